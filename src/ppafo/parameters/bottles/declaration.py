"""Declarations of the numbers of a bottle file with their ranges, and file layout."""

from collections.abc import Mapping
from typing import Any

from ppafo.documents.toml_text import NAME
from ppafo.model.declaration import Quantity
from ppafo.parameters.declared import Field, InnerTable, Words, inside, schema_of
from ppafo.parameters.overrides import Forms
from ppafo.parameters.parameter_set import NUMBER_ENTRY, TEXT_ENTRY

BOTTLE = (
    Quantity("volume", "m^3", "internal volume of the bottle", minimum=1e-6, maximum=1.0),
    Quantity("wall_heat_capacity", "J/K", "heat capacity of the bottle's wall", minimum=1e-3, maximum=1e9),
    Quantity("content_heat_transfer", "W/K", "heat conductance from wall to fluid", minimum=0.0, maximum=1e6),
    Quantity("room_heat_transfer", "W/K", "heat conductance from the room to the wall", minimum=0.0, maximum=1e6),
)
FILL_BY_MASS = (Quantity("gas_mass", "kg", "mass of gas in a full bottle", minimum=0.0, minimum_allowed=False),)
FILL_BY_PRESSURE = (
    Quantity("fill_pressure", "Pa_a", "pressure of a full bottle", minimum=1e5, maximum=1e8),
    Quantity(
        "fill_temperature", "K", "temperature at which the bottle has that pressure", minimum=200.0, maximum=400.0
    ),
)
FILLS: Forms = {"bottle": tuple(tuple(quantity.name for quantity in form) for form in (FILL_BY_MASS, FILL_BY_PRESSURE))}
"""Alternative forms of a bottle filling: by mass, or by pressure and temperature."""
REGULATOR = (
    Quantity("set_pressure", "Pa_a", "outlet pressure of the regulator without flow", minimum=1e5, maximum=2e7),
    Quantity("droop", "Pa s/kg", "drop of the outlet pressure per mass flow", minimum=0.0, maximum=1e9),
    Quantity("pressure_margin", "Pa_d", "minimum pressure drop that the regulator needs", minimum=0.0, maximum=1e7),
    Quantity("area", "m^2", "flow area of the regulator, fully open", minimum=0.0, maximum=1e-3, minimum_allowed=False),
    Quantity(
        "discharge_coefficient",
        "",
        "discharge coefficient of the regulator",
        minimum=0.0,
        maximum=2.0,
        minimum_allowed=False,
    ),
)


def _passage(component: str, short_name: str) -> tuple[Quantity, ...]:
    """Return the quantities of a component in the gas path, in the order of ``Passage``."""
    warming = f"effectiveness of the {short_name}: gas temperature rise over the initial difference"
    conductance = f"heat conductance from the room to the {short_name}"
    return (
        Quantity("heat_capacity", "J/K", f"heat capacity of the {component}", minimum=1e-3, maximum=1e6),
        Quantity("effectiveness", "", warming, minimum=0.0, maximum=1.0),
        Quantity("room_heat_transfer", "W/K", conductance, minimum=0.0, maximum=1e6),
    )


BODY = (
    *_passage("regulator's body", "regulator"),
    Quantity(
        "ice_capacity",
        "kg",
        "dry ice that closes the regulator's seat",
        minimum=0.0,
        maximum=1.0,
        minimum_allowed=False,
    ),
)
HOSE = _passage("hose to the device", "hose")
ROOM = (Quantity("temperature", "K", "temperature of the room, and initially of bottle and gas"),)

SECTIONS: dict[str, tuple[Quantity, ...]] = {
    "bottle": BOTTLE + FILL_BY_MASS + FILL_BY_PRESSURE,
    "regulator": REGULATOR + BODY,
    "hose": HOSE,
    "room": ROOM,
}
_OPTIONAL = "hose"
"""Optional section of a bottle file."""

PATHS: dict[str, Quantity] = {
    f"{section}.{quantity.name}": quantity for section, members in SECTIONS.items() for quantity in members
}
"""Declaration of every number of a bottle, by dotted path."""
REQUIRED = tuple(
    f"{section}.{quantity.name}"
    for section, members in (("bottle", BOTTLE), ("regulator", REGULATOR), ("room", ROOM))
    for quantity in members
)
"""Paths of numbers without a default, without the filling, which has two forms."""

WARMING = (*(f"regulator.{quantity.name}" for quantity in BODY), *(f"hose.{quantity.name}" for quantity in HOSE))
"""Paths of values for the warming of the gas in regulator and hose; defaults from the paper's bottle."""


def declared(_document: Mapping[str, Any]) -> dict[str, Field]:
    """Return every field of a bottle file, by path."""
    fields: dict[str, Field] = {
        "schema_version": Words("version of this layout", True, (1,)),
        "name": Words(required=True, pattern=NAME),
        "title": Words(required=True),
        "notes": Words(),
        **inside("gas", TEXT_ENTRY, "name of the fluid, which needs a property table", required=True),
        **{section: InnerTable(f"section {section}", section != _OPTIONAL) for section in SECTIONS},
    }
    for path, quantity in PATHS.items():
        fields |= inside(path, NUMBER_ENTRY, f"{quantity.summary} [{quantity.unit or '-'}]")
    return fields


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a bottle file."""
    return schema_of("ppafo bottle", declared)
