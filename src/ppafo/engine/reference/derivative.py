"""The plant in continuous time, with the exact flow functions: what the reference solver integrates."""

import math
from typing import NamedTuple

from ppafo.model.orifice import isentropic_flow_function, iso6358_flow_function
from ppafo.model.places import friction_in_motion, way_in, way_out
from ppafo.model.plant import (
    Openings,
    PlantParameters,
    ThermalParameters,
    chamber_pressures,
    chamber_volumes,
    driving_torque,
)
from ppafo.model.ports import admitted_flow
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


class Transport(NamedTuple):
    """Mass and energy that pass [kg/s], the energy as a content of ``PlantState``."""

    mass: float
    content: float


class ThermalGasRates(NamedTuple):
    """As ``GasRates``, with the contents of ``PlantState`` [kg/s] before the true masses."""

    content_1: float
    content_2: float
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


def exact_flow(pressure_a: float, pressure_b: float, conductance: float, orifice: ExactOrifice) -> float:
    """Mass flow from a to b [kg/s] through a conductance [kg/(s Pa)] with the flow function of an orifice.

    Positive from a to b. Equations (6), (7).
    """
    upstream = max(pressure_a, pressure_b)
    ratio = min(pressure_a, pressure_b) / upstream
    flow = conductance * upstream * exact_flow_function(ratio, orifice)
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
    full = valve_orifice.conductance
    source_1 = exact_flow(plant.supply_pressure, pressure_1, way_in(openings.source_1 * full), valve_orifice)
    source_2 = exact_flow(plant.dorsiflexion_pressure, pressure_2, way_in(openings.source_2 * full), valve_orifice)
    source_1 = admitted_flow(source_1, plant.relieving)
    source_2 = admitted_flow(source_2, plant.relieving)
    vent_1 = exact_flow(pressure_1, plant.atmospheric_pressure, way_out(openings.vent_1 * full), valve_orifice)
    vent_2 = exact_flow(pressure_2, plant.atmospheric_pressure, way_out(openings.vent_2 * full), valve_orifice)
    leak = exact_flow(pressure_1, pressure_2, leak_orifice.conductance, leak_orifice)
    return GasRates(
        mass_1=source_1 - vent_1 - leak,
        mass_2=source_2 - vent_2 + leak,
        supplied=source_1 + source_2,
        vented=vent_1 + vent_2,
        leaked=abs(leak),
    )


def transport(
    thermal: ThermalParameters, pressure_a: float, pressure_b: float, warmth_a: float, warmth_b: float, flow: float
) -> Transport:
    """What a flow [kg/s] that holds at the reference temperature carries, with the temperature of its upstream side.

    Warmths are T/T_0 [-] on both sides; flow from a to b. Equation (6).
    """
    warmth = warmth_a if pressure_a >= pressure_b else warmth_b
    mass = flow / math.sqrt(warmth)
    return Transport(mass, thermal.heat_capacity_ratio * warmth * mass)


def thermal_gas_rates(
    plant: PlantParameters,
    thermal: ThermalParameters,
    valve_orifice: ExactOrifice,
    leak_orifice: ExactOrifice,
    openings: Openings,
    contents: tuple[float, float],
    masses: tuple[float, float],
    angle: float,
    angular_velocity: float,
) -> ThermalGasRates:
    """All rates of gas with an energy balance [kg/s]; contents as in ``PlantState``. Equations (3), (6) to (9)."""
    source_pressure_1, source_pressure_2 = plant.supply_pressure, plant.dorsiflexion_pressure
    room, full = plant.atmospheric_pressure, valve_orifice.conductance
    volume_1, volume_2 = chamber_volumes(plant, angle)
    pressure_1, pressure_2 = chamber_pressures(plant, angle, contents[0], contents[1])
    warmth_1, warmth_2 = contents[0] / masses[0], contents[1] / masses[1]
    supply_1 = exact_flow(source_pressure_1, pressure_1, way_in(openings.source_1 * full), valve_orifice)
    supply_2 = exact_flow(source_pressure_2, pressure_2, way_in(openings.source_2 * full), valve_orifice)
    supply_1, supply_2 = admitted_flow(supply_1, plant.relieving), admitted_flow(supply_2, plant.relieving)
    outlet_1 = exact_flow(pressure_1, room, way_out(openings.vent_1 * full), valve_orifice)
    outlet_2 = exact_flow(pressure_2, room, way_out(openings.vent_2 * full), valve_orifice)
    across = exact_flow(pressure_1, pressure_2, leak_orifice.conductance, leak_orifice)
    source_1 = transport(thermal, source_pressure_1, pressure_1, 1.0, warmth_1, supply_1)
    source_2 = transport(thermal, source_pressure_2, pressure_2, 1.0, warmth_2, supply_2)
    vent_1 = transport(thermal, pressure_1, room, warmth_1, 1.0, outlet_1)
    vent_2 = transport(thermal, pressure_2, room, warmth_2, 1.0, outlet_2)
    leak = transport(thermal, pressure_1, pressure_2, warmth_1, warmth_2, across)
    compression = (thermal.heat_capacity_ratio - 1.0) * plant.volume_per_angle * angular_velocity
    wall_1 = thermal.wall_exchange * volume_1 * (1.0 - warmth_1)
    wall_2 = thermal.wall_exchange * volume_2 * (1.0 - warmth_2)
    return ThermalGasRates(
        content_1=source_1.content - vent_1.content - leak.content - compression * contents[0] / volume_1 + wall_1,
        content_2=source_2.content - vent_2.content + leak.content + compression * contents[1] / volume_2 + wall_2,
        mass_1=source_1.mass - vent_1.mass - leak.mass,
        mass_2=source_2.mass - vent_2.mass + leak.mass,
        supplied=source_1.mass + source_2.mass,
        vented=vent_1.mass + vent_2.mass,
        leaked=abs(leak.mass),
    )


def joined_gas_rates(
    gas: GasRates, valve_orifice: ExactOrifice, opening: float, pressure_1: float, pressure_2: float
) -> GasRates:
    """Mass flows [kg/s] with a valve beside the leak that joins the chambers. Equations (6), (7), (9)."""
    across = exact_flow(pressure_1, pressure_2, opening * valve_orifice.conductance, valve_orifice)
    return GasRates(
        mass_1=gas.mass_1 - across,
        mass_2=gas.mass_2 + across,
        supplied=gas.supplied,
        vented=gas.vented,
        leaked=gas.leaked + abs(across),
    )


def joined_thermal_rates(
    gas: ThermalGasRates,
    thermal: ThermalParameters,
    valve_orifice: ExactOrifice,
    opening: float,
    pressure_1: float,
    pressure_2: float,
    warmth_1: float,
    warmth_2: float,
) -> ThermalGasRates:
    """As ``joined_gas_rates`` [kg/s], of gas with an energy balance; warmths are T/T_0 [-]."""
    flow = exact_flow(pressure_1, pressure_2, opening * valve_orifice.conductance, valve_orifice)
    across = transport(thermal, pressure_1, pressure_2, warmth_1, warmth_2, flow)
    return ThermalGasRates(
        content_1=gas.content_1 - across.content,
        content_2=gas.content_2 + across.content,
        mass_1=gas.mass_1 - across.mass,
        mass_2=gas.mass_2 + across.mass,
        supplied=gas.supplied,
        vented=gas.vented,
        leaked=gas.leaked + abs(across.mass),
    )


def free_motion(
    plant: PlantParameters, angle: float, angular_velocity: float, pressure_1: float, pressure_2: float, way: float
) -> tuple[float, float]:
    """Slopes of angle [rad/s] and angular velocity [rad/s^2] of a vane that slides towards ``way`` (0: it is held).

    Equations (1), (2), (10).
    """
    if way == 0.0:
        return 0.0, 0.0
    torque = driving_torque(plant, angle, pressure_1, pressure_2)
    friction = way * friction_in_motion(plant.dynamic_torque, angular_velocity, pressure_1, pressure_2)
    return angular_velocity, vane_acceleration(torque, angular_velocity, friction, plant.viscous_damping, plant.inertia)
