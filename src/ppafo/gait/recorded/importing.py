"""Import of a gait from recorded files: tables, map, gaps, filter, strides, checks, mean curves and their series.

Curves over the stride: each brought to the same phases, their mean and their standard deviation.

Found here is what no leg does: columns that stay constant while the wearer walks, drop-outs that were filled with the
last value, and strides that scatter too much or that no series fits.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ppafo.errors import DataError, PpafoError, count_of, noted_in, raise_noted
from ppafo.gait.agreement import check_side, delay_remarks, size_remarks
from ppafo.gait.document import load_gait
from ppafo.gait.gait import HARMONICS, REQUIRED, Curve, FitError, Gait, Origin, fit_curve
from ppafo.gait.plausible import (
    MeanStride,
    SignSource,
    check_force_scale,
    check_plausible,
    force_remarks,
    moment_remarks,
    sign_remarks,
    standing_tilt,
    turning_remarks,
    zero_remarks,
)
from ppafo.gait.recorded.footfalls import (
    FORCE,
    LEAST_STRIDES,
    SHANK,
    Footfalls,
    Stride,
    find_footfalls,
    force_of_plates,
    strides_of_curve,
    strides_within,
    usable_strides,
)
from ppafo.gait.recorded.form import Convention
from ppafo.gait.recorded.mapping import GaitMap, ImportSettings, KneeMap, check_settings, column_names, unsaid_axes
from ppafo.gait.recorded.reading import FORMS, find_convention, read_table
from ppafo.gait.recorded.table import MotionTable, fill_gaps
from ppafo.gait.recorded.walk import (
    LOADS,
    Person,
    Signal,
    acceleration_of,
    check_way,
    knee_remarks,
    low_pass,
    walk_signals,
)
from ppafo.signals.recording import Floats
from ppafo.units import format_quantity

SAMPLES = 101
PHASES = np.linspace(0.0, 1.0, SAMPLES)
"""Phases [strides] of every normalised curve, from 0 to 1."""

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
        inside = (PHASES > _UNLOADED_FORCE) & (fraction - _UNLOADED_FORCE > PHASES)
        at, first = PHASES[inside], float(mean[inside][0])
        # The line over the swing goes on into the next stride, where the stance begins again.
        mean = np.interp(PHASES, [*at, 1.0 + at[0]], [*mean[inside], first], period=None)
        deviation = np.where(inside, deviation, 0.0)
    return CurveStatistics(curves, mean, deviation, tuple(strides))


@dataclass(frozen=True, slots=True)
class Strides:
    """Strides taken, strides left out, each with the reason, and the least number to take."""

    taken: tuple[Stride, ...]
    left_out: tuple[tuple[Stride, str], ...]
    least: int

    def without(self, odd: Sequence[Stride], why: str, else_refused: str = "") -> "Strides":
        """Return these without some; where too few remain all stay, or DataError with the words for that case."""
        kept = tuple(stride for stride in self.taken if stride not in odd)
        if len(kept) >= self.least:
            return Strides(kept, (*self.left_out, *((stride, why) for stride in odd)), self.least)
        if else_refused:
            raise DataError(else_refused)
        return self


def of_usual_time(strides: Sequence[Stride], least: int) -> Strides:
    """Return strides without those whose time differs from the median by more than LARGEST_STRIDE_CHANGE of it."""
    if not strides:
        return Strides((), (), least)
    # The median: one stop among ten strides would move a mean.
    median = float(np.median([stride.time for stride in strides]))
    kept = [stride for stride in strides if abs(stride.time - median) <= LARGEST_STRIDE_CHANGE * median]
    why = "{:.3g} s long, the others are about " + f"{np.mean([stride.time for stride in kept]):.3g} s"
    return Strides(
        tuple(kept), tuple((stride, why.format(stride.time)) for stride in strides if stride not in kept), least
    )


LONGEST_HELD = 0.1
"""Seconds that a column may keep one value within the strides."""

_ABOUT_STANCE = 0.05
"""Of the stride, at either end of the stance, in which a load may rest too."""
_COARSE = 0.001
"""Fraction of the range; a sensor with coarser steps keeps a value where its curve turns round."""
_STEPS_OF_REST = 3.0
"""Smallest steps by which such a sensor may enter and leave a value at which the leg rests."""


def without_drop_outs(
    walk: Mapping[str, Signal],
    tables: Sequence[MotionTable],
    covered: Mapping[str, Sequence[Stride]],
    strides: Strides,
    wrong: list[PpafoError],
) -> Strides:
    """Leave out strides in which a column keeps one value for more than 0.1 s; a load may in swing.

    Loads are looked at in the strides that they cover. A column that never moves is no drop-out, and a stretch that a
    coarse sensor enters and leaves by its smallest step is none either. Where too few strides would be left all stay,
    and that is added to ``wrong``.
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
                what = f"column {column!r} of {name} keeps one value from {start:.4g} to {end:.4g} s"
                with noted_in(wrong):
                    strides = strides.without(
                        [stride for stride in strides.taken if stride.start < end and start < stride.end],
                        f"{what}: a drop-out was filled with it",
                        f"{table.file}: {what} while the wearer walks: a drop-out was filled with it; cut the file "
                        "there and give the longer part",
                    )
    return strides


def constant_stretches(time: Floats, values: Floats, spans: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return start and end [s] of all stretches with one value that cover more than 0.1 s of the spans."""
    moves = np.flatnonzero(np.diff(values) != 0.0)
    if moves.size == 0:
        return []
    starts, ends = np.concatenate([[0], moves + 1]), np.concatenate([moves, [values.size - 1]])
    long = time[ends] - time[starts] > LONGEST_HELD
    stretches = []
    for first, last in zip(starts[long].tolist(), ends[long].tolist(), strict=True):
        start, end = float(time[first]), float(time[last])
        inside = sum(max(0.0, min(end, high) - max(start, low)) for low, high in spans)
        if inside > LONGEST_HELD and not _by_coarse_steps(values, first, last):
            stretches.append((start, end))
    return stretches


ODD_SHAPE, ODD_PHASE, ODD_AGAINST_OTHERS = 0.25, 0.4, 4.0
"""A stride is odd whose curve is off the median one by these fractions of its range, RMS over the stride or at any one
phase, and by as many times the median distance of all strides. Impaired walking varies more, but then in every stride.
"""
_FEWEST_TO_COMPARE = 3
_MOST_ODD = 0.4
"""Fraction of the strides; where more are odd, none is the exception."""


def without_odd_shapes(curves: Mapping[str, CurveStatistics], strides: Strides) -> Strides:
    """Leave out strides whose curve is unlike all others: a stumble, a turn, markers that were exchanged."""
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
                [stride for stride in odd if stride in strides.taken], f"{name} is unlike all others"
            )
    return strides


def _by_coarse_steps(values: Floats, first: int, last: int) -> bool:
    """Return whether the value changes by a few of a coarse sensor's smallest steps on both sides of a stretch."""
    steps = np.abs(np.diff(values))
    # Rounding makes equal steps of a sensor differ in the last digits.
    smallest = 1.001 * float(np.min(steps[steps > 0.0]))
    beside = [float(steps[place]) for place in (first - 1, last) if 0 <= place < steps.size]
    return (
        smallest > _COARSE * float(np.nanmax(values) - np.nanmin(values)) and max(beside) <= _STEPS_OF_REST * smallest
    )


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
    """Raise DataError for curves that scatter by a quarter of their range, or that no series fits."""
    raise_noted(
        [
            DataError(
                f"{walk[scatter.name].file}: {_statement(scatter)}; at most {100.0 * REFUSED_SPREAD:.0f} % and "
                f"{100.0 * REFUSED_MISFIT:.0f} % are accepted; {_REMEDY}"
            )
            for scatter in _scatters(curves, errors)
            if scatter.spread > REFUSED_SPREAD or scatter.misfit > REFUSED_MISFIT
        ]
    )


def _statement(scatter: _Scatter) -> str:
    return (
        f"{scatter.name} differs between strides by {100.0 * scatter.spread:.0f} % of its range and its series misses "
        f"{100.0 * scatter.misfit:.1f} % (standard deviation, root mean square)"
    )


def _scatters(curves: Mapping[str, CurveStatistics], errors: Mapping[str, FitError]) -> Iterator[_Scatter]:
    for name, curve in curves.items():
        moved = float(np.ptp(curve.mean))
        if moved > 0.0:
            yield _Scatter(name, curve.spread / moved, errors[name].root_mean_square / moved)


_SAME = 0.02
"""Fraction by which two statements of one body mass may differ without a remark."""


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """Tables, map and signals of a recording, settings with what the files say, and remarks on what was mended."""

    tables: Sequence[MotionTable]
    columns: GaitMap
    walk: Mapping[str, Signal]
    settings: ImportSettings
    signs_from: SignSource
    remarks: tuple[str, ...]


def read_source(files: Sequence[str | Path], settings: ImportSettings, wrong: list[PpafoError]) -> Source:
    """Return the signals in recorded files; what is wrong but leaves both angles usable is added to ``wrong``.

    DataError for what ends the import, with everything in ``wrong``.
    """
    if not files:
        raise DataError("no file was given; a gait needs at least the angles of shank and ankle")
    cut, tables = (settings.longest_gap, settings.start, settings.end), []
    for path in files:
        with noted_in(wrong):
            tables.append(read_table(path, *cut, settings.form))
    if len(tables) < len(files):
        raise_noted(wrong)
    if settings.columns is None:
        # Only without a map: a user's map names the columns as the file has them.
        tables = [FORMS[table.form].arrange(table) for table in tables]
    settings, said = _with_subject(settings, tables, wrong)
    # Without a body mass loads are looked at per kg of 1 kg, and scaled to 1 below.
    person = Person(settings.body_mass or 1.0, settings.stature)
    convention = (
        find_convention(tables, settings.side, person.body_mass)
        if settings.columns is None
        else Convention(settings.columns)
    )
    columns = convention.columns
    if settings.ankle_neutral is not None:
        neutral = {"neutral": format_quantity(settings.ankle_neutral, "rad")}
        columns = columns.model_copy(update={"ankle_angle": columns.ankle_angle.model_copy(update=neutral)})
    mapped = [getattr(columns, name) for name in GaitMap.model_fields if name != "schema_version"]
    names = [name.removeprefix("-") for mapping in mapped if mapping is not None for name in column_names(mapping)]
    # Only the columns in use: a gap elsewhere needs no word.
    tables = [fill_gaps(table, names, settings.longest_gap) for table in tables]
    walk = walk_signals(tables, columns, person, settings.columns is None, wrong)
    if settings.body_mass is None:
        walk |= {name: _of_one(walk[name]) for name in ("ankle_moment", FORCE) if name in walk}
    if convention.plates and FORCE not in walk and settings.body_mass is not None:
        with noted_in(wrong):
            force, more = force_of_plates(tables, convention.plates, walk["shank_angle"], person.body_mass)
            walk |= {} if force is None else {FORCE: force}
            said += more
    mended = [f"{Path(table.file).name}: {remark}" for table in tables for remark in table.remarks]
    mended += _ends(walk, tables)
    said += [] if settings.columns is None else unsaid_axes(settings.columns)
    signs_from: SignSource = "columns" if settings.columns is None else "map"
    return Source(tables, columns, walk, settings, signs_from, (*said, *convention.remarks, *mended))


def _of_one(signal: Signal, is_upwards: bool = False) -> Signal:
    """Return a load whose largest number is 1: its scale is wrong or not known, and the rest is looked at with it."""
    largest = float(signal.values[np.argmax(np.abs(signal.values))]) or 1.0
    return replace(signal, values=signal.values / (largest if is_upwards else abs(largest)))


def _with_subject(
    settings: ImportSettings, tables: Sequence[MotionTable], wrong: list[PpafoError]
) -> tuple[ImportSettings, list[str]]:
    """Return the settings with body mass and stature that a C3D file states; what the user states wins.

    A body mass that is stated nowhere is added to ``wrong``.
    """
    masses, statures = (
        [(table.file, value) for table in tables if table.trial and (value := getattr(table.trial, name)) is not None]
        for name in ("body_mass", "stature")
    )
    said = []
    if settings.body_mass is None and not masses:
        wrong.append(
            DataError(
                f"{tables[0].file}: does not state the body mass; give it, such as --body-mass '62 kg' (until then "
                "loads are taken relative to their largest value)"
            )
        )
    elif settings.body_mass is None:
        file, mass = masses[0]
        settings = replace(settings, body_mass=mass)
        said.append(f"body mass {mass:.4g} kg, as {Path(file).name} states")
    elif masses and abs(masses[0][1] - settings.body_mass) > _SAME * settings.body_mass:
        said.append(
            f"body mass {settings.body_mass:.4g} kg as stated; {Path(masses[0][0]).name} states {masses[0][1]:.4g} kg"
        )
    if settings.stature is None and statures:
        settings = replace(settings, stature=statures[0][1])
        said.append(f"stature {statures[0][1]:.4g} m, as {Path(statures[0][0]).name} states")
    return settings, said


def _ends(walk: Mapping[str, Signal], tables: Sequence[MotionTable]) -> list[str]:
    """Return a remark on each motion that was not seen at an end of its file, and on loads that were not measured."""
    spans = {table.file: (float(table.time[0]), float(table.time[-1])) for table in tables}
    seen: dict[tuple[float, float, float, float], list[str]] = {}
    loads: dict[int, list[str]] = {}
    for name, signal in walk.items():
        low, high = spans[signal.file]
        if signal.time[0] > low or signal.time[-1] < high:
            seen.setdefault((float(signal.time[0]), float(signal.time[-1]), low, high), []).append(name)
        if signal.absent is not None:
            loads.setdefault(round(100.0 * float(signal.absent.mean())), []).append(name)
    said = [
        f"{', '.join(names)} from {first:.4g} to {last:.4g} s: not seen in the rest of {low:.4g} to {high:.4g} s"
        for (first, last, low, high), names in seen.items()
    ]
    return said + [
        f"{', '.join(names)}: absent in {percent} % of the record, where no plate measured this foot"
        for percent, names in loads.items()
    ]


LARGEST_STRIDE_CHANGE = 0.25
"""Fraction of the median stride time; a stride that differs by more has a missed event, or is not steady walking."""


@dataclass(frozen=True, slots=True, eq=False)
class ImportedGait:
    """The gait, its strides, the curves of each stride by name, errors of the series, and remarks.

    ``events`` says where the strides come from: ``vertical_force``, ``shank_angle`` or ``events of the file``.
    """

    gait: Gait
    strides: tuple[Stride, ...]
    left_out: tuple[Stride, ...]
    curves: Mapping[str, CurveStatistics]
    fit_errors: Mapping[str, FitError]
    events: str
    files: tuple[str, ...]
    remarks: tuple[str, ...] = field(default=())


def import_gait(files: Sequence[str | Path], settings: ImportSettings) -> ImportedGait:
    """Return the mean stride in recorded files of one walk of one person on one clock.

    They are of any form of ``reading.FORMS``: .mot, .sto, .csv, .txt, .tsv, .c3d, .trc, .mat.

    Strides come from the vertical force where there is one, else from events of the file or from the shank. DataError
    names all that is wrong with file, column and row, and what to do: what is wrong with one curve is noted, and the
    others are looked at without it. What was mended is among the remarks.
    """
    check_settings(settings)
    wrong: list[PpafoError] = []
    source = read_source(files, settings, wrong)
    settings = source.settings
    walk: Mapping[str, Signal] = source.walk
    # A force in a wrong unit is noted, and scaled to 1 so that its events are still found.
    force = walk.get(FORCE)
    if force is not None:
        try:
            check_force_scale(force.file, force.values, source.signs_from)
        except DataError as error:
            wrong.append(error)
            walk = {**walk, FORCE: _of_one(force, is_upwards=True)}
    footfalls = None
    with noted_in(wrong):
        footfalls = find_footfalls(walk, source.tables, settings.side, settings.least_strides)
    if footfalls is None:
        raise_noted(wrong)
    walk, events, cut = footfalls.walk, footfalls.events, footfalls.strides
    least = settings.least_strides or (1 if footfalls.is_one_cycle or footfalls.is_overground else LEAST_STRIDES)
    strides = of_usual_time(usable_strides(walk, cut), least)
    with noted_in(wrong):
        _check_enough(strides, cut, {name: walk[name] for name in (*REQUIRED, events) if name in walk})
    if not strides.taken:
        raise_noted(wrong)
    covered = {name: strides_of_curve(footfalls, name, signal, strides.taken) for name, signal in walk.items()}
    # A load that no plate measured for a whole stance would otherwise look like one whose file is too short.
    unmeasured = [
        name for name in LOADS if name in walk and not covered[name] and strides_within(walk[name], strides.taken)
    ]
    walk = {name: signal for name, signal in walk.items() if name not in unmeasured}
    strides = without_drop_outs(walk, source.tables, covered, strides, wrong)
    # Footfalls come from the unfiltered force, whose edges a low pass would move.
    smooth = walk if settings.low_pass is None else {n: low_pass(s, settings.low_pass) for n, s in walk.items()}
    curves = {
        name: statistics(name, signal, [stride for stride in covered[name] if stride in strides.taken])
        for name, signal in smooth.items()
    }
    strides = without_odd_shapes(curves, strides)
    for name, curve in list(curves.items()):
        kept = [stride in strides.taken for stride in curve.strides]
        if not any(kept):
            signal = walk[name]
            wrong.append(
                DataError(
                    f"{signal.file}: {name} goes from {signal.time[0]:.4g} to {signal.time[-1]:.4g} s and covers no "
                    f"whole stride ({strides.taken[0].start:.4g} to {strides.taken[0].end:.4g} s is the first); give a "
                    "longer file, or leave it out"
                )
            )
            del curves[name]
        elif not all(kept):
            curves[name] = over_strides(
                name, curve.curves[kept], [stride for stride in curve.strides if stride in strides.taken]
            )
    missing = [f"{name} is left out: in no whole stride was it measured throughout the stance" for name in unmeasured]
    remarks = [*source.remarks, *footfalls.remarks, *missing]
    if any(name not in curves for name in REQUIRED):
        raise_noted(wrong)
    walk = {name: signal for name, signal in walk.items() if name in curves}
    return _finish(source, replace(footfalls, walk=walk), curves, strides, remarks, wrong)


def _finish(
    source: Source,
    footfalls: Footfalls,
    curves: Mapping[str, CurveStatistics],
    strides: Strides,
    remarks: Sequence[str],
    wrong: list[PpafoError],
) -> ImportedGait:
    """Return the gait of mean curves that legs can have; DataError where any cannot, with everything in ``wrong``."""
    taken, walk, settings, signs_from = strides.taken, footfalls.walk, source.settings, source.signs_from
    share, time = (
        float(np.mean([stride.stance_share for stride in taken])),
        float(np.mean([stride.time for stride in taken])),
    )
    means = {name: curve.mean for name, curve in curves.items()}
    fitted = {name: fit_curve(curve.mean, HARMONICS[name], curve.spread) for name, curve in curves.items()}
    errors = {name: error for name, (_, error) in fitted.items()}
    files = {name: signal.file for name, signal in walk.items()}
    mean_stride = MeanStride(files, means, share, time, signs_from, _is_one_marker(source.columns.knee))
    with noted_in(wrong):
        check_scatter(curves, errors, walk)
    with noted_in(wrong):
        # The ankle of the other foot looks like a wrong zero to what follows.
        check_side(mean_stride, load_gait())
        check_plausible(mean_stride)
    with noted_in(wrong):
        check_way(walk, signs_from)
    raise_noted(wrong)
    gait = _gait(settings, source.tables, taken, {name: curve for name, (curve, _) in fitted.items()}, footfalls.events)
    said = [*remarks, *_remarks(curves, strides, footfalls.events)]
    said += knee_remarks(source.columns.knee, walk, settings.stature)
    said += sign_remarks(means["shank_angle"], means["ankle_angle"])
    said += moment_remarks(means["ankle_moment"]) if "ankle_moment" in means else []
    said += turning_remarks(mean_stride)
    said += delay_remarks(mean_stride) + size_remarks(mean_stride)
    said += _sampling_remarks(walk, taken)
    tilt = standing_tilt(means["shank_angle"], means["ankle_angle"])
    sign, taken_off = source.columns.ankle_angle.sign_and_neutral()
    # The reading of the file that would be neutral.
    neutral = f"{float(np.degrees(taken_off)) + sign * tilt:.1f} deg"
    said += zero_remarks(tilt, f"--ankle-neutral '{neutral}', or ankle_angle.neutral in a gait map, corrects it")
    # A line on each curve that scatters more than a steady walk does.
    said += [
        f"{_statement(scatter)}: that is noise, or the walk is not steady; {_REMEDY}"
        for scatter in _scatters(curves, errors)
        if scatter.spread > REMARKED_SPREAD or scatter.misfit > REMARKED_MISFIT
    ]
    names = tuple(table.file for table in source.tables)
    return ImportedGait(
        gait,
        taken,
        tuple(stride for stride, _ in strides.left_out),
        curves,
        errors,
        footfalls.events,
        names,
        tuple(dict.fromkeys(said)),
    )


def _is_one_marker(knee: KneeMap | None) -> bool:
    """Tell whether a map takes both coordinates of the knee from one marker, whose unit is one."""
    if knee is None or knee.thigh is not None or len(knee.forward) != 1 or len(knee.up) != 1:
        return False
    forward, up = (terms[0].removeprefix("-").rpartition(".")[0] for terms in (knee.forward, knee.up))
    return forward == up != ""


def _check_enough(strides: Strides, usable: list[Stride], walk: Mapping[str, Signal]) -> None:
    taken, least = len(strides.taken), strides.least
    if taken >= least:
        return
    spans = ", ".join(f"{name} {signal.time[0]:.4g} to {signal.time[-1]:.4g} s" for name, signal in walk.items())
    count = count_of(taken, "whole stride")
    where = list(walk)[-1]
    events = (
        f"{len(usable)} in the events" if usable else f"no heel strikes were found in {where}: is it the right column?"
    )
    raise DataError(
        f"{walk['shank_angle'].file}: has {count} within angles and events ({events}; {spans}), {least} are needed; "
        "give a longer recording, or accept fewer with --minimum-strides"
    )


def _spread(values: Sequence[float]) -> float:
    return float(np.std(values, ddof=1)) if len(values) > 1 else 0.0


def _gait(
    settings: ImportSettings,
    tables: Sequence[MotionTable],
    strides: Sequence[Stride],
    curves: Mapping[str, Curve],
    events: str,
) -> Gait:
    origin: Origin = "measured" if all(table.kind == "measured" for table in tables) else "synthetic"
    names = ", ".join(Path(table.file).name for table in tables)
    return Gait(
        name=settings.name,
        title=settings.title or f"Mean of {len(strides)} strides, {settings.side} foot",
        origin=origin,
        source=f"imported from {names}, {settings.side} foot; strides from the {events.replace('_', ' ')}",
        body_mass=settings.body_mass or 0.0,
        stature=settings.stature,
        walking_speed=settings.walking_speed,
        stride_time=float(np.mean([stride.time for stride in strides])),
        stance_share=float(np.mean([stride.stance_share for stride in strides])),
        stride_time_deviation=_spread([stride.time for stride in strides]),
        stance_share_deviation=_spread([stride.stance_share for stride in strides]),
        strides=len(strides),
        shank_angle=curves["shank_angle"],
        ankle_angle=curves["ankle_angle"],
        ankle_moment=curves.get("ankle_moment"),
        vertical_force=curves.get("vertical_force"),
        centre_of_pressure=curves.get("centre_of_pressure"),
        knee_forward=curves.get("knee_forward"),
        knee_up=curves.get("knee_up"),
    )


_COARSE_RATE = 50.0
"""Samples a second; below it an event is known to no better than a hundredth of a stride."""
_NOISY_FORCE = 0.02
"""Body weights, standard deviation in swing; the events are at 0.05 and 0.03."""
_WITHIN_SWING = 0.1
"""Of the swing, at either end, in which the foot may still be on the plate, or again."""


def _sampling_remarks(walk: Mapping[str, Signal], strides: Sequence[Stride]) -> list[str]:
    """Return which curves have few samples, and by how much the force scatters while the foot is in the air."""
    rates: dict[int, list[str]] = {}
    for name, signal in walk.items():
        if signal.rate < _COARSE_RATE:
            rates.setdefault(round(signal.rate), []).append(name)
    said = [
        f"{', '.join(names)}: {rate} samples a second; heel strikes and toe-offs are known to about "
        f"{500.0 / rate:.0f} ms"
        for rate, names in rates.items()
    ]
    force = walk.get("vertical_force")
    if force is None:
        return said
    spans = [(stride.toe_off, stride.end, _WITHIN_SWING * (stride.end - stride.toe_off)) for stride in strides]
    # Only the middle of the swing: at its ends the foot may still be on the plate.
    swings = [force.values[(force.time > off + slack) & (force.time < end - slack)] for off, end, slack in spans]
    scatter = max((float(np.std(values)) for values in swings if values.size > 1), default=0.0)
    if scatter > _NOISY_FORCE:
        said.append(
            f"the vertical force scatters by {scatter:.2g} body weights while the foot is in the air: events are found "
            "at 0.05 and 0.03; a low pass of the plate, or --low-pass, makes them surer"
        )
    return said


def _remarks(curves: Mapping[str, CurveStatistics], strides: Strides, events: str) -> list[str]:
    remarks = [
        f"stride from {stride.start:.4g} to {stride.end:.4g} s left out: {why}" for stride, why in strides.left_out
    ]
    remarks += [
        f"{name} covers {len(curve.strides)} of {len(strides.taken)} strides"
        for name, curve in curves.items()
        if len(curve.strides) < len(strides.taken)
    ]
    if "vertical_force" in curves:
        return remarks + force_remarks(curves["vertical_force"].mean)
    less = ": heel strikes and toe-offs come from the shank and are less exact" if events == SHANK else ""
    return [*remarks, f"no vertical force{less}; a column of another name needs a gait map (--map)"]
