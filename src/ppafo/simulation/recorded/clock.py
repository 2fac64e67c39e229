"""The clock of a recording: whether its samples are regular, and on which grid a run follows them."""

import numpy as np

from ppafo.signals.recording import Floats

LONGEST_STEP = 1.0e-3
"""Seconds over which a recorded pressure or torque is averaged, and the longest step of a replay."""
SHORTEST_SAMPLE = 1.0e-4
"""Seconds; irregular samples are placed on a grid no finer than this."""
_IRREGULARITY = 0.02
"""Fraction of a sample by which a time may be off a regular grid; clocks write rounded times."""


def regular_interval(time: Floats) -> float | None:
    """Return the time between samples [s] where they are regular, else None; ``time`` [s] has two samples or more."""
    interval = float(time[-1] - time[0]) / (time.size - 1)
    offsets = time - time[0] - interval * np.arange(time.size)
    return interval if float(np.abs(offsets).max()) < _IRREGULARITY * interval else None


def sample_period(time: Floats) -> float:
    """Return the time between samples [s], or of the grid on which irregular samples are placed."""
    shortest = min(max(float(np.diff(time).min()), SHORTEST_SAMPLE), LONGEST_STEP)
    return regular_interval(time) or shortest


def usual_interval(time: Floats) -> float:
    """Return the median time between two samples [s]."""
    return float(np.median(np.diff(time)))
