"""Gas supply: a bottle of gas, with or without liquid, and its regulator.

First the properties of a real fluid, read from a table: its gas and, if it has one, its liquid at the same pressure.
The table has the temperature and, for the gas, the relative density as coordinates: the density divided by the density
of the densest gas at that temperature, which is saturated vapour if there is a liquid, else a fixed density. All
columns are interpolated linearly, so that nothing overshoots. The source of the values is given by the module that
makes the table.

A bottle has a fixed volume. Its content has one temperature; liquid and vapour are in equilibrium, so that drawing
vapour boils liquid, which cools the content and lowers the pressure. Heat flows from the wall of the bottle to the
content, and from the room to the wall. After the liquid is used up the bottle contains gas only. The outflow takes its
enthalpy along: ``dU/dt = -m_dot h + heat from the wall``. The regulator has no dynamics.
"""

from bisect import bisect_right
from typing import NamedTuple

from ppafo.model.orifice import area_conductance, isentropic_flow_function

Column = tuple[float, ...]
Nodes = tuple[int, float]
"""Index of the lower node, and fraction of the interval to the next node."""

# More halvings than a float has bits, so that the result does not depend on where they began.
_HALVINGS = 80
_NARROW_ENOUGH = 1e-9
_MAXIMUM_HALVINGS = 60


class FluidTable(NamedTuple):
    """Table of a fluid: ``temperatures`` [K], ``fractions`` of the densest gas's density [-] from 0 to 1, and values.

    By temperature: ``densest`` gas [kg/m^3], ``liquid_densities`` [kg/m^3] and ``liquid_energies`` [J/kg], both empty
    for a fluid without liquid. By temperature and fraction: ``factors`` P/(rho R T) [-], ``energies`` [J/kg].
    """

    gas_constant: float
    temperatures: Column
    fractions: Column
    densest: Column
    liquid_densities: Column
    liquid_energies: Column
    factors: tuple[Column, ...]
    energies: tuple[Column, ...]


def has_liquid(table: FluidTable) -> bool:
    """Return whether the densest gas of the table is vapour over liquid."""
    return bool(table.liquid_densities)


def densest_gas(table: FluidTable, temperature: float) -> float:
    """Density [kg/m^3] of the densest gas at a temperature [K]: saturated vapour if the fluid has a liquid."""
    return between(table.densest, nodes_around(table, temperature))


def liquid_density(table: FluidTable, temperature: float) -> float:
    """Density [kg/m^3] of the saturated liquid at a temperature [K]."""
    return between(table.liquid_densities, nodes_around(table, temperature))


def fluid_pressure(table: FluidTable, temperature: float, density: float) -> float:
    """Absolute pressure [Pa] of gas at a density [kg/m^3], at most the pressure of the densest gas."""
    nodes = nodes_around(table, temperature)
    # Beyond saturated vapour more gas is more liquid, at the same pressure.
    held = min(density, between(table.densest, nodes))
    factor = across(table.factors, table, nodes, density)
    return factor * held * table.gas_constant * temperature


def gas_density(table: FluidTable, temperature: float, pressure: float) -> float:
    """Density [kg/m^3] of gas at a temperature [K] and an absolute pressure [Pa], by bisection; at most ``densest``."""
    low = 0.0
    high = densest_gas(table, temperature)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if fluid_pressure(table, temperature, middle) < pressure:
            low = middle
        else:
            high = middle
    return high


def gas_specific_energy(table: FluidTable, temperature: float, density: float) -> float:
    """Specific internal energy [J/kg] of gas at a density [kg/m^3]; beyond the densest gas, its energy."""
    return across(table.energies, table, nodes_around(table, temperature), density)


def nodes_around(table: FluidTable, temperature: float) -> Nodes:
    """Nodes of the table around a temperature [K]; the end nodes outside of the table."""
    return place_among(table.temperatures, temperature)


def across(rows: tuple[Column, ...], table: FluidTable, nodes: Nodes, density: float) -> float:
    """Bilinear interpolation of a table between temperature nodes and at a density [kg/m^3].

    The second coordinate is the density divided by the density of the densest gas.
    """
    index, weight = nodes
    fraction = min(density / between(table.densest, nodes), 1.0)
    place = place_among(table.fractions, fraction)
    return (1.0 - weight) * between(rows[index], place) + weight * between(rows[index + 1], place)


def between(column: Column, nodes: Nodes) -> float:
    """Linear interpolation of a column at given nodes, in the unit of the column."""
    index, weight = nodes
    return (1.0 - weight) * column[index] + weight * column[index + 1]


def place_among(nodes: Column, at: float) -> Nodes:
    """Nodes around a number, in the same unit; the end nodes outside of their range."""
    index = min(max(bisect_right(nodes, at) - 1, 0), len(nodes) - 2)
    weight = (at - nodes[index]) / (nodes[index + 1] - nodes[index])
    return index, min(max(weight, 0.0), 1.0)


class BottleWall(NamedTuple):
    """Heat capacity of the wall [J/K], and heat transfer [W/K] from wall to content and from room to wall."""

    wall_heat_capacity: float
    content_heat_transfer: float
    room_heat_transfer: float


class BottleState(NamedTuple):
    """State of a bottle: mass [kg] and internal energy [J] of the content, temperature of its wall [K]."""

    mass: float
    energy: float
    wall_temperature: float


class BottleContent(NamedTuple):
    """Content of a bottle: temperature [K], absolute pressure [Pa], liquid [kg], enthalpy of the outflow [J/kg]."""

    temperature: float
    pressure: float
    liquid_mass: float
    outflow_enthalpy: float


class _BottleRates(NamedTuple):
    """Time derivatives of ``BottleState``, and power [W] over the boundary: outflow enthalpy and heat from the room."""

    mass_rate: float
    content_energy_rate: float
    wall_temperature_rate: float
    outflow_power: float
    room_heat: float


class Regulator(NamedTuple):
    """Regulator: set pressure [Pa absolute], droop [Pa s/kg], pressure margin [Pa] and seat area [m^2].

    ``pressure_margin`` is the smallest inlet pressure minus outlet pressure; ``seat_area`` is the fully open seat, area
    times discharge coefficient.
    """

    set_pressure: float
    droop: float
    pressure_margin: float
    seat_area: float


def bottle_content(table: FluidTable, mass: float, volume: float, temperature: float) -> BottleContent:
    """Content of a bottle of a volume [m^3] with ``mass`` [kg] at a temperature [K]."""
    density = mass / volume
    # The gas that leaves is vapour as long as there is liquid, else all that is there.
    vapour = min(density, densest_gas(table, temperature))
    pressure = fluid_pressure(table, temperature, density)
    enthalpy = gas_specific_energy(table, temperature, density) + pressure / vapour
    return BottleContent(
        temperature=temperature,
        pressure=pressure,
        liquid_mass=liquid_mass(table, mass, volume, temperature),
        outflow_enthalpy=enthalpy,
    )


def liquid_mass(table: FluidTable, mass: float, volume: float, temperature: float) -> float:
    """Liquid [kg] in a bottle of a volume [m^3], from the densities of both phases; 0 without liquid."""
    return _liquid_beside(table, mass, volume, nodes_around(table, temperature))


def _liquid_beside(table: FluidTable, mass: float, volume: float, nodes: Nodes) -> float:
    vapour = between(table.densest, nodes)
    if mass <= volume * vapour or not has_liquid(table):
        return 0.0
    # Both phases fill the volume: m = m_l + rho_v (V - m_l / rho_l), solved for the liquid.
    liquid = between(table.liquid_densities, nodes)
    return min((mass - volume * vapour) / (1.0 - vapour / liquid), mass)


def content_energy(table: FluidTable, mass: float, volume: float, temperature: float) -> float:
    """Internal energy [J] of the content of a bottle, relative to the reference state of the table."""
    nodes = nodes_around(table, temperature)
    liquid = _liquid_beside(table, mass, volume, nodes)
    gas = across(table.energies, table, nodes, mass / volume)
    energy = (mass - liquid) * gas
    return energy + liquid * between(table.liquid_energies, nodes) if liquid > 0.0 else energy


def content_temperature(table: FluidTable, mass: float, volume: float, energy: float) -> float:
    """Temperature [K] of a content with an internal energy [J]: the inverse of ``content_energy``.

    The end temperatures of the table for energies outside of its range.
    """
    nodes = table.temperatures
    below = 0
    above = len(nodes) - 1
    miss_below = content_energy(table, mass, volume, nodes[below]) - energy
    miss_above = content_energy(table, mass, volume, nodes[above]) - energy
    if miss_below >= 0.0:
        return nodes[below]
    if miss_above <= 0.0:
        return nodes[above]
    # The energy grows with temperature, so that halves of the table can be thrown away.
    while above - below > 1:
        middle = (below + above) // 2
        miss = content_energy(table, mass, volume, nodes[middle]) - energy
        if miss <= 0.0:
            below = middle
            miss_below = miss
        else:
            above = middle
            miss_above = miss
    # False position between two nodes, where the energy is smooth and grows with temperature. An end that stays counts
    # half the next time (the Illinois form), or the root would be approached from one side alone, slowly.
    low = nodes[below]
    high = nodes[above]
    miss_low = miss_below
    miss_high = miss_above
    for _ in range(_MAXIMUM_HALVINGS):
        found = (low * miss_high - high * miss_low) / (miss_high - miss_low)
        miss = content_energy(table, mass, volume, found) - energy
        if abs(miss) <= _NARROW_ENOUGH * abs(miss_high - miss_low) or high - low <= _NARROW_ENOUGH:
            return found
        if miss > 0.0:
            high = found
            miss_high = miss
            miss_low = 0.5 * miss_low
        else:
            low = found
            miss_low = miss
            miss_high = 0.5 * miss_high
    return 0.5 * (low + high)


def bottle_rates(
    content: BottleContent, state: BottleState, draw: float, wall: BottleWall, room_temperature: float
) -> _BottleRates:
    """Rates of a bottle for an outflow of vapour [kg/s]: balances of mass, and of energy of content and wall."""
    to_content = wall.content_heat_transfer * (state.wall_temperature - content.temperature)
    from_room = wall.room_heat_transfer * (room_temperature - state.wall_temperature)
    outflow = draw * content.outflow_enthalpy
    return _BottleRates(
        mass_rate=-draw,
        content_energy_rate=to_content - outflow,
        wall_temperature_rate=(from_room - to_content) / wall.wall_heat_capacity,
        outflow_power=outflow,
        room_heat=from_room,
    )


def regulated_pressure(regulator: Regulator, mass_flow: float) -> float:
    """Absolute pressure [Pa] downstream of a working regulator: set pressure minus the droop at a flow [kg/s]."""
    return regulator.set_pressure - regulator.droop * mass_flow


def pressure_reserve(regulator: Regulator, bottle_pressure: float, mass_flow: float) -> float:
    """Bottle pressure minus the required inlet pressure of the regulator at a flow [kg/s], in [Pa]."""
    return bottle_pressure - regulator.pressure_margin - regulated_pressure(regulator, mass_flow)


def regulator_flow_limit(
    regulator: Regulator,
    bottle_pressure: float,
    temperature: float,
    heat_capacity_ratio: float,
    gas_constant: float,
) -> float:
    """Largest flow [kg/s] of a regulator at its set pressure, with its seat fully open. Equations (6), (7)."""
    # A set pressure above the bottle's gives no flow, not an error: the bottle is nearly empty then.
    ratio = min(regulator.set_pressure / bottle_pressure, 1.0)
    # The area of the seat has its discharge coefficient in it.
    conductance = area_conductance(regulator.seat_area, 1.0, heat_capacity_ratio, gas_constant, temperature)
    return conductance * bottle_pressure * isentropic_flow_function(ratio, heat_capacity_ratio)
