"""Curves over the stride: each stride brought to the same phases, their mean and their standard deviation."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.fourier import HARMONICS
from ppafo.gait.recorded.events import Stride
from ppafo.gait.recorded.knee import acceleration_of
from ppafo.gait.recorded.signal import Signal
from ppafo.signals.recording import Floats

SAMPLES = 101
"""Phases from 0 to 1, in percent."""

_UNLOADED_FORCE = 0.02


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
        """Standard deviation between strides, root mean square over the phases, in the unit of the curve [SI]."""
        return float(np.sqrt(np.mean(self.deviation**2)))


def phases() -> Floats:
    """Return the phases [strides] of every normalised curve, from 0 to 1."""
    return np.linspace(0.0, 1.0, SAMPLES)


def strides_within(signal: Signal, strides: Sequence[Stride]) -> list[Stride]:
    """Return the strides that lie within a signal, to half a sample."""
    slack = 0.5 / signal.rate
    return [item for item in strides if item.start >= signal.time[0] - slack and item.end <= signal.time[-1] + slack]


def statistics(signal: Signal, strides: Sequence[Stride]) -> CurveStatistics:
    """Return the curves of a signal over strides that it covers; between samples runs a cubic spline."""
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(signal.time, signal.values)
    at = [np.clip(item.start + item.time * phases(), signal.time[0], signal.time[-1]) for item in strides]
    curves = np.array([spline(times) for times in at])
    return _over_strides(curves, strides)


def _over_strides(curves: Floats, strides: Sequence[Stride]) -> CurveStatistics:
    deviation = curves.std(axis=0, ddof=1) if len(strides) > 1 else np.zeros(SAMPLES)
    return CurveStatistics(curves, curves.mean(axis=0), deviation, tuple(strides))


def mean_curve(name: str, signal: Signal, strides: Sequence[Stride], inside: Sequence[Stride]) -> CurveStatistics:
    """Return the curves of the strides ``inside``, which a signal covers; at least one of all ``strides`` has to be."""
    if not inside:
        raise DataError(
            f"{signal.file}: {name} goes from {signal.time[0]:.4g} to {signal.time[-1]:.4g} s and covers no whole "
            f"stride ({strides[0].start:.4g} to {strides[0].end:.4g} s is the first); give a longer file, or "
            "leave it out"
        )
    result = statistics(signal, inside)
    if signal.is_position:
        return _accelerations(result, HARMONICS[name])
    return _bridge_swing(result) if name == "centre_of_pressure" else result


def _accelerations(result: CurveStatistics, harmonics: int) -> CurveStatistics:
    """Return the accelerations [m/s^2] of positions [m], each stride with its own time."""
    pairs = zip(result.curves, result.strides, strict=True)
    return _over_strides(np.array([acceleration_of(way, harmonics, item.time) for way, item in pairs]), result.strides)


def _bridge_swing(result: CurveStatistics) -> CurveStatistics:
    """Return a centre of pressure with a straight line over swing, where it has no meaning."""
    percent = phases()
    fraction = float(np.mean([item.stance_share for item in result.strides]))
    inside = (percent > _UNLOADED_FORCE) & (percent < fraction - _UNLOADED_FORCE)
    at, first = percent[inside], float(result.mean[inside][0])
    mean = np.interp(percent, [*at, 1.0 + at[0]], [*result.mean[inside], first], period=None)
    deviation = np.where(inside, result.deviation, 0.0)
    return CurveStatistics(result.curves, mean, deviation, result.strides)


def without_outliers(strides: Sequence[Stride], largest: float) -> tuple[list[Stride], list[Stride]]:
    """Return the strides whose time is within ``largest`` [-] of the median, relative to it, and the others."""
    if not strides:
        return [], []
    median = float(np.median([item.time for item in strides]))
    kept = [item for item in strides if abs(item.time - median) <= largest * median]
    return kept, [item for item in strides if item not in kept]
