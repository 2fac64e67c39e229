"""C3D files: points, model outputs, analog channels, force plates, subject and events."""

from collections.abc import Iterable, Iterator
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.gait import BODY_MASSES, STATURES
from ppafo.gait.recorded.delimited import merged, told_apart
from ppafo.gait.recorded.form import GaitForm
from ppafo.gait.recorded.forms.markers import PLATE, marker_convention
from ppafo.gait.recorded.table import AXES, Events, MotionTable, bare_label
from ppafo.signals.recording import Floats
from ppafo.storage.files import read_bytes
from ppafo.storage.trial_reading import check_can_be_read
from ppafo.wording import count_of, one_line

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

_BODY = ("Bodymass", "BODYMASS", "BodyMass")
_HEIGHT = ("Height", "HEIGHT")


def read_c3d(path: str | Path) -> MotionTable:
    """Return the columns of a C3D file, with its data on subject and events.

    Analog channels have a higher rate and are sampled at the times of the points. A point that was not visible is NaN,
    to be filled or rejected by the user of the column. The clock is the one of the trial, which may start before the
    file.
    """
    try:
        import ezc3d  # noqa: F401  # its absence is reported before the file is looked at
    except ImportError as error:
        raise DataError(f"{path}: C3D files need ezc3d; install it with 'pip install ppafo[c3d]'") from error
    if read_bytes(path)[1:2] != _MARK:
        raise DataError(f"{path}: is not a C3D file")
    # A damaged file ends ezc3d with a crash: another process tries it first.
    check_can_be_read(Path(path), open_c3d, "ezc3d")
    content = open_c3d(path)
    parameters: Any = content["parameters"]
    rates = np.atleast_1d(parameters["POINT"]["RATE"]["value"])
    rate = float(rates[0]) if rates.size else 0.0
    if not 0.0 < rate < np.inf:
        raise DataError(f"{path}: POINT:RATE is {rate:g} Hz; it must be above 0 Hz")
    points: Floats = content["data"]["points"]
    # The labels, without the subject's name before a colon.
    group = parameters["POINT"]
    number = points.shape[1]
    written = [bare_label(label) for label in _texts(group, "LABELS")][:number]
    # A point whose label is not its own has its description for a name, or its number.
    labels = told_apart(written, [bare_label(text) for text in _texts(group, "DESCRIPTIONS")])
    frames = points.shape[2]
    coordinates = {
        f"{label}.{axis}": points[row, number, :]
        for number, label in enumerate(labels)
        for row, axis in enumerate(AXES)
    }
    columns, doubled = merged([f"{label}.{axis}" for label in written for axis in AXES], coordinates, "points")
    units = {name: unit for name, unit in _units(group, (*labels, *written)).items() if name in columns}
    analogs: Floats = content["data"]["analogs"][0]
    if analogs.shape[0] and frames:
        # Analog samples are a whole multiple of the points' by the format.
        step = analogs.shape[1] // frames
        analog = parameters["ANALOG"]
        channels = [bare_label(label) for label in _texts(analog, "LABELS")][: analogs.shape[0]]
        stated = _texts(analog, "UNITS")
        for row, name in enumerate(channels):
            # A channel named like a coordinate of a point must not take its place.
            if name and channels.count(name) == 1 and name not in columns:
                columns[name] = analogs[row, ::step][:frames]
                units[name] = _unit_name(stated[row]) if row < len(stated) else ""
    for name, values in _plates(content, frames):
        columns[name] = values
        units[name] = "N"
    # A trial that was cut keeps its clock: events count from the beginning of the capture.
    first = max(0, int(content["header"]["points"].get("first_frame", 0)))
    subject = parameters.get("PROCESSING", {})
    mass = _number(subject, _BODY)
    height = _number(subject, _HEIGHT)
    # Plug-in Gait keeps the height in mm.
    stature = None if height is None else height / 1000.0 if height > 100.0 else height
    events, on_events = _events(parameters.get("EVENT", {}))
    remarks = [*on_events, *doubled]
    remarks += [f"{count_of(number - len(labels), 'point')} without a label not read"] if len(labels) < number else []
    # An unknown spelling or an implausible value is treated as absent.
    return MotionTable(
        str(path),
        (first + np.arange(frames)) / rate,
        columns,
        units,
        remarks=tuple(remarks),
        body_mass=mass if mass is not None and BODY_MASSES[0] <= mass <= BODY_MASSES[1] else None,
        stature=stature if stature is not None and STATURES[0] <= stature <= STATURES[1] else None,
        events=events,
    )


def open_c3d(path: str | Path) -> Any:
    """Return the content of a file read by ezc3d, with force plates if possible; a damaged file can end the process."""
    import ezc3d

    try:
        try:
            return ezc3d.c3d(str(path), extract_forceplat_data=True)
        except (OSError, RuntimeError, ValueError, IndexError, KeyError):
            return ezc3d.c3d(str(path))
    except (OSError, RuntimeError, ValueError, IndexError, KeyError) as error:
        raise DataError(f"{path}: ezc3d cannot read the file: {one_line(error)}") from error


def _plates(content: Any, frames: int) -> Iterator[tuple[str, Floats]]:
    """Yield the forces [N] of every plate in laboratory axes, positive upwards, at the times of the points."""
    for number, plate in enumerate(content["data"].get("platform", ()), start=1):
        force: Floats = np.asarray(plate["force"], dtype=np.float64)
        if frames == 0 or force.ndim != 2 or force.shape[1] < frames:
            continue
        # Some laboratories store what the plate feels, some what it gives back; a foot loads it downwards.
        force = force[:, :: force.shape[1] // frames][:, :frames]
        # Whichever axis is up, the weight is the largest of the sums.
        total = np.nansum(force, axis=1)
        sign = -1.0 if total[np.argmax(np.abs(total))] < 0.0 else 1.0
        for row, axis in enumerate(AXES):
            yield f"{PLATE}{number}.{axis}", sign * force[row]


def _units(group: Any, labels: Iterable[str]) -> dict[str, str]:
    """Return the unit of every point's coordinates; units of model outputs are in separate parameter groups."""
    usual = _unit_name(next(iter(_texts(group, "UNITS")), ""))
    units = {label: usual for label in labels}
    for names, unit in _GROUPS:
        stated = _unit_name(next(iter(_texts(group, unit)), ""))
        units.update({bare_label(label): stated for label in _texts(group, names)})
    return {f"{label}.{axis}": unit for label, unit in units.items() for axis in AXES}


def _unit_name(unit: str) -> str:
    return _UNITS.get(unit.strip(), unit.strip())


def _texts(group: Any, key: str) -> list[str]:
    """Return the texts of a C3D parameter; with more than 255 texts it continues in KEY2, KEY3 and so on."""
    keys = [key]
    for number in count(2):
        if f"{key}{number}" not in group:
            break
        keys.append(f"{key}{number}")
    return [str(text) for name in keys if name in group for text in group[name]["value"]]


def _number(group: Any, names: Iterable[str]) -> float | None:
    for name in names:
        if name in group:
            values = np.atleast_1d(group[name]["value"])
            if values.size and values.dtype.kind in "fi" and np.isfinite(values[0]):
                return float(values[0])
    return None


def _events(group: Any) -> tuple[Events, tuple[str, ...]]:
    """Return the times [s] of heel strikes and toe-offs, and remarks on them.

    A time is stored as minutes and seconds, in two rows. Some programs write a flat list instead, of such pairs or of
    seconds.
    """
    present = [name for name in ("CONTEXTS", "LABELS", "TIMES") if name in group]
    if len(present) < 3:
        return {}, ("events not read: EVENT needs CONTEXTS, LABELS and TIMES",) if present else ()
    sides = _texts(group, "CONTEXTS")
    kinds = _texts(group, "LABELS")
    times = np.asarray(group["TIMES"]["value"], dtype=np.float64)
    count = len(kinds)
    assumption = ""
    if times.shape == (2, count) or (count < 2 and times.size == 2 * count):
        pairs = times.reshape(2, count)
    elif times.size == 2 * count:
        pairs = times.reshape(count, 2).T
        assumption = "a flat list of minutes and seconds"
    elif times.size == count:
        pairs = np.array([np.zeros(count), times.reshape(-1)])
        assumption = "a flat list of seconds"
    else:
        pairs = np.zeros((2, 0))
    if not count == len(sides) == pairs.shape[1]:
        return {}, (
            f"events not read: EVENT has {len(sides)} contexts, {count} labels and {times.size} times, but needs the "
            "same number of each",
        )
    events: Events = {}
    for side, kind, time in zip(sides, kinds, (60.0 * pairs[0] + pairs[1]).tolist(), strict=True):
        if np.isfinite(time):
            events.setdefault((side.strip().lower(), kind.strip().lower()), []).append(time)
    return {key: sorted(events[key]) for key in events}, (f"event times read as {assumption}",) if assumption else ()


FORM = GaitForm(
    name="c3d",
    summary="C3D files with markers, or with the angles, moments and forces of Plug-in Gait",
    suffixes=(".c3d",),
    read=read_c3d,
    convention=marker_convention,
)
