"""Why a bottle no longer feeds a device, and what is left in it then."""

from dataclasses import dataclass
from typing import Literal

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.model.fluid_table import densest_gas, has_liquid
from ppafo.model.source import BottleContent, bottle_content, pressure_reserve, regulator_flow_limit
from ppafo.parameters.bottles.bottle import Bottle
from ppafo.questions.endurance.draw import Draw

EndKind = Literal["empty", "too cold", "frozen", "time is up"]
Stop = Literal["supply", "frozen", "time"]
"""What stopped a run: the supply pressure was not maintained, the table ended in the cold, the time was over."""

_NEXT_TO_NOTHING = 0.01
"""Fraction of a full bottle: less than this left to be had from a warm bottle is called empty."""


@dataclass(frozen=True, slots=True)
class Ending:
    """How a run ended: kind, a sentence, mass left [kg], and the part of it [kg] that a warm bottle would give."""

    kind: EndKind
    message: str
    mass_left: float
    usable_when_warm: float


def reserve(bottle: Bottle, draw: Draw, pressure: float, temperature: float) -> float:
    """Return the margin of a bottle at its largest flow, as a fraction: below 0 the supply pressure is lost.

    The smaller of two: pressure above what the regulator needs, and flow above the largest one.
    """
    to_spare = pressure_reserve(bottle.regulator, pressure, draw.peak_flow) / bottle.regulator.set_pressure
    return min(to_spare, flow_limit(bottle, pressure, temperature) / draw.peak_flow - 1.0)


def flow_limit(bottle: Bottle, pressure: float, temperature: float) -> float:
    """Return the largest flow [kg/s] that the regulator passes at a pressure [Pa] and temperature [K] in the bottle."""
    gas_constant = bottle.fluid.table.gas_constant
    return regulator_flow_limit(bottle.regulator, pressure, temperature, bottle.heat_capacity_ratio, gas_constant)


def smallest_mass_when_warm(bottle: Bottle, draw: Draw) -> float:
    """Return the mass of gas [kg] with which the bottle, at room temperature, just holds the supply pressure."""
    table, room = bottle.fluid.table, bottle.room_temperature
    low, high = 0.0, min(bottle.mass, bottle.volume * densest_gas(table, room))
    for _ in range(60):
        middle = 0.5 * (low + high)
        pressure = bottle_content(table, middle, bottle.volume, room).pressure
        if reserve(bottle, draw, pressure, room) < 0.0:
            low = middle
        else:
            high = middle
    return high


def frozen_below(bottle: Bottle) -> float:
    """Return the temperature [K] at which the liquid freezes, or below which the table knows nothing of the gas."""
    return bottle.fluid.table.temperatures[0]


def ending(bottle: Bottle, draw: Draw, mass: float, content: BottleContent, stopped_by: Stop) -> Ending:
    """Return the ending for what stopped a run: the supply pressure, the cold end of the table, or the time.

    A bottle that would still do at room temperature is too cold, any other is empty.
    """
    usable = max(0.0, mass - smallest_mass_when_warm(bottle, draw))
    left = f"{mass * GRAMS_PER_KILOGRAM:.3g} g are left"
    warm = f"{usable * GRAMS_PER_KILOGRAM:.3g} g of this would be usable at room temperature"
    if stopped_by == "time":
        return Ending(
            "time is up", f"the supply pressure was maintained for the whole requested time; {left}", mass, usable
        )
    if stopped_by == "frozen":
        cold = "the liquid begins to freeze (dry ice)" if has_liquid(bottle.fluid.table) else "the gas is too cold"
        return Ending("frozen", f"{cold}, and the property table ends here; {left}, {warm}", mass, usable)
    why = _shortage(bottle, draw, content)
    if usable > _NEXT_TO_NOTHING * bottle.mass:
        return Ending("too cold", f"the bottle is too cold: {why}; {left}, {warm}", mass, usable)
    return Ending("empty", f"the bottle is empty: {why}, and would be also when warm; {left}", mass, usable)


def _shortage(bottle: Bottle, draw: Draw, content: BottleContent) -> str:
    """Return which of the two is short, pressure or flow."""
    to_spare = pressure_reserve(bottle.regulator, content.pressure, draw.peak_flow) / bottle.regulator.set_pressure
    if to_spare <= flow_limit(bottle, content.pressure, content.temperature) / draw.peak_flow - 1.0:
        return "its pressure is too low to maintain the supply pressure"
    return "its pressure is too low to drive the largest flow through the regulator"
