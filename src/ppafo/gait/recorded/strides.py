"""Curves over the stride: each brought to the same phases, their mean and their standard deviation.

What no leg does is found here: columns that stay constant while the wearer walks, drop-outs that were filled with the
last value, and strides that scatter too much, or that no series comes near.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.gait import HARMONICS, FitError
from ppafo.gait.recorded.footfalls import Stride
from ppafo.gait.recorded.table import MotionTable
from ppafo.gait.recorded.walk import LOADS, Signal, acceleration_of
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
        # Each stride has its own time.
        pairs = zip(result.curves, inside, strict=True)
        return _over_strides(
            np.array([acceleration_of(way, HARMONICS[name], item.time) for way, item in pairs]), inside
        )
    return _bridge_swing(result) if name == "centre_of_pressure" else result


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


LONGEST_HELD = 0.1
"""Seconds that a column may keep one value within the strides."""

_ABOUT_STANCE = 0.05
"""Of the stride, at either end of the stance, in which a load may rest too."""
_COARSE = 0.002
"""Fraction of the range; a sensor with coarser steps keeps a value where its curve turns round."""


def check_constant(
    walk: Mapping[str, Signal],
    tables: Sequence[MotionTable],
    strides: Sequence[Stride],
    covered: Mapping[str, Sequence[Stride]],
    left_out: Sequence[Stride],
) -> None:
    """Raise DataError for a column that keeps one value for more than 0.1 s within the strides; a load may in swing.

    Loads are checked in the strides that they cover, motions in strides that are left out too: a drop-out made
    those longer. A column that never moves is no drop-out, and a stretch that a coarse sensor enters and leaves by its
    smallest step is none either.
    """
    by_file = {table.file: table for table in tables}
    for name, signal in walk.items():
        table = by_file[signal.file]
        # Between the times of a span a column of this curve moves all the time.
        spans = [(item.start, item.end) for item in (*strides, *left_out)]
        if name in LOADS:
            loaded = [(item, _ABOUT_STANCE * item.time) for item in covered[name]]
            spans = [(item.start + slack, item.toe_off - slack) for item, slack in loaded]
        columns = [(column, table.columns[column]) for column in signal.columns]
        if name in LOADS and len(columns) > 1:
            # Plates that are summed rest in turn, so their sum is looked at.
            columns = [(" + ".join(signal.columns), np.sum([np.abs(values) for _, values in columns], axis=0))]
        for column, values in columns:
            found = constant_stretch(table.time, values, spans)
            if found is not None:
                raise DataError(
                    f"{table.file}: column {column!r} of {name} keeps one value from {found[0]:.4g} to "
                    f"{found[1]:.4g} s while the wearer walks: a drop-out was filled with it; cut the file there and "
                    "give the longer part"
                )


def constant_stretch(time: Floats, values: Floats, spans: Sequence[tuple[float, float]]) -> tuple[float, float] | None:
    """Return start and end [s] of the first stretch with one value that covers more than 0.1 s of the spans."""
    moves = np.flatnonzero(np.diff(values) != 0.0)
    if moves.size == 0:
        return None
    starts, ends = np.concatenate([[0], moves + 1]), np.concatenate([moves, [values.size - 1]])
    long = time[ends] - time[starts] > LONGEST_HELD
    for first, last in zip(starts[long].tolist(), ends[long].tolist(), strict=True):
        start, end = float(time[first]), float(time[last])
        inside = sum(max(0.0, min(end, high) - max(start, low)) for low, high in spans)
        if inside > LONGEST_HELD and not _by_coarse_steps(values, first, last):
            return start, end
    return None


def _by_coarse_steps(values: Floats, first: int, last: int) -> bool:
    """Tell whether the value changes by the smallest step of a coarse sensor on both sides of a stretch."""
    steps = np.abs(np.diff(values))
    # Rounding makes equal steps of a sensor differ in the last digits.
    smallest = 1.001 * float(np.min(steps[steps > 0.0]))
    beside = [float(steps[place]) for place in (first - 1, last) if 0 <= place < steps.size]
    return smallest > _COARSE * float(np.nanmax(values) - np.nanmin(values)) and max(beside) <= smallest


REMARKED_SPREAD, REFUSED_SPREAD = 0.1, 0.25
"""Standard deviation between strides, fractions of the range of the mean curve; steady walks have 0.004 to 0.06."""

REMARKED_MISFIT, REFUSED_MISFIT = 0.03, 0.1
"""What the series leaves, root mean square, fractions of the same range; true curves have below 0.01."""

_REMEDY = "smooth the recording (--low-pass '6 Hz'), or give better or more strides"


@dataclass(frozen=True, slots=True)
class _Scatter:
    """Spread and misfit of one curve as fractions of its range."""

    name: str
    spread: float
    misfit: float


def check_scatter(
    curves: Mapping[str, CurveStatistics], errors: Mapping[str, FitError], walk: Mapping[str, Signal]
) -> None:
    """Raise DataError for curves that scatter by a quarter of their range, or that no series comes near."""
    for item in _scatters(curves, errors):
        if item.spread > REFUSED_SPREAD or item.misfit > REFUSED_MISFIT:
            raise DataError(
                f"{walk[item.name].file}: {_statement(item)}; at most {100.0 * REFUSED_SPREAD:.0f} % and "
                f"{100.0 * REFUSED_MISFIT:.0f} % are accepted; {_REMEDY}"
            )


def scatter_remarks(curves: Mapping[str, CurveStatistics], errors: Mapping[str, FitError]) -> list[str]:
    """Return a line on each curve that scatters more than a steady walk does."""
    return [
        f"{_statement(item)}: that is noise, or the walk is not steady; {_REMEDY}"
        for item in _scatters(curves, errors)
        if item.spread > REMARKED_SPREAD or item.misfit > REMARKED_MISFIT
    ]


def _statement(item: _Scatter) -> str:
    return (
        f"{item.name} differs between strides by {100.0 * item.spread:.0f} % of its range and its series misses "
        f"{100.0 * item.misfit:.1f} % (standard deviation, root mean square)"
    )


def _scatters(curves: Mapping[str, CurveStatistics], errors: Mapping[str, FitError]) -> Iterator[_Scatter]:
    for name, item in curves.items():
        moved = float(np.ptp(item.mean))
        if moved > 0.0:
            yield _Scatter(name, item.spread / moved, errors[name].root_mean_square / moved)
