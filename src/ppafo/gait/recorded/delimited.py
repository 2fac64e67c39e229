"""Text tables of motion: rows of numbers below a header of any layout; missing values are NaN, names may repeat."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ppafo.documents.regular_file import decoded
from ppafo.errors import DataError, refused_as
from ppafo.gait.recorded.table import MotionTable, marker_of
from ppafo.signals.recording import Floats
from ppafo.storage.comma_separated import check_clock
from ppafo.storage.files import read_bytes, text_of
from ppafo.wording import LONGEST_SHOWN, count_of, finite_number, one_line

_UNSEEN = ("", "nan", "-nan", "n/a", "na", "null")
"""Cell texts of a missing value, in lower case."""
_MOST_SAID = 3
"""Largest number of repeated names with a separate remark."""


class NumberBlock(NamedTuple):
    """Rows of numbers in a text file.

    ``first`` is the index of the first row among the lines, ``decimal`` the decimal mark; ``delimiter`` is None for
    blanks and tabs. With ``is_ragged``, cells at the end of a row may be missing, as of markers that were not visible.
    """

    lines: Sequence[str]
    first: int
    delimiter: str | None
    decimal: str = "."
    is_ragged: bool = True


def lines_of(path: str | Path) -> list[str]:
    """Return the lines of a text file with any line ends; bytes that are not valid UTF-8 are replaced."""
    content = read_bytes(path)
    try:
        text = decoded(content)
    except UnicodeDecodeError:
        text = content.decode("utf-8", errors="replace")
    return text.splitlines()


def tabbed_lines(path: str | Path) -> list[str]:
    """Return the lines of a table of an older system. Raises DataError for a file that is not text.

    If a spreadsheet replaced the tabs by commas and padded all lines to equal width, tabs are restored.
    """
    content = read_bytes(path)
    with refused_as(DataError, path, DataError):
        lines = text_of(content).replace("\r\n", "\n").replace("\r", "\n").split("\n")
    last = next((line.strip() for line in reversed(lines) if line.strip()), "")
    if "," not in last or any(" " in last or "\t" in line for line in lines):
        return lines
    return [line.replace(",", "\t").rstrip("\t") for line in lines]


def delimiter_of(line: str) -> str:
    """Return the delimiter that occurs most often in a line: comma, semicolon or tab; a comma for a tie."""
    return max(",;\t", key=line.count)


def cells_of(line: str, delimiter: str | None) -> list[str]:
    """Return the cells of a line without surrounding blanks and quotation marks."""
    return [cell.strip().strip('"').strip() for cell in line.split(delimiter)]


def rows_of(block: NumberBlock, names: Sequence[str], clock: Sequence[int] = ()) -> tuple[Floats, list[int]]:
    """Return the numbers of a block, shape (rows, named columns), NaN for missing values, and line numbers from 1.

    ``names`` are the names of all columns in their order, "" for a column that is skipped; ``clock`` are the indices of
    the named columns that must be complete. Raises DataError, with line and column, for a cell that is not a number.
    """
    named = [column for column, name in enumerate(names) if name]
    width = len(names)
    rows: list[list[float]] = []
    numbers: list[int] = []
    for number, line in enumerate(block.lines[block.first :], block.first + 1):
        if line.startswith("#") or not line.strip():
            continue
        row = cells_of(line, block.delimiter)
        while len(row) > width and not row[-1]:
            row.pop()
        if len(row) > width or (len(row) < width and not block.is_ragged):
            raise DataError(f"line {number} has {len(row)} values for {width} columns")
        row += [""] * (width - len(row))
        if block.decimal != ".":
            row = [cell.replace(block.decimal, ".") for cell in row]
        rows.append([_number_in(row[at], number, names[at], index in clock) for index, at in enumerate(named)])
        numbers.append(number)
    if not rows:
        raise DataError("has no rows of numbers")
    return np.array(rows), numbers


def _number_in(cell: str, line: int, label: str, is_needed: bool) -> float:
    """Return the number in a cell, NaN if it is missing and not needed."""
    value = float("nan") if not is_needed and cell.lower() in _UNSEEN else finite_number(cell)
    if value is None:
        raise DataError(f"line {line}, column {label!r}: {one_line(cell)[:LONGEST_SHOWN]!r} is not a finite number")
    return value


def table_of(
    path: str | Path,
    block: NumberBlock,
    names: Sequence[str],
    units: Sequence[str],
    clock: str,
    *,
    frame_rate: float | None = None,
    seconds: float = 1.0,
    noun: str = "columns",
    kind: str = "measured",
) -> MotionTable:
    """Return the motion table of a block of numbers.

    ``names`` and ``units`` cover all columns in order: an empty name skips a column, an empty unit is not stated in the
    file. ``clock`` names the time column, in units of ``seconds`` [s]; with a ``frame_rate`` [Hz] it names the column
    of frame numbers from 1, or is empty for one frame per row.
    Duplicate column names are allowed. Raises DataError, with file, line and column, for values that cannot be read.
    """
    written = [name for name in names if name]
    distinct = told_apart(written)
    distinct_names = iter(distinct)
    named = [next(distinct_names) if name else "" for name in names]
    time_column = written.index(clock) if clock else None
    with refused_as(DataError, path, DataError):
        values, numbers = rows_of(block, named, () if time_column is None else (time_column,))
        has_clock = time_column is not None
        time: Floats = values[:, time_column] if has_clock else np.arange(len(values), dtype=np.float64)
        first = 1.0 if has_clock else 0.0
        time = time * seconds if frame_rate is None else (time - first) / frame_rate
        check_clock(time, numbers)
    others = {name: values[:, column] for column, name in enumerate(distinct) if column != time_column}
    columns, remarks = merged([name for column, name in enumerate(written) if column != time_column], others, noun)
    written_units = [unit for name, unit in zip(names, units, strict=True) if name]
    stated = dict(zip((*distinct, *written), (*written_units, *written_units), strict=True))
    return MotionTable(str(path), time, columns, {name: stated[name] for name in columns}, kind=kind, remarks=remarks)


def told_apart(names: Sequence[str], descriptions: Sequence[str] = ()) -> list[str]:
    """Return unique column names: duplicates get their descriptions as names, or numbers ``NAME#2``, ``LABEL#2.x``.

    Descriptions are used only if all columns of a name have one and none equals another name.
    """
    apart = list(names)
    for name, count in Counter(names).items():
        places = [index for index, other in enumerate(names) if other == name] if count > 1 else []
        said = [descriptions[index].strip() if index < len(descriptions) else "" for index in places]
        are_names = all(said) and len(set(said)) == len(said) and not set(said) & {*apart, *names}
        label = marker_of(name)
        for number, index in enumerate(places):
            apart[index] = said[number] if are_names else f"{label}#{number + 1}{name.removeprefix(label)}"
    return apart


def merged(
    written: Sequence[str], columns: Mapping[str, Floats], noun: str
) -> tuple[dict[str, Floats], tuple[str, ...]]:
    """Return columns with unique names; those that repeat a name and its values are one column of that name.

    ``written`` are the names in the file. Also returns a remark on each name whose columns differ, in words of the
    ``noun`` of columns; above a limit, only a count. A marker repeats with all its coordinates.
    """
    twins: dict[str, dict[str, list[str]]] = {}
    for name, own in zip(written, columns, strict=True):
        if name != own:
            twins.setdefault(marker_of(name), {}).setdefault(marker_of(own), []).append(own)
    renamed = dict[str, str]()
    said = []
    copies = set[str]()
    for label, groups in twins.items():
        first, *others = groups.values()
        pairs = [pair for other in others for pair in zip(first, other, strict=False)]
        if others and all(np.array_equal(columns[one], columns[two], equal_nan=True) for one, two in pairs):
            renamed |= {own: own.replace(marker_of(own), label, 1) for own in first}
            copies.update(*others)
        elif others:
            shown = one_line(label)[:LONGEST_SHOWN]
            said.append(f"several {noun} are named {shown!r}: they were renamed {', '.join(map(repr, groups))}")
    more = len(said) - _MOST_SAID
    if more > 0:
        said[_MOST_SAID:] = [f"{noun} of {count_of(more, 'more repeated name')} were renamed likewise"]
    return {renamed.get(name, name): values for name, values in columns.items() if name not in copies}, tuple(said)
