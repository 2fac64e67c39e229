"""A vane displaces its torque constant per radian, unless a set or a setting states another displacement."""

import numpy as np
import pytest

from ppafo.parameters import load_device
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
