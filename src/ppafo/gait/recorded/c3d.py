"""C3D files through ezc3d: markers, model outputs and force plates as columns. Needs the extra ``c3d``."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.errors import DataError, first_twice, one_line
from ppafo.signals.recording import Floats
from ppafo.storage.files import read_bytes
from ppafo.storage.trial_reading import check_can_be_read

_AXES = "xyz"
_MARK = b"\x50"
"""Second byte of every C3D file."""
_UNITS = {"Nmm/kg": "N mm/kg", "Nmm": "N mm", "Nm": "N m", "Nm/kg": "N m/kg", "": ""}
_GROUPS = (("ANGLES", "ANGLE_UNITS"), ("MOMENTS", "MOMENT_UNITS"), ("FORCES", "FORCE_UNITS"))


def read_c3d(path: str | Path) -> tuple[Floats, dict[str, Floats], dict[str, str]]:
    """Return time [s], columns and their units: points as ``LABEL.x``, ``.y``, ``.z``, analog channels by label.

    Analog channels are faster; the samples at the times of the points are taken. A gap in a point is NaN here, and
    refused by whoever uses the column. DataError where the file cannot be read.
    """
    _check_is_c3d(path)
    check_can_be_read(Path(path), __name__, "open_c3d", "ezc3d")
    content = open_c3d(path)
    parameters: Any = content["parameters"]
    rate = _rate(parameters, path)
    points: Floats = content["data"]["points"]
    labels = _labels(parameters["POINT"], points.shape[1], path)
    frames = points.shape[2]
    columns = {
        f"{label}.{axis}": points[row, number, :]
        for number, label in enumerate(labels)
        for row, axis in enumerate(_AXES)
    }
    units = _units(parameters["POINT"], labels)
    analogs: Floats = content["data"]["analogs"][0]
    if analogs.shape[0] and frames:
        step = analogs.shape[1] // frames
        names = _labels(parameters["ANALOG"], analogs.shape[0], path)
        stated = _texts(parameters["ANALOG"], "UNITS")
        for number, label in enumerate(names):
            columns[label] = analogs[number, ::step][:frames]
            units[label] = _unit_name(stated[number]) if number < len(stated) else ""
    return np.arange(frames) / rate, columns, units


def _check_is_c3d(path: str | Path) -> None:
    try:
        import ezc3d  # noqa: F401  # its absence is reported before the file is looked at
    except ImportError as error:
        raise DataError(f"{path}: C3D files need ezc3d; install it with 'pip install ppafo[c3d]'") from error
    if read_bytes(path)[1:2] != _MARK:
        raise DataError(f"{path}: is not a C3D file")


def open_c3d(path: str | Path) -> Any:
    """Return what ezc3d makes of a file; a damaged one can bring down the process.

    DataError where it cannot be read.
    """
    import ezc3d

    try:
        return ezc3d.c3d(str(path))
    except (OSError, RuntimeError, ValueError, IndexError, KeyError) as error:
        raise DataError(f"{path}: ezc3d cannot read it: {one_line(error)}") from error


def _rate(parameters: Any, path: str | Path) -> float:
    values = np.atleast_1d(parameters["POINT"]["RATE"]["value"])
    rate = float(values[0]) if values.size else 0.0
    if not 0.0 < rate < np.inf:
        raise DataError(f"{path}: POINT:RATE is {rate:g}; points need a rate above 0 Hz")
    return rate


def _labels(group: Any, count: int, path: str | Path) -> list[str]:
    """Return the labels, without the subject's name before a colon."""
    labels = [label.rpartition(":")[2].strip() for label in _texts(group, "LABELS")][:count]
    twice = first_twice(labels)
    if twice is not None or len(labels) != count:
        what = f"two of {twice!r}" if twice is not None else f"{len(labels)} labels for {count} columns"
        raise DataError(f"{path}: there are {what}; every point and channel needs a label of its own")
    return labels


def _units(group: Any, labels: Iterable[str]) -> dict[str, str]:
    """Return the unit of every point's coordinates: those of model outputs stand in groups of their own."""
    usual = _unit_name(next(iter(_texts(group, "UNITS")), ""))
    units = {label: usual for label in labels}
    for names, unit in _GROUPS:
        stated = _unit_name(next(iter(_texts(group, unit)), ""))
        units.update({label.rpartition(":")[2].strip(): stated for label in _texts(group, names)})
    return {f"{label}.{axis}": unit for label, unit in units.items() for axis in _AXES}


def _unit_name(unit: str) -> str:
    return _UNITS.get(unit.strip(), unit.strip())


def _texts(group: Any, key: str) -> list[str]:
    return [str(text) for text in group[key]["value"]] if key in group else []
