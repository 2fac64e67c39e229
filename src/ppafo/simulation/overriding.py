"""Overrides of a scenario: ``PATH=VALUE`` where the path begins in the scenario or in its device."""

import copy
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from ppafo.errors import ScenarioError, nearest_name, one_line
from ppafo.model.valves.catalog import VALVES
from ppafo.parameters.declaration import ORIFICE, RELIEVING_PATH, SPECIES_PATH
from ppafo.parameters.declaration import quantities as device_quantities
from ppafo.simulation import declaration, supply_line

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_SEED = "sensors.seed"
_ONE_OR_OTHER = {"controller.rate": "period", "controller.period": "rate"}
_OWN_KEYS = {"controller": frozenset({"kind", "rate", "period"})}


@dataclass(frozen=True, slots=True)
class OverriddenDocument:
    """A document with overrides in it: paths that were set, and the overrides that belong to the device."""

    document: dict[str, Any]
    paths: frozenset[str]
    device: tuple[str, ...]


def apply_overrides(document: Mapping[str, Any], overrides: Iterable[str], file: str) -> OverriddenDocument:
    """Return a changed copy of a document; ``file`` is what messages call it.

    Naming another kind of motion, controller or profile drops the settings that only the old kind has; giving a rate
    drops the period, and the reverse. A gain on the torque may leave out its unit. ScenarioError for a path that is
    neither of the scenario nor of its device.
    """
    changed = copy.deepcopy(dict(document))
    paths: set[str] = set()
    device: list[str] = []
    for override in overrides:
        path, text = split_override(override)
        if is_of_device(path):
            device.append(override)
            continue
        known = scenario_paths(changed)
        if path not in known:
            raise unknown_value(override, known, f"{file} has")
        if path == "motion.kind":
            declaration.check_motion_kind(text, f"override '{override}'")
        _set(changed, path, text, file)
        paths.add(path)
    return OverriddenDocument(changed, frozenset(paths), tuple(device))


def split_override(override: str) -> tuple[str, str]:
    """Return path and value of a text such as ``run.duration=1 s``. ScenarioError for any other text."""
    on_one_line = one_line(override)
    path, separator, text = (part.strip() for part in on_one_line.partition("="))
    if not separator or not path or not text:
        raise ScenarioError(f"override '{on_one_line}' is not of the form PATH=VALUE, as valve.area=12.6mm^2 is")
    return path, text


def scenario_paths(document: Mapping[str, Any]) -> tuple[str, ...]:
    """Return every path of the scenario that an override can set, for the kinds that the document names."""
    return (*declaration.texts(document), *(declaration.quantities(document) | supply_line.paths()))


def device_paths() -> tuple[str, ...]:
    """Return every path of the device that an override can set, with ``valve`` for the one that is chosen."""
    sections = [path for path in device_quantities({}) if not path.startswith("reported.")]
    valve = [*ORIFICE, *(item for kind in VALVES.values() for item in kind.quantities)]
    return (*sections, SPECIES_PATH, RELIEVING_PATH, *(f"valve.{item.name}" for item in valve))


def is_of_device(path: str) -> bool:
    """Tell whether a path begins in the device, which then has the say about the rest of it."""
    sections = {path.partition(".")[0] for path in device_paths()} | {"valves", "reported"}
    return path.partition(".")[0] in sections


def unknown_value(override: str, known: tuple[str, ...], who_has: str) -> ScenarioError:
    """Return the error for a path that is neither known nor of the device; ``who_has`` begins as ``task.toml has``."""
    path, _ = split_override(override)
    allowed = [*known, *device_paths()]
    section = path.partition(".")[0]
    near = [name for name in known if name.startswith(f"{section}.")]
    hint = nearest_name(path, allowed) or f"; for example {', '.join(near[:6] or known[:6])}"
    return ScenarioError(f"override '{one_line(override)}': {who_has} no value '{path}'{hint}")


def _set(document: dict[str, Any], path: str, text: str, file: str) -> None:
    section, _, name = path.rpartition(".")
    table = document
    for part in section.split(".") if section else ():
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            raise ScenarioError(f"override '{path}={text}': {file} has no table [{section}]")
    if name == "kind" and table.get("kind") != text:
        _drop_settings_of_old_kind(document, section, text)
    table.pop(_ONE_OR_OTHER.get(path, ""), None)
    table[name] = _seed(path, text) if path == _SEED else _with_unit_of_gain(document, path, text)


def _drop_settings_of_old_kind(document: dict[str, Any], section: str, kind: str) -> None:
    table = declaration.value_at(document, section)
    before = _setting_names(document, section)
    table["kind"] = kind
    after = _setting_names(document, section)
    for name in before - after - _OWN_KEYS.get(section, frozenset()):
        table.pop(name, None)


def _setting_names(document: dict[str, Any], section: str) -> frozenset[str]:
    """Return the keys that a section can have beside its kind."""
    prefix = f"{section}."
    paths = [path.removeprefix(prefix) for path in scenario_paths(document) if path.startswith(prefix)]
    return frozenset(path.partition(".")[0] for path in paths) - {"kind"}


def _with_unit_of_gain(document: dict[str, Any], path: str, text: str) -> str:
    """Return the text with the SI unit of a gain on the torque where it has none: papers print gains without units."""
    quantity = declaration.quantities(document).get(path)
    is_gain = quantity is not None and path.startswith("controller.") and "(N m" in quantity.unit
    return f"{text} {quantity.unit}" if quantity is not None and is_gain and _NUMBER.fullmatch(text) else text


def _seed(path: str, text: str) -> int:
    try:
        return int(text)
    except ValueError as error:
        raise ScenarioError(f"override '{path}={text}': must be a whole number") from error
