"""Gas bottles: their files and fluids, and bottles of the catalogue of parts.

Fluids are property tables by name, made from CoolProp. The catalogue of parts states only the gas of a bottle and its
mass. All other values are scaled from the paper's bottle at the same filling density: volume in proportion to the gas,
heat capacity of the wall to the mass, surfaces to the 2/3 power of the volume.
"""

import functools
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import BaseModel, Field

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.documents.models import SchemaVersion, make_schema, optional, read_model, table
from ppafo.documents.problems import NAME
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import ParameterError, UnitError, refused_as
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
from ppafo.parameters.overrides import Forms, other_forms, override_set, read_overrides
from ppafo.parameters.parameter_set import Entry, TextEntry, allowed_number
from ppafo.parameters.parts import Part, load_catalogue
from ppafo.parameters.parts.catalogue import Figure
from ppafo.units import format_quantity, split_quantity
from ppafo.units.shown import shown_text
from ppafo.wording import nearest_name, said_missing

_FOLDER = resources.files("ppafo.parameters.bottles") / "fluid_tables"
_SUFFIX = ".json"


@dataclass(frozen=True, slots=True)
class Fluid:
    """Fluid: name, table of properties, and source of the numbers."""

    name: str
    table: FluidTable
    source: str


def list_fluids() -> tuple[str, ...]:
    """Return the names of the fluids that have a property table."""
    return tuple(sorted(file.name.removesuffix(_SUFFIX) for file in _FOLDER.iterdir() if file.name.endswith(_SUFFIX)))


@functools.cache
def load_fluid(name: str) -> Fluid:
    """Return a fluid by name; ParameterError if it has no property table."""
    known = list_fluids()
    if name not in known:
        raise ParameterError(
            f"there is no property table of '{name}'{nearest_name(name, known)}; available: {', '.join(known)}"
        )
    content = json.loads((_FOLDER / f"{name}{_SUFFIX}").read_text(encoding="utf-8"))
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


_SURFACES = ("bottle.content_heat_transfer", "bottle.room_heat_transfer")
_WALL = 885.0
"""Heat capacity of the paper's bottle divided by its mass [J/(kg K)]: 400 J/K and 452 g."""


@functools.cache
def bottle_parts() -> Mapping[str, Part]:
    """Return the bottles of the bundled catalogue, by name."""
    return load_catalogue().groups["bottles"]


def scaled_entries(part: Part, paper: Mapping[str, Entry]) -> dict[str, Entry]:
    """Return the values of a bottle scaled from the ``paper``'s to the gas mass [kg] and empty mass [kg] of a part."""
    content, empty = part.values["content"], part.values["empty_mass"]
    # The same density of filling: content over the paper's, and the volume with it.
    ratio = 1000.0 * content / paper["bottle.gas_mass"].value
    volume, wall = paper["bottle.volume"].value * ratio, _WALL * empty
    found = {
        "bottle.gas_mass": (1000.0 * content, "g", f"catalogue of parts, {part.name}"),
        "bottle.volume": (volume, "cm^3", "filled as densely as the paper's"),
        "bottle.wall_heat_capacity": (wall, "J/K", "its empty mass, at 885 J/(kg K) as the paper's"),
    }
    # Heat passes surfaces: of similar bodies they grow with the two thirds power of the volume.
    surface = ratio ** (2.0 / 3.0)
    for path in _SURFACES:
        scaled = paper[path].value * surface
        found[path] = (scaled, paper[path].unit, "the paper's bottle, with the surface of its fluid")
    return dict(paper) | {
        path: Entry(value=value, unit=unit, origin="derived", source=source)
        for path, (value, unit, source) in found.items()
    }


PAPER_BOTTLE = "paper-co2-9oz"

FILE = TomlKind("bottle", "bottle", resources.files("ppafo.parameters.bottles") / "files", ParameterError)

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
"""Alternative forms of the filling of a bottle: by mass, or by pressure and temperature."""
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


def _passed(part: str, short: str) -> tuple[Quantity, ...]:
    """Return the quantities of a component in the gas path, in the order of ``Passage``."""
    warms = f"share of the way to the {short}'s temperature that the gas warms"
    return (
        Quantity("heat_capacity", "J/K", f"heat capacity of the {part}", minimum=1e-3, maximum=1e6),
        Quantity("effectiveness", "", warms, minimum=0.0, maximum=1.0),
        Quantity(
            "room_heat_transfer", "W/K", f"heat conductance from the room to the {short}", minimum=0.0, maximum=1e6
        ),
    )


BODY = (
    *_passed("regulator's body", "regulator"),
    Quantity(
        "ice_capacity",
        "kg",
        "dry ice that closes the regulator's seat",
        minimum=0.0,
        maximum=1.0,
        minimum_allowed=False,
    ),
)
HOSE = _passed("hose to the device", "hose")
ROOM = (Quantity("temperature", "K", "temperature of the room, and initially of bottle and gas"),)

SECTIONS: dict[str, tuple[Quantity, ...]] = {
    "bottle": BOTTLE + FILL_BY_MASS + FILL_BY_PRESSURE,
    "regulator": REGULATOR + BODY,
    "hose": HOSE,
    "room": ROOM,
}
_MAY_LACK = "hose"
"""Optional section of a bottle file."""

PATHS: dict[str, Quantity] = {
    f"{section}.{quantity.name}": quantity for section, members in SECTIONS.items() for quantity in members
}
NEEDED = tuple(
    f"{section}.{quantity.name}"
    for section, members in (("bottle", BOTTLE), ("regulator", REGULATOR), ("room", ROOM))
    for quantity in members
)

WARMING = (*(f"regulator.{quantity.name}" for quantity in BODY), *(f"hose.{quantity.name}" for quantity in HOSE))
"""Values for the warming of the gas in regulator and hose; by default those of the paper's bottle."""


@functools.cache
def bottle_file() -> type[BaseModel]:
    """Return the model of a bottle file."""
    fields: dict[str, Any] = {
        "schema_version": (SchemaVersion, ...),
        "name": (str, Field(pattern=NAME)),
        "title": (str, Field(min_length=1)),
        "notes": (str, ""),
        "gas": (TextEntry, Field(description="name of the fluid, which needs a property table")),
    }
    for name, members in SECTIONS.items():
        own = {quantity.name: optional(Entry, f"{quantity.summary} [{quantity.unit or '-'}]") for quantity in members}
        section, described = table(f"{name.capitalize()}OfABottle", own), f"section {name}"
        fields[name] = optional(section, described) if name == _MAY_LACK else (section, Field(description=described))
    return table("BottleFile", fields)


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a bottle file."""
    return make_schema(bottle_file(), "ppafo bottle")


@dataclass(frozen=True, slots=True)
class Bottle:
    """Full bottle with its regulator, in SI: volume [m^3], mass of gas [kg], room temperature [K].

    ``entries`` maps each dotted path to its value as given, with the source.
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
    def supply(self) -> ColdSupply:
        """Bottle, regulator and hose as parameters of the model."""
        return ColdSupply(
            volume=self.volume,
            wall=self.wall,
            regulator=self.regulator,
            body=self.body,
            ice_capacity=self.ice_capacity,
            hose=self.hose,
            room_temperature=self.room_temperature,
            heat_capacity_ratio=self.heat_capacity_ratio,
        )


def is_of_catalogue(name_or_path: str | Path) -> bool:
    """Return True if a name is a part of a catalogue file, ``CATALOGUE.toml/PART``."""
    return Path(name_or_path).parent.suffix == ".toml"


def _part_of(name_or_path: str | Path) -> Part | None:
    """Return the catalogue part of a bottle by name or ``CATALOGUE.toml/PART``; None for a bottle with a file."""
    path = Path(name_or_path)
    if is_of_catalogue(path):
        return load_catalogue(path.parent).part("bottles", path.name)
    # A bottle file has its own walls and regulator; a part of the same name has only a content and a mass.
    return None if str(name_or_path) in FILE.names() else bottle_parts().get(str(name_or_path))


def list_bottles() -> tuple[str, ...]:
    """Return the names of the bundled bottles: bottle files, and bottles of the catalogue."""
    return tuple(dict.fromkeys((*FILE.names(), *bottle_parts())))


def described_bottles() -> list[dict[str, Any]]:
    """Return name and title of each bundled bottle."""
    titles = {
        name: f"{part.title}, {1000.0 * part.values['content']:.0f} g, of the catalogue of parts"
        for name, part in bottle_parts().items()
    }
    # A bottle file has its own walls and regulator, and comes before a part of its name.
    titles |= {name: str(FILE.parse(FILE.read(name), name)["title"]) for name in FILE.names()}
    return [{"name": name, "title": titles[name]} for name in list_bottles()]


def load_bottle(name_or_path: str | Path, overrides: Iterable[str] = ()) -> Bottle:
    """Return a bottle by name, part name or path of a TOML file, with overrides applied.

    A part of your own catalogue is ``CATALOGUE.toml/PART``. ``overrides`` are texts such as ``bottle.gas_mass=567 g``
    or ``room.temperature=5 degC``.
    """
    name, known, part = label(str(name_or_path)), list_bottles(), _part_of(name_or_path)
    if not (name in known or Path(name_or_path).suffix == ".toml" or "/" in name):
        hint = nearest_name(name, known)
        raise ParameterError(f"there is no bottle '{name}'{hint}; available: {', '.join(known)}, or give a .toml file")
    # A part has no file of its own: the paper's bottle gives what a catalogue does not say.
    parsed, file = read_model(FILE, bottle_file(), name_or_path if part is None else PAPER_BOTTLE)
    # A file without regulator and hose values has the paper's.
    paper = _given(read_model(FILE, bottle_file(), PAPER_BOTTLE)[0])
    entries = {path: paper[path] for path in WARMING} | _given(parsed)
    if part is not None:
        parsed = parsed.model_copy(update={"name": part.name, "title": f"{part.maker}: {part.model}, with a regulator"})
        entries, file = scaled_entries(part, entries), part.name
    for path, override in override_set(read_overrides(overrides), forms=FILLS).items():
        if path not in PATHS:
            raise ParameterError(f"override '{override}': a bottle has no value '{path}'{nearest_name(path, PATHS)}")
        with refused_as(ParameterError, f"override '{override}'", UnitError):
            value, unit = split_quantity(override.text)
        # A new form of the filling replaces the old one, of which two would contradict each other.
        kept = {name: entry for name, entry in entries.items() if name not in other_forms(path, FILLS)}
        entries = kept | {path: Entry(value=value, unit=unit, origin="assumed", source="override")}
    return _build(parsed, entries, file)


def _given(parsed: Any) -> dict[str, Entry]:
    sections = {section: getattr(parsed, section) for section in SECTIONS}
    entries = {path: getattr(sections[path.partition(".")[0]], path.partition(".")[2], None) for path in PATHS}
    return {path: entry for path, entry in entries.items() if entry is not None}


def _build(parsed: Any, entries: Mapping[str, Entry], file: str) -> Bottle:
    """Return the bottle with the given values; ParameterError for missing or impossible ones."""
    missing = [path for path in NEEDED if path not in entries]
    if missing:
        raise ParameterError(f"{file}: {said_missing(missing)}")
    values = {}
    for path, entry in entries.items():
        written = f"{file}: {path} = {format_quantity(entry.value, entry.unit)}"
        values[path] = allowed_number(written, entry, PATHS[path])
    with refused_as(ParameterError, f"{file}: gas = '{parsed.gas.value}'", ParameterError):
        fluid = load_fluid(parsed.gas.value)
    bottle = Bottle(
        name=parsed.name,
        title=parsed.title,
        fluid=fluid,
        heat_capacity_ratio=SPECIES[fluid.name].heat_capacity_ratio,
        volume=values["bottle.volume"],
        mass=_mass_of_fill(values, entries, fluid, file),
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
    _check_content(bottle, file)
    return bottle


def _mass_of_fill(values: Mapping[str, float], entries: Mapping[str, Entry], fluid: Fluid, file: str) -> float:
    """Return the mass of gas [kg] in a full bottle, given directly or by pressure and temperature."""
    by_pressure = [f"bottle.{quantity.name}" for quantity in FILL_BY_PRESSURE]
    stated = [path for path in by_pressure if path in values]
    # Exactly one form: by mass, or by pressure and temperature.
    if ("bottle.gas_mass" in values) == bool(stated):
        raise ParameterError(f"{file}: give either bottle.gas_mass or {' and '.join(by_pressure)}")
    if not stated:
        return values["bottle.gas_mass"]
    missing = [path for path in by_pressure if path not in values]
    if missing:
        raise ParameterError(f"{file}: {said_missing(missing)} beside {stated[0]}")
    pressure, temperature = (values[path] for path in by_pressure)
    _check_temperature("bottle.fill_temperature", temperature, fluid, file)
    # Above the saturated vapour the rest is liquid: pressure and temperature then leave the mass open.
    if fluid_pressure(fluid.table, temperature, math.inf) < pressure:
        most = fluid_pressure(fluid.table, temperature, math.inf)
        where, unit = f"{file}: bottle.fill_pressure", entries["bottle.fill_pressure"].unit
        end = f"{shown_text(most, 'Pa_a', '.4g', unit=unit)} at {temperature:g} K"
        raise ParameterError(
            f"{where}: {fluid.name} is gas up to {end}; give bottle.gas_mass instead"
            if has_liquid(fluid.table)
            else f"{where}: the table of {fluid.name} ends at {end}"
        )
    return values["bottle.volume"] * gas_density(fluid.table, temperature, pressure)


def _check_temperature(path: str, temperature: float, fluid: Fluid, file: str) -> None:
    coldest, hottest = fluid.table.temperatures[0], fluid.table.temperatures[-1]
    if not coldest < temperature <= hottest:
        raise ParameterError(
            f"{file}: {path} = {temperature:g} K: the properties of {fluid.name} are known above {coldest:g} K "
            f"and up to {hottest:g} K"
        )


def _check_content(bottle: Bottle, file: str) -> None:
    """Raise ParameterError for an overfull bottle, or a fill pressure too low for the regulator."""
    fluid, temperature = bottle.fluid, bottle.room_temperature
    _check_temperature("room.temperature", temperature, fluid, file)
    # Liquid can fill the whole bottle; a gas without liquid ends where its table does.
    wet = has_liquid(fluid.table)
    most = bottle.volume * (liquid_density if wet else densest_gas)(fluid.table, temperature)
    if bottle.mass >= most:
        volume = bottle.entries["bottle.volume"]
        fill = "bottle.gas_mass" if "bottle.gas_mass" in bottle.entries else "bottle.fill_pressure"
        limit = "liquid would fill it at" if wet else "the property table ends at"
        raise ParameterError(
            f"{file}: {GRAMS_PER_KILOGRAM * bottle.mass:.4g} g of {fluid.name} do not fit into "
            f"{format_quantity(volume.value, volume.unit)} at {temperature:g} K: {limit} "
            f"{GRAMS_PER_KILOGRAM * most:.4g} g; set {fill} or room.temperature lower, or bottle.volume higher"
        )
    content = bottle_content(fluid.table, bottle.mass, bottle.volume, temperature)
    if pressure_reserve(bottle.regulator, content.pressure, 0.0) <= 0.0:
        needed, unit = (
            bottle.regulator.set_pressure + bottle.regulator.pressure_margin,
            bottle.entries["regulator.set_pressure"].unit,
        )
        has, needs = (shown_text(each, "Pa_a", ".4g", unit=unit) for each in (content.pressure, needed))
        raise ParameterError(
            f"{file}: the full bottle has {has} at {temperature:g} K, but its regulator "
            f"needs {needs}, the sum of regulator.set_pressure and regulator.pressure_margin; lower one of them"
        )


def bottle_part(name_or_path: str | Path) -> tuple[Part, str]:
    """Return a bottle as a part with gas mass and empty mass, and the name of its fluid.

    A bottle file states no empty mass: it is computed from the heat capacity of the wall.
    """
    bottle, known = load_bottle(name_or_path), _part_of(name_or_path)
    if known is not None:
        return known, bottle.fluid.name
    empty = bottle.wall.wall_heat_capacity / _WALL
    source = "heat capacity of its wall, at 885 J/(kg K)"
    figure = Figure(value=1000.0 * empty, unit="g", origin="assumed", source=source)
    part = Part(
        name=bottle.name,
        group="bottles",
        kind="",
        maker="",
        model=bottle.title,
        document="",
        note="",
        figures={"empty_mass": figure},
        values={"content": bottle.mass, "empty_mass": empty},
        unknown=(),
    )
    return part, bottle.fluid.name
