"""Text exports of motion capture: Vicon Nexus CSV, Qualisys TSV, OptiTrack Motive CSV, D-Flow text, BTS EMT and TRC.

Each format is recognised by its first line, which states the frame rate or the clock. Markers become columns
``LABEL.x``, ``.y`` and ``.z``, without the subject's name before a colon.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ppafo.errors import DataError, refused_as
from ppafo.gait.recorded.delimited import NumberBlock, cells_of, delimiter_of, lines_of, rows_of, tabbed_lines, table_of
from ppafo.gait.recorded.form import GaitForm
from ppafo.gait.recorded.forms.markers import PLATE, marker_convention
from ppafo.gait.recorded.table import AXES, MotionTable, bare_label
from ppafo.signals.recording import Floats
from ppafo.wording import LONGEST_SHOWN, one_line

# Block titles of a Nexus export: markers and model outputs; then force plates and other analog channels.
_NEXUS_MOTION = ("Trajectories", "Model Outputs")
_NEXUS_DEVICES = "Devices"
_LENGTHS = {"Meters": "m", "Centimeters": "cm", "Millimeters": "mm"}
_MOTIVE_ROWS = 3
"""Least number of rows above the axes of a Motive export: types, names and quantities."""
_DFLOW = {"Pos": "m", "Cop": "m", "For": "N", "Mom": "N m"}
# First word of a TRC file, and number of lines before its first row.
_TRC = "PathFileType"
_TRC_ROWS = 5
_NUMBER = re.compile(r"[+-]?\.?\d|nan", re.IGNORECASE)
"""Pattern of the start of a numeric cell."""
_DFLOW_COLUMN = re.compile(r"(.+)\.(Pos|Cop|For|Mom)([XYZ])")
_SHARED = (".csv", ".txt", ".tsv")
"""File suffixes of several formats."""


def _head_of(line: str) -> str:
    """Return the only cell of a line, without trailing delimiters."""
    return line.strip().rstrip(",;\t").strip('"').strip()


def _rate_in(path: str | Path, cell: str, line: int) -> float:
    try:
        rate = float(cell)
    except ValueError:
        rate = 0.0
    if not 0.0 < rate < np.inf:
        raise DataError(f"{path}: line {line}: the frame rate must be a number above 0 Hz, not {one_line(cell)[:20]!r}")
    return rate


def _read_nexus(path: str | Path) -> MotionTable:
    """Return markers, model outputs and force plates of a Vicon Nexus CSV export.

    A block consists of its kind, rate [Hz], labels, ``Frame, Sub Frame, X, Y, Z, ...``, units, and rows up to a blank
    line.
    """
    lines = lines_of(path)
    blocks = [
        (_head_of(line), _nexus_block(path, lines, start))
        for start, line in enumerate(lines)
        if _head_of(line) in (*_NEXUS_MOTION, _NEXUS_DEVICES)
    ]
    motions = []
    for rate, columns, units, rows in (block for kind, block in blocks if kind != _NEXUS_DEVICES):
        # Velocities and accelerations, X' and X'', are not read.
        names = [f"{bare_label(label)}.{axis}" if label and axis in AXES else "" for label, axis in columns]
        names[0] = "Frame"
        motions.append(table_of(path, rows, names, units, "Frame", frame_rate=rate, noun="markers"))
    if not motions:
        raise DataError(f"{path}: has no block 'Trajectories' or 'Model Outputs'")
    whole = motions[0]
    for table in motions[1:]:
        if table.time.size == whole.time.size:
            whole = _joined(whole, table.columns, table.units)
    for kind, block in blocks:
        if kind == _NEXUS_DEVICES:
            forces = _nexus_forces(path, block, whole.time)
            whole = _joined(whole, forces, dict.fromkeys(forces, "N"))
    return whole


def _joined(table: MotionTable, columns: Mapping[str, Floats], units: Mapping[str, str]) -> MotionTable:
    return replace(table, columns={**columns, **table.columns}, units={**units, **table.units})


_NexusBlock = tuple[float, list[tuple[str, str]], list[str], NumberBlock]
"""Rate [Hz] of a block, label and axis in lower case of every column, their units, and the rows of numbers."""


def _nexus_block(path: str | Path, lines: Sequence[str], start: int) -> _NexusBlock:
    """Return the block whose title is on line ``start``; raises DataError for an invalid header."""
    head = lines[start + 1 : start + 5]
    delimiter = delimiter_of(head[2]) if len(head) == 4 else ","
    axes = [axis.lower() for axis in cells_of(head[2], delimiter)] if len(head) == 4 else []
    if axes[:2] != ["frame", "sub frame"]:
        raise DataError(f"{path}: line {start + 4}: must begin with 'Frame' and 'Sub Frame'")
    labels = []
    last = ""
    written = cells_of(head[1], delimiter)
    for label in [*written, *[""] * len(axes)][: len(axes)]:
        # A label stands above the first of its columns.
        last = label or last
        labels.append(last)
    units = [*cells_of(head[3], delimiter), *[""] * len(axes)][: len(axes)]
    rate = _rate_in(path, cells_of(head[0], delimiter)[0], start + 2)
    end = next((n for n in range(start + 5, len(lines)) if not lines[n].strip(",;\t ")), len(lines))
    return rate, list(zip(labels, axes, strict=True)), units, NumberBlock(lines[:end], start + 5, delimiter)


def _nexus_forces(path: str | Path, block: _NexusBlock, time: Floats) -> dict[str, Floats]:
    """Return the plate forces [N] at the times of the frames [s], positive upwards, by ``force plate 1.x``."""
    rate, columns, _, rows = block
    plates = list(dict.fromkeys(label for label, _ in columns if label.lower().endswith("force")))
    names = [
        f"{PLATE}{plates.index(label) + 1}.{axis[1]}" if label in plates and axis in ("fx", "fy", "fz") else ""
        for label, axis in columns
    ]
    if not any(names):
        return {}
    with refused_as(DataError, path, DataError):
        values, _ = rows_of(rows, names)
    # Devices are sampled faster than markers, from the same first frame.
    at = np.clip(np.rint((time - time[0]) * rate).astype(np.int64), 0, len(values) - 1)
    forces = dict(zip((name for name in names if name), values[at].T, strict=True))
    for number in range(1, len(plates) + 1):
        own = {name: force for name, force in forces.items() if name.startswith(f"{PLATE}{number}.")}
        # Some laboratories store what the plate feels, some what it gives back.
        if own and max((float(np.nansum(force)) for force in own.values()), key=abs) < 0.0:
            forces |= {name: -force for name, force in own.items()}
    return forces


def _read_qualisys(path: str | Path) -> MotionTable:
    """Return the markers of a Qualisys TSV export: header of keys and values, marker names, and rows [mm]."""
    lines = lines_of(path)
    keys = {cells[0]: (number, cells[1:]) for number, cells in enumerate(cells_of(line, "\t") for line in lines)}
    if "MARKER_NAMES" not in keys:
        raise DataError(f"{path}: has no line MARKER_NAMES")
    at, labels = keys["MARKER_NAMES"]
    labels = [bare_label(label) for label in labels if label]
    line, (rate, *_) = keys.get("FREQUENCY", (0, ["missing"]))
    names = [f"{label}.{axis}" for label in labels for axis in AXES]
    first = next((n for n in range(at + 1, len(lines)) if _NUMBER.match(cells_of(lines[n], "\t")[0])), len(lines))
    width = len(cells_of(lines[first], "\t")) if first < len(lines) else 0
    # Newer exports have a header line, and the number of the frame and the time before the markers.
    is_counted = cells_of(lines[first - 1], "\t")[:2] == ["Frame", "Time"]
    before = ["", "time"] if is_counted else []
    block = NumberBlock(lines, first, "\t", decimal="," if "," in lines[min(first, len(lines) - 1)] else ".")
    units = [*["", "s"][: len(before)], *["mm"] * len(names)]
    if width < len(before) + len(names) - 2:
        raise DataError(
            f"{path}: line {first + 1} has {width} values for {len(before) + len(names)} columns, three for each marker"
        )
    frame_rate = None if is_counted else _rate_in(path, rate, line + 1)
    clock = "time" if is_counted else ""
    return table_of(path, block, [*before, *names], units, clock, frame_rate=frame_rate, noun="markers")


def _read_motive(path: str | Path) -> MotionTable:
    """Return the markers of an OptiTrack Motive CSV export; bones and rigid bodies are skipped."""
    lines = lines_of(path)
    head = cells_of(lines[0], ",")
    stated = dict(zip(head[::2], head[1::2], strict=False))
    unit = _LENGTHS.get(stated.get("Length Units", ""), "")
    at = next((n for n, line in enumerate(lines) if cells_of(line, ",")[:1] == ["Frame"]), -1)
    above = [cells_of(line, ",") for line in lines[1 : max(at, 1)] if line.strip(", \t")]
    rows = {cells[1]: cells for cells in above if len(cells) > 1 and cells[1]}
    if not rows and len(above) >= _MOTIVE_ROWS:
        # Some exports leave out what their rows are: types, names, and further ones above the quantities.
        rows = {"Type": above[0], "Name": above[1]}
    if at < 0 or "Name" not in rows:
        raise DataError(f"{path}: has no header 'Frame, Time (Seconds), X, Y, Z, ...' below the marker names")
    axes = cells_of(lines[at], ",")
    quantities = above[-1]
    kinds = rows.get("Type", rows["Name"])
    labels = rows["Name"]
    names = []
    for place, axis in enumerate(axes):
        kind, label, quantity = (cells[place] if place < len(cells) else "" for cells in (kinds, labels, quantities))
        is_marker = "marker" in kind.lower() and quantity.lower() == "position" and axis.lower() in AXES
        names.append(f"{bare_label(label)}.{axis.lower()}" if is_marker else "")
    if not any(names):
        raise DataError(f"{path}: has no marker positions")
    names[1] = "time"
    units = ["", "s", *[unit] * (len(names) - 2)]
    return table_of(path, NumberBlock(lines, at + 1, ","), names, units, "time", noun="markers")


def _read_dflow(path: str | Path) -> MotionTable:
    """Return markers and force plates of a D-Flow text file: ``TimeStamp``, ``FrameNumber``, ``LABEL.PosX``, ..."""
    lines = lines_of(path)
    names = []
    units = []
    for cell in cells_of(lines[0].lstrip("% "), "\t"):
        column = _DFLOW_COLUMN.fullmatch(cell)
        is_marker = column is not None and column[2] == "Pos"
        names.append(f"{bare_label(column[1])}.{column[3].lower()}" if column is not None and is_marker else cell)
        units.append(_DFLOW[column[2]] if column is not None else "")
    names = ["" if name == "FrameNumber" else name for name in names]
    return table_of(path, NumberBlock(lines, 1, "\t"), names, units, "TimeStamp", noun="markers")


def _read_bts(path: str | Path) -> MotionTable:
    """Return the markers of a BTS text file: kind, unit and rate, then ``Frame, Time, LABEL.X, LABEL.Y, ...``."""
    lines = lines_of(path)
    at = next((n for n, line in enumerate(lines) if cells_of(line, "\t")[:2] == ["Frame", "Time"]), -1)
    stated = dict(cells_of(line, "\t")[:2] for line in lines[: max(at, 0)] if line.count("\t") >= 1)
    kind = stated.get("Type:", "")
    if at < 0 or kind != "Point 3D tracks":
        raise DataError(
            f"{path}: contains '{one_line(kind)[:40]}' instead of markers; export 'Point 3D tracks' with the line "
            "'Frame, Time, ...' above the numbers"
        )
    unit = stated.get("Measure unit:", "")
    names = ["", "time"]
    for cell in cells_of(lines[at], "\t")[2:]:
        label, _, axis = cell.rpartition(".")
        names.append(f"{bare_label(label)}.{axis.lower()}" if axis.lower() in AXES else "")
    while not names[-1]:
        names.pop()
    is_decimal_comma = "," in lines[min(at + 1, len(lines) - 1)]
    block = NumberBlock(lines, at + 1, "\t", decimal="," if is_decimal_comma else ".")
    units = ["", "s", *[unit if unit in _LENGTHS.values() else ""] * (len(names) - 2)]
    return table_of(path, block, names, units, "time", noun="markers")


def read_trc(path: str | Path) -> MotionTable:
    """Return the markers of a TRC file.

    Line 1 is ``PathFileType 4 (X/Y/Z) NAME``; lines 2 and 3 have names and values of the header. Line 4 has ``Frame#``,
    ``Time`` and a marker name for every three columns, line 5 ``X1 Y1 Z1 ...``; the rows follow.
    """
    lines = tabbed_lines(path)
    if not lines[0].startswith(_TRC) or len(lines) <= _TRC_ROWS:
        raise DataError(
            f"{path}: is not a .trc file: line 1 must begin with '{_TRC}', and rows must follow line {_TRC_ROWS}"
        )
    unit = dict(zip(lines[1].split(), lines[2].split(), strict=False)).get("Units", "")
    if unit not in _LENGTHS.values():
        shown = one_line(unit)[:LONGEST_SHOWN]
        raise DataError(f"{path}: line 3: Units is {shown!r}; allowed are {', '.join(_LENGTHS.values())}")
    head = cells_of(lines[3], "\t")
    labels = [label for label in head[2:] if label]
    if [cell.lower() for cell in head[1:2]] != ["time"] or not labels:
        raise DataError(f"{path}: line 4: must have 'Frame#', 'Time' and the names of markers, separated by tabs")
    names = ["", "time", *(f"{label}.{axis}" for label in labels for axis in AXES)]
    rows = lines[_TRC_ROWS:]
    block = NumberBlock(lines, _TRC_ROWS, "\t" if any("\t" in line for line in rows) else None)
    return table_of(path, block, names, ["", "s", *[unit] * (len(names) - 2)], "time", noun="markers")


def _form(
    name: str,
    summary: str,
    first: Sequence[str],
    read: Callable[[str | Path], MotionTable],
    suffixes: tuple[str, ...] = _SHARED,
) -> GaitForm:
    def recognises(path: str | Path) -> bool:
        line = next((line for line in lines_of(path) if line.strip()), "")
        return Path(path).suffix.lower() not in _SHARED or cells_of(re.split(r"[,;\t]", line)[0], ",")[0] in first

    return GaitForm(
        name=name,
        summary=summary,
        suffixes=suffixes,
        read=read,
        recognises=recognises,
        convention=marker_convention,
    )


NEXUS = _form("nexus", "CSV exports of Vicon Nexus", (*_NEXUS_MOTION, _NEXUS_DEVICES), _read_nexus)
QUALISYS = _form("qualisys", "TSV exports of Qualisys Track Manager", ("NO_OF_FRAMES",), _read_qualisys)
MOTIVE = _form("motive", "CSV exports of OptiTrack Motive", ("Format Version",), _read_motive)
BTS = _form("bts", "EMT text files of BTS Bioengineering", (), _read_bts, (".emt",))
DFLOW = _form("dflow", "text files of D-Flow", ("TimeStamp", "% TimeStamp"), _read_dflow)
TRC = _form("trc", "TRC files with markers", (_TRC,), read_trc, (".trc", ".txt"))
