"""A bottle over a walk: what it went through, what ended it, and what must close."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

from ppafo.engine.lanes import Floats
from ppafo.model.cold_gas import DRY_ICE, SupplyState
from ppafo.report.display_units import display_value, quantity_text
from ppafo.signals import Channel, Recording
from ppafo.walking.bottle.supply import BottleSupply

EndKind = Literal["walk's end", "empty", "too cold", "frozen", "iced", "too little flow", "diverged"]
WALKED: EndKind = "walk's end"
DIVERGED: EndKind = "diverged"

UNITS = {
    "bottle_mass": "kg",
    "liquid_mass": "kg",
    "bottle_temperature": "K",
    "wall_temperature": "K",
    "bottle_pressure": "Pa",
    "regulator_temperature": "K",
    "hose_temperature": "K",
    "outlet_temperature": "K",
    "gas_temperature": "K",
    "regulated_pressure": "Pa",
    "seat_open": "-",
}
"""Values of a supply by name, with their units."""


class SupplyEnding(NamedTuple):
    """End of a walk on its bottle: kind, a sentence, and its time [s]."""

    kind: EndKind
    message: str
    time: float


class SupplyBalance(NamedTuple):
    """Balances of a supply: gas out of the bottle, through its regulator and as ice [kg], energy of all parts [J].

    left_bottle = regulated + iced. ``given_up`` is what content, wall, regulator and hose lost, ``ice`` the enthalpy
    that the dry ice in the seat lacks, ``room`` the heat of the room, ``delivered`` the enthalpy of the gas behind the
    hose: given_up + ice + room = delivered.
    """

    left_bottle: float
    regulated: float
    iced: float
    given_up: float
    ice: float
    room: float
    delivered: float


@dataclass(frozen=True, slots=True, eq=False)
class SupplyCourse:
    """A supply over a walk: times [s] (n,) at which bottle and device met, values (n,) by name in ``UNITS``."""

    supply: BottleSupply
    times: Floats
    values: Mapping[str, Floats]
    first: SupplyState
    last: SupplyState
    regulated: float
    ending: SupplyEnding

    @property
    def recording(self) -> Recording:
        """Return the course of the supply as a recording."""
        channels = {name: Channel(values, UNITS[name]) for name, values in self.values.items()}
        return Recording(f"bottle {self.supply.bottle.name}", self.times, channels, kind="simulated")

    @property
    def balance(self) -> SupplyBalance:
        """Mass and energy balances of the supply from start to end."""
        first, last, supply = self.first, self.last, self.supply.bottle.supply
        parts = (
            first.energy - last.energy,
            supply.wall.wall_heat_capacity * (first.wall_temperature - last.wall_temperature),
            supply.body.heat_capacity * (first.body_temperature - last.body_temperature),
            supply.hose.heat_capacity * (first.hose_temperature - last.hose_temperature),
        )
        return SupplyBalance(
            left_bottle=first.mass - last.mass,
            regulated=self.regulated,
            iced=last.ice,
            given_up=sum(parts),
            ice=(DRY_ICE - self.supply.line.enthalpies[0]) * last.ice,
            room=last.room_heat,
            delivered=last.delivered,
        )


def lasted(course: SupplyCourse) -> float | None:
    """Time that a bottle lasted [s]; None where the walk ended before it, or diverged."""
    return None if course.ending.kind in (WALKED, DIVERGED) else course.ending.time


def minutes_text(seconds: float) -> str:
    """Return minutes with three digits, and whole ones where there are more."""
    return quantity_text(seconds, "duration", ".0f" if display_value(seconds, "duration") >= 999.5 else ".3g")


def strides_text(strides: float) -> str:
    """Return a number of strides as it is shown: a decimal of few, such as of task sequences, whole ones of many."""
    return f"{strides:.1f}" if strides < 99.5 else f"{strides:.0f}"
