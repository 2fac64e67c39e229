"""Tables of motion from OpenSim, CSV, C3D and TRC files in one form: time, and columns with the unit of the file."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.recorded.c3d import Trial, read_c3d
from ppafo.gait.recorded.plain_csv import is_plain, read_plain_csv
from ppafo.signals.recording import Floats
from ppafo.storage.comma_separated import read_csv
from ppafo.storage.opensim import OpenSimTable, read_opensim_with_gaps
from ppafo.storage.trc import read_trc

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
        table = _of_trc(path)
    elif suffix == ".c3d":
        found = read_c3d(path)
        table = MotionTable(str(path), C3D, found.time, found.columns, found.units, trial=found.trial)
    else:
        raise DataError(f"{path}: is not a {FILES} file")
    if table.time.size < 3:
        raise DataError(f"{table.file}: has {table.time.size} rows; a stride needs several tens")
    low = float(table.time[0] if start is None else start)
    high = float(table.time[-1] if end is None else end)
    return _cut(_bridge_gaps(table, longest_gap, low, high), low, high)


def _cut(table: MotionTable, low: float, high: float) -> MotionTable:
    """Return the rows of a table between two times [s]."""
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


def _of_trc(path: str | Path) -> MotionTable:
    found = read_trc(path)
    columns = {f"{name}.{axis}": xyz[row] for name, xyz in found.markers.items() for row, axis in enumerate("xyz")}
    return MotionTable(str(path), TRC, found.time, columns, dict.fromkeys(columns, found.unit))


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
