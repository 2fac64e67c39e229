"""What the how-to pages on scenarios, controllers and valves show is run as it stands there."""

import dataclasses
import importlib.util
import re
import shlex
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import ppafo
from ppafo.cli.main import main
from ppafo.control import controllers
from ppafo.control.catalog import CONTROLLERS
from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.engine.reference.agreement import compare_with_reference
from ppafo.model.command import VENT
from ppafo.model.sensors import Measurement
from ppafo.model.valves.catalog import VALVES
from ppafo.parameters.device import Valve
from ppafo.simulation.loading import parse_scenario, scenario_from_dict
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import LedMotion
from ppafo.simulation.schema import scenario_file
from ppafo.walking.schema import walk_file

PAGES = Path(__file__).parents[2] / "docs" / "how-to"


def blocks(page: str, language: str) -> list[str]:
    """The code blocks of a page in one language, without their indentation."""
    found = re.findall(rf"^( *)```{language}\n(.*?)^\1```", (PAGES / page).read_text(), re.DOTALL | re.MULTILINE)
    return [textwrap.dedent(text) for _, text in found]


def module_of(text: str, name: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The module that a page tells to write, imported from a file as a real one is."""
    file = folder / f"{name}.py"
    file.write_text(text)
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, name, module)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def hysteresis(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """The controller of the page, in the catalogue for the length of a test."""
    text = blocks("add-a-controller.md", "python")[1]
    module = module_of(text, "hysteresis", tmp_path, monkeypatch)
    monkeypatch.setitem(CONTROLLERS, module.KIND.name, module.KIND)
    scenario_file.cache_clear()
    yield module
    scenario_file.cache_clear()


def test_the_scenario_of_the_page_loads_and_says_what_the_page_says() -> None:
    scenario = parse_scenario(blocks("write-a-scenario.md", "toml")[0].encode(), "stairs.toml")
    assert scenario.name == "stairs"
    assert isinstance(scenario.motion, LedMotion)
    assert (scenario.time_step, scenario.output_interval, scenario.control.period) == (0.001, 0.002, 0.002)
    assert [item.path for item in scenario.assumptions] == ["motion.profile.level"]


def test_the_python_of_the_scenario_page_runs(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, Any] = {}
    for block in blocks("write-a-scenario.md", "python"):
        exec(block, names)
    assert capsys.readouterr().out == "3.0 0.25\n"
    assert [scenario.name for scenario in names["levels"]] == ["short-test"] * 3


def test_the_overrides_of_the_scenario_page_are_taken() -> None:
    command = blocks("write-a-scenario.md", "sh")[0].replace('"', "")
    overrides = re.findall(r"--set (.+?)(?= --set|$)", command.strip())
    scenario = parse_scenario(blocks("write-a-scenario.md", "toml")[0].encode(), "stairs.toml", overrides)
    assert len(overrides) == 3
    assert scenario.reference.settings["level"] == 5.0
    assert scenario.device.valve_name == "solenoid"


def test_the_check_of_the_scenario_page_finds_what_the_page_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    words = shlex.split(blocks("write-a-scenario.md", "sh")[1].replace("\\\n", " "))
    assert main(words[1:]) == 1
    printed = capsys.readouterr().out
    (shown,) = blocks("write-a-scenario.md", "text")
    tables = [text[text.index("Check of") :].split("\n\n")[0].splitlines() for text in (printed, shown)]
    names, shown_names = ([line.split("  ")[0] for line in table] for table in tables)
    assert names == shown_names
    assert {"rms_error", "angle over time"} <= set(names)
    cause = "a measurement moved by 1e-07 of its range, which nobody could measure"
    assert cause in " ".join(shown.split())
    assert cause in printed


def test_the_message_on_the_scenario_page_is_the_real_one() -> None:
    text = (PAGES / "write-a-scenario.md").read_text()
    shown = re.findall(r"`stairs\.toml: (.+?)`", text)
    with pytest.raises(ppafo.ScenarioError) as caught:
        ppafo.load_scenario("torque-task-proportional", ["motion.angel=75 deg"])
    assert "did you mean 'motion.angle'" in str(caught.value)
    held = 'schema_version = 1\nname = "a"\ndevice.set = "ppafo2011"\nrun.duration = "1 s"\n'
    held += 'controller = { kind = "on_off", rate = "20 Hz" }\nmotion = { kind = "held", angle = "75 deg", angel = 1 }'
    with pytest.raises(ppafo.ScenarioError) as caught:
        parse_scenario(held.encode(), "stairs.toml")
    assert str(caught.value) == f"stairs.toml: {shown[0]}"


def test_the_python_controller_of_the_page_controls(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, Any] = {}
    exec(blocks("add-a-controller.md", "python")[0], names)
    assert capsys.readouterr().out.startswith("completed ")
    command = names["result"].recording["command"]
    assert command.max() > 0.05
    assert abs(command[1:] - command[:-1]).max() <= 0.1 + 1e-12


def test_the_controller_of_the_page_keeps_its_command_inside_the_band(hysteresis: ModuleType) -> None:
    parameters, state = hysteresis.HysteresisParameters(0.3), hysteresis.HysteresisState(1.0)
    inside, above = Measurement(1.3, 1e5, 1e5, 2.2), Measurement(1.3, 1e5, 1e5, 2.4)
    assert hysteresis.update(parameters, state, 2.0, inside, 1e-3)[0] == 1.0
    assert hysteresis.update(parameters, state, 2.0, above, 1e-3)[0] == -1.0


def test_the_controller_of_the_page_is_compiled_and_named_in_a_scenario(hysteresis: ModuleType) -> None:
    content = {
        "schema_version": 1,
        "name": "band",
        "device": {"set": "ppafo2011"},
        "run": {"duration": "0.5 s"},
        "motion": {"kind": "held", "angle": "75 deg"},
        "controller": {"kind": "hysteresis", "rate": "200 Hz", "band": "0.3 N m"},
        "reference": {"kind": "constant", "level": "2 N m"},
    }
    assert 'kind = "hysteresis"' in blocks("add-a-controller.md", "toml")[0]
    wide = ppafo.simulate(scenario_from_dict(content, ["controller.band=1 N m"]))
    narrow = ppafo.simulate(scenario_from_dict(content))
    assert hysteresis.KIND.name == narrow.scenario.control.kind
    assert 1 <= wide.metrics["switchings"].value < narrow.metrics["switchings"].value


def test_the_controller_of_the_page_walks(
    hysteresis: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "ppafo.control.controllers.hysteresis", hysteresis)
    monkeypatch.setattr(controllers, "hysteresis", hysteresis, raising=False)
    text = blocks("add-a-controller.md", "python")[2]
    module = module_of(text, "event_hysteresis", tmp_path, monkeypatch)
    monkeypatch.setitem(WALKING_CONTROLLERS, module.KIND.name, module.KIND)
    walk_file.cache_clear()
    try:
        walked = ppafo.walk("proportional", 0.1, ["controller.kind=event_hysteresis", "controller.band=0.5 N m"])
    finally:
        walk_file.cache_clear()
    assert walked.status.is_completed
    assert "safe_state_time" not in walked.metrics
    assert walked.metrics["push_off_work"].value > 0.5
    command = walked.recording["command"]
    assert set(command.round(12)) <= {-1.0, 0.0, 1.0, VENT}


def test_the_valve_of_the_page_agrees_with_the_reference_solver(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = module_of(blocks("add-a-valve.md", "python")[0], "three_position", tmp_path, monkeypatch)
    monkeypatch.setitem(VALVES, module.KIND.name, module.KIND)
    task = ppafo.load_scenario("torque-task-solenoid", ["run.duration=0.3 s", "motion.kind=free"])
    valve = Valve("three_position", task.device.valve.orifice, {"threshold": 0.5})
    scenario = dataclasses.replace(task, device=dataclasses.replace(task.device, valve=valve))
    agreement = compare_with_reference(plan_run(scenario))
    assert agreement.angle < 2e-4
    assert agreement.worst_pressure < 1e-3
