import pytest

from ppafo.errors import IdentificationError
from ppafo.identification.trajectory.experiment import (
    TIME_OFFSET,
    broken_rule,
    declaration_of,
    declared_numbers,
    full_path,
    number_at,
    with_numbers,
)
from ppafo.simulation.scenario import Scenario

_SECOND = ("supply.dorsiflexion_pressure", "initial.pressure_2")
FOLLOWERS = {
    "supply.pressure": _SECOND,
    "supply.dorsiflexion_pressure": ("initial.pressure_2",),
    "supply.atmospheric_pressure": ("supply.pressure", *_SECOND, "initial.pressure_1"),
}
"""One pressure is that of both regulators, gauge ones count from the atmosphere, and chambers begin at a word."""


def test_every_declared_number_can_be_read_and_replaced(step: Scenario) -> None:
    paths = [path for path in declared_numbers(step) if path != TIME_OFFSET]
    assert len(paths) > 30
    for path in paths:
        changed = with_numbers(step, {path: number_at(step, path) + 0.125})
        assert number_at(changed, path) == number_at(step, path) + 0.125
        others = [other for other in paths if number_at(changed, other) != number_at(step, other)]
        assert others == [other for other in paths if other == path or other in FOLLOWERS.get(path, ())]


def test_a_time_offset_belongs_to_the_recording_and_leaves_the_scenario_alone(step: Scenario) -> None:
    assert number_at(step, TIME_OFFSET) == 0.0
    assert with_numbers(step, {TIME_OFFSET: 0.01}) is step


def test_the_scenario_itself_is_left_as_it_was(step: Scenario) -> None:
    before = number_at(step, "valve.dead_band")
    with_numbers(step, {"valves.proportional.dead_band": 0.25})
    assert number_at(step, "valve.dead_band") == before


def test_the_chosen_valve_has_the_path_that_a_parameter_set_has(step: Scenario) -> None:
    assert full_path("valve.area", step) == "valves.proportional.area"
    assert number_at(step, "valve.area") == number_at(step, "valves.proportional.area") == pytest.approx(31.6e-6)


def test_a_misspelt_path_is_answered_with_the_nearest_one(step: Scenario) -> None:
    with pytest.raises(IdentificationError, match=r"did you mean 'friction\.viscous_damping'"):
        declaration_of("friction.viscous_dampening", step)


def test_dynamic_friction_above_static_friction_is_named(step: Scenario) -> None:
    assert broken_rule(step.device) == ""
    above = with_numbers(step, {"friction.dynamic_torque": 0.5})
    assert "friction.dynamic_torque" in broken_rule(above.device)
