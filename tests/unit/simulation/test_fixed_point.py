"""Scenarios whose controller computes with whole numbers."""

import numpy as np
import pytest

from ppafo.control.fixed.whole_numbers import Converter, read
from ppafo.errors import ProgramError, ScenarioError
from ppafo.exports.c_library import c_library
from ppafo.exports.firmware import chip_controller
from ppafo.exports.firmware.lock_step import PythonChip
from ppafo.model.sensors import Measurement
from ppafo.running import simulate
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import load_scenario, scenario_from_dict

FIXED = "controller.arithmetic=fixed"


class InPython:
    """The integer controller as a Python object."""

    def __init__(self, chip: PythonChip, converter: Converter) -> None:
        self.chip = chip
        self.converter = converter

    def reset(self) -> None:
        self.chip.begin()

    def update(self, time: float, reference: float, measurement: Measurement) -> float:
        assert time >= 0.0
        return self.chip.sample(read(self.converter, reference, measurement))[0] / 1000


@pytest.mark.parametrize("name", ["torque-task-proportional", "torque-task-solenoid"])
def test_whole_numbers_cost_less_than_one_percent_in_both_torque_tasks(name: str) -> None:
    floats, fixed = (simulate(load_scenario(name, overrides)).metrics for overrides in ((), (FIXED,)))
    for metric in ("rms_error", "gas_supplied"):
        assert fixed[metric].value == pytest.approx(floats[metric].value, rel=0.01)


def test_the_lanes_decide_as_python_does() -> None:
    scenario = load_scenario("torque-task-proportional", (FIXED,))
    chip = chip_controller(scenario)
    mine = simulate(scenario.controlled_by(InPython(PythonChip(chip), chip.converter))).recording
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
        (("controller.converter_bits=9.5",), r"controller.converter_bits = 9.5: must be whole"),
        (("controller.converter_bits=15",), "must be at least 8 and at most 14"),
        (("controller.converter_range=0.4 MPa_a",), "reference: from 0 N m to 6 N m, and the converter shows"),
        (("controller.derivative_gain=20",), "a gain of 'pid' on whole numbers is .* times the largest"),
    ],
)
def test_what_whole_numbers_cannot_hold_is_refused(overrides: tuple[str, ...], said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        simulate(load_scenario("torque-task-proportional", (FIXED, *overrides)))


def test_a_converter_without_whole_numbers_is_refused() -> None:
    content = dict(load_scenario("torque-task-proportional").origin.content)
    content["controller"] = {**content["controller"], "converter_bits": 10}
    with pytest.raises(ScenarioError, match=r'controller.converter_bits = 10: needs controller.arithmetic = "fixed"'):
        scenario_from_dict(content)


def test_a_law_without_whole_numbers_has_no_arithmetic_to_choose() -> None:
    with pytest.raises(ScenarioError, match=r"no value 'controller.arithmetic'"):
        load_scenario("step-response", (FIXED,))
    assert not load_scenario("torque-task-proportional", (FIXED, "controller.kind=sliding_mode")).control.is_fixed


def test_whole_numbers_have_no_exported_library() -> None:
    with pytest.raises(ProgramError, match="no library yet; 'ppafo firmware' writes it"):
        c_library(load_scenario("torque-task-solenoid", (FIXED,)))
