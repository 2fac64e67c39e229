"""Functions of the model run by Python as a program has them, those of other modules among them; over samples, too."""

import math

import numpy as np
import pytest

from ppafo.engine.in_python import in_program, over_samples, over_samples_in
from ppafo.model.plant import Openings, PlantParameters, blended_ports
from ppafo.model.ports import load_torque
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run

OPEN = Openings(source_1=1.0, vent_1=0.0, source_2=0.0, vent_2=1.0)


def fed_by(plant: PlantParameters, openings: Openings) -> float:
    """A function of somebody's own module, which calls one of the model that has a port in it."""
    return blended_ports(plant, openings)[0].source_conductance


def root_over(value: float, other: float) -> float:
    """What Python refuses for some numbers."""
    return math.sqrt(value) / other


def test_an_effect_acts_in_a_function_of_another_module() -> None:
    texts = ["effects.line_resistance.area=2 mm^2", "effects.line_resistance.discharge_coefficient=0.8"]
    run = plan_run(load_scenario("step-response", texts))
    plain = fed_by(run.plant, OPEN)
    assert 0.0 < in_program(fed_by, run.program, run.effects)({}, run.plant, OPEN) < 0.9 * plain


def test_a_function_over_samples_has_the_effects_and_their_numbers() -> None:
    run = plan_run(load_scenario("step-response", ["effects.joint_load.drag=0.05 N m s^2/rad^2"]))
    rates = np.array([-2.0, 0.0, 3.0])
    taken = over_samples_in(run.program, run.effects, load_torque, {}, 0.0, 1.0, rates)
    assert taken == pytest.approx(0.05 * rates * np.abs(rates), rel=1e-15)


def test_what_python_refuses_goes_on_as_compiled_code_does() -> None:
    found = over_samples(root_over, np.array([4.0, -1.0, 1.0]), np.array([2.0, 1.0, 0.0]))
    assert np.array_equal(found, [1.0, math.nan, math.inf], equal_nan=True)
