"""The layout of a walk file, built from the declarations."""

import functools
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from ppafo.control.catalog import CONTROLLERS
from ppafo.control.fixed.walking_numbers import FIXED_WALKS
from ppafo.control.walking.catalog import TIMINGS, WALKING_CONTROLLERS, walking_controllers
from ppafo.documents.models import NAME, make_schema, one_of, optional, table
from ppafo.simulation.declaration import SAMPLING, SUPPLY_LINE
from ppafo.simulation.schema import (
    device_fields,
    gas_model_table,
    kind_field,
    model_name,
    number_type,
    quantity_fields,
    supply_line_table,
)
from ppafo.walking import declaration
from ppafo.walking.bottle import BOTTLE, BOTTLE_NUMBERS
from ppafo.walking.wearer import WEARER


def _controller() -> Any:
    sampling = {item.name: optional(number_type(item), item.summary) for item in SAMPLING}
    said = "floats, or fixed: whole numbers as a small processor has them; float unless given"
    whole = {"arithmetic": optional(Literal["float", "fixed"], said)}
    return one_of(
        [
            table(
                f"{model_name(name)}Walking",
                kind_field(name, kind.summary)
                | sampling
                | (whole | quantity_fields(declaration.converter_settings(name)) if name in FIXED_WALKS else {})
                | quantity_fields(kind.quantities),
            )
            for name, kind in walking_controllers().items()
        ]
    )


def _timing() -> Any:
    found = []
    for name, kind in TIMINGS.items():
        fields = {item.name: optional(number_type(item), item.summary) for item in kind.quantities}
        found.append(table(f"{model_name(name)}Timing", kind_field(name, kind.summary) | fields))
    return one_of(found)


def _fault(sensor: str) -> Any:
    timing = quantity_fields((declaration.FAULT_TIME, declaration.PERIOD_OF_FAULT))
    own = {
        "frozen": {},
        "stuck": quantity_fields((declaration.READINGS[sensor],)),
        "distorted": quantity_fields(declaration.DISTORTIONS[sensor]),
    }
    return one_of(
        [
            table(f"{model_name(sensor)}{kind.capitalize()}", kind_field(kind, summary) | timing | own[kind])
            for kind, summary in declaration.FAULT_KINDS.items()
        ]
    )


def _bottle() -> dict[str, Any]:
    numbers = {item.name: optional(number_type(item), item.summary) for item in BOTTLE_NUMBERS}
    changes: Any = (list[str], Field(default_factory=list, description="such as 'room.temperature=5 degC'"))
    return {"name": optional(str, "name of a bottle, or the path of its file"), **numbers, "overrides": changes}


def walk_file() -> type[BaseModel]:
    """Return the model of a walk file, for the controllers that are loaded."""
    return _walk_file(tuple(walking_controllers().items()))


@functools.lru_cache(maxsize=4)
def _walk_file(_kinds: Any) -> type[BaseModel]:
    seed = Annotated[int, Field(ge=0, le=declaration.LARGEST_SEED)]
    sensors = quantity_fields(declaration.WALK_SENSORS)
    sensors |= {item.name: optional(number_type(item), item.summary) for item in declaration.BANDWIDTHS}
    sensors["seed"] = (seed, Field(1, description=declaration.SEED.summary))
    faults = {name: optional(_fault(name), f"fault of the {name} sensor") for name in declaration.FAULTY}
    run = {"duration": optional(number_type(declaration.DURATION), declaration.DURATION.summary)}
    run |= quantity_fields((declaration.STEP,))
    fields: dict[str, Any] = {
        "schema_version": (Literal[1], Field(description="version of this layout")),
        "name": (str, Field(pattern=NAME, max_length=100)),
        "description": (str, Field("", description="what this file tries, and why")),
        "gait": optional(
            str, "name of a gait, or the path of a gait file; its subject walks; the built-in one unless given"
        ),
        "course": optional(
            str, "name of a course, or the path of its file; stride after equal stride unless one is given"
        ),
        "device": (table("WalkDevice", device_fields()), Field(description="the hardware")),
        "controller": (_controller(), Field(description="what commands the valve")),
        "timing": optional(_timing(), "how the controller knows the time in the stride; thresholds unless given"),
        "wearer": optional(
            table("Wearer", quantity_fields((*WEARER, declaration.PERSON))),
            "who walks; the subject of the gait that is named, else the paper's, unless given",
        ),
        "sensors": optional(table("WalkSensors", sensors), "sensors of the controller; ideal unless given"),
        "faults": optional(table("Faults", faults), "sensors that fail during the walk"),
        "gas_model": optional(gas_model_table(), "how the gas in the chambers behaves; isothermal unless given"),
        SUPPLY_LINE: optional(supply_line_table(), "regulators and lines of the gas; constant pressures unless given"),
        BOTTLE: optional(
            table("WalkBottle", _bottle()), "bottle that the device hangs on; a supply without end unless given"
        ),
        "run": optional(table("WalkRun", run), "how long it is, and how it is computed"),
        "assumed": (
            dict[str, str],
            Field(default_factory=dict, description="assumed values, which no source gives, and why these"),
        ),
    }
    return table("WalkFile", fields)


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a walk file."""
    WALKING_CONTROLLERS.load_all()
    CONTROLLERS.load_all()
    return make_schema(walk_file(), "ppafo walk")
