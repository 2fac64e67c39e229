"""Device of a scenario: its parameter set with the overrides of the file, then those of the caller."""

import functools
import logging
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ppafo.errors import ParameterError
from ppafo.parameters import ParameterSet, build_device, list_sets, load_parameter_set
from ppafo.parameters.declaration import OF_SECOND_CHAMBER
from ppafo.parameters.device import Device
from ppafo.parameters.graph import Graph
from ppafo.parameters.overrides import CHOSEN_VALVE, Override, check_valve, one_path, read_overrides, with_overrides
from ppafo.parameters.parameter_set import (
    PATHS_THAT_SET_UNITS,
    Entry,
    atmospheric_pressure,
    chosen_units,
    chosen_valve,
    links_of_set,
    units_of_texts,
)
from ppafo.simulation.document import DocumentReader, ScenarioRequest, value_at
from ppafo.simulation.overrides import is_of_device
from ppafo.simulation.scenario import Origin
from ppafo.wording import nearest_name, one_line, override_text

logger = logging.getLogger("ppafo")

_PARTS_WITH_UNITS = ("initial", "motion", "controller.peak_torque", "reference")
"""Parts of a file whose quantities define the display units of their author, in increasing priority."""


@dataclass(frozen=True, slots=True)
class Hardware:
    """Parameter set with all overrides applied, name of its selected valve, and links between its numbers.

    ``replaced`` is a sentence on values of the scenario that replace those of a set other than its own, else "".
    """

    parameter_set: ParameterSet
    valve: str
    links: Graph
    replaced: str


def read_hardware(reading: DocumentReader, request: ScenarioRequest, overrides: tuple[Override, ...]) -> Hardware:
    """Return the parameter set with the overrides of the file, then those of the caller."""
    section, in_file = reading.document["device"], request.content.get("device", {})
    valve = section.get("valve")
    try:
        of_file = read_overrides(section.get("overrides", ()))
        check_valve(of_file, in_file.get("valve"), f"device.valve = '{in_file.get('valve')}'")
        parameter_set = request.parameter_set or load_parameter_set(set_name(section["set"], request.folder))
        kinds = parameter_set.valve_kinds
        if valve is not None and valve not in kinds and not nearest_name(valve, kinds):
            # The scenario names the valve of another device.
            raise ParameterError(
                f"{parameter_set.file}: there is no valve '{valve}'; available: {', '.join(kinds)}; give "
                f"{override_text((f'device.valve={parameter_set.default_valve}',))}"
            )
        name = chosen_valve(parameter_set, valve)
        is_own = section["set"] == in_file.get("set")
        of_file = _overrides_for(of_file, parameter_set, is_own)
        of_valve = [item for item in of_file if item.typed.startswith(CHOSEN_VALVE) and valve != in_file.get("valve")]
        entries = {one_path(path, name): entry for path, entry in parameter_set.numbers.items()}
        owner, replacing = (f"valve '{name}'", of_valve) if is_own else (section["set"], of_file)
        replaced = _replaced_text(entries, owner, replacing, overrides)
        parameter_set = with_overrides(parameter_set, of_file, valve)
        if replaced:
            _warn_once(f"ppafo: {reading.file}: {replaced}")
    except ParameterError as error:
        raise device_error(reading, error) from error
    before = atmospheric_pressure(parameter_set) if overrides else None
    changed = with_overrides(parameter_set, overrides, valve)
    return Hardware(changed, name, links_of_set(changed, {override.typed for override in overrides}, before), replaced)


def _overrides_for(of_file: tuple[Override, ...], parameter_set: ParameterSet, is_own: bool) -> tuple[Override, ...]:
    """Return the file's overrides that apply to a parameter set; ``is_own`` is true for the set that the file names."""
    if is_own or not parameter_set.has_one_chamber:
        return of_file
    return tuple(item for item in of_file if item.typed not in OF_SECOND_CHAMBER)


def _replaced_text(
    numbers: Mapping[str, Entry], name: str, of_file: Sequence[Override], overrides: tuple[Override, ...]
) -> str:
    """Sentence on values of the scenario file that replace values of the set or valve ``name``; "" without any."""
    given = {override.typed for override in overrides}
    replaced = [item for item in of_file if item.typed not in given]
    if not replaced:
        return ""
    entries = [(item.typed, numbers.get(item.typed)) for item in replaced]
    kept = [f"{path}={entry.value:.12g} {entry.unit}".rstrip() for path, entry in entries if entry is not None]
    keeping = f"; {override_text(kept)} restores the replaced values" if kept else ""
    return f"values of the scenario replace values of {name}: {', '.join(map(str, replaced))}{keeping}"


_warn_once = functools.lru_cache(maxsize=64)(logger.warning)


def parameter_set_of(origin: Origin) -> ParameterSet:
    """Return the parameter set of a scenario's device, with the overrides of its file and then those of the caller.

    Raises ParameterError if the set can no longer be read.
    """
    folder = Path() if origin.file is None else Path(origin.file).parent
    in_file = origin.content.get("device", {})
    of_file = read_overrides(in_file.get("overrides", ()))
    of_caller = [override for override in read_overrides(origin.overrides) if is_of_device(override.typed)]
    parameter_set = load_parameter_set(set_name(origin.parameter_set, folder))
    of_file = _overrides_for(of_file, parameter_set, origin.parameter_set == in_file.get("set"))
    return with_overrides(with_overrides(parameter_set, of_file, origin.valve), of_caller, origin.valve)


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
    written = chosen_units(_texts([value_at(reading.document, part) for part in _PARTS_WITH_UNITS]))
    levels = [path for path in sorted(reading.overridden) if path.startswith(PATHS_THAT_SET_UNITS)]
    overridden = units_of_texts(value_at(reading.document, path) for path in levels)
    return replace(device, units={**device.units, **written, **overridden})


def _texts(values: Iterable[Any]) -> Iterator[Any]:
    """Yield the values of nested tables and lists in order."""
    for value in values:
        if isinstance(value, Mapping | list):
            yield from _texts(value.values() if isinstance(value, Mapping) else value)
        else:
            yield value


def device_error(reading: DocumentReader, error: ParameterError) -> ParameterError:
    """Return a ParameterError that names the scenario in which ``error`` was raised, on one line."""
    return ParameterError(f"{reading.file}: [device]: {one_line(error)}")
