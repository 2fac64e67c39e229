"""How quickly a torque or a pressure changes at an angle, against where the gains of a law take the chambers."""

from ppafo.model.catalog import ACTUATORS
from ppafo.model.controlled import ANGLE, TORQUE
from ppafo.parameters.device import Actuator, Device
from ppafo.parameters.reach import still
from ppafo.simulation.mean_chambers import LEAST_GAUGE, inside_stops


def place_of_gains(actuator: Actuator) -> float:
    """Return the angle [rad] at which the gains of a law take the chambers of an actuator."""
    ends = float(actuator.angle_min), float(actuator.angle_max)
    return inside_stops(*ends) if ACTUATORS[actuator.kind].model.shape is None else 0.5 * (ends[0] + ends[1])


def quicker_at(device: Device, angle: float, controlled: str) -> float:
    """Return how many times quicker a torque or a pressure changes at an angle [rad] than the gains take it to [-]."""
    here, there = (_per_flow(device, place, controlled) for place in (angle, place_of_gains(device.actuator)))
    return here / there if there > 0.0 else 1.0


def _per_flow(device: Device, angle: float, controlled: str) -> float:
    supply = device.supply
    room = float(supply.atmospheric_pressure)
    own = still(device.actuator, room)
    full_1, full_2 = float(supply.pressure), float(supply.dorsiflexion_pressure)
    gauge_1, gauge_2 = max(full_1 - room, LEAST_GAUGE), max(full_2 - room, LEAST_GAUGE)
    half_1, half_2 = room + 0.5 * gauge_1, room + 0.5 * gauge_2
    filled, vented = own.chambers(angle, half_1, half_2), own.torque(angle, room, room)
    volume_1 = filled.volume_1 + half_1 * filled.compliance_1
    volume_2 = filled.volume_2 + half_2 * filled.compliance_2
    by_1 = abs(own.torque(angle, room + gauge_1, room) - vented) / gauge_1
    by_2 = abs(own.torque(angle, room, room + gauge_2) - vented) / gauge_2
    if controlled not in (TORQUE, ANGLE):
        by_1, by_2 = float(controlled != "pressure_2"), float(controlled != "pressure_1")
    return max(by_1 * full_1 / volume_1, by_2 * full_2 / volume_2)
