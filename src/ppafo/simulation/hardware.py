"""Device of a scenario: its parameter set with the overrides of the file, then those of the caller."""

import functools
import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ppafo.errors import ParameterError
from ppafo.parameters import ParameterSet, build_device, list_sets, load_parameter_set
from ppafo.parameters.declaration import OF_SECOND_CHAMBER
from ppafo.parameters.declared import value_at
from ppafo.parameters.device import Device
from ppafo.parameters.graph import Graph
from ppafo.parameters.overrides import CHOSEN_VALVE, Override, check_valve, read_overrides, with_overrides
from ppafo.parameters.parameter_set import (
    PATHS_THAT_SET_UNITS,
    atmospheric_pressure,
    chosen_units,
    chosen_valve,
    links_of_set,
    units_of_texts,
)
from ppafo.simulation.document import DocumentReader
from ppafo.wording import one_line

logger = logging.getLogger("ppafo")

_PARTS_WITH_UNITS = ("initial", "motion", "controller.peak_torque", "reference")
"""Parts of a file whose quantities define the display units of their author, in increasing priority."""


@dataclass(frozen=True, slots=True)
class Hardware:
    """Parameter set with all overrides applied, name of its selected valve, and links between its numbers.

    ``replaced`` is a sentence on values of the scenario that replace those of another set or valve, else "".
    """

    parameter_set: ParameterSet
    valve: str
    links: Graph
    replaced: str


def read_hardware(reading: DocumentReader) -> Hardware:
    """Return the parameter set with the overrides of the file, then those of the caller.

    Values of the file that replace those of another set or valve are logged. Raises ParameterError for unusable values.
    """
    section, in_file, overrides = reading.document["device"], reading.content.get("device", {}), reading.device
    valve = section.get("valve")
    try:
        of_file = read_overrides(section.get("overrides", ()))
        check_valve(of_file, in_file.get("valve"), f"device.valve = '{in_file.get('valve')}'")
        plain_set = reading.parameter_set or load_parameter_set(set_name(section["set"], reading.folder))
        valve_name = chosen_valve(plain_set, valve)
        owner, replacing = "", tuple[Override, ...]()
        if section["set"] != in_file.get("set"):
            # Another set than the file's own may have one chamber only.
            missing = OF_SECOND_CHAMBER if plain_set.has_one_chamber else ()
            of_file = tuple(item for item in of_file if item.typed not in missing)
            owner, replacing = section["set"], of_file
        elif valve != in_file.get("valve"):
            owner = f"valve '{valve_name}'"
            replacing = tuple(item for item in of_file if item.typed.startswith(CHOSEN_VALVE))
        overridden = {override.typed for override in overrides}
        in_force = [item for item in replacing if item.typed not in overridden]
        listed = ", ".join(map(str, in_force))
        replaced = f"values of the scenario replace values of {owner}: {listed}" if in_force else ""
        set_of_file = with_overrides(plain_set, of_file, valve)
        if replaced:
            _warn_once(f"ppafo: {reading.file}: {replaced}")
    except ParameterError as error:
        raise device_error(reading, error) from error
    before = atmospheric_pressure(set_of_file) if overrides else None
    changed = with_overrides(set_of_file, overrides, valve)
    return Hardware(changed, valve_name, links_of_set(changed, overridden, before), replaced)


_warn_once = functools.lru_cache(maxsize=64)(logger.warning)


def set_name(name: str, folder: Path) -> str:
    """Return the name of a shipped parameter set, or the path of a set file; relative paths start from ``folder``."""
    is_path = Path(name).suffix == ".toml" or "/" in name
    return str(folder / name) if is_path and name not in list_sets() else name


def read_device(reading: DocumentReader, hardware: Hardware) -> Device:
    """Return the device of a parameter set with its overrides; ParameterError for missing or contradictory values."""
    try:
        device = build_device(hardware.parameter_set, hardware.valve, hardware.links)
    except ParameterError as error:
        raise device_error(reading, error) from error
    written = chosen_units(_leaves([value_at(reading.document, part) for part in _PARTS_WITH_UNITS]))
    levels = [path for path in sorted(reading.overridden) if path.startswith(PATHS_THAT_SET_UNITS)]
    overridden = units_of_texts(value_at(reading.document, path) for path in levels)
    return replace(device, units={**device.units, **written, **overridden})


def _leaves(value: Any) -> list[Any]:
    """Return the values of nested tables and lists in order."""
    inner = list(value.values()) if isinstance(value, Mapping) else value
    return [leaf for item in inner for leaf in _leaves(item)] if isinstance(inner, list) else [value]


def device_error(reading: DocumentReader, error: ParameterError) -> ParameterError:
    """Return a ParameterError that names the scenario in which ``error`` was raised, on one line."""
    return ParameterError(f"{reading.file}: [device]: {one_line(error)}")
