"""Presets of the simulated bench: TOML files with changes of the model, errors of the sensors, and the reasons.

Changes of the model are overrides of a run, in the order in which they apply; the user's come after them. All other
values are declared here, with unit and range.
"""

import functools
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import BaseModel, Field

from ppafo.documents.models import SchemaVersion, Text, Texts, make_schema, read_model, table
from ppafo.documents.toml_text import TomlKind
from ppafo.errors import ParameterError, UnitError, refused_as
from ppafo.model.declaration import Quantity
from ppafo.parameters.declaration import is_within, range_rule
from ppafo.parameters.overrides import override_set, read_overrides
from ppafo.units import parse_quantity
from ppafo.wording import nearest_name

PREFIX = "rig."
"""Prefix of overrides of the preset; other overrides change the device or the experiment."""

_FILE = TomlKind("preset of the rig", "rig", resources.files("ppafo.rig") / "presets", ParameterError)


def _from_zero(name: str, unit: str, summary: str, maximum: float = math.inf) -> Quantity:
    return Quantity(name, unit, summary, 0.0, 0.0, maximum)


def _sensor(unit: str, name: str) -> tuple[Quantity, ...]:
    return (
        _from_zero("noise", unit, f"standard deviation of the noise of the {name}"),
        _from_zero("offset", unit, f"standard deviation of the offset of the {name}, drawn once"),
        _from_zero("gain", "", f"standard deviation of the relative gain error of the {name}, drawn once", 0.5),
        _from_zero("resolution", unit, f"step of the {name}, 0 for none"),
        _from_zero("lag", "s", f"time constant of the {name} in recordings of motion", 10.0),
    )


SECTIONS: dict[str, tuple[Quantity, ...]] = {
    "bench": (
        Quantity("rate", "Hz", "samples recorded per second", 1e3, 1.0, 1e5),
        _from_zero("friction_scatter", "", "standard deviation of the static limit from reading to reading", 0.5),
        _from_zero("hysteresis", "", "play between command and spool in the valve map, whole width", 0.5),
        Quantity("gas_difference", "K", "gas in the flow meter above the set's temperature", 0.0, -80.0, 80.0),
    ),
    "angle_sensor": _sensor("rad", "angle sensor"),
    "pressure_sensor": _sensor("Pa_d", "pressure sensors"),
    "torque_sensor": _sensor("N m", "scale"),
    "flow_sensor": _sensor("kg/s", "flow meter"),
}
PATHS: dict[str, Quantity] = {
    f"{section}.{quantity.name}": quantity for section, members in SECTIONS.items() for quantity in members
}
"""Values of a preset by dotted path, each with a default."""


@functools.cache
def _layout() -> type[BaseModel]:
    """Return the layout of a preset file."""
    fields: dict[str, Any] = {
        "schema_version": (SchemaVersion, ...),
        "name": (str, Field(description="name of the preset")),
        "title": (str, Field(description="which test bench it represents, in one line")),
        "notes": (str, Field(description="what is on, what is off, and where the values come from")),
        "model": (Texts, Field(default=(), description="overrides of each run: what the identified model has not")),
        "valves": (dict[str, Texts], Field(default={}, description="further overrides by kind of valve")),
    }
    for section, members in SECTIONS.items():
        values: dict[str, Any] = {
            item.name: (
                Text,
                Field(
                    default=f"{item.default:g} {item.unit}".strip(), description=f"{item.summary} [{item.unit or '-'}]"
                ),
            )
            for item in members
        }
        layout = table("".join(part.capitalize() for part in section.split("_")), values)
        fields[section] = (layout, Field(default_factory=layout))
    return table("RigPreset", fields)


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a preset."""
    return make_schema(_layout(), "ppafo rig preset")


@dataclass(frozen=True, slots=True)
class Preset:
    """Preset: overrides of each run, further ones by kind of valve, and values [SI] by dotted path."""

    name: str
    title: str
    model: tuple[str, ...]
    valves: Mapping[str, tuple[str, ...]]
    values: Mapping[str, float]


def list_presets() -> tuple[str, ...]:
    """Return the names of the bundled presets."""
    return _FILE.names()


def load_preset(name_or_path: str | Path, overrides: Iterable[str] = ()) -> Preset:
    """Load a preset, by bundled name or path of a TOML file.

    ``overrides`` are texts such as ``rig.pressure_sensor.noise=0 Pa_d``. Raises ParameterError for an invalid preset or
    override.
    """
    layout, file = read_model(_FILE, _layout(), name_or_path)
    read: Any = layout
    values = {}
    for path, quantity in PATHS.items():
        section, _, name = path.partition(".")
        values[path] = _value(f"{file}: {path}", getattr(getattr(read, section), name), quantity)
    for typed, override in override_set(read_overrides(overrides)).items():
        path = typed.removeprefix(PREFIX)
        if path not in PATHS:
            hint = nearest_name(typed, [f"{PREFIX}{known}" for known in PATHS])
            raise ParameterError(f"override '{override}': the simulated test bench has no value '{typed}'{hint}")
        values[path] = _value(f"override '{override}'", override.text, PATHS[path])
    return Preset(read.name, read.title, read.model, read.valves, values)


def _value(place: str, text: str, quantity: Quantity) -> float:
    """Return the number [SI] of a text with a unit. Raises ParameterError if it has none or is out of range."""
    with refused_as(ParameterError, place, UnitError):
        value = parse_quantity(text, quantity.unit)
    if not (math.isfinite(value) and is_within(value, quantity)):
        raise ParameterError(f"{place} = {text}: {range_rule(quantity, quantity.unit)}")
    return value
