"""The plant in continuous time with the engine's flow curves, as CasADi expressions of its own text.

What the engine steps and what is differentiated here are the same functions: ports, flow curves, chambers, gas with an
energy balance, vane. Only the sums of equation (9) and the state of the vane, which stands or slides, are said here.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

from ppafo.engine.continuous_time import free_motion, real_gas_rates
from ppafo.engine.scheme.thermal_gas import ThermalFlows, WarmChambers, thermal_flows
from ppafo.model.declaration import PlainFunction
from ppafo.model.orifice import orifice_flow
from ppafo.model.plant import (
    Openings,
    PlantParameters,
    PlantState,
    PortFlow,
    ThermalParameters,
    ThermalState,
    blended_port_flow,
    blended_ports,
    chamber_volumes,
    pressures_per_mass,
)
from ppafo.model.ports import gas_density, leakage_path
from ppafo.translation.symbolic import Acting, Compare, Wrapper, both_sides, symbolic

Around = Mapping[PlainFunction, Wrapper]


class GasFlows(NamedTuple):
    """Flows into both chambers, from the source, to the atmosphere and from chamber 1 to 2 over the vane [kg/s]."""

    mass_1: float
    mass_2: float
    supplied: float
    vented: float
    leaked: float


class PlantRates(NamedTuple):
    """Rates of both pressures [Pa/s] and temperatures [K/s], flows from the source and to the atmosphere [kg/s]."""

    pressure_1: Any
    pressure_2: Any
    temperature_1: Any
    temperature_2: Any
    supplied: Any
    vented: Any


def port_flows(
    plant: PlantParameters, openings: Openings, pressure_1: float, pressure_2: float
) -> tuple[PortFlow, PortFlow, float]:
    """Flows [kg/s] through the ports of both chambers and from 1 to 2 at absolute pressures [Pa]. Eqs (6) to (9)."""
    port_1, port_2 = blended_ports(plant, openings)
    in_1 = blended_port_flow(pressure_1, port_1, plant.valve_curve)
    in_2 = blended_port_flow(pressure_2, port_2, plant.valve_curve)
    leak_conductance = leakage_path(plant.leak_conductance, pressure_1, pressure_2, plant.leak_curve)
    return in_1, in_2, orifice_flow(pressure_1, pressure_2, leak_conductance, plant.leak_curve)


def gas_flows(plant: PlantParameters, openings: Openings, pressure_1: float, pressure_2: float) -> GasFlows:
    """All flows [kg/s] of gas that keeps its temperature, at absolute pressures [Pa]. Equations (6) to (9)."""
    in_1, in_2, leak = port_flows(plant, openings, pressure_1, pressure_2)
    supplied = in_1.from_source + in_2.from_source
    return GasFlows(
        mass_1=in_1.total - leak,
        mass_2=in_2.total + leak,
        supplied=supplied,
        vented=supplied - in_1.total - in_2.total,
        leaked=leak,
    )


def thermal_gas_flows(
    plant: PlantParameters,
    thermal: ThermalParameters,
    openings: Openings,
    state: PlantState,
    masses: ThermalState,
    pressure_1: float,
    pressure_2: float,
) -> ThermalFlows:
    """All rates of gas with an energy balance [kg/s], at absolute pressures [Pa]. Equations (3), (6) to (9)."""
    in_1, in_2, leak = port_flows(plant, openings, pressure_1, pressure_2)
    volume_1, volume_2 = chamber_volumes(plant, state.angle)
    growth = plant.displacement_per_radian * state.angular_velocity
    at = WarmChambers(volume_1=volume_1, volume_2=volume_2, growth_1=growth, growth_2=-growth, give_1=0.0, give_2=0.0)
    return thermal_flows(thermal, state, masses, at, in_1, in_2, leak)


def gas_rates(
    plant: PlantParameters,
    openings: Any,
    angle: Any,
    rate: Any,
    pressures: tuple[Any, Any],
    compare: Compare = both_sides,
    acting: Acting | None = None,
) -> PlantRates:
    """Rates at an angle [rad] that is a symbol, its rate [rad/s] and absolute pressures [Pa]; gas of one temperature.

    Equation (3) is differentiated, (6) to (9) are the engine's. ``acting`` as in ``symbolic``.
    """
    flows = symbolic(gas_flows, PlantParameters, Openings, float, float, compare=compare, acting=acting)
    gas = flows(plant, openings, *pressures)
    # Flows are true masses; where the gas is not ideal its content grows by another amount.
    gained = gas.mass_1, gas.mass_2
    if any(gas_density in effect.laws for effect in acting or ()):
        types = (PlantParameters, float, float, float, float, float, float)
        gained = symbolic(real_gas_rates, *types, compare=compare, acting=acting)(
            plant, angle, rate, *gained, *_contents(plant, angle, pressures, acting)
        )
    slopes = _pressure_rates(plant, angle, rate, pressures, gained, acting)
    return PlantRates(
        pressure_1=slopes[0],
        pressure_2=slopes[1],
        temperature_1=0.0,
        temperature_2=0.0,
        supplied=gas.supplied,
        vented=gas.vented,
    )


def thermal_gas_rates(
    plant: PlantParameters,
    thermal: ThermalParameters,
    openings: Any,
    angle: Any,
    rate: Any,
    pressures: tuple[Any, Any],
    temperatures: tuple[Any, Any],
    compare: Compare = both_sides,
    acting: Acting | None = None,
) -> PlantRates:
    """Rates of ``gas_rates`` for gas with an energy balance at temperatures [K]."""
    content_1, content_2 = _contents(plant, angle, pressures, acting)
    mass_1, mass_2 = (
        content * thermal.temperature / warm for content, warm in zip((content_1, content_2), temperatures, strict=True)
    )
    types = (PlantParameters, ThermalParameters, Openings, PlantState, ThermalState, float, float)
    flows = symbolic(thermal_gas_flows, *types, compare=compare, acting=acting)
    # Totals do not act on rates: zeros stand for them.
    state = PlantState(
        angle=angle,
        angular_velocity=rate,
        mass_1=content_1,
        mass_2=content_2,
        supplied_mass=0.0,
        vented_mass=0.0,
        leaked_mass=0.0,
    )
    masses = ThermalState(
        mass_1=mass_1, mass_2=mass_2, supplied_content=0.0, vented_content=0.0, heat_content=0.0, gas_work=0.0
    )
    gas = flows(plant, thermal, openings, state, masses, *pressures)
    # The contents hold the work of the moving wall already: only the volumes are left of equation (3).
    slopes = _pressure_rates(plant, angle, rate, pressures, (gas.content_1, gas.content_2), acting)
    # A temperature is the walls' times gas content over mass.
    return PlantRates(
        pressure_1=slopes[0],
        pressure_2=slopes[1],
        temperature_1=temperatures[0] * (gas.content_1 / content_1 - gas.mass_1 / mass_1),
        temperature_2=temperatures[1] * (gas.content_2 / content_2 - gas.mass_2 / mass_2),
        supplied=gas.supplied,
        vented=gas.supplied - gas.mass_1 - gas.mass_2,
    )


def _contents(plant: PlantParameters, angle: Any, pressures: tuple[Any, Any], acting: Acting | None) -> tuple[Any, Any]:
    """What ``PlantState`` counts of the gas [kg] at two absolute pressures [Pa]. Equation (3)."""
    per_mass = symbolic(pressures_per_mass, PlantParameters, float, acting=acting)(plant, angle)
    return pressures[0] / per_mass[0], pressures[1] / per_mass[1]


def _pressure_rates(
    plant: PlantParameters,
    angle: Any,
    rate: Any,
    pressures: tuple[Any, Any],
    mass_rates: tuple[Any, Any],
    acting: Acting | None,
) -> tuple[Any, Any]:
    """Rates of both pressures [Pa/s] from the rates of the gas [kg/s] and the angle [rad/s]: equation (3) in time."""
    import casadi

    per_mass = symbolic(pressures_per_mass, PlantParameters, float, acting=acting)(plant, angle)
    first, second = (
        # p = m f(angle), so dp/dt = f dm/dt + p / f df/dt: no division by a mass, and any actuator.
        factor * gained + pressure / factor * casadi.jtimes(factor, angle, rate)
        for factor, pressure, gained in zip(per_mass, pressures, mass_rates, strict=True)
    )
    return first, second


def vane_acceleration(
    plant: PlantParameters,
    angle: Any,
    rate: Any,
    pressures: tuple[Any, Any],
    way: float,
    compare: Compare = both_sides,
    acting: Acting | None = None,
    added_torque: Any = 0.0,
) -> Any:
    """Angular acceleration [rad/s^2] of a vane that slides one ``way`` (1 or -1), 0 where it sticks (0)."""
    types = (PlantParameters, float, float, float, float, float, float)
    motion = symbolic(free_motion, *types, compare=compare, acting=acting)
    return motion(plant, angle, rate, *pressures, added_torque, way)[1]
