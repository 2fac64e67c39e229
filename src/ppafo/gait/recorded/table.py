"""Tables of motion from OpenSim, CSV, C3D and TRC files in one form: time, and columns with the unit of the file.

A CSV file need not have the header ``name [unit]``: names alone or with the unit in brackets and any usual delimiter
will do. Gaps are filled up to a length that the user states, each named.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from ppafo.errors import DataError, first_twice, one_line
from ppafo.gait.recorded.c3d import Trial, read_c3d
from ppafo.signals.recording import Floats
from ppafo.storage.comma_separated import read_csv
from ppafo.storage.files import read_bytes
from ppafo.storage.foreign import ColumnMap, MappedChannel, read_foreign
from ppafo.storage.opensim import OpenSimTable, read_opensim_with_gaps, read_trc

_LARGEST_JUMP = 3.0
"""Times the median interval; a longer one is a gap, not jitter of the clock."""

OPENSIM, CSV, C3D, TRC = "opensim", "csv", "c3d", "trc"
MARKERS = (C3D, TRC)
FILES = ".mot, .sto, .csv, .c3d or .trc"

_STATE = re.compile(r".*/([^/]+)/value")
"""A coordinate among OpenSim's states, such as ``/jointset/ankle_r/ankle_angle_r/value``; its speed is beside it."""


@dataclass(frozen=True, slots=True, eq=False)
class MotionTable:
    """Columns over time [s] as a file has them; a unit is empty where the file does not say it.

    ``remarks`` say what was mended, ``trial`` is what a C3D file says of subject and events.
    """

    file: str
    form: str
    time: Floats
    columns: Mapping[str, Floats]
    units: Mapping[str, str]
    kind: str = "measured"
    remarks: tuple[str, ...] = ()
    trial: Trial | None = None


def read_table(
    path: str | Path, longest_gap: float = 0.0, start: float | None = None, end: float | None = None
) -> MotionTable:
    """Return the table in a ``.mot``, ``.sto``, ``.csv``, ``.c3d`` or ``.trc`` file from ``start`` to ``end`` [s].

    Its clock runs without a gap there: rows missing for no longer than ``longest_gap`` [s] are bridged and remarked.
    """
    suffix = Path(path).suffix.lower()
    if suffix in (".mot", ".sto"):
        table = _of_opensim(str(path), read_opensim_with_gaps(path))
    elif suffix == ".csv":
        table = _of_csv(path)
    elif suffix == ".trc":
        trc = read_trc(path)
        columns = {f"{name}.{axis}": xyz[row] for name, xyz in trc.markers.items() for row, axis in enumerate("xyz")}
        table = MotionTable(str(path), TRC, trc.time, columns, dict.fromkeys(columns, trc.unit))
    elif suffix == ".c3d":
        found = read_c3d(path)
        table = MotionTable(str(path), C3D, found.time, found.columns, found.units, trial=found.trial)
    else:
        raise DataError(f"{path}: is not a {FILES} file")
    if table.time.size < 3:
        raise DataError(f"{table.file}: has {table.time.size} rows; a stride needs several tens")
    low = float(table.time[0] if start is None else start)
    high = float(table.time[-1] if end is None else end)
    table = _bridge_gaps(table, longest_gap, low, high)
    inside = (table.time >= low) & (table.time <= high)
    if not inside.any():
        raise DataError(
            f"{table.file}: nothing is left of it from {low:g} to {high:g} s; it goes from {table.time[0]:g} to "
            f"{table.time[-1]:g} s: choose --start and --end within"
        )
    columns = {name: values[inside] for name, values in table.columns.items()}
    return replace(table, time=table.time[inside], columns=columns)


def _of_opensim(file: str, table: OpenSimTable) -> MotionTable:
    """Return the table with the units that OpenSim's labels imply; angles are as the header says.

    A coordinate that is named by its path among the states is there by its own name too.
    """
    is_unstated = table.in_degrees is None and table.is_old
    angle = "deg" if is_unstated else {True: "deg", False: "rad", None: ""}[table.in_degrees]
    paths = {match[1]: name for name in table.columns if (match := _STATE.fullmatch(name))}
    columns = {**table.columns, **{name: table.columns[path] for name, path in paths.items()}}
    units = {name: _opensim_unit(paths.get(name, name), name, angle) for name in columns}
    remarks = table.remarks
    if is_unstated and any(unit == "deg" for unit in units.values()):
        remarks = (*remarks, "the header does not state the unit of angles: degrees, as in files of its older style")
    return MotionTable(file, OPENSIM, table.time, columns, units, table.kind, remarks)


def _opensim_unit(path: str, label: str, angle: str) -> str:
    if path != label:
        # States are in radians and metres whatever the header says of other columns.
        angle = angle or "rad"
    if label.endswith("_moment") or "torque" in label or label.endswith(("_mx", "_my", "_mz")):
        return "N m"
    if label.endswith("_force") or label.endswith(("_vx", "_vy", "_vz")):
        return "N"
    if label.endswith(("_tx", "_ty", "_tz", "_px", "_py", "_pz")):
        return "m"
    return angle


def _of_csv(path: str | Path) -> MotionTable:
    """Return a table of this package, or a plain one; columns that OpenSim names mean what they mean there."""
    if is_plain(path):
        time, columns, units = read_plain_csv(path)
        form = OPENSIM if any(name.startswith("ankle_angle_") for name in columns) else CSV
        implied = {name: _opensim_unit(name, name, "") if form == OPENSIM else "" for name in columns}
        return MotionTable(str(path), form, time, columns, {name: units[name] or implied[name] for name in columns})
    recording = read_csv(path)
    columns = {name: recording[name] for name in recording.names}
    units = {name: recording.unit(name) for name in recording.names}
    return MotionTable(str(path), CSV, recording.time, columns, units, recording.kind)


def _bridge_gaps(table: MotionTable, longest: float, low: float, high: float) -> MotionTable:
    """Return the table with a remark on rows missing between two times [s]; DataError where for too long."""
    steps = np.diff(table.time)
    median = float(np.median(steps))
    seen = (table.time[:-1] >= low) & (table.time[1:] <= high)
    jumps = np.flatnonzero(seen & (steps > _LARGEST_JUMP * median)).tolist()
    for index in jumps:
        if steps[index] > longest + 1.5 * median:
            raise DataError(
                f"{table.file}: the time jumps in row {index + 2} from {table.time[index]:g} s to "
                f"{table.time[index + 1]:g} s, the usual interval is {median:.3g} s; cut the file there or fill the gap"
                " (--start, --end, --fill-gaps)"
            )
    said = [f"rows from {table.time[i]:g} to {table.time[i + 1]:g} s are missing and were bridged" for i in jumps]
    return replace(table, remarks=(*table.remarks, *said))


_DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab"}
_NAME = re.compile(r"(.*?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?")
_TIMES = {"time": "s", "t": "s", "time_s": "s", "time_ms": "ms"}
_LONGEST_SHOWN = 40

Columns = tuple[Floats, dict[str, Floats], dict[str, str]]


def is_plain(path: str | Path) -> bool:
    """Tell whether the first column of a CSV file has a header without its unit in square brackets."""
    return "[" not in re.split(r"[,;\t]", _header(path))[0]


def read_plain_csv(path: str | Path) -> Columns:
    """Return time [s], columns, and their units, empty where the header does not state one.

    DataError names the line of what cannot be read.
    """
    header = _header(path)
    delimiter = max(_DELIMITERS, key=header.count)
    cells = [cell.strip().strip('"').strip() for cell in header.split(delimiter)]
    pairs = [match.groups() for cell in cells if (match := _NAME.fullmatch(cell))]
    names, units = [str(name) for name, _ in pairs], [unit or "" for _, unit in pairs]
    if names[0].lower() not in _TIMES:
        raise DataError(f"{path}: the first column must be 'time', it is {one_line(names[0])[:_LONGEST_SHOWN]!r}")
    twice = first_twice(names)
    if twice is not None or "" in names:
        what = "a column has no name" if twice is None else f"there are two columns {one_line(twice)!r}"
        raise DataError(f"{path}: {what}; every column needs a name of its own")
    channels = {f"c{number}": MappedChannel(column=number + 1) for number in range(1, len(names))}
    channels["time"] = MappedChannel(column=1, unit=units[0] or _TIMES[names[0].lower()])
    mapped = ColumnMap(
        delimiter=_DELIMITERS[delimiter],
        decimal="point" if delimiter == "," or not re.search(r"\d,\d", _text(path)) else "comma",
        channels=channels,
    )
    recording = read_foreign(path, mapped)
    columns = {name: recording[f"c{number}"] for number, name in enumerate(names) if number > 0}
    return recording.time, columns, dict(zip(names, units, strict=True))


def _header(path: str | Path) -> str:
    lines = (line for line in _text(path).splitlines() if line.strip() and not line.startswith("#"))
    return next(lines, "")


def _text(path: str | Path) -> str:
    return read_bytes(path).decode("utf-8-sig", errors="replace")


LONGEST_FILLED = 0.25
"""Seconds; over a quarter of a stride no curve can be drawn through what was not seen."""


def fill_gaps(table: MotionTable, names: Iterable[str], longest: float) -> MotionTable:
    """Return the table with gaps of no longer than ``longest`` [s] in these columns filled by a cubic spline.

    What is missing at the ends stays so, and longer gaps too: whoever uses the column refuses them.
    """
    from scipy.interpolate import CubicSpline

    columns, said, time = dict(table.columns), [], table.time
    for name in dict.fromkeys(names):
        if name not in columns or longest <= 0.0:
            continue
        whole = columns[name].copy()
        known = np.flatnonzero(np.isfinite(whole))
        stretches = [(before + 1, after) for before, after in pairwise(known.tolist()) if after > before + 1]
        short = [gap for gap in stretches if time[gap[1]] - time[gap[0] - 1] <= longest + 1e-9]
        if not short:
            continue
        through = CubicSpline(time[known], whole[known])
        for first, last in short:
            whole[first:last] = through(time[first:last])
            said.append(f"column '{name}': {last - first} samples from {time[first]:g} to {time[last - 1]:g} s filled")
        columns[name] = whole
    return replace(table, columns=columns, remarks=(*table.remarks, *said))
