"""Gas bottles by name, from bottle files or the catalogue of parts.

The catalogue of parts states only the gas of a bottle and its mass. All other values are scaled from the paper's bottle
at the same filling density: volume in proportion to the gas, heat capacity of the wall to the mass, surfaces to the 2/3
power of the volume.
"""

import functools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.documents.models import read_model
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import ParameterError, PpafoError, UnitError, noted_in, raise_noted, refused_as
from ppafo.model.cold_gas import ColdSupply, Passage
from ppafo.model.gas import SPECIES
from ppafo.model.source import (
    BottleWall,
    Regulator,
    bottle_content,
    densest_gas,
    has_liquid,
    liquid_density,
    pressure_reserve,
)
from ppafo.parameters.bottles.declaration import FILLS, PATHS, REQUIRED, SECTIONS, WARMING, bottle_file
from ppafo.parameters.bottles.fluid import Fluid, check_temperature, filled_mass, filling_text, load_fluid
from ppafo.parameters.overrides import other_forms, override_set, read_overrides
from ppafo.parameters.parameter_set import SOURCE, Entry, allowed_number
from ppafo.parameters.parts import Part, load_catalogue
from ppafo.parameters.parts.catalogue import Figure
from ppafo.units import format_quantity, split_quantity
from ppafo.units.shown import shown_text
from ppafo.wording import changed_text, known_names, nearest_name, said_missing

PAPER_BOTTLE = "paper-co2-9oz"
FILE = TomlKind("bottle", "bottle", resources.files("ppafo.parameters.bottles") / "files", ParameterError)

_SURFACES = ("bottle.content_heat_transfer", "bottle.room_heat_transfer")
_WALL = 885.0
"""Wall heat capacity of the paper's bottle per mass [J/(kg K)]: 400 J/K and 452 g."""


@functools.cache
def bottle_parts() -> Mapping[str, Part]:
    """Return the bottles of the bundled catalogue of parts, by name."""
    return load_catalogue().groups["bottles"]


def scaled_entries(part: Part, paper: Mapping[str, Entry]) -> dict[str, Entry]:
    """Return the paper's bottle values scaled to the gas mass [kg] and empty mass [kg] of a catalogue part."""
    content, empty_mass = part.values["content"], part.values["empty_mass"]
    # At the same filling density the volume is proportional to the content.
    ratio = 1000.0 * content / paper["bottle.gas_mass"].value
    volume, wall = paper["bottle.volume"].value * ratio, _WALL * empty_mass
    derived = {
        "bottle.gas_mass": (1000.0 * content, "g", f"catalogue of parts, {part.name}"),
        "bottle.volume": (volume, "cm^3", "filled as densely as the paper's"),
        "bottle.wall_heat_capacity": (wall, "J/K", "its empty mass, at 885 J/(kg K) as the paper's"),
    }
    # Heat conductances are proportional to the surface of similar bodies.
    surface = ratio ** (2.0 / 3.0)
    for path in _SURFACES:
        value = paper[path].value * surface
        derived[path] = (value, paper[path].unit, "the paper's bottle, with the surface of its fluid")
    return dict(paper) | {
        path: Entry(value=value, unit=unit, origin="derived", source=source)
        for path, (value, unit, source) in derived.items()
    }


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


def is_of_catalogue(name_or_path: str | Path) -> bool:
    """Return whether a name has the form ``CATALOGUE.toml/PART`` of a part in a catalogue file."""
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
    name, bundled, part = label(str(name_or_path)), list_bottles(), _part_of(name_or_path)
    if not (name in bundled or Path(name_or_path).suffix == ".toml" or "/" in name):
        raise ParameterError(f"there is no bottle '{name}'{known_names(name, bundled)}, or give a .toml file")
    # The catalogue does not state all values of a bottle: the others are those of the paper's bottle.
    parsed, file = read_model(FILE, bottle_file(), name_or_path if part is None else PAPER_BOTTLE)
    paper = _entries_of(read_model(FILE, bottle_file(), PAPER_BOTTLE)[0])
    entries = {path: paper[path] for path in WARMING} | _entries_of(parsed)
    if part is not None:
        parsed = parsed.model_copy(update={"name": part.name, "title": f"{part.maker}: {part.model}, with a regulator"})
        entries, file = scaled_entries(part, entries), part.name
    changes = override_set(read_overrides(overrides), forms=FILLS)
    for path, override in changes.items():
        if path not in PATHS:
            is_gas = "gas" in path.split(".")
            of_file = "; choose the gas by the name or file of the bottle" if is_gas else nearest_name(path, PATHS)
            raise ParameterError(f"override '{override}': a bottle has no parameter '{path}'{of_file}")
        with refused_as(ParameterError, f"override '{override}'", UnitError):
            value, unit = split_quantity(override.text)
        # A new form of the filling replaces the old one: two forms would contradict each other.
        for other in other_forms(path, FILLS):
            entries.pop(other, None)
        entries[path] = Entry(value=value, unit=unit, origin="assumed", source=SOURCE)
    bottle, changed = _build(parsed, entries, file), changed_text(map(str, changes.values()))
    return replace(bottle, title=f"{bottle.title} ({changed})") if changes else bottle


def _entries_of(parsed: Any) -> dict[str, Entry]:
    """Return the numbers given in a bottle file, by dotted path."""
    sections = {section: getattr(parsed, section) for section in SECTIONS}
    entries = {path: getattr(sections[path.partition(".")[0]], path.partition(".")[2], None) for path in PATHS}
    return {path: entry for path, entry in entries.items() if entry is not None}


def _build(parsed: Any, entries: Mapping[str, Entry], file: str) -> Bottle:
    """Build a bottle from its values. Raises ParameterError for missing or impossible values."""
    with refused_as(ParameterError, f"{file}: gas = '{parsed.gas.value}'", ParameterError):
        fluid = load_fluid(parsed.gas.value)
    values: dict[str, float] = {}
    wrong: list[PpafoError] = []
    for path, entry in entries.items():
        with noted_in(wrong):
            assignment = f"{file}: {path} = {format_quantity(entry.value, entry.unit)}"
            values[path] = allowed_number(assignment, entry, PATHS[path])
    missing = [path for path in REQUIRED if path not in entries]
    if missing:
        has_mass_alone = "bottle.volume" in missing and "bottle.gas_mass" in values
        filling = filling_text(fluid, values["bottle.gas_mass"]) if has_mass_alone else ""
        source = " --from co2-16g" if fluid.name == "CO2" else ""
        remedy = f"'ppafo new bottle NAME{source}' writes a file with all of them"
        wrong.append(ParameterError(f"{file}: {said_missing(missing)}{filling}; {remedy}"))
    raise_noted(wrong)
    bottle = Bottle(
        name=parsed.name,
        title=parsed.title,
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
    _check_content(bottle, file)
    return bottle


def _check_content(bottle: Bottle, file: str) -> None:
    """Raise ParameterError for an overfull bottle, or a fill pressure too low for the regulator."""
    fluid, temperature = bottle.fluid, bottle.room_temperature
    check_temperature("room.temperature", temperature, fluid, file)
    # Liquid can fill the whole bottle; a gas without liquid is limited by its table.
    is_wet = has_liquid(fluid.table)
    largest_mass = bottle.volume * (liquid_density if is_wet else densest_gas)(fluid.table, temperature)
    if bottle.mass >= largest_mass:
        volume = bottle.entries["bottle.volume"]
        fill = "bottle.gas_mass" if "bottle.gas_mass" in bottle.entries else "bottle.fill_pressure"
        limit = "liquid fills the bottle at" if is_wet else "the property table ends at"
        raise ParameterError(
            f"{file}: {GRAMS_PER_KILOGRAM * bottle.mass:.4g} g of {fluid.name} do not fit into "
            f"{format_quantity(volume.value, volume.unit)} at {temperature:g} K: {limit} "
            f"{GRAMS_PER_KILOGRAM * largest_mass:.4g} g; set {fill} or room.temperature lower, or bottle.volume higher"
        )
    content = bottle_content(fluid.table, bottle.mass, bottle.volume, temperature)
    if pressure_reserve(bottle.regulator, content.pressure, 0.0) <= 0.0:
        required = bottle.regulator.set_pressure + bottle.regulator.pressure_margin
        unit = bottle.entries["regulator.set_pressure"].unit
        raise ParameterError(
            f"{file}: the full bottle has {shown_text(content.pressure, 'Pa_a', '.4g', unit=unit)} at "
            f"{temperature:g} K, but the regulator needs {shown_text(required, 'Pa_a', '.4g', unit=unit)}, the sum of "
            "regulator.set_pressure and regulator.pressure_margin; lower one of them"
        )


def bottle_part(name_or_path: str | Path) -> tuple[Part, str]:
    """Return a bottle as a part with gas mass and empty mass, and the name of its fluid.

    A bottle file states no empty mass: it is computed from the heat capacity of the wall.
    """
    bottle, part = load_bottle(name_or_path), _part_of(name_or_path)
    if part is not None:
        return part, bottle.fluid.name
    empty_mass = bottle.wall.wall_heat_capacity / _WALL
    source = "heat capacity of its wall, at 885 J/(kg K)"
    figure = Figure(value=1000.0 * empty_mass, unit="g", origin="assumed", source=source)
    part = Part(
        name=bottle.name,
        group="bottles",
        kind="",
        maker="",
        model=bottle.title,
        document="",
        note="",
        figures={"empty_mass": figure},
        values={"content": bottle.mass, "empty_mass": empty_mass},
        unknown=(),
    )
    return part, bottle.fluid.name
