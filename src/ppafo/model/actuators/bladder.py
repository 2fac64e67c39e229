"""Fabric bladders that lie over the joint: tubes which the joint folds, and which unfold when they are inflated.

A tube of radius r that is folded by an angle f about a line on its surface loses a wedge on each side of the fold, and
holds pi r^2 L - 2 pi r^3 tan(f/2); it unfolds with the torque p pi r^3/cos^2(f/2), which begins as the moment p pi r^3
under which an inflated tube gives way (Comer and Levy, AIAA Journal 1(7), 1963). This is the self-intersection of the
pneumatic interference actuator (Nesler, Swift and Rouse, Soft Robotics 5(2), 2018) for a round tube. The fabric gives:
the volume grows by a share per pressure. Bladder 1 unfolds with the angle, bladder 2 against it; radius 0 is none.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

from ppafo.model.actuators.kind import ActuatorKind, ActuatorModel, Chambers, Range, ShapedPlant
from ppafo.model.actuators.linear_chambers import (
    LinearChamber,
    linear_chambers,
    linear_pressures,
    linear_torque,
    stretching,
)
from ppafo.model.declaration import Quantity
from ppafo.model.elementary import TURNS_OF_RADIAN, sine_and_cosine_of_turns

LARGEST_FOLD = math.radians(150.0)


class Tube(NamedTuple):
    """Volume unfolded [m^3], what a fold takes off [m^3], angle at which it is straight [rad], dead volume [m^3]."""

    full: float
    wedge: float
    straight: float
    dead_volume: float


class Bladders(NamedTuple):
    """Both tubes, the share by which a volume grows per pressure [1/Pa], and the passive stiffness [N m/rad].

    The passive torque is zero at ``rest_angle`` [rad].
    """

    tube_1: Tube
    tube_2: Tube
    stretch: float
    stiffness: float
    rest_angle: float


def folded(tube: Tube, stretch: float, fold: float, way: float) -> LinearChamber:
    """A tube folded by an angle [rad], which the joint's angle unfolds where ``way`` is 1 and folds where it is -1."""
    sine, cosine = sine_and_cosine_of_turns(fold * TURNS_OF_RADIAN)
    per = 1.0 / (1.0 + cosine)
    volume = tube.full - tube.wedge * sine * per
    slope = way * tube.wedge * per
    return stretching(tube.dead_volume, volume, slope, stretch)


def bladder_1(shape: Bladders, angle: float) -> LinearChamber:
    """The bladder that unfolds with the angle [rad]."""
    return folded(shape.tube_1, shape.stretch, shape.tube_1.straight - angle, 1.0)


def bladder_2(shape: Bladders, angle: float) -> LinearChamber:
    """The bladder that the angle [rad] folds."""
    return folded(shape.tube_2, shape.stretch, angle - shape.tube_2.straight, -1.0)


def chambers(plant: ShapedPlant, angle: float, pressure_1: float, pressure_2: float) -> Chambers:
    """Both bladders at an angle [rad]."""
    shape: Bladders = plant.shape
    return linear_chambers(plant, bladder_1(shape, angle), bladder_2(shape, angle), pressure_1, pressure_2)


def pressures(plant: ShapedPlant, angle: float, mass_1: float, mass_2: float) -> tuple[float, float]:
    """Absolute pressures [Pa] of two masses [kg]. Equation (3)."""
    shape: Bladders = plant.shape
    return linear_pressures(plant, bladder_1(shape, angle), bladder_2(shape, angle), mass_1, mass_2)


def torque(plant: ShapedPlant, angle: float, pressure_1: float, pressure_2: float) -> float:
    """Torque [N m] of two absolute pressures [Pa], and of the fabric."""
    shape: Bladders = plant.shape
    active = linear_torque(plant, bladder_1(shape, angle), bladder_2(shape, angle), pressure_1, pressure_2)
    return active - shape.stiffness * (angle - shape.rest_angle)


def tube_of(radius: float, length: float, straight: float, dead_volume: float) -> Tube:
    """A tube of a radius and a length [m]."""
    section = math.pi * radius * radius
    return Tube(full=section * length, wedge=2.0 * section * radius, straight=straight, dead_volume=dead_volume)


def prepare(settings: Mapping[str, float], stops: Range) -> Bladders:
    """Numbers of the bladders."""
    length = settings["tube_length"]
    return Bladders(
        tube_1=tube_of(settings["radius_1"], length, settings["straight_angle_1"], stops.dead_volume_1),
        tube_2=tube_of(settings["radius_2"], length, settings["straight_angle_2"], stops.dead_volume_2),
        stretch=settings["stretch"],
        stiffness=settings["passive_stiffness"],
        rest_angle=settings["rest_angle"],
    )


def problem(settings: Mapping[str, float], stops: Range) -> str:
    """A bladder that is bent the other way between the stops, folded flat, or too short for its fold."""
    folds = {
        "1": [settings["straight_angle_1"] - angle for angle in (stops.angle_min, stops.angle_max)],
        "2": [angle - settings["straight_angle_2"] for angle in (stops.angle_min, stops.angle_max)],
    }
    for number, ends in folds.items():
        radius = settings[f"radius_{number}"]
        if radius == 0.0:
            continue
        if min(ends) < 0.0 or max(ends) > LARGEST_FOLD:
            low, high = (math.degrees(fold) for fold in sorted(ends))
            return (
                f"bladder {number} is folded by {low:.4g} to {high:.4g} deg between the stops, and 0 to "
                f"{math.degrees(LARGEST_FOLD):.0f} are allowed: change straight_angle_{number} or the stops"
            )
        needed = 4.0 * radius * math.tan(0.5 * max(ends))
        if settings["tube_length"] <= needed:
            return f"tube_length must be above {needed:.4g} m, so that bladder {number} is longer than its fold"
    return ""


KIND = ActuatorKind(
    name="bladder",
    summary="One or two fabric bladders over the joint, which unfold when they are inflated.",
    quantities=(
        Quantity("radius_1", "m", "radius of bladder 1", minimum=1.0e-3, maximum=0.5),
        Quantity("radius_2", "m", "radius of bladder 2, 0 for none", 0.0, 0.0, 0.5),
        Quantity("tube_length", "m", "length of each bladder, folded in its middle", minimum=1.0e-2, maximum=5.0),
        Quantity("straight_angle_1", "rad", "angle at which bladder 1 is straight", minimum=-10.0, maximum=10.0),
        Quantity("straight_angle_2", "rad", "angle at which bladder 2 is straight", 0.0, -10.0, 10.0),
        Quantity("stretch", "1/Pa", "share by which a volume grows per gauge pressure", 0.0, 0.0, 1.0e-4),
        Quantity("passive_stiffness", "N m/rad", "torque of the fabric per angle from rest", 0.0, 0.0, 1.0e4),
        Quantity("rest_angle", "rad", "angle at which the fabric gives no torque", 0.0, -10.0, 10.0),
    ),
    model=ActuatorModel(Bladders, prepare, chambers, pressures, torque),
    problem=problem,
)
