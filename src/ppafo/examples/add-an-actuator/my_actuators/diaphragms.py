"""Two rolling diaphragms that pull on a pulley, one against the other; each gives a little under pressure."""

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


class Diaphragms(NamedTuple):
    """Volume per angle [m^3/rad], share by which volumes grow per pressure [1/Pa], stops [rad], dead volumes [m^3]."""

    per_angle: float
    stretch: float
    angle_min: float
    angle_max: float
    dead_volume_1: float
    dead_volume_2: float


def diaphragm_1(shape: Diaphragms, angle: float) -> LinearChamber:
    """The diaphragm that pulls towards larger angles [rad]."""
    volume = shape.per_angle * (angle - shape.angle_min)
    return stretching(shape.dead_volume_1, volume, shape.per_angle, shape.stretch)


def diaphragm_2(shape: Diaphragms, angle: float) -> LinearChamber:
    """The diaphragm that pulls back."""
    volume = shape.per_angle * (shape.angle_max - angle)
    return stretching(shape.dead_volume_2, volume, -shape.per_angle, shape.stretch)


def chambers(plant: ShapedPlant, angle: float, pressure_1: float, pressure_2: float) -> Chambers:
    """Volumes, and how they grow with the pressure."""
    shape: Diaphragms = plant.shape
    return linear_chambers(plant, diaphragm_1(shape, angle), diaphragm_2(shape, angle), pressure_1, pressure_2)


def pressures(plant: ShapedPlant, angle: float, mass_1: float, mass_2: float) -> tuple[float, float]:
    """The two pressures at which p V = m R T."""
    shape: Diaphragms = plant.shape
    return linear_pressures(plant, diaphragm_1(shape, angle), diaphragm_2(shape, angle), mass_1, mass_2)


def torque(plant: ShapedPlant, angle: float, pressure_1: float, pressure_2: float) -> float:
    """What both diaphragms give the shaft, positive in plantarflexion."""
    shape: Diaphragms = plant.shape
    return linear_torque(plant, diaphragm_1(shape, angle), diaphragm_2(shape, angle), pressure_1, pressure_2)


def prepare(settings: Mapping[str, float], stops: Range) -> Diaphragms:
    """Numbers of the actuator."""
    return Diaphragms(
        per_angle=settings["area"] * settings["pulley_radius"],
        stretch=settings["stretch"],
        angle_min=stops.angle_min,
        angle_max=stops.angle_max,
        dead_volume_1=stops.dead_volume_1,
        dead_volume_2=stops.dead_volume_2,
    )


def problem(settings: Mapping[str, float], stops: Range) -> str:
    """Two numbers that do not fit together, in words; here any do."""
    return ""


KIND = ActuatorKind(
    name="diaphragms",
    summary="Two rolling diaphragms that pull on a pulley, one against the other.",
    quantities=(
        Quantity("area", "m^2", "effective area of a diaphragm", minimum=1.0e-6, maximum=1.0),
        Quantity("pulley_radius", "m", "radius of the pulley", minimum=1.0e-3, maximum=1.0),
        Quantity("stretch", "1/Pa", "share by which a volume grows per gauge pressure", 0.0, 0.0, 1.0e-4),
    ),
    model=ActuatorModel(Diaphragms, prepare, chambers, pressures, torque),
    problem=problem,
)
