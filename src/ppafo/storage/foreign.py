"""Tables from elsewhere, with their own columns, units and signs, read through a column map as recordings.

A map is part of a TOML file, ``[columns.NAME]``. What cannot be read is named with file, line and column, and what is
wrong in the map with its key. Clocks are in ``clock.py``, MATLAB's files in ``matlab.py``.
"""

import csv
import math
import re
from array import array
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from importlib import resources
from itertools import chain, islice
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.models import StrictTable, Text, make_schema, read_model
from ppafo.documents.toml_text import TomlKind
from ppafo.errors import DataError, UnitError, nearest_name, one_line, refused_as
from ppafo.signals import Channel, Recording, RecordingKind
from ppafo.signals.recording import PLAIN_NUMBER, TIME, TIME_UNIT, Between, Floats
from ppafo.storage.clock import DateOrder, Form, clock_seconds, counted_on, is_clock
from ppafo.storage.comma_separated import SPLIT_NUMBERS, Column, check_clock, in_si, kind_of_comments
from ppafo.storage.files import read_bytes, text_of
from ppafo.storage.matlab import MATLAB_SUFFIX, MatlabFile, read_matlab

Thousands = Literal["point", "comma", "apostrophe", "blank"]


class MappedChannel(StrictTable):
    """Where one channel comes from: a column, or a constant. The value is sign * (factor * number + offset) in unit."""

    column: Annotated[
        Annotated[int, Field(ge=1)] | Text | None, Field(description="number of the column from 1, or its name")
    ] = None
    constant: Annotated[Text | None, Field(description="instead of a column: one value, such as '1 bar_a'")] = None
    unit: Annotated[str, Field(description="unit of the value, such as 'bar_g'; '-' for a plain number")] = "-"
    sign: Annotated[Literal[1, -1], Field(description="-1 where the file has the opposite sign")] = 1
    factor: Annotated[float, Field(description="unit per number, for a sensor's volts")] = 1.0
    offset: Annotated[float, Field(description="added after the factor, in unit")] = 0.0
    times: Annotated[Text | None, Field(description="a quantity to multiply by, such as a lever arm '0.13 m'")] = None
    thousands: Annotated[Thousands | None, Field(description="mark between groups of digits")] = None
    between: Annotated[
        Between | None,
        Field(description="between two samples: 'hold' the earlier value, or 'linear'; left out, a command holds"),
    ] = None
    words: Annotated[
        dict[str, float] | None,
        Field(description="numbers for words in the column; direction knows up, down, auf, ab and others"),
    ] = None
    at: Annotated[
        Text | None,
        Field(description="reference condition of a volume flow: 'ANR', 'DIN 1343' or '0 degC, 1.01325 bar_a'"),
    ] = None
    gas: Annotated[
        Text | None, Field(description="gas of a volume flow, such as 'air' or '0.044 kg/mol'; default: the set's")
    ] = None
    rate: Annotated[
        Text | None, Field(description="of time alone, instead of a column: rows per second, such as '100 Hz'")
    ] = None
    date: Annotated[
        Annotated[int, Field(ge=1)] | Text | None,
        Field(description="of time alone: column of the date beside a time of day"),
    ] = None
    date_order: Annotated[
        DateOrder | None, Field(description="of time alone: what comes first in a date such as 03/04/2026")
    ] = None
    clock: Annotated[Form | None, Field(description="of time alone: what a time of day such as 08:10 is")] = None


class MappedDirection(StrictTable):
    """Direction (1 or -1, 0 for neither) from how fast a channel moves; sweeps one way are counted as repetitions."""

    of: Annotated[Text, Field(description="channel whose rate decides")]
    threshold: Annotated[Text, Field(description="slowest rate that counts, such as '2 mm/s'")]
    window: Annotated[Text, Field(description="time over which the channel is smoothed, such as '0.2 s'")]
    sign: Annotated[Literal[1, -1], Field(description="-1 where a growing channel means falling pressure")] = 1


class ColumnMap(StrictTable):
    """How a file is written and what its columns are."""

    delimiter: Annotated[
        Literal["comma", "semicolon", "tab", "whitespace"], Field(description="what separates columns")
    ] = "comma"
    decimal: Annotated[Literal["point", "comma"], Field(description="decimal mark")] = "point"
    encoding: Annotated[Literal["utf-8", "latin-1"], Field(description="encoding of the text")] = "utf-8"
    header: Annotated[bool, Field(description="whether a line names the columns")] = True
    skip_lines: Annotated[int, Field(ge=0, description="lines before the header, or before the first row")] = 0
    skip_rows: Annotated[
        int, Field(ge=0, description="rows below the header to leave out: a line of units, or numbers")
    ] = 0
    channels: Annotated[dict[str, MappedChannel], Field(min_length=1, description="channels by name, with 'time'")]
    direction: Annotated[MappedDirection | None, Field(description="direction from the rate of a channel")] = None


class ColumnMaps(BaseModel):
    """Column maps by name, as a file has them; a problem file of ``ppafo identify`` has more beside them."""

    model_config = ConfigDict(strict=True, frozen=True, allow_inf_nan=False)

    columns: Annotated[dict[str, ColumnMap], Field(min_length=1, description="column maps by name")]


_FILE = TomlKind("file of column maps", "columns", resources.files("ppafo.storage"), DataError)


def load_column_map(path: str | Path, name: str | None = None) -> ColumnMap:
    """Return a column map of a TOML file by its name; without a name the file's only one.

    DataError where it has no such map, or several and no name is given.
    """
    parsed, file = read_model(_FILE, ColumnMaps, path)
    maps = parsed.columns
    known = ", ".join(maps)
    if name is None and len(maps) > 1:
        raise DataError(f"{file}: has several column maps; name one as {file}:NAME; available: {known}")
    if name is not None and name not in maps:
        raise DataError(f"{file}: there is no column map '{name}'{nearest_name(name, maps)}; available: {known}")
    return maps[name or next(iter(maps))]


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a file of column maps."""
    return make_schema(ColumnMaps, "ppafo column maps")


_DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t"}
_MARKS = {"point": ".", "comma": ",", "apostrophe": "'", "blank": " "}
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_GROUPED = {
    name: re.compile(rf"[+-]?\d{{1,3}}(?:{re.escape(mark)}\d{{3}})+(?![\d{mark}])", re.ASCII)
    for name, mark in _MARKS.items()
}
_LONGEST_SHOWN = 40
Rows = Iterator[tuple[int, list[str]]]
"""Rows of text, each with its line in the file."""
_COMMENT = "#"
_SERIAL_MONITOR = re.compile(r"(\d{1,2}:\d{2}:\d{2}[.,]\d{3}) -> ")
"""What the serial monitor of the Arduino IDE puts before each line."""
_STAMP = "timestamp"
_HEADER_WITHIN = 200
"""Lines in which a header is looked for that is not where the map has it."""

_DIRECTION = "direction"
_UPWARDS = (
    "up",
    "rising",
    "rise",
    "increasing",
    "loading",
    "forward",
    "auf",
    "aufwärts",
    "steigend",
    "belastung",
    "+",
    "↑",
)
_DOWNWARDS = (
    *("down", "falling", "fall", "decreasing", "unloading", "backward", "ab", "abwärts", "fallend", "entlastung"),
    *("-", "\u2212", "↓"),
)
_WORDS = (
    {word: 1.0 for word in _UPWARDS} | {word: -1.0 for word in _DOWNWARDS} | dict.fromkeys(("none", "hold", "0"), 0.0)
)
"""What people write for directions; ``-`` alone and ``+`` too."""


class _Table(NamedTuple):
    """What a map takes of a file: numbers by channel, cells of a clock and of its dates, and where each row stands."""

    size: int
    numbers: dict[str, Floats]
    clock: list[str] | None
    dates: list[str] | None
    rows: Sequence[int]
    noun: str
    kind: RecordingKind


def column_map_of(columns: ColumnMap | str | Path) -> tuple[ColumnMap, str]:
    """Return a map, or the one that is named as a file, ``logger.toml:bench``, and its name, empty for a map."""
    if isinstance(columns, ColumnMap):
        return columns, ""
    text = str(columns)
    path, separator, name = text.rpartition(".toml:")
    return load_column_map(f"{path}.toml", name) if separator and name else load_column_map(text), text


def read_foreign(
    path: str | Path,
    columns: ColumnMap,
    label: str | None = None,
    atmosphere: float = STANDARD_ATMOSPHERE,
    map_name: str = "",
    gas: str = "",
) -> Recording:
    """Return the recording in a table through a column map, in SI units; gauge counts from ``atmosphere`` [Pa abs].

    ``gas`` is the gas of a volume flow whose map does not say it. DataError names the file and the column; of a fault
    in the map its key, and the map where ``map_name`` says which.
    """
    suffix = Path(path).suffix.lower()
    # Both name the file themselves where it cannot be read.
    content = read_matlab(path) if suffix == MATLAB_SUFFIX else read_bytes(path)
    with refused_as(DataError, path, DataError):
        if suffix == ".nc":
            raise DataError("is a NetCDF file, which names its own channels and units: read it without a column map")
        with _in_map(map_name):
            _check_keys(columns)
        if isinstance(content, bytes):
            table = _of_text(content, columns, map_name)
        else:
            table = _of_matlab(content, columns, map_name)
        with _in_map(map_name):
            channels = {
                name: _channel(name, mapped, table.numbers.get(name, np.empty(0)), table.size, (atmosphere, gas))
                for name, mapped in columns.channels.items()
                if name != TIME
            }
            time = _time(columns.channels[TIME], table, atmosphere)
        check_clock(time, table.rows, table.noun)
        # A synthetic recording stays one through a column map.
        recording = Recording(label or one_line(Path(path).stem), time, channels, table.kind)
        with _in_map(map_name):
            return recording if columns.direction is None else _with_direction(recording, columns.direction)


def _in_map(map_name: str) -> AbstractContextManager[None]:
    """Name the map in what is refused within a ``with`` block, if it has a name."""
    return refused_as(DataError, f"column map {one_line(map_name)}", DataError) if map_name else nullcontext()


_OF_TIME = ("rate", "date", "date_order", "clock")


def _check_keys(columns: ColumnMap) -> None:
    """Refuse a map without a time, a channel that comes from nowhere or from two places, and keys that mean nothing."""
    if TIME not in columns.channels:
        raise DataError(f'has no channels.{TIME}; give a column, or {TIME} = {{ rate = "100 Hz" }}')
    for name, mapped in columns.channels.items():
        sources = [key for key in ("column", "constant", "rate") if getattr(mapped, key) is not None]
        may = "a column, constant or rate" if name == TIME else "a column or constant"
        for key in () if name == TIME else _OF_TIME:
            if getattr(mapped, key) is not None:
                raise DataError(f"channels.{name}.{key} is a key of channels.{TIME} alone")
        if len(sources) != 1:
            several = "both" if len(sources) == 2 else "all of"
            keys = f"{several} a {' and a '.join(sources)}" if sources else f"no {may[2:]}"
            raise DataError(f"channels.{name} gives {keys}; give one of them")


def _time(mapped: MappedChannel, table: _Table, atmosphere: float) -> Floats:
    """Return the time [s] of the rows: by their number and a rate, from a clock, or from numbers with a unit."""
    from ppafo.units import parse_quantity

    if mapped.rate is not None:
        with refused_as(DataError, f"channels.{TIME}.rate = {mapped.rate!r}", UnitError):
            rate = _rate(mapped.rate, parse_quantity)
        return np.arange(table.size) / rate
    if table.clock is None:
        return counted_on(
            _channel(TIME, mapped, table.numbers.get(TIME, np.empty(0)), table.size, (atmosphere, "")).values
        )
    rows = [f"{table.noun} {row}, channels.{TIME}" for row in table.rows]
    time = clock_seconds(table.clock, rows, table.dates, mapped.date_order, mapped.clock)
    # Loggers that write whole seconds may write many rows in each.
    if table.size > 2 and (np.diff(time) == 0.0).any() and time[-1] > 0.0 and (np.diff(time) >= 0.0).all():
        rate = float(f"{(table.size - 1) / time[-1]:.3g}")
        raise DataError(
            f"channels.{TIME}: several rows have the same time of day; give the rate of the rows in place of the "
            f'column, such as {TIME} = {{ rate = "{rate:g} Hz" }}, which is the mean of this file'
        )
    return time


def _rate(text: str, parse: Callable[[str, str], float]) -> float:
    """Return rows per second of ``100 Hz``, ``100 1/s`` or ``10 1/min``; UnitError for another text."""
    rate = parse(text, "1/s")
    if rate <= 0.0:
        raise UnitError("must be above 0 Hz")
    return rate


def _of_matlab(file: MatlabFile, columns: ColumnMap, map_name: str) -> _Table:
    """Return what a map takes of a MATLAB file, by the names of its variables."""
    numbers: dict[str, Floats] = {}
    clock = dates = None
    with _in_map(map_name):
        for name, mapped in columns.channels.items():
            if mapped.column is None:
                continue
            column = _variable(f"channels.{name}.column", mapped.column, file)
            if name == TIME and column in file.texts:
                clock = file.texts[column]
            else:
                numbers[name] = file.columns[column]
        date = columns.channels[TIME].date
        if date is not None:
            dates = file.texts.get(_variable(f"channels.{TIME}.date", date, file))
        lengths = {name: values.size for name, values in numbers.items()} | ({TIME: len(clock)} if clock else {})
        if len(set(lengths.values())) != 1:
            said = ", ".join(f"channels.{name} has {size}" for name, size in lengths.items())
            raise DataError(f"all columns must have the same number of samples: {said or 'there is no column'}")
        for name, values in numbers.items():
            bad = np.flatnonzero(~np.isfinite(values))
            if bad.size:
                raise DataError(f"channels.{name}.column: sample {bad[0] + 1} is {values[bad[0]]}, not a finite number")
    count = next(iter(lengths.values()))
    return _Table(
        size=count, numbers=numbers, clock=clock, dates=dates, rows=range(1, count + 1), noun="sample", kind="measured"
    )


def _variable(key: str, wanted: int | str, file: MatlabFile) -> str:
    """Return the name of a column in a MATLAB file; a number is a column of its only matrix."""
    if isinstance(wanted, int):
        matrices = sorted({name.partition("(")[0] for name in file.columns if "(:," in name and "." not in name})
        if len(matrices) != 1:
            raise DataError(f"{key} = {wanted}: columns of a .mat file have names; it has {_shown(file.columns)}")
        wanted = f"{matrices[0]}(:,{wanted})"
    name = re.sub(r"\s+", "", wanted) if "(" in wanted else wanted
    if name not in file.columns and name not in file.texts:
        known = (*file.columns, *file.texts)
        hint = nearest_name(name, known)
        raise DataError(
            f"{key} = {wanted!r}: the file has no such column{hint}; it has {_shown(known)}{file.said_of_objects()}"
        )
    return name


_MOST_SHOWN = 20


def _shown(names: Collection[str]) -> str:
    shown = ", ".join(one_line(name)[:_LONGEST_SHOWN] for name in islice(names, _MOST_SHOWN))
    return f"{shown}, ..." if len(names) > _MOST_SHOWN else shown


def _of_text(content: bytes, columns: ColumnMap, map_name: str) -> _Table:
    """Return what a map takes of a table of text."""
    remedy = '; give encoding = "latin-1" if it is that'
    lines = text_of(content, columns.encoding, remedy).splitlines()
    if any(map(_SERIAL_MONITOR.match, lines)):
        lines = _stamps_as_column(lines, columns)
    time = columns.channels[TIME]
    with _in_map(map_name):
        names, first, rows = _rows(lines, columns)
        places = {
            name: index
            for name, mapped in columns.channels.items()
            if (index := _place(f"channels.{name}.column", mapped.column, names, first, lines)) >= 0
        }
        date_place = _place(f"channels.{TIME}.date", time.date, names, first, lines)
    titles = {name: names[index] if names else str(index + 1) for name, index in places.items()}
    # A first row that is too short is refused with the others, below.
    begins = first[places[TIME]] if TIME in places and places[TIME] < len(first) else ""
    clock: list[str] | None = [] if is_clock(begins) else None
    dates: list[str] | None = [] if clock is not None and date_place >= 0 else None
    last = max((*places.values(), date_place), default=0)
    # Row by row, so that no cell of a large file is kept as a text.
    numbers, stamps = {name: array("d") for name in places if name != TIME or clock is None}, array("q")
    for line, row in rows:
        _check_width(row, len(names), len(first), last, (line, columns))
        stamps.append(line)
        for name, index in places.items():
            if name == TIME and clock is not None:
                clock.append(row[index])
                continue
            mapped = columns.channels[name]
            known = mapped.words if mapped.words is not None else _WORDS if name == _DIRECTION else {}
            value = _of_word(row[index], known)
            numbers[name].append(
                _number(row[index], mapped.thousands, columns.decimal, (titles[name], line, name, known))
                if value is None
                else value
            )
        if dates is not None:
            dates.append(row[date_place])
    kind = kind_of_comments(line for line in lines if line.startswith(_COMMENT))
    return _Table(
        size=len(stamps),
        numbers={name: np.array(column) for name, column in numbers.items()},
        clock=clock,
        dates=dates,
        rows=stamps,
        noun="line",
        kind=kind,
    )


def _of_word(cell: str, words: Mapping[str, float]) -> float | None:
    text = cell.strip()
    return next((value for word, value in words.items() if word.lower() == text.lower()), None) if words else None


def _check_width(row: list[str], header: int, first: int, last: int, place: tuple[int, ColumnMap]) -> None:
    """Refuse a row that has not as many cells as the header or the first row, beside empty ones at its end."""
    (line, columns), width = place, len(row)
    wide = header or first
    while width > wide and not row[width - 1].strip():
        width -= 1
    if width == wide or (width == first and first < wide and last < width):
        return
    split = columns.delimiter == "comma" and width == 2 * wide
    remedy = f"; {SPLIT_NUMBERS}" if split else ""
    if line <= columns.skip_lines + 2 and not split:
        remedy = "; where the table begins further down, give skip_lines"
    raise DataError(f"line {line} has {len(row)} values for {wide} columns{remedy}")


def _stamps_as_column(lines: list[str], columns: ColumnMap) -> list[str]:
    """Return the lines of a serial monitor with the time before each as a first column, called ``timestamp``."""
    mark = _DELIMITERS.get(columns.delimiter, " ")
    # A time that has a comma must not be two cells.
    stamped = [_SERIAL_MONITOR.sub(lambda match: f"{match[1].replace(',', '.')}{mark}", line) for line in lines]
    if not columns.header:
        return stamped
    for number in range(columns.skip_lines, len(stamped)):
        if stamped[number].strip() and not stamped[number].startswith(_COMMENT):
            stamped[number] = re.sub(r"^\d{1,2}:\d{2}:\d{2}\.\d{3}", _STAMP, stamped[number])
            break
    return stamped


def _rows(lines: list[str], columns: ColumnMap) -> tuple[list[str], list[str], Rows]:
    """Return the names of the columns (none without a header), the first row of numbers, and all rows of text."""

    def split() -> Rows:
        for number, line in islice(enumerate(lines, start=1), columns.skip_lines, None):
            if not line.strip() or line.startswith(_COMMENT):
                continue
            row = _cells(line, number, columns)
            if row:
                yield number, row

    cells = split()
    head = next(cells, None)
    if head is None:
        skipped = f"after the {columns.skip_lines} of skip_lines = {columns.skip_lines}" if columns.skip_lines else ""
        raise DataError(f"has no rows {skipped}".rstrip())
    names = [name.strip() for name in head[1]] if columns.header else []
    rows = islice(cells if columns.header else chain([head], cells), columns.skip_rows, None)
    first = next(rows, None)
    if first is None:
        remedy = ": header = false, if the first line is one of numbers" if columns.header else ""
        raise DataError(f"has no rows of numbers{remedy}")
    return names, first[1], chain([first], rows)


def _cells(line: str, number: int, columns: ColumnMap) -> list[str]:
    if columns.delimiter == "whitespace":
        return line.split()
    try:
        return next(csv.reader([line], delimiter=_DELIMITERS[columns.delimiter], strict=True))
    except csv.Error as error:
        raise DataError(f"line {number} cannot be read: {error}") from error


def _other_delimiter(cells: list[str], is_there: Callable[[list[str]], bool]) -> str:
    """Return the remedy where the first line with another delimiter would have what is missing, else nothing."""
    parts = (
        (name, [part.strip() for cell in cells for part in cell.split(mark)]) for name, mark in _DELIMITERS.items()
    )
    return next(
        (f'; give delimiter = "{name}"' for name, other in parts if other != cells and is_there(other)),
        "",
    )


def _place(key: str, column: int | str | None, names: list[str], first: list[str], lines: list[str]) -> int:
    """Return the place of a column from 0, -1 where none is mapped; ``key`` is where the map has it."""
    if column is None:
        return -1
    if isinstance(column, int):
        wanted, line = column, names or first
        if wanted > len(line):
            remedy = _other_delimiter(line, lambda cells: len(cells) >= wanted)
            raise DataError(f"{key} = {wanted}: the file has {len(line)} columns{remedy}")
        return wanted - 1
    if not names:
        raise DataError(f"{key} = {column!r} names a column, but the file has no header; give its number")
    places = [number for number, known in enumerate(names, start=1) if known == column]
    if not places:
        remedy = _other_delimiter(names, lambda cells: column in cells) or _other_line(lines, names, column)
        hint = "" if remedy else nearest_name(column, names)
        raise DataError(f"{key} = {column!r}: there is no such column{hint}; the file has {_shown(names)}{remedy}")
    if len(places) > 1:
        shown = " and ".join(map(str, places))
        raise DataError(f"{key}: columns {shown} are both called {column!r}; give the number of one")
    return places[0] - 1


def _other_line(lines: list[str], names: list[str], column: str) -> str:
    """Return how many lines to skip where a line further down is the header, else nothing."""
    for number, line in enumerate(lines[:_HEADER_WITHIN]):
        for name, mark in _DELIMITERS.items():
            cells = [cell.strip() for cell in line.split(mark)]
            if column in cells and cells != names:
                return f'; line {number + 1} has it: give skip_lines = {number} and delimiter = "{name}"'
    return ""


def _number(cell: str, thousands: str | None, decimal: str, place: tuple[str, int, str, Mapping[str, float]]) -> float:
    """Return the number in a cell; ``place`` is its column, line and channel, and the words that the channel knows."""
    column, line, channel, words = place
    where, key = f"line {line}, column {column!r}", f"(channels.{channel}.column)"
    text = cell.strip()
    if thousands is not None and _MARKS[thousands] in text:
        grouped = _GROUPED[thousands].match(text)
        if grouped is None:
            # Without its mark 1.5 would be 15.
            shown = one_line(text)[:_LONGEST_SHOWN]
            wanted = f'does not have groups of three digits, as thousands = "{thousands}" says'
            raise DataError(f"{where}: {shown!r} {wanted} {key}")
        text = grouped.group().replace(_MARKS[thousands], "") + text[grouped.end() :]
    if decimal != "point":
        # A point that is left is no mark of this file; what no number has in it makes the text none.
        text = text.replace(".", "?").replace(_MARKS[decimal], ".")
    value = float(text) if _NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        shown = one_line(cell)[:_LONGEST_SHOWN]
        with_point = cell.strip().replace(",", ".") if decimal == "point" else ""
        remedy = '; give decimal = "comma"' if "," in cell and _NUMBER.fullmatch(with_point) else ""
        if words:
            remedy = f"; known words: {_shown(words)}; others in channels.{channel}.words"
        elif not remedy and is_clock(cell) and channel != TIME:
            remedy = "; it is a time of day"
        raise DataError(f"{where}: {shown!r} is not a finite number {key}{remedy}")
    return value


def _channel(name: str, mapped: MappedChannel, numbers: Floats, count: int, around: tuple[float, str]) -> Channel:
    """Return a channel in SI, a constant one too; the quantity that it is multiplied by brings its own unit.

    ``around`` is the atmosphere [Pa absolute], and the gas of a volume flow that does not say it.
    """
    from ppafo.units import split_number

    atmosphere, gas = around
    if mapped.constant is not None:
        with refused_as(DataError, f"channels.{name}.constant = {mapped.constant!r}", UnitError):
            value, unit = split_number(mapped.constant)
            column = Column(name, _flow_unit(name, unit, mapped, gas) or PLAIN_NUMBER)
            return Channel(in_si(column, np.full(count, value), atmosphere), column.si_unit, mapped.between)
    values, unit, key = mapped.sign * (mapped.factor * numbers + mapped.offset), mapped.unit, f"unit = {mapped.unit!r}"
    if mapped.times is not None:
        with refused_as(DataError, f"channels.{name}.times = {mapped.times!r}", UnitError):
            multiple, times_unit = split_number(mapped.times)
        values, unit = values * multiple, f"{unit} {times_unit}".removeprefix(f"{PLAIN_NUMBER} ").strip()
        key += f" with times = {mapped.times!r}"
    with refused_as(DataError, f"channels.{name}.{key}", UnitError):
        column = Column(name, _flow_unit(name, unit, mapped, gas))
        return Channel(in_si(column, values, atmosphere), column.si_unit, mapped.between)


def _flow_unit(name: str, unit: str, mapped: MappedChannel, gas: str) -> str:
    """Return the unit of a channel, with reference condition and gas where it is a volume flow for a mass flow."""
    from ppafo.units import is_volume_flow, with_condition

    is_flow = Column(name, unit).si_unit == _MASS_FLOW and unit not in ("", PLAIN_NUMBER) and is_volume_flow(unit)
    if not is_flow:
        if mapped.at is not None or mapped.gas is not None:
            raise UnitError("at and gas belong to a volume flow, such as 'L/min', in the place of a mass flow")
        return unit
    return with_condition(unit, mapped.at, mapped.gas or gas) if mapped.at else unit


_MASS_FLOW = "kg/s"


def _with_direction(recording: Recording, wanted: MappedDirection) -> Recording:
    """Return the recording with ``direction``, and with ``repetition`` counted up at every reversal."""
    from ppafo.units import parse_quantity

    with refused_as(DataError, f"direction.of = {wanted.of!r}", DataError):
        unit = recording.unit(wanted.of)
    rate_unit = "1/s" if unit == PLAIN_NUMBER else f"{unit.removesuffix('_d')}/s"
    with refused_as(DataError, f"direction.threshold = {wanted.threshold!r}", UnitError):
        threshold = parse_quantity(wanted.threshold, rate_unit)
    with refused_as(DataError, f"direction.window = {wanted.window!r}", UnitError):
        window = parse_quantity(wanted.window, TIME_UNIT)
    # The slope between the means of the half windows [s] before and after each sample.
    time = recording.time
    sums = np.concatenate(([0.0], np.cumsum(recording[wanted.of])))
    times = np.concatenate(([0.0], np.cumsum(time)))
    here = np.arange(time.size)
    # At least the sample itself on either side, where the window is shorter than a sample.
    first = np.minimum(np.searchsorted(time, time - 0.5 * window), here)
    last = np.maximum(np.searchsorted(time, time + 0.5 * window, side="right"), here + 1)
    before, after = here - first + 1, last - here
    means = (sums[here + 1] - sums[first]) / before, (sums[last] - sums[here]) / after
    centres = (times[here + 1] - times[first]) / before, (times[last] - times[here]) / after
    gap = np.maximum(centres[1] - centres[0], 1e-12)
    rate = wanted.sign * np.asarray((means[1] - means[0]) / gap)
    direction = np.where(rate > threshold, 1.0, np.where(rate < -threshold, -1.0, 0.0))
    moving = np.flatnonzero(direction)
    if moving.size == 0:
        raise DataError(f"direction.threshold: '{wanted.of}' never moves faster than {wanted.threshold}")
    sweeps = np.zeros(direction.size)
    sweeps[moving] = np.concatenate(([1], 1 + np.cumsum(np.diff(direction[moving]) != 0.0)))
    directed = recording.with_channel("direction", direction, PLAIN_NUMBER)
    return directed if "repetition" in recording else directed.with_channel("repetition", sweeps, PLAIN_NUMBER)
