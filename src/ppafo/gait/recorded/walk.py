"""Recorded walk: curves of a gait over time, in SI units and in the signs of the package.

Each curve is computed from the one table that contains its columns: directly, from lines between markers (shank lean,
and ankle angle of the foot relative to the shank), or, for the knee, from hip and thigh.
"""

import math
from collections.abc import Sequence, Set
from dataclasses import replace

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.errors import DataError, PpafoError, noted_in, raise_noted
from ppafo.gait.gait import REQUIRED
from ppafo.gait.plausible_angles import SHANK_RANGE
from ppafo.gait.recorded.columns import LOADS, CurveColumns, check_recorded, find_columns, missing_column
from ppafo.gait.recorded.knee import knee_signals
from ppafo.gait.recorded.mapping import AngleMap, ForceMap, GaitMap, MomentMap, PressureMap, ShankMap, column_names
from ppafo.gait.recorded.signal import Signal, with_absence, without_ends
from ppafo.gait.recorded.table import MotionTable
from ppafo.signals.recording import Floats

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


def walk_signals(
    tables: Sequence[MotionTable],
    columns: GaitMap,
    body_mass: float,
    stature: float | None,
    required: Set[str],
    wrong: list[PpafoError],
) -> dict[str, Signal]:
    """Return the signals of a recorded walk by curve; problems with their columns are added to ``wrong``.

    Loads are divided by ``body_mass`` [kg] or by the body weight; ``stature`` [m] gives the length of the thigh.

    Both angles and the curves of a user's map (``required``) must have columns; the others may be absent. A motion
    starts at its first valid sample and ends at its last; a load is 0 where it was not measured.
    Raises DataError if no file has an angle, with all problems in ``wrong``.
    """
    try:
        angles = {
            name: [column.removeprefix("-") for column in column_names(getattr(columns, name))] for name in REQUIRED
        }
        if not any(table.columns.keys() >= set(names) for table in tables for names in angles.values()):
            raise DataError(missing_column(angles, tables))
    except DataError as error:
        raise_noted([*wrong, error])
    walk: dict[str, Signal] = {}
    # The shank stands first: an ankle from markers of the foot turns against it.
    for name in _UNITS:
        mapped, found = getattr(columns, name), None
        if mapped is None:
            continue
        with noted_in(wrong):
            found = find_columns(name, column_names(mapped), tables, name not in {*required, *REQUIRED})
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
        knee = {} if columns.knee is None else knee_signals(columns.knee, tables, stature, "knee" not in required)
        walk |= {name: without_ends(signal) for name, signal in knee.items()}
    return walk


def _curve_of(name: str, columns: CurveColumns, mapped: MappedCurve, body_mass: float) -> Signal:
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
    recorded = without_ends(pitch)
    inside = (recorded.time >= shank.time[0]) & (recorded.time <= shank.time[-1])
    time, values = recorded.time[inside], recorded.values[inside]
    lean = np.interp(time, shank.time, shank.values)
    lost = np.zeros(time.size, dtype=np.bool_) if recorded.lost is None else recorded.lost[inside]
    if shank.lost is not None:
        lost = lost | (np.interp(time, shank.time, shank.lost.astype(np.float64)) > 0.0)
    flat = np.zeros(time.size, dtype=np.bool_)
    if time.size >= 3:
        # Flat: the foot hardly turns while the shank leans over it. The median of these samples is the zero.
        flat = (np.abs(np.gradient(values, time)) < _SLOW) & (np.gradient(lean, time) < 0.0) & ~lost
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
                f"{shank.file}: shank_angle.vertical = {mapped.vertical!r}, but the line from {mapped.knee!r} to "
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
