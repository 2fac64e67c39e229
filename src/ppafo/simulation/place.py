"""Rate of a torque or pressure loop at an angle, relative to the angle at which the gains of a law are computed."""

from ppafo.model.catalog import ACTUATORS
from ppafo.model.controlled import ANGLE, TORQUE
from ppafo.parameters.device import Device
from ppafo.parameters.plant import plant_parameters
from ppafo.parameters.reach import static_torque
from ppafo.simulation.mean_chambers import gauge_of, usual_place


def quicker_at(device: Device, angle: float, controlled: str) -> float:
    """Rate of a torque or pressure at an angle [rad] over its rate where the gains are computed [-]."""
    here, there = (
        _rate_per_flow(device, place, controlled)
        for place in (angle, usual_place(float(device.actuator.angle_min), float(device.actuator.angle_max)))
    )
    return here / there if there > 0.0 else 1.0


def _rate_per_flow(device: Device, angle: float, controlled: str) -> float:
    """Rate of change per volume flow at full opening, [N m/m^3] or of a pressure [Pa/m^3], the larger chamber's."""
    supply, plant, torque = device.supply, plant_parameters(device), static_torque(device)
    room = float(supply.atmospheric_pressure)
    full_1, full_2 = float(supply.pressure), float(supply.dorsiflexion_pressure)
    gauge_1, gauge_2 = gauge_of(full_1, room), gauge_of(full_2, room)
    half_1, half_2 = room + 0.5 * gauge_1, room + 0.5 * gauge_2
    filled = ACTUATORS[device.actuator.kind].model.chambers(plant, angle, half_1, half_2)
    volume_1 = float(filled.volume_1 + half_1 * filled.compliance_1)
    volume_2 = float(filled.volume_2 + half_2 * filled.compliance_2)
    if controlled in (TORQUE, ANGLE):
        vented = torque(angle, room, room)
        by_1 = abs((torque(angle, room + gauge_1, room) - vented) / gauge_1)
        by_2 = abs((torque(angle, room, room + gauge_2) - vented) / gauge_2)
    else:
        by_1, by_2 = float(controlled != "pressure_2"), float(controlled != "pressure_1")
    # What fills a chamber of a suction device is the room.
    return max(by_1 * max(full_1, room) / volume_1, by_2 * max(full_2, room) / volume_2)
