"""Pressures, volumes and torque of any actuator from Python, of floats or of arrays."""

from collections.abc import Callable
from typing import Any

from ppafo.engine.rows import leaves, rebuilt
from ppafo.model.actuators.kind import ActuatorModel
from ppafo.model.actuators.vane import MODEL as VANE
from ppafo.model.columns import over_runs
from ppafo.model.sensors import Measurement
from ppafo.model.vane import gravity_torque, net_driving_torque


def _of_plant(actuator: ActuatorModel, function: Callable[..., Any], plant: Any, *given: Any) -> Any:
    """What a function of a model gives, of numbers any of which may be arrays of one length."""
    if actuator is VANE:
        return function(plant, *given)
    flat = leaves(plant)

    def alone(*values: float) -> Any:
        return function(rebuilt(actuator.plant, values[: len(flat)]), *values[len(flat) :])

    return over_runs(alone, *flat, *given)


def pressures_of(actuator: ActuatorModel, plant: Any, angle: Any, mass_1: Any, mass_2: Any) -> tuple[Any, Any]:
    """Absolute pressures [Pa] of both chambers at an angle [rad] with two masses [kg]. Equation (3)."""
    pressure_1, pressure_2 = _of_plant(actuator, actuator.pressures, plant, angle, mass_1, mass_2)
    return pressure_1, pressure_2


def volumes_of(actuator: ActuatorModel, plant: Any, angle: Any, pressure_1: Any, pressure_2: Any) -> tuple[Any, Any]:
    """Volumes of both chambers [m^3] at an angle [rad] and two absolute pressures [Pa]."""
    chambers = _of_plant(actuator, actuator.chambers, plant, angle, pressure_1, pressure_2)
    return chambers.volume_1, chambers.volume_2


def torque_of(actuator: ActuatorModel, plant: Any, angle: Any, pressure_1: Any, pressure_2: Any) -> Any:
    """Torque [N m] at an angle [rad] and two absolute pressures [Pa], positive in plantarflexion."""
    return _of_plant(actuator, actuator.torque, plant, angle, pressure_1, pressure_2)


def seen_with_torque(actuator: ActuatorModel, plant: Any, seen: Measurement) -> Measurement:
    """What the sensors show, with the torque that the actuator would have at the angle and pressures shown."""
    return seen._replace(torque=actuator.torque(plant, seen.angle, seen.pressure_1, seen.pressure_2))


def driving_torque_of(actuator: ActuatorModel, plant: Any, angle: float, mass_1: float, mass_2: float) -> float:
    """Torque before friction and damping [N m] at an angle [rad] with two masses [kg]. Equation (1)."""
    torque = actuator.torque(plant, angle, *actuator.pressures(plant, angle, mass_1, mass_2))
    return net_driving_torque(torque, gravity_torque(angle, plant.gravity_torque), plant.external_torque)
