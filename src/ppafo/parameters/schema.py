"""The layout of a parameter set file, built from the declarations, so that a value is declared in one place only."""

from types import GenericAlias
from typing import Annotated, Any, Literal, Union

from pydantic import BaseModel, ConfigDict, Field, create_model

from ppafo.model.declaration import Quantity
from ppafo.model.valves.catalog import VALVES
from ppafo.parameters import declaration
from ppafo.parameters.provenance import Accepted, Citation, Entry, TextEntry

_CONFIG = ConfigDict(strict=True, extra="forbid", frozen=True)
_NAME = r"^[a-z0-9][a-z0-9_-]*$"


def _left_out() -> None:
    """Stand in for a value that a file may leave out; keeps 'null' out of the published schema."""


def _optional(annotation: Any, description: str) -> Any:
    return annotation, Field(default_factory=_left_out, description=description)


def _by_name(model: Any) -> Any:
    return GenericAlias(dict, (str, model))


def _fields(quantities: tuple[Quantity, ...]) -> dict[str, Any]:
    return {quantity.name: _optional(Entry, f"{quantity.summary} [{quantity.unit or '-'}]") for quantity in quantities}


def _section(name: str, quantities: tuple[Quantity, ...], extra: dict[str, Any] | None = None) -> Any:
    return create_model(name, __config__=_CONFIG, **_fields(quantities), **(extra or {}))


def _valve_section(kind: str) -> Any:
    return _section(
        f"{kind.capitalize()}Valve",
        declaration.ORIFICE + VALVES[kind].quantities,
        {"kind": (Literal[kind], Field(description=VALVES[kind].summary))},
    )


def _sections() -> dict[str, Any]:
    """Return the sections that hold values, each a model, all of them optional: a set may have gaps."""
    leak = _section("Leak", declaration.ORIFICE)
    valve_reports = _section("ReportedOfAValve", declaration.REPORTED_OF_A_VALVE)
    reported = {
        declaration.REPORTED_FORMULA: _optional(TextEntry, "exponent inside C1, a formula in k"),
        "valves": _optional(_by_name(valve_reports), "what was reported for each valve, by its name"),
    }
    return {
        "gas": _section("Gas", declaration.GAS, {"species": _optional(TextEntry, "name of the gas")}),
        "actuator": _section("Actuator", declaration.ACTUATOR, {"leak": _optional(leak, "leak across the vane")}),
        "friction": _section("Friction", declaration.FRICTION),
        "foot_plate": _section("FootPlate", declaration.FOOT_PLATE),
        "supply": _section("Supply", declaration.SUPPLY),
        "flow": _section("Flow", declaration.FLOW),
        "reported": _section("Reported", declaration.REPORTED, reported),
    }


def _parameter_file() -> Any:
    valve: Any = Annotated[Union[tuple(map(_valve_section, VALVES))], Field(discriminator="kind")]  # noqa: UP007
    fields: dict[str, Any] = {
        "schema_version": (Literal[1], Field(description="version of this layout")),
        "name": (str, Field(pattern=_NAME)),
        "title": (str, Field(min_length=1)),
        "citation": _optional(Citation, "where the set was published"),
        "notes": (str, ""),
        "completed_by": (str, Field("", description="name of a set that completes this one")),
        "default_valve": (str, Field(description="name of the valve that a device has unless told otherwise")),
        "accepted": (list[Accepted], Field(default_factory=list, description="contradictions kept for a reason")),
    }
    fields |= {name: _optional(model, f"section {name}") for name, model in _sections().items()}
    fields["valves"] = (_by_name(valve), Field(min_length=1, description="valves by name"))
    return create_model("ParameterFile", __config__=_CONFIG, **fields)


PARAMETER_FILE: type[BaseModel] = _parameter_file()


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a parameter set file."""
    schema = PARAMETER_FILE.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "ppafo parameter set"}
