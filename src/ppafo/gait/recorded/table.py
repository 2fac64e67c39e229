"""Tables of motion from OpenSim, CSV and C3D files in one form: time, and named columns with the unit of the file."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ppafo.errors import DataError
from ppafo.signals.recording import Floats
from ppafo.storage.comma_separated import read_csv
from ppafo.storage.opensim import OpenSimTable, read_opensim

_LARGEST_JUMP = 3.0
"""Times the median interval; a longer one is a gap, not jitter of the clock."""

OPENSIM, CSV, C3D = "opensim", "csv", "c3d"


@dataclass(frozen=True, slots=True, eq=False)
class MotionTable:
    """Columns over time [s] as a file has them; a unit is empty where the file does not say it."""

    file: str
    form: str
    time: Floats
    columns: Mapping[str, Floats]
    units: Mapping[str, str]
    kind: str = "measured"


def read_table(path: str | Path) -> MotionTable:
    """Return the table in a ``.mot``, ``.sto``, ``.csv`` or ``.c3d`` file; its clock runs without a gap.

    DataError for any other file, or for one with a gap in its time.
    """
    suffix = Path(path).suffix.lower()
    if suffix in (".mot", ".sto"):
        table = _of_opensim(str(path), read_opensim(path))
    elif suffix == ".csv":
        table = _of_csv(path)
    elif suffix == ".c3d":
        from ppafo.gait.recorded.c3d import read_c3d

        table = MotionTable(str(path), C3D, *read_c3d(path))
    else:
        raise DataError(f"{path}: is not a .mot, .sto, .csv or .c3d file")
    _check_gaps(table)
    return table


def _of_opensim(file: str, table: OpenSimTable) -> MotionTable:
    """Return the table with the units that OpenSim's labels imply; angles are as the header says."""
    angle = {True: "deg", False: "rad", None: ""}[table.in_degrees]
    units = {name: _opensim_unit(name, angle) for name in table.columns}
    return MotionTable(file, OPENSIM, table.time, table.columns, units)


def _opensim_unit(label: str, angle: str) -> str:
    if label.endswith("_moment") or "torque" in label or label.endswith(("_mx", "_my", "_mz")):
        return "N m"
    if label.endswith("_force") or label.endswith(("_vx", "_vy", "_vz")):
        return "N"
    if label.endswith(("_tx", "_ty", "_tz", "_px", "_py", "_pz")):
        return "m"
    return angle


def _of_csv(path: str | Path) -> MotionTable:
    recording = read_csv(path)
    columns = {name: recording[name] for name in recording.names}
    units = {name: recording.unit(name) for name in recording.names}
    return MotionTable(str(path), CSV, recording.time, columns, units, recording.kind)


def _check_gaps(table: MotionTable) -> None:
    if table.time.size < 3:
        raise DataError(f"{table.file}: has {table.time.size} rows; a stride needs several tens")
    steps = np.diff(table.time)
    median = float(np.median(steps))
    index = int(np.argmax(steps))
    if steps[index] > _LARGEST_JUMP * median:
        raise DataError(
            f"{table.file}: the time jumps in row {index + 2} from {table.time[index]:g} s to "
            f"{table.time[index + 1]:g} s, the usual interval is {median:.3g} s; cut the file there or fill the gap"
        )
