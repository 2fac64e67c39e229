"""Which torque an actuator of any kind reaches at an angle, by the kind's own functions.

One chamber is at its supply then and the other one at the atmosphere.
"""

from typing import Any, NamedTuple

from ppafo.model.actuators.kind import Range
from ppafo.model.catalog import ACTUATORS
from ppafo.model.declaration import quantities_of
from ppafo.parameters.device import Actuator, Device

MOST_PRESSURE = 1.0e8
"""Pa: beyond it no supply is looked for."""


class Still(NamedTuple):
    """A kind's functions of one actuator that stands still, ``torque(angle, p_1, p_2)`` and ``chambers`` of the same."""

    torque: Any
    chambers: Any


class _StillShape(NamedTuple):
    """What the functions of a kind may ask of their plant (``ShapedPlant``), for an actuator that stands still."""

    shape: Any
    atmospheric_pressure: float
    supply_pressure: float
    dorsiflexion_pressure: float
    gas_product: float = 1.0
    gravity_torque: float = 0.0
    external_torque: float = 0.0


class _StillVane(NamedTuple):
    """What a vane's functions ask of their plant."""

    torque_constant: float
    displacement_per_radian: float
    angle_min: float
    angle_max: float
    dead_volume_1: float
    dead_volume_2: float
    atmospheric_pressure: float
    gas_product: float = 1.0


def still(actuator: Actuator, atmosphere: float) -> Still:
    """Return the functions of an actuator in an atmosphere [Pa absolute]."""
    kind = ACTUATORS[actuator.kind]
    model = kind.model
    row: Any
    if model.shape is None:
        names = _StillVane._fields[:6]
        row = _StillVane(**{name: float(getattr(actuator, name)) for name in names}, atmospheric_pressure=atmosphere)
    else:
        settings = kind.settings(*(float(getattr(actuator, item.name)) for item in quantities_of(kind.settings)))
        ends = Range(*(float(getattr(actuator, name)) for name in Range._fields))
        table = () if actuator.table is None else (actuator.table,)
        row = _StillShape(model.prepare(settings, ends, *table), atmosphere, atmosphere, atmosphere)
    return Still(
        lambda angle, p_1, p_2: float(model.torque(row, angle, p_1, p_2)),
        lambda angle, p_1, p_2: model.chambers(row, angle, p_1, p_2),
    )


def torque_reach(device: Device, angle: float) -> tuple[float, float]:
    """Return the lowest and the highest torque [N m] of a device at an angle [rad]: one chamber full, one vented."""
    supply = device.supply
    room = supply.atmospheric_pressure
    own = still(device.actuator, room)
    return own.torque(angle, room, supply.dorsiflexion_pressure), own.torque(angle, supply.pressure, room)


def supply_for(device: Device, angle: float, torque: float) -> float | None:
    """Return the pressure [Pa absolute] of the chamber's supply with which a torque [N m] is reached at an angle.

    None where no pressure reaches it. Chamber 1 raises the torque, chamber 2 lowers it.
    """
    room = device.supply.atmospheric_pressure
    own, sign = still(device.actuator, room), 1.0 if torque > own_rest(device, angle) else -1.0

    def reached(gauge: float) -> float:
        full = room + gauge
        return sign * own.torque(angle, *((full, room) if sign > 0.0 else (room, full)))

    low, high = 0.0, 1.0e5
    while reached(high) < sign * torque:
        low, high = high, 2.0 * high
        if high > MOST_PRESSURE:
            return None
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if reached(middle) >= sign * torque else (middle, high)
    return room + high


def own_rest(device: Device, angle: float) -> float:
    """Return the torque [N m] of an actuator whose chambers are vented, at an angle [rad]."""
    room = device.supply.atmospheric_pressure
    return still(device.actuator, room).torque(angle, room, room)
