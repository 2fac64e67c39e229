"""Presets of the simulated bench: TOML files of deviations from the model, each with unit and reason.

Every value of a preset is declared here with section, name, SI unit, range and meaning.
"""

import functools
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import BaseModel, Field

from ppafo.documents.models import SchemaVersion, StrictTable, make_schema, read_model, table
from ppafo.documents.toml_text import TomlKind
from ppafo.errors import ParameterError, UnitError, refused_as
from ppafo.model.declaration import Quantity
from ppafo.parameters.declaration import is_within, range_rule
from ppafo.parameters.overrides import override_set, read_overrides
from ppafo.units import parse_quantity, to_si
from ppafo.wording import nearest_name

PREFIX = "rig."
"""Prefix of preset overrides; other overrides change the device or the experiment."""

_FILE = TomlKind("preset of the rig", "rig", resources.files("ppafo.rig") / "presets", ParameterError)


_DIFFERENCE: Any = {"minimum": -80.0, "maximum": 80.0}
"""Range of temperature differences on the bench [K]."""


def _from_zero(name: str, unit: str, summary: str, maximum: float = math.inf) -> Quantity:
    return Quantity(name, unit, summary, minimum=0.0, maximum=maximum)


def _sensor(unit: str, name: str) -> tuple[Quantity, ...]:
    return (
        _from_zero("noise", unit, f"standard deviation of the noise of the {name}"),
        _from_zero("offset", unit, f"standard deviation of the offset of the {name}, drawn once"),
        _from_zero("resolution", unit, f"step of the {name}, 0 for none"),
    )


SECTIONS: dict[str, tuple[Quantity, ...]] = {
    "gas": (
        _from_zero("heat_transfer_coefficient", "W/(m^2 K)", "heat transfer between gas and wall", 1e9),
        _from_zero("wall_area_per_volume", "1/m", "inner surface of chamber or line over its volume", 1e5),
        Quantity("wall_temperature_difference", "K", "wall and room above the set's temperature", **_DIFFERENCE),
        Quantity("supply_temperature_difference", "K", "supplied gas above the set's temperature", **_DIFFERENCE),
        _from_zero("real_gas_share", "", "fraction of the gas's second virial coefficient, 0: ideal", 1.0),
    ),
    "supply": (
        _from_zero("droop", "Pa s/kg", "fall of a regulated pressure per mass flow", 1e9),
        _from_zero("recovery_time", "s", "time constant with which the regulated pressure falls and recovers", 10.0),
    ),
    "line": (
        _from_zero("volume", "m^3", "volume of each line, a part of the dead volume, 0 for none", 1e-2),
        _from_zero("area", "m^2", "area of an orifice between line and chamber with the same pressure loss", 1e-2),
        _from_zero("discharge_coefficient", "", "discharge coefficient of that orifice", 2.0),
        _from_zero("delay", "s", "time that a wave needs through the line, added to the command", 0.1),
    ),
    "valve": (
        _from_zero("hysteresis", "", "play between command and spool, whole width", 0.5),
        _from_zero("dead_band", "", "proportional: smallest command that opens the valve", 0.9),
        _from_zero("delay", "s", "proportional: dead time between command and spool", 0.2),
        _from_zero("spool_frequency", "Hz", "proportional: undamped frequency of the spool, 0 for none", 2e3),
        Quantity("spool_damping_ratio", "", "proportional: damping ratio of the spool", minimum=0.05, maximum=5.0),
        _from_zero("opening_delay", "s", "solenoid: time from energising to flow from the source", 0.2),
        _from_zero("closing_delay", "s", "solenoid: time from de-energising to venting", 0.2),
    ),
    "friction": (
        _from_zero("static_per_pressure", "m^3", "static limit per pressure difference across the vane", 1e-2),
        _from_zero("dynamic_per_pressure", "m^3", "dynamic friction per pressure difference", 1e-2),
        _from_zero("stribeck_velocity", "rad/s", "speed at which half of the rise at standstill is left", 1e2),
        _from_zero("scatter", "", "standard deviation of the static limit from reading to reading", 0.5),
    ),
    "leak": (
        _from_zero("conductance_factor", "", "leak of the device times this", 1e3),
        _from_zero("laminar_conductance", "kg/(s Pa^2)", "further leak per difference of squared pressures", 1e-8),
    ),
    "sampling": (Quantity("rate", "Hz", "samples recorded per second", minimum=1.0, maximum=1e5),),
    "angle_sensor": (
        _from_zero("bandwidth", "Hz", "first-order bandwidth of the angle sensor, 0 for none", 1e5),
        *_sensor("rad", "angle sensor"),
    ),
    "pressure_sensor": (
        _from_zero("bandwidth", "Hz", "first-order bandwidth of the pressure sensors, 0 for none", 1e5),
        *_sensor("Pa_d", "pressure sensors"),
    ),
    "torque_sensor": _sensor("N m", "scale"),
    "flow_sensor": _sensor("kg/s", "flow meter"),
}
"""Values of a preset by section, all required; physics that is off has the value 0 and a reason."""

PATHS: dict[str, Quantity] = {
    f"{section}.{quantity.name}": quantity for section, members in SECTIONS.items() for quantity in members
}


class PresetValue(StrictTable):
    """Value in a preset file, with unit and reason."""

    value: float = Field(description="the number, in the unit beside it")
    unit: str = Field(description="unit of the number, such as 'mm^2'; empty for a plain number")
    reason: str = Field(min_length=1, description="reason for the number: a source, or why it was chosen")


@functools.cache
def _layout() -> type[BaseModel]:
    """Return the layout of a preset file: name, title, notes, and a table for each section of ``SECTIONS``."""
    fields: dict[str, Any] = {
        "schema_version": (SchemaVersion, ...),
        "name": (str, Field(description="name of the preset")),
        "title": (str, Field(description="which test bench it represents, in one line")),
        "notes": (str, Field(description="what is on, what is off, and where the values come from")),
    }
    for name, members in SECTIONS.items():
        values = {
            quantity.name: (PresetValue, Field(description=f"{quantity.summary} [{quantity.unit or '-'}]"))
            for quantity in members
        }
        fields[name] = (table("".join(part.capitalize() for part in name.split("_")), values), Field())
    return table("RigPreset", fields)


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a preset; every value is required."""
    return make_schema(_layout(), "ppafo rig preset")


@dataclass(frozen=True, slots=True)
class Preset:
    """Preset of the simulated bench: values [SI] and their reasons, by dotted path."""

    name: str
    title: str
    notes: str
    values: Mapping[str, float]
    reasons: Mapping[str, str]

    def section(self, name: str) -> dict[str, float]:
        """Return the values [SI] of a section, by name."""
        return {quantity.name: self.values[f"{name}.{quantity.name}"] for quantity in SECTIONS[name]}

    def with_value(self, path: str, value: float, reason: str) -> "Preset":
        """Return a copy of the preset with another value [SI].

        Raises ParameterError if the path is unknown or the value is out of range.
        """
        quantity = PATHS.get(path)
        if quantity is None:
            raise ParameterError(f"preset '{self.name}' has no value '{path}'{nearest_name(path, PATHS)}")
        if not (math.isfinite(value) and is_within(value, quantity)):
            raise ParameterError(f"preset '{self.name}': {path} = {value:g}: {range_rule(quantity, quantity.unit)}")
        return replace(self, values={**self.values, path: value}, reasons={**self.reasons, path: reason})


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
    preset = Preset(read.name, read.title, read.notes.strip(), {}, {})
    for path, quantity in PATHS.items():
        section, _, name = path.partition(".")
        entry: PresetValue = getattr(getattr(read, section), name)
        with refused_as(ParameterError, f"{file}: {path}", UnitError):
            in_si = to_si(entry.value, entry.unit, quantity.unit)
        with refused_as(ParameterError, file, ParameterError):
            preset = preset.with_value(path, in_si, entry.reason)
    for typed, override in override_set(read_overrides(overrides)).items():
        path = typed.removeprefix(PREFIX)
        if path not in PATHS or not typed.startswith(PREFIX):
            hint = nearest_name(typed, [f"{PREFIX}{known}" for known in PATHS])
            raise ParameterError(f"override '{override}': the simulated test bench has no value '{typed}'{hint}")
        with refused_as(ParameterError, f"override '{override}'", UnitError):
            value = parse_quantity(override.text, PATHS[path].unit)
        preset = preset.with_value(path, value, "override")
    return preset
