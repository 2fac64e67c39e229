"""Presets of the rig: how far it departs from the identified model. TOML files, each value with its unit and reason."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, Field

from ppafo.documents.models import STRICT, make_schema, quote, table
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import ParameterError, UnitError, nearest_name, one_line
from ppafo.model.declaration import Quantity
from ppafo.parameters.declaration import is_within
from ppafo.rig.declaration import PATHS, SECTIONS
from ppafo.units import parse_quantity, to_si


class PresetValue(BaseModel):
    """A value of the rig, with its reason."""

    model_config = STRICT

    value: float = Field(description="the number, in the unit beside it")
    unit: str = Field(description="unit of the number, such as 'mm^2'; empty for a plain number")
    reason: str = Field(min_length=1, description="reason for the number: a source, or why it was chosen")


def _description(quantity: Quantity) -> str:
    return f"{quantity.summary} [{quantity.unit or '-'}]"


def _section(name: str, quantities: tuple[Quantity, ...]) -> type[BaseModel]:
    title = "".join(part.capitalize() for part in name.split("_"))
    return table(title, {item.name: (PresetValue, Field(description=_description(item))) for item in quantities})


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a preset; every value is needed."""
    fields: dict[str, Any] = {
        "schema_version": (Literal[1], Field(description="version of this layout")),
        "name": (str, Field(description="name of the preset")),
        "title": (str, Field(description="which test bench it represents, in one line")),
        "notes": (str, Field(description="what is on, what is off, and where the values come from")),
    }
    fields |= {name: (_section(name, members), Field()) for name, members in SECTIONS.items()}
    return make_schema(table("RigPreset", fields), "ppafo rig preset")


PREFIX = "rig."
"""An override whose path begins so belongs to the preset, any other one to the device or the experiment."""

_FILE = TomlKind("preset of the rig", "rig", resources.files("ppafo.rig") / "presets", ParameterError)
_ENTRY = ("value", "unit", "reason")
_HEAD = ("schema_version", "name", "title", "notes")


@dataclass(frozen=True, slots=True)
class Preset:
    """A preset: values in SI by dotted path, and the reason for each."""

    name: str
    title: str
    notes: str
    values: Mapping[str, float]
    reasons: Mapping[str, str]

    def section(self, name: str) -> dict[str, float]:
        """Return the values of one section by name, in SI."""
        return {item.name: self.values[f"{name}.{item.name}"] for item in SECTIONS[name]}

    def with_value(self, path: str, value: float, reason: str) -> "Preset":
        """Return the preset with one value [SI] replaced. ParameterError where it is unknown or out of range."""
        quantity = PATHS.get(path)
        if quantity is None:
            raise ParameterError(f"preset '{self.name}' has no value '{path}'{nearest_name(path, PATHS)}")
        if not (math.isfinite(value) and is_within(value, quantity)):
            limits = f"from {quantity.minimum:g} to {quantity.maximum:g} {quantity.unit}".rstrip()
            raise ParameterError(f"preset '{self.name}': {path} = {value:g}: {quantity.summary} must be {limits}")
        return replace(self, values={**self.values, path: value}, reasons={**self.reasons, path: reason})


def list_presets() -> tuple[str, ...]:
    """Return the names of the presets that come with the package."""
    return _FILE.names()


def load_preset(name_or_path: str | Path, overrides: Iterable[str] = ()) -> Preset:
    """Return a preset by its name in the package or by the path of a TOML file.

    ``overrides`` are texts such as ``rig.pressure_sensor.noise=0 Pa_d``. ParameterError for anything that cannot be
    used.
    """
    file = label(str(name_or_path))
    preset = _parse(_FILE.parse(_FILE.read(name_or_path), file), file)
    for override in overrides:
        path, separator, text = (part.strip() for part in one_line(override).partition("="))
        if not separator or not path.startswith(PREFIX) or not text:
            raise ParameterError(f"override '{one_line(override)}' is not of the form {PREFIX}PATH=VALUE")
        preset = _override(preset, path.removeprefix(PREFIX), text)
    return preset


def _override(preset: Preset, path: str, text: str) -> Preset:
    if path not in PATHS:
        raise ParameterError(
            f"override '{PREFIX}{path}={text}': the rig has no value '{path}'{nearest_name(path, PATHS)}"
        )
    try:
        value = parse_quantity(text, PATHS[path].unit)
    except UnitError as error:
        raise ParameterError(f"override '{PREFIX}{path}={text}': {error}") from error
    return preset.with_value(path, value, "override")


def _parse(document: dict[str, Any], file: str) -> Preset:
    """Check keys, units and ranges of a document; every value must be there."""
    if not document:
        raise ParameterError(f"{file}: holds no values; 'ppafo schema rig' prints its format")
    _check_names(document, (*_HEAD, *SECTIONS), "", file)
    if document.get("schema_version") != 1:
        raise ParameterError(f"{file}: schema_version must be 1, it is {quote(document.get('schema_version'))}")
    for key in _HEAD[1:]:
        if not isinstance(document.get(key), str):
            raise ParameterError(f"{file}: '{key}' must be a text in quotation marks")
    preset = Preset(document["name"], document["title"], document["notes"].strip(), {}, {})
    for section, members in SECTIONS.items():
        table = _table(document, section, file)
        _check_names(table, [item.name for item in members], f"{section}.", file)
        for item in members:
            preset = _with_entry(preset, f"{section}.{item.name}", _table(table, item.name, file, f"{section}."), file)
    return preset


def _with_entry(preset: Preset, path: str, entry: dict[str, Any], file: str) -> Preset:
    _check_names(entry, _ENTRY, f"{path}.", file)
    value, unit, reason = (entry.get(name) for name in _ENTRY)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ParameterError(f"{file}: {path}.value = {quote(value)} must be a number")
    if not isinstance(unit, str) or not isinstance(reason, str) or not reason:
        raise ParameterError(f"{file}: {path} needs a unit and a reason, both texts")
    try:
        in_si = to_si(float(value), unit, PATHS[path].unit)
    except UnitError as error:
        raise ParameterError(f"{file}: {path}: {error}") from error
    try:
        return preset.with_value(path, in_si, reason)
    except ParameterError as error:
        raise ParameterError(f"{file}: {error}") from error


def _table(parent: Mapping[str, Any], key: str, file: str, before: str = "") -> dict[str, Any]:
    table = parent.get(key)
    if not isinstance(table, dict):
        raise ParameterError(f"{file}: there is no table [{before}{key}]")
    return table


def _check_names(table: Mapping[str, Any], allowed: Iterable[str], before: str, file: str) -> None:
    names = list(allowed)
    unknown = next((key for key in table if key not in names), None)
    if unknown is not None:
        hint = nearest_name(unknown, names)
        raise ParameterError(f"{file}: unknown key '{before}{one_line(unknown)}'{hint}; allowed: {', '.join(names)}")
