"""Sensors with a bandwidth: against the reference solver, and against the closed form of a first-order filter."""

import dataclasses
import math

import numpy as np
import pytest

import ppafo
from ppafo.engine.lanes import run_batch
from ppafo.engine.run import batch_of, state_row_numbers
from ppafo.model.sensors import Measurement, decay_factors
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import PYTHON_CONTROLLER, Control, PrescribedMotion, ProfileChoice
from tests.reference.reference_solver import compare_with_reference

SLOW = ("sensors.angle_bandwidth=20 Hz", "sensors.pressure_bandwidth=40 Hz")
LATE = ("sensors.delay=2.3 ms",)


@pytest.mark.parametrize("overrides", [SLOW, SLOW[1:], (*SLOW, *LATE)], ids=["both", "pressure", "late too"])
def test_a_loop_closed_over_slow_sensors_is_that_of_the_reference_solver(overrides: tuple[str, ...]) -> None:
    run = plan_run(load_scenario("torque-task-proportional", ("run.duration=1 s", *overrides)))
    agreement = compare_with_reference(run)
    assert agreement.worst_pressure < 1.0e-3, agreement
    assert agreement.worst_rms < 1.0e-4, agreement
    ideal = run_batch(batch_of(plan_run(load_scenario("torque-task-proportional", ("run.duration=1 s",)))))
    command = state_row_numbers(run)["result.command"]
    away = run_batch(batch_of(run)).record[:, command, 0] - ideal.record[:, command, 0]
    assert np.abs(away).max() > 1.0e-2, "the bandwidth must matter"


class Listener:
    """A controller that keeps what it sees and asks for nothing."""

    def reset(self) -> None:
        self.seen: list[Measurement] = []

    def update(self, time: float, reference: float, measured: Measurement) -> float:
        self.seen.append(measured)
        return 0.0


@pytest.mark.parametrize("share", [1e-3, 0.3, 1.0, 20.0, 39.0, 41.0, 1e3, 1e5, 1e8])
def test_what_fades_in_a_step_is_the_exponential_and_its_mean_however_long_the_step(share: float) -> None:
    assert decay_factors(share / 0.01, 0.01) == pytest.approx(
        (math.exp(-share), -math.expm1(-share) / share), abs=1e-12
    )


def test_a_slow_angle_sensor_shows_a_sine_smaller_and_later_and_the_others_show_the_truth() -> None:
    bandwidth = 5.0
    frequency = 4.0
    scenario = load_scenario(
        "torque-task-proportional", (f"sensors.angle_bandwidth={bandwidth} Hz", "run.duration=2 s")
    )
    swing = ProfileChoice("sine", {"level": 1.3, "amplitude": 0.4, "frequency": frequency, "phase": 0.0})
    listener = Listener()
    listening = Control(PYTHON_CONTROLLER, {}, scenario.controller.period, listener)
    result = ppafo.simulate(dataclasses.replace(scenario, motion=PrescribedMotion(swing), controller=listening))
    times = result.recording.time[: len(listener.seen)]
    ratio = frequency / bandwidth
    expected = 1.3 + 0.4 / math.hypot(1.0, ratio) * np.sin(2.0 * math.pi * frequency * times - math.atan(ratio))
    shown = np.array([measured.angle for measured in listener.seen])
    settled = times > 0.6
    assert np.abs(shown - expected)[settled].max() < 1.0e-4
    first = np.array([measured.pressure_1 for measured in listener.seen])
    np.testing.assert_allclose(first, result.recording["pressure_1"][: first.size], rtol=1e-12)


def test_a_bandwidth_varies_in_an_ensemble_as_it_does_alone() -> None:
    base = load_scenario("torque-task-proportional", ("run.duration=0.3 s", *SLOW))
    bandwidths = np.array([5.0, 40.0, 500.0])
    ensemble = run_ensemble(base, {"sensors.pressure_bandwidth": bandwidths}, ("rms_error",))
    given = ("run.duration=0.3 s", SLOW[0])
    alone = [
        ppafo.simulate("torque-task-proportional", [*given, f"sensors.pressure_bandwidth={value} Hz"])
        .metrics["rms_error"]
        .value
        for value in bandwidths
    ]
    np.testing.assert_allclose(ensemble.metrics["rms_error"], alone, rtol=1e-9)
    assert len(set(alone)) == 3
