"""The layout of a catalogue of parts, built from the declarations, so that a figure is declared in one place only."""

from types import GenericAlias
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from ppafo.documents.models import NAME, make_schema, one_of, optional, table
from ppafo.model.declaration import Quantity
from ppafo.model.valves.catalog import VALVES
from ppafo.parameters.parts.declaration import GROUPS, NEEDED, figures_of
from ppafo.parameters.parts.part import Figure

_TITLES = {"valves": "Valve", "actuators": "Actuator", "regulators": "Regulator", "bottles": "Bottle"}
_NAMES = Annotated[tuple[str, ...], Field(strict=False)]


def _part(title: str, group: str, quantities: tuple[Quantity, ...], extra: dict[str, Any] | None = None) -> Any:
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


def _valve(kind: str) -> Any:
    own = {"kind": (Literal[kind], Field(description=VALVES[kind].summary))}
    return _part(f"{kind.capitalize()}ValvePart", "valves", figures_of("valves", kind), own)


def _catalogue_file() -> type[BaseModel]:
    fields: dict[str, Any] = {
        "schema_version": (Literal[1], Field(description="version of this layout")),
        "name": (str, Field(pattern=NAME)),
        "title": (str, Field(min_length=1)),
        "notes": (str, ""),
    }
    for group in GROUPS:
        parts = (
            one_of([_valve(kind) for kind in VALVES])
            if group == "valves"
            else _part(_TITLES[group], group, GROUPS[group])
        )
        fields[group] = (GenericAlias(dict, (str, parts)), Field(default_factory=dict, description=f"{group} by name"))
    return table("CatalogueFile", fields)


CATALOGUE_FILE = _catalogue_file()


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a catalogue of parts."""
    return make_schema(CATALOGUE_FILE, "ppafo catalogue of parts")
