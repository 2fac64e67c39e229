"""A WebAssembly module under node gives what Python gives: every sample of every channel to the last bit."""

import json
import shutil
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from ppafo.exports.c_library import library_of
from ppafo.loading import load_scenario
from ppafo.page import wasm
from ppafo.page.wasm import module_of
from ppafo.running import simulate
from ppafo.simulation.loading import list_scenarios
from ppafo.simulation.numbers import with_numbers
from ppafo.walking import list_walks, load_walk
from tests.modules_under_node import DIVERGED, assert_alike, assert_same, compared, drawn, drawn_walks, driven

DRAWS, WALKS = 5, 2
MOVED = (
    *("valve.area=20 mm^2", "run.step=0.5 ms", "run.duration=2 s", "controller.period=2 ms", "motion.angle=80 deg"),
    "sensors.seed=3",
)
needs_node = pytest.mark.skipif(shutil.which("node") is None, reason="no node on this machine")


@needs_node
@pytest.mark.parametrize("name", list_scenarios())
def test_a_module_gives_the_bits_of_python(name: str) -> None:
    module = module_of(load_scenario(name))
    ended = Counter(compared(name, module, drawn(module, DRAWS)))
    assert ended["completed"] >= 0.8 * DRAWS


@needs_node
@pytest.mark.long
@pytest.mark.parametrize("name", list_walks())
def test_a_module_gives_the_bits_of_a_walk_in_python(name: str) -> None:
    module = module_of(load_walk(name))
    ended = Counter(compared(name, module, drawn_walks(module, WALKS)))
    assert ended["completed"] >= 0.5 * WALKS


@needs_node
def test_a_run_that_diverges_is_kept_up_to_there() -> None:
    scenario = load_scenario("torque-task-moving-ankle")
    module = module_of(scenario)
    settings = drawn(module, 1)
    column = [item["key"] for item in module.description["settings"]].index("motion.profile.amplitude")
    settings[0, column] *= 20.0
    given = driven(module, settings)
    assert_alike(given)
    result = simulate(with_numbers(scenario, {"motion.profile.amplitude": float(settings[0, column])}))
    assert not result.status.is_completed
    assert given.runs[0].status == DIVERGED
    assert_same(module, given.runs[0], result)


@needs_node
def test_what_would_need_another_program_is_said_and_refused() -> None:
    module = module_of(load_scenario("torque-task-solenoid"))
    kept = {item["key"]: item["kept"] for item in module.description["settings"] if item["kept"]}
    assert kept["valve.switching_interval"] == "above zero"
    assert kept["sensors.pressure_noise"] == "zero"
    keys = [item["key"] for item in module.description["settings"]]
    settings = np.tile(drawn(module, 1)[0], (len(kept), 1))
    for row, (key, how) in zip(settings, kept.items(), strict=True):
        row[keys.index(key)] = 0.01 if how == "zero" else 0.0
    named = [keys[ran.checked - len(keys)] for ran in driven(module, settings).runs]
    assert named == list(kept), "each by its name"


def test_a_program_stays_good_where_its_functions_move_in_python_and_not_where_they_change() -> None:
    library = library_of(load_scenario("step-response"))
    text = wasm.source_of(library, wasm.compose(library))
    moved = text.replace("model_orifice_", "model_flow_of_orifices_")
    assert moved != text
    assert wasm.digest_of(moved) == wasm.digest_of(text)
    assert wasm.digest_of(text.replace("1.0 - ", "1.0 + ", 1)) != wasm.digest_of(text)


def test_other_numbers_need_no_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wasm, "build", lambda _text: pytest.fail("it was built"))
    plain = module_of(load_scenario("torque-task-proportional"))
    changed = module_of(load_scenario("torque-task-proportional", MOVED))
    assert changed.wasm == plain.wasm
    assert {item["key"] for item in changed.description["settings"] if item["origin"] == "changed"} == {
        "valve.area",
        "run.step",
        "run.duration",
        "controller.period",
        "motion.angle",
        "sensors.seed",
    }


def as_it_is(number: float) -> float:
    """Stands for another function of the preparation."""
    return number


@pytest.mark.parametrize(
    ("place", "value"),
    [
        ("ppafo.engine.scheme.pneumatics.GAMMA", 0.3),
        ("ppafo.simulation.plan.rounded_up", as_it_is),
    ],
)
def test_changed_physics_never_takes_a_program_of_the_package(
    place: str, value: object, fresh_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = load_scenario("torque-task-proportional")
    shipped = module_of(scenario).wasm
    monkeypatch.setattr(wasm, "check_can_build", lambda: None)
    monkeypatch.setattr(wasm, "build", lambda text: f"built of {wasm.digest_of(text)}".encode())
    with monkeypatch.context() as patch:
        patch.setattr(place, value)
        assert module_of(scenario).wasm.startswith(b"built of ")
    assert module_of(scenario).wasm == shipped


def test_a_description_says_of_each_setting_where_it_comes_from() -> None:
    description = module_of(load_scenario("step-response")).description
    assert json.loads(json.dumps(description)) == description
    settings = {item["key"]: item for item in description["settings"]}
    assert settings["valve.area"]["origin"] == "published"
    assert settings["valve.area"]["source"]
    assert settings["supply.pressure"]["origin"] == "task"
    assert settings["supply.pressure"]["display"] == {"unit": "psi_g", "factor": 6894.757293168361, "zero": 101325.0}
    assert settings["supply.dorsiflexion_pressure"]["follows"] == "supply.pressure"
    assert settings["initial.pressure_2"]["follows"] == "supply.dorsiflexion_pressure"
    assert settings["run.duration"]["origin"] == "assumed"
    assert "figure 7" in settings["run.duration"]["note"]
    assert settings["sensors.delay"]["origin"] == "default"
    units = {item["name"]: item["display"]["unit"] for item in description["channels"]}
    assert units["angle"] == "deg"
    assert units["mass_1"] == "g"
