"""Gas bottles by name or file: numbers with their ranges, properties of the fluid from CoolProp, filling."""

import functools
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.documents.toml_text import NAME, TomlKind
from ppafo.errors import Faults, ParameterError, UnitError, refused_as
from ppafo.model.cold_gas import ColdSupply, Passage
from ppafo.model.declaration import Quantity
from ppafo.model.gas import SPECIES
from ppafo.model.source import (
    BottleWall,
    FluidTable,
    Regulator,
    bottle_content,
    densest_gas,
    fluid_pressure,
    gas_density,
    has_liquid,
    liquid_density,
    pressure_reserve,
)
from ppafo.parameters.declared import Field, InnerTable, Words, check_keys, inside, schema_of, value_at
from ppafo.parameters.overrides import Forms, other_forms, override_set, read_overrides
from ppafo.parameters.parameter_set import NUMBER_ENTRY, SOURCE, TEXT_ENTRY, Entry, allowed_number
from ppafo.parameters.records import record_from
from ppafo.units import format_quantity, split_quantity
from ppafo.units.shown import shown_text
from ppafo.wording import changed_text, check_known, nearest_name, said_missing

PAPER_BOTTLE = "paper-co2-9oz"
FILE = TomlKind("bottle", "bottle", resources.files("ppafo.parameters.bottles") / "files", ParameterError)
_TABLES = resources.files("ppafo.parameters.bottles") / "fluid_tables"
_SUFFIX = ".json"
FILLS: Forms = {"bottle": (("gas_mass",), ("fill_pressure", "fill_temperature"))}
"""Alternative forms of a bottle filling: by mass, or by pressure and temperature."""
_OPTIONAL = "hose"
"""Optional section of a bottle file."""


def _passage(component: str, short_name: str) -> tuple[Quantity, ...]:
    """Return the quantities of a component in the gas path, in the order of ``Passage``."""
    warming = f"effectiveness of the {short_name}: gas temperature rise over the initial difference"
    conductance = f"heat conductance from the room to the {short_name}"
    return (
        Quantity("heat_capacity", "J/K", f"heat capacity of the {component}", minimum=1e-3, maximum=1e6),
        Quantity("effectiveness", "", warming, minimum=0.0, maximum=1.0),
        Quantity("room_heat_transfer", "W/K", conductance, minimum=0.0, maximum=1e6),
    )


def _above_zero(name: str, unit: str, summary: str, maximum: float) -> Quantity:
    return Quantity(name, unit, summary, minimum=0.0, maximum=maximum, minimum_allowed=False)


SECTIONS: dict[str, tuple[Quantity, ...]] = {
    "bottle": (
        Quantity("volume", "m^3", "internal volume of the bottle", minimum=1e-6, maximum=1.0),
        Quantity("wall_heat_capacity", "J/K", "heat capacity of the bottle's wall", minimum=1e-3, maximum=1e9),
        Quantity("content_heat_transfer", "W/K", "heat conductance from wall to fluid", minimum=0.0, maximum=1e6),
        Quantity("room_heat_transfer", "W/K", "heat conductance from the room to the wall", minimum=0.0, maximum=1e6),
        _above_zero("gas_mass", "kg", "mass of gas in a full bottle", math.inf),
        Quantity("fill_pressure", "Pa_a", "pressure of a full bottle", minimum=1e5, maximum=1e8),
        Quantity("fill_temperature", "K", "temperature at which the bottle has that pressure", None, 200.0, 400.0),
    ),
    "regulator": (
        Quantity("set_pressure", "Pa_a", "outlet pressure of the regulator without flow", minimum=1e5, maximum=2e7),
        Quantity("droop", "Pa s/kg", "drop of the outlet pressure per mass flow", minimum=0.0, maximum=1e9),
        Quantity("pressure_margin", "Pa_d", "minimum pressure drop that the regulator needs", minimum=0.0, maximum=1e7),
        _above_zero("area", "m^2", "flow area of the regulator, fully open", 1e-3),
        _above_zero("discharge_coefficient", "", "discharge coefficient of the regulator", 2.0),
        *_passage("regulator's body", "regulator"),
        _above_zero("ice_capacity", "kg", "dry ice that closes the regulator's seat", 1.0),
    ),
    "hose": _passage("hose to the device", "hose"),
    "room": (Quantity("temperature", "K", "temperature of the room, and initially of bottle and gas"),),
}

PATHS: dict[str, Quantity] = {
    f"{section}.{quantity.name}": quantity for section, members in SECTIONS.items() for quantity in members
}
"""Declaration of every number of a bottle, by dotted path."""
WARMING = (
    *(f"regulator.{name}" for name in (*Passage._fields, "ice_capacity")),
    *(f"hose.{name}" for name in Passage._fields),
)
"""Paths of values for the warming of the gas in regulator and hose; defaults from the paper's bottle."""
REQUIRED = tuple(path for path in PATHS if path not in WARMING and not other_forms(path, FILLS))
"""Paths of numbers without a default, without the filling, which has two forms."""


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
    check_known(name, available, ParameterError, f"there is no property table for '{name}'")
    content = json.loads((_TABLES / f"{name}{_SUFFIX}").read_text(encoding="utf-8"))
    columns = {"fractions": content["shares"], **content}
    table = FluidTable(*(_fixed(columns.get(name, ())) for name in FluidTable._fields))
    return Fluid(name, table, f"{content['source']}; reference {content['reference']}")


def _fixed(value: Any) -> Any:
    return tuple(map(_fixed, value)) if isinstance(value, list) else value


def check_temperature(path: str, temperature: float, fluid: Fluid, file: str) -> None:
    """Raise ParameterError for a temperature [K] that the property table of the fluid does not cover."""
    coldest = fluid.table.temperatures[0]
    hottest = fluid.table.temperatures[-1]
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
    by_pressure = ["bottle.fill_pressure", "bottle.fill_temperature"]
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
            else f"{file}: {path}: the property table of {fluid.name} ends at {limit}"
        )
    return values["bottle.volume"] * gas_density(fluid.table, temperature, pressure)


@dataclass(frozen=True, slots=True)
class Bottle:
    """Full bottle with its regulator, in SI: volume [m^3], mass of gas [kg], room temperature [K].

    ``title`` lists the values that overrides changed. ``entries`` maps each dotted path to its value as given, with the
    source.
    """

    name: str
    title: str
    fluid: Fluid
    heat_capacity_ratio: float
    volume: float
    mass: float
    wall: BottleWall
    regulator: Regulator
    room_temperature: float
    body: Passage
    ice_capacity: float
    hose: Passage
    entries: Mapping[str, Entry]

    @property
    def label(self) -> str:
        """Name of the bottle for sentences and titles, with a remark if overrides changed values."""
        is_changed = any(entry.source == SOURCE for entry in self.entries.values())
        return f"{self.name} (values changed)" if is_changed else self.name

    @property
    def supply(self) -> ColdSupply:
        """Bottle, regulator and hose as parameters of the gas supply model."""
        return ColdSupply(**{name: getattr(self, name) for name in ColdSupply._fields})


def list_bottles() -> tuple[str, ...]:
    """Return the names of the bundled bottles."""
    return tuple(FILE.names())


def load_bottle(name_or_path: str | Path, overrides: Iterable[str] = ()) -> Bottle:
    """Return a bottle by name or path of a TOML file, with overrides applied.

    ``overrides`` are texts such as ``bottle.gas_mass=567 g`` or ``room.temperature=5 degC``.
    """
    parsed, stated, file = _read(name_or_path)
    # A file need not state how its regulator and hose warm the gas: they then do so as the paper's.
    _, paper, _ = _read(PAPER_BOTTLE)
    entries = {path: paper[path] for path in WARMING} | stated
    changes = override_set(read_overrides(overrides), forms=FILLS)
    for path, override in changes.items():
        if path not in PATHS:
            raise ParameterError(
                f"override '{override}': a bottle has no parameter '{path}'{nearest_name(path, PATHS)}"
            )
        with refused_as(ParameterError, f"override '{override}'", UnitError):
            value, unit = split_quantity(override.text)
        # A new form of the filling replaces the old one: two forms would contradict each other.
        for other in other_forms(path, FILLS):
            entries.pop(other, None)
        entries[path] = Entry(value=value, unit=unit, origin="assumed", source=SOURCE)
    bottle = _build(parsed, entries, file)
    changed = changed_text(map(str, changes.values()))
    return replace(bottle, title=f"{bottle.title} ({changed})") if changes else bottle


def _read(name_or_path: str | Path) -> tuple[dict[str, Any], dict[str, Entry], str]:
    """Read and check a bottle file. Returns its document, its numbers by dotted path, and its label in messages."""
    source = FILE.load(name_or_path)
    document = source.document
    check_keys(source, declared(document))
    tables = {path: table for path in PATHS if (table := value_at(document, path)) is not None}
    return document, {path: record_from(Entry, table) for path, table in tables.items()}, source.label


def _build(parsed: Mapping[str, Any], entries: Mapping[str, Entry], file: str) -> Bottle:
    """Build a bottle from its values. Raises ParameterError for missing or impossible values."""
    with refused_as(ParameterError, f"{file}: gas = '{parsed['gas']['value']}'", ParameterError):
        fluid = load_fluid(parsed["gas"]["value"])
    values: dict[str, float] = {}
    wrong = Faults()
    for path, entry in entries.items():
        with wrong:
            assignment = f"{file}: {path} = {format_quantity(entry.value, entry.unit)}"
            values[path] = allowed_number(assignment, entry, PATHS[path])
    missing = [path for path in REQUIRED if path not in entries]
    if missing:
        wrong.append(ParameterError(f"{file}: {said_missing(missing)}"))
    wrong.raise_all()
    bottle = Bottle(
        name=parsed["name"],
        title=parsed["title"],
        fluid=fluid,
        heat_capacity_ratio=SPECIES[fluid.name].heat_capacity_ratio,
        volume=values["bottle.volume"],
        mass=filled_mass(values, entries, fluid, file),
        wall=BottleWall(**{name: values[f"bottle.{name}"] for name in BottleWall._fields}),
        regulator=Regulator(
            set_pressure=values["regulator.set_pressure"],
            droop=values["regulator.droop"],
            pressure_margin=values["regulator.pressure_margin"],
            seat_area=values["regulator.area"] * values["regulator.discharge_coefficient"],
        ),
        room_temperature=values["room.temperature"],
        body=Passage(*(values[f"regulator.{name}"] for name in Passage._fields)),
        ice_capacity=values["regulator.ice_capacity"],
        hose=Passage(*(values[f"hose.{name}"] for name in Passage._fields)),
        entries=entries,
    )
    temperature = bottle.room_temperature
    check_temperature("room.temperature", temperature, fluid, file)
    # Liquid can fill the whole bottle; a gas without liquid is limited by its table.
    is_wet = has_liquid(fluid.table)
    largest_mass = bottle.volume * (liquid_density if is_wet else densest_gas)(fluid.table, temperature)
    if bottle.mass >= largest_mass:
        volume = bottle.entries["bottle.volume"]
        raise ParameterError(
            f"{file}: {GRAMS_PER_KILOGRAM * bottle.mass:.4g} g of {fluid.name} do not fit into bottle.volume = "
            f"{format_quantity(volume.value, volume.unit)} at {temperature:g} K, but "
            f"{GRAMS_PER_KILOGRAM * largest_mass:.4g} g"
        )
    content = bottle_content(fluid.table, bottle.mass, bottle.volume, temperature)
    if pressure_reserve(bottle.regulator, content.pressure, 0.0) <= 0.0:
        required = bottle.regulator.set_pressure + bottle.regulator.pressure_margin
        unit = bottle.entries["regulator.set_pressure"].unit
        raise ParameterError(
            f"{file}: the full bottle has {shown_text(content.pressure, 'Pa_a', '.4g', unit=unit)} at "
            f"{temperature:g} K, but the regulator needs {shown_text(required, 'Pa_a', '.4g', unit=unit)}, the sum of "
            "regulator.set_pressure and regulator.pressure_margin"
        )
    return bottle
