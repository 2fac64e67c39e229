"""A workbench of scenarios and walks: which of them share a tab, what they are called there, what the page gets."""

import json
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Protocol, final

from ppafo.arguments import Overrides, checked
from ppafo.errors import PpafoError, ScenarioError, UnitError
from ppafo.loading import load_scenario
from ppafo.page.html import block_of, packed_once, page_of
from ppafo.page.opening import computed_opening, first_settings, opening_like, opening_of
from ppafo.page.still import still_of
from ppafo.page.wasm import WasmModule, module_of
from ppafo.page.words import words
from ppafo.parameters.graph import ATMOSPHERE_PATH
from ppafo.parameters.overrides import over, read_overrides
from ppafo.plugins import Plugins, name_plugins
from ppafo.report.finding import LivePart
from ppafo.report.setting_names import label_of
from ppafo.report.style import PAGE_LOOKS
from ppafo.simulation.declaration import OF_A_VANE, PRESSURE_WORDS, Declared
from ppafo.simulation.motion_kind import VANE, WALK
from ppafo.simulation.overrides import apply_overrides, is_of_device
from ppafo.simulation.scenario import Scenario, vane_motion
from ppafo.units import conversion, from_si, parse_quantity, to_si
from ppafo.units.shown import shown_in
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
_ABSOLUTE = ("largest_pressure",)
"""Metrics whose name says that a pressure is absolute."""
_NICE = (1.0, 2.0, 2.5, 5.0, 10.0)


_FIRST_STRIDE = "controller.first_stride_time"
_WALKED = 6
"""Length [s] of a walk in a page, unless somebody wants more: five strides."""


class _ShownMotion(Protocol):
    """What a page shows and asks of the scenarios of one layout."""

    claims: ClassVar[str]
    """Which claims of ``words.toml`` a page makes of it."""

    def declared(self) -> Declared:
        """Return what its file can hold."""

    def look(self, scenario: Scenario, /) -> int:
        """Return the number of its colour."""

    def tab(self, scenario: Scenario, /) -> str:
        """Return the title of the tab that it shares."""

    def usual_changes(self, scenario: Scenario, /) -> dict[str, str]:
        """Return the changes with which it begins, texts by key."""

    def with_limits(self, entry: Mapping[str, Any], scenario: Scenario, /) -> dict[str, Any]:
        """Return a setting with the limits that its file has and its program has not."""

    def relations(self, keys: Collection[str], /) -> list[dict[str, Any]]:
        """Return contradictions of settings that its file refuses and its program does not."""


@final
class _VaneAlone:
    claims: ClassVar[str] = "claims"

    def declared(self) -> Declared:
        return OF_A_VANE

    def look(self, scenario: Scenario) -> int:
        return PAGE_LOOKS.get(scenario.device.valve.kind, 0)

    def tab(self, scenario: Scenario) -> str:
        motion = vane_motion(scenario)
        if motion.profile is None:
            return "Step response" if scenario.controller.is_open_loop else "Unconstrained vane"
        return "Moving ankle" if motion.locked_angle is None else "Torque task"

    def usual_changes(self, _scenario: Scenario) -> dict[str, str]:
        return {}

    def with_limits(self, entry: Mapping[str, Any], _scenario: Scenario) -> dict[str, Any]:
        return dict(entry)

    def relations(self, _keys: Collection[str]) -> list[dict[str, Any]]:
        return []


@final
class _Walk:
    claims: ClassVar[str] = "claims_of_walks"

    def declared(self) -> Declared:
        from ppafo.walking.declaration import OF_A_WALK

        return OF_A_WALK

    def look(self, _scenario: Scenario) -> int:
        # With and without the device, a walk takes colours in their order, as its figures do.
        return 0

    def tab(self, _scenario: Scenario) -> str:
        return "Walk"

    def usual_changes(self, scenario: Scenario) -> dict[str, str]:
        from ppafo.walking.motion import SHORTEST_STRIDES

        # A walk is short here.
        return {"run.duration": f"{max(_WALKED, math.ceil(SHORTEST_STRIDES * scenario.motion.stride_time))} s"}

    def with_limits(self, entry: Mapping[str, Any], scenario: Scenario) -> dict[str, Any]:
        from ppafo.walking.motion import LONGEST_MINUTES, SHORTEST_STRIDES

        stride = scenario.motion.stride_time
        if entry["key"] == _FIRST_STRIDE:
            return {**entry, "minimum": 0.5 * stride, "maximum": 2.0 * stride}
        if entry["key"] == "run.duration":
            limits = {"minimum": SHORTEST_STRIDES * stride, "maximum": 60.0 * LONGEST_MINUTES}
            return {**entry, **limits, "is_minimum_allowed": True}
        return dict(entry)

    def relations(self, keys: Collection[str]) -> list[dict[str, Any]]:
        from ppafo.walking.contradictions import COMPRESSION

        above = (
            ("controller.highest_pressure", "supply.pressure", COMPRESSION),
            ("controller.highest_pressure", "supply.dorsiflexion_pressure", COMPRESSION),
            ("controller.frozen_time", "controller.period", 2.0),
            ("controller.fill_time", "valve.delay", 1.0),
            ("controller.vent_time", "valve.delay", 1.0),
        )
        return [
            {"key": key, "relation": "above", "other": other, "factor": factor, "slack": 0.0}
            for key, other, factor in above
            if {key, other} <= set(keys)
        ]


_SHOWN: Mapping[str, _ShownMotion] = {VANE: _VaneAlone(), WALK: _Walk()}


def _motion(scenario: Scenario) -> _ShownMotion:
    """Return what a page shows and asks of a scenario."""
    return _SHOWN[scenario.motion.motion_kind.layout]


@dataclass(frozen=True, slots=True)
class Simulated:
    """A scenario or walk and the module that simulates it; ``label`` distinguishes it from others of its tab."""

    scenario: Scenario
    module: WasmModule
    label: str


def program_content(simulated: Simulated, module: str, intervals: Mapping[str, Interval]) -> dict[str, Any]:
    """Return what the page knows of a scenario; ``module`` is the element that holds its program."""
    described = simulated.module.description
    gauge, keys = (
        _gauge_texts(simulated.scenario, described["settings"]),
        {setting["key"] for setting in described["settings"]},
    )
    # The file of a scenario or walk with the overrides in it; overrides of the device stay overrides.
    shown = _motion(simulated.scenario)
    overridden = read_overrides(described["overrides"], ScenarioError)
    changed = apply_overrides(described["document"], overridden, described["name"], shown.declared())
    document, own = changed.document, changed.device
    of_file = document.get("device", {}).get("overrides", ())
    overrides = list(over(of_file, map(str, own), valve=simulated.scenario.device.valve_name))
    document["device"] = {**document.get("device", {}), **({"overrides": overrides} if overrides else {})}
    return {
        "name": described["name"],
        "kind": described["kind"],
        "label": simulated.label,
        "look": shown.look(simulated.scenario),
        "description": " ".join(described["title"].split()),
        "document": document,
        "usual": shown.usual_changes(simulated.scenario),
        "deviceSections": sorted(
            {entry["key"].partition(".")[0] for entry in described["settings"] if is_of_device(entry["key"])}
        ),
        "settings": [
            _setting(_as_in_files(entry, simulated.scenario), gauge, intervals) for entry in described["settings"]
        ],
        "relations": [
            {
                "key": relation["key"],
                "relation": relation["relation"],
                "other": relation["other"],
                "factor": 1.0 + relation["tolerance"] * relation["is_share"],
                "slack": 0.0 if relation["is_share"] else relation["tolerance"],
            }
            for relation in described["relations"]
        ]
        + shown.relations(keys),
        "channels": [_shown(entry) for entry in described["channels"] if entry["name"] != "time"],
        "metrics": [_shown(entry) for entry in described["metrics"]],
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
"""The settings of which the torques are made that the supplies sustain."""


def usual_values(scenario: Scenario) -> dict[str, float]:
    """Return the changes with which a scenario begins as numbers in SI by key: all of them are times."""
    return {key: parse_quantity(text, "s") for key, text in _motion(scenario).usual_changes(scenario).items()}


def _as_in_files(entry: Mapping[str, Any], scenario: Scenario) -> dict[str, Any]:
    """A setting with what only Python knows of it: its limits in a file, and which pressures are absolute."""
    display = entry["display"]
    if entry["group"] == "controller" and display["unit"].endswith("_g"):
        return {**entry, "display": {**display, "unit": f"{display['unit'][:-2]}_a", "zero": 0.0}}
    return _motion(scenario).with_limits(entry, scenario)


def page_content(
    title: str, form: str, tabs: Sequence[Mapping[str, Any]], programs: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    """Return all that a page is made of, but its modules."""
    shown = {
        (entry["unit"], entry["shown"])
        for program in programs
        for kind in ("settings", "channels", "metrics")
        for entry in program[kind]
    }
    recorded = {("s", "s"), ("N m", "N m"), (_LEVEL, "psi_g"), ("rad", "deg"), ("", ""), ("kg", "g")}
    return {
        "version": __version__,
        "title": title,
        "form": form,
        "tabs": list(tabs),
        "bottle": json.loads(files("ppafo.page").joinpath("minutes.json").read_text(encoding="utf-8")),
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
    return {
        "key": key,
        "label": label_of(key),
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
    slider = words()["sliders"].get(entry["key"])
    if slider is not None:
        begin, end = float(slider[0]), float(slider[1])
    else:
        end = _nice(2.5 * abs(value)) if value else (high if high is not None and high <= 1.0 else 1.0)
        begin = -end if value < 0.0 else 0.0
    # A slider to a bound that is not allowed ends a hundredth of its way before it.
    is_small = low is not None and (not entry["is_minimum_allowed"] or 0.0 < low < end / 100.0)
    if entry["kept"] == "above zero" or (low is not None and low >= begin and is_small):
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
    text, shown = entry["description"], entry["display"]["unit"]
    return {
        "name": entry["name"],
        "unit": unit,
        "shown": f"{shown[:-2]}_a" if entry["name"] in _ABSOLUTE else _bare(shown),
        "label": text[:1].upper() + text[1:],
    }


def _gauge_texts(scenario: Scenario, settings: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """Texts of the pressures that count from the atmosphere: they move with it, as they do in Python."""
    following = {entry["key"] for entry in settings if entry["follows"]}
    gaps = {
        path: link.gap for path, links in scenario.graph.items() for link in links if link.sources == (ATMOSPHERE_PATH,)
    }
    texts = {}
    for path, gap in gaps.items():
        if path in following:
            continue
        # As a file may write it: the shortest text that gives the same number.
        written = (
            f"{number!r} {unit}"
            for unit in _GAUGES
            for digits in range(1, 17)
            if to_si(number := float(f"{from_si(gap, unit, _LEVEL, 0.0):.{digits}g}"), unit, _LEVEL, 0.0) == gap
        )
        texts[path] = next(written, "")
    return texts


def _scales(shown: Iterable[tuple[str, str]]) -> dict[str, list[dict[str, Any]]]:
    """How each unit that somebody may type becomes one in SI: in decimals, as ``ppafo.units`` reckons."""
    wanted: dict[str, dict[str, None]] = {}
    for si, unit in sorted(shown):
        wanted.setdefault(si, {}).update(dict.fromkeys((unit, *_UNITS.get(si, ()), si)))
    scales: dict[str, list[dict[str, Any]]] = {}
    for si, units in wanted.items():
        scales[si] = []
        for unit in units:
            try:
                scale, offset, is_gauge = conversion(_typed(unit, si), si)
            except UnitError:
                # A unit that is shown and cannot be typed for this quantity.
                continue
            scales[si].append({"unit": unit, "scale": str(scale), "offset": str(offset), "isGauge": is_gauge})
    return scales


def _typed(unit: str, si: str) -> str:
    """The unit as it is typed; differences of pressure are shown without their ending."""
    return f"{unit}_d" if si == _DIFFERENCE and not unit.endswith("_d") else unit


TITLE = "The powered ankle-foot orthosis, live"
DEFAULT = ("torque-task-solenoid", "torque-task-proportional", "step-response", "solenoid")
MOST_SCENARIOS = 24
_OPEN = 2
"""Configurations that a tab opens with."""
_LABELS = {
    "torque-task-solenoid": "Solenoid pair",
    "torque-task-proportional": "Proportional valve",
    "torque-task-slow-valve": "Slow valve",
    "torque-task-anti-windup": "Anti-windup",
    "torque-task-moving-ankle": "Moving ankle",
    "step-response": "Step response",
    "solenoid": "Solenoid pair",
    "proportional": "Proportional valve",
    "off": "Without help",
}


@checked("scenarios", "overrides")
def workbench(scenarios: Sequence[str | Path] = DEFAULT, *, overrides: Overrides = (), plugins: Plugins = ()) -> bytes:
    """Return a page, one file of HTML, in which scenarios are simulated again while their numbers are changed.

    ``scenarios`` are names or files of scenarios and walks; those with the same kind of motion share a tab.
    ``overrides`` change all of them. Each tab opens with its first two scenarios.
    ScenarioError for none, too many or two of one name; ProgramError where a program has to be built and cannot be.

    ``plugins`` are modules of your own whose objects files may name, as of ``simulate``.

    >>> import ppafo
    >>> ppafo.workbench("torque-task-proportional")[:15]
    b'<!DOCTYPE html>'
    """
    name_plugins(plugins)
    content = _content([str(scenario) for scenario in scenarios], tuple(overrides), "page")
    return page_of(TITLE, content.document, content.modules, content.still)


def live_part(scenarios: "Sequence[str | Scenario]") -> LivePart | None:
    """Return a part of a page with the controls that matter most; None where one of the programs cannot be had.

    Of scenarios with one name only the first is in it.
    """
    # Backwards, so that of two with one name the first stays.
    named = {
        named_scenario if isinstance(named_scenario, str) else named_scenario.name: named_scenario
        for named_scenario in reversed(scenarios)
    }
    try:
        content = _content(list(reversed(named.values())), (), "block")
    except PpafoError:
        return None
    remark = ""
    for named_scenario in named.values():
        shorter = usual_values(named_scenario).get("run.duration") if isinstance(named_scenario, Scenario) else None
        if isinstance(named_scenario, Scenario) and shorter is not None and shorter < named_scenario.run.duration:
            part = f"{shorter:g} s of the {named_scenario.run.duration:g} s above"
            remark = max(remark, f"It begins with {part}: lengthen run.duration to compare the numbers.")
    html, policy = block_of(content.document, content.modules)
    return LivePart(policy, html, remark)


class _PageContent(NamedTuple):
    """What a page simulates and shows, its packed modules by name, and the picture of its first tab."""

    document: dict[str, Any]
    modules: dict[str, str]
    still: str


def _content(scenarios: "Sequence[str | Scenario]", overrides: Sequence[str], form: str) -> _PageContent:
    """Content of a ``"page"`` or of a ``"block"`` of one; programs that are the same share one module."""
    simulated = _simulated(scenarios, overrides)
    intervals = known_intervals()
    names: dict[str, str] = {}
    programs = []
    for program in simulated:
        name = names.setdefault(packed_once(program.module.wasm), f"module-{len(names) + 1}")
        with shown_in(program.scenario.device.shown):
            programs.append(program_content(program, name, intervals))
    content = page_content(TITLE, form, _tabs(simulated), programs)
    by_name = {program.scenario.name: program for program in simulated}
    described = {program["name"]: program for program in programs}
    stills = []
    for tab in content["tabs"]:
        started = [by_name[entry["program"]] for entry in tab["start"]]
        shown = [described[entry["program"]] for entry in tab["start"]]
        openings = [_opening(program, form, tab["claims"]) for program in started]
        tab["first"] = first_settings(openings, shown)
        # A question is asked where one of the programs has all the settings that it changes.
        settings = [{entry["key"] for entry in program["settings"] if entry["kept"] != "zero"} for program in shown]
        tab["questions"] = [
            question for question in tab["questions"] if any(set(question["changes"]) <= keys for keys in settings)
        ]
        with shown_in(started[0].scenario.device.shown):
            stills.append(still_of(tab, openings, shown))
    return _PageContent(content, {name: text for text, name in names.items()}, stills[0])


def _simulated(scenarios: "Sequence[str | Scenario]", overrides: Sequence[str]) -> list[Simulated]:
    """The scenarios with their programs and labels; ScenarioError for none, too many, or two of one name."""
    if not 1 <= len(scenarios) <= MOST_SCENARIOS:
        raise ScenarioError(f"a workbench has 1 to {MOST_SCENARIOS} scenarios, not {len(scenarios)}")
    loaded = [load_scenario(scenario, overrides) if isinstance(scenario, str) else scenario for scenario in scenarios]
    names = [scenario.name for scenario in loaded]
    repeated = next((name for place, name in enumerate(names) if name in names[:place]), None)
    if repeated is not None:
        raise ScenarioError(f"two scenarios are called '{repeated}'; a workbench distinguishes them by name")
    simulated = []
    for scenario in loaded:
        spoken = scenario.name.replace("-", " ").replace("_", " ")
        label = _LABELS.get(scenario.name, spoken[:1].upper() + spoken[1:])
        simulated.append(Simulated(scenario, module_of(scenario), label))
    return simulated


def _opening(simulated: Simulated, form: str, claims: Sequence[str]) -> dict[str, Any]:
    """What a program shows as it opens, with the metrics called claims; a block opens as the shipped scenario does."""
    if form == "block":
        return opening_like(simulated.module)
    return opening_of(simulated.scenario, simulated.module, usual_values(simulated.scenario), claims)


def openings_of(names: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Return what ``opening_of`` finds of shipped scenarios and walks as a page opens with them, computed anew."""
    openings = {}
    for name in names:
        simulated = Simulated(load_scenario(name), module_of(load_scenario(name)), name)
        content = page_content(TITLE, "page", _tabs([simulated]), [program_content(simulated, "", {})])
        claims = content["tabs"][0]["claims"]
        openings[name] = computed_opening(
            simulated.scenario, simulated.module, usual_values(simulated.scenario), claims
        )
    return openings


@cache
def known_intervals() -> Mapping[str, Interval]:
    """Return 95 % intervals in SI, by key, of numbers of which the set does not say how well they are known.

    They come from a study, which takes long to read: ``scripts/known_intervals.py`` writes the file.
    """
    described = json.loads(files("ppafo.page").joinpath("intervals.json").read_text(encoding="utf-8"))
    return {path: (low, high) for path, (low, high) in described.items()}


def _tabs(simulated: Sequence[Simulated]) -> list[dict[str, Any]]:
    groups: dict[str, list[Simulated]] = {}
    for program in simulated:
        groups.setdefault(_motion(program.scenario).tab(program.scenario), []).append(program)
    tabs = []
    for title, group in groups.items():
        alone = " ".join(group[0].scenario.description.split()).replace("psi_g", "psi") if len(group) == 1 else ""
        starts = [program.scenario for program in group[:_OPEN]]
        asked = [question for question in words()["questions"] if title in question["tabs"]]
        tabs.append(
            {
                "title": title,
                "summary": alone or _SUMMARIES.get(title, ""),
                "programs": [program.scenario.name for program in group],
                "start": [
                    {"program": scenario.name, "changes": _motion(scenario).usual_changes(scenario)}
                    for scenario in starts
                ],
                "claims": words()[_motion(starts[0]).claims],
                "questions": [{"text": question["text"], "changes": question["changes"]} for question in asked],
            }
        )
    return tabs


_SUMMARIES = {
    "Torque task": "The foot stays flat on the ground while the actuator follows a torque that ramps up and stays.",
    "Walk": "A leg that walks with the device; the dashed line is what a healthy ankle would do.",
}
