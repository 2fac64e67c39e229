"""The plant in continuous time, with the exact flow functions: what the reference solver integrates."""

from typing import NamedTuple

from ppafo.model.orifice import isentropic_flow_function, iso6358_flow_function
from ppafo.model.plant import Openings, PlantParameters, driving_torque
from ppafo.model.vane import vane_acceleration


class ExactOrifice(NamedTuple):
    """An orifice: conductance [kg/(s Pa)], 1 for the ISO 6358 form or 0 for the isentropic one, and its number [-].

    The number is the critical ratio in the first case and the heat capacity ratio in the second.
    """

    conductance: float
    is_iso6358: float
    number: float
    linear_ratio: float


class GasRates(NamedTuple):
    """Mass flows [kg/s]: into each chamber, from the source, to the atmosphere, across the vane (size)."""

    mass_1: float
    mass_2: float
    supplied: float
    vented: float
    leaked: float


def exact_flow_function(ratio: float, orifice: ExactOrifice) -> float:
    """Flow over choked flow [-] with the straight line near a ratio of 1. Equations (6), (7)."""
    inside = min(ratio, orifice.linear_ratio)
    if orifice.is_iso6358 > 0.5:
        value = iso6358_flow_function(inside, orifice.number)
    else:
        value = isentropic_flow_function(inside, orifice.number)
    return value * min((1.0 - ratio) / (1.0 - orifice.linear_ratio), 1.0)


def exact_flow(pressure_a: float, pressure_b: float, share: float, orifice: ExactOrifice) -> float:
    """Mass flow from a to b [kg/s] through a share of an orifice, positive from a to b. Equations (6), (7)."""
    upstream = max(pressure_a, pressure_b)
    ratio = min(pressure_a, pressure_b) / upstream
    flow = share * orifice.conductance * upstream * exact_flow_function(ratio, orifice)
    return flow if pressure_a >= pressure_b else -flow


def gas_rates(
    plant: PlantParameters,
    valve_orifice: ExactOrifice,
    leak_orifice: ExactOrifice,
    openings: Openings,
    pressure_1: float,
    pressure_2: float,
) -> GasRates:
    """All mass flows [kg/s] at two chamber pressures [Pa absolute]. Equations (8), (9)."""
    source_1 = exact_flow(plant.supply_pressure, pressure_1, openings.source_1, valve_orifice)
    source_2 = exact_flow(plant.dorsiflexion_pressure, pressure_2, openings.source_2, valve_orifice)
    vent_1 = exact_flow(pressure_1, plant.atmospheric_pressure, openings.vent_1, valve_orifice)
    vent_2 = exact_flow(pressure_2, plant.atmospheric_pressure, openings.vent_2, valve_orifice)
    leak = exact_flow(pressure_1, pressure_2, 1.0, leak_orifice)
    return GasRates(source_1 - vent_1 - leak, source_2 - vent_2 + leak, source_1 + source_2, vent_1 + vent_2, abs(leak))


def free_motion(
    plant: PlantParameters, angle: float, angular_velocity: float, pressure_1: float, pressure_2: float, way: float
) -> tuple[float, float]:
    """Slopes of angle [rad/s] and angular velocity [rad/s^2] of a vane that slides towards ``way`` (0: it is held).

    Equations (1), (2), (10).
    """
    if way == 0.0:
        return 0.0, 0.0
    torque = driving_torque(plant, angle, pressure_1, pressure_2)
    friction = way * plant.dynamic_torque
    return angular_velocity, vane_acceleration(torque, angular_velocity, friction, plant.viscous_damping, plant.inertia)
