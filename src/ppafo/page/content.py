"""Content of a page: settings with units, limits and sliders, relations, channels and metrics."""

import contextlib
import json
import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from ppafo.errors import ScenarioError, UnitError
from ppafo.model.controlled import CONTROLLED
from ppafo.page.motions import declared_content, is_walk, relations_in_files, usual_changes, with_limits
from ppafo.page.wasm import WasmModule
from ppafo.page.wasm.description import display_of
from ppafo.parameters.graph import ATMOSPHERE_PATH
from ppafo.parameters.joint import ANKLE, JointNames
from ppafo.parameters.overrides import over, read_overrides
from ppafo.report.display_units import metric_quantity
from ppafo.report.setting_names import REFERENCE_LEVELS, label_of
from ppafo.report.style import PAGE_LOOKS
from ppafo.simulation.declaration import PRESSURE_WORDS
from ppafo.simulation.document import value_at
from ppafo.simulation.overrides import is_of_device, override_document
from ppafo.simulation.profiles import limits_of
from ppafo.simulation.scenario import Scenario
from ppafo.units import conversion, from_si, parse_quantity, split_quantity, to_si
from ppafo.units.quantity import SI
from ppafo.units.shown import QUANTITIES, shown_in
from ppafo.version import __version__

Interval = tuple[float, float]

_LEVEL, _DIFFERENCE = "Pa_a", "Pa_d"
_UNITS: dict[str, tuple[str, ...]] = {
    _LEVEL: ("psi_g", "psi_a", "bar_g", "bar_a", "kPa_g", "kPa_a", "MPa_g", "MPa_a", "Pa_g", "Pa_a"),
    _DIFFERENCE: ("psi_d", "bar_d", "kPa_d", "Pa_d"),
    "m^2": ("mm^2", "cm^2", "m^2"),
    "m^3": ("cm^3", "mm^3", "L", "m^3"),
    "m^3/rad": ("cm^3/rad", "cm^3/deg", "m^3/rad"),
    "rad": ("deg", "rad"),
    "rad/s": ("deg/s", "rad/s"),
    "s": ("s", "ms", "us", "min"),
    "Hz": ("Hz", "kHz"),
    "K": ("K", "degC"),
    "kg": ("g", "kg", "mg"),
    "kg/mol": ("g/mol", "kg/mol"),
    "m": ("mm", "cm", "m"),
    "N m/rad": ("N m/rad", "N m/deg"),
    "kg m^2": ("g m^2", "kg cm^2", "kg m^2"),
    "kg m^2/s": ("g m^2/s", "kg m^2/s", "N m s"),
    "": ("", "percent"),
}
"""Units accepted for typed values, besides the display unit and the SI unit."""
_GAUGES = ("psi_g", "kPa_g", "bar_g", "Pa_g")
_NICE = (1.0, 2.0, 2.5, 5.0, 10.0)


@cache
def words() -> dict[str, Any]:
    """Load the texts of a page on claims, sliders and questions from ``words.toml``."""
    return tomllib.loads(files("ppafo.page").joinpath("words.toml").read_text(encoding="utf-8"))


@dataclass(frozen=True, slots=True)
class PageSimulation:
    """Scenario or walk with its WebAssembly module; ``label`` distinguishes it within a tab."""

    scenario: Scenario
    module: WasmModule
    label: str


def program_content(simulated: PageSimulation, module: str, intervals: Mapping[str, Interval]) -> dict[str, Any]:
    """Return the page data of a scenario; ``module`` is the id of the HTML element with its program."""
    described, joint = simulated.module.description, simulated.scenario.device.joint
    gauge = _gauge_texts(simulated.scenario, described["settings"])
    keys = {setting["key"] for setting in described["settings"]}
    # The file of a scenario or walk with the overrides in it; overrides of the device stay overrides.
    scenario, settings = simulated.scenario, []
    overridden = read_overrides(described["overrides"], ScenarioError)
    changed = override_document(described["document"], overridden, described["name"], declared_content(scenario))
    for stated in described["settings"]:
        entry = _in_given_unit(stated, value_at(changed.document, stated["key"]))
        display = entry["display"]
        # Pressures of a controller are absolute, and the file of a walk has limits that its program has not.
        if entry["group"] == "controller" and display["unit"].endswith("_g"):
            known = {**entry, "display": {**display, "unit": f"{display['unit'][:-2]}_a", "zero": 0.0}}
        else:
            known = with_limits(entry, scenario)
        settings.append(_setting(known, gauge, intervals, scenario))
    document, own = changed.document, changed.device
    of_file = document.get("device", {}).get("overrides", ())
    overrides = list(over(of_file, map(str, own), valve=scenario.device.valve_name))
    document["device"] = {**document.get("device", {}), **({"overrides": overrides} if overrides else {})}
    return {
        "name": described["name"],
        "kind": described["kind"],
        "actuator": simulated.scenario.device.actuator.kind,
        "label": simulated.label,
        # Walks, with and without the device, have colours in order.
        "look": 0 if is_walk(scenario) else PAGE_LOOKS.get(scenario.device.valve.kind, 0),
        "description": " ".join(described["title"].split()),
        "document": document,
        "usual": usual_changes(scenario),
        "deviceSections": sorted(
            {entry["key"].partition(".")[0] for entry in described["settings"] if is_of_device(entry["key"])}
        ),
        "settings": settings,
        "relations": [
            {
                **{name: relation[name] for name in ("key", "relation", "other")},
                "factor": 1.0 + relation["tolerance"] * relation["is_share"],
                "slack": 0.0 if relation["is_share"] else relation["tolerance"],
            }
            for relation in described["relations"]
        ]
        + relations_in_files(keys, scenario),
        "channels": [_shown(entry, joint) for entry in described["channels"] if entry["name"] != "time"],
        "metrics": [_shown(entry, joint) for entry in described["metrics"]],
        # Only of an actuator that makes its torque of a pressure so.
        "sustained": dict(_SUSTAINED) if keys >= set(_SUSTAINED.values()) else None,
        "module": module,
    }


_SUSTAINED = {
    "factor": "actuator.torque_constant",
    "raised": "supply.pressure",
    "lowered": "supply.dorsiflexion_pressure",
    "zero": ATMOSPHERE_PATH,
}
"""Settings that determine the static torque range at the supply pressures."""


def usual_values(scenario: Scenario) -> dict[str, float]:
    """Return the initial changes of a scenario on a page, as times [s] by key."""
    return {key: parse_quantity(text, "s") for key, text in usual_changes(scenario).items()}


def page_content(
    title: str,
    form: str,
    tabs: Sequence[Mapping[str, Any]],
    programs: Sequence[Mapping[str, Any]],
    joint: str = ANKLE.name,
) -> dict[str, Any]:
    """Return all page data except modules; ``joint`` is the joint in plot titles."""
    shown = {
        (entry["unit"], entry["shown"])
        for program in programs
        for kind in ("settings", "channels", "metrics")
        for entry in program[kind]
    }
    recorded = {("s", "s"), ("N m", "N m"), (_LEVEL, "psi_g"), ("rad", "deg"), ("", ""), ("kg", "g")}
    wanted: dict[str, dict[str, None]] = {}
    for si, unit in sorted(shown | recorded):
        wanted.setdefault(si, {}).update(dict.fromkeys((unit, *_UNITS.get(si, ()), si)))
    # Conversion of each unit that may be entered into SI: in decimals, as ``ppafo.units`` computes.
    scales: dict[str, list[dict[str, Any]]] = {}
    for si, units in wanted.items():
        scales[si] = []
        for unit in units:
            # A unit may be shown that cannot be typed for this quantity.
            with contextlib.suppress(UnitError):
                scale, offset, is_gauge = conversion(_typed(unit, si), si)
                scales[si].append({"unit": unit, "scale": str(scale), "offset": str(offset), "isGauge": is_gauge})
    return {
        "version": __version__,
        "title": title,
        "joint": joint,
        "form": form,
        "tabs": list(tabs),
        "bottle": json.loads(files("ppafo.page").joinpath("minutes.json").read_text(encoding="utf-8")),
        "programs": list(programs),
        "units": scales,
        # What a run computes nothing up to, by the unit in SI: the page shows it as 0, as all else does.
        "zeros": {unit: QUANTITIES[kind].zero for unit in wanted if (kind := metric_quantity(unit))},
    }


def _in_given_unit(entry: Mapping[str, Any], given: Any) -> Mapping[str, Any]:
    """Return a setting in the unit of its file, for example ``2 ms``; pressures keep the unit of the set."""
    si = entry["unit"]
    with contextlib.suppress(UnitError):
        unit = split_quantity(given)[1] if isinstance(given, str) and si not in (_LEVEL, _DIFFERENCE) else ""
        if unit not in ("", SI, si):
            zero = to_si(0.0, unit, si)
            return {**entry, "display": {"unit": unit, "factor": to_si(1.0, unit, si) - zero, "zero": zero}}
    return entry


def _setting(
    entry: Mapping[str, Any], gauge: Mapping[str, str], intervals: Mapping[str, Interval], scenario: Scenario
) -> dict[str, Any]:
    device, followed = scenario.device, CONTROLLED[scenario.controlled]
    key, half = entry["key"], entry["half_width"]
    interval = intervals.get(key) if half is None else (entry["value"] - half, entry["value"] + half)
    # An interval speaks of the value of the set; one that was put there by somebody is known to them.
    is_theirs = entry["origin"] == "changed" or (
        interval is not None and not interval[0] <= entry["value"] <= interval[1]
    )
    is_initial = key in ("initial.pressure_1", "initial.pressure_2")
    display = entry["display"]
    factor, zero = display["factor"], display["zero"]
    value = (entry["value"] - zero) / factor
    low, high = ((end - zero) / factor if end is not None else None for end in (entry["minimum"], entry["maximum"]))
    slider, begin, end = words()["sliders"].get(entry["key"]), math.inf, -math.inf
    if key in REFERENCE_LEVELS and followed.reach is not None:
        limits = limits_of(device, followed)
        begin, end = (float(f"{(limit - zero) / factor:.2g}") for limit in (limits.lowest, limits.highest))
    elif slider is not None:
        begin, end = float(slider[0]), float(slider[1])
        with shown_in({}):
            usual = display_of(entry["unit"], device.supply.atmospheric_pressure, is_absolute=key == ATMOSPHERE_PATH)
        if usual["unit"] != display["unit"]:
            # The file has its ends in the package's own units.
            sizes = [(usual["zero"] + usual["factor"] * each - zero) / factor for each in (begin, end)]
            begin, end = (float(f"{size:.2g}") for size in sizes)
    if not begin <= value <= end:
        end = high if high is not None and high <= 1.0 else 1.0
        if value:
            # The next round number that is not smaller.
            wide = 2.5 * abs(value)
            decade = 10.0 ** math.floor(math.log10(wide))
            end = next(step * decade for step in _NICE if step * decade >= wide * (1.0 - 1e-9))
        begin = -end if value < 0.0 else 0.0
    # A slider to a bound that is not allowed ends a hundredth of its way before it.
    is_small = low is not None and (not entry["is_minimum_allowed"] or 0.0 < low < end / 100.0)
    if entry["kept"] == "above zero" or (low is not None and low >= begin and is_small):
        begin = max(begin, (low or 0.0) + (end - (low or 0.0)) / 100.0)
    begin = begin if low is None else max(begin, low)
    end = end if high is None else min(end, high)
    return {
        "key": key,
        "label": device.joint.said(label_of(key, followed.words)),
        "unit": _bare(entry["unit"]),
        "shown": _typed(_bare(entry["display"]["unit"]), entry["unit"]),
        "low": entry["minimum"],
        "high": entry["maximum"],
        "isLowAllowed": entry["is_minimum_allowed"],
        "value": entry["value"],
        "text": gauge.get(key, ""),
        "follows": entry["follows"] or "",
        "made": entry["made"],
        "words": {word: f"supply.{name}" for word, name in PRESSURE_WORDS.items()} if is_initial else {},
        "kept": entry["kept"] or "",
        "slider": (min(begin, value), max(end, value)),
        "summary": device.joint.said(entry["description"]),
        "origin": entry["origin"],
        "source": entry["source"],
        "note": entry["note"],
        "interval": None if is_theirs else interval,
    }


def _bare(unit: str) -> str:
    """Return a display unit as typed by the user; empty for a plain number."""
    return "" if unit == "1" else unit


def _shown(entry: Mapping[str, Any], joint: JointNames) -> dict[str, str]:
    unit = _LEVEL if entry["unit"] == "Pa" else _bare(entry["unit"])
    text = entry["description"]
    return {
        "name": entry["name"],
        "unit": unit,
        "shown": _bare(entry["display"]["unit"]),
        "label": joint.said(text[:1].upper() + text[1:]),
    }


def _gauge_texts(scenario: Scenario, settings: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """Return the settings given as gauge pressures, as texts by key, since absolute values follow the atmosphere."""
    following = {entry["key"] for entry in settings if entry["follows"]}
    gaps = {
        path: link.gap
        for path, links in scenario.graph.items()
        for link in links
        if link.sources == (ATMOSPHERE_PATH,) and path not in following
    }
    texts = {}
    for path, gap in gaps.items():
        # As a file may write it: the shortest text that gives the same number.
        written = (
            f"{number!r} {unit}"
            for unit in _GAUGES
            for digits in range(1, 17)
            if to_si(number := float(f"{from_si(gap, unit, _LEVEL, 0.0):.{digits}g}"), unit, _LEVEL, 0.0) == gap
        )
        texts[path] = next(written, "")
    return texts


def _typed(unit: str, si: str) -> str:
    """Return the typed form of a display unit, with the suffix of a pressure difference."""
    return f"{unit}_d" if si == _DIFFERENCE and not unit.endswith("_d") else unit
