"""What a page needs of each scenario, as plain data for its script: settings, units, channels, metrics, tabs.

The shapes are those of ``page/source/content.ts``, which says what each entry means.
"""

import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from ppafo.answers.style import PAGE_LOOKS
from ppafo.errors import UnitError
from ppafo.exports.wasm import WasmModule
from ppafo.parameters.graph import ATMOSPHERE_PATH
from ppafo.simulation.building import apply_overrides, is_of_device
from ppafo.simulation.declaration import OF_A_VANE, PRESSURE_WORDS
from ppafo.simulation.scenario import Scenario, worn_kind
from ppafo.units import conversion, from_si, to_si
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
"""Units in which a person may type a value, beside the unit in which it is shown and that in SI."""
_GAUGES = ("psi_g", "kPa_g", "bar_g", "Pa_g")
_FIRST_STRIDE = "controller.first_stride_time"
_WALKED = 6
"""Length [s] of a walk in a page, unless somebody wants more: five strides."""
_ABSOLUTE = ("largest_pressure",)
"""Metrics whose name says that a pressure is absolute."""
_NICE = (1.0, 2.0, 2.5, 5.0, 10.0)


@dataclass(frozen=True, slots=True)
class Simulated:
    """A scenario or walk and the module that simulates it; ``label`` tells it from others of its tab."""

    scenario: Scenario
    module: WasmModule
    label: str


@cache
def words() -> dict[str, Any]:
    """Return names, first settings and sliders: ``words.toml``."""
    return tomllib.loads(files("ppafo.live").joinpath("words.toml").read_text(encoding="utf-8"))


def program_content(item: Simulated, module: str, intervals: Mapping[str, Interval]) -> dict[str, Any]:
    """Return what the page knows of a scenario; ``module`` is the element that holds its program."""
    told = item.module.description
    gauge = _gauge_texts(item.scenario, told["settings"])
    document = _document(told)
    return {
        "name": told["name"],
        "kind": told["kind"],
        "label": item.label,
        # With and without the device, a walk takes colours in their order, as its figures do.
        "look": PAGE_LOOKS.get(item.scenario.device.valve.kind, 0) if worn_kind(item.scenario) is None else 0,
        "description": " ".join(told["title"].split()),
        "document": document,
        "usual": usual_changes(item.scenario),
        "deviceSections": sorted(
            {entry["key"].partition(".")[0] for entry in told["settings"] if is_of_device(entry["key"])}
        ),
        "settings": [_setting(_as_in_files(entry, item.scenario), gauge, intervals) for entry in told["settings"]],
        "relations": [
            {
                "key": one["key"],
                "relation": one["relation"],
                "other": one["other"],
                "factor": 1.0 + one["tolerance"] * one["is_share"],
                "slack": 0.0 if one["is_share"] else one["tolerance"],
            }
            for one in told["relations"]
        ]
        + _relations_of_files(told),
        "channels": [_shown(entry) for entry in told["channels"] if entry["name"] != "time"],
        "metrics": [_shown(entry) for entry in told["metrics"]],
        "module": module,
    }


def usual_changes(scenario: Scenario) -> dict[str, str]:
    """Return the changes that a configuration of a page begins with, texts by key: a walk is short."""
    if worn_kind(scenario) is None:
        return {}
    from ppafo.walking.motion import walk_of
    from ppafo.walking.varying import SHORTEST_STRIDES

    return {"run.duration": f"{max(_WALKED, math.ceil(SHORTEST_STRIDES * walk_of(scenario).gait.stride_time))} s"}


def _relations_of_files(told: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Contradictions that the file of a walk refuses and its program does not."""
    if told["kind"] != "walk":
        return []
    from ppafo.walking.contradictions import COMPRESSION

    above = (
        ("controller.highest_pressure", "supply.pressure", COMPRESSION),
        ("controller.highest_pressure", "supply.dorsiflexion_pressure", COMPRESSION),
        ("controller.frozen_time", "controller.period", 2.0),
        ("controller.fill_time", "valve.delay", 1.0),
        ("controller.vent_time", "valve.delay", 1.0),
    )
    keys = {entry["key"] for entry in told["settings"]}
    return [
        {"key": key, "relation": "above", "other": other, "factor": factor, "slack": 0.0}
        for key, other, factor in above
        if {key, other} <= keys
    ]


def _as_in_files(entry: Mapping[str, Any], item: Scenario) -> dict[str, Any]:
    """A setting with what only Python knows of a walk: its stride and length, and which pressures are absolute."""
    if worn_kind(item) is not None and entry["key"] in (_FIRST_STRIDE, "run.duration"):
        from ppafo.walking.motion import walk_of
        from ppafo.walking.varying import LONGEST_MINUTES, SHORTEST_STRIDES

        stride = walk_of(item).gait.stride_time
        if entry["key"] == _FIRST_STRIDE:
            return {**entry, "minimum": 0.5 * stride, "maximum": 2.0 * stride}
        shortest = SHORTEST_STRIDES * stride
        return {**entry, "minimum": shortest, "maximum": 60.0 * LONGEST_MINUTES, "is_minimum_allowed": True}
    if entry["group"] == "controller" and entry["display"]["unit"] == "psi_g":
        return {**entry, "display": {**entry["display"], "unit": "psi_a", "zero": 0.0}}
    return dict(entry)


def _document(told: Mapping[str, Any]) -> dict[str, Any]:
    """The file of a scenario or walk with the overrides in it; those of the device stay overrides."""
    declared = OF_A_VANE
    if told["kind"] == "walk":
        from ppafo.walking.declaration import OF_A_WALK

        declared = OF_A_WALK
    changed = apply_overrides(told["document"], told["overrides"], told["name"], declared)
    document, own = changed.document, changed.device
    overrides = [*document.get("device", {}).get("overrides", ()), *own]
    document["device"] = {**document.get("device", {}), **({"overrides": overrides} if overrides else {})}
    return document


def page_content(
    title: str, form: str, tabs: Sequence[Mapping[str, Any]], programs: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    """Return all that a page is made of, but its modules."""
    shown = {
        (entry["unit"], entry["shown"])
        for one in programs
        for kind in ("settings", "channels", "metrics")
        for entry in one[kind]
    }
    recorded = {("s", "s"), ("N m", "N m"), (_LEVEL, "psi_g"), ("rad", "deg"), ("", ""), ("kg", "g")}
    return {
        "version": __version__,
        "title": title,
        "form": form,
        "tabs": list(tabs),
        "programs": list(programs),
        "units": _scales(shown | recorded),
    }


def _setting(entry: Mapping[str, Any], gauge: Mapping[str, str], intervals: Mapping[str, Interval]) -> dict[str, Any]:
    key, half = entry["key"], entry["half_width"]
    interval = intervals.get(key) if half is None else (entry["value"] - half, entry["value"] + half)
    # An interval speaks of the value of the set; one that was put there by somebody is known to them.
    is_theirs = entry["origin"] == "changed" or (
        interval is not None and not interval[0] <= entry["value"] <= interval[1]
    )
    is_initial = key in ("initial.pressure_1", "initial.pressure_2")
    # ``sensors.angle_noise`` is the angle noise of the sensors.
    said = entry["name"].replace("_", " ")
    prefix = {"sensors": "Sensors: ", "supply_line": "Line: "}.get(entry["group"].partition(".")[0], "")
    return {
        "key": key,
        "label": words()["labels"].get(key, f"{prefix}{said}" if prefix else said[:1].upper() + said[1:]),
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
        "slider": _slider(entry),
        "summary": entry["description"],
        "origin": entry["origin"],
        "source": entry["source"],
        "note": entry["note"],
        "interval": None if is_theirs else interval,
    }


def _bare(unit: str) -> str:
    """A unit as it is typed; a plain number has none."""
    return "" if unit == "1" else unit


def _slider(entry: Mapping[str, Any]) -> Interval:
    """Ends of a slider in the unit that is shown, with the value inside."""
    display = entry["display"]
    factor, zero = display["factor"], display["zero"]
    value = (entry["value"] - zero) / factor
    low, high = ((end - zero) / factor if end is not None else None for end in (entry["minimum"], entry["maximum"]))
    given = words()["sliders"].get(entry["key"])
    if given is not None:
        begin, end = float(given[0]), float(given[1])
    else:
        end = _nice(2.5 * abs(value)) if value else (high if high is not None and high <= 1.0 else 1.0)
        begin = -end if value < 0.0 else 0.0
    if entry["kept"] == "above zero" or (low is not None and low >= begin and not entry["is_minimum_allowed"]):
        begin = max(begin, (low or 0.0) + (end - (low or 0.0)) / 100.0)
    begin = begin if low is None else max(begin, low)
    end = end if high is None else min(end, high)
    return min(begin, value), max(end, value)


def _nice(value: float) -> float:
    """The next round number that is not smaller."""
    decade = 10.0 ** math.floor(math.log10(value))
    return next(step * decade for step in _NICE if step * decade >= value * (1.0 - 1e-9))


def _shown(entry: Mapping[str, Any]) -> dict[str, str]:
    unit = _LEVEL if entry["unit"] == "Pa" else _bare(entry["unit"])
    text = entry["description"]
    return {
        "name": entry["name"],
        "unit": unit,
        "shown": "psi_a" if entry["name"] in _ABSOLUTE else _bare(entry["display"]["unit"]),
        "label": text[:1].upper() + text[1:],
    }


def _gauge_texts(item: Scenario, settings: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """Texts of the pressures that count from the atmosphere: they move with it, as they do in Python."""
    following = {entry["key"] for entry in settings if entry["follows"]}
    gaps = {
        path: link.gap for path, links in item.graph.items() for link in links if link.sources == (ATMOSPHERE_PATH,)
    }
    return {path: _gauge_text(gap, 0.0) for path, gap in gaps.items() if path not in following}


def _gauge_text(value: float, atmosphere: float) -> str:
    """A gauge pressure as a file may write it: the shortest one that gives the same number."""
    for unit in _GAUGES:
        for digits in range(1, 17):
            number = float(f"{from_si(value, unit, _LEVEL, atmosphere):.{digits}g}")
            if to_si(number, unit, _LEVEL, atmosphere) == value:
                return f"{number!r} {unit}"
    return ""


def _scales(shown: Iterable[tuple[str, str]]) -> dict[str, list[dict[str, Any]]]:
    """How each unit that somebody may type becomes one in SI: in decimals, as ``ppafo.units`` reckons."""
    wanted: dict[str, dict[str, None]] = {}
    for si, unit in sorted(shown):
        wanted.setdefault(si, {}).update(dict.fromkeys((unit, *_UNITS.get(si, ()), si)))
    return {si: [_scale(unit, si) for unit in units if _fits(unit, si)] for si, units in wanted.items()}


def _scale(unit: str, si: str) -> dict[str, Any]:
    scale, offset, is_gauge = conversion(_typed(unit, si), si)
    return {"unit": unit, "scale": str(scale), "offset": str(offset), "isGauge": is_gauge}


def _typed(unit: str, si: str) -> str:
    """The unit as it is typed; differences of pressure are shown without their ending."""
    return f"{unit}_d" if si == _DIFFERENCE and not unit.endswith("_d") else unit


def _fits(unit: str, si: str) -> bool:
    try:
        conversion(_typed(unit, si), si)
    except UnitError:
        return False
    return True
