"""What a file of a bottle holds: every value with unit, range and meaning, and the layout of the file."""

import functools
from typing import Any, Literal

from pydantic import BaseModel, Field

from ppafo.documents.models import NAME, optional, published_schema, table
from ppafo.model.declaration import Quantity
from ppafo.parameters.provenance import Entry, TextEntry

BOTTLE = (
    Quantity("volume", "m^3", "room for gas in the bottle", minimum=1e-6, maximum=1.0),
    Quantity("wall_heat_capacity", "J/K", "heat capacity of the bottle's wall", minimum=1e-3, maximum=1e9),
    Quantity("content_heat_transfer", "W/K", "heat from wall to content per kelvin", minimum=0.0, maximum=1e6),
    Quantity("room_heat_transfer", "W/K", "heat from the room to the wall per kelvin", minimum=0.0, maximum=1e6),
)
FILL_BY_MASS = (Quantity("gas_mass", "kg", "mass of gas in a full bottle", minimum=0.0, minimum_allowed=False),)
FILL_BY_PRESSURE = (
    Quantity("fill_pressure", "Pa_a", "pressure of a full bottle", minimum=1e5, maximum=1e8),
    Quantity(
        "fill_temperature", "K", "temperature at which the bottle has that pressure", minimum=200.0, maximum=400.0
    ),
)
REGULATOR = (
    Quantity("set_pressure", "Pa_a", "pressure behind the regulator without flow", minimum=1e5, maximum=2e7),
    Quantity("droop", "Pa s/kg", "fall of the regulated pressure per mass flow", minimum=0.0, maximum=1e9),
    Quantity("pressure_margin", "Pa_d", "inlet above outlet that the regulator needs", minimum=0.0, maximum=1e7),
    Quantity(
        "area", "m^2", "area of the regulator's seat, fully open", minimum=0.0, maximum=1e-3, minimum_allowed=False
    ),
    Quantity("discharge_coefficient", "", "its Cd", minimum=0.0, maximum=2.0, minimum_allowed=False),
)
ROOM = (Quantity("temperature", "K", "temperature of the room, and of bottle and gas at the start"),)

SECTIONS: dict[str, tuple[Quantity, ...]] = {
    "bottle": BOTTLE + FILL_BY_MASS + FILL_BY_PRESSURE,
    "regulator": REGULATOR,
    "room": ROOM,
}
PATHS: dict[str, Quantity] = {
    f"{section}.{item.name}": item for section, members in SECTIONS.items() for item in members
}
NEEDED = tuple(
    f"{section}.{item.name}"
    for section, members in (("bottle", BOTTLE), ("regulator", REGULATOR), ("room", ROOM))
    for item in members
)


def _section(name: str) -> Any:
    fields = {item.name: optional(Entry, f"{item.summary} [{item.unit or '-'}]") for item in SECTIONS[name]}
    return table(f"{name.capitalize()}OfABottle", fields)


@functools.cache
def bottle_file() -> type[BaseModel]:
    """Return the layout of a file of a bottle."""
    fields: dict[str, Any] = {
        "schema_version": (Literal[1], Field(description="version of this layout")),
        "name": (str, Field(pattern=NAME)),
        "title": (str, Field(min_length=1)),
        "notes": (str, ""),
        "gas": (TextEntry, Field(description="the fluid, one that has a property table")),
    }
    fields |= {name: (_section(name), Field(description=f"section {name}")) for name in SECTIONS}
    return table("BottleFile", fields)


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a file of a bottle."""
    return published_schema(bottle_file(), "ppafo bottle")
