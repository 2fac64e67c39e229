"""Tables of marker positions over time (``.trc``), as written by motion capture systems and OpenSim.

Line 1 is ``PathFileType 4 (X/Y/Z) NAME``; lines 2 and 3 have names and values of the header. Line 4 has ``Frame#``,
``Time`` and a marker name for every three columns, line 5 ``X1 Y1 Z1 ...``; the rows follow. The cells of an unseen
marker are empty or ``nan``.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ppafo.errors import DataError
from ppafo.signals.recording import TIME, Floats
from ppafo.storage.comma_separated import check_clock
from ppafo.storage.text_table import doubled, number_in, said_of_doubled, text_lines, told_apart, without_copies
from ppafo.wording import LONGEST_SHOWN, one_line

_FIRST_WORD = "PathFileType"
_HEAD_LINES = 5
"""Number of lines before the first row."""
_UNITS = ("mm", "cm", "m")
_UNSEEN = ("", "nan")
"""Cell texts for a marker that was not seen."""


@dataclass(frozen=True, slots=True, eq=False)
class _MarkerTable:
    """Marker positions over time [s]: coordinates (3, frames) by name, in ``unit``; NaN for a marker not seen.

    ``remarks`` name markers that were renamed because of duplicated names.
    """

    time: Floats
    markers: Mapping[str, Floats]
    unit: str
    remarks: tuple[str, ...] = ()


def read_trc(path: str | Path) -> _MarkerTable:
    """Read the markers of a ``.trc`` file. Raises DataError with file, line and error."""
    try:
        lines = text_lines(path)
        if not lines[0].startswith(_FIRST_WORD) or len(lines) <= _HEAD_LINES:
            raise DataError(
                f"is not a .trc file: line 1 must begin with '{_FIRST_WORD}', and rows must follow line {_HEAD_LINES}"
            )
        unit = dict(zip(lines[1].split(), lines[2].split(), strict=False)).get("Units", "")
        if unit not in _UNITS:
            shown = one_line(unit)[:LONGEST_SHOWN]
            raise DataError(f"line 3: Units is {shown!r}; allowed are {', '.join(_UNITS)}")
        head = [cell.strip() for cell in lines[3].split("\t")]
        if len(head) < 3 or head[1].lower() != "time":
            raise DataError("line 4: must begin with 'Frame#', 'Time' and the names of markers, separated by tabs")
        written = [name for name in head[2:] if name]
        if not written:
            raise DataError("line 4: has no marker names")
        names = told_apart(written)
        time, coordinates = _rows(lines, names)
    except DataError as error:
        raise DataError(f"{path}: {error}".replace(f"{path}: {path}:", f"{path}:")) from error
    twins = doubled(written, names)
    markers = without_copies(dict(zip(names, coordinates, strict=True)), twins)
    return _MarkerTable(time, markers, unit, tuple(said_of_doubled(twins, markers, "markers")))


def _rows(lines: list[str], names: list[str]) -> tuple[Floats, list[Floats]]:
    """Parse the frame times [s], and the coordinates (3, frames) of each marker in the unit of the file."""
    labels = [f"{axis} of {name}" for name in names for axis in "XYZ"]
    width = 2 + len(labels)
    numbers = [number for number, line in enumerate(lines, 1) if number > _HEAD_LINES and line.strip()]
    rows = []
    for number in numbers:
        line = lines[number - 1]
        cells = [cell.strip() for cell in line.split("\t")] if "\t" in line else line.split()
        if len(cells) > width and any(cells[width:]):
            raise DataError(f"line {number} has {len(cells)} values for {width} columns")
        # Cells that are not there belong to markers that were not seen.
        cells = [*cells, *[""] * (width - len(cells))][:width]
        time = number_in(cells[1], number, TIME)
        coordinates = [number_in(cell, number, label, _UNSEEN) for cell, label in zip(cells[2:], labels, strict=True)]
        rows.append([time, *coordinates])
    if not rows:
        raise DataError("has no rows")
    values = np.array(rows)
    check_clock(values[:, 0], numbers)
    return values[:, 0], [values[:, 1 + 3 * index : 4 + 3 * index].T for index in range(len(names))]
