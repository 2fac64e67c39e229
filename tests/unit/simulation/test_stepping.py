"""Runs stepped from outside: the bits of ``simulate``, refused commands, and the end of a run."""

import math
from typing import Any

import numpy as np
import pytest

import ppafo
from ppafo.running import SteppedRun

SHORT = {"run.duration": "0.1 s"}
CASES: dict[str, dict[str, Any]] = {
    "torque-task-proportional": SHORT,
    "torque-task-slow-valve": SHORT,
    "step-response": {"motion.kind": "free", "sensors.delay": "1.3 ms", "sensors.pressure_noise": "0.1 psi_d"},
    "solenoid": {"run.duration": "6 s"},
}


def replayed(name: str, overrides: dict[str, Any], recorded: ppafo.Result) -> SteppedRun:
    """A run that has been given the recorded command of every sample."""
    run = ppafo.start(name, overrides)
    while not run.is_over:
        run.step(recorded["command"][np.searchsorted(recorded.recording.time, run.time - 1e-9)])
    return run


@pytest.mark.parametrize("name", CASES)
def test_recorded_commands_give_the_bits_of_the_recording_again(name: str) -> None:
    recorded = ppafo.simulate(name, CASES[name])
    run = replayed(name, CASES[name], recorded)
    again = run.result()
    assert again.status.is_completed
    # A reference is recorded beside any command of one's own, that of a walk's law only beside the law.
    common = set(again.recording.names) & set(recorded.recording.names)
    assert len(common) >= 12
    for channel in common:
        assert again[channel].tobytes() == recorded[channel].tobytes(), channel
    assert run.state.supplied_mass == recorded["supplied_mass"][-1]
    assert ppafo.simulate(again.scenario).recording == again.recording


def test_measurements_are_those_that_a_controller_object_is_given() -> None:
    class Kept:
        def reset(self) -> None:
            self.seen: list[Any] = []

        def update(self, time: float, reference: float, measurement: ppafo.Measurement) -> float:
            self.seen.append((time, reference, measurement))
            return 0.1

    scenario = ppafo.load_scenario("torque-task-slow-valve", SHORT)
    kept = Kept()
    ppafo.simulate(scenario.controlled_by(kept))
    run, seen = ppafo.start(scenario), []
    while not run.is_over:
        seen.append((run.time, run.reference, run.measurement))
        run.step(0.1)
    assert seen == kept.seen


def test_the_reference_of_a_stepped_walk_is_the_torque_that_its_controller_requests() -> None:
    run, told = ppafo.start("proportional", {"run.duration": "6 s"}), {}
    while not run.is_over:
        told[run.time] = run.reference
        run.step(2.0)
    recorded = run.result()
    at = np.searchsorted(recorded.recording.time, np.array(list(told)) - 1e-9)
    assert list(told.values()) == recorded["reference"][at].tolist()
    assert min(told.values()) < -1.0
    assert max(told.values()) > 4.0


def test_a_result_so_far_ends_at_the_present_sample() -> None:
    run = ppafo.start("torque-task-proportional")
    with pytest.raises(ppafo.SimulationError, match="no command"):
        run.result()
    for _ in range(20):
        run.step(0.5)
    assert run.result()["angle"].size == 20
    assert run.time == 20 * run.period


@pytest.mark.parametrize(
    ("name", "command", "said"),
    [
        ("step-response", None, "None"),
        ("step-response", [0.1], "0.1"),
        ("step-response", "0.5", "'0.5'"),
        ("step-response", 1.5, "1.5"),
        ("step-response", math.nan, "nan"),
        ("step-response", 2, "must be -1 to 1$"),
        ("solenoid", 3, "or 2 to vent"),
    ],
)
def test_a_command_beyond_the_valve_is_refused(name: str, command: Any, said: str) -> None:
    with pytest.raises(ppafo.SimulationError, match=said):
        ppafo.start(name).step(command)


def test_a_run_that_is_over_takes_no_command() -> None:
    run = ppafo.start("step-response", {"run.duration": "1 ms"})
    while not run.is_over:
        run.step(1)
    with pytest.raises(ppafo.SimulationError, match=r"over at t = 0\.001 s"):
        run.step(0.0)


def test_a_run_that_diverges_is_over() -> None:
    run = ppafo.start("step-response", ["motion.kind=free", "foot_plate.inertia=1e-12 kg m^2"])
    while not run.is_over:
        run.step(1.0)
    assert run.has_diverged
    assert run.result().status == ppafo.simulate(run.result().scenario).status
    assert run.time < 0.5
