"""Python objects as controllers where many runs are made: slow, one after the other, and with the same numbers."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import ppafo
from ppafo.errors import ScenarioError, SimulationError, StudyError
from ppafo.model.sensors import Measurement
from ppafo.progress import Progress
from ppafo.simulation.ensemble import COMPLETED, run_ensemble
from ppafo.simulation.scenario import PYTHON_CONTROLLER, Control

TASK = "torque-task-proportional"
SHORT = ("run.duration=0.2 s", "reference.ramp_time=0.1 s")
METRIC = ("rms_error",)


class Integral:
    """Proportional and integral action; counts how often it is reset."""

    def __init__(self, gain: float = 0.2) -> None:
        self.gain, self.sum, self.resets = gain, 0.0, 0

    def reset(self) -> None:
        self.sum = 0.0
        self.resets += 1

    def update(self, time: float, reference: float, measurement: Measurement) -> float:
        error = reference - measurement.torque
        self.sum += 0.001 * error
        return self.gain * error + 0.5 * self.sum


class Proportional(Integral):
    def update(self, time: float, reference: float, measurement: Measurement) -> float:
        return self.gain * (reference - measurement.torque)


def test_each_run_of_an_ensemble_gives_what_it_gives_alone_and_begins_afresh() -> None:
    mine = Integral()
    base = ppafo.load_scenario(TASK, SHORT).controlled_by(mine)
    pressures = np.array([3e5, 4e5, 5e5])
    found = run_ensemble(base, {"supply.pressure": pressures}, METRIC, ("command",), 0.05)
    assert mine.resets == 3
    assert (found.status == COMPLETED).all()
    for run, pressure in enumerate(pressures):
        scenario = ppafo.load_scenario(TASK, (*SHORT, f"supply.pressure={float(pressure)!r} Pa_a"))
        alone = ppafo.simulate(scenario.controlled_by(Integral()))
        assert found.metrics["rms_error"][run] == pytest.approx(alone.metrics["rms_error"].value, rel=1e-11)
        assert found.traces["command"][:, run] == pytest.approx(alone.recording["command"][::50], rel=1e-12)


def test_it_sees_the_same_late_and_noisy_signals_as_alone() -> None:
    base = ppafo.load_scenario("torque-task-slow-valve", SHORT)
    assert base.sensors.delay > 0.0
    assert base.sensors.pressure_noise > 0.0
    mine = base.controlled_by(Proportional())
    found = run_ensemble(mine, {"sensors.seed": np.array([1.0, 2.0])}, METRIC).metrics["rms_error"]
    for seed, error in enumerate(found, 1):
        alone = ppafo.simulate(replace(mine, sensors=replace(mine.sensors, seed=seed)))
        assert error == pytest.approx(alone.metrics["rms_error"].value, rel=1e-11)
    assert found[0] != found[1]


def test_it_is_compared_over_an_uncertain_device_with_progress_and_overrides() -> None:
    base, heard = ppafo.load_scenario(TASK, SHORT), list[Progress]()
    pair = {"mine": base.controlled_by(Integral(0.1)), "stronger": base.controlled_by(Integral(0.4))}
    level = ["reference.level=2 N m"]
    found = ppafo.compare(pair, study="torque-task-uncertainty", overrides=level, draws=64, progress=heard.append)
    done = [item.done for item in heard]
    # A slow machine reports between the blocks too.
    assert done == sorted(done)
    assert {32, 64, 96, 128} <= set(done)
    (cases,) = found.found.tasks.values()
    better = cases[1].pairs["rms_error"].better
    assert better is not None
    assert better.value == 1.0
    assert {case.scenario.reference.level for case in cases} == {2.0}
    with pytest.raises(StudyError, match=r"gain=1': scenario '.*' has a Python controller"):
        ppafo.compare(pair, overrides=["controller.proportional_gain=1"])


def test_a_command_that_is_no_number_names_the_object_and_a_valve_that_nothing_controls_is_refused() -> None:
    base = ppafo.load_scenario(TASK, SHORT)
    columns = {"supply.pressure": np.array([4e5])}
    with pytest.raises(SimulationError, match=r"Proportional.update returned nan at t = 0 s"):
        run_ensemble(base.controlled_by(Proportional(float("nan"))), columns, METRIC)
    with pytest.raises(ScenarioError, match="has no controller; give one"):
        run_ensemble(replace(base, controller=Control(PYTHON_CONTROLLER, {}, base.controller.period)), columns, METRIC)


@pytest.mark.parametrize("law", [Proportional, 1.0])
def test_what_cannot_control_a_valve_is_refused(law: Any) -> None:
    with pytest.raises(ScenarioError, match=r"no method 'reset'|is a class"):
        ppafo.load_scenario(TASK).controlled_by(law)
