"""Delimited text tables of motion: rows of numbers below a header of any layout; missing values are NaN."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ppafo.documents.regular_file import decoded
from ppafo.errors import DataError, refused_as
from ppafo.gait.recorded.table import MotionTable
from ppafo.signals.recording import Floats
from ppafo.storage.comma_separated import check_clock
from ppafo.storage.files import read_bytes
from ppafo.storage.text_table import doubled, number_in, said_of_doubled, told_apart, without_copies

UNSEEN = ("", "nan", "-nan", "n/a", "na", "null")
"""Cell texts of a missing value, in lower case."""


class NumberBlock(NamedTuple):
    """Rows of numbers in a text file.

    ``first`` is the index of the first row among the lines, ``decimal`` the decimal mark. With ``is_ragged``, cells at
    the end of a row may be missing, for example of markers that were not visible.
    """

    lines: Sequence[str]
    first: int
    delimiter: str
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


def delimiter_of(line: str) -> str:
    """Return the delimiter that occurs most often in a line: comma, semicolon or tab; a comma for a tie."""
    return max(",;\t", key=line.count)


def cells_of(line: str, delimiter: str) -> list[str]:
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
        rows.append(
            [
                number_in(row[column], number, names[column], () if index in clock else UNSEEN)
                for index, column in enumerate(named)
            ]
        )
        numbers.append(number)
    if not rows:
        raise DataError("has no rows of numbers")
    return np.array(rows), numbers


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
    twins = {name: others for name, others in doubled(written, distinct).items() if name != clock}
    columns = without_copies(
        {name: values[:, column] for column, name in enumerate(distinct) if column != time_column}, twins
    )
    written_units = [unit for name, unit in zip(names, units, strict=True) if name]
    stated = dict(zip((*distinct, *written), (*written_units, *written_units), strict=True))
    remarks = tuple(said_of_doubled(twins, columns, noun))
    return MotionTable(str(path), time, columns, {name: stated[name] for name in columns}, kind=kind, remarks=remarks)
