"""Description of a module as plain data for JSON: settings with range, unit and origin, channels and metrics.

::

    {"name": ..., "title": ..., "version": ..., "kind": "scenario" or "walk",
     "document": the scenario or walk as its file has it, without overrides,
     "overrides": overrides of the scenario or walk,
     "settings": [{"key": "valve.area", "group": "valve", "name": "area", "unit": "m^2", "value": 1.26e-05,
                   "minimum": 0.0 or null, "is_minimum_allowed": true, "maximum": 0.01 or null, "is_whole": false,
                   "display": {"unit": "mm^2", "factor": 1e-06, "zero": 0.0}, "description": ..., "origin": "published",
                   "source": ..., "note": ..., "half_width": 95 % interval in SI or null,
                   "follows": key or null,
                   "made": {"terms": [{"rule": ..., "sources": [keys]}], "gap": ..., "when_set": false} or null,
                   "kept": "zero", "above zero" or null}, ...],
     "channels": [{"name": "time", "unit": "s", "display": {...}, "description": ...}, ...],
     "metrics": [{"name": ..., "unit": ..., "display": {...}, "description": ...}, ...],
     "relations": [{"key": ..., "relation": "below", "at most", "at least" or "above", "other": key,
                    "tolerance": 0.0, "is_share": true for a tolerance that is a fraction of the other}, ...]}

``key=value unit`` is an override of the scenario, as in ``ppafo simulate --set``. A value in SI is ``zero`` plus
``factor`` times the displayed value. ``origin`` is the origin stated by the parameter set (published, datasheet,
derived, identified, fitted, assumed), ``task`` for a number of the scenario itself, ``default`` for a number that is
not given, or ``changed`` for a number set by an override or a caller. A setting with ``follows`` equals the named
setting until changed itself. A setting with ``made`` is the sum of a gap and of rules applied to other settings.
``kept`` requires a setting to stay 0, or above 0; otherwise another program would be needed.
"""

import contextlib
import math
from typing import Any

from ppafo.errors import PpafoError
from ppafo.exports.c_library.files import OUTPUTS
from ppafo.exports.c_library.library import ExportParameter, Library, c_identifier
from ppafo.model.controlled import CONTROLLED
from ppafo.parameters import ParameterSet
from ppafo.parameters.device import Device
from ppafo.parameters.graph import ATMOSPHERE_PATH, itself
from ppafo.parameters.overrides import one_path, read_overrides
from ppafo.parameters.parameter_set import SOURCE, atmospheric_pressure, entry_in_si
from ppafo.report.display_units import display_unit
from ppafo.simulation.clock import TIMES
from ppafo.simulation.declaration import LOCKED_ANGLE, SEED
from ppafo.simulation.document import value_at
from ppafo.simulation.hardware import parameter_set_of
from ppafo.simulation.motion_kind import VANE, WALK
from ppafo.simulation.overrides import is_of_device
from ppafo.simulation.scenario import Scenario
from ppafo.units import split_pressure_kind, to_si
from ppafo.units.shown import quantity_of_unit
from ppafo.version import __version__

_KINDS = {VANE: "scenario", WALK: "walk"}
"""Name of a simulation on a page, by kind of motion."""
_TASK = {"origin": "task", "source": "", "note": "", "half_width": None}
_CHANGED = {**_TASK, "origin": "changed"}
_DEFAULT = {**_TASK, "origin": "default"}


def description_of(scenario: Scenario, library: Library) -> dict[str, Any]:
    """Return the description of a scenario's module, in the form given in the module docstring."""
    keys = {setting.name: setting.path for setting in library.settings}
    origins, kept = _origins(scenario, library), _kept(library)
    # Settings that have the number of another until they are changed by themselves.
    follows = {path: links[0].sources[0] for path, links in library.links.items() if links[0].is_same}
    # Settings that rules make of others until they are changed by themselves; a rule has the name of its function.
    # The page has the rules of a loop of torque: gains in 1/Pa have others under these names, and stay as they are.
    own = f"{scenario.controlled}." if CONTROLLED[scenario.controlled].unit.startswith("Pa") else ""
    made = {
        path: {
            "terms": [
                {
                    "rule": f"{own}{term.function.__module__.rpartition('.')[2]}.{term.function.__name__}",
                    "sources": list(term.sources),
                }
                for term in links[0].terms
            ],
            "gap": links[0].gap,
            "when_set": links[0].when_set,
        }
        for path, links in library.links.items()
        if any(term.function is not itself for term in links[0].terms)
    }
    program, atmosphere = library.program, scenario.device.supply.atmospheric_pressure
    channels = {"time": ("s", "since the start"), **{name: OUTPUTS[name] for name in program.outputs}}
    return {
        "name": library.title,
        "title": library.description,
        "version": __version__,
        "kind": _KINDS[scenario.motion.motion_kind.layout],
        "document": dict(scenario.origin.content),
        "overrides": list(scenario.origin.overrides),
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


def _kept(library: Library) -> dict[str, str]:
    """Return the settings, by C name, that must stay ``zero`` or ``above zero`` for the same program."""
    values = {setting.name: setting.value for setting in library.settings}
    kept: dict[str, str] = {}
    for names, is_above in library.switches:
        above = [name for name in names if values[name] > 0.0]
        if not is_above:
            kept |= dict.fromkeys(names, "zero")
        elif len(above) == 1:
            kept[above[0]] = "above zero"
    return kept


def _setting(setting: ExportParameter, atmosphere: float) -> dict[str, Any]:
    quantity = setting.quantity
    group, _, name = setting.path.rpartition(".")
    return {
        "key": setting.path,
        "group": group,
        "name": name,
        "unit": quantity.unit,
        "value": setting.value,
        "minimum": quantity.minimum if math.isfinite(quantity.minimum) else None,
        "is_minimum_allowed": quantity.minimum_allowed,
        "maximum": quantity.maximum if math.isfinite(quantity.maximum) else None,
        "is_whole": name == SEED.name,
        "display": display_of(quantity.unit, atmosphere, is_absolute=setting.path == ATMOSPHERE_PATH),
        "description": quantity.summary or quantity.name,
    }


def _shown(name: str, unit: str, said: str, atmosphere: float) -> dict[str, Any]:
    bare = "" if unit in ("-", "1") else unit
    return {"name": name, "unit": bare, "display": display_of(bare, atmosphere, "gas mass"), "description": said}


def display_of(unit: str, atmosphere: float, kilograms: str = "mass", is_absolute: bool = False) -> dict[str, Any]:
    """Return the display unit of a quantity and its conversion: SI value = ``zero`` + ``factor`` * displayed value.

    Pressures are gauge pressures relative to ``atmosphere`` [Pa], unless ``is_absolute``; ``kilograms`` is the kind of
    quantity of a mass.
    """
    quantity = kilograms if unit == "kg" else quantity_of_unit(unit)
    if not quantity:
        return {"unit": unit, "factor": 1.0, "zero": 0.0}
    shown = display_unit(quantity)
    if quantity.startswith("pressure"):
        is_change = quantity == "pressure change"
        bare, kind = (shown, "") if is_change else split_pressure_kind(shown)
        factor, is_absolute = to_si(1.0, f"{bare}_d", "Pa_d"), is_absolute or kind == "a"
        return {
            "unit": bare if is_change else f"{bare}_a" if is_absolute else f"{bare}_g",
            "factor": factor,
            "zero": 0.0 if is_change or is_absolute else atmosphere,
        }
    zero = to_si(0.0, shown, unit)
    return {"unit": shown, "factor": to_si(1.0, shown, unit) - zero, "zero": zero}


def _origins(scenario: Scenario, library: Library) -> dict[str, dict[str, Any]]:
    """Return the origin of each setting by path."""
    origin, device = scenario.origin, scenario.device
    # None where the set cannot be read any more.
    parameter_set: ParameterSet | None = None
    with contextlib.suppress(PpafoError):
        parameter_set = parameter_set_of(origin)
    assumed = {assumption.path: assumption.note for assumption in scenario.assumptions}
    changed = {
        c_identifier(one_path(override.typed, device.valve_name)) for override in read_overrides(origin.overrides)
    }
    origins: dict[str, dict[str, Any]] = {}
    for setting in library.settings:
        if setting.name in changed:
            origins[setting.path] = dict(_CHANGED)
        elif is_of_device(setting.path):
            origins[setting.path] = dict(_of_set(parameter_set, device, setting, follows=setting.path in library.links))
        else:
            # Times and the angle of a locked vane have no key of their own in every file, and are the task's anyway.
            is_given = value_at(origin.content, setting.path) is not None or setting.path in (*TIMES, LOCKED_ANGLE)
            origins[setting.path] = dict(_TASK if is_given else _DEFAULT)
        if setting.path in assumed and setting.name not in changed:
            origins[setting.path] |= {"origin": "assumed", "note": assumed[setting.path]}
    return origins


def _of_set(
    parameter_set: ParameterSet | None, device: Device, setting: ExportParameter, *, follows: bool
) -> dict[str, Any]:
    """Return the origin of a device number: from the set if unchanged, ``default`` if it ``follows`` another."""
    if parameter_set is None:
        return _CHANGED
    path = setting.path
    if path.startswith("valve."):
        path = f"valves.{device.valve_name}.{path.removeprefix('valve.')}"
    entry, declared = parameter_set.numbers.get(path), parameter_set.declarations().get(path)
    if entry is None or declared is None:
        return _DEFAULT if follows or setting.value == setting.quantity.default else _CHANGED
    if entry_in_si(entry, declared, atmospheric_pressure(parameter_set)) != setting.value:
        return _CHANGED
    if entry.source == SOURCE:
        return _TASK
    unit, si, half = entry.unit, setting.quantity.unit, None
    if si == "Pa_a":
        # Half of an interval is a difference, also of a level.
        unit, si = f"{unit[:-2]}_d", "Pa_d"
    if entry.uncertainty is not None:
        half = to_si(entry.uncertainty, unit, si)
    return {"origin": entry.origin, "source": entry.source, "note": entry.note, "half_width": half}
