"""The two parts of a torque task: the ramp, and the hold after it."""

import math

import numpy as np

from ppafo.metrics.metric import Floats, Readings
from ppafo.model.columns import choose
from ppafo.signals import Recording
from ppafo.signals.meter import SAME_LEVEL


def hold_start(recording: Recording) -> float | None:
    """Return the time [s] from which on the reference stays at its final level; None where it never rests there."""
    reference = recording["reference"]
    tolerance = SAME_LEVEL * float(np.max(np.abs(reference)))
    away = np.flatnonzero(np.abs(reference - reference[-1]) > tolerance)
    first = int(away[-1]) + 1 if away.size else 0
    return float(recording.time[first]) if len(recording) - first >= 2 else None


def ramp(recording: Recording) -> Recording | None:
    """Return the recording until the reference reaches the level it keeps; None where there is no ramp or no hold."""
    start = hold_start(recording)
    if start is None or start == recording.time[0]:
        return None
    return recording.between(float(recording.time[0]), start)


def hold(recording: Recording) -> Recording | None:
    """Return the recording from where the reference stays at its final level; None where it never does."""
    start = hold_start(recording)
    return None if start is None else recording.between(start, float(recording.time[-1]))


def spans(readings: Readings) -> tuple[Floats, Floats]:
    """Number of samples before the hold and of intervals on it, of metered runs; nan where there is no such part."""
    start = readings.course.hold_start
    length = readings.samples - 1 - start
    ramp_samples = choose(length >= 1.0, choose(start > 0.0, start, math.nan), math.nan)
    return ramp_samples, choose(length >= 1.0, length, math.nan)
