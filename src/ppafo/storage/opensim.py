"""Tables of OpenSim, ``.mot`` and ``.sto``, read and written as it does, and tables of markers, ``.trc``.

A header is lines until ``endheader``: ``nRows=211`` and ``inDegrees=yes`` (or the sentence "Angles are in degrees."),
or in the older style ``datarows 9009``. Then come one line of labels and the rows.

Of a ``.trc`` file lines 1 to 3 are ``PathFileType 4 (X/Y/Z) NAME``, names of the header's values, and these. Line 4 has
``Frame#``, ``Time`` and a name for every three columns, line 5 ``X1 Y1 Z1 ...``; then come the rows. A marker that was
not seen leaves its cells empty, or has ``nan``.

A recording in OpenSim's names, zero and signs is at the end. ``ankle_angle_r`` is 0 with the foot square to the shank
and grows in dorsiflexion [rad]. ``ankle_angle_r_moment`` is the moment along it [N m], below 0 in push-off, and
``ankle_angle_r_device_moment`` what a device adds. ``ground_force_r_vy`` is the vertical force [N].
``shank_angle_r`` is no coordinate of OpenSim's models, whose legs have hip and knee: it stays as the package has it, as
do channels without a counterpart.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.errors import DataError, one_line
from ppafo.signals import Channel, Recording, RecordingKind
from ppafo.signals.recording import TIME, Floats
from ppafo.storage.doubled_names import doubled, said_of_doubled, told_apart, without_copies
from ppafo.storage.files import read_bytes, text_of, write_file

_END = "endheader"
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_COUNT = re.compile(r"(nRows|nColumns|datarows|datacolumns)\s*(?:=|\s)\s*(\S+)", re.IGNORECASE)
_DEGREES = re.compile(r"inDegrees\s*=\s*(\w+)", re.IGNORECASE)
_SENTENCE = re.compile(r"angles are in (degrees|radians)", re.IGNORECASE)
_LONGEST_SHOWN = 40
GAPS, _UNSEEN = ("nan",), ("", "nan")
"""What stands for a gap in a table, and for a marker that was not seen."""
_KINDS: tuple[RecordingKind, ...] = ("simulated", "synthetic")


@dataclass(frozen=True, slots=True, eq=False)
class OpenSimTable:
    """A table: time [s] and columns by label; ``in_degrees`` is None where the header does not say.

    ``is_old`` tells a header of the older style, SIMM's, whose angles are in degrees.
    ``kind`` is the kind of a recording that nobody measured, where this package wrote it.
    ``first_line`` is the line of the file in which the first row stands, ``remarks`` say what was mended.
    """

    name: str
    time: Floats
    columns: Mapping[str, Floats]
    in_degrees: bool | None
    first_line: int
    remarks: tuple[str, ...] = ()
    kind: RecordingKind = "measured"
    is_old: bool = False


@dataclass(frozen=True, slots=True)
class _Header:
    name: str
    rows: int | None
    width: int | None
    in_degrees: bool | None
    end: int
    kind: RecordingKind
    is_old: bool


def read_opensim(path: str | Path, gaps: Sequence[str] = ()) -> OpenSimTable:
    """Return the table in a ``.mot`` or ``.sto`` file; DataError names file, line and column of what is wrong.

    A count of columns in the header that all rows contradict, and last rows that repeat a time, are mended; remarks say
    so. A cell with one of the texts in ``gaps`` is NaN, to fill or to refuse; without them it is refused here.
    """
    try:
        lines = _text_lines(path)
        header = _header(lines)
        number, written = _labels(lines, header)
        labels = told_apart(written)
        # The numbers, row by row; blank lines may only follow the last row.
        first = number + 1
        last = len(lines)
        while last >= first and not lines[last - 1].strip():
            last -= 1
        count = last - first + 1
        if count <= 0:
            raise DataError("has labels but no rows")
        if header.rows is not None and header.rows != count:
            raise DataError(
                f"has {count} rows, its header states {header.rows}: the file is cut off or was edited; "
                "get it again, or correct the header"
            )
        table = np.empty((count, len(labels)))
        for index in range(count):
            cells = lines[first - 1 + index].split()
            if len(cells) != len(labels):
                raise DataError(f"line {first + index} has {len(cells)} values for {len(labels)} columns")
            table[index, 0] = _number(cells[0], first + index, labels[0])
            pairs = zip(cells[1:], labels[1:], strict=True)
            table[index, 1:] = [_number(text, first + index, label, gaps) for text, label in pairs]
        # Last rows that repeat a time, as some tools write them, are dropped.
        kept, remarks = count, []
        while kept > 1 and table[kept - 1, 0] == table[kept - 2, 0]:
            kept -= 1
        if kept < count:
            rows = "the last row repeats" if kept == count - 1 else f"the last {count - kept} rows repeat"
            was = "was" if kept == count - 1 else "were"
            remarks.append(f"{rows} the time {table[-1, 0]:g} s and {was} dropped")
        values = table[:kept]
        time = values[:, 0]
        _check_clock(time, range(first, first + kept))
        if header.width is not None and header.width != len(labels):
            said = (
                f"the header states {header.width} columns, labels and every row have {len(labels)}, which were taken"
            )
            remarks.insert(0, said)
    except DataError as error:
        raise DataError(f"{path}: {error}".replace(f"{path}: {path}:", f"{path}:")) from error
    twins = doubled(written[1:], labels[1:])
    named = {label: values[:, index] for index, label in enumerate(labels) if index > 0}
    columns = without_copies(named, twins)
    remarks += said_of_doubled(twins, columns, "columns")
    return OpenSimTable(
        header.name, time, columns, header.in_degrees, number + 1, tuple(remarks), header.kind, header.is_old
    )


def _header(lines: list[str]) -> _Header:
    end = next((index for index, line in enumerate(lines) if line.strip().lower() == _END), None)
    if end is None:
        raise DataError(f"has no line '{_END}': it is cut off in its header, or is no .mot or .sto file")
    counts: dict[str, int] = {}
    in_degrees: bool | None = None
    for number, line in enumerate(lines[:end], start=1):
        match = _COUNT.match(line.strip())
        if match is not None:
            text = match[2]
            if not (text.isascii() and text.isdigit() and len(text) < 12):
                raise DataError(f"line {number}: {match[1]} is {one_line(text)[:_LONGEST_SHOWN]!r}, not a whole number")
            counts[match[1].lower()] = int(text)
        key, sentence = _DEGREES.match(line.strip()), _SENTENCE.search(line)
        if key is not None and key[1].lower() not in ("yes", "no"):
            raise DataError(f"line {number}: inDegrees is {one_line(key[1])[:_LONGEST_SHOWN]!r}; it is 'yes' or 'no'")
        said = None if sentence is None else sentence[1].lower() == "degrees"
        said = said if key is None else key[1].lower() == "yes"
        if said is not None and in_degrees is not None and said != in_degrees:
            raise DataError(f"line {number}: the header states degrees and radians; correct the one that is wrong")
        in_degrees = in_degrees if said is None else said
    first = lines[0].strip()
    name = first.removeprefix("name ").strip() if end > 0 and first else "unnamed"
    rows, width = (
        counts.get(new, counts.get(old)) for new, old in (("nrows", "datarows"), ("ncolumns", "datacolumns"))
    )
    kinds = [kind for line in lines[:end] for kind in _KINDS if line.strip() == f"kind={kind}"]
    return _Header(
        one_line(name), rows, width, in_degrees, end, kinds[0] if kinds else "measured", "datacolumns" in counts
    )


def _labels(lines: list[str], header: _Header) -> tuple[int, list[str]]:
    """Return the number of the line of labels (from 1) and the labels."""
    for number in range(header.end + 2, len(lines) + 1):
        if lines[number - 1].strip():
            # Labels may hold blanks where tabs separate them.
            line = lines[number - 1]
            labels = [cell.strip() for cell in line.strip().split("\t")] if "\t" in line else line.split()
            if labels[0].lower() != TIME:
                first = one_line(labels[0])[:_LONGEST_SHOWN]
                raise DataError(f"line {number}: the first column must be '{TIME}', it is {first!r}")
            if "" in labels:
                raise DataError(f"line {number}: column {labels.index('') + 1} has no name")
            return number, labels
    raise DataError(f"has nothing after '{_END}': the file is cut off")


def _number(cell: str, line: int, label: str, gaps: Sequence[str] = ()) -> float:
    """Return the number in a cell, NaN for one of the texts that stand for a gap."""
    if cell.lower() in gaps:
        return float("nan")
    value = float(cell) if _NUMBER.fullmatch(cell) else float("nan")
    if not np.isfinite(value):
        shown = one_line(cell)[:_LONGEST_SHOWN]
        raise DataError(
            f"line {line}, column {label!r}: {shown!r} is not a finite number; fill the gap or cut the file there"
        )
    return value


def _check_clock(time: Floats, lines: Sequence[int]) -> None:
    """Refuse a time [s] that does not grow from row to row; ``lines`` are the lines of the rows in the file."""
    stalled = np.flatnonzero(np.diff(time) <= 0.0)
    if stalled.size:
        index = int(stalled[0]) + 1
        word = "stands still" if time[index] == time[index - 1] else "goes backwards"
        raise DataError(f"line {lines[index]}: the clock {word}: {time[index]:g} s follows {time[index - 1]:g} s")


def _text_lines(path: str | Path) -> list[str]:
    """Return the lines of a file, with any line ends."""
    return text_of(read_bytes(path)).replace("\r\n", "\n").replace("\r", "\n").split("\n")


_SIGNS = {
    r"(healthy_)?ankle_angle_[rl]": "is 0 with the foot square to the shank and above 0 in dorsiflexion",
    r"ankle_angle_[rl]_speed": "is above 0 towards dorsiflexion",
    r"ankle_angle_[rl]_moment": "is what the wearer gives, above 0 in dorsiflexion",
    r"ankle_angle_[rl]_device(_moment)?": "is what the device gives the wearer, above 0 in dorsiflexion",
    r"ground_force_[rl]_vy": "is above 0 upward",
}
"""What the header says of the signs of the columns in OpenSim's names."""


def _signs(names: Sequence[str]) -> str:
    said = [f"{name} {sign}" for name in names for form, sign in _SIGNS.items() if re.fullmatch(form, name)]
    others = "other columns" if said else "columns"
    return f"signs={'; '.join([*said, f'{others} have the signs of ppafo'])}"


def opensim_bytes(recording: Recording) -> bytes:
    """Return a recording as a ``.sto`` file: SI units, angles in radians, labels ``time`` and the channels' names.

    Units and signs stand in the header, where OpenSim keeps them as text; so does the kind of a recording that nobody
    measured.
    """
    units = ", ".join(f"{name} [{recording.unit(name)}]" for name in recording.names)
    head = [
        one_line(recording.label),
        "version=1",
        f"nRows={len(recording)}",
        f"nColumns={1 + len(recording.names)}",
        "inDegrees=no",
        f"kind={recording.kind}",
        f"units={units}",
        _signs(recording.names),
        _END,
        "\t".join((TIME, *recording.names)),
    ]
    columns = [recording.time, *(recording[name] for name in recording.names)]
    rows = ["\t".join(map(repr, row)) for row in zip(*(column.tolist() for column in columns), strict=True)]
    return ("\n".join([*head, *rows]) + "\n").encode()


def write_opensim(path: str | Path, recording: Recording) -> Path:
    """Write a recording as a ``.sto`` file that OpenSim reads; returns the path."""
    return write_file(path, opensim_bytes(recording))


_FIRST = "PathFileType"
_HEAD_LINES = 5
_UNITS = ("mm", "cm", "m")


@dataclass(frozen=True, slots=True, eq=False)
class MarkerTable:
    """Markers over time [s]: coordinates (3, frames) by name in ``unit``; NaN where a marker was not seen.

    ``remarks`` say which have the names of others in the file.
    """

    time: Floats
    markers: Mapping[str, Floats]
    unit: str
    remarks: tuple[str, ...] = ()


def read_trc(path: str | Path) -> MarkerTable:
    """Return the markers in a ``.trc`` file; DataError names file, line and what is wrong."""
    try:
        lines = _text_lines(path)
        if not lines[0].startswith(_FIRST) or len(lines) <= _HEAD_LINES:
            raise DataError(
                f"is not a .trc file: its first line begins with '{_FIRST}', and five lines come before rows"
            )
        unit = dict(zip(lines[1].split(), lines[2].split(), strict=False)).get("Units", "")
        if unit not in _UNITS:
            shown = one_line(unit)[:_LONGEST_SHOWN]
            raise DataError(f"line 3: Units is {shown!r}; allowed are {', '.join(_UNITS)}")
        # The names of the markers; the two names before them are frame and time.
        line = lines[3]
        cells = [cell.strip() for cell in line.split("\t")]
        if len(cells) < 3 or cells[1].lower() != "time":
            raise DataError("line 4: must begin with 'Frame#', 'Time' and the names of markers, separated by tabs")
        written = [name for name in cells[2:] if name]
        if not written:
            raise DataError("line 4: names no marker; every marker needs a name of its own")
        names = told_apart(written)
        labels = [f"{axis} of {name}" for name in names for axis in "XYZ"]
        rows, wanted = [], 2 + len(labels)
        numbers = [number for number, line in enumerate(lines, 1) if number > _HEAD_LINES and line.strip()]
        for number in numbers:
            line = lines[number - 1]
            cells = [cell.strip() for cell in line.split("\t")] if "\t" in line else line.split()
            if len(cells) > wanted and any(cells[wanted:]):
                raise DataError(f"line {number} has {len(cells)} values for {wanted} columns")
            # Cells that are not there belong to markers that were not seen.
            cells = [*cells, *[""] * (wanted - len(cells))][:wanted]
            labelled = zip(cells[2:], labels, strict=True)
            rows.append(
                [_number(cells[1], number, TIME), *(_number(cell, number, of, _UNSEEN) for cell, of in labelled)]
            )
        if not rows:
            raise DataError("has no rows")
        values = np.array(rows)
        _check_clock(values[:, 0], numbers)
    except DataError as error:
        raise DataError(f"{path}: {error}".replace(f"{path}: {path}:", f"{path}:")) from error
    twins = doubled(written, names)
    named = {name: values[:, 1 + 3 * index : 4 + 3 * index].T for index, name in enumerate(names)}
    markers = without_copies(named, twins)
    return MarkerTable(values[:, 0], markers, unit, tuple(said_of_doubled(twins, markers, "markers")))


_ANGLES = {"ankle_angle": "{}", "angle": "{}", "healthy_angle": "healthy_{}"}
_REVERSED = {"angular_velocity": "{}_speed", "ankle_moment": "{}_moment", "external_torque": "{}_device_moment"}
_KEPT = ("shank_angle",)
_PER_MASS = ("ankle_moment", "vertical_force")


def opensim_recording(
    recording: Recording, side: str = "right", body_mass: float | None = None
) -> tuple[Recording, tuple[str, ...]]:
    """Return a recording of a walk in OpenSim's names, zero and signs, and the channels that need ``body_mass`` [kg].

    Moment and force per mass become the body's; without a body mass they are left out and named.
    """
    foot, ankle, mass = side[0], f"ankle_angle_{side[0]}", body_mass or 0.0
    units = {name: recording.unit(name) for name in recording.names}
    per_mass = [name for name in _PER_MASS if units.get(name) in ("N m/kg", "-", "N/kg")]
    missing = tuple(per_mass) if body_mass is None else ()
    channels = {}
    for name, unit in units.items():
        values = recording[name]
        if name in missing:
            continue
        if name in _ANGLES and unit == "rad":
            channels[_ANGLES[name].format(ankle)] = Channel(0.5 * math.pi - values, unit)
        elif name in _REVERSED:
            factor = mass if unit == "N m/kg" else 1.0
            channels[_REVERSED[name].format(ankle)] = Channel(-factor * values, unit.removesuffix("/kg"))
        elif name == "vertical_force":
            factor = {"-": mass * STANDARD_GRAVITY, "N/kg": mass}.get(unit, 1.0)
            channels[f"ground_force_{foot}_vy"] = Channel(factor * values, "N")
        else:
            channels[f"{name}_{foot}" if name in _KEPT else name] = Channel(values, unit)
    if {"heel_force", "toe_force"} <= set(recording.names):
        channels[f"ground_force_{foot}_vy"] = Channel(recording["heel_force"] + recording["toe_force"], "N")
    return Recording(recording.label, recording.time, channels, recording.kind), missing
