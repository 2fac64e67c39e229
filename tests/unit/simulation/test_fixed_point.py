"""Scenarios whose controller computes with whole numbers."""

import numpy as np
import pytest

from ppafo.errors import ScenarioError
from ppafo.model.sensors import Measurement
from ppafo.processor.controller import FixedPointController, PythonProcessor, fixed_point_controller
from ppafo.processor.fixed_point import read
from ppafo.running import simulate
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import load_scenario

FIXED = "controller.kind=pid_fixed_point"


class InPython:
    """The integer controller as a Python object."""

    def __init__(self, fixed: FixedPointController) -> None:
        self.processor = PythonProcessor(fixed)
        self.fixed = fixed

    def reset(self) -> None:
        self.processor.begin()

    def update(self, time: float, reference: float, measurement: Measurement) -> float:
        assert time >= 0.0
        readings = read(self.fixed.steps, self.fixed.numbers.limits, reference, measurement)
        return self.processor.sample(readings)[0] / 1000


@pytest.mark.parametrize(
    ("name", "kind"), [("torque-task-proportional", "pid_fixed_point"), ("torque-task-solenoid", "on_off_fixed_point")]
)
def test_whole_numbers_cost_less_than_one_percent_in_both_torque_tasks(name: str, kind: str) -> None:
    overrides = (f"controller.kind={kind}",)
    floats, fixed = (simulate(load_scenario(name, given)).metrics for given in ((), overrides))
    for metric in ("rms_error", "gas_supplied"):
        assert fixed[metric].value == pytest.approx(floats[metric].value, rel=0.01)


def test_the_lanes_decide_as_python_does() -> None:
    scenario = load_scenario("torque-task-proportional", (FIXED,))
    fixed = fixed_point_controller(scenario)
    mine = simulate(scenario.controlled_by(InPython(fixed))).recording
    lanes = simulate(scenario).recording
    assert all(np.array_equal(mine[name], lanes[name]) for name in lanes.names)
    assert len(set(lanes["command"])) > 100


def test_fewer_bits_cost_more_and_can_be_a_column() -> None:
    scenario = load_scenario("torque-task-proportional", (FIXED,))
    found = run_ensemble(scenario, {"controller.converter_bits": np.array([8.0, 12.0])}, ["gas_supplied"])
    gas = found.metrics["gas_supplied"]
    assert gas[0] > 1.5 * gas[1]
    assert gas[1] == pytest.approx(simulate(scenario).metrics["gas_supplied"].value, rel=1.0e-9)


@pytest.mark.parametrize(
    ("overrides", "said"),
    [
        (("controller.converter_bits=9.5",), r"controller.converter_bits = 9.5: must be a whole number"),
        (("controller.converter_bits=15",), "must be at least 8 and at most 14"),
        (("controller.converter_range=0.4 MPa_a",), "reference: 0 N m to 6 N m exceeds the range of the converter"),
        (("controller.derivative_gain=20",), "a gain of 'pid_fixed_point' is .* times the largest"),
    ],
)
def test_what_whole_numbers_cannot_hold_is_refused(overrides: tuple[str, ...], said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        simulate(load_scenario("torque-task-proportional", (FIXED, *overrides)))
