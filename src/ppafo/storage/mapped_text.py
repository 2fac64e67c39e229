"""Column map applied to a text table: cells become numbers in the units of the file, row by row.

Error messages name line and column of the file, or the key of the map, and a remedy.
"""

import csv
import re
from array import array
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import chain, islice
from typing import NamedTuple

import numpy as np

from ppafo.errors import DataError, PpafoError, noted_in, raise_noted
from ppafo.signals.recording import TIME
from ppafo.storage.clock import is_clock
from ppafo.storage.column_map import ColumnMap, MappedTable, in_map, shown_names
from ppafo.storage.comma_separated import finite_number, header_cells, kind_of_comments
from ppafo.storage.files import text_of
from ppafo.wording import LONGEST_SHOWN, nearest_name, one_line

_DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t"}
_MARKS = {"point": ".", "comma": ",", "apostrophe": "'", "blank": " "}
"""Decimal marks and thousands separators, by name in a column map."""
_COMMENT = "#"
_GROUPED = {
    name: re.compile(rf"[+-]?\d{{1,3}}(?:{re.escape(mark)}\d{{3}})+(?![\d{mark}])", re.ASCII)
    for name, mark in _MARKS.items()
}
"""Pattern of the integer part of a number with digit groups, by name of the separator."""

_SERIAL_MONITOR = re.compile(r"(\d{1,2}:\d{2}:\d{2}[.,]\d{3}) -> ")
"""Pattern of the time stamp at the start of each line from the serial monitor of the Arduino IDE."""
_STAMP = "timestamp"
"""Column name of the time stamps of the serial monitor."""
_STAMP_OF_HEADER = re.compile(r"^\d{1,2}:\d{2}:\d{2}\.\d{3}")
_DIRECTION = "direction"
_UPWARDS = (
    *("up", "rising", "rise", "increasing", "loading", "forward", "auf", "aufwärts", "steigend", "belastung"),
    *("+", "↑"),
)
_DOWNWARDS = (
    *("down", "falling", "fall", "decreasing", "unloading", "backward", "ab", "abwärts", "fallend", "entlastung"),
    *("-", "\u2212", "↓"),
)
_WORDS_OF_DIRECTION = {
    **dict.fromkeys(_UPWARDS, 1.0),
    **dict.fromkeys(_DOWNWARDS, -1.0),
    **dict.fromkeys(("none", "hold", "0"), 0.0),
}
"""Values of direction words, including ``+`` and ``-`` alone."""

Rows = Iterator[tuple[int, list[str]]]
"""Rows of a text table: line number in the file and cells."""


def read_mapped_text(content: bytes, columns: ColumnMap, map_name: str) -> MappedTable:
    """Read the columns of a text table that a map selects, in the units of the file.

    Raises DataError with line and column of an invalid cell or, for an error in the map, with the key and, if it has
    one, the name of the map.
    """
    lines = text_of(content, columns.encoding, remedy='; give encoding = "latin-1" for a Latin-1 file').splitlines()
    if any(map(_SERIAL_MONITOR.match, lines)):
        lines = _with_stamps_as_column(lines, columns)
    faults, indices = list[PpafoError](), dict[str, int]()
    with in_map(map_name):
        table = _begin(lines, columns)
        for name, mapped in columns.channels.items():
            with noted_in(faults):
                if mapped.column is not None:
                    indices[name] = _index_of(f"channels.{name}.column", mapped.column, table)
        raise_noted(faults)
        date = columns.channels[TIME].date
        date_index = None if date is None else _index_of(f"channels.{TIME}.date", date, table)
    time_index = indices.get(TIME)
    # A first row that is too short is refused with the others, below.
    is_time_of_day = (
        time_index is not None and time_index < len(table.first_row) and is_clock(table.first_row[time_index])
    )
    numbers = []
    for name, index in indices.items():
        mapped = columns.channels[name]
        words = (_WORDS_OF_DIRECTION if name == _DIRECTION else {}) if mapped.words is None else mapped.words
        if not (name == TIME and is_time_of_day):
            numbers.append(_Numbers(name, index, table.title(index), columns.decimal, mapped.thousands, words))
    clock: list[str] = []
    dates: list[str] = []
    last_index = max((*indices.values(), date_index or 0), default=0)
    stamps = array("q")
    # Row by row, so that no cell of a large file is kept as a text.
    for line, row in table.rows:
        _check_width(row, line, table, last_index)
        stamps.append(line)
        for column in numbers:
            column.values.append(column.number_in(row[column.index], line))
        if is_time_of_day and time_index is not None:
            clock.append(row[time_index])
            if date_index is not None:
                dates.append(row[date_index])
    return MappedTable(
        size=len(stamps),
        numbers={column.channel: np.array(column.values) for column in numbers},
        clock=clock if is_time_of_day else None,
        dates=dates if is_time_of_day and date_index is not None else None,
        rows=stamps,
        noun="line",
        kind=kind_of_comments(line for line in lines if line.startswith(_COMMENT)),
    )


def _with_stamps_as_column(lines: list[str], columns: ColumnMap) -> list[str]:
    """Return the lines of a serial monitor with the time stamps as first column, named ``timestamp``."""
    delimiter = _DELIMITERS.get(columns.delimiter, " ")
    # A time that has a comma must not be two cells.
    stamped = [_SERIAL_MONITOR.sub(lambda match: f"{match[1].replace(',', '.')}{delimiter}", line) for line in lines]
    if not columns.header:
        return stamped
    for number in range(columns.skip_lines, len(stamped)):
        if stamped[number].strip() and not stamped[number].startswith(_COMMENT):
            stamped[number] = _STAMP_OF_HEADER.sub(_STAMP, stamped[number])
            break
    return stamped


class _StartedTable(NamedTuple):
    """Text table at its first row: column names (empty without header), first row of numbers, all rows."""

    names: list[str]
    first_row: list[str]
    rows: Rows

    def title(self, index: int) -> str:
        """Return the name of a column in messages: its header, or its number from 1."""
        return self.names[index] if self.names else str(index + 1)


def _begin(lines: list[str], columns: ColumnMap) -> _StartedTable:
    """Read the header and first row of a table. Raises DataError if there is no header or no row."""
    rows = _split(lines, columns)
    head = next(rows, None)
    if head is None:
        skipped = f"after skip_lines = {columns.skip_lines}" if columns.skip_lines else ""
        raise DataError(f"has no rows {skipped}".rstrip())
    rows = islice(rows if columns.header else chain([head], rows), columns.skip_rows, None)
    first = next(rows, None)
    if first is None:
        remedy = "; give header = false if the first line contains numbers" if columns.header else ""
        raise DataError(f"has no rows of numbers{remedy}")
    cells = head[1] if columns.header else []
    # Brackets around several columns, such as 'x [left,right]', are no unit.
    if columns.delimiter in _DELIMITERS and len(first[1]) != len(cells):
        cells = header_cells(cells, _DELIMITERS[columns.delimiter])
    return _StartedTable([name.strip() for name in cells], first[1], chain([first], rows))


def _split(lines: list[str], columns: ColumnMap) -> Rows:
    """Yield line number and cells of every line after ``skip_lines`` that is neither blank nor a comment."""
    for number, line in islice(enumerate(lines, start=1), columns.skip_lines, None):
        if not line.strip() or line.startswith(_COMMENT):
            continue
        if columns.delimiter == "whitespace":
            yield number, line.split()
            continue
        try:
            yield number, next(csv.reader([line], delimiter=_DELIMITERS[columns.delimiter], strict=True))
        except csv.Error as error:
            raise DataError(f"line {number} cannot be read: {error}") from error


def _index_of(key: str, column: int | str, table: _StartedTable) -> int:
    """Return the index (from 0) of the column that the map gives at ``key``, by name or number from 1."""
    names = table.names or [str(number) for number in range(1, len(table.first_row) + 1)]
    if isinstance(column, int) and column <= len(names):
        return column - 1
    # A file without header has numbers alone.
    if table.names and names.count(str(column)) == 1 and isinstance(column, str):
        return names.index(column)
    hint = "" if column in names else nearest_name(str(column), names)
    raise DataError(
        f"{key} = {column!r}: must be the number of a column of the file, or a name that is not there twice{hint}; "
        f"available: {shown_names(names)}; if these are no columns, give delimiter, skip_lines or header"
    )


def _check_width(row: list[str], line: int, table: _StartedTable, last_index: int) -> None:
    """Raise DataError for a row with a wrong number of cells; empty cells at the end do not count."""
    width, first_width = len(row), len(table.first_row)
    expected = len(table.names) or first_width
    while width > expected and not row[width - 1].strip():
        width -= 1
    # A header may name columns at its end that no row has.
    if width == expected or (width == first_width and first_width < expected and last_index < width):
        return
    raise DataError(f"line {line} has {len(row)} values for {expected} columns; else give delimiter or skip_lines")


@dataclass(frozen=True, slots=True)
class _Numbers:
    """Column of numbers while a text table is read.

    ``channel``: name of the channel. ``index``: index of the column. ``title``: its name in messages. ``decimal`` and
    ``thousands``: marks in its numbers. ``words``: numbers for words. ``values``: numbers read so far.
    """

    channel: str
    index: int
    title: str
    decimal: str
    thousands: str | None
    words: Mapping[str, float]
    values: "array[float]" = field(default_factory=lambda: array("d"))

    def number_in(self, cell: str, line: int) -> float:
        """Parse the number, or a known word, in a cell. Raises DataError for any other text."""
        text = cell.strip()
        for word, value in self.words.items():
            if word.lower() == text.lower():
                return value
        at, key = f"line {line}, column {self.title!r}", f"(channels.{self.channel}.column)"
        mark = _MARKS[self.thousands] if self.thousands else ""
        # Marks between groups of digits have to be where they belong: without its mark 1.5 would be 15.
        if self.thousands and mark in text:
            grouped = _GROUPED[self.thousands].match(text)
            if grouped is None:
                raise DataError(
                    f"{at}: {_shown(text)} must have groups of three digits with thousands = '{self.thousands}' {key}"
                )
            text = grouped.group().replace(mark, "") + text[grouped.end() :]
        # A point that is no decimal mark of the file makes the text no number.
        number = finite_number(text if self.decimal == "point" else text.replace(".", "?").replace(",", "."))
        if number is not None:
            return number
        words = f" or a word of channels.{self.channel}.words: {shown_names(self.words)}" if self.words else ""
        raise DataError(f"{at}: {_shown(cell)} is not a finite number with decimal = '{self.decimal}'{words} {key}")


def _shown(cell: str) -> str:
    return repr(one_line(cell)[:LONGEST_SHOWN])
