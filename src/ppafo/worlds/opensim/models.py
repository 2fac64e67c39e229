"""Models and motions of OpenSim: read, checked against each other, and quiet."""

import math
from pathlib import Path
from typing import Any

import opensim

from ppafo.errors import DataError, nearest_name, one_line
from ppafo.exports.opensim.add_device import check_coordinate, line, read_model
from ppafo.storage.opensim import OpenSimTable, read_opensim

_STATE = "/value"
CONTACT = ("HuntCrossleyForce", "ElasticFoundationForce", "SmoothSphereHalfSpaceForce")
"""Forces of a model that press the feet on the ground: measured ones stand in their place."""


def load_model(path: str | Path) -> Any:
    """Return a model of OpenSim; DataError for a file that is none."""
    try:
        return read_model(Path(path))
    except ValueError as error:
        raise DataError(one_line(error)) from error


def coordinate_of_model(model: Any, name: str) -> Any:
    """Return a coordinate of a model; DataError where it has none of that name."""
    names = coordinate_names(model)
    if name not in names:
        raise DataError(
            f"model {model.getName()}: has no coordinate '{name}'{nearest_name(name, names)}; "
            f"there are: {', '.join(names)}"
        )
    return model.getCoordinateSet().get(name)


def check_place(model: Any, name: str) -> None:
    """Refuse a coordinate that cannot take a device: one that is not there, is no angle, or has one; DataError."""
    coordinate_of_model(model, name)
    try:
        check_coordinate(model, name)
    except ValueError as error:
        raise DataError(f"model {error}") from error


def coordinate_names(model: Any) -> list[str]:
    """Return the names of all coordinates, in the order of the model."""
    coordinates = model.getCoordinateSet()
    return [coordinates.get(index).getName() for index in range(coordinates.getSize())]


def muscles_across(model: Any, coordinate: str) -> tuple[str, ...]:
    """Return the names of the muscles that turn a coordinate; DataError where none does."""
    state = model.initSystem()
    turned = coordinate_of_model(model, coordinate)
    muscles = [model.getMuscles().get(index) for index in range(model.getMuscles().getSize())]
    arms = {muscle.getName(): muscle.getGeometryPath().computeMomentArm(state, turned) for muscle in muscles}
    found = tuple(name for name, arm in arms.items() if abs(arm) > 1.0e-5)
    if not found:
        raise DataError(f"model {model.getName()}: no muscle crosses '{coordinate}'")
    return found


def read_motion(path: str | Path, model: Any, coordinate: str) -> OpenSimTable:
    """Return a motion by the names of the model's coordinates, in the file's units.

    DataError where the file has no column for a coordinate that the model leaves free.
    """
    table = read_opensim(path)
    named = {name.removesuffix(_STATE).rpartition("/")[2]: name for name in table.columns}
    if coordinate not in named:
        raise DataError(f"{path}: has no column '{coordinate}'{nearest_name(coordinate, named)}")
    state = model.initSystem()
    free = [name for name in coordinate_names(model) if not model.getCoordinateSet().get(name).isConstrained(state)]
    missing = [name for name in free if name not in named]
    if missing:
        raise DataError(f"{path}: has no column for {', '.join(missing)} of model {model.getName()}")
    return table


def follow_motion(
    model: Any, path: str | Path, coordinate: str, start: float | None = None, free: tuple[str, ...] = ()
) -> float:
    """Let a model follow a motion, but for locked coordinates and those in ``free``; returns how long there is one [s].

    Time 0 of the model is ``start`` [s] of the file, its first row unless given. Curves between rows are cubic splines.
    DataError for a motion that does not fit the model, and for a start that is not inside.
    """
    table = read_motion(path, model, coordinate)
    first, last = float(table.time[0]), float(table.time[-1])
    start = first if start is None else start
    if not first <= start < last:
        raise DataError(f"{path}: goes from {first:g} to {last:g} s, it cannot be followed from {start:g} s on")
    for name in free:
        coordinate_of_model(model, name)
    degrees = table.in_degrees if table.in_degrees is not None else table.is_old
    for label, values in table.columns.items():
        name = label.removesuffix(_STATE).rpartition("/")[2]
        if name in free or name not in coordinate_names(model):
            continue
        led = model.updCoordinateSet().get(name)
        if led.getDefaultLocked():
            continue
        scale = math.radians(1.0) if degrees and led.getMotionType() == opensim.Coordinate.Rotational else 1.0
        led.setPrescribedFunction(spline((table.time - start).tolist(), (scale * values).tolist()))
        led.setDefaultIsPrescribed(True)
    return last - start


def spline(times: list[float], values: list[float]) -> Any:
    """Return a function of OpenSim: a cubic spline through values at times [s], or a line through two."""
    if len(times) < 4:
        return line(times, values)
    function = opensim.SimmSpline()
    for time, value in zip(times, values, strict=True):
        function.addPoint(time, value)
    return function
