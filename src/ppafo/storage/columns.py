"""The columns of a table of text: names and units from the header, numbers in SI units from the rows."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.errors import DataError, UnitError, first_twice
from ppafo.signals import CHANNELS
from ppafo.signals.channels import PLAIN_NUMBER, TIME, TIME_UNIT
from ppafo.signals.recording import Floats

_HEADER = re.compile(r"\s*(\w+)\s*\[\s*([^\[\]]+?)\s*\]\s*", re.ASCII)
_LEVEL = "Pa_a"


@dataclass(frozen=True, slots=True)
class Column:
    """What a header says of a column: channel (or time) and the unit of its numbers."""

    name: str
    unit: str

    @property
    def si_unit(self) -> str:
        """The unit in which the recording keeps it; a channel that is not known by name stays as it is."""
        if self.name == TIME:
            return TIME_UNIT
        return CHANNELS[self.name].unit if self.name in CHANNELS else self.unit


def parse_header(cells: list[str]) -> list[Column]:
    """Return the columns of a header such as ``time [s]``, ``pressure_1 [psi_g]``; time comes first.

    DataError for one that cannot be read.
    """
    if not cells:
        raise DataError("the header must come first, line 1 is empty")
    columns = [_column(cell) for cell in cells]
    names = [column.name for column in columns]
    if names[0] != TIME:
        raise DataError(f"the first column must be '{TIME} [{TIME_UNIT}]', it is '{names[0]}'")
    twice = first_twice(names)
    if twice is not None:
        raise DataError(f"there are two columns '{twice}'")
    return columns


def _column(cell: str) -> Column:
    match = _HEADER.fullmatch(cell)
    if match is None:
        shown = cell if len(cell) <= 40 else f"{cell[:36]} ..."
        raise DataError(f"the header must name columns as 'name [unit]', separated by commas; '{shown}' is not one")
    return Column(match[1], match[2])


def check_clock(time: Floats, lines: Sequence[int]) -> None:
    """Refuse a clock [s] that goes backwards or stands still; ``lines`` are those of the rows in the file.

    DataError names the line.
    """
    stalled = np.flatnonzero(np.diff(time) <= 0.0)
    if stalled.size:
        index = int(stalled[0]) + 1
        word = "stands still" if time[index] == time[index - 1] else "goes backwards"
        raise DataError(
            f"line {lines[index]}, column '{TIME}': the clock {word}: {time[index]:.9g} s follows "
            f"{time[index - 1]:.9g} s; time must increase from sample to sample"
        )


def in_si(column: Column, values: Floats, atmosphere: float) -> Floats:
    """Return the values in the unit in which a recording keeps them; gauge counts from ``atmosphere`` [Pa absolute].

    DataError for a unit that does not fit.
    """
    from ppafo.units import check_unit, to_si

    try:
        if column.unit != column.si_unit:
            given, wanted = (_for_conversion(unit) for unit in (column.unit, column.si_unit))
            return np.array([to_si(value, given, wanted, atmosphere) for value in values.tolist()])
        if column.name not in CHANNELS:
            check_unit(_for_conversion(column.unit))
    except UnitError as error:
        raise DataError(f"column '{column.name} [{column.unit}]': {error}") from error
    return values


def _for_conversion(unit: str) -> str:
    """Return the unit as ``ppafo.units`` spells it: there a pressure says its kind and a plain number has no unit."""
    return {"Pa": _LEVEL, PLAIN_NUMBER: ""}.get(unit, unit)
