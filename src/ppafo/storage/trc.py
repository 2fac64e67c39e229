"""Tables of markers, ``.trc``: three columns a marker, as motion capture and OpenSim write them.

Lines 1 to 3 are ``PathFileType 4 (X/Y/Z) NAME``, names of the header's values, and these. Line 4 has ``Frame#``,
``Time`` and a name for every three columns, line 5 ``X1 Y1 Z1 ...``; then come the rows. A marker that was not seen
leaves its cells empty, or has ``nan``.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ppafo.errors import DataError, first_twice, one_line
from ppafo.signals.recording import Floats
from ppafo.storage.files import read_bytes
from ppafo.storage.opensim import text_lines

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_FIRST = "PathFileType"
_HEAD_LINES = 5
_LONGEST_SHOWN = 40
_UNITS = ("mm", "cm", "m")


@dataclass(frozen=True, slots=True, eq=False)
class MarkerTable:
    """Markers over time [s]: coordinates (3, frames) by name in ``unit``; NaN where a marker was not seen."""

    time: Floats
    markers: Mapping[str, Floats]
    unit: str


def read_trc(path: str | Path) -> MarkerTable:
    """Return the markers in a ``.trc`` file; DataError names file, line and what is wrong."""
    try:
        lines = text_lines(read_bytes(path))
        if not lines[0].startswith(_FIRST) or len(lines) <= _HEAD_LINES:
            raise DataError(
                f"is not a .trc file: its first line begins with '{_FIRST}', and five lines come before rows"
            )
        unit = _unit(lines)
        names = _names(lines[3])
        rows = [(number, line) for number, line in enumerate(lines[_HEAD_LINES:], _HEAD_LINES + 1) if line.strip()]
        values = np.array([_row(line, number, len(names)) for number, line in rows]).reshape(-1, 1 + 3 * len(names))
        _check_clock(values[:, 0], [number for number, _ in rows])
    except DataError as error:
        raise DataError(f"{path}: {error}".replace(f"{path}: {path}:", f"{path}:")) from error
    markers = {name: values[:, 1 + 3 * place : 4 + 3 * place].T for place, name in enumerate(names)}
    return MarkerTable(values[:, 0], markers, unit)


def _unit(lines: list[str]) -> str:
    names, values = lines[1].split(), lines[2].split()
    stated = dict(zip(names, values, strict=False)).get("Units", "")
    if stated not in _UNITS:
        shown = one_line(stated)[:_LONGEST_SHOWN]
        raise DataError(f"line 3: Units is {shown!r}; allowed are {', '.join(_UNITS)}")
    return stated


def _names(line: str) -> list[str]:
    """Return the names of the markers; the two names before them are those of frame and time."""
    cells = [cell.strip() for cell in line.split("\t")]
    if len(cells) < 3 or cells[1].lower() != "time":
        raise DataError("line 4: must begin with 'Frame#', 'Time' and the names of markers, parted by tabs")
    names = [name for name in cells[2:] if name]
    twice = first_twice(names)
    if twice is not None or not names:
        what = "no marker" if twice is None else f"two markers {one_line(twice)[:_LONGEST_SHOWN]!r}"
        raise DataError(f"line 4: names {what}; every marker needs a name of its own")
    return names


def _row(line: str, number: int, markers: int) -> list[float]:
    """Return time and coordinates of a row; cells that are not there are those of markers that were not seen."""
    cells = [cell.strip() for cell in line.split("\t")] if "\t" in line else line.split()
    wanted = 2 + 3 * markers
    if len(cells) > wanted and any(cells[wanted:]):
        raise DataError(f"line {number} has {len(cells)} values for {wanted} columns")
    cells = [*cells, *[""] * (wanted - len(cells))][:wanted]
    return [_number(cells[1], number, is_time=True), *(_number(cell, number) for cell in cells[2:])]


def _number(cell: str, number: int, is_time: bool = False) -> float:
    if not is_time and cell.lower() in ("", "nan"):
        return float("nan")
    value = float(cell) if _NUMBER.fullmatch(cell) else float("nan")
    if not np.isfinite(value):
        raise DataError(f"line {number}: {one_line(cell)[:_LONGEST_SHOWN]!r} is not a number, or not a finite one")
    return value


def _check_clock(time: Floats, lines: list[int]) -> None:
    if time.size == 0:
        raise DataError("has no rows")
    stalled = np.flatnonzero(np.diff(time) <= 0.0)
    if stalled.size:
        index = int(stalled[0]) + 1
        raise DataError(
            f"line {lines[index]}: the time {time[index]:g} s follows {time[index - 1]:g} s; it must increase"
        )
