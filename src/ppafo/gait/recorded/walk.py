"""A recorded walk: the curves of a gait over time, in SI units and in the signs of the package."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.errors import DataError, UnitError, nearest_name, one_line
from ppafo.gait.gait import CURVES, REQUIRED
from ppafo.gait.recorded.mapping import (
    AngleMap,
    ForceMap,
    GaitMap,
    MomentMap,
    PressureMap,
    ShankMap,
)
from ppafo.gait.recorded.signal import Signal
from ppafo.gait.recorded.table import OPENSIM, MotionTable
from ppafo.signals.recording import Floats
from ppafo.units import parse_quantity, to_si

_RIGHT_ANGLE = 0.5 * np.pi
_KNEE = "knee_angle_"
_LONGEST_SHOWN = 12


Walk = Mapping[str, Signal]
"""Signals by the names of ``CURVES``."""


def recorded_walk(
    tables: Sequence[MotionTable], columns: GaitMap, body_mass: float, is_default: bool
) -> dict[str, Signal]:
    """Return the signals that a map finds in tables; ``body_mass`` [kg] turns moments and forces into shares of it.

    With a convention of the package (``is_default``) moment, force and pressure may be missing; what a map of the user
    names has to be there.
    """
    walk = {}
    for name in CURVES:
        mapped = getattr(columns, name)
        if mapped is None:
            continue
        found = _terms(name, mapped, tables, optional=is_default and name not in REQUIRED)
        if found is not None:
            walk[name] = _READERS[name](found, mapped, body_mass)
    return walk


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """The table of a curve, and its columns with their signs."""

    curve: str
    table: MotionTable
    terms: tuple[tuple[float, str], ...]

    def in_unit(self, stated: str | None, si_units: Sequence[str]) -> tuple[Floats, str]:
        """Return the sum of the terms in the first SI unit that fits, and that unit."""
        total = np.zeros(self.table.time.size)
        chosen = si_units[0]
        for sign, name in self.terms:
            values, chosen = self._column(name, stated, si_units)
            total += sign * values
        return total, chosen

    def _column(self, name: str, stated: str | None, si_units: Sequence[str]) -> tuple[Floats, str]:
        place = f"{self.table.file}: column {name!r}"
        unit = stated or self.table.units[name]
        values = self.table.columns[name]
        _check_finite(values, place, self.table.time)
        if not unit:
            raise DataError(f"{place}: the file does not say its unit; give {self.curve}.unit in the gait map")
        given = "" if unit == "-" else unit
        problem = ""
        for si_unit in si_units:
            try:
                zero, one = (to_si(number, given, si_unit) for number in (0.0, 1.0))
            except UnitError as error:
                problem = problem or str(error)
                continue
            return zero + (one - zero) * values, si_unit
        raise DataError(f"{place} [{unit}]: {problem}")


def _check_finite(values: Floats, place: str, time: Floats) -> None:
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        row = int(bad[0])
        raise DataError(
            f"{place} has a gap of {bad.size} samples, the first in row {row + 1} at {time[row]:g} s; "
            "fill it or cut the file there"
        )


def _terms(curve: str, mapped: object, tables: Sequence[MotionTable], optional: bool) -> _Found | None:
    """Return the one table that has every column of a curve."""
    names = _column_names(mapped)
    bare = [name.removeprefix("-") for name in names]
    holders = [table for table in tables if all(name in table.columns for name in bare)]
    if len(holders) > 1:
        files = " and ".join(table.file for table in holders)
        raise DataError(f"{curve}: both {files} have the column {bare[0]!r}; give one of them, or name another column")
    if holders:
        signs = [-1.0 if name.startswith("-") else 1.0 for name in names]
        return _Found(curve, holders[0], _detected_knee(holders[0], tuple(zip(signs, bare, strict=True))))
    if optional and not any(name in table.columns for name in bare for table in tables):
        return None
    known = [name for table in tables for name in table.columns]
    missing = next((name for name in bare if name not in known), bare[0])
    shown = ", ".join(one_line(name) for name in known[:_LONGEST_SHOWN]) + (
        ", ..." if len(known) > _LONGEST_SHOWN else ""
    )
    files = ", ".join(table.file for table in tables)
    why = f"no column {missing!r}{nearest_name(missing, known)}" if missing not in known else "its columns in two files"
    raise DataError(
        f"{curve}: there is {why} ({files}: {shown}); name the columns in a gait map, 'ppafo schema gait-map'"
    )


def _column_names(mapped: object) -> tuple[str, ...]:
    if isinstance(mapped, ShankMap) and mapped.terms is None:
        axes = (mapped.forward.removeprefix("-"), mapped.vertical)
        return tuple(f"{marker}.{axis}" for marker in (mapped.knee, mapped.ankle) for axis in axes)
    terms: tuple[str, ...] = getattr(mapped, "terms")  # noqa: B009  # every map has them, by its own class
    return terms


def _detected_knee(table: MotionTable, terms: tuple[tuple[float, str], ...]) -> tuple[tuple[float, str], ...]:
    """Return the terms with the knee taken away where its flexion counts above 0, as in the newer OpenSim models."""
    if table.form != OPENSIM:
        return terms
    return tuple(
        (-sign if name.startswith(_KNEE) and _bends_above_zero(table.columns[name]) else sign, name)
        for sign, name in terms
    )


def _bends_above_zero(values: Floats) -> bool:
    return float(np.max(values)) > -float(np.min(values))


def _shank(found: _Found, mapped: ShankMap, _body_mass: float) -> Signal:
    if mapped.terms is None:
        values = _marker_angle(found, mapped)
    else:
        values, _ = found.in_unit(mapped.unit, ("rad",))
    sign = 1.0 if mapped.positive == "ankle_in_front" else -1.0
    return Signal(found.table.file, found.table.time, sign * values)


def _marker_angle(found: _Found, mapped: ShankMap) -> Floats:
    """Return the lean of the line from knee to ankle, above 0 while the ankle is in front."""
    place = {name: found.table.columns[name] for _, name in found.terms}
    for name, values in place.items():
        _check_finite(values, f"{found.table.file}: column {name!r}", found.table.time)
    axis = mapped.forward.removeprefix("-")
    sign = -1.0 if mapped.forward.startswith("-") else 1.0
    ahead = sign * (place[f"{mapped.ankle}.{axis}"] - place[f"{mapped.knee}.{axis}"])
    below = place[f"{mapped.knee}.{mapped.vertical}"] - place[f"{mapped.ankle}.{mapped.vertical}"]
    return np.asarray(np.arctan2(ahead, below), dtype=np.float64)


def _ankle(found: _Found, mapped: AngleMap, _body_mass: float) -> Signal:
    values, _ = found.in_unit(mapped.unit, ("rad",))
    try:
        neutral = parse_quantity(mapped.neutral, "rad")
    except UnitError as error:
        raise DataError(f"ankle_angle.neutral = {mapped.neutral!r}: {error}") from error
    sign = 1.0 if mapped.positive == "plantarflexion" else -1.0
    return Signal(found.table.file, found.table.time, _RIGHT_ANGLE + sign * (values - neutral))


def _moment(found: _Found, mapped: MomentMap, body_mass: float) -> Signal:
    values, unit = found.in_unit(mapped.unit, ("N m/kg", "N m"))
    share = values / body_mass if unit == "N m" else values
    return Signal(found.table.file, found.table.time, share if mapped.positive == "plantarflexion" else -share)


def _force(found: _Found, mapped: ForceMap, body_mass: float) -> Signal:
    values, unit = found.in_unit(mapped.unit, ("", "N", "N/kg"))
    weight = {"": 1.0, "N": body_mass * STANDARD_GRAVITY, "N/kg": STANDARD_GRAVITY}[unit]
    sign = 1.0 if mapped.positive == "up" else -1.0
    return Signal(found.table.file, found.table.time, sign * values / weight)


def _pressure(found: _Found, mapped: PressureMap, _body_mass: float) -> Signal:
    values, _ = found.in_unit(mapped.unit, ("m",))
    return Signal(found.table.file, found.table.time, values if mapped.positive == "forward" else -values)


_READERS: dict[str, Callable[..., Signal]] = {
    "shank_angle": _shank,
    "ankle_angle": _ankle,
    "ankle_moment": _moment,
    "vertical_force": _force,
    "centre_of_pressure": _pressure,
}
