"""The layout of a parameter set file, built from the declarations, so that a value is declared in one place only."""

import functools
import re
from types import GenericAlias
from typing import Any, Literal

from pydantic import BaseModel, Field

from ppafo.documents.models import NAME, make_schema, one_of, optional, table
from ppafo.model.declaration import Quantity
from ppafo.model.valves.catalog import VALVES
from ppafo.parameters import declaration
from ppafo.parameters.provenance import Accepted, Citation, Entry, FlagEntry, TextEntry


def _by_name(model: Any) -> Any:
    return GenericAlias(dict, (str, model))


def _fields(quantities: tuple[Quantity, ...]) -> dict[str, Any]:
    return {quantity.name: optional(Entry, f"{quantity.summary} [{quantity.unit or '-'}]") for quantity in quantities}


def _section(name: str, quantities: tuple[Quantity, ...], extra: dict[str, Any] | None = None) -> Any:
    return table(name, _fields(quantities) | (extra or {}))


def _valve_section(kind: str) -> Any:
    return _section(
        f"{re.sub(r'[^A-Za-z0-9_]', '_', kind.capitalize())}Valve",
        declaration.ORIFICE + VALVES[kind].quantities,
        {"kind": (Literal[kind], Field(description=VALVES[kind].summary))},
    )


def _sections() -> dict[str, Any]:
    """Return the sections that hold values, each a model, all of them optional: a set may have gaps."""
    leak = _section("Leak", declaration.ORIFICE)
    valve_reports = _section("ReportedOfAValve", declaration.REPORTED_OF_A_VALVE)
    reported = {
        declaration.REPORTED_FORMULA: optional(TextEntry, "exponent inside C1, a formula in k"),
        "valves": optional(_by_name(valve_reports), "what was reported for each valve, by its name"),
    }
    return {
        "gas": _section("Gas", declaration.GAS, {"species": optional(TextEntry, "name of the gas")}),
        "actuator": _section("Actuator", declaration.ACTUATOR, {"leak": optional(leak, "leak across the vane")}),
        "friction": _section("Friction", declaration.FRICTION),
        "foot_plate": _section("FootPlate", declaration.FOOT_PLATE),
        "supply": _section("Supply", declaration.SUPPLY, {"relieving": optional(FlagEntry, declaration.RELIEVING)}),
        "flow": _section("Flow", declaration.FLOW),
        "reported": _section("Reported", declaration.REPORTED, reported),
    }


def parameter_file() -> type[BaseModel]:
    """Return the model of a parameter set file, for the valves that are loaded."""
    return _parameter_file(tuple(VALVES.items()))


@functools.lru_cache(maxsize=4)
def _parameter_file(_kinds: Any) -> type[BaseModel]:
    fields: dict[str, Any] = {
        "schema_version": (Literal[1], Field(description="version of this layout")),
        "name": (str, Field(pattern=NAME)),
        "title": (str, Field(min_length=1)),
        "citation": optional(Citation, "where the set was published"),
        "notes": (str, ""),
        "completed_by": (str, Field("", description="name of a set that completes this one")),
        "default_valve": (str, Field(description="name of the valve that a device has by default")),
        "accepted": (list[Accepted], Field(default_factory=list, description="contradictions kept for a reason")),
    }
    fields |= {name: optional(model, f"section {name}") for name, model in _sections().items()}
    fields["valves"] = (
        _by_name(one_of([_valve_section(kind) for kind in VALVES])),
        Field(min_length=1, description="valves by name"),
    )
    return table("ParameterFile", fields)


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a parameter set file, with the valves of all packages."""
    VALVES.load_all()
    return make_schema(parameter_file(), "ppafo parameter set")
