"""Tables of OpenSim (``.mot``, ``.sto``): reading and writing.

The header ends with the line ``endheader``; it has ``nRows=211`` and ``inDegrees=yes`` (or the sentence "Angles are in
degrees."), or ``datarows 9009`` in the older style. One line of labels and the rows follow.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ppafo.errors import DataError
from ppafo.signals import Recording, RecordingKind
from ppafo.signals.recording import TIME, Floats
from ppafo.storage.comma_separated import check_clock
from ppafo.storage.files import write_file
from ppafo.storage.text_table import doubled, number_in, said_of_doubled, text_lines, told_apart, without_copies
from ppafo.wording import LONGEST_SHOWN, one_line

_END = "endheader"
_COUNT = re.compile(r"(nRows|nColumns|datarows|datacolumns)\s*(?:=|\s)\s*(\S+)", re.IGNORECASE)
_DEGREES = re.compile(r"inDegrees\s*=\s*(\w+)", re.IGNORECASE)
_SENTENCE = re.compile(r"angles are in (degrees|radians)", re.IGNORECASE)
_KIND = "kind="
"""Header key for the kind of a recording that was not measured, in files of this package."""
_MOST_DIGITS = 11
"""Largest number of digits in a header count."""
GAPS = ("nan",)
"""Cell texts of a gap in a table."""
_KINDS: tuple[RecordingKind, ...] = ("simulated", "synthetic")


@dataclass(frozen=True, slots=True, eq=False)
class _OpenSimTable:
    """Content of an OpenSim table.

    ``time``: times [s]. ``columns``: values by label. ``in_degrees``: None if the header does not state the unit of
    angles. ``is_old``: the header is in the older style of SIMM, with angles in degrees. ``kind``: kind of the
    recording, if this package wrote the file. ``first_line``: line number of the first row. ``remarks``: sentences on
    repairs.
    """

    name: str
    time: Floats
    columns: Mapping[str, Floats]
    in_degrees: bool | None
    first_line: int
    remarks: tuple[str, ...] = ()
    kind: RecordingKind = "measured"
    is_old: bool = False


class _Header(NamedTuple):
    """Header of an OpenSim table; counts of rows and columns are None if not stated.

    ``end`` is the index, from 0, of the last header line.
    """

    name: str
    row_count: int | None
    column_count: int | None
    in_degrees: bool | None
    end: int
    kind: RecordingKind
    is_old: bool


def read_opensim(path: str | Path, gaps: Sequence[str] = ()) -> _OpenSimTable:
    """Read a ``.mot`` or ``.sto`` file. Raises DataError with file, line and column of an error.

    A column count in the header that contradicts all rows, and last rows that repeat a time, are repaired with a
    remark. A cell with one of the texts in ``gaps`` becomes NaN; without ``gaps`` such a cell is an error.
    """
    try:
        lines = text_lines(path)
        header = _header(lines)
        label_line, written = _labels(lines, header)
        labels = told_apart(written)
        # Blank lines may only follow the last row.
        last = len(lines)
        while last > label_line and not lines[last - 1].strip():
            last -= 1
        row_lines = range(label_line + 1, last + 1)
        if not row_lines:
            raise DataError("has labels but no rows")
        if header.row_count is not None and header.row_count != len(row_lines):
            raise DataError(
                f"has {len(row_lines)} rows, but the header states {header.row_count}: the file is cut off or was "
                "edited; export it again, or correct the header"
            )
        table = _numbers(lines, row_lines, labels, gaps)
        # Some tools repeat the last time.
        count = len(table)
        while count > 1 and table[count - 1, 0] == table[count - 2, 0]:
            count -= 1
        time = table[:count, 0]
        check_clock(time, row_lines[:count])
    except DataError as error:
        raise DataError(f"{path}: {error}".replace(f"{path}: {path}:", f"{path}:")) from error
    twins = doubled(written[1:], labels[1:])
    columns = without_copies(dict(zip(labels[1:], table[:count, 1:].T, strict=True)), twins)
    remarks = []
    if header.column_count not in (None, len(labels)):
        remarks.append(
            f"the header states {header.column_count} columns, but labels and rows have {len(labels)}: "
            f"{len(labels)} columns were read"
        )
    if dropped := len(table) - count:
        rows, verb = ("the last row repeats", "was") if dropped == 1 else (f"the last {dropped} rows repeat", "were")
        remarks.append(f"{rows} the time {table[-1, 0]:g} s and {verb} dropped")
    return _OpenSimTable(
        name=header.name,
        time=time,
        columns=columns,
        in_degrees=header.in_degrees,
        first_line=row_lines.start,
        remarks=(*remarks, *said_of_doubled(twins, columns, "columns")),
        kind=header.kind,
        is_old=header.is_old,
    )


def _numbers(lines: list[str], row_lines: range, labels: list[str], gaps: Sequence[str]) -> Floats:
    """Parse the numbers of all rows (rows, columns), time first."""
    table = np.empty((len(row_lines), len(labels)))
    for row, number in enumerate(row_lines):
        cells = lines[number - 1].split()
        if len(cells) != len(labels):
            raise DataError(f"line {number} has {len(cells)} values for {len(labels)} columns")
        table[row, 0] = number_in(cells[0], number, labels[0])
        others = zip(cells[1:], labels[1:], strict=True)
        table[row, 1:] = [number_in(cell, number, label, gaps) for cell, label in others]
    return table


def _header(lines: list[str]) -> _Header:
    """Parse the header, up to ``endheader``. Raises DataError with the line of an error."""
    end = next((index for index, line in enumerate(lines) if line.strip().lower() == _END), None)
    if end is None:
        raise DataError(f"has no line '{_END}': the header is cut off, or this is not a .mot or .sto file")
    counts: dict[str, int] = {}
    in_degrees: bool | None = None
    kind: RecordingKind | None = None
    for number, line in enumerate((line.strip() for line in lines[:end]), start=1):
        count = _COUNT.match(line)
        if count is not None:
            text = count[2]
            if not (text.isascii() and text.isdigit() and len(text) <= _MOST_DIGITS):
                raise DataError(f"line {number}: {count[1]} is {one_line(text)[:LONGEST_SHOWN]!r}, not a whole number")
            counts[count[1].lower()] = int(text)
        key = _DEGREES.match(line)
        if key is not None and key[1].lower() not in ("yes", "no"):
            raise DataError(
                f"line {number}: inDegrees is {one_line(key[1])[:LONGEST_SHOWN]!r}; it must be 'yes' or 'no'"
            )
        stated = key or _SENTENCE.search(line)
        if stated is not None:
            says_degrees = stated[1].lower() in ("yes", "degrees")
            if in_degrees is not None and says_degrees != in_degrees:
                raise DataError(f"line {number}: the header states both degrees and radians; remove the wrong unit")
            in_degrees = says_degrees
        if kind is None and line.startswith(_KIND):
            kind = next((known for known in _KINDS if line == f"{_KIND}{known}"), None)
    first = lines[0].strip()
    return _Header(
        name=one_line(first.removeprefix("name ").strip() if end > 0 and first else "unnamed"),
        row_count=counts.get("nrows", counts.get("datarows")),
        column_count=counts.get("ncolumns", counts.get("datacolumns")),
        in_degrees=in_degrees,
        end=end,
        kind=kind or "measured",
        is_old="datacolumns" in counts,
    )


def _labels(lines: list[str], header: _Header) -> tuple[int, list[str]]:
    """Return the column labels and their line number (from 1), number first."""
    for number in range(header.end + 2, len(lines) + 1):
        if lines[number - 1].strip():
            # Labels may hold blanks where tabs separate them.
            line = lines[number - 1]
            labels = [cell.strip() for cell in line.strip().split("\t")] if "\t" in line else line.split()
            if labels[0].lower() != TIME:
                first = one_line(labels[0])[:LONGEST_SHOWN]
                raise DataError(f"line {number}: the first column must be '{TIME}', not {first!r}")
            if "" in labels:
                raise DataError(f"line {number}: column {labels.index('') + 1} has no name")
            return number, labels
    raise DataError(f"has nothing after '{_END}': the file is cut off; export it again")


_SIGNS = {
    r"(healthy_)?ankle_angle_[rl]": "is 0 with the foot square to the shank and above 0 in dorsiflexion",
    r"ankle_angle_[rl]_speed": "is above 0 towards dorsiflexion",
    r"ankle_angle_[rl]_moment": "is what the wearer gives, above 0 in dorsiflexion",
    r"ankle_angle_[rl]_device(_moment)?": "is what the device gives the wearer, above 0 in dorsiflexion",
    r"ground_force_[rl]_vy": "is above 0 upward",
}
"""Sign conventions for the header, by column name of OpenSim."""


def opensim_bytes(recording: Recording) -> bytes:
    """Return the ``.sto`` file of a recording: SI units, angles in radians, labels ``time`` and channel names.

    The header states units and signs as text, which OpenSim preserves, and the kind of a recording that was not
    measured.
    """
    units = ", ".join(f"{name} [{recording.unit(name)}]" for name in recording.names)
    signs = [f"{name} {sign}" for name in recording.names for form, sign in _SIGNS.items() if re.fullmatch(form, name)]
    signs.append(f"{'other columns' if signs else 'columns'} have the signs of ppafo")
    head = [
        one_line(recording.label),
        "version=1",
        f"nRows={len(recording)}",
        f"nColumns={1 + len(recording.names)}",
        "inDegrees=no",
        f"{_KIND}{recording.kind}",
        f"units={units}",
        f"signs={'; '.join(signs)}",
        _END,
        "\t".join((TIME, *recording.names)),
    ]
    columns = [recording.time, *(recording[name] for name in recording.names)]
    rows = ["\t".join(map(repr, row)) for row in zip(*(column.tolist() for column in columns), strict=True)]
    return ("\n".join([*head, *rows]) + "\n").encode()


def write_opensim(path: str | Path, recording: Recording) -> Path:
    """Write a recording as a ``.sto`` file for OpenSim. Returns the path."""
    return write_file(path, opensim_bytes(recording))
