"""Recorded walk: curves of a gait over time, in SI units and in the signs of the package.

Each curve is computed from the one table that contains its columns: directly, from lines between markers (shank lean,
and ankle angle of the foot relative to the shank), or, for the knee, from hip and thigh.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from textwrap import shorten
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.constants import STANDARD_GRAVITY
from ppafo.errors import DataError, PpafoError, UnitError, noted_in, raise_noted, refused_as
from ppafo.gait.gait import HARMONICS, REQUIRED, fit_curve
from ppafo.gait.mean_stride import SignSource, other_sign
from ppafo.gait.plausible_angles import SHANK_RANGE
from ppafo.gait.recorded.mapping import (
    AngleMap,
    GaitMap,
    KneeMap,
    ShankMap,
    column_names,
    setting_text,
)
from ppafo.gait.recorded.near_columns import nearest_column
from ppafo.gait.recorded.table import MotionTable
from ppafo.signals.recording import Floats
from ppafo.units import parse_quantity, to_si
from ppafo.wording import one_line

_MINIMUM_SAMPLES = 20
"""Least number of samples for the low pass."""
_ORDER = 2
"""Order of the Butterworth low pass, which is applied twice."""
_DOUBLE_PASS = (2.0**0.5 - 1.0) ** 0.25
"""Ratio of the -3 dB frequencies of two passes and of a single pass (Winter, Biomechanics, section 2.4)."""


@dataclass(frozen=True, slots=True, eq=False)
class Signal:
    """Signal over time [s] from one file, with nearly uniform sampling.

    ``is_position`` marks a position [m], whose acceleration is a curve of the gait. ``columns`` are the columns of the
    file that were used. ``absent`` marks samples of a load that were not measured and are set to 0, None if complete.
    ``lost`` marks samples of a motion that were not recorded and are interpolated linearly, None if complete.
    """

    file: str
    time: Floats
    values: Floats
    is_position: bool = False
    columns: tuple[str, ...] = ()
    absent: NDArray[np.bool_] | None = None
    lost: NDArray[np.bool_] | None = None

    @property
    def rate(self) -> float:
        """Sampling rate [Hz]."""
        return float((self.time.size - 1) / (self.time[-1] - self.time[0]))


def without_ends(signal: Signal) -> Signal:
    """Return a motion from its first to its last valid sample, with gaps interpolated linearly and marked as lost."""
    known = np.flatnonzero(np.isfinite(signal.values))
    inside = slice(int(known[0]), int(known[-1]) + 1)
    time, values = signal.time[inside], signal.values[inside]
    gaps = ~np.isfinite(values)
    if not gaps.any():
        return replace(signal, time=time, values=values)
    return replace(signal, time=time, values=np.interp(time, time[~gaps], values[~gaps]), lost=gaps)


def with_absence(signal: Signal) -> Signal:
    """Return a load set to 0 where it was not measured, with these samples marked as absent."""
    absent = ~np.isfinite(signal.values)
    return signal if not absent.any() else replace(signal, values=np.where(absent, 0.0, signal.values), absent=absent)


def low_pass(signal: Signal, cut_off: float) -> Signal:
    """Return the signal filtered forwards and backwards by a Butterworth low pass, -3 dB at ``cut_off`` [Hz].

    Raises DataError for a signal with too few samples.
    """
    from scipy.signal import butter, sosfiltfilt

    if signal.time.size < _MINIMUM_SAMPLES:
        raise DataError(f"{signal.file}: {signal.time.size} rows are too short for a stride; give a longer recording")
    # A filter needs even samples; the jitter of a clock is small beside a stride.
    even = np.linspace(signal.time[0], signal.time[-1], signal.time.size)
    relative = cut_off / _DOUBLE_PASS / (0.5 * signal.rate)
    if relative >= 1.0:
        raise DataError(
            f"{signal.file}: cannot be low-passed at {cut_off:g} Hz: it has {signal.rate:.4g} samples a second; "
            f"choose less than {0.5 * signal.rate * _DOUBLE_PASS:.3g} Hz"
        )
    sections = butter(_ORDER, relative, output="sos")
    values = sosfiltfilt(sections, np.interp(even, signal.time, signal.values))
    return replace(signal, time=even, values=np.asarray(values, dtype=np.float64))


LOADS = ("ankle_moment", "vertical_force", "centre_of_pressure")
"""Curves that are undefined while the foot is off a force plate, which does not count as a gap."""

_MOST_SHOWN, _LONGEST_SAID = 12, 160
"""Limits of a message: number of column names, and characters of the names and of a remark."""


@dataclass(frozen=True, slots=True, eq=False)
class CurveColumns:
    """Columns of a curve: unit key in a gait map, table, and terms as pairs of sign and column name."""

    unit_key: str
    table: MotionTable
    terms: tuple[tuple[float, str], ...]
    may_be_absent: bool = False

    def in_unit(self, stated: str | None, si_units: Sequence[str]) -> tuple[Floats, str]:
        """Return the sum of the terms in the first SI unit that fits, and this unit; raises DataError if none fits."""
        total = np.zeros(self.table.time.size)
        chosen = si_units[0]
        wrong: list[PpafoError] = []
        for sign, name in self.terms:
            if not self.may_be_absent:
                with noted_in(wrong):
                    check_recorded(self.table.columns[name], f"{self.table.file}: column {name!r}")
            with noted_in(wrong):
                values, chosen = self._column(name, stated, si_units)
                total += sign * values
        raise_noted(wrong)
        return total, chosen

    def _column(self, name: str, stated: str | None, si_units: Sequence[str]) -> tuple[Floats, str]:
        where = f"{self.table.file}: column {name!r}"
        unit = stated or self.table.units[name]
        values = self.table.columns[name]
        if not unit:
            a_map = f"a gait map ({setting_text('columns')})"
            raise DataError(f"{where}: the file does not state its unit; give {self.unit_key} in {a_map}")
        given = "" if unit == "-" else unit
        problem = ""
        for si_unit in si_units:
            try:
                # Units are affine: two conversions give scale and zero for a whole column.
                zero, one = (to_si(number, given, si_unit) for number in (0.0, 1.0))
            except UnitError as error:
                problem = problem or str(error)
                continue
            return zero + (one - zero) * values, si_unit
        raise DataError(f"{where} [{unit}]: {problem}")


def check_recorded(values: Floats, where: str) -> None:
    """Raise DataError for a column without any number; ``where`` is its name in the message."""
    if not np.isfinite(values).any():
        raise DataError(f"{where} contains no numbers; use another file, or map another column")


def find_columns(
    curve: str, names: Sequence[str], tables: Sequence[MotionTable], optional: bool
) -> CurveColumns | None:
    """Return the columns of a curve from the one table that has all of them; None for an optional curve without any."""
    bare = [name.removeprefix("-") for name in names]
    # One table must have all terms: files need not share a clock to the sample.
    holders = [table for table in tables if all(name in table.columns for name in bare)]
    if len(holders) > 1:
        files = " and ".join(table.file for table in holders)
        raise DataError(f"{curve}: both {files} have the column {bare[0]!r}; give one of them, or name another column")
    if holders:
        signs = [-1.0 if name.startswith("-") else 1.0 for name in names]
        terms = tuple(zip(signs, bare, strict=True))
        return CurveColumns(f"{curve}.unit", holders[0], terms, curve in LOADS)
    if optional and not any(name in table.columns for name in bare for table in tables):
        return None
    raise DataError(f"{_why_missing(curve, bare, tables)} {_said_of_columns(tables)}")


def _why_missing(curve: str, bare: Sequence[str], tables: Sequence[MotionTable]) -> str:
    """Return a text on the missing column of a curve, with the nearest name; raises DataError for duplicates."""
    known = [name for table in tables for name in table.columns]
    missing = next((name for name in bare if name not in known), bare[0])
    twins = [name for name in known if re.fullmatch(re.escape(_whole(missing)) + r"#\d+(\.[xyz])?", name)]
    if twins:
        files = ", ".join(table.file for table in tables)
        either = " or ".join(repr(_whole(name)) for name in twins if name[-2:] not in (".y", ".z"))
        raise DataError(
            f"{curve}: {files} has {_whole(missing)!r} more than once, and they differ: choose one, "
            f"{either}, in a gait map ({setting_text('columns')})"
        )
    hint = nearest_column(missing, known)
    return f"{curve}: " + (
        f"there is no column {missing!r}{hint}" if missing not in known else "no file has all of its columns"
    )


def _said_of_columns(tables: Sequence[MotionTable]) -> str:
    """Return the columns and remarks of files, shortened, and a hint to name columns in a gait map, as text."""
    # A marker counts once, not by its coordinates.
    names = list(dict.fromkeys(one_line(_whole(name)) for table in tables for name in table.columns))
    shown = ", ".join(names[:_MOST_SHOWN]) + (", ..." if len(names) > _MOST_SHOWN else "")
    said = (
        shorten(one_line(remark), _LONGEST_SAID, placeholder=" ...") for table in tables for remark in table.remarks
    )
    files = ", ".join(table.file for table in tables)
    listed = "; ".join([shorten(shown, _LONGEST_SAID, placeholder=" ..."), *said])
    a_map = f"a gait map ({setting_text('columns')}), 'ppafo doctor --schema gait-map'"
    return f"({files}: {listed}); name the columns in {a_map}"


def _whole(name: str) -> str:
    """Return the marker of a coordinate; any other column name is returned unchanged."""
    return name[:-2] if name[-2:] in (".x", ".y", ".z") else name


_SLOW = np.radians(25.0)
"""Angular velocity [rad/s] below which the foot stands flat while the shank leans forward."""

_LEAST_FLAT = 0.1
"""Least duration of flat foot [s] for the zero of the ankle angle."""


def between_markers(
    columns: CurveColumns, mapped: ShankMap | AngleMap, first: str, second: str
) -> tuple[Floats, Floats]:
    """Return the distance of the second marker ahead of the first, and the height above it, in the unit of the file."""
    marker = {name: columns.table.columns[name] for _, name in columns.terms}
    for name, values in marker.items():
        check_recorded(values, f"{columns.table.file}: column {name!r}")
    axis, vertical = mapped.forward.removeprefix("-"), mapped.vertical
    sign = -1.0 if mapped.forward.startswith("-") else 1.0
    ahead = sign * (marker[f"{second}.{axis}"] - marker[f"{first}.{axis}"])
    return ahead, marker[f"{second}.{vertical}"] - marker[f"{first}.{vertical}"]


def foot_markers_angle(columns: CurveColumns, mapped: AngleMap, shank: Signal) -> Signal:
    """Return the ankle angle [rad] from heel and toe markers; with a flat foot it is 90 deg plus the shank angle.

    The neutral angle of the map is subtracted.
    """
    ahead, up = between_markers(columns, mapped, str(mapped.heel), str(mapped.toe))
    pitch = Signal(columns.table.file, columns.table.time, np.arctan2(up, ahead))
    seen = without_ends(pitch)
    inside = (seen.time >= shank.time[0]) & (seen.time <= shank.time[-1])
    time, values = seen.time[inside], seen.values[inside]
    lean = np.interp(time, shank.time, shank.values)
    lost = np.zeros(time.size, dtype=np.bool_) if seen.lost is None else seen.lost[inside]
    if shank.lost is not None:
        lost = lost | (np.interp(time, shank.time, shank.lost.astype(np.float64)) > 0.0)
    flat = np.zeros(time.size, dtype=np.bool_)
    if time.size >= 3:
        # Flat: the foot hardly turns while the shank leans over it. The median of these samples is the zero.
        flat = (np.abs(np.gradient(values, time)) < _SLOW) & (np.gradient(lean, time) < 0.0) & ~lost
    # Less than a tenth of a second of flat foot may be a pause of the swing.
    if np.count_nonzero(flat) < _LEAST_FLAT * seen.rate:
        raise DataError(
            f"{columns.table.file}: the line from {mapped.heel!r} to {mapped.toe!r} never stands still while the "
            "shank leans forward, so the zero of the ankle is unknown; give the angle itself in ankle_angle.terms "
            "of a gait map"
        )
    sign, neutral = mapped.sign_and_neutral()
    angle = 0.5 * np.pi + lean - (values - float(np.median(values[flat]))) - sign * neutral
    return Signal(columns.table.file, time, angle, lost=lost if lost.any() else None)


THIGH_FRACTION = 0.245
"""Thigh length as a fraction of the stature: figure 4.1 of Winter, Biomechanics and Motor Control of Human Movement,
4th ed. 2009."""

_LENGTHS = (0.2, 0.7)
_HIP_HEIGHT = 0.3
"""Depth of the hip below the origin [m] above which the sign is wrong; laboratories have no origin above the hip."""
_FASTEST_BACK = 0.2
"""Largest backward speed [m/s] on a treadmill, averaged over the recording."""


def knee_signals(
    mapped: KneeMap, tables: Sequence[MotionTable], stature: float | None, is_default: bool
) -> dict[str, Signal]:
    """Return ``knee_forward`` and ``knee_up``, each a position [m] or an acceleration [m/s^2].

    With a thigh, they are the position of the knee, computed in the sagittal plane from the hip position in the columns
    of the map and the lean of the thigh. Raises DataError if a column, unit or length is missing or inconsistent.
    """
    if mapped.thigh is not None and mapped.thigh_length is None and stature is None:
        if is_default:
            return {}
        raise DataError("knee.thigh needs a length: give knee.thigh_length in the gait map, or the stature")
    thigh = mapped.thigh or ()
    found = find_columns("knee", (*mapped.forward, *mapped.up, *thigh), tables, is_default)
    if found is None:
        return {}
    ends = len(mapped.forward), len(mapped.forward) + len(mapped.up)
    forward, unit = replace(found, terms=found.terms[: ends[0]]).in_unit(mapped.unit, ("m/s^2", "m"))
    up, other = replace(found, terms=found.terms[slice(*ends)]).in_unit(mapped.unit, ("m/s^2", "m"))
    if mapped.thigh is not None:
        if "m/s^2" in (unit, other):
            raise DataError(f"{found.table.file}: knee.thigh is added to positions of the hip in m, not to m/s^2")
        leaning = replace(found, terms=found.terms[ends[1] :], unit_key="knee.thigh_unit")
        lean, _ = leaning.in_unit(mapped.thigh_unit, ("rad",))
        for values, terms in ((forward, mapped.forward), (up, mapped.up)):
            if np.ptp(values) == 0.0:
                raise DataError(
                    f"{found.table.file}: the hip does not move ({', '.join(terms)} is constant), and without its "
                    "motion the knee's is unknown; omit the stature, or knee in the gait map"
                )
        height = float(np.mean(up[np.isfinite(up)]))
        if -height > _HIP_HEIGHT:
            raise DataError(
                f"{found.table.file}: the hip is {height:.2f} m high ({', '.join(mapped.up)}), below the ground, and "
                f"{-height:.2f} m with the other sign: its sign is reversed; correct it in the file, or change the "
                "sign of knee.up in a gait map"
            )
        # The file has the hip: the knee follows by the lean of the thigh.
        forward, up = knee_position(forward, up, lean, _thigh_length(mapped, stature))
    file, time = found.table.file, found.table.time
    columns = tuple(dict.fromkeys(name for _, name in found.terms))
    return {
        "knee_forward": Signal(file, time, forward, unit == "m", columns),
        "knee_up": Signal(file, time, up, other == "m", columns),
    }


def knee_remarks(mapped: KneeMap | None, walk: Mapping[str, Signal], stature: float | None) -> list[str]:
    """Return remarks on the source of the knee's acceleration, or the reason for its absence; ``stature`` in [m].

    Raises DataError for an implausible length of the thigh.
    """
    if mapped is None:
        return []
    if "knee_forward" not in walk:
        missing = (
            f"it needs a length of the thigh; give {setting_text('stature')}, or a gait map with knee.thigh_length"
        )
        return [f"no acceleration of the knee: {missing}"] if mapped.thigh is not None else []
    remarks = []
    if mapped.thigh is not None and mapped.thigh_length is None:
        remarks.append(
            f"thigh of {_thigh_length(mapped, stature):.3f} m: {THIGH_FRACTION:g} of the stature (Winter 2009)"
        )
    if walk["knee_forward"].is_position:
        remarks.append(
            f"acceleration of the knee from a series of {HARMONICS['knee_forward']} harmonics of its position"
        )
    return remarks


def check_way(walk: Mapping[str, Signal], signs_from: SignSource) -> None:
    """Raise DataError for a knee that moves backwards; on a treadmill, the knee stays in about the same place."""
    knee = walk.get("knee_forward")
    if knee is None or not knee.is_position:
        return
    speed = float((knee.values[-1] - knee.values[0]) / (knee.time[-1] - knee.time[0]))
    if speed < -_FASTEST_BACK:
        raise DataError(
            f"{knee.file}: the knee goes back by {-speed:.2g} m/s: knee.forward points against the "
            "direction of walking; "
            f"{other_sign(signs_from, 'the sign of knee.forward')}"
        )


def knee_position(hip_forward: Floats, hip_up: Floats, lean: Floats, thigh_length: float) -> tuple[Floats, Floats]:
    """Return the knee position, forward and up [m]; ``lean`` of the thigh [rad], positive with the knee in front."""
    return hip_forward + thigh_length * np.sin(lean), hip_up - thigh_length * np.cos(lean)


def acceleration_of(position: Floats, harmonics: int, stride_time: float) -> Floats:
    """Return the acceleration [m/s^2] of a position [m] over one stride with this stride time [s], at the same phases.

    The mean speed is subtracted, a Fourier series is fitted, and the series is differentiated twice.
    """
    phase = np.linspace(0.0, 1.0, position.size)
    # A straight line through both ends leaves a periodic rest, which a series can follow.
    curve, _ = fit_curve(position - (position[-1] - position[0]) * phase, harmonics)
    return curve.derivative(stride_time).derivative(stride_time).values_at(phase)


def _thigh_length(mapped: KneeMap, stature: float | None) -> float:
    if mapped.thigh_length is None:
        return THIGH_FRACTION * (stature or 0.0)
    where, (low, high) = f"knee.thigh_length = {mapped.thigh_length!r}", _LENGTHS
    with refused_as(DataError, where, UnitError):
        length = parse_quantity(mapped.thigh_length, "m")
    if not low <= length <= high:
        raise DataError(f"{where} is not plausible; a thigh is {low:g} to {high:g} m long")
    return length


_RIGHT_ANGLE = 0.5 * np.pi


def walk_signals(
    tables: Sequence[MotionTable],
    columns: GaitMap,
    body_mass: float,
    stature: float | None,
    is_default: bool,
    wrong: list[PpafoError],
) -> dict[str, Signal]:
    """Return the signals that a map finds in tables; all problems with their columns are added to ``wrong``.

    Loads are divided by ``body_mass`` [kg] or by the body weight; ``stature`` [m] gives the length of the thigh.

    For a default convention (``is_default``), only both angles are required; all curves in a map of the user are
    required. A motion starts at its first valid sample and ends at its last; a load is 0 where it was not measured.
    Raises DataError if an angle cannot be used, with all problems in ``wrong``.
    """
    try:
        named = {
            name: [column.removeprefix("-") for column in column_names(getattr(columns, name))] for name in REQUIRED
        }
        if not any(all(name in table.columns for name in bare) for table in tables for bare in named.values()):
            why = "; ".join(_why_missing(curve, bare, tables) for curve, bare in named.items())
            raise DataError(f"{why} {_said_of_columns(tables)}")
    except DataError as error:
        raise_noted([*wrong, error])
    walk: dict[str, Signal] = {}
    # The shank stands first: an ankle from markers of the foot turns against it.
    for name in _UNITS:
        mapped, found = getattr(columns, name), None
        if mapped is None:
            continue
        with noted_in(wrong):
            found = find_columns(name, column_names(mapped), tables, is_default and name not in REQUIRED)
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
            # Nothing else that is wrong matters in what is no walk.
            check_walks(walk[name], found, mapped)
    with noted_in(wrong):
        knee = {} if columns.knee is None else knee_signals(columns.knee, tables, stature, is_default)
        walk |= {name: without_ends(signal) for name, signal in knee.items()}
    if any(name not in walk for name in REQUIRED):
        raise_noted(wrong)
    return walk


_SHORTEST_WALK = 1.0
"""Duration [s] below which a record may contain a part of a stride only, with little rotation of the shank."""
_LEAST_UPRIGHT = 0.5
"""Least vertical component of the mean shank relative to its length [-]."""


def check_walks(shank: Signal, columns: CurveColumns, mapped: ShankMap) -> None:
    """Raise DataError for a shank with wrong axes, or with too small a rotation for walking."""
    if shank.time[-1] - shank.time[0] < _SHORTEST_WALK:
        return
    low, high = SHANK_RANGE
    travel = float(np.ptp(np.degrees(shank.values)))
    said = f"{shank.file}: shank_angle covers a range of {travel:.2g} deg in the whole record, a walk {low:g} or more"
    if mapped.terms is not None:
        # Radians that are called degrees have no event either, but a unit as a remedy.
        if travel < low and not low <= np.degrees(travel) <= high:
            raise DataError(f"{said}: this is not walking, or these are not the columns of the shank")
        return
    ends = {
        axis: [columns.table.columns.get(f"{label}.{axis}") for label in (mapped.knee, mapped.ankle)] for axis in "xyz"
    }
    # A text of two axes has no third, and one of a marker that was lost throughout no number.
    shin = {axis: below - above for axis, (above, below) in ends.items() if above is not None and below is not None}
    means = {axis: float(np.nanmean(along)) for axis, along in shin.items() if np.isfinite(along).any()}
    length, longest = math.hypot(*means.values()), max(means, key=lambda axis: abs(means[axis]))
    if abs(means[mapped.vertical]) < _LEAST_UPRIGHT * length:
        raise DataError(
            f"{shank.file}: the line from {mapped.knee!r} to {mapped.ankle!r} is longest along {longest}, and "
            f"shank_angle.vertical is {mapped.vertical!r}: give {longest!r} in a gait map, for the ankle too"
        )
    if travel >= low:
        return
    leans, across = 0.0, min(means.keys() - {mapped.forward[-1], mapped.vertical}, default="")
    if across:
        lean = np.degrees(np.arctan2(shin[across], -shin[mapped.vertical]))
        leans = float(np.nanmax(lean) - np.nanmin(lean))
    if leans >= low:
        raise DataError(
            f"{said}, and {leans:.2g} deg along {across}: shank_angle.forward is {mapped.forward!r}; give {across!r} "
            f"or '-{across}', where the walk goes, in a gait map, for the ankle too"
        )
    raise DataError(f"{said}: this is not walking; give a recording of walking")


_UNITS = {
    "shank_angle": ("rad",),
    "ankle_angle": ("rad",),
    "ankle_moment": ("N m/kg", "N m"),
    "vertical_force": ("", "N", "N/kg"),
    "centre_of_pressure": ("m",),
}
"""SI units of the curves in a map, the package's own unit first."""
_POSITIVE = ("ankle_in_front", "plantarflexion", "up", "forward")
"""Positive directions in the package."""


def _curve_of(name: str, columns: CurveColumns, mapped: Any, body_mass: float) -> Signal:
    """Return the signal of a curve in SI units and package signs; loads are relative to ``body_mass`` [kg]."""
    if isinstance(mapped, ShankMap) and mapped.terms is None:
        ahead, up = between_markers(columns, mapped, str(mapped.knee), str(mapped.ankle))
        values, unit = np.asarray(np.arctan2(ahead, -up), dtype=np.float64), "rad"
    else:
        values, unit = columns.in_unit(mapped.unit, _UNITS[name])
    if isinstance(mapped, AngleMap):
        sign, neutral = mapped.sign_and_neutral()
        return Signal(columns.table.file, columns.table.time, _RIGHT_ANGLE + sign * (values - neutral))
    # A moment is per body mass, and a force in body weights.
    over = {"N m": body_mass, "N": body_mass * STANDARD_GRAVITY, "N/kg": STANDARD_GRAVITY}.get(unit, 1.0)
    sign = 1.0 if mapped.positive in _POSITIVE else -1.0
    return Signal(columns.table.file, columns.table.time, sign * values / over)
