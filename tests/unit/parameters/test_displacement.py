"""A vane displaces its torque constant per radian, unless a set or a setting states another displacement."""

import numpy as np
import pytest

from ppafo.analyses.sets.values import values_document
from ppafo.parameters import apply_overrides, load_device, load_parameter_set
from ppafo.parameters.audit.changes import changes
from ppafo.parameters.parameter_set import with_followers
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.numbers import with_numbers

CONSTANT, DISPLACEMENT = "actuator.torque_constant", "actuator.displacement_per_radian"


def test_an_override_of_the_torque_constant_moves_the_displacement_and_one_of_the_displacement_stays_alone() -> None:
    moved = load_device("ppafo2011", overrides=(f"{CONSTANT}=20 cm^3",)).actuator
    assert moved.torque_constant == moved.displacement_per_radian == 2.0e-5
    apart = load_device("ppafo2011", overrides=(f"{DISPLACEMENT}=23.5 cm^3/rad", f"{CONSTANT}=20 cm^3")).actuator
    assert (apart.torque_constant, apart.displacement_per_radian) == (2.0e-5, 2.35e-5)


def test_a_column_of_a_study_moves_the_displacement_too() -> None:
    scenario = load_scenario("torque-task-proportional")
    varied = with_numbers(scenario, {CONSTANT: np.array([1.0e-5, 2.0e-5])})
    assert np.array_equal(varied.device.actuator.displacement_per_radian, [1.0e-5, 2.0e-5])
    stated = load_scenario("torque-task-proportional", [f"{DISPLACEMENT}=23.5 cm^3/rad"])
    varied = with_numbers(stated, {CONSTANT: np.array([1.0e-5, 2.0e-5])})
    assert varied.device.actuator.displacement_per_radian == 2.35e-5


@pytest.mark.parametrize("unit", ["cm^3", "m^3", "N m/psi", "in^3"])
def test_the_displacement_is_the_torque_constant_to_the_last_bit_in_any_unit(unit: str) -> None:
    actuator = load_device("ppafo2011", overrides=(f"{CONSTANT}=0.1234 {unit}",)).actuator
    assert actuator.displacement_per_radian == actuator.torque_constant


def test_a_set_shows_what_follows_and_an_override_says_what_it_replaces() -> None:
    chosen = load_parameter_set("ppafo2011")
    assert DISPLACEMENT not in chosen.numbers
    shown = {value["path"]: value for value in values_document(chosen)["values"]}[DISPLACEMENT]
    assert (shown["value"], shown["unit"], shown["note"]) == (1.451e-5, "m^3/rad", f"follows {CONSTANT}")
    stated = apply_overrides(chosen, [f"{DISPLACEMENT}=23.5 cm^3/rad"])
    assert "the set has 1.451e-05 m^3/rad" in stated.numbers[DISPLACEMENT].note
    assert [change.path for change in changes(stated, chosen)] == [DISPLACEMENT]


def test_an_actuator_of_another_kind_has_no_displacement_of_a_vane() -> None:
    assert DISPLACEMENT not in with_followers(load_parameter_set("cylinder-lever")).numbers
