"""Catalogue of commercial parts with data-sheet figures: file layout and loading."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from importlib import resources
from pathlib import Path
from types import GenericAlias
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from ppafo.arguments import checked
from ppafo.documents.models import SchemaVersion, StrictTable, make_schema, one_of, optional, table, validate
from ppafo.documents.problems import NAME
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import ParameterError, PpafoError, noted_in, raise_noted
from ppafo.model.catalog import VALVES
from ppafo.model.declaration import Quantity
from ppafo.parameters.declaration import ACTUATOR, AREA_FORM, ORIFICE, SONIC_FORM
from ppafo.parameters.parameter_set import allowed_number
from ppafo.wording import known_names

MASS = Quantity("mass", "kg", "mass of the part, of both valves for a pair", minimum=0.0, maximum=100.0)
RATING = Quantity(
    "largest_pressure", "Pa_a", "maximum pressure that the part is rated for", minimum=1.0e4, maximum=1.0e8
)
NOMINAL_FLOW = Quantity(
    "nominal_flow", "m^3/s", "flow of air at normal conditions from 6 bar to 5 bar gauge", minimum=0.0, maximum=1.0
)
NOMINAL_DIAMETER = Quantity("nominal_diameter", "m", "diameter of the opening", minimum=0.0, maximum=0.1)
CONTENT = Quantity("content", "kg", "gas in the full bottle", minimum=0.0, maximum=100.0, minimum_allowed=False)
EMPTY_MASS = Quantity("empty_mass", "kg", "mass of the empty bottle with its valve", minimum=0.0, maximum=100.0)
POWER = Quantity("power", "W", "electrical power: of an energised coil, of a spool at full stroke", None, 0.0, 1000.0)
IDLE_POWER = Quantity("idle_power", "W", "electrical power without a stroke", None, 0.0, 1000.0)
ENERGY = Quantity("energy", "J", "energy of the charged cell", None, 0.0, 1.0e8, minimum_allowed=False)

_OF_ACTUATOR = ("torque_constant", "displacement_per_radian")

VALVE = (MASS, RATING, NOMINAL_FLOW, NOMINAL_DIAMETER, POWER, IDLE_POWER, *ORIFICE)
GROUPS: dict[str, tuple[Quantity, ...]] = {
    "valves": VALVE + tuple(quantity for kind in VALVES.values() for quantity in kind.quantities),
    "actuators": (MASS, RATING, *(quantity for quantity in ACTUATOR if quantity.name in _OF_ACTUATOR)),
    "regulators": (MASS, RATING),
    "bottles": (CONTENT, EMPTY_MASS),
    "processors": (MASS, POWER),
    "batteries": (MASS, ENERGY),
}
"""Declared figures by group of parts; a valve also has the figures of its kind."""

NEEDED: dict[str, tuple[str, ...]] = {
    "valves": ("mass",),
    "actuators": ("mass", "torque_constant"),
    "regulators": ("mass",),
    "bottles": ("content", "empty_mass"),
    "processors": ("mass", "power"),
    "batteries": ("mass", "energy"),
}
"""Figures of a part that a study requires; a valve also needs an orifice in one of two forms.

By default the displacement of an actuator per radian is its torque constant, as in a parameter set.
"""


def figures_of(group: str, kind: str) -> tuple[Quantity, ...]:
    """Return the declared figures of a group; ``kind`` is the kind of a valve, '' for other groups."""
    return VALVE + VALVES[kind].quantities if group == "valves" else GROUPS[group]


Origin = Literal["published", "datasheet", "quoted", "measured", "derived", "assumed"]
DOUBTFUL: tuple[Origin, ...] = ("quoted", "assumed")
"""Origins that need verification before a part is bought: quoted from memory of a document, or assumed."""


class Figure(StrictTable):
    """Figure of a part in its given unit, with origin and source."""

    value: Annotated[float, Field(description="the number, in the unit beside it")]
    unit: Annotated[str, Field(description="such as 'mm^2', 'g', 'bar_g'; '' for a number")]
    origin: Annotated[
        Origin,
        Field(
            description="'published' in a paper, read in a 'datasheet', 'quoted' from a document not opened for it, "
            "'measured', 'derived' from other figures, or 'assumed'"
        ),
    ]
    source: Annotated[
        str, Field(min_length=1, description="where to look it up; for an assumed one, the basis of the assumption")
    ]
    note: Annotated[str, Field(description="reason or remark")] = ""


@dataclass(frozen=True, slots=True)
class Part:
    """Commercial part with its data-sheet figures.

    ``kind`` is the kind of a valve, else ''. ``figures`` are as written and ``values`` in SI units (pressures
    absolute), by name. ``unknown`` lists figures for which no source states a value.
    """

    name: str
    group: str
    kind: str
    maker: str
    model: str
    document: str
    note: str
    figures: Mapping[str, Figure]
    values: Mapping[str, float]
    unknown: tuple[str, ...]

    @property
    def title(self) -> str:
        """Maker and model of the part."""
        return f"{self.maker} {self.model}"

    @property
    def doubtful(self) -> tuple[str, ...]:
        """Names of the figures with origin quoted or assumed."""
        return tuple(name for name, figure in self.figures.items() if figure.origin in DOUBTFUL)

    @property
    def ideal(self) -> tuple[str, ...]:
        """Names of the figures without a value that count as ideal: no delay, no dead band, no pressure limit."""
        zeros = [quantity.name for quantity in figures_of(self.group, self.kind) if quantity.default == 0.0]
        zeros += [RATING.name] if self.group in ("valves", "actuators") else []
        return tuple(name for name in zeros if name not in self.values)

    @property
    def full_mass(self) -> float:
        """Mass of the part in use [kg]; for a bottle with its gas."""
        # Only a bottle has no mass of its own: it is empty mass and content.
        return self.values["mass"] if "mass" in self.values else self.values["empty_mass"] + self.values["content"]

    @property
    def model_numbers(self) -> dict[str, float]:
        """Numbers of a valve part by path [SI]; missing figures have the default of an ideal valve."""
        # A figure that is not given is left at the model's default, which is the ideal valve.
        declared = (*ORIFICE, *VALVES[self.kind].quantities)
        numbers = {quantity.name: self.values.get(quantity.name, quantity.default) for quantity in declared}
        return {f"valve.{name}": number for name, number in numbers.items() if number is not None}


def rated_pressure(*parts: Part) -> float:
    """Return the lowest rated pressure of parts [Pa absolute]; infinity if no part states it.

    A part without a rated pressure sets no limit.
    """
    return min(part.values.get(RATING.name, math.inf) for part in parts)


_NAMES = Annotated[tuple[str, ...], Field(strict=False)]


def _part_table(title: str, group: str, quantities: tuple[Quantity, ...], extra: dict[str, Any] | None = None) -> Any:
    fields: dict[str, Any] = {
        "maker": (str, Field(min_length=1, description="manufacturer or dealer")),
        "model": (str, Field(min_length=1, description="designation given by the manufacturer")),
        "document": (str, Field("", description="data sheet, catalogue or paper; empty where none is known")),
        "note": (str, Field("", description="remark")),
        "unknown": (_NAMES, Field(default=(), description="figures that are not known")),
    }
    for quantity in quantities:
        text = f"{quantity.summary} [{quantity.unit or '-'}]"
        fields[quantity.name] = (
            (Figure, Field(description=text)) if quantity.name in NEEDED[group] else optional(Figure, text)
        )
    return table(title, fields | (extra or {}))


def _catalogue_file() -> type[BaseModel]:
    fields: dict[str, Any] = {
        "schema_version": (SchemaVersion, ...),
        "name": (str, Field(pattern=NAME)),
        "title": (str, Field(min_length=1)),
        "notes": (str, ""),
    }
    for group, quantities in GROUPS.items():
        if group == "valves":
            # Each kind of valve has a table of its own, so that a figure of another kind is refused by name.
            kinds = {kind: (Literal[kind], Field(description=VALVES[kind].summary)) for kind in VALVES}
            parts = one_of(
                [
                    _part_table(f"{kind.capitalize()}ValvePart", group, figures_of(group, kind), {"kind": own})
                    for kind, own in kinds.items()
                ]
            )
        else:
            title = group.replace("ies", "ys").removesuffix("s").capitalize()
            parts = _part_table(title, group, quantities)
        fields[group] = (GenericAlias(dict, (str, parts)), Field(default_factory=dict, description=f"{group} by name"))
    return table("CatalogueFile", fields)


CATALOGUE_FILE = _catalogue_file()


json_schema = partial(make_schema, CATALOGUE_FILE, "ppafo catalogue of parts")
"""JSON Schema of a catalogue of parts."""


DEFAULT = "parts"
"""Name of the bundled catalogue."""

_FILE = TomlKind(
    "catalogue of parts", "parts", resources.files("ppafo.parameters.parts") / "catalogues", ParameterError
)
FOR_A_CYLINDER = (
    "search supply.pressure by 'ppafo find' with controller.kind=damped_proportional, or for a wearer try 'ppafo walk "
    "proportional' with device.set, wearer.body_mass, supply.pressure, controller.peak_torque and "
    "controller.largest_torque"
)


@dataclass(frozen=True, slots=True)
class Catalogue:
    """Catalogue of parts by group and name; ``file`` is the label in messages."""

    file: str
    name: str
    title: str
    notes: str
    groups: Mapping[str, Mapping[str, Part]]

    def part(self, group: str, name: str) -> Part:
        """Return a part by its group (``valves``, ``bottles``, ...) and name.

        Raises ParameterError with the nearest name for an unknown part.
        """
        parts = self.groups[group]
        if name not in parts:
            raise ParameterError(f"{self.file}: {group} has no part '{name}'{known_names(name, parts)}")
        return parts[name]

    @property
    def parts(self) -> tuple[Part, ...]:
        """All parts, group by group."""
        return tuple(part for parts in self.groups.values() for part in parts.values())


@checked
def load_catalogue(catalogue: str | Path = DEFAULT) -> Catalogue:
    """Load a catalogue of parts, by bundled name or path of a TOML file.

    >>> import ppafo
    >>> [part.name for part in ppafo.load_catalogue().parts if part.kind == "solenoid"]
    ['festo-vovg-5v-pair', 'festo-mha2-ms1h-pair']
    """
    return parse_catalogue(_FILE.read(catalogue), label(str(catalogue)))


def parse_catalogue(content: bytes, file: str) -> Catalogue:
    """Return the catalogue in the bytes of a TOML file; ``file`` is the label used in messages.

    Raises ParameterError if the catalogue is not usable.
    """
    document, wrong = _FILE.parse(content, file), list[PpafoError]()
    parsed: Any = None
    try:
        parsed = validate(CATALOGUE_FILE, document, file, ParameterError)
    except ParameterError as error:
        own = "'ppafo design' sizes vanes only: write a cylinder as a parameter set ('ppafo new set NAME --from "
        cylinder = f"; {own}cylinder-lever') and {FOR_A_CYLINDER}" * ("unknown key 'actuators." in str(error))
        wrong.append(ParameterError(f"{error}{cylinder}"))
    valves = document.get("valves")
    for name, valve in valves.items() if isinstance(valves, dict) else ():
        if not isinstance(valve, dict):
            continue
        given = [[number.name for number in form if number.name in valve] for form in (AREA_FORM, SONIC_FORM)]
        # Half a form of an orifice is as unusable as two forms at once.
        if sorted(map(len, given)) != [0, 2]:
            needs = "needs either area and discharge_coefficient or sonic_conductance and critical_ratio, but has"
            has = ", ".join(given[0] + given[1]) or "none of them"
            wrong.append(ParameterError(f"{file}: valves.{name}: {needs} {has}"))
    groups = {
        group: {name: _part(file, group, name, table, wrong) for name, table in getattr(parsed, group, {}).items()}
        for group in GROUPS
    }
    raise_noted(wrong)
    return Catalogue(file, parsed.name, parsed.title, parsed.notes, groups)


def _part(file: str, group: str, name: str, parsed: Any, wrong: list[PpafoError]) -> Part:
    # Only valves come in kinds.
    kind = getattr(parsed, "kind", "")
    declared = {quantity.name: quantity for quantity in figures_of(group, kind)}
    figures = {key: figure for key in declared if isinstance(figure := getattr(parsed, key), Figure)}
    where = f"{file}: {group}.{name}"
    for key in parsed.unknown:
        if key not in declared:
            text = f"there is no value '{key}'{known_names(key, declared)}"
            wrong.append(ParameterError(f"{where}.unknown: {text}"))
        if key in figures:
            wrong.append(ParameterError(f"{where}.unknown: '{key}' has a value in this part; omit it from unknown"))
    values = {}
    for key, figure in figures.items():
        shown = f"{where}.{key} = {figure.value:g} {figure.unit}"
        # Data sheets give gauge pressures at sea level.
        with noted_in(wrong):
            values[key] = allowed_number(shown, figure, declared[key])
    if "torque_constant" in values:
        values.setdefault("displacement_per_radian", values["torque_constant"])
    return Part(
        name, group, kind, parsed.maker, parsed.model, parsed.document, parsed.note, figures, values, parsed.unknown
    )
