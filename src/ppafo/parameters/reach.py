"""Static torque limits of an actuator at an angle, from its torque function.

At the upper limit chamber 1 is at its supply pressure and chamber 2 is vented, at the lower limit the reverse. With a
vacuum supply, chamber 2 raises the torque and chamber 1 lowers it.
"""

import math
from collections.abc import Callable
from typing import Any

from ppafo.model.catalog import ACTUATORS
from ppafo.parameters.device import Device
from ppafo.parameters.graph import PRESSURE_PATH, SECOND_PRESSURE_PATH
from ppafo.parameters.plant import plant_parameters

HIGHEST_PRESSURE = 1.6e6
"""Highest supply pressure in the search [Pa gauge]: the usual maximum of pneumatic parts."""
_HALVINGS = 60
"""Number of bisection steps, enough to reduce any bracket to rounding error."""
_LOWEST_PRESSURE = 1.0e3
"""Lowest absolute pressure of a vacuum in the search [Pa]: the lower limit in a parameter set."""

StaticTorque = Callable[[float, float, float], float]
"""Static torque [N m] as a function of angle [rad] and absolute pressures of chambers 1 and 2 [Pa]."""


def static_torque(device: Device) -> StaticTorque:
    """Return the static torque function of a device, for a single run."""
    torque = ACTUATORS[device.actuator.kind].model.torque
    plant = plant_parameters(device)
    return lambda angle, pressure_1, pressure_2: float(torque(plant, angle, pressure_1, pressure_2))


def torque_reach(device: Device, angle: float, torque: StaticTorque | None = None) -> tuple[float, float]:
    """Return lowest and highest static torque [N m] of a device at an angle [rad].

    ``torque`` is the ``static_torque`` of the device, for repeated calls.
    """
    own = torque or static_torque(device)
    at_lowest, at_highest = reaching_pressures(device)
    return own(angle, *at_lowest), own(angle, *at_highest)


def reaching_pressures(device: Device) -> tuple[tuple[Any, Any], tuple[Any, Any]]:
    """Return the pressures of both chambers [Pa absolute] at the lowest and highest torque; arrays (runs,) too."""
    highest_1, highest_2 = device.highest_pressures
    vented = device.lowest_pressure
    of_1 = (highest_1, vented)
    of_2 = (vented, highest_2)
    return (of_1, of_2) if device.supply.is_vacuum else (of_2, of_1)


def supply_that_moves(device: Device, upwards: bool) -> str:
    """Return the path of the supply pressure that raises the torque, or lowers it if ``upwards`` is False."""
    return PRESSURE_PATH if upwards != device.supply.is_vacuum else SECOND_PRESSURE_PATH


def supply_for(device: Device, angle: float, torque: float) -> float | None:
    """Return the supply pressure [Pa absolute] for a static torque [N m] at an angle [rad].

    Chamber 1 raises the torque above the torque of the vented actuator, chamber 2 lowers it; with a vacuum the reverse.
    None if no supply up to ``HIGHEST_PRESSURE``, or no vacuum, gives the torque.
    """
    own = static_torque(device)
    vented = float(device.lowest_pressure)
    room = float(device.supply.atmospheric_pressure)
    most = device.valve.settings.get("highest_pressure", math.inf)
    sign = 1.0 if torque > own(angle, vented, vented) else -1.0
    is_first = supply_that_moves(device, sign > 0.0) == PRESSURE_PATH

    def is_enough(gauge: float) -> bool:
        # A regulator fills to the highest pressure that it can be set to, whatever its supply.
        full = min(room + gauge, float(most))
        return sign * own(angle, *((full, vented) if is_first else (vented, full))) >= sign * torque

    farthest = _LOWEST_PRESSURE - room if device.supply.is_vacuum else HIGHEST_PRESSURE
    if not is_enough(farthest):
        return None
    low = 0.0
    high = farthest
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if is_enough(middle) else (middle, high)
    return room + high
