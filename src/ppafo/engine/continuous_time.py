"""Plant in continuous time for solvers and linear models: gas balance and unconstrained vane.

The flows are computed as in a step of the engine.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from ppafo.engine.in_python import in_program
from ppafo.engine.led_leg import torque_of_leg
from ppafo.engine.run import Run
from ppafo.engine.scheme.pneumatics import StageFlows, plant_with_leak_at, stage_flows
from ppafo.engine.scheme.thermal_gas import WarmChambers, thermal_flows
from ppafo.model.plant import (
    ActuatorFunctions,
    Openings,
    PlantParameters,
    PlantState,
    ThermalParameters,
    ThermalState,
    blended_port_flow,
    blended_ports,
    chamber_mass,
    driving_torque,
    holds_still,
    vane_acceleration,
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


def flows_at(plant: PlantParameters, openings: Openings, pressure_1: float, pressure_2: float) -> StageFlows:
    """Flows [kg/s] through both ports and the leakage, for valve openings [-]. Equations (6) to (8)."""
    leaking = plant_with_leak_at(plant, pressure_1, pressure_2)
    port_1, port_2 = blended_ports(plant, openings)
    return stage_flows(leaking, pressure_1, pressure_2, port_1, port_2, blended_port_flow)


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

    Without ``thermal`` the gas is isothermal. The pressures follow from the time derivative of equation (3), d(p V) =
    R T dm, where the volume of a compliant chamber also changes with its pressure.
    """
    (angle, angular_velocity), (pressure_1, pressure_2), product = motion, pressures, plant.gas_product
    now, less, more = (parts.chambers(plant, at, *pressures) for at in (angle, angle - NEAR, angle + NEAR))
    per_angle = angular_velocity / (2.0 * NEAR)
    growth_1, growth_2 = (more.volume_1 - less.volume_1) * per_angle, (more.volume_2 - less.volume_2) * per_angle
    in_1, in_2, leak = flows_at(plant, openings, pressure_1, pressure_2)
    if thermal is None:
        gained_1, gained_2, warming_1, warming_2 = in_1.total - leak, in_2.total + leak, 0.0, 0.0
        supplied = in_1.from_source + in_2.from_source
        vented = supplied - in_1.total - in_2.total
    else:
        content_1 = chamber_mass(pressure_1, now.volume_1, product)
        content_2 = chamber_mass(pressure_2, now.volume_2, product)
        mass_1 = content_1 * thermal.temperature / temperatures[0]
        mass_2 = content_2 * thermal.temperature / temperatures[1]
        give_1, give_2 = pressure_1 * now.compliance_1 / now.volume_1, pressure_2 * now.compliance_2 / now.volume_2
        warm = WarmChambers(now.volume_1, now.volume_2, growth_1, growth_2, give_1, give_2)
        # Neither motion nor totals act on the rates of the gas: zeros stand for them.
        state = PlantState(*[0.0] * len(PlantState._fields))._replace(mass_1=content_1, mass_2=content_2)
        masses = ThermalState(*[0.0] * len(ThermalState._fields))._replace(mass_1=mass_1, mass_2=mass_2)
        found = thermal_flows(thermal, state, masses, warm, in_1, in_2, leak)
        gained_1, gained_2, supplied = found.content_1, found.content_2, found.supplied
        vented = supplied - found.mass_1 - found.mass_2
        # A temperature is the walls' times content over mass.
        warming_1 = temperatures[0] * (gained_1 / content_1 - found.mass_1 / mass_1)
        warming_2 = temperatures[1] * (gained_2 / content_2 - found.mass_2 / mass_2)
        # The contents have the work of the moving wall in them: of equation (3) only the volumes are left.
    return GasRates(
        pressure_1=(product * gained_1 - pressure_1 * growth_1) / (now.volume_1 + pressure_1 * now.compliance_1),
        pressure_2=(product * gained_2 - pressure_2 * growth_2) / (now.volume_2 + pressure_2 * now.compliance_2),
        temperature_1=warming_1,
        temperature_2=warming_2,
        supplied=supplied,
        vented=vented,
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
    torque = driving_torque(plant, angle, pressure_1, pressure_2, parts=parts) + added_torque
    friction = way * friction_in_motion(plant.dynamic_torque, angular_velocity, pressure_1, pressure_2)
    return angular_velocity, vane_acceleration(
        torque, friction, plant.viscous_damping, plant.inertia, angle, angular_velocity
    )


def torque_at_rest(run: Run) -> Callable[[Mapping[str, Any], float, float, float, float], float]:
    """Torque on a joint at rest before friction [N m], including actuator, loads and leg.

    The returned function takes effect states by name, time [s], angle [rad] and two absolute pressures [Pa]. Equation
    (1).
    """
    program = run.program
    driving = in_program(driving_torque, program, run.effects)

    def torque(states: Mapping[str, Any], time: float, angle: float, pressure_1: float, pressure_2: float) -> float:
        alone: float = driving(states, run.plant, angle, pressure_1, pressure_2, parts=program.functions)
        return alone if run.leg is None else alone + torque_of_leg(program, run.leg, time, angle)

    return torque


def mode_at_rest(plant: PlantParameters, angle: float, torque: float) -> float:
    """Direction in which a vane at ``angle`` [rad] starts to move under ``torque`` [N m]: 1, -1, or 0 if it sticks."""
    if holds_still(torque, plant.static_torque, angle <= plant.angle_min, angle >= plant.angle_max):
        return 0.0
    return 1.0 if torque > 0.0 else -1.0
