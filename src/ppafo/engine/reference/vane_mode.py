"""Stick, slip and stops as the modes between which the reference solver switches."""

from typing import NamedTuple

from ppafo.model.plant import PlantParameters, chamber_pressures, driving_torque
from ppafo.model.vane import holds_still

SLOWEST_REBOUND = 1.0e-7


class Roots(NamedTuple):
    """Two root functions whose zeros end a mode; positive while the mode lasts."""

    first: float
    second: float


def torque_on_vane(plant: PlantParameters, angle: float, mass_1: float, mass_2: float) -> float:
    """Driving torque [N m] from the masses in the chambers."""
    pressure_1, pressure_2 = chamber_pressures(plant, angle, mass_1, mass_2)
    return driving_torque(plant, angle, pressure_1, pressure_2)


def mode_at_rest(plant: PlantParameters, angle: float, torque: float) -> float:
    """Direction in which a vane at ``angle`` [rad] sets off under ``torque`` [N m]: 1, -1, or 0 where it is held."""
    if holds_still(torque, plant.static_torque, angle <= plant.angle_min, angle >= plant.angle_max):
        return 0.0
    return 1.0 if torque > 0.0 else -1.0


def roots_at_rest(plant: PlantParameters, angle: float, torque: float) -> Roots:
    """Distance of the torque from breakaway in both directions [N m]; a stop holds against any torque."""
    towards_upper = 1.0 if angle >= plant.angle_max else plant.static_torque - torque
    towards_lower = 1.0 if angle <= plant.angle_min else plant.static_torque + torque
    return Roots(towards_upper, towards_lower)


def roots_sliding(plant: PlantParameters, angle: float, angular_velocity: float, way: float) -> Roots:
    """Speed along the way [rad/s] and distance from the stop ahead [rad]."""
    ahead = plant.angle_max - angle if way > 0.0 else angle - plant.angle_min
    return Roots(way * angular_velocity, ahead)


def after_stop(plant: PlantParameters, angular_velocity: float) -> float:
    """Angular velocity [rad/s] after an impact on a stop; 0 where the rebound is not worth following."""
    rebound = -plant.restitution * angular_velocity
    return rebound if abs(rebound) > SLOWEST_REBOUND else 0.0
