"""Clock of a recording: test for regular sampling, and time grid of a run that follows the recording."""

import numpy as np

from ppafo.signals.recording import Floats

LONGEST_STEP = 1.0e-3
"""Averaging time of a recorded pressure or torque, and longest step of a replay [s]."""
SHORTEST_SAMPLE = 1.0e-4
"""Smallest interval of the grid to which irregular samples are assigned [s]."""
_IRREGULARITY = 0.02
"""Largest deviation of a time from a regular grid, as a fraction of the interval; clocks write rounded times."""


def regular_interval(time: Floats) -> float | None:
    """Return the sample interval [s] of regular samples, else None; ``time`` [s] has at least two samples."""
    interval = float(time[-1] - time[0]) / (time.size - 1)
    offsets = time - time[0] - interval * np.arange(time.size)
    return interval if float(np.abs(offsets).max()) < _IRREGULARITY * interval else None


def sample_period(time: Floats) -> float:
    """Return the sample interval [s], or the interval of the grid to which irregular samples are assigned."""
    shortest = min(max(float(np.diff(time).min()), SHORTEST_SAMPLE), LONGEST_STEP)
    return regular_interval(time) or shortest
