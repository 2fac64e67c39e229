"""Curves over the stride: time-normalised curves of single strides, mean, standard deviation and scatter.

A curve is rejected if it scatters too much between strides or if its Fourier series fits badly.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.errors import DataError, raise_noted
from ppafo.gait.gait import HARMONICS, FitError, fit_curve
from ppafo.gait.recorded.footfalls import Stride
from ppafo.gait.recorded.signal import Signal
from ppafo.signals.recording import Floats

SAMPLES = 101
"""Number of samples of a time-normalised curve, both ends of the stride included."""
PHASES = np.linspace(0.0, 1.0, SAMPLES)
"""Phases [strides] of a time-normalised curve, from 0 to 1."""
REMARKED_SPREAD, REFUSED_SPREAD = 0.1, 0.25
"""Standard deviation between strides relative to the range [-] for a remark and for rejection; usual: 0.004 to 0.06."""
REMARKED_MISFIT, REFUSED_MISFIT = 0.03, 0.1
"""RMS residual of the series relative to the range [-] for a remark, and for rejection; correct curves: below 0.01."""
_UNLOADED_PHASE = 0.02
"""Duration at both ends of the stance [strides] with too little force for a centre of pressure."""


@dataclass(frozen=True, slots=True, eq=False)
class CurveStatistics:
    """Time-normalised curves of single strides (strides x 101), their mean and their standard deviation (101 each).

    The deviation is 0 for a single stride. ``strides`` are the strides of the rows of ``curves``.
    """

    curves: Floats
    mean: Floats
    deviation: Floats
    strides: tuple[Stride, ...]

    @property
    def spread(self) -> float:
        """RMS over the phases of the standard deviation between strides, in the unit of the curve [SI]."""
        return float(np.sqrt(np.mean(self.deviation**2)))


def statistics(name: str, signal: Signal, strides: Sequence[Stride]) -> CurveStatistics:
    """Return the curves of a signal over strides that it covers, interpolated with a cubic spline.

    For a position, the curves are the acceleration [m/s^2], computed with the duration of each stride.
    """
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(signal.time, signal.values)
    at = [np.clip(stride.start + stride.time * PHASES, signal.time[0], signal.time[-1]) for stride in strides]
    curves = np.array([spline(times) for times in at]).reshape(-1, SAMPLES)
    if signal.is_position and strides:
        pairs = zip(curves, strides, strict=True)
        curves = np.array([acceleration_of(way, HARMONICS[name], stride.time) for way, stride in pairs])
    return over_strides(name, curves, strides)


def over_strides(name: str, curves: Floats, strides: Sequence[Stride]) -> CurveStatistics:
    """Return curves (strides x 101) with mean and deviation over the strides, which are nan without strides.

    For a centre of pressure, which is undefined in swing, the mean is interpolated linearly over the swing.
    """
    if not strides:
        return CurveStatistics(curves, np.full(SAMPLES, np.nan), np.full(SAMPLES, np.nan), ())
    mean = curves.mean(axis=0)
    deviation = curves.std(axis=0, ddof=1) if len(strides) > 1 else np.zeros(SAMPLES)
    if name == "centre_of_pressure":
        fraction = float(np.mean([stride.stance_share for stride in strides]))
        # Without its ends: where hardly any force acts its place has no meaning.
        inside = (PHASES > _UNLOADED_PHASE) & (fraction - _UNLOADED_PHASE > PHASES)
        at, first = PHASES[inside], float(mean[inside][0])
        # The line over the swing goes on into the next stride, where the stance begins again.
        mean = np.interp(PHASES, [*at, 1.0 + at[0]], [*mean[inside], first], period=None)
        deviation = np.where(inside, deviation, 0.0)
    return CurveStatistics(curves, mean, deviation, tuple(strides))


def check_scatter(
    curves: Mapping[str, CurveStatistics], errors: Mapping[str, FitError], walk: Mapping[str, Signal]
) -> None:
    """Raise DataError for curves that scatter by a quarter of their range, or whose Fourier series fits badly."""
    most = f"at most {100.0 * REFUSED_SPREAD:.0f} % and {100.0 * REFUSED_MISFIT:.0f} % are accepted"
    scatters = _scatters(curves, errors, REFUSED_SPREAD, REFUSED_MISFIT)
    raise_noted([DataError(f"{walk[name].file}: {message}; {most}") for name, message in scatters])


def _scatters(
    curves: Mapping[str, CurveStatistics], errors: Mapping[str, FitError], most_spread: float, most_misfit: float
) -> Iterator[tuple[str, str]]:
    """Yield each curve whose spread or misfit, as a fraction of the range, exceeds its limit, with a description."""
    for name, curve in curves.items():
        moved = float(np.ptp(curve.mean))
        if moved <= 0.0:
            continue
        spread, misfit = curve.spread / moved, errors[name].root_mean_square / moved
        if spread > most_spread or misfit > most_misfit:
            yield (
                name,
                f"{name} has, relative to its range, a standard deviation between strides of {100.0 * spread:.0f} % "
                f"and an RMS error of its Fourier series of {100.0 * misfit:.1f} %",
            )


def scatter_remarks(curves: Mapping[str, CurveStatistics], errors: Mapping[str, FitError]) -> list[str]:
    """Return a remark on each curve with unusual scatter between strides or an unusual misfit of its series."""
    scatters = _scatters(curves, errors, REMARKED_SPREAD, REMARKED_MISFIT)
    return [f"{message}: the data are noisy, or the walk is not steady" for _, message in scatters]


def acceleration_of(position: Floats, harmonics: int, stride_time: float) -> Floats:
    """Return the acceleration [m/s^2] of a position [m] over one stride with this stride time [s], at the same phases.

    The mean speed is subtracted, a Fourier series is fitted, and the series is differentiated twice.
    """
    phase = np.linspace(0.0, 1.0, position.size)
    # A straight line through both ends leaves a periodic rest, which a series can follow.
    curve, _ = fit_curve(position - (position[-1] - position[0]) * phase, harmonics)
    return curve.derivative(stride_time).derivative(stride_time).values_at(phase)
