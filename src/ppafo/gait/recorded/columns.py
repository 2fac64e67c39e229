"""Columns of recorded tables that form a curve: lookup by name, sum in SI units, message for missing columns."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from textwrap import shorten

import numpy as np

from ppafo.errors import DataError, PpafoError, UnitError, noted_in, raise_noted
from ppafo.gait.recorded.mapping import setting_text
from ppafo.gait.recorded.table import COORDINATES, MotionTable, marker_of
from ppafo.signals.recording import Floats
from ppafo.units import to_si
from ppafo.wording import nearest_name, one_line

LOADS = ("ankle_moment", "vertical_force", "centre_of_pressure")
"""Curves that are undefined while the foot is off a force plate, which does not count as a gap."""
_RATE = "rad/s"
_NOT_INTEGRATED = "; integrate it over each stride, less its mean over the stride, and set the zero while standing"
_MOST_NAMES, _LONGEST_TEXT = 12, 160
"""Limits of an error message: number of column names, and characters of the names and of a remark."""


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
        """Return a column in the first SI unit that fits, and this unit; raises DataError if none fits."""
        where = f"{self.table.file}: column {name!r}"
        unit = stated or self.table.units[name]
        values = self.table.columns[name]
        if not unit:
            raise DataError(f"{where} has no unit, in the file or as {self.unit_key} of a gait map")
        parsed_unit = "" if unit == "-" else unit
        problem = ""
        for si_unit in (*si_units, _RATE):
            try:
                # Units are affine: two conversions give scale and zero for a whole column.
                zero, one = (to_si(number, parsed_unit, si_unit) for number in (0.0, 1.0))
            except UnitError as error:
                problem = problem or str(error)
                continue
            if si_unit == _RATE:
                problem += _NOT_INTEGRATED
                break
            return zero + (one - zero) * values, si_unit
        raise DataError(f"{where} [{unit}]: {problem}")


def check_recorded(values: Floats, where: str) -> None:
    """Raise DataError for a column without any number; ``where`` is its name in the message."""
    if not np.isfinite(values).any():
        raise DataError(f"{where} contains no numbers")


def find_columns(
    curve: str, names: Sequence[str], tables: Sequence[MotionTable], optional: bool
) -> CurveColumns | None:
    """Return the columns of a curve from the one table that has all of them; None for an optional curve without any."""
    unsigned = [name.removeprefix("-") for name in names]
    # One table must have all terms: files need not share a clock to the sample.
    holders = [table for table in tables if all(name in table.columns for name in unsigned)]
    if len(holders) > 1:
        files = " and ".join(table.file for table in holders)
        raise DataError(f"{curve}: {files} both have the column {unsigned[0]!r}")
    if holders:
        signs = [-1.0 if name.startswith("-") else 1.0 for name in names]
        terms = tuple(zip(signs, unsigned, strict=True))
        return CurveColumns(f"{curve}.unit", holders[0], terms, curve in LOADS)
    if optional and not any(name in table.columns for name in unsigned for table in tables):
        return None
    raise DataError(missing_column({curve: unsigned}, tables))


def missing_column(names: Mapping[str, Sequence[str]], tables: Sequence[MotionTable]) -> str:
    """Return a message on the missing columns of curves; ``names`` are the unsigned columns of each curve.

    The message has the nearest name for each missing column, and the columns and remarks of the files, shortened.
    Raises DataError for a column name that a file has more than once.
    """
    known, reasons = [name for table in tables for name in table.columns], []
    files = ", ".join(table.file for table in tables)
    for curve, wanted in names.items():
        missing = next((name for name in wanted if name not in known), wanted[0])
        twins = [name for name in known if re.fullmatch(re.escape(marker_of(missing)) + r"#\d+(\.[xyz])?", name)]
        if twins:
            either = " or ".join(repr(marker_of(name)) for name in twins if name[-2:] not in COORDINATES[1:])
            raise DataError(
                f"{curve}: {files} has several different columns {marker_of(missing)!r}; choose {either} in a gait "
                f"map ({setting_text('columns')})"
            )
        reason = f"there is no column {missing!r}{nearest_name(missing, known)}"
        reasons.append(f"{curve}: {'no file has all columns of this curve' if missing in known else reason}")
    # A marker counts once, not by its coordinates.
    markers = list(dict.fromkeys(one_line(marker_of(name)) for name in known))
    first_names = ", ".join(markers[:_MOST_NAMES]) + (", ..." if len(markers) > _MOST_NAMES else "")
    texts = [first_names, *(one_line(remark) for table in tables for remark in table.remarks)]
    listed = "; ".join(shorten(text, _LONGEST_TEXT, placeholder=" ...") for text in texts)
    return f"{'; '.join(reasons)} ({files}: {listed}); a gait map ({setting_text('columns')}) names other columns"
