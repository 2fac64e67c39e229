"""State of a gas bottle over a walk: time series, reason of the end, and balances of mass and energy."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

from ppafo.engine.lanes import Floats
from ppafo.model.cold_gas import DRY_ICE, SupplyState
from ppafo.report.kind import duration_kind
from ppafo.signals import Channel, Recording
from ppafo.walking.bottle.supply import BottleSupply

EndKind = Literal["walk's end", "empty", "too cold", "frozen", "iced", "too little flow", "stopped", "diverged"]
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
"""Series of a supply by name, with their units."""


class SupplyEnding(NamedTuple):
    """End of a walk caused by its gas bottle: reason code, explanation as a sentence, and time [s]."""

    kind: EndKind
    message: str
    time: float


class SupplyBalance(NamedTuple):
    """Mass and energy balances of a supply, from the start of a walk to its end.

    Mass [kg]: left_bottle = regulated + iced, which are the gas that left the bottle, the gas through the regulator and
    the dry ice in the seat.

    Energy [J]: given_up + ice + room = delivered. ``given_up`` is the energy released by content, wall, regulator and
    hose, ``ice`` the enthalpy difference of the dry ice in the seat, ``room`` the heat from the room, and ``delivered``
    the enthalpy of the gas downstream of the hose.
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
    """State of a supply over a walk.

    ``times`` [s] (n,) are the times of data exchange between bottle and device, ``values`` (n,) the series by name, in
    the units of ``UNITS``. ``first`` and ``last`` are the states at the start and at the end, ``regulated`` is the gas
    through the regulator [kg], ``walked`` and ``rested`` are the times of walking and of rests [s].
    """

    supply: BottleSupply
    times: Floats
    values: Mapping[str, Floats]
    first: SupplyState
    last: SupplyState
    regulated: float
    walked: float
    rested: float
    ending: SupplyEnding

    @property
    def recording(self) -> Recording:
        """State of the supply over the walk as a recording."""
        channels = {name: Channel(values, UNITS[name]) for name, values in self.values.items()}
        return Recording(f"bottle {self.supply.bottle.name}", self.times, channels, kind="simulated")

    @property
    def balance(self) -> SupplyBalance:
        """Mass and energy balances of the supply from the start of the walk to the end."""
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


def duration_text(seconds: float) -> str:
    """Return a duration as text with three significant digits, in seconds to 2 min, in whole minutes from 1000 min."""
    kind = duration_kind(seconds)
    return kind.text(seconds, ".0f" if kind.values(seconds) >= 999.5 else ".3g")


def strides_text(strides: float) -> str:
    """Return a number of strides as text, with one decimal below 100 and none above."""
    return f"{strides:.1f}" if strides < 99.5 else f"{strides:.0f}"
