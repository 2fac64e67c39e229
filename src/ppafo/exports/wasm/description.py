"""What a page must know of a module: settings with range, unit and origin, channels, metrics; plain data for JSON.

::

    {"name": ..., "title": ..., "version": ..., "kind": "scenario" or "walk",
     "document": the scenario or walk as its file has it, without overrides,
     "overrides": those of it,
     "settings": [{"key": "valve.area", "group": "valve", "name": "area", "unit": "m^2", "value": 1.26e-05,
                   "minimum": 0.0 or null, "is_minimum_allowed": true, "maximum": 0.01 or null, "is_whole": false,
                   "display": {"unit": "mm^2", "factor": 1e-06, "zero": 0.0}, "description": ..., "origin": "published",
                   "source": ..., "note": ..., "half_width": 95 % interval in SI or null,
                   "follows": key or null,
                   "made": {"terms": [{"rule": ..., "sources": [keys]}], "gap": ...} or null,
                   "kept": "zero", "above zero" or null}, ...],
     "channels": [{"name": "time", "unit": "s", "display": {...}, "description": ...}, ...],
     "metrics": [{"name": ..., "unit": ..., "display": {...}, "description": ...}, ...],
     "relations": [{"key": ..., "relation": "below", "at most", "at least" or "above", "other": key,
                    "tolerance": 0.0, "is_share": true where that is a share of the other}, ...]}

``key=value unit`` is an override of the scenario as ``ppafo simulate --set`` takes it. A value in SI is ``zero`` plus
``factor`` times the one that is shown. ``origin`` is that of the parameter set (published, datasheet, derived,
identified, fitted, assumed), ``task`` for a number of the scenario itself, ``default`` for one that nobody gave, or
``changed`` for one that an override or a caller put there. What ``follows`` another setting is the same number as
long as nobody changes it by itself; what is ``made`` of others is the sum of a gap and of what rules make of them.
``kept`` says that a setting must stay 0, or above 0, as another program would be needed.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ppafo.answers.display_units import display_unit, quantity_of_unit
from ppafo.errors import PpafoError
from ppafo.exports.c_library.files import OUTPUTS, Library, Setting, c_identifier
from ppafo.parameters import ParameterSet, apply_overrides, load_parameter_set
from ppafo.parameters.device import Device
from ppafo.parameters.graph import ATMOSPHERE_PATH, Graph, Term, itself
from ppafo.parameters.overrides import SOURCE
from ppafo.parameters.parameter_set import Entry, atmospheric_pressure, entry_in_si
from ppafo.simulation.building import is_of_device, set_name, split_override
from ppafo.simulation.declaration import SEED, value_at
from ppafo.simulation.numbers import HELD_ANGLE, TIMES
from ppafo.simulation.scenario import Scenario, worn_kind
from ppafo.units import to_si
from ppafo.version import __version__

if TYPE_CHECKING:
    from ppafo.simulation.scenario import Scenario

_TASK = {"origin": "task", "source": "", "note": "", "half_width": None}
_CHANGED = {**_TASK, "origin": "changed"}
_DEFAULT = {**_TASK, "origin": "default"}


@dataclass(frozen=True, slots=True)
class _File:
    """What was read: the document, where relative paths begin, overrides on top, and the reasons for assumptions."""

    document: Mapping[str, Any]
    folder: Path
    overrides: Sequence[str]
    assumed: Mapping[str, str]


def description_of(item: Scenario, library: Library) -> dict[str, Any]:
    """The description of the module of a scenario or a walk, as the beginning of this file has it."""
    file = _file_of_scenario(item)
    keys = {setting.name: setting.path for setting in library.settings}
    origins, follows, kept = _origins(file, item.device, library), _follows(library.links), _kept(library)
    # Settings that rules make of others until they are changed by themselves; a rule has the name of its function.
    made = {
        path: {
            "terms": [
                {"rule": f"{_module(term)}.{term.function.__name__}", "sources": list(term.sources)}
                for term in found[0].terms
            ],
            "gap": found[0].gap,
        }
        for path, found in library.links.items()
        if any(term.function is not itself for term in found[0].terms)
    }
    program, atmosphere = library.program, item.device.supply.atmospheric_pressure
    channels = {"time": ("s", "since the start"), **{name: OUTPUTS[name] for name in program.outputs}}
    return {
        "name": library.title,
        "title": library.description,
        "version": __version__,
        "kind": "scenario" if worn_kind(item) is None else "walk",
        "document": dict(file.document),
        "overrides": list(file.overrides),
        "settings": [
            {
                **_setting(setting, atmosphere),
                **origins[setting.path],
                "follows": follows.get(setting.path),
                "made": made.get(setting.path),
                "kept": kept.get(setting.name),
            }
            for setting in library.settings
        ],
        "channels": [_shown(name, unit, said, atmosphere) for name, (unit, said) in channels.items()],
        "metrics": [_shown(kind.name, kind.unit, kind.summary, atmosphere) for kind in program.metrics],
        "relations": [
            {
                "key": keys[rule.name],
                "relation": rule.relation,
                "other": keys[rule.other],
                "tolerance": rule.tolerance,
                "is_share": rule.is_share,
            }
            for rule in library.relations
        ],
    }


def _file_of_scenario(scenario: Scenario) -> _File:
    origin = scenario.origin
    folder = Path() if origin.file is None else Path(origin.file).parent
    return _File(origin.content, folder, origin.overrides, {item.path: item.note for item in scenario.assumptions})


def _kept(library: Library) -> dict[str, str]:
    """How settings must stay, by name in C; of some of which any must be above 0 that one which alone is."""
    values = {item.name: item.value for item in library.settings}
    found: dict[str, str] = {}
    for switch in library.switches:
        above = [name for name in switch.names if values[name] > 0.0]
        if not switch.is_above:
            found |= dict.fromkeys(switch.names, "zero")
        elif len(above) == 1:
            found[above[0]] = "above zero"
    return found


def _setting(item: Setting, atmosphere: float) -> dict[str, Any]:
    quantity = item.quantity
    group, _, name = item.path.rpartition(".")
    return {
        "key": item.path,
        "group": group,
        "name": name,
        "unit": quantity.unit,
        "value": item.value,
        "minimum": quantity.minimum if math.isfinite(quantity.minimum) else None,
        "is_minimum_allowed": quantity.minimum_allowed,
        "maximum": quantity.maximum if math.isfinite(quantity.maximum) else None,
        "is_whole": name == SEED.name,
        "display": display_of(quantity.unit, atmosphere, is_absolute=item.path == ATMOSPHERE_PATH),
        "description": quantity.summary or quantity.name,
    }


def _shown(name: str, unit: str, said: str, atmosphere: float) -> dict[str, Any]:
    bare = "" if unit in ("-", "1") else unit
    return {"name": name, "unit": bare, "display": display_of(bare, atmosphere, "gas mass"), "description": said}


def display_of(unit: str, atmosphere: float, kilograms: str = "mass", is_absolute: bool = False) -> dict[str, Any]:
    """In which unit a quantity is shown, and how: a value in SI is ``zero`` plus ``factor`` times the one shown.

    Gauge pressures count from ``atmosphere`` [Pa], but where ``is_absolute``; ``kilograms`` is what a mass is.
    """
    quantity = kilograms if unit == "kg" else quantity_of_unit(unit)
    if not quantity:
        return {"unit": unit, "factor": 1.0, "zero": 0.0}
    shown = display_unit(quantity)
    if quantity.startswith("pressure"):
        bare = shown.removesuffix("_g")
        factor, is_change = to_si(1.0, f"{bare}_d", "Pa_d"), quantity == "pressure change"
        return {
            "unit": bare if is_change else f"{bare}_a" if is_absolute else f"{bare}_g",
            "factor": factor,
            "zero": 0.0 if is_change or is_absolute else atmosphere,
        }
    zero = to_si(0.0, shown, unit)
    return {"unit": shown, "factor": to_si(1.0, shown, unit) - zero, "zero": zero}


def _origins(file: _File, device: Device, library: Library) -> dict[str, dict[str, Any]]:
    """Where the value of each setting comes from, by path."""
    parameter_set = _parameter_set(file, device)
    changed = {c_identifier(_of_valve(split_override(text)[0], device)) for text in file.overrides}
    found: dict[str, dict[str, Any]] = {}
    for item in library.settings:
        if item.name in changed:
            found[item.path] = dict(_CHANGED)
        elif is_of_device(item.path):
            found[item.path] = dict(_of_set(parameter_set, device, item))
        else:
            is_given = value_at(file.document, item.path) is not None or item.path in (*TIMES, HELD_ANGLE)
            found[item.path] = dict(_TASK if is_given else _DEFAULT)
        if item.path in file.assumed and item.name not in changed:
            found[item.path] |= {"origin": "assumed", "note": file.assumed[item.path]}
    return found


def _of_valve(path: str, device: Device) -> str:
    """A path with ``valve.`` for the valve of the device."""
    own = f"valves.{device.valve_name}."
    return f"valve.{path.removeprefix(own)}" if path.startswith(own) else path


def _of_set(parameter_set: ParameterSet | None, device: Device, item: Setting) -> dict[str, Any]:
    """Origin of a number of the device: that of the set where it has this very value."""
    if parameter_set is None:
        return _CHANGED
    path = item.path
    if path.startswith("valve."):
        path = f"valves.{device.valve_name}.{path.removeprefix('valve.')}"
    entry, declared = parameter_set.numbers.get(path), parameter_set.declarations().get(path)
    if entry is None or declared is None:
        return _DEFAULT if item.value == item.quantity.default else _CHANGED
    if entry_in_si(entry, declared, atmospheric_pressure(parameter_set)) != item.value:
        return _CHANGED
    if entry.source == SOURCE:
        return _TASK
    return {"origin": entry.origin, "source": entry.source, "note": entry.note, "half_width": _half_width(entry, item)}


def _half_width(entry: Entry, item: Setting) -> float | None:
    """Half of the interval of a value, in SI."""
    if entry.uncertainty is None:
        return None
    unit, si = entry.unit, item.quantity.unit
    if si == "Pa_a":
        unit, si = f"{unit[:-2]}_d", "Pa_d"
    return to_si(entry.uncertainty, unit, si)


def _parameter_set(file: _File, device: Device) -> ParameterSet | None:
    """The set of the device with all overrides; None where it cannot be read any more."""
    section: Mapping[str, Any] = file.document.get("device", {})
    own = [text for text in file.overrides if is_of_device(split_override(text)[0])]
    try:
        found = load_parameter_set(set_name(section.get("set", device.name), file.folder))
        return apply_overrides(found, (*section.get("overrides", ()), *own), device.valve_name)
    except PpafoError:
        return None


def _follows(links: Graph) -> dict[str, str]:
    """Settings that have the number of another until they are changed by themselves."""
    return {path: found[0].sources[0] for path, found in links.items() if found[0].is_same}


def _module(term: Term) -> str:
    return term.function.__module__.rpartition(".")[2]
