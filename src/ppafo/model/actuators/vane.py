"""Vane of the paper: two chambers whose volumes are linear in the angle. Equations (2), (4), (5).

By virtual work the displacement per radian equals the torque constant, and is derived from it by default. A parameter
set may give another value, as reported: then the shaft does not receive the work of the gas (docs/decisions/0014).
"""

from typing import Annotated, Any, NamedTuple

from ppafo.model.actuators.kind import ActuatorKind, ActuatorModel, Chambers, Range
from ppafo.model.declaration import Number
from ppafo.model.plant import PlantParameters, chamber_pressures, chamber_volumes, joint_torque

SMALLEST_VOLUME = 1e-18
"""Smallest volume [m^3], a cube of a micrometre: a smaller value is a typing error, and dividing by it may overflow."""


def chambers(plant: PlantParameters, angle: float, pressure_1: float, pressure_2: float) -> Chambers:
    """Both chambers, which are rigid. Equations (4), (5)."""
    volume_1, volume_2 = chamber_volumes(plant, angle)
    return Chambers(volume_1=volume_1, volume_2=volume_2, compliance_1=0.0, compliance_2=0.0)


def prepare(_settings: Any, _stops: Range) -> None:
    """Return None: the geometry of a vane is contained in the plant parameters."""


MODEL = ActuatorModel(None, prepare, chambers, chamber_pressures, joint_torque, gives=False, has_torque_constant=True)


class VaneSettings(NamedTuple):
    """Settings of a vane: torque per pressure, and displacement per radian."""

    torque_constant: Annotated[float, Number("m^3", "torque per pressure difference", minimum=SMALLEST_VOLUME)]
    displacement_per_radian: Annotated[float, Number("m^3/rad", "displacement per radian", minimum=SMALLEST_VOLUME)]


KIND = ActuatorKind(
    name="vane",
    summary="A vane between two chambers whose volumes run linearly with the angle.",
    settings=VaneSettings,
    model=MODEL,
)
