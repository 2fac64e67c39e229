"""Recordings as CSV: one header line ``time [s],angle [rad],...``, then one line a sample, exact to the last bit.

A column whose channel is held where such channels usually run straight says so: ``supply_pressure [Pa] hold``; the
other way round it is ``linear``.

Files from elsewhere may use other units (``angle [deg]``, ``pressure_1 [psi_g]``) and begin with lines of comment (#).
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

from ppafo.arguments.door import argument_text
from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import DataError, UnitError, refused_as
from ppafo.signals import CHANNELS, Channel, Recording, RecordingKind
from ppafo.signals.recording import BETWEEN, PLAIN_NUMBER, TIME, TIME_UNIT, Between, Floats
from ppafo.storage.files import read_bytes, text_of, write_file
from ppafo.wording import first_twice, nearest_name, one_line

_OTHERS = (
    (";", "semicolons", 'delimiter = "semicolon", and decimal = "comma" if numbers have decimal commas'),
    ("\t", "tabs", 'delimiter = "tab", and decimal = "comma" if numbers have decimal commas'),
)
_HEADER = re.compile(r"\s*(\w+)\s*\[\s*([^\[\]]+?)\s*\]\s*(\w*)\s*", re.ASCII)
_LEVEL = "Pa_a"
_ONLY_SIMULATED = "supplied_mass"


def _own_columns() -> str:
    """Return the remedy for columns of another form."""
    named = argument_text("columns", "FILE.toml:NAME")
    return (
        f"; other columns are read through a column map: validate {named}, or columns = 'NAME' in a problem file of "
        "identify"
    )


@dataclass(frozen=True, slots=True)
class HeaderColumn:
    """Column as its header declares it: channel (or time), the unit of its numbers, interpolation between samples."""

    name: str
    unit: str
    between: Between | None = None

    @property
    def si_unit(self) -> str:
        """The unit in which the recording keeps it; a channel that is not known by name stays as it is."""
        if self.name == TIME:
            return TIME_UNIT
        return CHANNELS[self.name].unit if self.name in CHANNELS else self.unit


def parse_header(cells: list[str]) -> list[HeaderColumn]:
    """Return the columns of a header such as ``time [s]``, ``pressure_1 [psi_g]``; time comes first.

    DataError for one that cannot be read.
    """
    if not cells:
        raise DataError("the header must come first, line 1 is empty")
    columns = []
    if is_of_frame(cells):
        cells = [f"{name} [{CHANNELS[name].unit if name in CHANNELS else TIME_UNIT}]" for name in map(str.strip, cells)]
    for cell in cells:
        match = _HEADER.fullmatch(cell)
        if match is None:
            shown = cell if len(cell) <= 40 else f"{cell[:36]} ..."
            remedy = next((f"; {one} need a column map with {key}" for mark, one, key in _OTHERS if mark in cell), "")
            known = CHANNELS.get(cell.strip())
            if known is not None:
                remedy = f": write '{cell.strip()} [{known.unit}]'"
            raise DataError(
                f"the header must name columns as 'name [unit]', separated by commas; '{one_line(shown)}' is not one"
                f"{remedy or (_own_columns() if cell.strip() else '; does the line end with a comma?')}"
            )
        name, unit, word = match[1], match[2], match[3]
        # Time itself does nothing between its samples.
        between = next((known for known in BETWEEN if word == known and name != TIME), None)
        if word and between is None:
            hint = nearest_name(word, BETWEEN)
            raise DataError(f"column '{name}': behind its unit may stand {' or '.join(BETWEEN)}, not '{word}'{hint}")
        columns.append(HeaderColumn(name, unit, between))
    names = [column.name for column in columns]
    if names[0] != TIME:
        raise DataError(f"the first column must be '{TIME} [{TIME_UNIT}]', it is '{names[0]}'")
    twice = first_twice(names)
    if twice is not None:
        raise DataError(f"there are two columns '{twice}'")
    return columns


def is_of_frame(cells: Sequence[str]) -> bool:
    """Tell whether a header is of a result's ``to_dataframe().to_csv()``: channels of a simulation, bare and in SI.

    Bare names alone do not say so: a logger may call a column in degrees ``angle``.
    """
    names = {cell.strip() for cell in cells}
    return _ONLY_SIMULATED in names and names <= {TIME, *CHANNELS}


def check_clock(time: Floats, lines: Sequence[int], noun: str = "line") -> None:
    """Refuse a clock [s] that goes backwards or stands still; ``lines`` are the lines of the rows in the file.

    DataError names the line, or what ``noun`` calls it.
    """
    stalled = np.flatnonzero(np.diff(time) <= 0.0)
    if stalled.size:
        index = int(stalled[0]) + 1
        word = "stands still" if time[index] == time[index - 1] else "goes backwards"
        falls = np.flatnonzero(np.diff(time) < 0.0) + 1
        # Each trial of a file begins about where the first one does.
        are_trials = falls.size > 0 and bool((time[falls] < time[1]).all())
        trials = (
            f", or take one of {falls.size + 1} trials with trial = 1, or 'all', in a column map" if are_trials else ""
        )
        raise DataError(
            f"{noun} {lines[index]}, column '{TIME}': the clock {word}: {time[index]:.9g} s follows "
            f"{time[index - 1]:.9g} s; time must increase from sample to sample{trials}"
        )


def in_si(column: HeaderColumn, values: Floats, atmosphere: float) -> Floats:
    """Return the values in the unit in which a recording keeps them; gauge counts from ``atmosphere`` [Pa absolute].

    UnitError for a unit that does not fit.
    """
    from ppafo.units import check_unit, to_si

    if column.unit != column.si_unit:
        known, wanted = (_SPELT.get(unit, unit) for unit in (column.unit, column.si_unit))
        return np.array([to_si(value, known, wanted, atmosphere) for value in values.tolist()])
    if column.name not in CHANNELS:
        check_unit(_SPELT.get(column.unit, column.unit))
    return values


_SPELT = {"Pa": _LEVEL, PLAIN_NUMBER: ""}
"""Units as ``ppafo.units`` spells them: there a pressure says its kind and a plain number has no unit."""
_MARKS: dict[RecordingKind, str] = {
    "simulated": "# simulated: a model's own output, not measured",
    "synthetic": "# synthetic: made by a model to stand for a measurement",
}
"""Lines of comment; when read, the word before the colon counts."""

_MARK = re.compile(r"#\s*(\w+):.*")
_LONGEST_CELL = 40
"""Characters of a cell that a message repeats."""
_UNDERSCORE = "_"
"""Python takes 1_000 for a thousand, and digits of any script; in a table they are a slip."""

SPLIT_NUMBERS = (
    "commas seem to separate columns and decimals alike: write the file with decimal points, or with another delimiter "
    'and read it through a column map with decimal = "comma"'
)
"""Message about rows with twice as many cells as there are columns."""
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d*,\d+(?:[eE][+-]?\d+)?\s*", re.ASCII)
_SIMILAR = 0.8
"""Similarity above which a word is a misspelt kind; 'measurement: run 3' is a remark like any other."""


def write_csv(path: str | Path, recording: Recording) -> Path:
    """Write a recording as CSV in SI units; one that no one measured says so in a line of comment. Returns the path."""
    return write_file(path, marked_csv_bytes(recording))


def marked_csv_bytes(recording: Recording) -> bytes:
    """Return the table of a recording for a file that stands alone; it begins with its kind unless it was measured."""
    return mark_of(recording.kind).encode() + csv_bytes(recording)


def mark_of(kind: RecordingKind) -> str:
    """Return the line of comment with which a file begins whose recording was not measured; empty for the others."""
    return f"{_MARKS[kind]}\n" if kind in _MARKS else ""


def csv_bytes(recording: Recording) -> bytes:
    """Return the bare table of a recording; its label and its kind are not in it."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    named = recording.channels.items()
    heads = (f"{name} [{channel.unit}] {channel.between or ''}".rstrip() for name, channel in named)
    writer.writerow([f"{TIME} [{TIME_UNIT}]", *heads])
    columns = [recording.time, *(recording[name] for name in recording.names)]
    rows = map(",".join, zip(*(map(repr, column.tolist()) for column in columns), strict=True))
    buffer.writelines(f"{row}\n" for row in rows)
    return buffer.getvalue().encode()


def read_csv(path: str | Path, label: str | None = None, atmosphere: float = STANDARD_ATMOSPHERE) -> Recording:
    """Return the recording in a CSV file, in SI units; its label is the file's name unless one is given.

    Gauge pressure counts from ``atmosphere`` [Pa absolute]. DataError for a file that is not usable.
    """
    from ppafo.storage.clock import counted_on  # a run reads no clocks of loggers

    content = read_bytes(path)
    try:
        text = text_of(content, remedy='; a column map with encoding = "latin-1" reads that')
        # Whoever writes a table ends its last line: one without an end is a file that was cut off in a number.
        if not text.endswith(("\n", "\r")):
            raise DataError(
                "the last line has no line break: the file may be cut off in a number; add one if it is whole"
            )
        lines = text.splitlines()
        first = next((number for number, line in enumerate(lines) if not line.startswith("#")), len(lines))
        mark = _mark(next(islice(lines, first, None), ""))
        rows = csv.reader(islice(lines, first, None), delimiter=mark, strict=True)
        header = _whole_cells(next(rows, []), mark)
        if not header and not any(lines[first:]):
            raise DataError("has no header")
        # A first column without a name is the row number that pandas writes.
        is_counted = bool(header) and not header[0].strip()
        columns = parse_header(header[is_counted:])
        values = _table(header, rows if mark == "," else _with_points(rows), first)
        if not len(values):
            raise DataError("has a header but no samples")
        if is_counted and not np.array_equal(values[:, 0], np.arange(len(values))):
            raise DataError("the first column has no name, and does not count the rows from 0; name it, or remove it")
        values = values[:, is_counted:]
        series = []
        for index, column in enumerate(columns):
            with refused_as(DataError, f"column '{column.name} [{column.unit}]'", UnitError):
                series.append(in_si(column, values[:, index], atmosphere))
        series[0] = counted_on(series[0])
        check_clock(series[0], range(first + 2, first + 2 + len(values)))
        named = {
            column.name: Channel(one, column.si_unit, column.between, column.unit)
            for column, one in zip(columns[1:], series[1:], strict=True)
        }
        kind = "simulated" if is_of_frame(header) else kind_of_comments(lines[:first])
        return Recording(label or one_line(Path(path).stem), series[0], named, kind)
    except csv.Error as error:
        raise DataError(f"{path}: is not a CSV file: {error}") from error
    except DataError as error:
        raise DataError(f"{path}: {error}") from error


def _mark(header: str) -> str:
    """Return what separates the columns of a header: a tab or a semicolon only where all cells then are columns."""
    return next((mark for mark in "\t;" if mark in header and all(map(_HEADER.fullmatch, header.split(mark)))), ",")


def _whole_cells(cells: list[str], mark: str) -> list[str]:
    """Return the cells of a header with the pieces of a unit that has a comma in it put together again."""
    whole: list[str] = []
    for cell in cells:
        if whole and "[" in whole[-1] and "]" not in whole[-1]:
            whole[-1] += mark + cell
        else:
            whole.append(cell)
    return whole


def _with_points(rows: Iterable[list[str]]) -> Iterator[list[str]]:
    """Return rows whose columns no comma separates with decimal points, whichever mark they have."""
    return ([cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell for cell in row] for row in rows)


def kind_of_comments(comments: Iterable[str]) -> RecordingKind:
    """Return the kind that a comment names; a misspelt one must not let a simulation pass for a measurement.

    DataError for a misspelt one or two of them.
    """
    named: list[RecordingKind] = []
    for match in filter(None, map(_MARK.fullmatch, comments)):
        near = difflib.get_close_matches(match[1], _MARKS, n=1, cutoff=_SIMILAR)
        if near and match[1] not in _MARKS:
            raise DataError(f"the comment '# {match[1]}:' names no kind of recording, did you mean '{near[0]}'?")
        named += [kind for kind in _MARKS if kind == match[1]]
    if len(set(named)) > 1:
        raise DataError(f"the comments name two kinds of recording: {' and '.join(named)}")
    return named[0] if named else "measured"


def _table(header: list[str], rows: Iterable[list[str]], skipped: int) -> Floats:
    """Return the numbers below the header, row by row: the texts of a large file take many times its room."""
    # Blank lines may only follow the last row: one between rows is a sample that was lost.
    numbers, blank = array("d"), None
    for line, row in enumerate(rows, start=skipped + 2):
        if not row:
            blank = blank or line
            continue
        if blank is not None:
            raise DataError(f"line {blank} has 0 values for {len(header)} columns")
        if len(row) != len(header):
            remedy = f"; {SPLIT_NUMBERS}" if len(row) == 2 * len(header) else ""
            raise DataError(f"line {line} has {len(row)} values for {len(header)} columns{remedy}")
        try:
            values = [float(cell) for cell in row]
        except ValueError as error:
            raise _no_number(header, row, line) from error
        # All cells at once, as one by one costs more than reading the numbers.
        whole = "".join(row)
        if not whole.isascii() or _UNDERSCORE in whole or not all(map(math.isfinite, values)):
            raise _no_number(header, row, line)
        numbers.extend(values)
    return np.array(numbers).reshape(-1, len(header))


def _no_number(header: list[str], row: list[str], line: int) -> DataError:
    """Return the error of a row in which a cell is no finite number."""
    column = next((index for index, cell in enumerate(row) if not _is_finite(cell)), 0)
    name, cell = header[column].strip(), one_line(row[column])[:_LONGEST_CELL]
    remedy = '; decimal commas need a column map with decimal = "comma"' if _DECIMAL_COMMA.fullmatch(cell) else ""
    return DataError(f"line {line}, column '{name}': {cell!r} is not a number, or not a finite one{remedy}")


def _is_finite(cell: str) -> bool:
    try:
        return math.isfinite(float(cell)) and cell.isascii() and _UNDERSCORE not in cell
    except ValueError:
        return False
