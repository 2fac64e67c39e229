"""Recordings as CSV: a header line ``time [s],angle [rad],...`` and a line for each sample, without loss of bits.

A channel with an unusual interpolation between samples states it in its header, ``supply_pressure [Pa] hold`` or
``linear``.

Files from other sources may use other units (``angle [deg]``, ``pressure_1 [psi_g]``) and may start with comment lines
(#).
"""

import csv
import difflib
import io
import math
import re
from array import array
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import DataError, Faults, UnitError, refused_as
from ppafo.signals import CHANNELS, Channel, Recording, RecordingKind
from ppafo.signals.recording import BETWEEN, PLAIN_NUMBER, TIME, TIME_UNIT, Between, Floats
from ppafo.storage.files import read_bytes, text_of, write_file
from ppafo.units import LEVEL, check_unit, to_si
from ppafo.wording import LONGEST_SHOWN, finite_number, first_twice, nearest_name, one_line

_HEADER = re.compile(r"\s*(\w+)\s*\[\s*([^\[\]]+?)\s*\]\s*(\w*)\s*", re.ASCII)
_ONLY_SIMULATED = "supplied_mass"
_MAPPED = "; other names are read through a column map"
_NO_TIMES = f'for a table without a time column, give the sample rate in the map: {TIME} = {{ rate = "100 Hz" }}'
_SIMILAR = 0.8
"""Similarity [-] above which a word counts as a misspelt kind; 'measurement: run 3' in a comment stays below."""


@dataclass(frozen=True, slots=True)
class HeaderColumn:
    """Column of a CSV header: channel name (or time), unit of the numbers, interpolation between samples."""

    name: str
    unit: str
    between: Between | None = None

    @property
    def si_unit(self) -> str:
        """Unit in which the recording stores the channel; unknown channels keep their own unit."""
        if self.name == TIME:
            return TIME_UNIT
        return CHANNELS[self.name].unit if self.name in CHANNELS else self.unit

    def channel(self, values: Floats, atmosphere: float) -> Channel:
        """Return the channel of values in the unit of the column; gauge pressure is relative to ``atmosphere`` [Pa].

        Raises UnitError for a unit that does not fit.
        """
        known, wanted = (_SPELT.get(unit, unit) for unit in (self.unit, self.si_unit))
        if self.unit != self.si_unit:
            values = np.array([to_si(value, known, wanted, atmosphere) for value in values.tolist()])
        elif self.name not in CHANNELS:
            check_unit(known)
        return Channel(values, self.si_unit, self.between, self.unit)


def parse_header(cells: list[str]) -> list[HeaderColumn]:
    """Parse a header such as ``time [s]``, ``pressure_1 [psi_g]`` into columns, time first.

    Raises DataError for an invalid header.
    """
    if not cells:
        raise DataError("line 1 is empty; it must contain the header")
    columns = []
    if is_of_frame(cells):
        cells = [f"{name} [{CHANNELS[name].unit if name in CHANNELS else TIME_UNIT}]" for name in map(str.strip, cells)]
    for cell in cells:
        match = _HEADER.fullmatch(cell)
        if match is None:
            shown = one_line(cell if len(cell) <= 40 else f"{cell[:36]} ...")
            raise DataError(
                f"the header must name columns as 'name [unit]', separated by commas, not as '{shown}'"
                f"{_MAPPED}, for another delimiter or a decimal comma too"
            )
        name = match[1]
        unit = "Pa" if match[2] == LEVEL else match[2]
        word = match[3]
        # Time itself does nothing between its samples.
        between = next((known for known in BETWEEN if word == known and name != TIME), None)
        if word and between is None:
            hint = nearest_name(word, BETWEEN)
            raise DataError(f"column '{name}': '{word}' after the unit must be {' or '.join(BETWEEN)}{hint}")
        columns.append(HeaderColumn(name, unit, between))
    names = [column.name for column in columns]
    if names[0] != TIME:
        raise DataError(f"the first column must be '{TIME} [{TIME_UNIT}]', not '{names[0]}'{_MAPPED}; {_NO_TIMES}")
    twice = first_twice(names)
    if twice is not None:
        raise DataError(f"the column '{twice}' occurs twice")
    return columns


def is_of_frame(cells: Sequence[str]) -> bool:
    """Return whether a header was written by ``to_dataframe().to_csv()`` of a result: bare channel names, in SI.

    Bare names alone are not enough: a logger may call a column in degrees ``angle``.
    """
    names = {cell.strip() for cell in cells}
    return _ONLY_SIMULATED in names and names <= {TIME, *CHANNELS}


def check_clock(time: Floats, lines: Sequence[int], noun: str = "line") -> None:
    """Raise DataError unless times [s] increase; ``lines`` are the line numbers of the rows in the file.

    The message names the line, or the row in units of ``noun``.
    """
    stalled = np.flatnonzero(np.diff(time) <= 0.0)
    if stalled.size:
        index = int(stalled[0]) + 1
        word = "stands still" if time[index] == time[index - 1] else "goes backwards"
        raise DataError(
            f"{noun} {lines[index]}, column '{TIME}': the clock {word}: {time[index]:.9g} s follows "
            f"{time[index - 1]:.9g} s; time must increase from sample to sample"
        )


_SPELT = {"Pa": LEVEL, PLAIN_NUMBER: ""}
"""Unit names as ``ppafo.units`` requires: pressure with its kind, no unit for a plain number."""
_MARKS: dict[RecordingKind, str] = {
    "simulated": "# simulated: a model's own output, not measured",
    "synthetic": "# synthetic: made by a model to stand for a measurement",
}
"""Comment lines that mark the kind of a recording; when read, only the word before the colon counts."""

_MARK = re.compile(r"#\s*(\w+):.*")
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d*,\d+(?:[eE][+-]?\d+)?\s*", re.ASCII)


def write_csv(path: str | Path, recording: Recording) -> Path:
    """Write a recording as CSV in SI units, with a comment line on its kind unless measured. Returns the path."""
    return write_file(path, marked_csv_bytes(recording))


def marked_csv_bytes(recording: Recording) -> bytes:
    """Return the CSV table of a recording as a separate file, with a comment line on its kind unless measured."""
    mark = f"{_MARKS[recording.kind]}\n" if recording.kind in _MARKS else ""
    return mark.encode() + csv_bytes(recording)


def csv_bytes(recording: Recording) -> bytes:
    """Return the CSV table of a recording without its label and kind."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    # A pressure states that it is absolute.
    heads = [
        f"{name} [{LEVEL if channel.unit == 'Pa' else channel.unit}] {channel.between or ''}".rstrip()
        for name, channel in recording.channels.items()
    ]
    writer.writerow([f"{TIME} [{TIME_UNIT}]", *heads])
    columns = [recording.time, *(recording[name] for name in recording.names)]
    rows = map(",".join, zip(*(map(repr, column.tolist()) for column in columns), strict=True))
    buffer.writelines(f"{row}\n" for row in rows)
    return buffer.getvalue().encode()


def header_cells(cells: list[str], mark: str) -> list[str]:
    """Return the cells of a header line; a unit that has the delimiter ``mark`` in its brackets stays in one cell."""
    joined: list[str] = []
    for cell in cells:
        if joined and "[" in joined[-1] and "]" not in joined[-1]:
            joined[-1] += mark + cell
        else:
            joined.append(cell)
    # A bracket that is never closed, or opened twice, belongs to no unit.
    return joined if all(cell.count("[") == cell.count("]") <= 1 for cell in joined) else cells


def read_csv(
    path: str | Path, label: str | None = None, atmosphere: float = STANDARD_ATMOSPHERE, row_time: float | None = None
) -> Recording:
    """Read a recording from a CSV file, in SI units, labelled with the file name by default.

    Gauge pressure is relative to ``atmosphere`` [Pa absolute]. ``row_time`` [s] is the time between the rows of a table
    without a time column; None requires the column. Raises DataError for an invalid file.
    """
    content = read_bytes(path)
    try:
        text = text_of(content, remedy='; read a Latin-1 file through a column map with encoding = "latin-1"')
        # Whoever writes a table ends its last line: one without an end is a file that was cut off in a number.
        if not text.endswith(("\n", "\r")):
            raise DataError("the last line has no line break, so its last number may be cut off")
        lines = text.splitlines()
        first = next((number for number, line in enumerate(lines) if not line.startswith("#")), len(lines))
        head = next(islice(lines, first, None), "")
        # A unit may contain a semicolon: a tab or a semicolon separates only where all cells then are columns.
        marks = (each for each in "\t;" if each in head and all(map(_HEADER.fullmatch, head.split(each))))
        mark = next(marks, ",")
        rows: Iterator[list[str]] = csv.reader(islice(lines, first, None), delimiter=mark, strict=True)
        header = header_cells(next(rows, []), mark)
        if not header and not any(lines[first:]):
            raise DataError("has no header")
        # A first column without a name is the row number that pandas writes.
        is_counted = bool(header) and not header[0].strip()
        has_rows_only = row_time is not None and not any(cell.partition("[")[0].strip() == TIME for cell in header)
        columns = parse_header([*([f"{TIME} [{TIME_UNIT}]"] if has_rows_only else []), *header[is_counted:]])
        if mark != ",":
            # Commas that separate no columns are decimal marks.
            rows = (
                [cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell for cell in row] for row in rows
            )
        values = _table(header, rows, first)
        if is_counted and not np.array_equal(values[:, 0], np.arange(len(values))):
            raise DataError("the first column has no name and no row numbers from 0; name or remove the column")
        kind = "simulated" if is_of_frame(header) else kind_of_comments(lines[:first])
        line_numbers = range(first + 2, first + 2 + len(values))
        series = list(values[:, is_counted:].T)
        if row_time is not None and has_rows_only:
            series = [row_time * np.arange(float(len(values))), *series]
        return recording_of_columns(columns, series, line_numbers, label or one_line(Path(path).stem), kind, atmosphere)
    except csv.Error as error:
        raise DataError(f"{path}: is not a CSV file: {error}") from error
    except DataError as error:
        raise DataError(f"{path}: {error}") from error


def recording_of_columns(
    columns: Sequence[HeaderColumn],
    values: Sequence[Floats],
    rows: Sequence[int],
    label: str,
    kind: RecordingKind,
    atmosphere: float,
    noun: str = "line",
) -> Recording:
    """Return a recording from columns in the units of their headers, time first; ``rows`` are row numbers in the file.

    Raises DataError for a unit that does not fit, and for times that do not increase, naming the row in units of
    ``noun``.
    """
    from ppafo.storage.clock import counted_on  # a run reads no clocks of loggers

    if not len(values[0]):
        raise DataError("has a header but no samples")
    channels = {}
    faults = Faults()
    for column, numbers in zip(columns, values, strict=True):
        with faults, refused_as(DataError, f"column '{column.name} [{column.unit}]'", UnitError):
            if column.si_unit == PLAIN_NUMBER and column.unit.removeprefix("m") in ("V", "A"):
                raise UnitError(f"'{column.name}' is dimensionless; give factor in a column map")
            channels[column.name] = column.channel(numbers, atmosphere)
    faults.raise_all()
    time = counted_on(channels.pop(TIME).values)
    check_clock(time, rows, noun)
    return Recording(label, time, channels, kind)


def kind_of_comments(comments: Iterable[str]) -> RecordingKind:
    """Return the kind of recording stated in a comment, measured by default.

    Raises DataError for a misspelt kind, so that a simulation cannot pass as a measurement, and for two different
    kinds.
    """
    named: list[RecordingKind] = []
    for match in filter(None, map(_MARK.fullmatch, comments)):
        near = difflib.get_close_matches(match[1], _MARKS, n=1, cutoff=_SIMILAR)
        if near and match[1] not in _MARKS:
            raise DataError(f"the comment '# {match[1]}:' names no kind of recording, did you mean '{near[0]}'?")
        named += [kind for kind in _MARKS if kind == match[1]]
    if len(set(named)) > 1:
        raise DataError(f"the comments name two kinds of recording, {' and '.join(dict.fromkeys(named))}")
    return named[0] if named else "measured"


def _table(header: list[str], rows: Iterable[list[str]], skipped: int) -> Floats:
    """Parse the numbers below the header row by row, which needs far less memory than all cells as text."""
    # Blank lines may only follow the last row: one between rows is a sample that was lost.
    numbers = array("d")
    blank = None
    for line, row in enumerate(rows, start=skipped + 2):
        if not row:
            blank = blank or line
            continue
        if blank is not None:
            raise DataError(f"line {blank} is blank, and rows follow; remove the line, or add its {len(header)} values")
        if len(row) != len(header):
            raise DataError(f"line {line} has {len(row)} values for {len(header)} columns")
        try:
            values = [float(cell) for cell in row]
        except ValueError:
            values = [math.nan]
        # All cells at once, as one by one costs more than reading the numbers. Python takes 1_000 for a thousand, and
        # digits of any script; in a table they are a slip.
        whole = "".join(row)
        if not whole.isascii() or "_" in whole or not all(map(math.isfinite, values)):
            is_number = [cell.isascii() and finite_number(cell.strip()) is not None for cell in row]
            name = header[is_number.index(False)].strip()
            cell = one_line(row[is_number.index(False)])[:LONGEST_SHOWN]
            raise DataError(f"line {line}, column '{name}': {cell!r} is not a finite number, such as 1.5")
        numbers.extend(values)
    return np.array(numbers).reshape(-1, len(header))
