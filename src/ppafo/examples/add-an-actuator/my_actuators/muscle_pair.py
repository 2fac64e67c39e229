"""Two McKibben muscles on a pulley, one against the other: inflated, each grows thick and short.

The volume of a braided muscle of length L is the volume of a cylinder whose surface is the braid,
V = L (b^2 - L^2)/(4 pi n^2) with threads of length b wound n times, and its force is -p dV/dL: Chou and Hannaford,
Measurement and modeling of McKibben pneumatic artificial muscles, IEEE Transactions on Robotics and Automation 12(1),
1996. Muscle 1 drives plantarflexion. What rubber and braid lose is friction of the set, what rubber stores its passive
stiffness.
"""

import math
from typing import Annotated, NamedTuple

from ppafo.model.actuators.kind import ActuatorKind, ActuatorModel, Chambers, Range, ShapedPlant
from ppafo.model.actuators.linear_chambers import (
    LinearChamber,
    linear_chambers,
    linear_pressures,
    linear_torque,
    rigid,
)
from ppafo.model.declaration import Number

FULLY_SHORT = 1.0 / math.sqrt(3.0)
"""Length over thread length at which a muscle has its largest volume and pulls no more."""


class MusclePair(NamedTuple):
    """Square of the thread length [m^2], one over 4 pi n^2 [-], length of both at the neutral angle [m], pulley [m].

    Then the neutral angle [rad], passive stiffness about it [N m/rad], dead volumes [m^3].
    """

    thread_square: float
    per_turns: float
    length: float
    pulley: float
    neutral_angle: float
    stiffness: float
    dead_volume_1: float
    dead_volume_2: float


def muscle(shape: MusclePair, length: float, pull: float, dead_volume: float) -> LinearChamber:
    """A muscle of a length [m] that ``pull`` [m/rad] lengthens: its pulley, below 0 where the angle shortens it."""
    square = length * length
    volume = dead_volume + shape.per_turns * length * (shape.thread_square - square)
    return rigid(volume, shape.per_turns * (shape.thread_square - 3.0 * square) * pull)


def muscle_1(shape: MusclePair, angle: float) -> LinearChamber:
    """The muscle that is shorter at a larger angle [rad]."""
    length = shape.length - shape.pulley * (angle - shape.neutral_angle)
    return muscle(shape, length, -shape.pulley, shape.dead_volume_1)


def muscle_2(shape: MusclePair, angle: float) -> LinearChamber:
    """The muscle that is longer at a larger angle [rad]."""
    length = shape.length + shape.pulley * (angle - shape.neutral_angle)
    return muscle(shape, length, shape.pulley, shape.dead_volume_2)


def chambers(plant: ShapedPlant, angle: float, pressure_1: float, pressure_2: float) -> Chambers:
    """Both muscles at an angle [rad]."""
    shape: MusclePair = plant.shape
    return linear_chambers(plant, muscle_1(shape, angle), muscle_2(shape, angle), pressure_1, pressure_2)


def pressures(plant: ShapedPlant, angle: float, mass_1: float, mass_2: float) -> tuple[float, float]:
    """Absolute pressures [Pa] of two masses [kg]. Equation (3)."""
    shape: MusclePair = plant.shape
    return linear_pressures(plant, muscle_1(shape, angle), muscle_2(shape, angle), mass_1, mass_2)


def torque(plant: ShapedPlant, angle: float, pressure_1: float, pressure_2: float) -> float:
    """Torque [N m] of two absolute pressures [Pa], and of the rubber."""
    shape: MusclePair = plant.shape
    active = linear_torque(plant, muscle_1(shape, angle), muscle_2(shape, angle), pressure_1, pressure_2)
    return active - shape.stiffness * (angle - shape.neutral_angle)


class MuscleSettings(NamedTuple):
    """Threads, length and rubber of both muscles, and the pulley."""

    thread_length: Annotated[float, Number("m", "length of a thread of the braid", minimum=1.0e-2, maximum=5.0)]
    turns: Annotated[float, Number("", "turns of a thread around the muscle", minimum=0.05, maximum=100.0)]
    muscle_length: Annotated[
        float, Number("m", "length of both muscles at the neutral angle", minimum=1.0e-2, maximum=5.0)
    ]
    pulley_radius: Annotated[float, Number("m", "radius of the pulley", minimum=1.0e-3, maximum=1.0)]
    neutral_angle: Annotated[
        float, Number("rad", "angle at which both muscles are as long", minimum=-10.0, maximum=10.0)
    ]
    passive_stiffness: Annotated[
        float, Number("N m/rad", "torque of the rubber per angle from neutral", 0.0, 0.0, 1.0e4)
    ]


def prepare(settings: MuscleSettings, stops: Range) -> MusclePair:
    """Numbers of the pair."""
    thread = settings.thread_length
    turns = settings.turns
    return MusclePair(
        thread_square=thread * thread,
        per_turns=1.0 / (4.0 * math.pi * turns * turns),
        length=settings.muscle_length,
        pulley=settings.pulley_radius,
        neutral_angle=settings.neutral_angle,
        stiffness=settings.passive_stiffness,
        dead_volume_1=stops.dead_volume_1,
        dead_volume_2=stops.dead_volume_2,
    )


def problem(settings: MuscleSettings, stops: Range) -> str:
    """A muscle that would be longer than its threads, or shorter than where it pulls, between the stops."""
    farthest = max(abs(angle - settings.neutral_angle) for angle in (stops.angle_min, stops.angle_max))
    length = settings.muscle_length
    way = settings.pulley_radius * farthest
    thread = settings.thread_length
    if FULLY_SHORT * thread < length - way and length + way < thread:
        return ""
    return (
        f"a muscle is {length - way:.4g} to {length + way:.4g} m long between the stops, and pulls between "
        f"{FULLY_SHORT * thread:.4g} m (0.577 of thread_length) and thread_length = {thread:.4g} m: change "
        "muscle_length, pulley_radius or the stops"
    )


KIND = ActuatorKind(
    name="muscle_pair",
    summary="Two McKibben muscles on a pulley, one against the other.",
    settings=MuscleSettings,
    model=ActuatorModel(MusclePair, prepare, chambers, pressures, torque),
    problem=problem,
)
