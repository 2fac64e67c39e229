"""Puts the torque of a device into a model of OpenSim. Needs the package ``opensim`` (4.6 or later) and nothing else.

    python add_device.py MODEL.osim --out with-device.osim
    python add_device.py MODEL.osim --as-load --out with-load.osim

The first model has an actuator and its controller, for forward and inverse dynamics. The second one has a pair of
torques on shank and foot in their place, which static optimisation and computed muscle control must leave as they are:
these tools take every actuator for one more muscle, and its controller for nothing.

Part of ppafo, MIT licence.
"""

import argparse
import math
import re
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

SUFFIX = "_device"
"""The actuator's name is that of its coordinate and this."""
_HERE = Path(__file__).parent
_LARGEST = 1.0e6
_CODE = re.compile(
    r"^.*?\)( const)?': |SimTK Exception thrown at \S+: |Error detected by Simbody method \S+ "
    r"|\s*(Thrown at |In Object |\(Required condition ).*$"
)


def read_torque(path: Path) -> tuple[str, list[float], list[float]]:
    """Return the name of the actuator, times [s] and torques along its coordinate [N m] of a ``.sto`` file.

    ValueError for a file without such a column, and for rows that are cut off.
    """
    lines = path.read_text(encoding="utf-8").splitlines()
    if "endheader" not in lines:
        raise ValueError(f"{path}: has no line 'endheader'")
    labels, *rows = [line.split("\t") for line in lines[lines.index("endheader") + 1 :]] or [[""]]
    columns = [label for label in labels if label.endswith(SUFFIX)]
    if labels[0] != "time" or len(columns) != 1:
        raise ValueError(f"{path}: must have a first column 'time' and one column whose name ends in '{SUFFIX}'")
    place = labels.index(columns[0])
    if len(rows) < 2 or any(len(row) != len(labels) for row in rows):
        raise ValueError(f"{path}: is cut off; write it again")
    times, torques = ([float(row[column]) for row in rows] for column in (0, place))
    if not all(map(math.isfinite, [*times, *torques])) or any(b <= a for a, b in pairwise(times)):
        raise ValueError(f"{path}: times must grow, and every number must be finite")
    return columns[0], times, torques


def read_model(path: Path) -> Any:
    """Return a model of OpenSim; ValueError for a file that is none."""
    import opensim

    if not path.is_file():
        raise ValueError(f"{path}: there is no such file; give a model of OpenSim (.osim)")
    try:
        model = opensim.Model(str(path))
        model.initSystem()
    except RuntimeError as error:
        raise ValueError(f"{path}: OpenSim cannot read it as a model: {without_code(error)}") from error
    if model.getCoordinateSet().getSize() == 0:
        raise ValueError(f"{path}: is no model of OpenSim, or one without joints")
    return model


def without_code(error: Exception) -> str:
    """Return what an error says on one line, without the functions and lines of OpenSim's source."""
    return _CODE.sub("", " ".join(str(error).split()))


def check_coordinate(model: Any, name: str) -> None:
    """Refuse a coordinate that the model does not have, one that is no angle, and one with a device; ValueError."""
    import opensim

    coordinates = model.getCoordinateSet()
    names = [coordinates.get(index).getName() for index in range(coordinates.getSize())]
    if name not in names:
        raise ValueError(f"{model.getName()}: has no coordinate '{name}'; there are: {', '.join(names)}")
    if coordinates.get(name).getMotionType() != opensim.Coordinate.Rotational:
        raise ValueError(f"{model.getName()}: '{name}' is no angle about one axis; a torque needs one that is")
    forces = [model.getForceSet().get(index).getName() for index in range(model.getForceSet().getSize())]
    there = [force for force in forces if force == f"{name}{SUFFIX}" or force.startswith(f"{name}{SUFFIX}_")]
    if there:
        raise ValueError(
            f"{model.getName()}: has a device at '{name}' already ({', '.join(there)}); take the model without it"
        )


def add_actuator(model: Any, coordinate: str, function: Any) -> str:
    """Add an actuator at a coordinate whose torque [N m] is a function of time; returns its name."""
    import opensim

    name = f"{coordinate}{SUFFIX}"
    actuator = opensim.CoordinateActuator(coordinate)
    actuator.setName(name)
    actuator.setOptimalForce(1.0)
    actuator.setMinControl(-_LARGEST)
    actuator.setMaxControl(_LARGEST)
    model.addForce(actuator)
    controller = opensim.PrescribedController()
    controller.setName(f"{name}_controller")
    controller.addActuator(actuator)
    controller.prescribeControlForActuator(name, function)
    model.addController(controller)
    model.finalizeConnections()
    return name


def add_load(model: Any, coordinate: str, times: Sequence[float], torques: Sequence[float]) -> None:
    """Add torques [N m] on both bodies of a joint, equal and opposite, that come to a torque along a coordinate.

    Right for a joint that turns about an axis fixed in both bodies, as ankles of models do. ValueError for others.
    """
    import opensim

    # The joint's axis in its two bodies, by their names, in the second one reversed; each over its length.
    state = model.initSystem()
    joint = model.getCoordinateSet().get(coordinate).getJoint()
    child, parent = (frame.findBaseFrame() for frame in (joint.getChildFrame(), joint.getParentFrame()))
    found = [_axes_at(model, state, coordinate, (child, parent), angle) for angle in (0.0, 0.2)]
    same = all(abs(a - b) < 1.0e-6 for one, two in zip(*found, strict=True) for a, b in zip(one, two, strict=True))
    if not same or sum(component * component for component in found[0][0]) < 1.0e-12:
        raise ValueError(f"{model.getName()}: '{coordinate}' turns about no axis that is fixed in both bodies")
    (of_child, of_parent) = found[0]
    axes = {child.getName(): of_child, parent.getName(): [-component for component in of_parent]}
    for body, axis in axes.items():
        load = opensim.PrescribedForce(f"{coordinate}{SUFFIX}_{body}", model.getBodySet().get(body))
        load.set_forceIsGlobal(False)
        for component in axis:
            load.upd_torqueFunctions().cloneAndAppend(line(times, [component * torque for torque in torques]))
        model.addForce(load)
    model.finalizeConnections()


def line(times: Sequence[float], values: Sequence[float]) -> Any:
    """Return a function of OpenSim: straight lines between values at times [s], level outside of them."""
    import opensim

    function = opensim.PiecewiseLinearFunction()
    # OpenSim goes on beyond both ends along the last line.
    function.addPoint(times[0] - 1.0, values[0])
    for time, value in zip(times, values, strict=True):
        function.addPoint(time, value)
    function.addPoint(times[-1] + 1.0, values[-1])
    return function


def _axes_at(model: Any, state: Any, coordinate: str, frames: Sequence[Any], angle: float) -> list[list[float]]:
    """Return the axis in each frame, with the coordinate at an angle [rad] and nothing else in motion."""
    coordinates = model.getCoordinateSet()
    for index in range(coordinates.getSize()):
        coordinates.get(index).setSpeedValue(state, 0.0)
    moved = coordinates.get(coordinate)
    moved.setValue(state, angle, False)
    moved.setSpeedValue(state, 1.0)
    model.realizeVelocity(state)
    child, parent = (frame.getAngularVelocityInGround(state) for frame in frames)
    axis = [child[row] - parent[row] for row in range(3)]
    square = sum(component * component for component in axis) or 1.0
    turns = [frame.getTransformInGround(state).R() for frame in frames]
    return [
        [sum(turn.get(row, column) * axis[row] for row in range(3)) / square for column in range(3)] for turn in turns
    ]


def main(words: Sequence[str] | None = None) -> int:
    """Read model and torque, and write the model with the device; returns the exit code."""
    parser = argparse.ArgumentParser(description="Put the torque of a device into a model of OpenSim.")
    parser.add_argument("model", metavar="MODEL", type=Path, help="a model of OpenSim (.osim)")
    parser.add_argument("--torque", metavar="FILE", type=Path, default=_HERE / "device_torque.sto")
    parser.add_argument("--coordinate", metavar="NAME", help="of the model; default: the column of the torque says it")
    parser.add_argument("--as-load", action="store_true", help="torques on shank and foot instead of an actuator")
    parser.add_argument("--out", metavar="FILE", type=Path, required=True, help="the model to write")
    parsed = parser.parse_args(words)
    try:
        name, times, torques = read_torque(parsed.torque)
        # Else OpenSim leaves a file opensim.log, and lines about every component on the screen.
        import opensim

        opensim.Logger.removeFileSink()
        opensim.Logger.setLevelString("Error")
        model = read_model(parsed.model)
        coordinate = parsed.coordinate or name.removesuffix(SUFFIX)
        check_coordinate(model, coordinate)
        if parsed.as_load:
            add_load(model, coordinate, times, torques)
        else:
            add_actuator(model, coordinate, line(times, torques))
        if not parsed.out.parent.is_dir():
            raise ValueError(f"{parsed.out}: there is no folder {parsed.out.parent}")
        model.printToXML(str(parsed.out))
    except (OSError, ValueError, ImportError, RuntimeError) as error:
        print(f"add_device: {without_code(error)}", file=sys.stderr)
        return 2
    print(f"written: {parsed.out}, with {times[0]:g} to {times[-1]:g} s of torque along {coordinate}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
