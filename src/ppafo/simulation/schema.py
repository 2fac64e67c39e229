"""Schema of a scenario file, built from the declarations of its values.

The layout defines the allowed keys. Numbers are checked when they are read (``reading``), with file, key and unit.
"""

import functools
import re
from collections.abc import Container, Mapping
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, WithJsonSchema

from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.control.kind import ControllerKind
from ppafo.documents.models import REFERENCE, SchemaVersion, make_schema, one_of, optional, table
from ppafo.documents.problems import NAME
from ppafo.model.controlled import ANGLE, CONTROLLED, TORQUE
from ppafo.model.declaration import Quantity
from ppafo.simulation import declaration
from ppafo.simulation.document import PLAIN, kind_at
from ppafo.simulation.motion_kind import MOTIONS, VANE_MOTIONS, MotionKind
from ppafo.simulation.scenario import LARGEST_SEED

_LONGEST_NAME = 100
_STARTS_WITH_NUMBER = r"^\s*[+-]?(\d|\.\d)"
_QUANTITY_TEXT = {"type": "string", "pattern": _STARTS_WITH_NUMBER}


def number_type(quantity: Quantity, words: tuple[str, ...] = ()) -> Any:
    """Return the type of a value: text with unit, a plain number if it has no unit, or one of ``words``."""
    forms: list[dict[str, Any]] = [_QUANTITY_TEXT]
    forms += [{"type": "number"}] if quantity.unit in PLAIN else []
    forms += [{"enum": list(words)}] if words else []
    return Annotated[Any, WithJsonSchema({"anyOf": forms} if len(forms) > 1 else forms[0])]


def _description(quantity: Quantity) -> str:
    default = "" if quantity.default is None else f"; {quantity.default:g} unless given"
    default = "; the device's unless given" if quantity.default is None and quantity.follows else default
    return f"{quantity.summary} [{quantity.unit or '-'}]{default}".lstrip()


def quantity_fields(quantities: tuple[Quantity, ...], words: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return the fields of a section; a field without a default is required, unless a word can replace the value."""
    fields: dict[str, Any] = {}
    for quantity in quantities:
        kind = number_type(quantity, words)
        required = quantity.default is None and not words and not quantity.follows
        text = _description(quantity)
        fields[quantity.name] = (kind, Field(description=text)) if required else optional(kind, text)
    return fields


def kind_field(kind: str, summary: str) -> dict[str, Any]:
    """Return the field ``kind`` (discriminator) of a table whose layout depends on it."""
    return {"kind": (Literal[kind], Field(description=summary))}


def model_name(name: str) -> str:
    """Return the class name of a model: ``RampHold`` for ``ramp_hold``."""
    return "".join(part.capitalize() for part in re.split(r"\W|_", name))


def named_or_all(name: str, kinds: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return only the entry called ``name``, or all entries if there is none of this name."""
    return {name: kinds[name]} if name in kinds else kinds


def profile_table(prescribed: Quantity, purpose: str, kind: str = "", further: dict[str, Any] | None = None) -> Any:
    """Return the model of a profile's section, for one profile or for all loaded profiles, with ``further`` fields.

    ``purpose`` is the last part of the model names.
    """
    return one_of(
        [
            table(
                f"{model_name(name)}{purpose}",
                kind_field(name, profile.summary)
                | (further or {})
                | quantity_fields(_torque_levels(name) if further else declaration.profile_settings(name, prescribed)),
            )
            for name, profile in named_or_all(kind, PROFILES.loaded()).items()
        ]
    )


def _torque_levels(kind: str) -> tuple[Quantity, ...]:
    """Return the settings of a reference profile of torque; summaries name levels that other references require."""
    required = {item.name for item in declaration.reference_settings(kind, ANGLE) if item.default is None}
    return tuple(
        replace(item, summary=f"{item.summary}, required unless a torque is followed")
        if item.name in required and item.default is not None
        else item
        for item in declaration.reference_settings(kind, TORQUE)
    )


def motion_kinds() -> dict[str, MotionKind[Any]]:
    """Return the motions of a vane alone: all of this package, and loaded ones of other packages."""
    others = {name: kind for name, kind in MOTIONS.loaded().items() if kind.section is not None}
    return {name: MOTIONS[name] for name in VANE_MOTIONS} | others


def shank_table() -> Any:
    """Return the model of the section for the shank of a leg."""
    gait = {"gait": (str, Field(min_length=1, description="name of a gait, or a path relative to this file"))}
    return one_of(
        [
            *(
                table(
                    f"{model_name(name)}Shank",
                    kind_field(name, kind.summary) | quantity_fields(declaration.shank_settings(name)),
                )
                for name, kind in PROFILES.loaded().items()
            ),
            table(
                "GaitShank",
                kind_field(declaration.GAIT_SHANK, "shank and knee motion of a gait, without ground contact")
                | gait
                | quantity_fields(declaration.shank_settings(declaration.GAIT_SHANK)),
            ),
        ]
    )


def controller_table(kinds: Mapping[str, ControllerKind], suffix: str) -> Any:
    """Return the model of the controller section of a scenario or walk file."""
    sampling = {
        quantity.name: optional(number_type(quantity), _description(quantity)) for quantity in declaration.SAMPLING
    }
    return one_of(
        [
            table(
                f"{model_name(name)}{suffix}",
                kind_field(name, kind.summary) | sampling | quantity_fields(kind.quantities),
            )
            for name, kind in kinds.items()
        ]
    )


def file_model(name: str, own: dict[str, Any], sections: Container[str] = declaration.SECTIONS) -> type[BaseModel]:
    """Return the model of a scenario file: sections that every scenario has, and sections of its motion.

    Optional sections are included if they are in ``sections``.
    """
    device = {
        "set": (str, Field(min_length=1, description="name of a parameter set, or a path relative to this file")),
        "valve": optional(str, "name of one of the set's valves; its default valve unless given"),
        "overrides": (list[str], Field(default_factory=list, description="such as 'valve.area=12.6mm^2'")),
    }
    fields: dict[str, Any] = {
        "schema_version": (SchemaVersion, ...),
        "name": (str, Field(pattern=NAME, max_length=_LONGEST_NAME)),
        "description": (str, Field("", description="purpose of this file")),
        "device": (table("Device", device), Field(description="the hardware")),
        **own,
    }
    if "gas_model" in sections:
        isothermal = kind_field(declaration.ISOTHERMAL, "the gas keeps its temperature, as in the paper")
        thermal = kind_field(declaration.THERMAL, "the gas warms and cools: energy balance, heat through the walls")
        fields["gas_model"] = optional(
            one_of(
                [
                    table("IsothermalGas", isothermal),
                    table("ThermalGas", thermal | quantity_fields(declaration.THERMAL_GAS)),
                ]
            ),
            "how the gas in the chambers behaves; isothermal unless given",
        )
    if declaration.SUPPLY_LINE in sections:
        what = "regulators and lines of the gas; constant pressures unless given"
        lines = {
            line: optional(
                table(f"{model_name(line)}Line", quantity_fields(declaration.line_quantities(line))), f"{line} line"
            )
            for line in declaration.SUPPLY_LINES
        }
        fields[declaration.SUPPLY_LINE] = optional(table("SupplyLine", lines), what)
    reasons = "assumed values without a source, with the reason for each"
    fields["assumed"] = (dict[str, str], Field(default_factory=dict, description=reasons))
    return table(name, fields)


def scenario_file(document: Mapping[str, Any] | None = None) -> type[BaseModel]:
    """Return the model of a scenario file with the sections and components of a document; for None, with all loaded.

    A file that names no controller is compared with all controllers of this package.
    """
    controllers, profiles = CONTROLLERS.loaded_or_own(), PROFILES.loaded()
    sections = declaration.SECTIONS if document is None else tuple(filter(document.__contains__, declaration.SECTIONS))
    named = {} if document is None else {section: kind_at(document, section) for section in _WITH_KINDS}
    # What the model depends on is given for the cache alone: a kind that is loaded meanwhile makes another model.
    kinds = (tuple(controllers.items()), tuple(profiles.items()), tuple(motion_kinds()))
    return _scenario_file(sections, tuple(named.items()), kinds)


def whole_scenario_file() -> type[BaseModel]:
    """Return the model of a scenario file with every controller of this package."""
    CONTROLLERS.load_own()
    return scenario_file()


_WITH_KINDS = ("motion", "controller", "reference")


@functools.lru_cache(maxsize=16)
def _scenario_file(sections: tuple[str, ...], kinds: tuple[tuple[str, str], ...], _loaded: Any) -> type[BaseModel]:
    named = dict(kinds)
    motions = []
    for name, kind in named_or_all(named.get("motion", ""), motion_kinds()).items():
        assert kind.section is not None, "kinds of motion of a vane"
        fields = kind_field(name, kind.section.summary) | quantity_fields(kind.section.numbers)
        profile = kind.section.profile
        if profile is not None:
            fields[profile.name] = (profile.layout(), Field(description=profile.summary))
        motions.append(table(f"{model_name(name)}Motion", fields))
    controllers = named_or_all(named.get("controller", ""), CONTROLLERS.loaded())
    own: dict[str, Any] = {
        "run": (
            table("Run", quantity_fields((*declaration.RUN, declaration.ACCURACY))),
            Field(description="times of the run, and its accuracy"),
        ),
        "motion": (one_of(motions), Field(description="motion of the vane")),
    }
    if "initial" in sections:
        initial = table("Initial", quantity_fields(declaration.INITIAL, tuple(declaration.PRESSURE_WORDS)))
        own["initial"] = optional(initial, "state of the gas at the start; atmosphere unless given")
    own["controller"] = (controller_table(controllers, "Controller"), Field(description="controller of the valve"))
    if "reference" in sections:
        controlled = optional(Literal[tuple(CONTROLLED)], "controlled quantity; torque unless given")
        named_kind = named.get("reference", "")
        on_purpose = optional(str, "reason for a reference intentionally beyond the reach of the device")
        further = {"of": controlled, "beyond_reach": on_purpose}
        reference = profile_table(CONTROLLED[TORQUE].level, "Reference", named_kind, further)
        described = "reference of the controller, a torque unless 'of' names another quantity; optional for some kinds"
        own["reference"] = optional(reference, described)
    if "sensors" in sections:
        # The one whole number of the file: half a seed means nothing.
        seed = Annotated[int, Field(ge=0, le=LARGEST_SEED)]
        sensors = quantity_fields(declaration.SENSORS)
        sensors["seed"] = (seed, Field(1, description=declaration.SEED.summary))
        own["sensors"] = optional(table("Sensors", sensors), "sensors of the controller; ideal unless given")
    return file_model("ScenarioFile", own, sections)


def json_schema(reference: str = REFERENCE) -> dict[str, Any]:
    """Return the JSON Schema of a scenario file, with the controllers and profiles of all packages.

    ``reference`` is the template of references to its definitions.
    """
    CONTROLLERS.load_all()
    PROFILES.load_all()
    return make_schema(scenario_file(), "ppafo scenario", reference)
