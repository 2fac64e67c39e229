"""Curves over the stride: each brought to the same phases, their mean and deviation, and how far they scatter.

A curve is refused that scatters too much between strides, or that no series fits.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.errors import DataError, raise_noted
from ppafo.gait.gait import HARMONICS, FitError
from ppafo.gait.recorded.footfalls import Stride
from ppafo.gait.recorded.mapping import setting_text
from ppafo.gait.recorded.walk import Signal, acceleration_of
from ppafo.signals.recording import Floats

SAMPLES = 101
"""Samples of every normalised curve, both ends of the stride among them."""
PHASES = np.linspace(0.0, 1.0, SAMPLES)
"""Phases [strides] of every normalised curve, from 0 to 1."""
REMARKED_SPREAD, REFUSED_SPREAD = 0.1, 0.25
"""Standard deviation between strides, fractions of the range of the mean curve; steady walks have 0.004 to 0.06."""
REMARKED_MISFIT, REFUSED_MISFIT = 0.03, 0.1
"""RMS residual of the series over the range [-] that is remarked, and refused; below 0.01 for true curves."""
_UNLOADED_PHASE = 0.02
"""Fraction of the stride at either end of the stance with too little force for a centre of pressure."""


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


def statistics(name: str, signal: Signal, strides: Sequence[Stride]) -> CurveStatistics:
    """Return the curves of a signal over strides that it covers; between samples runs a cubic spline.

    Of a position the curves are its acceleration [m/s^2]; each stride has its own time.
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
    """Return the curves (strides x 101) with mean and deviation over the strides, nan where there is none.

    A centre of pressure has a straight line over swing, where it has no meaning.
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
    """Raise DataError for curves that scatter by a quarter of their range, or that no series fits."""
    most = f"at most {100.0 * REFUSED_SPREAD:.0f} % and {100.0 * REFUSED_MISFIT:.0f} % are accepted"
    scatters = _scatters(curves, errors, REFUSED_SPREAD, REFUSED_MISFIT)
    raise_noted([DataError(f"{walk[name].file}: {said}; {most}; {_remedy()}") for name, said in scatters])


def _scatters(
    curves: Mapping[str, CurveStatistics], errors: Mapping[str, FitError], most_spread: float, most_misfit: float
) -> Iterator[tuple[str, str]]:
    """Yield the curves whose spread or misfit, as fractions of the range, is above these, and a sentence on each."""
    for name, curve in curves.items():
        moved = float(np.ptp(curve.mean))
        if moved <= 0.0:
            continue
        spread, misfit = curve.spread / moved, errors[name].root_mean_square / moved
        if spread > most_spread or misfit > most_misfit:
            yield (
                name,
                f"{name} differs between strides by {100.0 * spread:.0f} % of its range and its series misses "
                f"{100.0 * misfit:.1f} % (standard deviation, root mean square)",
            )


def _remedy() -> str:
    return f"smooth the recording ({setting_text('low_pass', 6.0, '6 Hz')}), or give better or more strides"


def scatter_remarks(curves: Mapping[str, CurveStatistics], errors: Mapping[str, FitError]) -> list[str]:
    """Return a line on each curve that scatters more than a steady walk does, or that its series misses by more."""
    scatters = _scatters(curves, errors, REMARKED_SPREAD, REMARKED_MISFIT)
    return [f"{said}: that is noise, or the walk is not steady; {_remedy()}" for _, said in scatters]
