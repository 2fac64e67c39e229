"""Recording from which a gait is imported: tables, gait map and signals of its files, gaps filled, and remarks.

Each curve is computed from the one table that contains its columns: directly, from lines between markers (shank lean,
and ankle angle of the foot relative to the shank), or, for the knee, from hip and thigh.
"""

import math
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.errors import DataError, Faults
from ppafo.gait.gait import REQUIRED
from ppafo.gait.plausible import SHANK_RANGE, MeanStride, ankle_faults_alone, check_force_scale, moment_faults
from ppafo.gait.recorded.footfalls import FORCE, force_of_plates
from ppafo.gait.recorded.form import Convention, GaitForm
from ppafo.gait.recorded.forms.markers import convention_of_map
from ppafo.gait.recorded.mapping import (
    CURVES,
    AngleMap,
    ForceMap,
    GaitMap,
    ImportSettings,
    MomentMap,
    PressureMap,
    ShankMap,
    Side,
    setting_text,
    unsigned_names,
)
from ppafo.gait.recorded.signal import (
    LOADS,
    CurveColumns,
    Signal,
    check_recorded,
    find_columns,
    knee_signals,
    refuse_missing,
    with_absence,
    without_ends,
)
from ppafo.gait.recorded.table import (
    MotionTable,
    counted_table,
    cut_table,
    fill_gaps,
    marker_of,
    mean_stride_table,
    without_lost_markers,
)
from ppafo.kinds import Kinds
from ppafo.plugins import nearest_kind
from ppafo.signals.recording import Floats
from ppafo.units import format_quantity
from ppafo.wording import one_line

# The forms of gait recordings, tables of files in any of them, and the one map of files that come without one.

FORMS: Kinds[GaitForm] = Kinds(
    "ppafo.gait_forms",
    "gait form",
    GaitForm,
    {
        "opensim": "ppafo.gait.recorded.forms.opensim:FORM",
        "nexus": "ppafo.gait.recorded.forms.motion_capture:NEXUS",
        "qualisys": "ppafo.gait.recorded.forms.motion_capture:QUALISYS",
        "motive": "ppafo.gait.recorded.forms.motion_capture:MOTIVE",
        "bts": "ppafo.gait.recorded.forms.motion_capture:BTS",
        "dflow": "ppafo.gait.recorded.forms.motion_capture:DFLOW",
        "csv": "ppafo.gait.recorded.forms.comma_separated:FORM",
        "c3d": "ppafo.gait.recorded.forms.c3d:FORM",
        "trc": "ppafo.gait.recorded.forms.motion_capture:TRC",
        "matlab": "ppafo.gait.recorded.forms.matlab:FORM",
    },
)
_SLOW = np.radians(25.0)
"""Angular velocity [rad/s] below which the foot stands flat while the shank leans forward."""
_LEAST_FLAT = 0.1
"""Least duration of flat foot [s] for the zero of the ankle angle."""
_SHORTEST_WALK = 1.0
"""Duration [s] below which a record may contain a part of a stride only, with little rotation of the shank."""
_LEAST_UPRIGHT = 0.5
"""Least vertical component of the mean line from knee to ankle, relative to its length [-]."""
_RIGHT_ANGLE = 0.5 * np.pi
"""Ankle angle [rad] with a vertical shank and a flat foot."""
_UNITS = {
    "shank_angle": ("rad",),
    "ankle_angle": ("rad",),
    "ankle_moment": ("N m/kg", "N m"),
    "vertical_force": ("", "N", "N/kg"),
    "centre_of_pressure": ("m",),
}
"""SI units of the curves in a gait map, with the package's own unit first."""
_POSITIVE = ("ankle_in_front", "plantarflexion", "up", "forward")
"""Directions in a gait map that are positive in this package too."""

MappedCurve = ShankMap | AngleMap | MomentMap | ForceMap | PressureMap
"""Entry of a gait map for a single curve; the knee, with two curves, is separate."""
_SAME = 0.02
"""Relative difference up to which two statements of the body mass count as equal."""
_UNIT_BODY_MASS = 1.0
"""Body mass [kg] that divides the loads of a person of unknown body mass."""


def walk_signals(
    tables: Sequence[MotionTable],
    columns: GaitMap,
    body_mass: float,
    stature: float | None,
    required: Set[str],
    wrong: Faults,
) -> dict[str, Signal]:
    """Return the signals of a recorded walk by curve; problems with their columns are added to ``wrong``.

    Loads are divided by ``body_mass`` [kg] or by the body weight; ``stature`` [m] gives the length of the thigh.

    Both angles and the curves of a user's map (``required``) must have columns; the others may be absent. A motion
    starts at its first valid sample and ends at its last; a load is 0 where it was not measured.
    Raises DataError if no file has an angle, with all problems in ``wrong``.
    """
    angles = {name: unsigned_names(getattr(columns, name)) for name in REQUIRED}
    if not any(table.columns.keys() >= set(names) for table in tables for names in angles.values()):
        with wrong:
            refuse_missing(angles, tables)
        wrong.raise_all()
    walk: dict[str, Signal] = {}
    # The shank stands first: an ankle from markers of the foot turns against it.
    for name in _UNITS:
        mapped = getattr(columns, name)
        found = None
        with wrong:
            found = find_columns(name, mapped, tables, name not in {*required, *REQUIRED})
            if found is None:
                continue
            if not isinstance(mapped, AngleMap) or mapped.terms is not None:
                signal = _curve_of(name, found, mapped, body_mass)
            elif "shank_angle" in walk:
                signal = foot_markers_angle(found, mapped, walk["shank_angle"])
            else:
                continue
            signal = replace(signal, columns=tuple(column for _, column in found.terms))
            walk[name] = with_absence(signal) if name in LOADS else without_ends(signal)
        if isinstance(mapped, ShankMap) and found is not None and name in walk:
            # In a recording that is no walk, other faults do not matter.
            check_walks(walk[name], found, mapped)
    with wrong:
        knee = knee_signals(columns.knee, tables, stature, "knee" not in required)
        walk |= {name: without_ends(signal) for name, signal in knee.items()}
    return walk


def _curve_of(name: str, columns: CurveColumns, mapped: MappedCurve, body_mass: float) -> Signal:
    """Return the signal of a curve in SI units and package signs; loads are relative to ``body_mass`` [kg]."""
    if isinstance(mapped, ShankMap) and mapped.terms is None:
        ahead, up = between_markers(columns, mapped, str(mapped.knee), str(mapped.ankle))
        values = np.asarray(np.arctan2(ahead, -up), dtype=np.float64)
        unit = "rad"
    else:
        values, unit = columns.in_unit(mapped.unit, _UNITS[name])
    if isinstance(mapped, AngleMap):
        sign, neutral = mapped.sign_and_neutral()
        return Signal(columns.table.file, columns.table.time, _RIGHT_ANGLE + sign * (values - neutral))
    # A moment is per body mass, and a force in body weights.
    over = {"N m": body_mass, "N": body_mass * STANDARD_GRAVITY, "N/kg": STANDARD_GRAVITY}.get(unit, 1.0)
    sign = 1.0 if mapped.positive in _POSITIVE else -1.0
    return Signal(columns.table.file, columns.table.time, sign * values / over)


def between_markers(
    columns: CurveColumns, mapped: ShankMap | AngleMap, first: str, second: str
) -> tuple[Floats, Floats]:
    """Return the distance of the second marker ahead of the first, and the height above it, in the unit of the file."""
    marker = {name: columns.table.columns[name] for _, name in columns.terms}
    for name, values in marker.items():
        check_recorded(values, f"{columns.table.file}: column {name!r}")
    forward, vertical = mapped.axes
    axis = forward.removeprefix("-")
    sign = -1.0 if forward.startswith("-") else 1.0
    ahead = sign * (marker[f"{second}.{axis}"] - marker[f"{first}.{axis}"])
    return ahead, marker[f"{second}.{vertical}"] - marker[f"{first}.{vertical}"]


def foot_markers_angle(columns: CurveColumns, mapped: AngleMap, shank: Signal) -> Signal:
    """Return the ankle angle [rad] from heel and toe markers; with a flat foot it is 90 deg plus the shank angle.

    The neutral angle of the map is subtracted.
    """
    ahead, up = between_markers(columns, mapped, str(mapped.heel), str(mapped.toe))
    pitch = Signal(columns.table.file, columns.table.time, np.arctan2(up, ahead))
    recorded = without_ends(pitch)
    inside = (recorded.time >= shank.time[0]) & (recorded.time <= shank.time[-1])
    time = recorded.time[inside]
    values = recorded.values[inside]
    lean = np.interp(time, shank.time, shank.values)
    lost = np.zeros(time.size, dtype=np.bool_) if recorded.lost is None else recorded.lost[inside]
    if shank.lost is not None:
        lost = lost | (np.interp(time, shank.time, shank.lost.astype(np.float64)) > 0.0)
    # Flat: the foot hardly turns while the shank leans over it. The median of these samples is the zero.
    flat = (
        (np.abs(np.gradient(values, time)) < _SLOW) & (np.gradient(lean, time) < 0.0) & ~lost
        if time.size >= 3
        else np.zeros(time.size, dtype=np.bool_)
    )
    # Less than a tenth of a second of flat foot may be a pause of the swing.
    if np.count_nonzero(flat) < _LEAST_FLAT * recorded.rate:
        raise DataError(
            f"{columns.table.file}: the neutral ankle angle is unknown, because the foot (from {mapped.heel!r} to "
            f"{mapped.toe!r}) is never at rest while the shank leans forward"
        )
    sign, neutral = mapped.sign_and_neutral()
    angle = _RIGHT_ANGLE + lean - (values - float(np.median(values[flat]))) - sign * neutral
    return Signal(columns.table.file, time, angle, lost=lost if lost.any() else None)


def check_walks(shank: Signal, columns: CurveColumns, mapped: ShankMap) -> None:
    """Raise DataError for a shank with a wrong vertical axis, or with too small a rotation for walking."""
    if shank.time[-1] - shank.time[0] < _SHORTEST_WALK:
        return
    low, high = SHANK_RANGE
    travel = float(np.ptp(np.degrees(shank.values)))
    if mapped.terms is None:
        ahead, up = between_markers(columns, mapped, str(mapped.knee), str(mapped.ankle))
        if abs(np.nanmean(up)) < _LEAST_UPRIGHT * math.hypot(np.nanmean(ahead), np.nanmean(up)):
            raise DataError(
                f"{shank.file}: shank_angle.vertical = {mapped.axes[1]!r}, but the line from {mapped.knee!r} to "
                f"{mapped.ankle!r} is no shank upright along it"
            )
    # Radians that are called degrees have no event either, but a unit as a remedy.
    elif low <= np.degrees(travel) <= high:
        return
    if travel < low:
        raise DataError(
            f"{shank.file}: shank_angle has a range of {travel:.2g} deg in the whole recording (walking: at least "
            f"{low:g} deg)"
        )


def form_of(path: str | Path, name: str = "") -> GaitForm:
    """Return the file format by name, or the first format that recognises the file; raises DataError if none does."""
    if name:
        form = FORMS.get(name)
        if form is None:
            hint = nearest_kind(name, FORMS, GaitForm)
            raise DataError(f"there is no gait format '{one_line(name)}'{hint}; available: {', '.join(FORMS)}")
        return form
    # Any form may know the suffix: forms of other packages are loaded before it is refused.
    FORMS.load_all()
    # Forms of other packages are asked first: a user who installs one wants it for his files.
    forms = sorted(FORMS.loaded().values(), key=lambda form: FORMS.is_own(form.name))
    suffix = Path(path).suffix.lower()
    for form in forms:
        if suffix in form.suffixes and form.recognises(path):
            return form
    *others, last = dict.fromkeys(suffix for form in FORMS.loaded().values() for suffix in form.suffixes)
    raise DataError(f"{path}: is not a {', '.join(others)} or {last} file")


def read_table(
    path: str | Path, longest_gap: float = 0.0, start: float | None = None, end: float | None = None, form: str = ""
) -> MotionTable:
    """Return the table in a file of any format, from ``start`` to ``end`` [s]; ``form`` names the format.

    Gaps of up to ``longest_gap`` [s] are interpolated, with a remark on each gap.
    """
    chosen = form_of(path, form)
    table = replace(chosen.read(path), form=form or chosen.name)
    return table if table.problem else cut_table(table, longest_gap, start, end)


def find_convention(tables: Sequence[MotionTable], side: Side, body_mass: float) -> Convention:
    """Return the convention that fits the content of files; ``body_mass`` [kg] tells moments from moments per mass."""
    names = sorted({table.form for table in tables})
    if len(names) > 1 and any(FORMS[name].is_whole for name in names):
        raise DataError(f"the files have different formats ({', '.join(names)}), which only a gait map can join")
    conventions = [FORMS[table.form].convention(table, side, body_mass) for table in tables]
    # One convention for all files: each curve is from the first file that has its columns.
    columns = {}
    for name in CURVES:
        choices = [getattr(convention.columns, name) for convention in conventions]
        pairs = zip(choices, tables, strict=True)
        fitting = [each for each, table in pairs if _is_there(each, table)]
        columns[name] = fitting[0] if fitting else choices[0]
    plates = tuple(dict.fromkeys(plate for convention in conventions for plate in convention.plates))
    remarks = tuple(remark for convention in conventions for remark in convention.remarks)
    curve_remarks = tuple(remark for convention in conventions for remark in convention.curve_remarks)
    # A force by the name of this foot is surer than contacts chosen by the lean of the shank.
    has_force = any(_is_there(columns["vertical_force"], table) for table in tables)
    return Convention(GaitMap(**columns), () if has_force else plates, remarks, curve_remarks)


def _completed_map(own: GaitMap | None, tables: Sequence[MotionTable], side: Side, body_mass: float) -> Convention:
    """Return a user's map, if any, with the curves that it leaves out as the file formats have them.

    Raises DataError if the formats cannot interpret the files and the map does not name both angles.
    """
    if own is None:
        return find_convention(tables, side, body_mass)
    named = {name: unsigned_names(getattr(own, name)) for name in own.named}
    problems = []
    # The format shall not judge the units of loads whose columns the map names.
    loads = {marker_of(column) for name in LOADS for column in named.get(name, ())}
    kept = [[name for name in table.columns if marker_of(name) not in loads] for table in tables]
    pairs = zip(tables, kept, strict=True)
    others = [replace(table, columns={name: table.columns[name] for name in names}) for table, names in pairs]
    try:
        usual = find_convention(others, side, body_mass)
    except DataError as error:
        if not named.keys() >= set(REQUIRED):
            raise
        usual = Convention(own)
        problems = [f"only the curves of the gait map are imported: {error}"]
    columns = replace(usual.columns, time=own.time, **{name: getattr(own, name) for name in own.named})
    found = convention_of_map(columns, tables, side)
    plates = () if FORCE in named else found.plates or usual.plates
    on_others = tuple((curve, remark) for curve, remark in usual.curve_remarks if curve not in named)
    return Convention(found.columns, plates, (*found.remarks, *usual.remarks, *problems), on_others)


def _is_there(mapped: object, table: MotionTable) -> bool:
    return mapped is not None and table.columns.keys() >= set(unsigned_names(mapped))


@dataclass(frozen=True, slots=True, eq=False)
class GaitSource:
    """Recording for the import of a gait.

    ``tables`` are the files, ``columns`` is the gait map, and ``walk`` holds the signals by curve. ``settings`` are
    completed with the data of the files. ``remarks`` list repaired values.
    """

    tables: Sequence[MotionTable]
    columns: GaitMap
    walk: Mapping[str, Signal]
    settings: ImportSettings
    remarks: tuple[str, ...]


def read_source(files: Sequence[str | Path], settings: ImportSettings, wrong: Faults) -> GaitSource:
    """Return the signals in recorded files; problems that leave both angles usable are added to ``wrong``.

    Raises DataError for a problem that ends the import, including all problems in ``wrong``.
    """
    own = settings.columns
    named = () if own is None else own.named
    tables = _read_tables(
        files, settings, {each for name in named for each in unsigned_names(getattr(own, name))}, wrong
    )
    # The columns of unusable tables are still checked, before the import ends.
    is_usable = not wrong
    settings, remarks = _with_subject(settings, tables, wrong)
    body_mass = settings.body_mass or _UNIT_BODY_MASS
    try:
        convention = _completed_map(own, tables, settings.side, body_mass)
    except DataError as error:
        Faults([*wrong, error]).raise_all()
    columns = convention.columns
    if settings.ankle_neutral is not None:
        neutral = format_quantity(settings.ankle_neutral, "rad")
        columns = replace(columns, ankle_angle=replace(columns.ankle_angle, neutral=neutral))
    # Gaps matter in the columns in use only. A load of exactly 0 is no lost marker but a foot off the plate.
    used = {name: unsigned_names(getattr(columns, name)) for name in CURVES}
    names = [column for terms in used.values() for column in terms]
    moved = [column for name, terms in used.items() if name not in LOADS for column in terms]
    tables = [fill_gaps(without_lost_markers(table, moved), names, settings.longest_gap) for table in tables]
    walk = walk_signals(tables, columns, body_mass, settings.stature, set(named), wrong)
    if any(name not in walk for name in REQUIRED):
        # Without a stride, the whole recording still shows the range of the ankle and the sign of its moment.
        curves = {name: signal.values[np.isfinite(signal.values)] for name, signal in walk.items()}
        whole = MeanStride({name: signal.file for name, signal in walk.items()}, curves, 0.0, 0.0)
        faults = [*ankle_faults_alone(whole), *(moment_faults(whole) if settings.body_mass else ())]
        Faults([*wrong, *map(DataError, faults)]).raise_all()
    # The knee is one entry of a map, but two curves.
    added = {name: each.columns for name, each in walk.items() if not {name, name.partition("_")[0]} & {*named}}
    if own is not None and added:
        shown = "; ".join(f"{name} from {', '.join(map(repr, names))}" for name, names in added.items())
        remarks.append(f"not in the gait map, read as the {settings.side} foot by the file format: {shown}")
    if not is_usable:
        wrong.raise_all()
    # Loads of unknown body mass, and a force of a wrong scale, get a largest value of 1: their events are still found.
    if settings.body_mass is None:
        walk |= {name: of_largest_one(walk[name]) for name in ("ankle_moment", FORCE) if name in walk}
    elif convention.plates and FORCE not in walk:
        # Without a force in the files, the plates that this foot steps on give it.
        with wrong:
            force, on_plates = force_of_plates(tables, convention.plates, walk["shank_angle"], body_mass)
            walk |= {} if force is None else {FORCE: force}
            remarks += on_plates
    if FORCE in walk:
        try:
            check_force_scale(walk[FORCE].file, walk[FORCE].values)
        except DataError as error:
            wrong.append(error)
            walk[FORCE] = of_largest_one(walk[FORCE], is_upwards=True)
    remarks += [*convention.remarks, *(remark for _, remark in convention.curve_remarks)]
    remarks += [f"{Path(table.file).name}: {remark}" for table in tables for remark in table.remarks]
    return GaitSource(tables, columns, walk, settings, (*remarks, *_ends(walk, tables)))


def _read_tables(
    files: Sequence[str | Path], settings: ImportSettings, own: Set[str], wrong: Faults
) -> list[MotionTable]:
    """Return the tables of files as their formats arrange them, with the columns ``own`` as the files have them.

    ``own`` are the columns in a user's gait map, which names them as the files do; the convention of a format names
    them as arranged. Problems of a table are added to ``wrong``. Raises DataError if a file cannot be read.
    """
    if not files:
        raise DataError("no file was given")
    start, end = (None, None) if wrong else (settings.start, settings.end)
    read: list[MotionTable] = []
    for path in files:
        with wrong:
            read.append(read_table(path, settings.longest_gap, start, end, settings.form))
    if len(read) < len(files):
        wrong.raise_all()
    if settings.stride_time is not None:
        read = [mean_stride_table(each, settings.stride_time) if each.problem else each for each in read]
        if not any(each.is_mean_stride or each.problem for each in read):
            given = setting_text("stride_time")
            wrong.append(DataError(f"{given} is for a file over percent of the stride, in its first column"))
    if settings.columns is not None and settings.columns.time is not None:
        if not any(each.problem for each in read):
            wrong.append(DataError("time.rate of the gait map is for files without a time column"))
        rate = settings.columns.time.frequency()
        read = [
            cut_table(counted_table(each, rate), settings.longest_gap, start, end) if each.problem else each
            for each in read
        ]
    wrong += [DataError(table.problem) for table in read if table.problem]
    arranged = []
    for table in read:
        found = FORMS[table.form].arrange(table)
        kept = own & table.columns.keys()
        columns = {**found.columns, **{name: table.columns[name] for name in kept}}
        units = {**found.units, **{name: table.units[name] for name in kept}}
        arranged.append(replace(found, columns=columns, units=units))
    return arranged


def of_largest_one(signal: Signal, is_upwards: bool = False) -> Signal:
    """Return a load scaled to a largest value of 1, for checks that are independent of a wrong or unknown scale."""
    largest = float(signal.values[np.argmax(np.abs(signal.values))]) or 1.0
    return replace(signal, values=signal.values / (largest if is_upwards else abs(largest)))


def _with_subject(
    settings: ImportSettings, tables: Sequence[MotionTable], wrong: Faults
) -> tuple[ImportSettings, list[str]]:
    """Return the settings, completed with body mass and stature from C3D files; values of the user take precedence.

    A missing body mass is added to ``wrong``.
    """
    masses, statures = (
        [(table.file, value) for table in tables if (value := getattr(table, name)) is not None]
        for name in ("body_mass", "stature")
    )
    remarks = []
    if settings.body_mass is None and not masses:
        wrong.append(
            DataError(
                f"{tables[0].file}: does not state the body mass, and {setting_text('body_mass')} is not given (loads "
                "are checked relative to their maximum)"
            )
        )
    elif settings.body_mass is None:
        file, mass = masses[0]
        settings = replace(settings, body_mass=mass)
        remarks.append(f"body mass {mass:.4g} kg, from {Path(file).name}")
    elif masses and abs(masses[0][1] - settings.body_mass) > _SAME * settings.body_mass:
        remarks.append(
            f"body mass {settings.body_mass:.4g} kg as given; {Path(masses[0][0]).name} states {masses[0][1]:.4g} kg"
        )
    if settings.stature is None and statures:
        settings = replace(settings, stature=statures[0][1])
        remarks.append(f"stature {statures[0][1]:.4g} m, from {Path(statures[0][0]).name}")
    return settings, remarks


def _ends(walk: Mapping[str, Signal], tables: Sequence[MotionTable]) -> list[str]:
    """Return remarks on motions that are missing at an end of their file, and on loads that were not measured."""
    spans = {table.file: (float(table.time[0]), float(table.time[-1])) for table in tables}
    seen: dict[tuple[float, float, float, float], list[str]] = {}
    loads: dict[int, list[str]] = {}
    for name, signal in walk.items():
        low, high = spans[signal.file]
        if signal.time[0] > low or signal.time[-1] < high:
            seen.setdefault((float(signal.time[0]), float(signal.time[-1]), low, high), []).append(name)
        if signal.absent is not None:
            loads.setdefault(round(100.0 * float(signal.absent.mean())), []).append(name)
    remarks = [
        f"{', '.join(names)}: missing outside {first:.4g} to {last:.4g} s (recording: {low:.4g} to {high:.4g} s)"
        for (first, last, low, high), names in seen.items()
    ]
    return remarks + [
        f"{', '.join(names)}: missing in {percent} % of the recording, where no plate measured this foot"
        for percent, names in loads.items()
    ]
