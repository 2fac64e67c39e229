"""Gas bottles by name or file."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.documents.regular_file import decoded
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
from ppafo.parameters.bottles.fluid import (
    FILLS,
    PATHS,
    REQUIRED,
    WARMING,
    Fluid,
    check_temperature,
    declared,
    filled_mass,
    load_fluid,
)
from ppafo.parameters.declared import check_keys, value_at
from ppafo.parameters.overrides import other_forms, override_set, read_overrides
from ppafo.parameters.parameter_set import SOURCE, Entry, allowed_number, number_entry
from ppafo.units import format_quantity, split_quantity
from ppafo.units.shown import shown_text
from ppafo.wording import changed_text, nearest_name, said_missing

PAPER_BOTTLE = "paper-co2-9oz"
FILE = TomlKind("bottle", "bottle", resources.files("ppafo.parameters.bottles") / "files", ParameterError)


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


def described_bottles() -> list[dict[str, Any]]:
    """Return name and title of each bundled bottle."""
    return [{"name": name, "title": str(FILE.parse(FILE.read(name), name)["title"])} for name in FILE.names()]


def load_bottle(name_or_path: str | Path, overrides: Iterable[str] = ()) -> Bottle:
    """Return a bottle by name or path of a TOML file, with overrides applied.

    ``overrides`` are texts such as ``bottle.gas_mass=567 g`` or ``room.temperature=5 degC``.
    """
    parsed, file = _read(name_or_path)
    # A file need not state how its regulator and hose warm the gas: they then do so as the paper's.
    paper = _entries_of(_read(PAPER_BOTTLE)[0])
    entries = {path: paper[path] for path in WARMING} | _entries_of(parsed)
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
    bottle, changed = _build(parsed, entries, file), changed_text(map(str, changes.values()))
    return replace(bottle, title=f"{bottle.title} ({changed})") if changes else bottle


def _read(name_or_path: str | Path) -> tuple[dict[str, Any], str]:
    """Read and check a bottle file. Returns its document and the label used in messages."""
    file, content = label(str(name_or_path)), FILE.read(name_or_path)
    document = FILE.parse(content, file)
    check_keys(document, declared(document), file, ParameterError, decoded(content))
    return document, file


def _entries_of(document: Mapping[str, Any]) -> dict[str, Entry]:
    """Return the numbers given in a bottle file, by dotted path."""
    tables = {path: table for path in PATHS if (table := value_at(document, path)) is not None}
    return {path: number_entry(table) for path, table in tables.items()}


def _build(parsed: Mapping[str, Any], entries: Mapping[str, Entry], file: str) -> Bottle:
    """Build a bottle from its values. Raises ParameterError for missing or impossible values."""
    with refused_as(ParameterError, f"{file}: gas = '{parsed['gas']['value']}'", ParameterError):
        fluid = load_fluid(parsed["gas"]["value"])
    values: dict[str, float] = {}
    wrong: list[PpafoError] = []
    for path, entry in entries.items():
        with noted_in(wrong):
            assignment = f"{file}: {path} = {format_quantity(entry.value, entry.unit)}"
            values[path] = allowed_number(assignment, entry, PATHS[path])
    missing = [path for path in REQUIRED if path not in entries]
    if missing:
        wrong.append(ParameterError(f"{file}: {said_missing(missing)}"))
    raise_noted(wrong)
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
            "regulator.set_pressure and regulator.pressure_margin; lower one of them"
        )
