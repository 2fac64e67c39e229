"""Presets of the simulated bench: TOML files with changes of the model, errors of the sensors, and the reasons.

Changes of the model are overrides of a run, in the order in which they apply; the user's come after them. All other
values are declared here, with unit and range.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from ppafo.documents.toml_text import TomlKind
from ppafo.errors import ParameterError, UnitError, refused_as
from ppafo.model.declaration import Quantity
from ppafo.parameters.declared import (
    FREE_KEY,
    Field,
    InnerTable,
    Many,
    Words,
    check_keys,
    number_in,
    schema_of,
    value_at,
)
from ppafo.parameters.overrides import override_set, read_overrides
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


def declared(document: Mapping[str, Any]) -> dict[str, Field]:
    """Return every field of a preset file with the kinds of valve of a document, by path."""
    valves = document.get("valves")
    return {
        "schema_version": Words("version of this layout", True, (1,)),
        "name": Words("name of the preset", True),
        "title": Words("which test bench it represents, in one line", True),
        "notes": Words("what is on, what is off, and where the values come from", True),
        "model": Many(Words(required=True), "overrides of each run: what the identified model has not"),
        "valves": InnerTable("further overrides by kind of valve", keys=FREE_KEY),
        **{f"valves.{kind}": Many(Words(required=True)) for kind in (valves if isinstance(valves, Mapping) else ())},
        **PATHS,
    }


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a preset."""
    return schema_of("ppafo rig preset", declared)


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
    source = _FILE.load(name_or_path)
    document = source.document
    check_keys(source, declared(document))
    values = {
        path: float(quantity.default or 0.0)
        if (given := value_at(document, path)) is None
        else number_in(given, quantity)
        for path, quantity in PATHS.items()
    }
    for typed, override in override_set(read_overrides(overrides)).items():
        path = typed.removeprefix(PREFIX)
        if path not in PATHS:
            raise ParameterError(
                f"override '{override}': the simulated test bench has no value '{typed}'"
                f"{nearest_name(typed, [f'{PREFIX}{known}' for known in PATHS])}"
            )
        with refused_as(ParameterError, f"override '{override}'", UnitError):
            values[path] = number_in(override.text, PATHS[path])
    valves = {kind: tuple(texts) for kind, texts in document.get("valves", {}).items()}
    return Preset(document["name"], document["title"], tuple(document.get("model", ())), valves, values)
