"""Torque that an actuator gives at most, and what a reference requests beyond that."""

import numpy as np

from ppafo.engine.scheme.actuators import torque_of
from ppafo.metrics.metric import Floats
from ppafo.model.catalog import ACTUATORS
from ppafo.model.controlled import TORQUE
from ppafo.parameters.plant import plant_parameters
from ppafo.simulation.profiles import profile_bounds
from ppafo.simulation.scenario import Scenario

_ANGLES = 9
"""Number of angles between the stops at which the torque of a moving joint is evaluated."""


def shortfall(scenario: Scenario) -> Floats:
    """Largest reference minus the available torque [N m] in each run (runs,); 0 if the torque suffices."""
    if scenario.controlled != TORQUE:
        return np.zeros(1)
    lowest, highest = available_torque(scenario)
    least, most = profile_bounds(scenario.reference)
    return np.atleast_1d(np.maximum(0.0, np.maximum(most - highest, lowest - least)))


def available_torque(scenario: Scenario) -> tuple[Floats, Floats]:
    """Lowest and highest torque of the actuator [N m] in each run (runs,).

    One chamber is at its supply and the other vented, independent of the controller. For a moving joint the angle with
    the largest torque counts.
    """
    device = scenario.device
    actuator, supply, locked = device.actuator, device.supply, scenario.motion.locked_angle
    fractions = (0.0,) if locked is not None else np.linspace(0.0, 1.0, _ANGLES).tolist()
    first, travel = (actuator.angle_min, actuator.angle_max - actuator.angle_min) if locked is None else (locked, 0.0)
    model, plant, vented = ACTUATORS[actuator.kind].model, plant_parameters(device), supply.atmospheric_pressure
    angles = [first + fraction * travel for fraction in fractions]
    highest = [torque_of(model, plant, angle, supply.pressure, vented) for angle in angles]
    lowest = [torque_of(model, plant, angle, vented, supply.dorsiflexion_pressure) for angle in angles]
    if supply.is_vacuum:
        highest, lowest = lowest, highest
    return np.min(lowest, axis=0), np.max(highest, axis=0)
