"""The plant in continuous time, as solvers and linear models share it: real gas, an unconstrained vane, its modes.

A vane that sticks, slides or stands at a stop is in modes, which root functions end.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from ppafo.engine.led_leg import torque_of_leg
from ppafo.engine.linking import python_place
from ppafo.engine.run import Run
from ppafo.engine.scheme.real_gas import content_rate
from ppafo.model.plant import (
    PlantParameters,
    chamber_volumes,
    driving_torque,
    gravity_torque,
    holds_still,
    loaded,
    net_driving_torque,
    vane_acceleration,
)
from ppafo.model.ports import friction_in_motion, rebound

SAME_TIME = 1.0e-12
"""Two instants [s] that are as good as one."""
SLOWEST_REBOUND = 1.0e-7
"""Angular velocity [rad/s] below which a rebound is not worth following."""


def real_gas_rates(
    plant: PlantParameters,
    angle: float,
    angular_velocity: float,
    flow_1: float,
    flow_2: float,
    content_1: float,
    content_2: float,
) -> tuple[float, float]:
    """Rates of both contents [kg/s] of gas that is not ideal, from the flows into its chambers. Equation (3)."""
    volume_1, volume_2 = chamber_volumes(plant, angle)
    # The chambers are opposite: what one gains in volume the other loses.
    growth = plant.displacement_per_radian * angular_velocity
    return (
        content_rate(content_1, volume_1, growth, flow_1),
        content_rate(content_2, volume_2, -growth, flow_2),
    )


def free_motion(
    plant: PlantParameters,
    angle: float,
    angular_velocity: float,
    pressure_1: float,
    pressure_2: float,
    added_torque: float,
    way: float,
) -> tuple[float, float]:
    """Slopes of angle [rad/s] and angular velocity [rad/s^2] of a vane that slides towards ``way`` (0: it sticks).

    Equations (1), (2), (10). ``added_torque`` [N m] is the leg's, beside the plant's own.
    """
    if way == 0.0:
        return 0.0, 0.0
    torque = driving_torque(plant, angle, pressure_1, pressure_2) + added_torque
    friction = way * friction_in_motion(plant.dynamic_torque, angular_velocity, pressure_1, pressure_2)
    return angular_velocity, vane_acceleration(
        torque, friction, plant.viscous_damping, plant.inertia, angle, angular_velocity
    )


def torque_at_rest(run: Run) -> Callable[[Mapping[str, Any], float, float, float, float], float]:
    """What drives the joint of a run at rest before friction [N m], with its actuator, its loads and its leg.

    The function takes states of effects by name, time [s], angle [rad] and two absolute pressures [Pa]. Equation (1).
    """
    plant, program = run.plant, run.program
    taken = python_place(loaded, program.effects, run.effects)

    def torque(states: Mapping[str, Any], time: float, angle: float, pressure_1: float, pressure_2: float) -> float:
        actuator = program.actuator.torque(plant, angle, pressure_1, pressure_2)
        alone = net_driving_torque(actuator, gravity_torque(angle, plant.gravity_torque), plant.external_torque)
        left: float = alone if taken is None else taken(states, alone, angle)
        return left if run.leg is None else left + torque_of_leg(program, run.leg, time, angle)

    return torque


class Roots(NamedTuple):
    """Two root functions whose zeros end a mode; positive while the mode lasts."""

    first: float
    second: float


def mode_at_rest(plant: PlantParameters, angle: float, torque: float) -> float:
    """Direction in which a vane at ``angle`` [rad] sets off under ``torque`` [N m]: 1, -1, or 0 where it sticks."""
    if holds_still(torque, plant.static_torque, angle <= plant.angle_min, angle >= plant.angle_max):
        return 0.0
    return 1.0 if torque > 0.0 else -1.0


def roots_at_rest(plant: PlantParameters, angle: float, torque: float) -> Roots:
    """Distance of the torque from breakaway in both directions [N m]; a stop holds against any torque."""
    # A constant has no zero: the solver never leaves the mode through a stop that holds.
    towards_upper = 1.0 if angle >= plant.angle_max else plant.static_torque - torque
    towards_lower = 1.0 if angle <= plant.angle_min else plant.static_torque + torque
    return Roots(towards_upper, towards_lower)


def roots_sliding(plant: PlantParameters, angle: float, angular_velocity: float, way: float) -> Roots:
    """Speed along the way [rad/s] and distance from the stop ahead [rad]."""
    ahead = plant.angle_max - angle if way > 0.0 else angle - plant.angle_min
    return Roots(way * angular_velocity, ahead)


def after_stop(run: Run, states: Mapping[str, Any], angular_velocity: float) -> float:
    """Angular velocity [rad/s] after an impact on a stop; 0 where the rebound is not worth following."""
    law = python_place(rebound, run.program.effects, run.effects)
    thrown_back = 0.0 if law is None else float(law(states, angular_velocity))
    # Rebounds follow in ever shorter times: without a lowest speed the solver would restart without end.
    return thrown_back if abs(thrown_back) > SLOWEST_REBOUND else 0.0
