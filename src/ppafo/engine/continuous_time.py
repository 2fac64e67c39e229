"""Plant in continuous time for solvers and linear models: gas balance and unconstrained vane.

The flows are computed as in a step of the engine.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from ppafo.engine.in_python import in_program
from ppafo.engine.run import Run
from ppafo.engine.scheme.pneumatics import GasFlows, flow_rates, gas_flows
from ppafo.engine.scheme.thermal_gas import WarmChambers, WarmGas, thermal_flows, warm_chambers
from ppafo.model.plant import (
    ActuatorFunctions,
    Openings,
    PlantParameters,
    ThermalParameters,
    blended_port_flow,
    blended_ports,
    driving_torque,
    holds_still,
    net_torque,
    pressures_per_mass,
)
from ppafo.model.ports import friction_in_motion

NEAR = 1.0e-4
"""Half-width [rad] of the central difference of volumes with respect to the angle."""


class GasRates(NamedTuple):
    """Rates of both pressures [Pa/s] and temperatures [K/s], and flows from the source and to the atmosphere [kg/s]."""

    pressure_1: float
    pressure_2: float
    temperature_1: float
    temperature_2: float
    supplied: float
    vented: float


def flows_at(plant: PlantParameters, openings: Openings, pressure_1: float, pressure_2: float) -> GasFlows:
    """Flows [kg/s] through both ports and the leakage, for valve openings [-]. Equations (6) to (8)."""
    port_1, port_2 = blended_ports(plant, openings)
    return gas_flows(plant, pressure_1, pressure_2, port_1, port_2, blended_port_flow).flows


def chambers_in_motion(
    plant: PlantParameters, motion: tuple[float, float], pressures: tuple[float, float], *, parts: ActuatorFunctions
) -> WarmChambers:
    """Both chambers at an angle [rad] and rate [rad/s] and two absolute pressures [Pa]."""
    angle, angular_velocity = motion
    pressure_1, pressure_2 = pressures
    rate = angular_velocity / (2.0 * NEAR)
    return warm_chambers(plant, pressure_1, pressure_2, angle, angle - NEAR, angle + NEAR, rate, parts=parts)


def gas_rates(
    plant: PlantParameters,
    thermal: ThermalParameters | None,
    openings: Openings,
    motion: tuple[float, float],
    pressures: tuple[float, float],
    temperatures: tuple[float, float],
    *,
    parts: ActuatorFunctions,
) -> GasRates:
    """Rates of the gas at an angle [rad] and rate [rad/s], pressures [Pa] and temperatures [K]. Equations (3) to (9).

    Without ``thermal`` the gas is isothermal. The pressures follow from the time derivative of equation (3): they rise
    with the mass and fall with the volume, and the volume of a compliant chamber also changes with its pressure.
    """
    pressure_1, pressure_2 = pressures
    at = chambers_in_motion(plant, motion, pressures, parts=parts)
    per_mass_1, per_mass_2 = pressures_per_mass(plant.gas_product, at.volume_1, at.volume_2)
    flowing = flows_at(plant, openings, pressure_1, pressure_2)
    if thermal is None:
        flows = flow_rates(flowing)
        gained_1 = flows.mass_1
        gained_2 = flows.mass_2
        warming_1 = 0.0
        warming_2 = 0.0
    else:
        content_1 = pressure_1 / per_mass_1
        content_2 = pressure_2 / per_mass_2
        mass_1 = content_1 * thermal.temperature / temperatures[0]
        mass_2 = content_2 * thermal.temperature / temperatures[1]
        found = thermal_flows(thermal, WarmGas(content_1, content_2, mass_1, mass_2), at, flowing)
        flows = found.gas
        gained_1 = found.mass_1
        gained_2 = found.mass_2
        # A temperature is the walls' times content over mass.
        warming_1 = temperatures[0] * (gained_1 / content_1 - flows.mass_1 / mass_1)
        warming_2 = temperatures[1] * (gained_2 / content_2 - flows.mass_2 / mass_2)
        # The contents have the work of the moving wall in them: of equation (3) only the volumes are left.
    supplied = flows.supplied_1 + flows.supplied_2
    return GasRates(
        pressure_1=(per_mass_1 * gained_1 - pressure_1 * at.growth_1 / at.volume_1) / (1.0 + at.give_1),
        pressure_2=(per_mass_2 * gained_2 - pressure_2 * at.growth_2 / at.volume_2) / (1.0 + at.give_2),
        temperature_1=warming_1,
        temperature_2=warming_2,
        supplied=supplied,
        vented=supplied - flows.mass_1 - flows.mass_2,
    )


def free_motion(
    plant: PlantParameters,
    angle: float,
    angular_velocity: float,
    pressure_1: float,
    pressure_2: float,
    added_torque: float,
    way: float,
    *,
    parts: ActuatorFunctions,
) -> tuple[float, float]:
    """Rates of angle [rad/s] and angular velocity [rad/s^2] of a vane that slides in direction ``way`` (0: sticking).

    Equations (1), (2), (10). ``added_torque`` [N m] is the torque of the leg, in addition to the torque of the plant.
    """
    if way == 0.0:
        return 0.0, 0.0
    torque = driving_torque(plant, parts.torque(plant, angle, pressure_1, pressure_2), angle) + added_torque
    friction = friction_in_motion(plant.dynamic_torque, angular_velocity, pressure_1, pressure_2)
    net = net_torque(torque, way, friction, plant.viscous_damping, angle, angular_velocity)
    return angular_velocity, net / plant.inertia


def torque_at_rest(run: Run) -> Callable[[Mapping[str, Any], float, float, float, float], float]:
    """Torque on a joint at rest before friction [N m], including actuator, loads and leg.

    The returned function takes effect states by name, time [s], angle [rad] and two absolute pressures [Pa]. Equation
    (1).
    """
    program = run.program
    driving = in_program(driving_torque, program, run.effects)

    def torque(states: Mapping[str, Any], time: float, angle: float, pressure_1: float, pressure_2: float) -> float:
        actuator = program.actuator.torque(run.plant, angle, pressure_1, pressure_2)
        alone: float = driving(states, run.plant, actuator, angle)
        return alone if program.foot is None else alone + program.foot.torque(program, run.leg, time, angle)

    return torque


def mode_at_rest(plant: PlantParameters, angle: float, torque: float) -> float:
    """Direction in which a vane at ``angle`` [rad] starts to move under ``torque`` [N m]: 1, -1, or 0 if it sticks."""
    if holds_still(torque, plant.static_torque, angle <= plant.angle_min, angle >= plant.angle_max):
        return 0.0
    return 1.0 if torque > 0.0 else -1.0
