"""A device that knows the time in the stride: events when they happen, judged from the recording alone."""

import numpy as np
import pytest
from numpy.typing import NDArray

from ppafo.walking import WalkResult, walk

MINUTES = 0.25
SETTLED = 6.0
HEEL, TOE, SWING = 1.0, 3.0, 0.0
"""How the foot stands, as the channel ``contact`` has it."""


def times_of(recording_time: NDArray[np.float64], is_so: NDArray[np.bool_]) -> NDArray[np.float64]:
    begins = recording_time[1:][is_so[1:] & ~is_so[:-1]]
    return np.asarray(begins[begins > SETTLED])


def rms_error(true: NDArray[np.float64], known: NDArray[np.float64]) -> float:
    nearest = np.array([known[np.argmin(np.abs(known - time))] for time in true[:-1]])
    return float(np.sqrt(np.mean((nearest - true[:-1]) ** 2)))


def errors(result: WalkResult) -> dict[str, float]:
    """RMS errors [s] of heel strike, heel off and toes off, in NumPy from channels of the recording."""
    recording, time = result.recording, result.recording.time
    contact = recording["contact"]
    true = {
        "strike": times_of(time, contact == HEEL),
        "heel off": times_of(time, contact == TOE),
        "toes off": times_of(time, contact == SWING),
    }
    if "gait_event" in recording.channels:
        event = recording["gait_event"]
        known = {"strike": event == 0.0, "heel off": event == 2.0, "toes off": event == 3.0}
    else:
        phase = recording["controller_phase"]
        known = {"strike": phase == 1.0, "heel off": phase == 3.0, "toes off": phase == 0.0}
    return {name: rms_error(found, times_of(time, known[name])) for name, found in true.items()}


@pytest.fixture(scope="module")
def fractional() -> WalkResult:
    return walk("solenoid", minutes=MINUTES, overrides=["timing.kind=fractional"])


@pytest.fixture(scope="module")
def thresholds() -> WalkResult:
    return walk("solenoid", minutes=MINUTES)


def test_events_are_known_when_they_happen(fractional: WalkResult, thresholds: WalkResult) -> None:
    before, after = errors(thresholds), errors(fractional)
    assert before["strike"] > 0.02
    assert max(after.values()) < 0.004


def test_the_clock_shows_the_fraction_of_the_stride_that_the_gait_has(fractional: WalkResult) -> None:
    recording = fractional.recording
    starts = np.flatnonzero(np.diff((recording["contact"] > 0.0).astype(float)) > 0.0) + 1
    stride = slice(int(starts[-2]), int(starts[-1]))
    true = np.linspace(0.0, 1.0, stride.stop - stride.start, endpoint=False)
    apart = (recording["gait_fraction"][stride] - true + 0.5) % 1.0 - 0.5
    assert np.abs(apart).max() < 0.008


def test_with_the_time_known_the_foot_is_lifted_at_least_as_high(
    fractional: WalkResult, thresholds: WalkResult
) -> None:
    assert fractional.metrics["toe_landing"].value == 0.0
    known, seen = (item.metrics["lowest_toes"].value for item in (fractional, thresholds))
    # Push-off ends when it happens, so the toes are 3.2 mm higher with the time known.
    assert -0.002 < known - seen < 0.004
