"""A recorded walk: the curves of a gait over time, in SI units and in the signs of the package."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.gait.gait import REQUIRED
from ppafo.gait.recorded.columns import LOADS, CurveColumns, find_columns
from ppafo.gait.recorded.conventions import column_names
from ppafo.gait.recorded.foot_markers import between_markers, foot_markers_angle
from ppafo.gait.recorded.knee import knee_signals
from ppafo.gait.recorded.mapping import (
    AngleMap,
    ForceMap,
    GaitMap,
    MomentMap,
    PressureMap,
    ShankMap,
)
from ppafo.gait.recorded.signal import Signal, with_absence, without_ends
from ppafo.gait.recorded.table import MotionTable
from ppafo.signals.recording import Floats

_RIGHT_ANGLE = 0.5 * np.pi


@dataclass(frozen=True, slots=True)
class Person:
    """Body mass [kg], by which moments and forces are divided, and stature [m], which gives the length of the thigh."""

    body_mass: float
    stature: float | None = None


def walk_signals(
    tables: Sequence[MotionTable], columns: GaitMap, person: Person, is_default: bool
) -> dict[str, Signal]:
    """Return the signals that a map finds in tables.

    With a convention of the package (``is_default``) only both angles have to be there; what a map of the user names
    has to be there. A motion goes from its first number to its last, a load is 0 where it was not measured.
    """
    walk: dict[str, Signal] = {}
    for name, read in _READERS.items():
        mapped = getattr(columns, name)
        if mapped is None:
            continue
        optional = is_default and name not in REQUIRED
        found = find_columns(name, column_names(mapped), tables, optional, is_default)
        if found is not None:
            if isinstance(mapped, AngleMap) and mapped.terms is None:
                signal = foot_markers_angle(found, mapped, walk["shank_angle"])
            else:
                signal = read(found, mapped, person.body_mass)
            signal = replace(signal, columns=tuple(column for _, column in found.terms))
            walk[name] = with_absence(signal) if name in LOADS else without_ends(signal)
    if columns.knee is not None:
        knee = knee_signals(columns.knee, tables, person.stature, is_default)
        walk |= {name: without_ends(signal) for name, signal in knee.items()}
    return walk


def _shank(found: CurveColumns, mapped: ShankMap, _body_mass: float) -> Signal:
    if mapped.terms is None:
        values = _marker_angle(found, mapped)
    else:
        values, _ = found.in_unit(mapped.unit, ("rad",))
    sign = 1.0 if mapped.positive == "ankle_in_front" else -1.0
    return Signal(found.table.file, found.table.time, sign * values)


def _marker_angle(found: CurveColumns, mapped: ShankMap) -> Floats:
    """Return the lean of the line from knee to ankle, above 0 while the ankle is in front."""
    ahead, up = between_markers(found, mapped, str(mapped.knee), str(mapped.ankle))
    return np.asarray(np.arctan2(ahead, -up), dtype=np.float64)


def _ankle(found: CurveColumns, mapped: AngleMap, _body_mass: float) -> Signal:
    values, _ = found.in_unit(mapped.unit, ("rad",))
    sign, neutral = mapped.sign_and_neutral()
    return Signal(found.table.file, found.table.time, _RIGHT_ANGLE + sign * (values - neutral))


def _moment(found: CurveColumns, mapped: MomentMap, body_mass: float) -> Signal:
    values, unit = found.in_unit(mapped.unit, ("N m/kg", "N m"))
    fraction = values / body_mass if unit == "N m" else values
    return Signal(found.table.file, found.table.time, fraction if mapped.positive == "plantarflexion" else -fraction)


def _force(found: CurveColumns, mapped: ForceMap, body_mass: float) -> Signal:
    values, unit = found.in_unit(mapped.unit, ("", "N", "N/kg"))
    weight = {"": 1.0, "N": body_mass * STANDARD_GRAVITY, "N/kg": STANDARD_GRAVITY}[unit]
    sign = 1.0 if mapped.positive == "up" else -1.0
    return Signal(found.table.file, found.table.time, sign * values / weight)


def _pressure(found: CurveColumns, mapped: PressureMap, _body_mass: float) -> Signal:
    values, _ = found.in_unit(mapped.unit, ("m",))
    return Signal(found.table.file, found.table.time, values if mapped.positive == "forward" else -values)


_READERS: dict[str, Callable[..., Signal]] = {
    "shank_angle": _shank,
    "ankle_angle": _ankle,
    "ankle_moment": _moment,
    "vertical_force": _force,
    "centre_of_pressure": _pressure,
}
