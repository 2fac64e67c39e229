"""The columns that make a curve: the one table that has them, their signs and their unit."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.errors import DataError, UnitError, nearest_name, one_line
from ppafo.gait.recorded.repairs import LONGEST_FILLED
from ppafo.gait.recorded.table import OPENSIM, MotionTable
from ppafo.signals.recording import Floats
from ppafo.units import to_si

LOADS = ("ankle_moment", "vertical_force", "centre_of_pressure")
"""Where they were not measured, off a force plate, is no gap."""

_KNEE = "knee_angle_"
_LONGEST_SHOWN = 12


@dataclass(frozen=True, slots=True, eq=False)
class CurveColumns:
    """The table of a curve, its columns with their signs, and the key that states their unit in a gait map."""

    unit_key: str
    table: MotionTable
    terms: tuple[tuple[float, str], ...]
    may_be_absent: bool = False

    def in_unit(self, stated: str | None, si_units: Sequence[str]) -> tuple[Floats, str]:
        """Return the sum of the terms in the first SI unit that fits, and that unit. DataError where none fits."""
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
        if not self.may_be_absent:
            check_finite(values, place, self.table.time)
        if not unit:
            raise DataError(f"{place}: the file does not state its unit; give {self.unit_key} in a gait map")
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


def check_finite(values: Floats, place: str, time: Floats) -> None:
    """Raise DataError for a column with a gap within its ``time`` [s]; ``place`` is what the message calls it."""
    known = np.flatnonzero(np.isfinite(values))
    if known.size == 0:
        raise DataError(f"{place} contains no numbers; use another file, or map another column")
    first = int(known[0])
    bad = first + np.flatnonzero(~np.isfinite(values[first : int(known[-1]) + 1]))
    if bad.size:
        row = int(bad[0])
        raise DataError(
            f"{place} has a gap of {bad.size} samples, the first in row {row + 1} at {time[row]:g} s; "
            f"{_remedy(time, known)}"
        )


def _remedy(time: Floats, known: "np.ndarray[tuple[int], np.dtype[np.intp]]") -> str:
    """Return how to get rid of gaps between the samples that are known: the longest decides."""
    longest = float(np.max(np.diff(time[known])))
    if longest > LONGEST_FILLED:
        return f"fill it or cut the file there (--start, --end): {longest:.3g} s are too long to be filled here"
    needed = math.ceil(100.0 * longest - 1e-6) / 100.0
    return f"fill it or cut the file there (--fill-gaps '{needed:g} s', or --start, --end)"


def find_columns(
    curve: str, names: Sequence[str], tables: Sequence[MotionTable], optional: bool, is_default: bool
) -> CurveColumns | None:
    """Return the one table that has every column of a curve; None where it may be missing and no table has one.

    The sign of the knee is detected only with the map of the package (``is_default``): a user's map states it.
    """
    bare = [name.removeprefix("-") for name in names]
    holders = [table for table in tables if all(name in table.columns for name in bare)]
    if len(holders) > 1:
        files = " and ".join(table.file for table in holders)
        raise DataError(f"{curve}: both {files} have the column {bare[0]!r}; give one of them, or name another column")
    if holders:
        signs = [-1.0 if name.startswith("-") else 1.0 for name in names]
        terms = tuple(zip(signs, bare, strict=True))
        if is_default:
            terms = _detect_knee(holders[0], terms)
        return CurveColumns(f"{curve}.unit", holders[0], terms, curve in LOADS)
    if optional and not any(name in table.columns for name in bare for table in tables):
        return None
    known = [name for table in tables for name in table.columns]
    missing = next((name for name in bare if name not in known), bare[0])
    shown = ", ".join(one_line(name) for name in known[:_LONGEST_SHOWN]) + (
        ", ..." if len(known) > _LONGEST_SHOWN else ""
    )
    files = ", ".join(table.file for table in tables)
    hint = nearest_name(missing, known)
    why = f"there is no column {missing!r}{hint}" if missing not in known else "no file has all of its columns"
    raise DataError(f"{curve}: {why} ({files}: {shown}); name the columns in a gait map, 'ppafo schema gait-map'")


def _detect_knee(table: MotionTable, terms: tuple[tuple[float, str], ...]) -> tuple[tuple[float, str], ...]:
    """Return the terms with the knee taken away where its flexion counts above 0, as in the newer OpenSim models."""
    if table.form != OPENSIM:
        return terms
    return tuple(
        (-sign if name.startswith(_KNEE) and _bends_above_zero(table.columns[name]) else sign, name)
        for sign, name in terms
    )


def _bends_above_zero(values: Floats) -> bool:
    return float(np.nanmax(values)) > -float(np.nanmin(values))
