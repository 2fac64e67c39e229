"""Cold gas downstream of a regulator: throttled at constant enthalpy, warmed by the regulator's body and the hose.

A throttle keeps the enthalpy, and the vapour over liquid CO2 has less enthalpy than the gas at room temperature: it
leaves the throttle cold, or partly as dry ice where the outlet is below the triple-point pressure. The gas takes heat
from the parts through which it flows. Each part has one temperature, and the gas takes up a fixed fraction of the heat
that would bring it to this temperature, the effectiveness, because in turbulent flow the heat transfer grows nearly
with the flow (power 0.8, Dittus and Boelter). Dry ice stays in the seat of the regulator and narrows it until gas with
enough enthalpy removes it.
"""

import math
from typing import NamedTuple

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.errors import SimulationError
from ppafo.model.source import (
    BottleContent,
    BottleState,
    BottleWall,
    Column,
    FluidTable,
    Regulator,
    between,
    bottle_content,
    bottle_rates,
    content_energy,
    content_temperature,
    densest_gas,
    fluid_pressure,
    gas_density,
    gas_specific_energy,
    has_liquid,
    place_among,
    regulator_flow_limit,
)

DRY_ICE = 5.55e5
"""Heat of sublimation at the triple point [J/kg]: 350 000 of evaporation (tables), 205 000 of melting (CRC)."""

LARGEST_CHANGE = 0.2
"""Largest fraction of a temperature difference equalised by one step of Heun's rule; above 2 the rule is unstable."""

_LEAST_HEAT_CAPACITY = 2.5
"""Lower bound for the heat capacity at constant volume divided by the gas constant [-], for air, nitrogen and CO2."""

# First difference [K] of the secants, difference [K] that is none, and how many are tried before a search in the whole
# table.
_FIRST_SECANT = 1.0e-3
_SAME_TEMPERATURE = 1.0e-9
_MAXIMUM_SECANTS = 12


class Passage(NamedTuple):
    """Part through which the gas flows: heat capacity [J/K], effectiveness [-], heat transfer from the room [W/K]."""

    heat_capacity: float
    effectiveness: float
    room_heat_transfer: float


class Isobar(NamedTuple):
    """Gas at one pressure [Pa]: enthalpies [J/kg] at temperatures [K], linear between; ``freezes`` 1 where ice forms.

    The first node is where the gas starts to condense or to freeze, or the start of the table.
    """

    pressure: float
    temperatures: Column
    enthalpies: Column
    freezes: float


class ColdSupply(NamedTuple):
    """Bottle with downstream parts: volume [m^3], wall, regulator, its body, ice capacity of the seat [kg], hose.

    ``room_temperature`` [K]; ``heat_capacity_ratio`` [-] of the gas.
    """

    volume: float
    wall: BottleWall
    regulator: Regulator
    body: Passage
    ice_capacity: float
    hose: Passage
    room_temperature: float
    heat_capacity_ratio: float


class SupplyState(NamedTuple):
    """State of a supply: ``BottleState``, temperatures of regulator and hose [K], dry ice in the seat [kg].

    Totals since the start [J]: enthalpy out of the bottle, enthalpy delivered, heat from the room into all parts.
    """

    mass: float
    energy: float
    wall_temperature: float
    body_temperature: float
    hose_temperature: float
    ice: float
    outflow: float
    delivered: float
    room_heat: float


class SupplyNow(NamedTuple):
    """Capability of a supply: content of the bottle, and largest pressure [Pa] and flow [kg/s] of its regulator.

    ``outlet_temperature`` is the gas temperature after the regulator, ``gas_temperature`` after the hose [K].
    """

    content: BottleContent
    set_pressure: float
    largest_flow: float
    outlet_temperature: float
    gas_temperature: float


def isobar(table: FluidTable, pressure: float) -> Isobar:
    """Enthalpies of a gas at a pressure [Pa], for the temperatures of its table at which it is dry gas."""
    # At a lower node the gas would condense before it reached the pressure.
    dry = [node for node in table.temperatures if fluid_pressure(table, node, densest_gas(table, node)) >= pressure]
    enthalpies = tuple(gas_enthalpy(table, node, pressure) for node in dry)
    lowest = table.temperatures[0]
    # Liquid at the lowest temperature has more than the outlet's pressure: then the outlet lies below the triple point,
    # and wet gas freezes.
    freezes = has_liquid(table) and fluid_pressure(table, lowest, densest_gas(table, lowest)) > pressure
    return Isobar(pressure=pressure, temperatures=tuple(dry), enthalpies=enthalpies, freezes=1.0 if freezes else 0.0)


def gas_enthalpy(table: FluidTable, temperature: float, pressure: float) -> float:
    """Specific enthalpy [J/kg] of gas at a temperature [K] and a pressure [Pa]."""
    density = gas_density(table, temperature, pressure)
    return gas_specific_energy(table, temperature, density) + pressure / density


def enthalpy_at(line: Isobar, temperature: float) -> float:
    """Specific enthalpy [J/kg] on an isobar at a temperature [K]; constant outside of its ends."""
    return between(line.enthalpies, place_among(line.temperatures, temperature))


def temperature_at(line: Isobar, enthalpy: float) -> float:
    """Temperature [K] on an isobar at a specific enthalpy [J/kg]; constant below the first node (wet gas)."""
    return between(line.temperatures, place_among(line.enthalpies, enthalpy))


def enthalpy_behind(line: Isobar, passage: Passage, part_temperature: float, enthalpy: float) -> float:
    """Specific enthalpy [J/kg] of gas after a part at a temperature [K], for the inlet enthalpy ``enthalpy`` [J/kg]."""
    return enthalpy + passage.effectiveness * (enthalpy_at(line, part_temperature) - enthalpy)


def heat_to_warm(table: FluidTable, content: BottleContent, temperature: float, pressure: float) -> float:
    """Heat [J/kg] that brings the outflow of a bottle to a temperature [K] at the pressure [Pa] after the regulator."""
    return gas_enthalpy(table, temperature, pressure) - content.outflow_enthalpy


def open_share(supply: ColdSupply, ice: float) -> float:
    """Fraction of the seat [-] that dry ice [kg] leaves open."""
    return max(0.0, 1.0 - ice / supply.ice_capacity)


def ice_rate(line: Isobar, enthalpy: float, flow: float, ice: float, step: float) -> float:
    """Growth rate of the dry ice in the seat [kg/s] for a gas enthalpy [J/kg]; no more ice is removed than there is.

    Gas with less enthalpy than the freezing point deposits ice, gas with more removes ice. ``flow`` [kg/s] is the flow
    downstream of the seat; the flow out of the bottle is ``flow`` plus the growth rate.
    """
    if line.freezes < 0.5:
        return 0.0
    lacking = (line.enthalpies[0] - enthalpy) / DRY_ICE
    # The ice grows at the expense of flow plus growth, hence the divisor.
    return max(flow * lacking / (1.0 - lacking), -ice / step)


def enthalpy_behind_seat(line: Isobar, enthalpy: float, ice: float, mass: float) -> float:
    """Specific enthalpy [J/kg] of a mass of gas [kg] after a seat with dry ice [kg]; ``enthalpy`` is at the inlet.

    The gas is as cold as the ice while there is some, and warmer by the enthalpy that remains after all ice is removed.
    The removed ice is part of the mass.
    """
    if line.freezes < 0.5:
        return enthalpy
    if mass <= 0.0:
        return line.enthalpies[0] if ice > 0.0 else max(enthalpy, line.enthalpies[0])
    return max(enthalpy - (ice / mass) * (DRY_ICE + enthalpy - line.enthalpies[0]), line.enthalpies[0])


def supply_now(
    table: FluidTable, line: Isobar, supply: ColdSupply, state: SupplyState, near: float, mass: float
) -> SupplyNow:
    """Capability of a supply in a state with a content ``near`` a temperature [K]: pressure, flow and temperature.

    ``mass`` [kg] is the gas demand of the device in a step, taken from the previous step; dry ice cools this mass.
    """
    content = _content(table, supply, state, near)
    regulator = supply.regulator
    # A bottle near its end gives what it has above the margin of its regulator.
    highest = min(regulator.set_pressure, max(content.pressure - regulator.pressure_margin, 0.0))
    # The flow limit holds at what the regulator can deliver now, not at what it is set to.
    limit = regulator_flow_limit(
        regulator._replace(set_pressure=highest),
        content.pressure,
        content.temperature,
        supply.heat_capacity_ratio,
        table.gas_constant,
    )
    arriving = enthalpy_behind(line, supply.body, state.body_temperature, content.outflow_enthalpy)
    outlet = enthalpy_behind_seat(line, arriving, state.ice, mass)
    behind = enthalpy_behind(line, supply.hose, state.hose_temperature, outlet)
    return SupplyNow(
        content=content,
        set_pressure=highest,
        largest_flow=limit * open_share(supply, state.ice),
        outlet_temperature=temperature_at(line, outlet),
        gas_temperature=temperature_at(line, behind),
    )


def advance_supply(
    table: FluidTable,
    line: Isobar,
    supply: ColdSupply,
    state: SupplyState,
    content: BottleContent,
    mass: float,
    step: float,
) -> SupplyState:
    """Advance a supply by a step [s] in which a mass [kg] passes the regulator seat at a constant rate, by Heun's rule.

    ``content`` is the content of the bottle before the step. The step is subdivided where little gas, or a part of
    small heat capacity, responds too fast for the rule. Raises SimulationError if the bottle contains no more than the
    mass.
    """
    if mass >= state.mass:
        raise SimulationError(
            f"{mass * GRAMS_PER_KILOGRAM:.3g} g of gas were drawn within {step:.3g} s from a bottle with "
            f"{state.mass * GRAMS_PER_KILOGRAM:.3g} g: reduce bottle.coupling, or increase bottle.least_torque, "
            f"so that the walk ends before the bottle is empty"
        )
    flow = mass / step
    # Heun's rule is stable up to 2 over the fastest rate; a tenth of that keeps it accurate too.
    fastest = max(following_rates(table, line, supply, state.mass - mass, flow).values())
    parts = max(1, math.ceil(step * fastest / LARGEST_CHANGE))
    length = step / parts
    after = state
    for part in range(parts):
        if part > 0:
            content = _content(table, supply, after, content.temperature)
        # Heun's rule; the content is found anew at the end of the first guess, or it would lag behind the energy.
        first = supply_rates(line, supply, after, content, flow, length)
        guess = SupplyState._make(value + length * rate for value, rate in zip(after, first, strict=True))
        then = _content(table, supply, guess, content.temperature)
        second = supply_rates(line, supply, guess, then, flow, length)
        rates = zip(after, first, second, strict=True)
        after = SupplyState._make(value + 0.5 * length * (one + other) for value, one, other in rates)
    # The mass itself, so that what left the bottle came through the regulator or is ice, to the last digit.
    return after._replace(mass=state.mass - mass - (after.ice - state.ice))


def following_rates(table: FluidTable, line: Isobar, supply: ColdSupply, mass: float, flow: float) -> dict[str, float]:
    """Upper bounds of the rates [1/s], by name, at which content, wall, regulator and hose approach their surroundings.

    ``mass`` [kg] of gas in the bottle, ``flow`` [kg/s] through the regulator.
    """
    # Mean specific heat over the isobar: which one does not matter for a bound that is cut by a safety factor of ten.
    wall = supply.wall
    temperatures = line.temperatures
    capacity = (line.enthalpies[-1] - line.enthalpies[0]) / (temperatures[-1] - temperatures[0])
    parts = {"regulator": supply.body, "hose": supply.hose}
    passages = {
        name: (part.room_heat_transfer + flow * part.effectiveness * capacity) / part.heat_capacity
        for name, part in parts.items()
    }
    return {
        "content": wall.content_heat_transfer / (_LEAST_HEAT_CAPACITY * table.gas_constant * mass),
        "wall": (wall.content_heat_transfer + wall.room_heat_transfer) / wall.wall_heat_capacity,
        **passages,
    }


def supply_rates(
    line: Isobar, supply: ColdSupply, state: SupplyState, content: BottleContent, flow: float, step: float
) -> SupplyState:
    """Time derivatives of a state for a flow [kg/s] downstream of the seat, as a state, valid for a ``step`` [s]."""
    arriving = enthalpy_behind(line, supply.body, state.body_temperature, content.outflow_enthalpy)
    growth = ice_rate(line, arriving, flow, state.ice, step)
    leaving = flow + growth
    bottle = BottleState(state.mass, state.energy, state.wall_temperature)
    now = bottle_rates(content, bottle, leaving, supply.wall, supply.room_temperature)
    outlet = enthalpy_behind_seat(line, arriving, state.ice, flow * step)
    behind = enthalpy_behind(line, supply.hose, state.hose_temperature, outlet)
    to_body = supply.body.room_heat_transfer * (supply.room_temperature - state.body_temperature)
    to_hose = supply.hose.room_heat_transfer * (supply.room_temperature - state.hose_temperature)
    return SupplyState(
        mass=now.mass_rate,
        energy=now.content_energy_rate,
        wall_temperature=now.wall_temperature_rate,
        body_temperature=(to_body - leaving * (arriving - content.outflow_enthalpy)) / supply.body.heat_capacity,
        hose_temperature=(to_hose - flow * (behind - outlet)) / supply.hose.heat_capacity,
        ice=growth,
        outflow=now.outflow_power,
        delivered=flow * behind,
        room_heat=now.room_heat + to_body + to_hose,
    )


def _content(table: FluidTable, supply: ColdSupply, state: SupplyState, near: float) -> BottleContent:
    """Content of the bottle; the temperature [K] is found by the secant method, starting at ``near``."""
    # A step changes the temperature by little: two or three secants find it without a search in the whole table.
    mass = state.mass
    volume = supply.volume
    energy = state.energy
    before = near
    after = near + _FIRST_SECANT
    miss = content_energy(table, mass, volume, before) - energy
    for _ in range(_MAXIMUM_SECANTS):
        next_miss = content_energy(table, mass, volume, after) - energy
        # Two equal misses have no secant: the search takes over.
        if next_miss == miss:
            break
        found = after - next_miss * (after - before) / (next_miss - miss)
        if abs(found - after) <= _SAME_TEMPERATURE and table.temperatures[0] < found < table.temperatures[-1]:
            return bottle_content(table, mass, volume, found)
        before = after
        after = found
        miss = next_miss
    return bottle_content(table, mass, volume, content_temperature(table, mass, volume, energy))
