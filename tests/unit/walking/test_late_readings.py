"""Readings that come whole samples late: what the controller sees is what was there, as many samples ago."""

import numpy as np
import pytest

from ppafo.model.sensors import Fault, samples_late
from ppafo.walking.loading import load_walk
from ppafo.walking.walk import walk

BEGINS, LATE = 3.2, 0.05


@pytest.mark.parametrize(
    ("time", "sample", "late"), [(1.9, 1900, 0), (2.0, 2000, 7), (2.4, 2400, 7), (2.6, 2600, 0), (3.1, 3100, 7)]
)
def test_a_delay_begins_with_the_fault_and_comes_and_goes_with_it(time: float, sample: int, late: int) -> None:
    fault = Fault(2.0, 0.0, 0.0, distorts=1.0, late_samples=7.0, period=1.0)
    assert samples_late(fault, time, sample) == late


def test_nothing_is_older_than_the_walk() -> None:
    assert samples_late(Fault(0.0, 0.0, 0.0, distorts=1.0, late_samples=100.0), 0.03, 30) == 30


def test_a_late_heel_sensor_shows_the_next_strike_as_much_later() -> None:
    late = [f"faults.heel.{item}" for item in ("kind=distorted", f"time={BEGINS} s", f"delay={LATE} s")]
    sound = [f"faults.heel.{item}" for item in ("kind=distorted", f"time={BEGINS} s", "delay=0.001 s")]
    strikes = []
    for given in (sound, late):
        recording = walk(load_walk("solenoid", given), minutes=0.1).recording
        begins = np.diff(recording["controller_phase"] == 1.0, prepend=False) & (recording["controller_phase"] == 1.0)
        times = recording.time[begins]
        # The heel is on the ground when the fault begins: the first strike after it is that of the next stride.
        strikes.append(float(times[times > BEGINS + 0.3][0]))
    assert strikes[1] - strikes[0] == pytest.approx(LATE - 0.001, abs=0.0051)


def test_what_is_known_of_valve_and_sensors_may_delay_a_pressure() -> None:
    given = ["valve.delay=2 ms", "valve.spool_frequency=20 Hz", "sensors.pressure_bandwidth=50 Hz"]
    lags = 2.0e-3 + 2.0 * 0.7 / (2.0 * np.pi * 20.0) + 1.0 / (2.0 * np.pi * 50.0)
    ideal, slow = load_walk("proportional"), load_walk("proportional", given)
    assert slow.controller.follow_time - ideal.controller.follow_time == pytest.approx(lags)
    assert load_walk("proportional", [*given, "controller.follow_time=9 ms"]).controller.follow_time == 9.0e-3


@pytest.mark.parametrize("valve", ["solenoid", "proportional"])
def test_forces_that_come_65_ms_late_lift_only_within_two_and_a_half_strides(valve: str) -> None:
    words = ("kind=distorted", f"time={BEGINS} s", "delay=0.065 s")
    result = walk(
        load_walk(valve, [f"faults.{sensor}.{word}" for sensor in ("heel", "toe") for word in words]), minutes=0.12
    )
    lifted = np.flatnonzero(result.recording["safe_state"] > 0.0)
    assert BEGINS < result.recording.time[lifted[0]] < BEGINS + 2.5 * 1.04
    assert set(result.recording["safe_state"][lifted]) == {1.0}, "and so it stays"
