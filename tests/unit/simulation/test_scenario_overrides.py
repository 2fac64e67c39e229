"""Changing single values of a scenario and of its device by dotted path."""

import itertools
import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ppafo.errors import PpafoError, ScenarioError
from ppafo.loading import reloaded
from ppafo.simulation.declaration import OF_A_VANE
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.overrides import device_paths
from ppafo.simulation.scenario import FreeMotion, PrescribedMotion, ProfileChoice

TASK = "torque-task-proportional"


def problem_of(*overrides: str, kind: type[PpafoError] = ScenarioError) -> str:
    with pytest.raises(kind) as caught:
        load_scenario(TASK, overrides)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_values_of_scenario_and_device_are_changed_together() -> None:
    scenario = load_scenario(TASK, ["valve.area=12.6mm^2", "reference.level=5 N m", "motion.angle=80 deg"])
    assert scenario.device.valve.area == 12.6e-6
    assert scenario.reference.level == 5.0
    assert scenario.motion == PrescribedMotion(ProfileChoice("constant", {"level": math.radians(80.0)}), "locked")


def test_another_valve_is_chosen_and_then_changed() -> None:
    device = load_scenario(TASK, ["valve.opening_delay=3 ms", "device.valve=solenoid"]).device
    assert (device.valve.kind, device.valve.opening_delay) == ("solenoid", 0.003)


def test_another_kind_of_controller_drops_the_settings_of_the_old_one() -> None:
    scenario = load_scenario(TASK, ["controller.kind=on_off"])
    assert (scenario.controller.kind, scenario.controller.settings, scenario.controller.period) == ("on_off", {}, 0.001)
    assert not [item for item in scenario.assumptions if item.path.endswith("_gain")]


def test_another_kind_of_motion_keeps_what_both_have() -> None:
    assert load_scenario(TASK, ["motion.kind=free"]).motion == FreeMotion(math.radians(75.0))


def test_a_profile_can_be_built_from_nothing() -> None:
    overrides = ["motion.kind=prescribed", "motion.profile.kind=sine", "motion.profile.level=75 deg"]
    motion = load_scenario(TASK, [*overrides, "motion.profile.amplitude=5 deg"]).motion
    assert isinstance(motion, PrescribedMotion)
    assert motion.profile.amplitude == math.radians(5.0)


def test_a_period_takes_the_place_of_the_rate() -> None:
    scenario = load_scenario(TASK, ["controller.period=2 ms"])
    assert scenario.controller.period == 0.002
    assert "controller.rate" not in [item.path for item in scenario.assumptions]


def test_a_gain_may_leave_out_its_unit_as_the_paper_does() -> None:
    bare = load_scenario(TASK, ["controller.proportional_gain=0.1"]).controller
    assert bare == load_scenario(TASK, ["controller.proportional_gain=0.1 1/(N m)"]).controller
    assert bare.proportional_gain == 0.1


def test_a_gain_of_0_needs_no_unit_whatever_is_controlled() -> None:
    assert load_scenario("pressure-loop", ["controller.proportional_gain=0"]).controller.proportional_gain == 0.0
    with pytest.raises(ScenarioError, match="a unit like '1/Pa' is needed"):
        load_scenario("pressure-loop", ["controller.proportional_gain=1"])


PATHS = [*OF_A_VANE.paths(load_scenario(TASK).origin.content), *device_paths()]


@settings(max_examples=300)
@given(
    path=st.sampled_from(PATHS), text=st.one_of(st.text(max_size=20), st.sampled_from(["1 s", "1e300 N m", "0", "-1"]))
)
def test_any_override_text_is_taken_or_refused_cleanly(path: str, text: str) -> None:
    message = ""
    try:
        load_scenario(TASK, [f"{path}={text}"])
    except PpafoError as error:
        message = str(error)
    assert len(message.splitlines()) <= 1


@pytest.mark.parametrize(
    "words",
    [
        ["controller.kind=pid", "controller.integral_gain=1", "reference.kind=constant", "reference.level=2 N m"],
        [
            "motion.kind=prescribed",
            "motion.profile.kind=sine",
            "motion.profile.level=80 deg",
            "motion.profile.amplitude=5 deg",
            "motion.profile.frequency=1 Hz",
        ],
        [
            "gas_model.kind=thermal",
            "gas_model.heat_transfer_coefficient=50 W/(m^2 K)",
            "gas_model.wall_area_per_volume=9 1/m",
        ],
    ],
)
def test_a_setting_may_come_before_its_kind(words: list[str]) -> None:
    first, last = (load_scenario("step-response", order) for order in (words, words[::-1]))
    assert replace(last, origin=first.origin) == first


def test_a_value_of_a_valve_beside_the_choice_of_another_is_refused_with_both_in_any_order() -> None:
    words = ("device.valve=solenoid", "valves.proportional.area=5 mm^2")
    told = {problem_of(*order) for order in itertools.permutations(words)}
    assert len(told) == 1
    assert all(f"'{word}'" in next(iter(told)) for word in words)
    assert load_scenario(TASK, ["device.valve=solenoid", "valves.solenoid.area=5 mm^2"]).device.valve_name == "solenoid"


def test_the_choice_of_a_valve_drops_what_a_layer_below_gives_of_another() -> None:
    below = load_scenario(TASK, ["valves.proportional.area=5 mm^2", "run.duration=1 s"])
    chosen = reloaded(below, ["device.valve=solenoid"])
    assert chosen.origin.overrides == ("run.duration=1 s", "device.valve=solenoid")
    assert chosen.device == load_scenario(TASK, ["device.valve=solenoid"]).device
