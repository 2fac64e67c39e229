"""Numbers of a bottle file with their ranges, property table of its fluid, and gas mass from pressure and temperature.

The tables are made from CoolProp.
"""

import functools
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Any

from ppafo.documents.toml_text import NAME
from ppafo.errors import ParameterError
from ppafo.model.declaration import Quantity
from ppafo.model.source import FluidTable, fluid_pressure, gas_density, has_liquid
from ppafo.parameters.declared import Field, InnerTable, Words, inside, schema_of
from ppafo.parameters.overrides import Forms
from ppafo.parameters.parameter_set import NUMBER_ENTRY, TEXT_ENTRY, Entry
from ppafo.units.shown import shown_text
from ppafo.wording import known_names, said_missing

_TABLES = resources.files("ppafo.parameters.bottles") / "fluid_tables"
_SUFFIX = ".json"
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


@dataclass(frozen=True, slots=True)
class Fluid:
    """Fluid: name, property table, and source of the numbers."""

    name: str
    table: FluidTable
    source: str


def list_fluids() -> tuple[str, ...]:
    """Return the names of the fluids that have a property table."""
    return tuple(sorted(file.name.removesuffix(_SUFFIX) for file in _TABLES.iterdir() if file.name.endswith(_SUFFIX)))


@functools.cache
def load_fluid(name: str) -> Fluid:
    """Load a fluid by name. Raises ParameterError if it has no property table."""
    available = list_fluids()
    if name not in available:
        raise ParameterError(f"there is no property table for '{name}'{known_names(name, available)}")
    content = json.loads((_TABLES / f"{name}{_SUFFIX}").read_text(encoding="utf-8"))
    table = FluidTable(
        gas_constant=content["gas_constant"],
        temperatures=tuple(content["temperatures"]),
        fractions=tuple(content["shares"]),
        densest=tuple(content["densest"]),
        liquid_densities=tuple(content.get("liquid_densities", ())),
        liquid_energies=tuple(content.get("liquid_energies", ())),
        factors=tuple(map(tuple, content["factors"])),
        energies=tuple(map(tuple, content["energies"])),
    )
    return Fluid(name, table, f"{content['source']}; reference {content['reference']}")


def check_temperature(path: str, temperature: float, fluid: Fluid, file: str) -> None:
    """Raise ParameterError for a temperature [K] that the property table of the fluid does not cover."""
    coldest, hottest = fluid.table.temperatures[0], fluid.table.temperatures[-1]
    if not coldest < temperature <= hottest:
        raise ParameterError(
            f"{file}: {path} = {temperature:g} K: must be above {coldest:g} K and at most {hottest:g} K, the range "
            f"of the properties of {fluid.name}"
        )


def filled_mass(values: Mapping[str, float], entries: Mapping[str, Entry], fluid: Fluid, file: str) -> float:
    """Return the mass of gas in a full bottle [kg], stated directly or by pressure and temperature.

    ``values`` are numbers of a bottle in SI by path, ``entries`` the same as given. Raises ParameterError if none or
    both of the forms are given, or if pressure and temperature do not determine the mass.
    """
    by_pressure = [f"bottle.{quantity.name}" for quantity in FILL_BY_PRESSURE]
    given = [path for path in by_pressure if path in values]
    # Exactly one form: by mass, or by pressure and temperature.
    if ("bottle.gas_mass" in values) == bool(given):
        raise ParameterError(f"{file}: give either bottle.gas_mass or {' and '.join(by_pressure)}")
    if not given:
        return values["bottle.gas_mass"]
    missing = [path for path in by_pressure if path not in values]
    if missing:
        raise ParameterError(f"{file}: {said_missing(missing)}, which {given[0]} requires")
    pressure, temperature = (values[path] for path in by_pressure)
    check_temperature("bottle.fill_temperature", temperature, fluid, file)
    # Above the saturated vapour the rest is liquid: pressure and temperature then leave the mass open.
    highest = fluid_pressure(fluid.table, temperature, math.inf)
    if highest < pressure:
        path = "bottle.fill_pressure"
        limit = f"{shown_text(highest, 'Pa_a', '.4g', unit=entries[path].unit)} at {temperature:g} K"
        raise ParameterError(
            f"{file}: {path}: {fluid.name} is liquid above {limit}; give bottle.gas_mass instead"
            if has_liquid(fluid.table)
            else f"{file}: {path}: the property table of {fluid.name} ends at {limit}; give a lower pressure"
        )
    return values["bottle.volume"] * gas_density(fluid.table, temperature, pressure)
