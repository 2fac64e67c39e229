"""Strides and the curves over them: selection, time-normalised curves of single strides, mean, deviation and scatter.

Rejected are recordings that no leg can produce: columns that stay constant while the wearer walks, drop-outs filled
with the last value, and strides whose curve differs from all others; then curves that
scatter too much between strides, or whose Fourier series fits badly.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.errors import DataError, PpafoError, noted_in, raise_noted
from ppafo.gait.gait import HARMONICS, REQUIRED, FitError, fit_curve
from ppafo.gait.recorded.footfalls import (
    FORCE,
    LEAST_STRIDES,
    SHANK,
    Footfalls,
    Stride,
    heel_strikes,
    lost_in,
    usable_strides,
)
from ppafo.gait.recorded.mapping import setting_text
from ppafo.gait.recorded.signal import LOADS, Signal
from ppafo.gait.recorded.table import LONGEST_FILLED, MotionTable
from ppafo.signals.recording import Floats
from ppafo.wording import count_of

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


LARGEST_STRIDE_CHANGE = 0.25
"""Largest relative deviation from the median stride time; a larger one is a missed event or unsteady walking."""
LONGEST_HELD = 0.1
"""Longest time [s] for which a column may be constant within the strides."""

_ABOUT_STANCE = 0.05
"""Interval at both ends of the stance [strides] in which a load may be constant too."""
_COARSE = 0.001
"""Resolution relative to the range [-] above which a sensor counts as coarse and may be constant at a turning point."""
_STEPS_OF_REST = 3.0
"""Largest change, in smallest increments, before and after a constant value of a coarse sensor at a turning point."""
ODD_SHAPE, ODD_PHASE, ODD_AGAINST_OTHERS = 0.25, 0.4, 4.0
"""Limits for an odd stride: distance of its curve from the median curve relative to the range, as RMS over the stride
and at any one phase, and relative to the median distance of all strides. Impaired walking varies more, but in every
stride."""
_FEWEST_TO_COMPARE = 3
"""Least number of strides for the detection of an odd stride."""
_MOST_ODD = 0.4
"""Fraction of odd strides above which no stride is rejected."""


@dataclass(frozen=True, slots=True)
class StrideSelection:
    """Selected strides, rejected strides with the reason for each, and the least number of selected strides."""

    taken: tuple[Stride, ...]
    left_out: tuple[tuple[Stride, str], ...]
    least: int

    def without(self, odd: Sequence[Stride], why: str, else_refused: str = "") -> "StrideSelection":
        """Return the selection without some strides, or unchanged if too few would remain.

        In the latter case, raises DataError with the message ``else_refused``, if given.
        """
        kept = tuple(stride for stride in self.taken if stride not in odd)
        if len(kept) >= self.least:
            return StrideSelection(kept, (*self.left_out, *((stride, why) for stride in odd)), self.least)
        if else_refused:
            raise DataError(else_refused)
        return self


def select_strides(footfalls: Footfalls, given_least: int | None) -> StrideSelection:
    """Return the strides with both angles whose duration differs from the median by at most LARGEST_STRIDE_CHANGE.

    Strides with lost samples are rejected too. ``given_least`` is the least number of strides, None for the default.
    """
    walk = footfalls.walk
    least = given_least or (1 if footfalls.is_one_cycle or footfalls.is_overground else LEAST_STRIDES)
    recorded = usable_strides(walk, footfalls.strides)
    # The median: one stop among ten strides would move a mean.
    median = float(np.median([stride.time for stride in recorded])) if recorded else 0.0
    kept = [stride for stride in recorded if abs(stride.time - median) <= LARGEST_STRIDE_CHANGE * median]
    usual = f"{np.mean([stride.time for stride in kept]):.3g} s" if kept else ""
    odd = [stride for stride in recorded if stride not in kept]
    unusual = [(stride, f"{stride.time:.3g} s long, the others are about {usual}") for stride in odd]
    counts = [(stride, max(lost_in(walk[name], stride) for name in REQUIRED)) for stride in footfalls.strides]
    lost = [(stride, f"markers or angles lost in {count_of(count, 'frame')}") for stride, count in counts if count]
    return StrideSelection(tuple(kept), (*unusual, *lost), least)


def check_enough(strides: StrideSelection, footfalls: Footfalls) -> None:
    """Raise DataError for too few strides, with the cause: events, covered time or gaps."""
    taken, least = len(strides.taken), strides.least
    if taken >= least:
        return
    walk = {name: footfalls.walk[name] for name in (*REQUIRED, footfalls.events) if name in footfalls.walk}
    spans = ", ".join(f"{name} {signal.time[0]:.4g} to {signal.time[-1]:.4g} s" for name, signal in walk.items())
    count = count_of(taken, "whole stride")
    events = f"{count_of(len(footfalls.strides), 'stride')} in the events"
    if not footfalls.strides:
        where = FORCE if FORCE in walk else SHANK
        events = f"{count_of(len(heel_strikes(where, walk)), 'heel strike')} in {where}; a stride needs two"
    # From the last sample before the longest gap to the first one after it.
    longest = max(
        0.0 if signal.lost is None else float(np.max(np.diff(signal.time[~signal.lost]))) for signal in walk.values()
    )
    gap = f"; the longest gap is {longest:.3g} s, and {setting_text('longest_gap')} fills up to {LONGEST_FILLED:g} s"
    raise DataError(
        f"{walk['shank_angle'].file}: has {count} covered by both angles and events ({events}; {spans}), but "
        f"{setting_text('least_strides')} is {least}{gap if longest > 0.0 else ''}"
    )


def without_drop_outs(
    walk: Mapping[str, Signal],
    tables: Sequence[MotionTable],
    covered: Mapping[str, Sequence[Stride]],
    strides: StrideSelection,
    wrong: list[PpafoError],
) -> StrideSelection:
    """Reject strides in which a column is constant for more than 0.1 s; in swing, a load may be constant.

    Loads are checked in the strides that they cover. Two cases are no drop-outs: a column that never changes, and an
    interval that a coarse sensor enters and leaves by its smallest increment. If too few strides would remain, all are
    kept and the problem is added to ``wrong``.
    """
    by_file = {table.file: table for table in tables}
    for name, signal in walk.items():
        table = by_file[signal.file]
        # Between the times of a span a column of this curve moves all the time.
        spans = [(stride.start, stride.end) for stride in strides.taken]
        if name in LOADS:
            loaded = [(stride, _ABOUT_STANCE * stride.time) for stride in covered[name]]
            spans = [(stride.start + slack, stride.toe_off - slack) for stride, slack in loaded]
        columns = [(column, table.columns[column]) for column in signal.columns]
        if name in LOADS and len(columns) > 1:
            # Plates that are summed rest in turn, so their sum is looked at.
            columns = [(" + ".join(signal.columns), np.sum([np.abs(values) for _, values in columns], axis=0))]
        for column, values in columns:
            for start, end in constant_stretches(table.time, values, spans):
                what = f"column {column!r} of {name} is constant from {start:.4g} to {end:.4g} s"
                with noted_in(wrong):
                    strides = strides.without(
                        [stride for stride in strides.taken if stride.start < end and start < stride.end],
                        f"{what}: a sensor drop-out",
                        f"{table.file}: {what} while the wearer walks, as by a sensor drop-out",
                    )
    return strides


def constant_stretches(time: Floats, values: Floats, spans: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return start and end [s] of all intervals with a constant value that cover more than 0.1 s of the spans."""
    steps = np.abs(np.diff(values))
    # A gap ends a stretch, too, but a column with gaps alone never moves.
    moves = np.flatnonzero(steps != 0.0)
    if not np.any(steps > 0.0):
        return []
    # Rounding makes equal steps of a sensor differ in the last digits.
    smallest = 1.001 * float(np.min(steps[steps > 0.0]))
    is_coarse = smallest > _COARSE * float(np.nanmax(values) - np.nanmin(values))
    starts, ends = np.concatenate([[0], moves + 1]), np.concatenate([moves, [values.size - 1]])
    long = time[ends] - time[starts] > LONGEST_HELD
    stretches = []
    for first, last in zip(starts[long].tolist(), ends[long].tolist(), strict=True):
        start, end = float(time[first]), float(time[last])
        inside = sum(max(0.0, min(end, high) - max(start, low)) for low, high in spans)
        # A coarse sensor rests at a value that it enters and leaves by a few of its smallest steps.
        beside = [float(steps[place]) for place in (first - 1, last) if 0 <= place < steps.size]
        by_coarse_steps = is_coarse and max(beside) <= _STEPS_OF_REST * smallest
        if inside > LONGEST_HELD and not by_coarse_steps:
            stretches.append((start, end))
    return stretches


def without_odd_shapes(curves: Mapping[str, CurveStatistics], strides: StrideSelection) -> StrideSelection:
    """Reject strides whose curve differs from all others: a stumble, a turn, or exchanged markers."""
    for name, curve in curves.items():
        if len(curve.strides) < _FEWEST_TO_COMPARE or name == "centre_of_pressure":
            continue
        middle = np.median(curve.curves, axis=0)
        # From the median curve, which one odd stride does not move.
        away = np.abs(curve.curves - middle)
        is_odd = np.zeros(len(curve.strides), dtype=bool)
        for share, distances in ((ODD_SHAPE, np.sqrt(np.mean(away**2, axis=1))), (ODD_PHASE, np.max(away, axis=1))):
            # Both a fraction of the range and a multiple of the usual distance: impaired strides differ, but all of
            # them.
            is_odd |= distances > max(share * np.ptp(middle), ODD_AGAINST_OTHERS * np.median(distances))
        odd = [stride for stride, is_it in zip(curve.strides, is_odd.tolist(), strict=True) if is_it]
        if len(odd) <= _MOST_ODD * len(curve.strides):
            strides = strides.without(
                [stride for stride in odd if stride in strides.taken], f"{name} differs from all other strides"
            )
    return strides
