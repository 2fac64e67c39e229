"""The layout of a scenario file, built from the declarations, so that a value is declared in one place only.

Numbers are checked where they are read (``reading``), with the file, the key and the unit at hand; here it is decided
which keys there can be.
"""

import functools
import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, WithJsonSchema

from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.control.kind import ControllerKind
from ppafo.documents.models import NAME, make_schema, one_of, optional, table
from ppafo.model.controlled import CONTROLLED, TORQUE
from ppafo.model.declaration import Quantity
from ppafo.simulation import declaration
from ppafo.simulation.motion_kind import MOTIONS, VANE_MOTIONS, MotionKind
from ppafo.simulation.scenario import LARGEST_SEED

_LONGEST_NAME = 100
_STARTS_WITH_NUMBER = r"^\s*[+-]?(\d|\.\d)"
_QUANTITY_TEXT = {"type": "string", "pattern": _STARTS_WITH_NUMBER}


def number_type(quantity: Quantity, words: tuple[str, ...] = ()) -> Any:
    """Return the type of a value: a text with its unit, a plain number where there is no unit, or one of some words."""
    forms: list[dict[str, Any]] = [_QUANTITY_TEXT]
    forms += [{"type": "number"}] if quantity.unit in declaration.PLAIN else []
    forms += [{"enum": list(words)}] if words else []
    return Annotated[Any, WithJsonSchema({"anyOf": forms} if len(forms) > 1 else forms[0])]


def _description(quantity: Quantity) -> str:
    default = "" if quantity.default is None else f"; {quantity.default:g} unless given"
    default = "; the device's unless given" if quantity.default is None and quantity.follows else default
    return f"{quantity.summary} [{quantity.unit or '-'}]{default}".lstrip()


def quantity_fields(quantities: tuple[Quantity, ...], words: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return the fields of a section; one without a default has to be given, unless a word stands in for it."""
    fields: dict[str, Any] = {}
    for item in quantities:
        kind = number_type(item, words)
        required = item.default is None and not words and not item.follows
        text = _description(item)
        fields[item.name] = (kind, Field(description=text)) if required else optional(kind, text)
    return fields


def kind_field(kind: str, summary: str) -> dict[str, Any]:
    """Return the field that tells one kind of table from another."""
    return {"kind": (Literal[kind], Field(description=summary))}


def model_name(name: str) -> str:
    """Return the name of a model: ``ramp_hold`` as ``RampHold``."""
    return "".join(part.capitalize() for part in re.split(r"\W|_", name))


def profile_table(prescribed: Quantity, purpose: str, further: dict[str, Any] | None = None) -> Any:
    """Return the section of a profile with ``further`` fields; ``purpose`` ends the names of its models."""
    return one_of(
        [
            table(
                f"{model_name(name)}{purpose}",
                kind_field(name, kind.summary)
                | (further or {})
                | quantity_fields(declaration.profile_settings(name, prescribed)),
            )
            for name, kind in PROFILES.loaded().items()
        ]
    )


def motion_kinds() -> dict[str, MotionKind]:
    """Return the kinds of motion of a vane alone: all of this package, and loaded ones of others."""
    others = {name: kind for name, kind in MOTIONS.loaded().items() if kind.section is not None}
    return {name: MOTIONS[name] for name in VANE_MOTIONS} | others


def shank_table() -> Any:
    """Return the section of the shank of a leg."""
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
                kind_field(declaration.GAIT_SHANK, "the shank and the knee of a gait, whose ground is left out")
                | gait
                | quantity_fields(declaration.shank_settings(declaration.GAIT_SHANK)),
            ),
        ]
    )


def controller_table(kinds: Mapping[str, ControllerKind], suffix: str) -> Any:
    """Return the section of the controller."""
    sampling = {item.name: optional(number_type(item), _description(item)) for item in declaration.SAMPLING}
    return one_of(
        [
            table(
                f"{model_name(name)}{suffix}",
                kind_field(name, kind.summary) | sampling | quantity_fields(kind.quantities),
            )
            for name, kind in kinds.items()
        ]
    )


def file_model(name: str, own: dict[str, Any]) -> type[BaseModel]:
    """Return the model of a file of a scenario: the sections that every one has, and the ones of its kind of motion."""
    device = {
        "set": (str, Field(min_length=1, description="name of a parameter set, or a path relative to this file")),
        "valve": optional(str, "name of one of the set's valves; its default valve unless given"),
        "overrides": (list[str], Field(default_factory=list, description="such as 'valve.area=12.6mm^2'")),
    }
    isothermal = kind_field(declaration.ISOTHERMAL, "the gas keeps its temperature, as in the paper")
    thermal = kind_field(declaration.THERMAL, "the gas warms and cools: energy balance, heat through the walls")
    gas = [
        table("IsothermalGas", isothermal),
        table("ThermalGas", thermal | quantity_fields(declaration.THERMAL_GAS)),
    ]
    lines = {
        line: optional(
            table(f"{model_name(line)}Line", quantity_fields(declaration.line_quantities(line))), f"{line} line"
        )
        for line in declaration.SUPPLY_LINES
    }
    fields: dict[str, Any] = {
        "schema_version": (Literal[1], Field(description="version of this layout")),
        "name": (str, Field(pattern=NAME, max_length=_LONGEST_NAME)),
        "description": (str, Field("", description="what this file tries, and why")),
        "device": (table("Device", device), Field(description="the hardware")),
        **own,
        "gas_model": optional(one_of(gas), "how the gas in the chambers behaves; isothermal unless given"),
        declaration.SUPPLY_LINE: optional(
            table("SupplyLine", lines), "regulators and lines of the gas; constant pressures unless given"
        ),
        "assumed": (
            dict[str, str],
            Field(default_factory=dict, description="assumed values, which no source gives, and why these"),
        ),
    }
    return table(name, fields)


def scenario_file() -> type[BaseModel]:
    """Return the model of a scenario file, for the controllers and profiles that are loaded.

    A file that names no controller is compared with all of this package.
    """
    controllers, profiles = CONTROLLERS.loaded_or_own(), PROFILES.loaded()
    # What the model depends on is given for the cache alone: a kind that is loaded meanwhile makes another model.
    return _scenario_file(tuple(controllers.items()), tuple(profiles.items()), tuple(motion_kinds()))


def whole_scenario_file() -> type[BaseModel]:
    """Return the same for all controllers of this package too."""
    CONTROLLERS.load_own()
    return scenario_file()


@functools.lru_cache(maxsize=4)
def _scenario_file(*_kinds: Any) -> type[BaseModel]:
    motions = []
    for name, kind in motion_kinds().items():
        assert kind.section is not None, "kinds of motion of a vane"
        fields = kind_field(name, kind.section.summary) | quantity_fields(kind.section.numbers)
        profile = kind.section.profile
        if profile is not None:
            fields[profile.name] = (profile.layout(), Field(description=profile.summary))
        motions.append(table(f"{model_name(name)}Motion", fields))
    words = tuple(declaration.PRESSURE_WORDS)
    controlled = optional(Literal[tuple(CONTROLLED)], "what it is a value of; torque unless given")
    reference = profile_table(CONTROLLED[TORQUE].level, "Reference", {"of": controlled})
    # The one whole number of the file: half a seed means nothing.
    seed = Annotated[int, Field(ge=0, le=LARGEST_SEED)]
    sensors = quantity_fields(declaration.SENSORS) | {"seed": (seed, Field(1, description=declaration.SEED.summary))}
    initial = table("Initial", quantity_fields(declaration.INITIAL, words))
    own: dict[str, Any] = {
        "run": (
            table("Run", quantity_fields((*declaration.RUN, declaration.ACCURACY))),
            Field(description="times of the run, and its accuracy"),
        ),
        "motion": (one_of(motions), Field(description="what the vane does")),
        "initial": optional(initial, "state of the gas at the start; atmosphere unless given"),
        "controller": (
            controller_table(CONTROLLERS.loaded(), "Controller"),
            Field(description="what commands the valve"),
        ),
        "reference": optional(
            reference,
            "what the controller follows, a torque unless it says of what; one that follows none may leave it out",
        ),
        "sensors": optional(table("Sensors", sensors), "sensors of the controller; ideal unless given"),
    }
    return file_model("ScenarioFile", own)


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a scenario file, with the controllers and profiles of all packages."""
    CONTROLLERS.load_all()
    PROFILES.load_all()
    return make_schema(scenario_file(), "ppafo scenario")
