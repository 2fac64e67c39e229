"""Foreign tables, with other columns, units and signs, read as recordings through a column map.

Error messages name file, line and column of an invalid cell, or the key of an error in the map.
"""

import csv
import math
import re
from array import array
from collections.abc import Iterator
from dataclasses import replace
from itertools import chain, islice
from pathlib import Path

import numpy as np

from ppafo.constants import MOLAR_MASSES, STANDARD_ATMOSPHERE
from ppafo.errors import DataError, Faults, UnitError, refused_as
from ppafo.signals import Channel, Recording
from ppafo.signals.recording import PLAIN_NUMBER, TIME, TIME_UNIT, Floats
from ppafo.storage.clock import clock_seconds, counted_on, is_clock
from ppafo.storage.column_map import (
    ColumnMap,
    MappedChannel,
    MappedDirection,
    MappedTable,
    check_sources,
    in_map,
    shown_names,
)
from ppafo.storage.comma_separated import (
    HeaderColumn,
    check_clock,
    header_cells,
    kind_of_comments,
)
from ppafo.storage.files import read_bytes, text_of
from ppafo.storage.matlab import MATLAB_SUFFIX, read_mapped_matlab, read_matlab
from ppafo.units import parse_quantity, split_number
from ppafo.units.spelling import flow_of, is_volume_flow, molar_mass_in, read_unit
from ppafo.wording import LONGEST_SHOWN, finite_number, known_names, nearest_name, one_line

_SHORTEST = 1e-12
"""Least time [s] between the two means of samples that give a slope; a shorter time is rounding."""
# Unit of a mass flow, and relative difference [-] below which two reference densities count as the same.
_MASS_FLOW = "kg/s"
_SAME_DENSITY = 5.0e-3
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
    faults = Faults()
    indices = {}
    of_date = []
    with in_map(map_name):
        names, first_row, rows = _begun(lines, columns)
        titles = names or [str(number) for number in range(1, len(first_row) + 1)]
        for name, mapped in columns.channels.items():
            with faults:
                if mapped.column is not None:
                    indices[name] = _index_of(f"channels.{name}.column", mapped.column, names, titles)
        faults.raise_all()
        if (date := columns.channels[TIME].date) is not None:
            of_date = [_index_of(f"channels.{TIME}.date", date, names, titles)]
    last_index = max((*indices.values(), *of_date), default=0)
    # A first row that is too short is refused with the others, below.
    is_time_of_day = indices.get(TIME, len(first_row)) < len(first_row) and is_clock(first_row[indices[TIME]])
    of_clock = [indices.pop(TIME)] if is_time_of_day else []
    of_date = of_date if is_time_of_day else []
    numbers = [(_NumberColumn(name, titles[index], columns), index, array("d")) for name, index in indices.items()]
    clock = []
    dates = []
    stamps = array("q")
    # Row by row, so that no cell of a large file is kept as a text.
    for line, row in rows:
        width = len(row)
        # Empty cells at the end do not count, and a header may name columns at its end that no row has.
        while width > len(titles) and not row[width - 1].strip():
            width -= 1
        if width != len(titles) and not (width == len(first_row) < len(titles) and last_index < width):
            raise DataError(
                f"line {line} has {len(row)} values for {len(titles)} columns; else give delimiter or skip_lines"
            )
        stamps.append(line)
        for column, index, values in numbers:
            values.append(column.number_in(row[index], line))
        clock += [row[index] for index in of_clock]
        dates += [row[index] for index in of_date]
    return MappedTable(
        size=len(stamps),
        numbers={column.channel: np.array(values) for column, _, values in numbers},
        clock=clock if of_clock else None,
        dates=dates if of_date else None,
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


def _begun(lines: list[str], columns: ColumnMap) -> tuple[list[str], list[str], Rows]:
    """Return column names (none without a header), first row, and all rows. Raises DataError if there is no row."""
    rows = _split(lines, columns)
    head = next(rows, None)
    if head is None:
        skipped = f" after skip_lines = {columns.skip_lines}" if columns.skip_lines else ""
        raise DataError(f"has no rows{skipped}")
    rows = islice(rows if columns.header else chain([head], rows), columns.skip_rows, None)
    first = next(rows, None)
    if first is None:
        remedy = "; give header = false if the first line contains numbers" if columns.header else ""
        raise DataError(f"has no rows of numbers{remedy}")
    cells = head[1] if columns.header else []
    # Brackets around several columns, such as 'x [left,right]', are no unit.
    if columns.delimiter in _DELIMITERS and len(first[1]) != len(cells):
        cells = header_cells(cells, _DELIMITERS[columns.delimiter])
    return [name.strip() for name in cells], first[1], chain([first], rows)


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


def _index_of(key: str, column: int | str, names: list[str], titles: list[str]) -> int:
    """Return the index (from 0) of the column that the map gives at ``key``, by name or number from 1."""
    if isinstance(column, int) and column <= len(titles):
        return column - 1
    # A file without header has numbers alone.
    if isinstance(column, str) and names.count(column) == 1:
        return names.index(column)
    hint = "" if column in titles else nearest_name(str(column), titles)
    raise DataError(
        f"{key} = {column!r}: must be the number of a column of the file, or a name that is not there twice{hint}; "
        f"available: {shown_names(titles)}; if these are no columns, give delimiter, skip_lines or header"
    )


class _NumberColumn:
    """Column of numbers or known words of a channel, with its title in messages, in the marks of a column map."""

    def __init__(self, channel: str, title: str, columns: ColumnMap) -> None:
        mapped = columns.channels[channel]
        self.channel = channel
        self.title = title
        self.decimal = columns.decimal
        self.thousands = mapped.thousands
        words = (_WORDS_OF_DIRECTION if channel == _DIRECTION else {}) if mapped.words is None else mapped.words
        self.words = list(words)
        self.values = {word.lower(): words[word] for word in reversed(words)}

    def number_in(self, cell: str, line: int) -> float:
        """Parse the number, or a known word, in a cell. Raises DataError for any other text."""
        text = cell.strip()
        if text.lower() in self.values:
            return self.values[text.lower()]
        at = f"line {line}, column {self.title!r}"
        key = f"(channels.{self.channel}.column)"
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


def read_foreign(
    path: str | Path,
    columns: ColumnMap,
    atmosphere: float = STANDARD_ATMOSPHERE,
    map_name: str = "",
    gas: str = "",
) -> Recording:
    """Read a single recording from a table through a column map, in SI units; arguments and errors as ``read_trials``.

    Gauge pressure is relative to ``atmosphere`` [Pa absolute]. Raises DataError if the map selects several trials.
    """
    recordings = read_trials(path, columns, atmosphere, map_name, gas)
    if len(recordings) > 1:
        with refused_as(DataError, path, DataError), in_map(map_name):
            raise DataError(f"trial selects {len(recordings)} recordings; give the number of one trial")
    return recordings[0]


def read_trials(
    path: str | Path,
    columns: ColumnMap,
    atmosphere: float = STANDARD_ATMOSPHERE,
    map_name: str = "",
    gas: str = "",
) -> tuple[Recording, ...]:
    """Read all recordings from a table through a column map: one, or one for each trial that the map selects.

    ``gas`` is the gas of volume flows if the map states none. Raises DataError with file and column or, for an error in
    the map, with the key and the name of the map.
    """
    suffix = Path(path).suffix.lower()
    # Both name the file themselves where it cannot be read.
    content = read_matlab(path) if suffix == MATLAB_SUFFIX else read_bytes(path)
    with refused_as(DataError, path, DataError):
        if suffix == ".nc":
            raise DataError("is a NetCDF file, which names its own channels and units: read it without a column map")
        with in_map(map_name):
            check_sources(columns)
        table = (
            read_mapped_text(content, columns, map_name)
            if isinstance(content, bytes)
            else read_mapped_matlab(content, columns, map_name)
        )
        with in_map(map_name):
            faults = Faults()
            channels = {}
            for name, mapped in columns.channels.items():
                with faults:
                    if name == TIME:
                        time = _time(mapped, table, atmosphere)
                    else:
                        channels[name] = _channel(name, mapped, table, atmosphere, gas)
            faults.raise_all()
            falls = np.flatnonzero(np.diff(time) < 0.0) + 1
            if columns.trial is None and falls.size and np.all(time[falls] < np.mean(time[:2])):
                line = f"{table.noun} {table.rows[falls[0]]}"
                raise DataError(
                    f"{line}: the clock restarts, {falls.size + 1} trials; give trial: a number, list or 'all'"
                )
            trials = {"": slice(None)} if columns.trial is None else _rows_of_trials(time, columns.trial)
        recordings = []
        for suffix_of_label, rows in trials.items():
            check_clock(time[rows], table.rows[rows], table.noun)
            trial = {name: replace(channel, values=channel.values[rows]) for name, channel in channels.items()}
            trial_label = f"{one_line(Path(path).stem)}{suffix_of_label}"
            # A synthetic recording stays one through a column map.
            recording = Recording(trial_label, time[rows], trial, table.kind)
            with in_map(map_name):
                recordings.append(
                    recording if columns.direction is None else _with_direction(recording, columns.direction)
                )
        return tuple(recordings)


def _rows_of_trials(time: Floats, wanted: str | int | tuple[int, ...]) -> dict[str, slice]:
    """Return the rows of each selected trial by label suffix; a trial starts where the time [s] falls."""
    starts = [0, *(np.flatnonzero(np.diff(time) < 0.0) + 1).tolist(), time.size]
    count = len(starts) - 1
    numbers = range(1, count + 1) if isinstance(wanted, str) else np.atleast_1d(wanted).tolist()
    for trial in numbers:
        if trial > count:
            raise DataError(
                f"trial = {trial}: the clock restarts {count - 1} times, so the file has trials 1 to {count}"
            )
    rows = {f" trial {number}": slice(starts[number - 1], starts[number]) for number in numbers}
    return {"": rows[f" trial {wanted}"]} if isinstance(wanted, int) else rows


def _channel(name: str, mapped: MappedChannel, table: MappedTable, atmosphere: float, gas: str = "") -> Channel:
    """Return a channel in SI units, from a column or a constant; a factor ``times`` contributes its own unit.

    ``atmosphere`` [Pa absolute] and ``gas`` (empty if unknown) complete gauge pressures and volume flows.
    """
    if mapped.constant is not None:
        with refused_as(DataError, f"channels.{name}.constant = {mapped.constant!r}", UnitError):
            value, unit = split_number(mapped.constant)
            column = HeaderColumn(name, _flow_unit(name, unit, mapped, gas) or PLAIN_NUMBER, mapped.between)
            return column.channel(np.full(table.size, value), atmosphere)
    numbers = table.numbers.get(name, np.empty(0))
    values = mapped.sign * (mapped.factor * numbers + mapped.offset)
    unit = mapped.unit
    key = f"unit = {mapped.unit!r}"
    if mapped.times is not None:
        with refused_as(DataError, f"channels.{name}.times = {mapped.times!r}", UnitError):
            multiple, unit_of_multiple = split_number(mapped.times)
        values = values * multiple
        unit = f"{unit} {unit_of_multiple}".removeprefix(f"{PLAIN_NUMBER} ").strip()
        key += f" with times = {mapped.times!r}"
    with refused_as(DataError, f"channels.{name}.{key}", UnitError):
        return HeaderColumn(name, _flow_unit(name, unit, mapped, gas), mapped.between).channel(values, atmosphere)


def _flow_unit(name: str, unit: str, mapped: MappedChannel, gas: str) -> str:
    """Return the unit of a channel; a volume flow measured as mass flow gets its reference condition and gas."""
    is_flow = HeaderColumn(name, unit).si_unit == _MASS_FLOW and unit not in ("", PLAIN_NUMBER) and is_volume_flow(unit)
    if not is_flow:
        if mapped.at is not None or mapped.gas is not None:
            raise UnitError("'at' and 'gas' are allowed only for a mass flow in a unit of volume flow, such as 'L/min'")
        return unit
    flow = flow_of(unit)
    if mapped.gas is not None and molar_mass_in(f"{flow.name} ({mapped.gas})") is None:
        known = known_names(mapped.gas, MOLAR_MASSES)
        raise UnitError(f"there is no gas '{mapped.gas}'{known}, or a molar mass in kg/mol")
    by_unit = flow.at(mapped.at or "", mapped.gas or gas)
    by_map = flow_of(flow.unit).at(mapped.at or flow.condition, mapped.gas or "".join(flow.gases[:1]) or gas)
    if not math.isclose(read_unit(by_unit).scale, read_unit(by_map).scale, rel_tol=_SAME_DENSITY):
        raise UnitError(f"means '{by_map}' by 'at' and 'gas', but '{by_unit}' by 'unit'; give each only once")
    return by_unit


def _time(mapped: MappedChannel, table: MappedTable, atmosphere: float) -> Floats:
    """Return the time [s] of the rows: from a rate, from times of day, or from numbers with a unit."""
    if mapped.rate is not None:
        with refused_as(DataError, f"channels.{TIME}.rate = {mapped.rate!r}", UnitError):
            rate = parse_quantity(mapped.rate, "1/s")
            if rate <= 0.0:
                raise UnitError("must be above 0 Hz")
        return np.arange(table.size) / rate
    if table.clock is None:
        return counted_on(_channel(TIME, mapped, table, atmosphere).values)
    rows = [f"{table.noun} {row}, channels.{TIME}" for row in table.rows]
    time = clock_seconds(table.clock, rows, table.dates, mapped.date_order, mapped.clock)
    steps = np.diff(time)
    # Loggers that write whole seconds may write many rows in each.
    if table.size > 2 and (steps == 0.0).any() and time[-1] > 0.0 and (steps >= 0.0).all():
        mean_rate = float(f"{(table.size - 1) / time[-1]:.3g}")
        raise DataError(
            f"channels.{TIME}: several rows have the same time of day; give the sample rate instead of the column: "
            f'{TIME} = {{ rate = "{mean_rate:g} Hz" }} (mean of this file)'
        )
    return time


def _with_direction(recording: Recording, wanted: MappedDirection) -> Recording:
    """Add the channel ``direction`` to a recording: 1 up, -1 down, 0 for slower than the threshold.

    Unless the recording has a channel ``repetition``, one is added that numbers the sweeps from 1; it is 0 where the
    motion is too slow. Raises DataError for a channel that is absent or never moves, and for an invalid threshold or
    window.
    """
    with refused_as(DataError, f"direction.of = {wanted.of!r}", DataError):
        unit = recording.unit(wanted.of)
    rate_unit = "1/s" if unit == PLAIN_NUMBER else f"{unit.removesuffix('_d')}/s"
    with refused_as(DataError, f"direction.threshold = {wanted.threshold!r}", UnitError):
        threshold = parse_quantity(wanted.threshold, rate_unit)
    with refused_as(DataError, f"direction.window = {wanted.window!r}", UnitError):
        window = parse_quantity(wanted.window, TIME_UNIT)
    # The slope [1/s] between the means of the half windows [s] before and after each sample.
    sums = np.pad(np.cumsum([recording[wanted.of], recording.time], axis=1), ((0, 0), (1, 0)))
    here = np.arange(recording.time.size)
    # At least the sample itself on either side, where the window is shorter than a sample.
    first = np.minimum(np.searchsorted(recording.time, recording.time - 0.5 * window), here)
    end = np.maximum(np.searchsorted(recording.time, recording.time + 0.5 * window, side="right"), here + 1)
    before = (sums[:, here + 1] - sums[:, first]) / (here - first + 1)
    change, elapsed = (sums[:, end] - sums[:, here]) / (end - here) - before
    rate = wanted.sign * (change / np.maximum(elapsed, _SHORTEST))
    direction = np.where(rate > threshold, 1.0, np.where(rate < -threshold, -1.0, 0.0))
    moving = np.flatnonzero(direction)
    if moving.size == 0:
        raise DataError(f"direction.threshold = {wanted.threshold!r}: '{wanted.of}' never changes faster")
    directed = recording.with_channel("direction", direction, PLAIN_NUMBER)
    if "repetition" in recording:
        return directed
    sweeps = np.zeros(direction.size)
    is_reversed = np.diff(direction[moving]) != 0.0
    sweeps[moving] = np.concatenate(([1], 1 + np.cumsum(is_reversed)))
    return directed.with_channel("repetition", sweeps, PLAIN_NUMBER)
