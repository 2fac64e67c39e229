"""The vane of the paper as a package of others would write it: it calls nothing of the built-in one."""

from typing import Annotated, NamedTuple

from ppafo.model.actuators.kind import ActuatorKind, ActuatorModel, Chambers, Range, ShapedPlant
from ppafo.model.declaration import Number


class Chamber(NamedTuple):
    """Displacement [m^3/rad], both stops [rad] and dead volumes [m^3]."""

    displacement: float
    lower: float
    upper: float
    dead_1: float
    dead_2: float


def chambers(plant: ShapedPlant, angle: float, pressure_1: float, pressure_2: float) -> Chambers:
    """Both chambers at an angle [rad]."""
    shape: Chamber = plant.shape
    return Chambers(
        volume_1=shape.dead_1 + shape.displacement * (angle - shape.lower),
        volume_2=shape.dead_2 + shape.displacement * (shape.upper - angle),
        compliance_1=0.0,
        compliance_2=0.0,
    )


def pressures(plant: ShapedPlant, angle: float, mass_1: float, mass_2: float) -> tuple[float, float]:
    """Absolute pressures [Pa] of two masses [kg]."""
    shape: Chamber = plant.shape
    volume_1 = shape.dead_1 + shape.displacement * (angle - shape.lower)
    volume_2 = shape.dead_2 + shape.displacement * (shape.upper - angle)
    return mass_1 * plant.gas_product / volume_1, mass_2 * plant.gas_product / volume_2


def torque(plant: ShapedPlant, angle: float, pressure_1: float, pressure_2: float) -> float:
    """Torque [N m] of two absolute pressures [Pa]."""
    shape: Chamber = plant.shape
    return shape.displacement * (pressure_1 - pressure_2)


class Settings(NamedTuple):
    """Displacement of the vane."""

    displacement: Annotated[float, Number("m^3/rad", "volume per radian", minimum=1.0e-9, maximum=1.0)]


def prepare(settings: Settings, stops: Range) -> Chamber:
    """Numbers of the vane."""
    return Chamber(
        displacement=settings.displacement,
        lower=stops.angle_min,
        upper=stops.angle_max,
        dead_1=stops.dead_volume_1,
        dead_2=stops.dead_volume_2,
    )


KIND = ActuatorKind(
    name="vane_of_others",
    summary="A vane that another package wrote.",
    settings=Settings,
    model=ActuatorModel(Chamber, prepare, chambers, pressures, torque),
)
