"""Chamber volumes assumed by the observer of a walk for actuators other than the vane.

The settings of the observer give the assumed dead volumes and the assumed mean volume change with angle.
"""

from typing import Any

from ppafo.control.walking.nominal_device import NominalDevice, believed_volumes, mean_volumes
from ppafo.engine.scheme.motion import clamp_angle
from ppafo.model.actuators.kind import Chambers
from ppafo.model.binding import made_of
from ppafo.model.plant import ActuatorFunctions, PlantParameters


def as_believed(plant: PlantParameters, nominal: NominalDevice, filled: Chambers) -> tuple[float, float]:
    """Assumed volumes [m^3] of both chambers, with the dead volumes and the displacement of the observer settings."""
    scale = nominal.nominal_displacement_per_radian / plant.displacement_per_radian
    # A reading that no chamber can have, as of a sensor that failed, must not leave a volume of nothing.
    return (
        nominal.nominal_dead_volume_1 + scale * max(filled.volume_1 - plant.dead_volume_1, 0.0),
        nominal.nominal_dead_volume_2 + scale * max(filled.volume_2 - plant.dead_volume_2, 0.0),
    )


def kind_volumes(
    plant: PlantParameters,
    nominal: NominalDevice,
    angle: float,
    pressure_1: float,
    pressure_2: float,
    *,
    parts: ActuatorFunctions,
) -> tuple[float, float]:
    """Assumed volumes of both chambers [m^3] at a measured angle [rad], limited to the stops, and pressures [Pa]."""
    return as_believed(plant, nominal, parts.chambers(plant, clamp_angle(plant, angle), pressure_1, pressure_2))


def kind_mean_volumes(
    plant: PlantParameters, nominal: NominalDevice, pressure_1: float, pressure_2: float, *, parts: ActuatorFunctions
) -> tuple[float, float]:
    """Change of gas content with pressure [m^3] of both chambers at mid-range, for two measured pressures [Pa]."""
    middle = parts.chambers(plant, 0.5 * (plant.angle_min + plant.angle_max), pressure_1, pressure_2)
    volume_1, volume_2 = as_believed(plant, nominal, middle)
    # What an error of a pressure is in content: p V changes by V, and by what the chamber gives.
    return volume_1 + pressure_1 * middle.compliance_1, volume_2 + pressure_2 * middle.compliance_2


def chambers_of_observer(functions: ActuatorFunctions) -> dict[Any, Any]:
    """Functions of an actuator's chambers for the observer; each function takes the row ``plant`` first."""
    return {
        believed_volumes: made_of(kind_volumes, "kind_volumes", functions),
        mean_volumes: made_of(kind_mean_volumes, "kind_mean_volumes", functions),
    }
