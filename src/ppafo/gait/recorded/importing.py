"""Import of a gait from recorded files: strides, mean curves, checks, and the Fourier series of a gait.

Strides are rejected for lost samples, unusual duration, drop-outs filled with the last value, columns that stay
constant while the wearer walks, and a curve that differs from all others. A curve is rejected if it scatters too much
between strides or if its Fourier series fits badly.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.arguments import checked
from ppafo.errors import DataError, Faults, PpafoError
from ppafo.gait.document import load_gait
from ppafo.gait.gait import HARMONICS, REQUIRED, FitError, Gait, GaitCurve, Origin, fit_curve
from ppafo.gait.plausible import (
    MeanStride,
    check_plausible,
    check_side,
    stride_remarks,
)
from ppafo.gait.recorded.footfalls import (
    FORCE,
    LEAST_STRIDES,
    SHANK,
    Footfalls,
    Stride,
    covers,
    find_footfalls,
    heel_strikes,
    is_within,
    lost_in,
    usable_strides,
)
from ppafo.gait.recorded.mapping import ImportSettings, check_settings, setting_text, unsigned_names
from ppafo.gait.recorded.signal import LOADS, Signal, knee_remarks, low_pass
from ppafo.gait.recorded.source import GaitSource, read_source
from ppafo.gait.recorded.table import LONGEST_FILLED, MotionTable
from ppafo.signals.recording import Floats
from ppafo.wording import count_of

SAMPLES = 101
"""Number of samples of a time-normalised curve, both ends of the stride included."""
PHASES = np.linspace(0.0, 1.0, SAMPLES)
"""Phases [strides] of a time-normalised curve, from 0 to 1."""
# Standard deviation between strides relative to the range [-] for a remark and for rejection; usual: 0.004 to 0.06.
REMARKED_SPREAD = 0.1
REFUSED_SPREAD = 0.25
# RMS residual of the series relative to the range [-] for a remark, and for rejection; correct curves: below 0.01.
REMARKED_MISFIT = 0.03
REFUSED_MISFIT = 0.1
_UNLOADED_PHASE = 0.02
"""Duration at both ends of the stance [strides] with too little force for a centre of pressure."""
LARGEST_STRIDE_CHANGE = 0.25
"""Largest relative deviation from the median stride time; a larger one is a missed event or unsteady walking."""
LONGEST_HELD = 0.1
"""Longest time [s] for which a column may be constant within the strides."""
_FASTEST_BACK = 0.2
"""Largest backward speed of a knee [m/s] on a treadmill, averaged over the recording."""
_ABOUT_STANCE = 0.05
"""Interval at both ends of the stance [strides] in which a load may be constant too."""
_COARSE = 0.001
"""Resolution relative to the range [-] above which a sensor counts as coarse and may be constant at a turning point."""
_STEPS_OF_REST = 3.0
"""Largest change, in smallest increments, before and after a constant value of a coarse sensor at a turning point."""
# Limits for an odd stride: distance of its curve from the median curve relative to the range, as RMS over the stride
# and at any one phase, and relative to the median distance of all strides. Impaired walking varies more, but in every
# stride.
ODD_SHAPE = 0.25
ODD_PHASE = 0.4
ODD_AGAINST_OTHERS = 4.0
_FEWEST_TO_COMPARE = 3
"""Least number of strides for the detection of an odd stride."""
_MOST_ODD = 0.4
"""Fraction of odd strides above which no stride is rejected."""


@dataclass(frozen=True, eq=False)
class CurveStatistics:
    """Time-normalised curves of single strides (strides x 101) of a signal, by the name of the curve.

    ``strides`` are the strides of the rows of ``curves``.
    """

    name: str
    curves: Floats
    strides: tuple[Stride, ...]

    @cached_property
    def mean(self) -> Floats:
        """Mean over the strides (101,); of a centre of pressure, which is undefined in swing, a line over the swing."""
        mean = self.curves.mean(axis=0)
        if self.name == "centre_of_pressure":
            at = PHASES[self._inside]
            first = float(mean[self._inside][0])
            # The line goes on into the next stride, where the stance begins again.
            mean = np.interp(PHASES, [*at, 1.0 + at[0]], [*mean[self._inside], first], period=None)
        return np.asarray(mean)

    @cached_property
    def deviation(self) -> Floats:
        """Standard deviation over the strides (101,); 0 for a single stride, and for a centre of pressure in swing."""
        deviation = self.curves.std(axis=0, ddof=1) if len(self.strides) > 1 else np.zeros(SAMPLES)
        return np.where(self._inside, deviation, 0.0) if self.name == "centre_of_pressure" else np.asarray(deviation)

    @property
    def _inside(self) -> NDArray[np.bool_]:
        """Phases of the stance without its ends: where hardly any force acts its place has no meaning."""
        share = float(np.mean([stride.stance_share for stride in self.strides]))
        return np.asarray((PHASES > _UNLOADED_PHASE) & (share - _UNLOADED_PHASE > PHASES))

    @cached_property
    def fitted(self) -> tuple[GaitCurve, FitError]:
        """Fourier series of the mean, and its error."""
        return fit_curve(self.mean, HARMONICS[self.name], self.spread)

    @property
    def spread(self) -> float:
        """RMS over the phases of the standard deviation between strides, in the unit of the curve [SI]."""
        return float(np.sqrt(np.mean(self.deviation**2)))


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


@dataclass(frozen=True, slots=True, eq=False)
class ImportedGait:
    """Imported gait with the strides and curves behind it.

    ``strides`` are the strides used and ``left_out`` the strides rejected. ``curves`` holds the single strides by curve
    name. ``events`` is the source of the strides: ``vertical_force``, ``shank_angle`` or ``events of the file``.
    ``files`` are the names of the files, ``remarks`` the sentences for the user.
    """

    gait: Gait
    strides: tuple[Stride, ...]
    left_out: tuple[Stride, ...]
    curves: Mapping[str, CurveStatistics]
    events: str
    files: tuple[str, ...]
    remarks: tuple[str, ...] = field(default=())


@checked
def import_gait(files: Sequence[str | Path], settings: ImportSettings) -> ImportedGait:
    """Return the mean stride of one walk of one person, from a recorded file or several that share a clock.

    The files may be of any format of ``source.FORMS``: .mot, .sto, .csv, .txt, .tsv, .emt, .c3d, .trc, .mat.

    Strides come from the vertical force if available, otherwise from events of the file or from the shank. Raises a
    DataError that lists all problems with file, column, row and remedy: after a problem with one curve, the other
    curves are still checked. Repaired values are listed in the remarks.
    """
    wrong = Faults()
    with wrong:
        check_settings(settings)
    source = read_source(files, settings, wrong)
    try:
        footfalls = find_footfalls(source.walk, source.tables, settings.side, settings.least_strides)
    except PpafoError as error:
        Faults([*wrong, error]).raise_all()
    curves, strides, unmeasured = _curves_over_strides(source, footfalls, wrong)
    # Both coordinates of the knee may be from one marker, whose scale is one.
    labels = [name.rpartition(".")[0] for name in unsigned_names(source.columns.knee)]
    mean_stride = MeanStride(
        file={name: source.walk[name].file for name in curves},
        curves={name: curve.mean for name, curve in curves.items()},
        stance_share=float(np.mean([stride.stance_share for stride in strides.taken])),
        stride_time=float(np.mean([stride.time for stride in strides.taken])),
        is_knee_one_marker=len(labels) == 2 and labels[0] == labels[1] != "",
    )
    walk = {name: footfalls.walk[name] for name in curves}
    most = f"at most {100.0 * REFUSED_SPREAD:.0f} % and {100.0 * REFUSED_MISFIT:.0f} % are accepted"
    scattered = _scatters(curves, REFUSED_SPREAD, REFUSED_MISFIT)
    wrong += [DataError(f"{walk[name].file}: {message}; {most}") for name, message in scattered]
    with wrong:
        # The ankle of the other foot looks like a wrong zero to the checks of the curves.
        check_side(mean_stride, load_gait())
        check_plausible(mean_stride)
    if (way := walk.get("knee_forward")) is not None and way.is_position:
        speed = float((way.values[-1] - way.values[0]) / (way.time[-1] - way.time[0]))
        # On a treadmill the knee stays in about the same place.
        if speed < -_FASTEST_BACK:
            against = f"the knee moves backwards at {-speed:.2g} m/s, so knee.forward points against the"
            wrong.append(DataError(f"{way.file}: {against} walking direction"))
    wrong.raise_all()
    less = ": heel strikes and toe-offs are from shank_angle and less exact" if footfalls.events == SHANK else ""
    foot = source.columns.ankle_angle
    count = len(strides.taken)
    remarks = [
        *(*source.remarks, *footfalls.remarks, *unmeasured),
        *(f"stride from {each.start:.4g} to {each.end:.4g} s left out: {why}" for each, why in strides.left_out),
        *(f"{name} covers {own} of {count} strides" for name in curves if (own := len(curves[name].strides)) < count),
        *([] if FORCE in curves else [f"no vertical force{less}"]),
        *knee_remarks(source.columns.knee, walk, source.settings.stature),
        *([] if foot.terms else [f"ankle angle from the markers {foot.heel} and {foot.toe}; zero from the flat foot"]),
        *stride_remarks(mean_stride.curves),
        *(
            f"{message}: the data are noisy, or the walk is not steady"
            for _, message in _scatters(curves, REMARKED_SPREAD, REMARKED_MISFIT)
        ),
    ]
    settings = source.settings
    names = ", ".join(Path(table.file).name for table in source.tables)
    # A file states that it was made by a model, never that it was measured.
    origin: Origin = "imported" if all(table.kind == "measured" for table in source.tables) else "synthetic"
    times, shares = ([getattr(stride, name) for stride in strides.taken] for name in ("time", "stance_share"))
    # A table over percent does not state the number of its strides.
    is_mean_stride = any(table.is_mean_stride for table in source.tables)
    counted = f"Mean of {count} strides" if count > 1 else "One stride"
    gait = Gait(
        name=settings.name,
        title=settings.title or f"{'Mean stride' if is_mean_stride else counted}, {settings.side} foot",
        origin=origin,
        source=f"imported from {names}, {settings.side} foot; strides from the {footfalls.events.replace('_', ' ')}",
        body_mass=settings.body_mass or 0.0,
        stature=settings.stature,
        walking_speed=settings.walking_speed,
        stride_time=mean_stride.stride_time,
        stance_share=mean_stride.stance_share,
        stride_time_deviation=float(np.std(times, ddof=1)) if count > 1 else 0.0,
        stance_share_deviation=float(np.std(shares, ddof=1)) if count > 1 else 0.0,
        strides=count,
        **dict[str, Any]({name: curve.fitted[0] for name, curve in curves.items()}),
    )
    return ImportedGait(
        gait=gait,
        strides=strides.taken,
        left_out=tuple(stride for stride, _ in strides.left_out),
        curves=curves,
        events=footfalls.events,
        files=tuple(table.file for table in source.tables),
        remarks=tuple(dict.fromkeys(remarks)),
    )


def _curves_over_strides(
    source: GaitSource, footfalls: Footfalls, wrong: Faults
) -> tuple[dict[str, CurveStatistics], StrideSelection, list[str]]:
    """Return the curves over the selected strides, the selection, and a remark on each load without a measured stance.

    A stride is rejected if its duration differs from the median by more than LARGEST_STRIDE_CHANGE, or if it has lost
    samples. Problems are added to ``wrong``. Raises DataError, with all of them, without strides or without an angle.
    """
    cut_off = source.settings.low_pass
    recorded = footfalls.walk
    least = source.settings.least_strides or (1 if footfalls.is_one_cycle or footfalls.is_overground else LEAST_STRIDES)
    whole = usable_strides(recorded, footfalls.strides)
    # The median: one stop among ten strides would move a mean.
    median = float(np.median([stride.time for stride in whole])) if whole else 0.0
    kept = [stride for stride in whole if abs(stride.time - median) <= LARGEST_STRIDE_CHANGE * median]
    usual = f"{np.mean([stride.time for stride in kept]):.3g} s" if kept else ""
    odd = [stride for stride in whole if stride not in kept]
    unusual = [(stride, f"{stride.time:.3g} s long, the others are about {usual}") for stride in odd]
    counts = [(stride, max(lost_in(recorded[name], stride) for name in REQUIRED)) for stride in footfalls.strides]
    lost = [(stride, f"markers or angles lost in {count_of(count, 'frame')}") for stride, count in counts if count]
    shared = [(stride, "vertical_force, not shank_angle, shows another foot in it") for stride in footfalls.shared]
    usable = StrideSelection(tuple(kept), (*shared, *unusual, *lost), least)
    if len(kept) < least:
        wrong.append(DataError(_too_few(usable, footfalls)))
    if not kept:
        wrong.raise_all()
    covered = {name: [stride for stride in usable.taken if covers(footfalls, name, stride)] for name in recorded}
    # A load that no plate measured for a whole stance would otherwise be refused as one whose file is too short.
    uncovered = [name for name in LOADS if name in recorded and not covered[name]]
    unmeasured = [name for name in uncovered if any(is_within(recorded[name], stride) for stride in usable.taken)]
    walk = {name: signal for name, signal in recorded.items() if name not in unmeasured}
    moving = without_drop_outs(walk, source.tables, covered, usable, wrong)
    # Footfalls come from the unfiltered force, whose edges a low pass would move.
    smooth = walk if cut_off is None else {name: low_pass(signal, cut_off) for name, signal in walk.items()}
    curves = {
        name: _curve_of(name, signal, [stride for stride in covered[name] if stride in moving.taken])
        for name, signal in smooth.items()
    }
    strides = without_odd_shapes(curves, moving)
    remaining = {}
    for name, curve in curves.items():
        kept_rows = [row for row, stride in enumerate(curve.strides) if stride in strides.taken]
        if kept_rows:
            taken = tuple(curve.strides[row] for row in kept_rows)
            remaining[name] = replace(curve, curves=curve.curves[kept_rows], strides=taken)
            continue
        file = walk[name].file
        time = walk[name].time
        wrong.append(
            DataError(
                f"{file}: {name}, {time[0]:.4g} to {time[-1]:.4g} s, covers no whole stride (first stride: "
                f"{strides.taken[0].start:.4g} to {strides.taken[0].end:.4g} s)"
            )
        )
    if any(name not in remaining for name in REQUIRED):
        wrong.raise_all()
    remarks = [f"{name} is left out: not measured throughout the stance of any stride" for name in unmeasured]
    return remaining, strides, remarks


def _too_few(strides: StrideSelection, footfalls: Footfalls) -> str:
    """Return the message on too few strides, with the cause: events, covered time or gaps."""
    walk = {name: footfalls.walk[name] for name in (*REQUIRED, footfalls.events) if name in footfalls.walk}
    spans = ", ".join(f"{name} {signal.time[0]:.4g} to {signal.time[-1]:.4g} s" for name, signal in walk.items())
    events = f"{count_of(len(footfalls.strides), 'stride')} in the events"
    if not footfalls.strides:
        where = FORCE if FORCE in walk else SHANK
        events = f"{count_of(len(heel_strikes(where, walk)), 'heel strike')} in {where}; a stride needs two"
    # From the last sample before the longest gap to the first one after it.
    longest = max(
        0.0 if signal.lost is None else float(np.max(np.diff(signal.time[~signal.lost]))) for signal in walk.values()
    )
    gap = f"; the longest gap is {longest:.3g} s, and {setting_text('longest_gap')} fills up to {LONGEST_FILLED:g} s"
    return (
        f"{walk['shank_angle'].file}: has {count_of(len(strides.taken), 'whole stride')} covered by both angles and "
        f"events ({events}; {spans}), but {setting_text('least_strides')} is {strides.least}"
        f"{gap if longest > 0.0 else ''}"
    )


def without_drop_outs(
    walk: Mapping[str, Signal],
    tables: Sequence[MotionTable],
    covered: Mapping[str, Sequence[Stride]],
    strides: StrideSelection,
    wrong: Faults,
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
        # Plates that are summed rest in turn, so their sum is looked at.
        columns = (
            [(" + ".join(signal.columns), np.sum([np.abs(table.columns[each]) for each in signal.columns], axis=0))]
            if name in LOADS and len(signal.columns) > 1
            else [(column, table.columns[column]) for column in signal.columns]
        )
        for column, values in columns:
            for start, end in constant_stretches(table.time, values, spans):
                what = f"column {column!r} of {name} is constant from {start:.4g} to {end:.4g} s"
                with wrong:
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
    starts = np.concatenate([[0], moves + 1])
    ends = np.concatenate([moves, [values.size - 1]])
    long = time[ends] - time[starts] > LONGEST_HELD
    stretches = []
    for first, last in zip(starts[long].tolist(), ends[long].tolist(), strict=True):
        start = float(time[first])
        end = float(time[last])
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


def _curve_of(name: str, signal: Signal, strides: Sequence[Stride]) -> CurveStatistics:
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
    return CurveStatistics(name, curves, tuple(strides))


def acceleration_of(position: Floats, harmonics: int, stride_time: float) -> Floats:
    """Return the acceleration [m/s^2] of a position [m] over one stride with this stride time [s], at the same phases.

    The mean speed is subtracted, a Fourier series is fitted, and the series is differentiated twice.
    """
    phase = np.linspace(0.0, 1.0, position.size)
    # A straight line through both ends leaves a periodic rest, which a series can follow.
    curve, _ = fit_curve(position - (position[-1] - position[0]) * phase, harmonics)
    return curve.derivative(stride_time).derivative(stride_time).values_at(phase)


def _scatters(
    curves: Mapping[str, CurveStatistics], most_spread: float, most_misfit: float
) -> Iterator[tuple[str, str]]:
    """Yield each curve whose spread or misfit, as a fraction of the range, exceeds its limit, with a description."""
    for name, curve in curves.items():
        moved = float(np.ptp(curve.mean))
        if moved <= 0.0:
            continue
        spread = curve.spread / moved
        misfit = curve.fitted[1].root_mean_square / moved
        if spread > most_spread or misfit > most_misfit:
            yield (
                name,
                f"{name} has, relative to its range, a standard deviation between strides of {100.0 * spread:.0f} % "
                f"and an RMS error of its Fourier series of {100.0 * misfit:.1f} %",
            )
