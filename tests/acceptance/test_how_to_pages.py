"""What the how-to pages on scenarios and extensions show is run as it stands there."""

import dataclasses
import importlib
import math
import re
import sys
import tomllib
from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import ppafo
from ppafo.control.catalog import CONTROLLERS
from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.model.catalog import ACTUATORS, VALVES
from ppafo.model.sensors import Measurement
from ppafo.model.valves.kind import VENT
from ppafo.parameters.building import build_device
from ppafo.parameters.declaration import OF_SECOND_CHAMBER
from ppafo.parameters.device import Valve
from ppafo.parameters.loading import parse_parameter_set
from ppafo.simulation.loading import scenario_from_dict
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import PrescribedMotion
from tests.page_code import block_with, code_blocks, write_package
from tests.reference.reference_solver import compare_with_reference
from tests.scenario_text import parse_scenario

MEASURED = Path(__file__).parents[1] / "actuators"
MUSCLES = Path(__file__).parents[2] / "src" / "ppafo" / "examples" / "add-an-actuator"


def blocks(page: str, language: str) -> list[str]:
    """The code blocks of a how-to page in one language."""
    return code_blocks(f"how-to/{page}", language)


def extension(words: str) -> str:
    """The code block of the page on extensions that has some words."""
    return block_with("how-to/extend.md", words)


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., ModuleType]]:
    """Installs the module of a page as a package offers it, and imports it; forgotten at the end of the test."""
    catalogues = [(kinds, set(kinds)) for kinds in (CONTROLLERS, WALKING_CONTROLLERS, VALVES, ACTUATORS)]
    packages: set[str] = set()

    def installed(module: str, text: str, entry_points: str) -> ModuleType:
        write_package(tmp_path, module, text, entry_points)
        monkeypatch.syspath_prepend(tmp_path)
        packages.add(module.partition(".")[0])
        return importlib.import_module(module)

    yield installed
    for kinds, names in catalogues:
        for name in set(kinds) - names:
            del kinds[name]
    for name in [name for name in sys.modules if name.split(".")[0] in packages]:
        del sys.modules[name]


@pytest.fixture
def hysteresis(install: Callable[..., ModuleType]) -> ModuleType:
    """The controller of the page, installed for the length of a test."""
    return install("my_laws.hysteresis", extension("KIND = ControllerKind"), extension("ppafo.controllers"))


def test_the_scenario_of_the_page_loads_and_says_what_the_page_says() -> None:
    scenario = parse_scenario(blocks("write-a-scenario.md", "toml")[0].encode(), "stairs.toml")
    assert scenario.name == "stairs"
    assert isinstance(scenario.motion, PrescribedMotion)
    assert (scenario.run.step, scenario.run.output_interval, scenario.controller.period) == (0.001, 0.002, 0.002)
    assert [item.path for item in scenario.assumptions] == ["motion.profile.level"]


def test_the_python_of_the_scenario_page_runs(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, Any] = {}
    for block in blocks("write-a-scenario.md", "python"):
        exec(block, names)
    assert capsys.readouterr().out == "3.0 0.25\n"


def test_the_python_controller_of_the_page_controls(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, Any] = {}
    exec(extension("class Cautious"), names)
    assert capsys.readouterr().out.startswith("completed ")
    command = names["result"].recording["command"]
    assert command.max() > 0.05
    assert abs(command[1:] - command[:-1]).max() <= 0.1 + 1e-12
    exec(extension("pair = {"), names)
    assert capsys.readouterr().out == "64\n"


HOLDS = (0.0, 0.0, 0.0, 0.0)
FILLS_1 = (1.0, 0.0, 0.0, 1.0)
FILLS_2 = (0.0, 1.0, 1.0, 0.0)
VENTS = (0.0, 1.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("kind", "command", "expected"),
    [
        ("proportional", 0.0, HOLDS),
        ("proportional", 1.0, FILLS_1),
        ("proportional", 0.25, (0.25, 0.0, 0.0, 0.25)),
        ("proportional", -1.0, FILLS_2),
        ("solenoid", 0.0, VENTS),
        ("solenoid", 0.25, FILLS_1),
        ("solenoid", -0.25, FILLS_2),
        ("solenoid", VENT, VENTS),
    ],
)
def test_a_valve_does_with_a_command_what_the_page_says(kind: str, command: float, expected: tuple[float, ...]) -> None:
    settings = VALVES[kind].settings(*(item.default or 0.0 for item in VALVES[kind].quantities))
    model = VALVES[kind].choose(settings)
    valve = model.prepare(settings)
    state = model.settle(valve, model.state(), command, 0.0)
    assert tuple(model.instant(valve, state, command)) == pytest.approx(expected)


def test_the_controller_of_the_page_keeps_its_command_inside_the_band(hysteresis: ModuleType) -> None:
    parameters = hysteresis.HysteresisParameters(0.3)
    state = hysteresis.HysteresisState(1.0)
    inside = Measurement(1.3, 1e5, 1e5, 2.2)
    above = Measurement(1.3, 1e5, 1e5, 2.4)
    assert hysteresis.update(parameters, state, 2.0, inside, 1e-3)[0] == 1.0
    assert hysteresis.update(parameters, state, 2.0, above, 1e-3)[0] == -1.0


@pytest.fixture
def three_position(install: Callable[..., ModuleType]) -> ModuleType:
    """The valve of the page, installed for the length of a test."""
    return install("my_valves.three_position", extension("KIND = ValveKind"), extension("ppafo.valves"))


@pytest.mark.usefixtures("three_position")
def test_the_parameter_set_of_the_page_has_its_valve() -> None:
    shipped = (files("ppafo.parameters") / "sets" / "ppafo2011.toml").read_text(encoding="utf-8")
    valve = extension("[valves.main]")
    for kind in ("three_position", "my_valves.three_position:KIND"):
        text = shipped + "\n" + valve.replace('"three_position"', f'"{kind}"')
        device = build_device(parse_parameter_set(text.encode(), "mine.toml"), "main")
        assert device.valve.kind == kind
        assert device.valve.settings == {"threshold": 0.3}


@pytest.mark.usefixtures("three_position")
def test_the_valve_of_the_page_agrees_with_the_reference_solver() -> None:
    task = ppafo.load_scenario("torque-task-solenoid", ["run.duration=0.3 s", "motion.kind=free"])
    valve = Valve("three_position", task.device.valve.orifice, {"threshold": 0.5})
    scenario = dataclasses.replace(task, device=dataclasses.replace(task.device, valve=valve))
    agreement = compare_with_reference(plan_run(scenario))
    assert agreement.angle < 2e-4
    assert agreement.worst_pressure < 1e-3


@pytest.fixture
def elbow(tmp_path: Path) -> Path:
    """The set of the page: the shipped cylinder with the section of the page in the place of its actuator.

    The values of the second chamber are left out.
    """
    shipped = (files("ppafo.parameters") / "sets" / "cylinder-lever.toml").read_text(encoding="utf-8")
    before = shipped.index("[actuator]")
    after = shipped.index("[actuator.angle_min]")
    sections = re.split(r"^(?=\[)", shipped[after:], flags=re.MULTILINE)
    kept = "".join(text for text in sections if text[1:].partition("]")[0] not in OF_SECOND_CHAMBER)
    (tmp_path / "mine.toml").write_text(shipped[:before] + extension('kind = "table"') + "\n" + kept, encoding="utf-8")
    (tmp_path / "measured-bladder.csv").write_bytes((MEASURED / "measured-bladder.csv").read_bytes())
    return tmp_path / "mine.toml"


WITHIN = ("actuator.angle_max=110 deg", "supply.pressure=60 kPa_g")
"""What keeps the elbow within the table."""


def test_the_elbow_ends_where_the_page_says(elbow: Path) -> None:
    page = (Path(ppafo.__file__).parents[2] / "docs" / "how-to" / "control-an-angle.md").read_text(encoding="utf-8")
    written = tomllib.loads(block_with("how-to/control-an-angle.md", 'kind = "cascade"'))
    content = {
        "schema_version": 1,
        "name": "elbow-servo",
        "device": {"set": str(elbow), "overrides": list(WITHIN)},
        "run": {"duration": "4 s", "output_interval": "2 ms"},
        "motion": {"kind": "free", "angle": "40 deg"},
        **written,
    }
    levels = ["reference.start_level=40 deg", "reference.level=70 deg"]
    result = ppafo.simulate(scenario_from_dict(content, levels))
    left = abs(math.degrees(result.metrics["final_angle_error"].value))
    assert left < math.degrees(result.scenario.controller.settings["tolerance"])
    assert f"ends {left:.2g} deg away, within its tolerance" in page


@pytest.fixture
def muscles(install: Callable[..., ModuleType]) -> ModuleType:
    """The actuator of the example, offered as the page says, for the length of a test."""
    module = (MUSCLES / "my_actuators" / "muscle_pair.py").read_text(encoding="utf-8")
    return install("my_actuators.muscle_pair", module, extension("ppafo.actuators"))


@pytest.mark.usefixtures("muscles")
def test_the_actuator_of_the_page_pulls_as_its_catalogue_prints_by_entry_point_and_by_name_of_its_object() -> None:
    shipped = (MUSCLES / "muscle-pair.toml").read_text(encoding="utf-8")
    for kind in ("muscle_pair", "my_actuators.muscle_pair:KIND"):
        text = shipped.replace('kind = "muscle_pair"', f'kind = "{kind}"')
        actuator = build_device(parse_parameter_set(text.encode(), "mine.toml")).actuator
        assert actuator.kind == kind
        thread = actuator.thread_length
        turns = actuator.turns
        # Chou and Hannaford, F = p b^2 (3 cos^2 - 1)/(4 pi n^2), at the nominal length; 40 mm has four times the area.
        cosine = 0.2 / thread
        force = 6.0e5 * thread**2 * (3.0 * cosine**2 - 1.0) / (4.0 * math.pi * turns**2)
        assert 4.0 * force == pytest.approx(6000.0, rel=0.01)
