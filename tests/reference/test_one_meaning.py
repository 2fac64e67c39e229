"""A setting means the same at every door: words of a user, drawn, against the single run with them."""

import ctypes
import shutil
from pathlib import Path

import pytest

from ppafo.loading import load_scenario
from ppafo.page.workbench import _settings as page_settings
from ppafo.simulation import numbers
from ppafo.simulation.loading import list_scenarios
from ppafo.walking import list_walks
from scripts.one_meaning import OTHER_PROGRAM, BuiltLibrary, at_library, at_study
from scripts.typed_words import single

needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")


@pytest.mark.parametrize("name", [*list_scenarios(), *list_walks()])
def test_columns_of_a_study_are_single_runs_with_the_same_words(name: str) -> None:
    found = at_study(name, 12, seed=11)
    assert found.differing == []
    assert found.same >= 4


@needs_gcc
@pytest.mark.parametrize("name", ["torque-task-slow-valve", "proportional-regulators", "swing-foot-angle"])
def test_settings_of_a_library_are_single_runs_with_the_same_words_or_refused_by_both(name: str) -> None:
    found = at_library(name, 24, seed=15)
    assert found.differing == []
    assert found.same > 8
    assert found.refused > 0


@needs_gcc
@pytest.mark.parametrize("name", [*list_scenarios(), *list_walks()])
def test_a_slider_of_a_page_moves_over_values_that_its_program_runs(name: str, tmp_path: Path) -> None:
    scenario = load_scenario(name)
    built = BuiltLibrary(scenario, tmp_path)
    room = scenario.device.supply.atmospheric_pressure
    dead = {}
    for one in page_settings(scenario, built.library, ()):
        # What a browser lets a slider have is a whole number of steps above its lower end.
        shown = {
            one["from"] + one["step"] * (place * ((one["to"] - one["from"]) / one["step"]) // 19) for place in range(20)
        }
        zero = float(one["offset"]) + room * one["gauge"]
        given = [float(f"{zero + float(one['scale']) * position:.12g}") for position in shown if not one["hidden"]]
        found = [built.planned(built.changed({one["path"]: number}), "no run") for number in given]
        dead |= {one["path"]: found} if found.count(OTHER_PROGRAM) > len(found) / 4 else {}
    assert dead == {}


@needs_gcc
@pytest.mark.parametrize(
    ("name", "number", "text", "named"),
    [
        ("pressure-loop", ("reference.start_level", 87983.2), "[reference] leaves the range", "reference_level"),
        ("torque-task-moving-ankle", ("motion.profile.level", 0.0), "leaves the stops", "motion_profile_level"),
        ("swing-foot-angle", ("reference.value_20", 20.0), "[reference] leaves the stops", "reference_level"),
        ("swing-foot-angle", ("reference.time_14", 0.7), "time_15 = 0.2771 s: must be later", "reference_time_15"),
        ("proportional", ("controller.first_stride_time", 0.39), "half and twice", "controller_first_stride_time"),
        (
            "cylinder-servo",
            ("actuator.lever_offset", -3.0),
            "the angle between lever and base",
            "actuator_lever_offset",
        ),
        ("solenoid", ("actuator.angle_max", 1.7), "the gait needs", "actuator_angle_max"),
    ],
)
def test_a_rule_on_profiles_gait_and_actuator_holds_in_a_library_as_in_a_file(
    tmp_path: Path, name: str, number: tuple[str, float], text: str, named: str
) -> None:
    built = BuiltLibrary(load_scenario(name), tmp_path)
    path, value = number
    (unit,) = (setting.quantity.unit for setting in built.library.settings if setting.path == path)
    refusal = single(name, {path: f"{value!r} {unit}"})
    assert isinstance(refusal, str)
    assert text in refusal
    settings = built.changed({path: value})
    assert built.wrong_setting(settings.ctypes.data_as(ctypes.c_void_p)) == named.encode()


def test_a_door_at_which_nothing_follows_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numbers, "resolved", lambda _, replaced, *__: dict(replaced))
    # Which paths a seed draws depends on the numbers that there are; most draws have none that others follow.
    assert any(len(at_study("torque-task-solenoid", 60, seed=seed).differing) > 5 for seed in range(12, 32))
