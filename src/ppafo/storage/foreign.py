"""Tables from elsewhere, with their own columns, units and signs, read through a column map as recordings.

A map is part of a TOML file, ``[columns.NAME]``. What cannot be read is named with file, line and column.
"""

import csv
import math
import re
from array import array
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from importlib import resources
from itertools import chain, islice
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.models import StrictTable, Text, make_schema, read_model
from ppafo.documents.toml_text import TomlKind
from ppafo.errors import DataError, UnitError, nearest_name, one_line, refused_as
from ppafo.signals import Channel, Recording
from ppafo.signals.recording import PLAIN_NUMBER, TIME, TIME_UNIT, Between, Floats
from ppafo.storage.comma_separated import SPLIT_NUMBERS, Column, check_clock, in_si, kind_of_comments
from ppafo.storage.files import read_bytes, text_of

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


def read_foreign(
    path: str | Path,
    columns: ColumnMap,
    label: str | None = None,
    atmosphere: float = STANDARD_ATMOSPHERE,
    map_name: str = "",
) -> Recording:
    """Return the recording in a table through a column map, in SI units; gauge counts from ``atmosphere`` [Pa abs].

    DataError names the file and the column; of a fault in the map its key, and the map where ``map_name`` says which.
    """
    content = read_bytes(path)
    with refused_as(DataError, path, DataError):
        if Path(path).suffix.lower() == ".nc":
            raise DataError("is a NetCDF file, which names its own channels and units: read it without a column map")
        lines = text_of(content, columns.encoding, '; give encoding = "latin-1" if it is that').splitlines()
        if TIME not in columns.channels:
            raise DataError(f"the column map has no channel '{TIME}'")
        names, first, rows = _rows(lines, columns)
        width = len(names) or len(first)
        places = {
            name: place for name, item in columns.channels.items() if (place := _place(name, item, names, first)) >= 0
        }
        titles = {name: names[place] if names else str(place + 1) for name, place in places.items()}
        # Row by row, so that no cell of a large file is kept as a text.
        numbers, found = {name: array("d") for name in places}, array("q")
        for line, row in rows:
            if len(row) != width:
                remedy = f"; {SPLIT_NUMBERS}" if columns.delimiter == "comma" and len(row) == 2 * width else ""
                raise DataError(f"line {line} has {len(row)} values for {width} columns{remedy}")
            found.append(line)
            for name, place in places.items():
                thousands = columns.channels[name].thousands
                numbers[name].append(_number(row[place], thousands, columns.decimal, titles[name], line))
        channels = {}
        for name, item in columns.channels.items():
            with _in_map(map_name):
                channels[name] = _channel(name, item, np.array(numbers.get(name, ())), len(found), atmosphere)
        time = channels.pop(TIME).values
        check_clock(time, found)
        # A synthetic recording stays one through a column map.
        kind = kind_of_comments(line for line in lines if line.startswith(_COMMENT))
        recording = Recording(label or one_line(Path(path).stem), time, channels, kind)
        with _in_map(map_name):
            return recording if columns.direction is None else _with_direction(recording, columns.direction)


def _in_map(map_name: str) -> AbstractContextManager[None]:
    """Name the map in what is refused within a ``with`` block, if it has a name."""
    return refused_as(DataError, f"column map {one_line(map_name)}", DataError) if map_name else nullcontext()


def _rows(lines: list[str], columns: ColumnMap) -> tuple[list[str], list[str], Rows]:
    """Return the names of the columns (none without a header), the first row of numbers, and all rows of text."""

    def split() -> Rows:
        for number, line in islice(enumerate(lines, start=1), columns.skip_lines, None):
            if not line.strip() or line.startswith(_COMMENT):
                continue
            if columns.delimiter == "whitespace":
                row = line.split()
            else:
                try:
                    row = next(csv.reader([line], delimiter=_DELIMITERS[columns.delimiter], strict=True))
                except csv.Error as error:
                    raise DataError(f"line {number} cannot be read: {error}") from error
            if row:
                yield number, row

    cells = split()
    head = next(cells, None)
    if head is None:
        raise DataError("has no rows" if columns.skip_lines == 0 else f"has no rows after {columns.skip_lines} lines")
    names = [name.strip() for name in head[1]] if columns.header else []
    rows = islice(cells if columns.header else chain([head], cells), columns.skip_rows, None)
    first = next(rows, None)
    if first is None:
        raise DataError("has no rows of numbers")
    return names, first[1], chain([first], rows)


def _other_delimiter(cells: list[str], is_there: Callable[[list[str]], bool]) -> str:
    """Return the remedy where the first line with another delimiter would have what is missing, else nothing."""
    parts = (
        (name, [part.strip() for cell in cells for part in cell.split(mark)]) for name, mark in _DELIMITERS.items()
    )
    return next((f'; give delimiter = "{name}"' for name, found in parts if found != cells and is_there(found)), "")


def _place(name: str, item: MappedChannel, names: list[str], first: list[str]) -> int:
    """Return the place of the column of a channel from 0, -1 for a constant."""
    if (item.column is None) == (item.constant is None):
        raise DataError(
            f"the column map gives channel '{name}' {'neither' if item.column is None else 'both'} "
            f"a column {'nor' if item.column is None else 'and'} a constant; give one of them"
        )
    if item.column is None:
        return -1
    if isinstance(item.column, int):
        wanted, line = item.column, names or first
        if wanted > len(line):
            remedy = _other_delimiter(line, lambda found: len(found) >= wanted)
            raise DataError(f"channel '{name}' is to come from column {wanted}, the file has {len(line)}{remedy}")
        return wanted - 1
    if not names:
        raise DataError(f"channel '{name}' names a column {item.column!r}, but the file has no header; give its number")
    places = [place for place, known in enumerate(names, start=1) if known == item.column]
    if not places:
        shown = ", ".join(one_line(known)[:_LONGEST_SHOWN] for known in names)
        remedy = _other_delimiter(names, lambda found: item.column in found)
        hint = "" if remedy else nearest_name(item.column, names)
        raise DataError(f"channel '{name}': there is no column {item.column!r}{hint}; the file has {shown}{remedy}")
    if len(places) > 1:
        shown = " and ".join(map(str, places))
        raise DataError(f"channel '{name}': columns {shown} are both called {item.column!r}; give the number of one")
    return places[0] - 1


def _number(cell: str, thousands: str | None, decimal: str, column: str, line: int) -> float:
    text = cell.strip()
    if thousands is not None and _MARKS[thousands] in text:
        grouped = _GROUPED[thousands].match(text)
        if grouped is None:
            # Without its mark 1.5 would be 15.
            shown = one_line(text)[:_LONGEST_SHOWN]
            wanted = f'does not have groups of three digits, as thousands = "{thousands}" says'
            raise DataError(f"line {line}, column {column!r}: {shown!r} {wanted}")
        text = grouped.group().replace(_MARKS[thousands], "") + text[grouped.end() :]
    if decimal != "point":
        # A point that is left is no mark of this file; what no number has in it makes the text none.
        text = text.replace(".", "?").replace(_MARKS[decimal], ".")
    value = float(text) if _NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        shown = one_line(cell)[:_LONGEST_SHOWN]
        with_point = cell.strip().replace(",", ".") if decimal == "point" else ""
        remedy = '; give decimal = "comma"' if "," in cell and _NUMBER.fullmatch(with_point) else ""
        raise DataError(f"line {line}, column {column!r}: {shown!r} is not a finite number{remedy}")
    return value


def _channel(name: str, item: MappedChannel, numbers: Floats, count: int, atmosphere: float) -> Channel:
    """Return a channel in SI, a constant one too; the quantity that it is multiplied by brings its own unit."""
    from ppafo.units import split_quantity

    if item.constant is not None:
        with refused_as(DataError, f"channel '{name}', constant = {item.constant!r}", UnitError):
            value, unit = split_quantity(item.constant)
            column = Column(name, unit or PLAIN_NUMBER)
            return Channel(in_si(column, np.full(count, value), atmosphere), column.si_unit, item.between)
    values, unit, key = item.sign * (item.factor * numbers + item.offset), item.unit, f"unit = {item.unit!r}"
    if item.times is not None:
        with refused_as(DataError, f"channel '{name}', times = {item.times!r}", UnitError):
            multiple, times_unit = split_quantity(item.times)
        values, unit = values * multiple, f"{unit} {times_unit}".removeprefix(f"{PLAIN_NUMBER} ").strip()
        key += f" with times = {item.times!r}"
    column = Column(name, unit)
    with refused_as(DataError, f"channel '{name}', {key}", UnitError):
        return Channel(in_si(column, values, atmosphere), column.si_unit, item.between)


def _with_direction(recording: Recording, wanted: MappedDirection) -> Recording:
    """Return the recording with ``direction``, and with ``repetition`` counted up at every reversal."""
    from ppafo.units import parse_quantity

    unit = recording.unit(wanted.of)
    rate_unit = f"{'1' if unit == PLAIN_NUMBER else unit.removesuffix('_d')}/s"
    with refused_as(DataError, f"direction of '{wanted.of}'", UnitError):
        threshold = parse_quantity(wanted.threshold, rate_unit)
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
        raise DataError(f"direction: '{wanted.of}' never moves faster than {wanted.threshold}")
    sweeps = np.zeros(direction.size)
    sweeps[moving] = np.concatenate(([1], 1 + np.cumsum(np.diff(direction[moving]) != 0.0)))
    found = recording.with_channel("direction", direction, PLAIN_NUMBER)
    return found if "repetition" in recording else found.with_channel("repetition", sweeps, PLAIN_NUMBER)
