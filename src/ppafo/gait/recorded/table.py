"""Tables of motion from OpenSim, CSV, C3D and TRC files in one form: time, and columns with the unit of the file.

A CSV file need not have the header ``name [unit]``: names alone or with the unit in brackets and any usual delimiter
will do. Gaps are filled up to a length that the user states, each named.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import count, pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ppafo.documents.regular_file import decoded
from ppafo.errors import DataError, first_twice, one_line
from ppafo.signals.recording import Floats
from ppafo.storage.comma_separated import read_csv
from ppafo.storage.files import read_bytes
from ppafo.storage.foreign import ColumnMap, MappedChannel, read_foreign
from ppafo.storage.opensim import OpenSimTable, read_opensim_with_gaps, read_trc
from ppafo.storage.trial_reading import check_can_be_read

_AXES = "xyz"
_MARK = b"\x50"
"""Second byte of every C3D file."""
_UNITS = {
    "Nmm/kg": "N mm/kg",
    "N.mm/kg": "N mm/kg",
    "Nmm": "N mm",
    "N.mm": "N mm",
    "Nm": "N m",
    "N.m": "N m",
    "Nm/kg": "N m/kg",
    "N.m/kg": "N m/kg",
    "degrees": "deg",
    "": "",
}
_GROUPS = (("ANGLES", "ANGLE_UNITS"), ("MOMENTS", "MOMENT_UNITS"), ("FORCES", "FORCE_UNITS"))
_BODY, _HEIGHT = ("Bodymass", "BODYMASS", "BodyMass"), ("Height", "HEIGHT")
_STRIKE, _OFF = "foot strike", "foot off"
PLATE = "force plate "
"""Columns ``force plate 1.x``, ``.y``, ``.z`` [N]: what the plate's channels make in the axes of the laboratory."""

Events = dict[tuple[str, str], list[float]]


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """What a C3D file says beside its columns: subject (kg, m; None where not), events [s] by side and kind.

    ``remarks`` say how its events were read, or why they were not.
    """

    body_mass: float | None = None
    stature: float | None = None
    events: Events = field(default_factory=dict)
    remarks: tuple[str, ...] = ()

    def strikes(self, side: str) -> list[float]:
        """Return the heel strikes of a foot."""
        return self.events.get((side, _STRIKE), [])

    def offs(self, side: str) -> list[float]:
        """Return the toe-offs of a foot."""
        return self.events.get((side, _OFF), [])


@dataclass(frozen=True, slots=True, eq=False)
class C3dFile:
    """Time [s], columns and their units: points as ``LABEL.x``, ``.y``, ``.z``, analog channels and plates."""

    time: Floats
    columns: dict[str, Floats]
    units: dict[str, str]
    trial: Trial


def read_c3d(path: str | Path) -> C3dFile:
    """Return the columns of a C3D file and what it says of subject and events.

    Analog channels are faster; the samples at the times of the points are taken. Where a point was not seen it is NaN,
    for whoever uses the column to fill or refuse. The clock is that of the trial, which may begin before the file.
    """
    try:
        import ezc3d  # noqa: F401  # its absence is reported before the file is looked at
    except ImportError as error:
        raise DataError(f"{path}: C3D files need ezc3d; install it with 'pip install ppafo[c3d]'") from error
    if read_bytes(path)[1:2] != _MARK:
        raise DataError(f"{path}: is not a C3D file")
    check_can_be_read(Path(path), __name__, "open_c3d", "ezc3d")
    content = open_c3d(path)
    parameters: Any = content["parameters"]
    rate = _rate(parameters, path)
    points: Floats = content["data"]["points"]
    # The labels, without the subject's name before a colon.
    group = parameters["POINT"]
    number = points.shape[1]
    labels = [_bare(label) for label in _texts(group, "LABELS")][:number]
    twice = first_twice(labels)
    if twice is not None or len(labels) != number:
        what = f"two of {twice!r}" if twice is not None else f"{len(labels)} labels for {number} columns"
        raise DataError(f"{path}: there are {what}; every point and channel needs a label of its own")
    frames = points.shape[2]
    columns = {
        f"{label}.{axis}": points[row, number, :]
        for number, label in enumerate(labels)
        for row, axis in enumerate(_AXES)
    }
    units = _units(parameters["POINT"], labels)
    analogs: Floats = content["data"]["analogs"][0]
    if analogs.shape[0] and frames:
        for name, values, unit in _channels(parameters["ANALOG"], analogs, frames):
            columns[name], units[name] = values, unit
    for name, values in _plates(content, frames):
        columns[name], units[name] = values, "N"
    first = max(0, int(content["header"]["points"].get("first_frame", 0)))
    return C3dFile((first + np.arange(frames)) / rate, columns, units, _trial(parameters))


def open_c3d(path: str | Path) -> Any:
    """Return what ezc3d makes of a file, with its force plates where it can; damage can bring down the process."""
    import ezc3d

    try:
        try:
            return ezc3d.c3d(str(path), extract_forceplat_data=True)
        except (OSError, RuntimeError, ValueError, IndexError, KeyError):
            return ezc3d.c3d(str(path))
    except (OSError, RuntimeError, ValueError, IndexError, KeyError) as error:
        raise DataError(f"{path}: ezc3d cannot read it: {one_line(error)}") from error


def _rate(parameters: Any, path: str | Path) -> float:
    values = np.atleast_1d(parameters["POINT"]["RATE"]["value"])
    rate = float(values[0]) if values.size else 0.0
    if not 0.0 < rate < np.inf:
        raise DataError(f"{path}: POINT:RATE is {rate:g}; points need a rate above 0 Hz")
    return rate


def _bare(label: str) -> str:
    return label.rpartition(":")[2].strip()


def _channels(group: Any, analogs: Floats, frames: int) -> Iterator[tuple[str, Floats, str]]:
    """Yield name, values at the times of the points and unit of each channel whose label is its own."""
    step = analogs.shape[1] // frames
    labels = [_bare(label) for label in _texts(group, "LABELS")][: analogs.shape[0]]
    stated = _texts(group, "UNITS")
    for number, label in enumerate(labels):
        if label and labels.count(label) == 1:
            yield label, analogs[number, ::step][:frames], _unit_name(stated[number]) if number < len(stated) else ""


def _plates(content: Any, frames: int) -> Iterator[tuple[str, Floats]]:
    """Yield the forces [N] of every plate in the axes of the laboratory, upwards above 0, as often as the points."""
    for number, plate in enumerate(content["data"].get("platform", ()), start=1):
        force: Floats = np.asarray(plate["force"], dtype=np.float64)
        if frames == 0 or force.ndim != 2 or force.shape[1] < frames:
            continue
        # Some laboratories store what the plate feels, some what it gives back; a foot loads it downwards.
        force = force[:, :: force.shape[1] // frames][:, :frames]
        # Whichever axis is up, the weight is the largest of the sums.
        total = np.nansum(force, axis=1)
        sign = -1.0 if total[np.argmax(np.abs(total))] < 0.0 else 1.0
        for row, axis in enumerate(_AXES):
            yield f"{PLATE}{number}.{axis}", sign * force[row]


def _units(group: Any, labels: Iterable[str]) -> dict[str, str]:
    """Return the unit of every point's coordinates: those of model outputs stand in groups of their own."""
    usual = _unit_name(next(iter(_texts(group, "UNITS")), ""))
    units = {label: usual for label in labels}
    for names, unit in _GROUPS:
        stated = _unit_name(next(iter(_texts(group, unit)), ""))
        units.update({_bare(label): stated for label in _texts(group, names)})
    return {f"{label}.{axis}": unit for label, unit in units.items() for axis in _AXES}


def _unit_name(unit: str) -> str:
    return _UNITS.get(unit.strip(), unit.strip())


def _texts(group: Any, key: str) -> list[str]:
    """Return the texts of a parameter; one with more than 255 goes on in KEY2, KEY3 and so on."""
    keys = [key]
    for number in count(2):
        if f"{key}{number}" not in group:
            break
        keys.append(f"{key}{number}")
    return [str(text) for name in keys if name in group for text in group[name]["value"]]


def _trial(parameters: Any) -> Trial:
    """Return subject and events; those of other laboratories' spelling, or nonsense, are as if they were absent."""
    group = parameters.get("PROCESSING", {})
    mass, height = _number(group, _BODY), _number(group, _HEIGHT)
    # Plug-in Gait keeps the height in mm.
    stature = None if height is None else height / 1000.0 if height > 100.0 else height
    return Trial(
        mass if mass is not None and 1.0 <= mass <= 500.0 else None,
        stature if stature is not None and 0.5 <= stature <= 2.5 else None,
        *_events(parameters.get("EVENT", {})),
    )


def _number(group: Any, names: Iterable[str]) -> float | None:
    for name in names:
        if name in group:
            values = np.atleast_1d(group[name]["value"])
            if values.size and values.dtype.kind in "fi" and np.isfinite(values[0]):
                return float(values[0])
    return None


def _events(group: Any) -> tuple[Events, tuple[str, ...]]:
    """Return the times of strikes and offs, and what there is to say of them.

    A time is stored as minutes and seconds, in two rows; some programs write a flat list, of such pairs or of seconds.
    """
    present = [name for name in ("CONTEXTS", "LABELS", "TIMES") if name in group]
    if len(present) < 3:
        return {}, ("its events are not read: one of EVENT:CONTEXTS, LABELS and TIMES is missing",) if present else ()
    sides, kinds = _texts(group, "CONTEXTS"), _texts(group, "LABELS")
    times = np.asarray(group["TIMES"]["value"], dtype=np.float64)
    count, said = len(kinds), ""
    if times.shape == (2, count) or (count < 2 and times.size == 2 * count):
        pairs = times.reshape(2, count)
    elif times.size == 2 * count:
        pairs, said = times.reshape(count, 2).T, "a flat list of minutes and seconds"
    elif times.size == count:
        pairs, said = np.array([np.zeros(count), times.reshape(-1)]), "a flat list of seconds"
    else:
        pairs = np.zeros((2, 0))
    if not count == len(sides) == pairs.shape[1]:
        return {}, (
            f"its events are not read: EVENT has {len(sides)} contexts, {count} labels and {times.size} times, which "
            "do not fit together",
        )
    found: Events = {}
    for side, kind, time in zip(sides, kinds, (60.0 * pairs[0] + pairs[1]).tolist(), strict=True):
        if np.isfinite(time):
            found.setdefault((side.strip().lower(), kind.strip().lower()), []).append(time)
    return {key: sorted(found[key]) for key in found}, (f"times of its events read as {said}",) if said else ()


_LARGEST_JUMP = 3.0
"""Times the median interval; a longer one is a gap, not jitter of the clock."""

OPENSIM, CSV, C3D, TRC = "opensim", "csv", "c3d", "trc"
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
        remarks = found.trial.remarks
        table = MotionTable(str(path), C3D, found.time, found.columns, found.units, "measured", remarks, found.trial)
    else:
        raise DataError(f"{path}: is not a {FILES} file")
    if table.time.size < 3:
        raise DataError(f"{table.file}: has {table.time.size} rows; a stride needs several tens")
    low = float(table.time[0] if start is None else start)
    high = float(table.time[-1] if end is None else end)
    # The table with a remark on rows missing between two times [s]; DataError where for too long.
    steps = np.diff(table.time)
    median = float(np.median(steps))
    seen = (table.time[:-1] >= low) & (table.time[1:] <= high)
    jumps = np.flatnonzero(seen & (steps > _LARGEST_JUMP * median)).tolist()
    for index in jumps:
        if steps[index] > longest_gap + 1.5 * median:
            raise DataError(
                f"{table.file}: the time jumps in row {index + 2} from {table.time[index]:g} s to "
                f"{table.time[index + 1]:g} s, the usual interval is {median:.3g} s; cut the file there or fill the gap"
                " (--start, --end, --fill-gaps)"
            )
    said = [f"rows from {table.time[i]:g} to {table.time[i + 1]:g} s are missing and were bridged" for i in jumps]
    table = replace(table, remarks=(*table.remarks, *said))
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


_DELIMITERS: dict[str, Literal["comma", "semicolon", "tab"]] = {",": "comma", ";": "semicolon", "\t": "tab"}
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
    content = read_bytes(path)
    try:
        return decoded(content)
    except UnicodeDecodeError:
        return content.decode("utf-8", errors="replace")


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
