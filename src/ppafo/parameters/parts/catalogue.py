"""The layout of a catalogue of parts, built from the declarations, and the way from a name or a file to one."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from types import GenericAlias
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.models import NAME, make_schema, one_of, optional, table, validate
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import ParameterError, UnitError, nearest_name
from ppafo.model.catalog import VALVES
from ppafo.model.declaration import Quantity
from ppafo.parameters.declaration import AREA_FORM, SONIC_FORM, is_within
from ppafo.parameters.parts.declaration import GROUPS, NEEDED, figures_of
from ppafo.parameters.parts.part import Figure, Part
from ppafo.units import to_si

_TITLES = {"valves": "Valve", "actuators": "Actuator", "regulators": "Regulator", "bottles": "Bottle"}
_NAMES = Annotated[tuple[str, ...], Field(strict=False)]


def _part_table(title: str, group: str, quantities: tuple[Quantity, ...], extra: dict[str, Any] | None = None) -> Any:
    fields: dict[str, Any] = {
        "maker": (str, Field(min_length=1, description="manufacturer or dealer")),
        "model": (str, Field(min_length=1, description="designation given by the manufacturer")),
        "document": (str, Field("", description="data sheet, catalogue or paper; empty where none is known")),
        "note": (str, Field("", description="remark")),
        "unknown": (_NAMES, Field(default=(), description="figures that are not known")),
    }
    for item in quantities:
        text = f"{item.summary} [{item.unit or '-'}]"
        fields[item.name] = (Figure, Field(description=text)) if item.name in NEEDED[group] else optional(Figure, text)
    return table(title, fields | (extra or {}))


def _valve_table(kind: str) -> Any:
    own = {"kind": (Literal[kind], Field(description=VALVES[kind].summary))}
    return _part_table(f"{kind.capitalize()}ValvePart", "valves", figures_of("valves", kind), own)


def _catalogue_file() -> type[BaseModel]:
    fields: dict[str, Any] = {
        "schema_version": (Literal[1], Field(description="version of this layout")),
        "name": (str, Field(pattern=NAME)),
        "title": (str, Field(min_length=1)),
        "notes": (str, ""),
    }
    for group in GROUPS:
        parts = (
            one_of([_valve_table(kind) for kind in VALVES])
            if group == "valves"
            else _part_table(_TITLES[group], group, GROUPS[group])
        )
        fields[group] = (GenericAlias(dict, (str, parts)), Field(default_factory=dict, description=f"{group} by name"))
    return table("CatalogueFile", fields)


CATALOGUE_FILE = _catalogue_file()


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a catalogue of parts."""
    return make_schema(CATALOGUE_FILE, "ppafo catalogue of parts")


DEFAULT = "parts"
"""Name of the catalogue that comes with the package."""

_FILE = TomlKind(
    "catalogue of parts", "parts", resources.files("ppafo.parameters.parts") / "catalogues", ParameterError
)
_NEEDS_A_REASON = ("derived", "assumed")


@dataclass(frozen=True, slots=True)
class Catalogue:
    """Parts by group and name; ``file`` is what messages call it."""

    file: str
    name: str
    title: str
    notes: str
    groups: Mapping[str, Mapping[str, Part]]

    def part(self, group: str, name: str) -> Part:
        """Return a part by its group (``valves``, ``bottles``, ...) and name.

        ParameterError with the nearest name where there is none.
        """
        parts = self.groups[group]
        if name not in parts:
            known = ", ".join(parts) or "none"
            hint = nearest_name(name, parts)
            raise ParameterError(f"{self.file}: {group} has no part '{name}'{hint}; available: {known}")
        return parts[name]

    @property
    def parts(self) -> tuple[Part, ...]:
        """All parts, group by group."""
        return tuple(part for parts in self.groups.values() for part in parts.values())


def load_catalogue(name_or_path: str | Path = DEFAULT) -> Catalogue:
    """Return a catalogue of parts by its name in the package or by the path of a TOML file."""
    return parse_catalogue(_FILE.read(name_or_path), label(str(name_or_path)))


def parse_catalogue(content: bytes, file: str) -> Catalogue:
    """Return the catalogue in the bytes of a TOML file; ``file`` is what messages call it.

    ParameterError for one that is not usable.
    """
    parsed: Any = validate(CATALOGUE_FILE, _FILE.parse(content, file), file, ParameterError)
    groups = {
        group: {name: _part(file, group, name, item) for name, item in getattr(parsed, group).items()}
        for group in GROUPS
    }
    return Catalogue(file, parsed.name, parsed.title, parsed.notes, groups)


def _part(file: str, group: str, name: str, parsed: Any) -> Part:
    kind = getattr(parsed, "kind", "")
    declared = {item.name: item for item in figures_of(group, kind)}
    figures = {key: figure for key in declared if isinstance(figure := getattr(parsed, key), Figure)}
    place = f"{file}: {group}.{name}"
    _check_unknown(place, parsed.unknown, figures, declared)
    if group == "valves":
        _check_orifice(place, figures)
    values = {key: _in_si(f"{place}.{key}", figure, declared[key]) for key, figure in figures.items()}
    return Part(
        name, group, kind, parsed.maker, parsed.model, parsed.document, parsed.note, figures, values, parsed.unknown
    )


def _check_unknown(
    place: str, unknown: tuple[str, ...], figures: Mapping[str, Figure], declared: Mapping[str, Quantity]
) -> None:
    for key in unknown:
        if key not in declared:
            hint = nearest_name(key, declared)
            raise ParameterError(f"{place}.unknown: there is no figure '{key}'{hint}; available: {', '.join(declared)}")
        if key in figures:
            raise ParameterError(f"{place}.unknown: '{key}' is given in the same part")


def _check_orifice(place: str, figures: Mapping[str, Figure]) -> None:
    """Refuse a valve that has not exactly one of the two forms of an orifice, whole."""
    given = [[item.name for item in form if item.name in figures] for form in (AREA_FORM, SONIC_FORM)]
    if sorted(map(len, given)) != [0, 2]:
        raise ParameterError(
            f"{place}: needs either area and discharge_coefficient or sonic_conductance and critical_ratio, "
            f"it has {', '.join(given[0] + given[1]) or 'none of them'}"
        )


def _in_si(place: str, figure: Figure, quantity: Quantity) -> float:
    if figure.origin in _NEEDS_A_REASON and not figure.note.strip():
        raise ParameterError(f"{place}.note is missing: a figure that is {figure.origin} needs its reason")
    try:
        value = to_si(figure.value, figure.unit, quantity.unit, STANDARD_ATMOSPHERE)
    except UnitError as error:
        raise ParameterError(f"{place} = {figure.value:g} {figure.unit}: {error}") from error
    if not is_within(value, quantity):
        limits = [f"{'at least' if quantity.minimum_allowed else 'more than'} {quantity.minimum:g}"]
        limits += [f"at most {quantity.maximum:g}"] if math.isfinite(quantity.maximum) else []
        raise ParameterError(
            f"{place} = {figure.value:g} {figure.unit}: must be {' and '.join(limits)} {quantity.unit}".rstrip()
        )
    return value
