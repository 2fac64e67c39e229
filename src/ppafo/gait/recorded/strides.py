"""Curves over the stride: each stride brought to the same phases, their mean and how much they differ."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.gait.recorded.events import Stride
from ppafo.gait.recorded.signal import Signal
from ppafo.signals.recording import Floats

SAMPLES = 101
"""Phases from 0 to 1, in percent."""


@dataclass(frozen=True, slots=True, eq=False)
class CurveStatistics:
    """Curves of single strides (strides x 101), and over them the mean and the standard deviation (101 each).

    The deviation is 0 where there is only one stride. ``strides`` says which strides these are.
    """

    curves: Floats
    mean: Floats
    deviation: Floats
    strides: tuple[Stride, ...]

    @property
    def spread(self) -> float:
        """Standard deviation between strides, root mean square over the phases."""
        return float(np.sqrt(np.mean(self.deviation**2)))


def phases() -> Floats:
    """Return the phases of every normalised curve, 0 to 1."""
    return np.linspace(0.0, 1.0, SAMPLES)


def covered(signal: Signal, strides: Sequence[Stride]) -> list[Stride]:
    """Return the strides that lie within a signal, to half a sample."""
    slack = 0.5 / signal.rate
    return [item for item in strides if item.start >= signal.time[0] - slack and item.end <= signal.time[-1] + slack]


def statistics(signal: Signal, strides: Sequence[Stride]) -> CurveStatistics:
    """Return the curves of a signal over strides that it covers; between samples runs a cubic spline."""
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(signal.time, signal.values)
    at = [np.clip(item.start + item.time * phases(), signal.time[0], signal.time[-1]) for item in strides]
    curves = np.array([spline(times) for times in at])
    deviation = curves.std(axis=0, ddof=1) if len(strides) > 1 else np.zeros(SAMPLES)
    return CurveStatistics(curves, curves.mean(axis=0), deviation, tuple(strides))


def without_outliers(strides: Sequence[Stride], largest: float) -> tuple[list[Stride], list[Stride]]:
    """Return the strides whose time is within a share of the median, and those that are not."""
    if not strides:
        return [], []
    median = float(np.median([item.time for item in strides]))
    kept = [item for item in strides if abs(item.time - median) <= largest * median]
    return kept, [item for item in strides if item not in kept]
