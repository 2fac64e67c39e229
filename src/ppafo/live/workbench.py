"""A workbench of scenarios and walks: which of them share a tab, what they are called there, and the page of them."""

import json
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib.resources import files
from typing import Any

from ppafo.answers import LivePart
from ppafo.errors import PpafoError, ScenarioError
from ppafo.exports.wasm import module_of
from ppafo.live.content import Interval, Simulated, page_content, program_content, usual_changes, words
from ppafo.live.page import block_of, check_start, packed_once, page_of, policy_of_block
from ppafo.loading import load_scenario
from ppafo.simulation.scenario import FreeMotion, Scenario, vane_motion, worn_kind

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
_WALK = "Walk"
_TASKS = {"held": "Torque task", "prescribed": "Moving ankle", "free": "Free vane"}
_STEP = "Step response"


def workbench(
    scenarios: Iterable[str] = DEFAULT,
    overrides: Sequence[str] = (),
    title: str = TITLE,
    start: Sequence[Mapping[str, Any]] = (),
    summary: str = "",
) -> bytes:
    """Return a page, one file of HTML, in which scenarios are simulated again while their numbers are changed.

    ``scenarios`` are names or files of scenarios and walks; those with the same kind of motion share a tab.
    ``overrides`` change all of them.
    ``start`` are the configurations that the page opens with, at most four for a tab: a ``program`` (the name of a
    scenario) and ``changes``, texts by key. Without it each tab opens with its first two scenarios. ``summary`` is
    what a page of one tab says of it.
    ScenarioError for none, too many, two of one name, or a start that the page does not have; ProgramError where a
    program has to be built and cannot be.
    """
    content, modules = _content(list(scenarios), overrides, title, "page")
    check_start(start, content)
    for tab in content["tabs"]:
        own = [dict(item) for item in start if item["program"] in tab["programs"]]
        tab["start"] = own or tab["start"]
        tab["summary"] = summary if summary and len(content["tabs"]) == 1 else tab["summary"]
    return page_of(title, content, modules)


def live_part(scenarios: "Sequence[str | Scenario]") -> LivePart | None:
    """Return a part of a page with the controls that matter most; None where one of the programs cannot be had.

    Of scenarios with one name only the first is in it.
    """
    named = {item if isinstance(item, str) else item.name: item for item in reversed(scenarios)}
    try:
        content, modules = _content(list(reversed(named.values())), (), TITLE, "block")
    except PpafoError:
        return None
    return LivePart(policy_of_block(), block_of(content, modules))


def _content(
    scenarios: "Sequence[str | Scenario]", overrides: Sequence[str], title: str, form: str
) -> tuple[dict[str, Any], dict[str, str]]:
    """Content of a page, and its modules by name; programs that are the same are there once."""
    simulated = _simulated(scenarios, overrides)
    intervals = known_intervals()
    names: dict[str, str] = {}
    programs = []
    for item in simulated:
        name = names.setdefault(packed_once(item.module.wasm), f"module-{len(names) + 1}")
        programs.append(program_content(item, name, intervals))
    content = page_content(title, form, _tabs(simulated), programs)
    return content, {name: text for text, name in names.items()}


@cache
def known_intervals() -> Mapping[str, Interval]:
    """Return 95 % intervals in SI, by key, of numbers of which the set does not say how well they are known.

    They are those of a study, which takes long to read: ``scripts/known_intervals.py`` writes the file.
    """
    told = json.loads(files("ppafo.live").joinpath("intervals.json").read_text(encoding="utf-8"))
    return {path: (low, high) for path, (low, high) in told.items()}


def _simulated(given: "Sequence[str | Scenario]", overrides: Sequence[str]) -> list[Simulated]:
    if not 1 <= len(given) <= MOST_SCENARIOS:
        raise ScenarioError(f"a workbench has 1 to {MOST_SCENARIOS} scenarios, not {len(given)}")
    loaded = [load_scenario(item, overrides) if isinstance(item, str) else item for item in given]
    found: dict[str, Scenario] = {}
    for scenario in loaded:
        if scenario.name in found:
            raise ScenarioError(f"two scenarios are called '{scenario.name}'; a workbench distinguishes them by name")
        found[scenario.name] = scenario
    return [Simulated(scenario, module_of(scenario), _label(scenario)) for scenario in loaded]


def _label(scenario: Scenario) -> str:
    words_of_name = scenario.name.replace("-", " ").replace("_", " ")
    return _LABELS.get(scenario.name, words_of_name[:1].upper() + words_of_name[1:])


def _tabs(simulated: Sequence[Simulated]) -> list[dict[str, Any]]:
    groups: dict[str, list[Simulated]] = {}
    for item in simulated:
        groups.setdefault(_task(item.scenario), []).append(item)
    return [_tab(title, group) for title, group in groups.items()]


def _task(scenario: Scenario) -> str:
    if worn_kind(scenario) is not None:
        return _WALK
    motion = vane_motion(scenario)
    if isinstance(motion, FreeMotion):
        return _STEP if scenario.control.kind == "constant" else _TASKS["free"]
    return _TASKS["held" if motion.profile.kind == "constant" else "prescribed"]


def _tab(title: str, group: Sequence[Simulated]) -> dict[str, Any]:
    alone = " ".join(group[0].scenario.description.split()).replace("psi_g", "psi") if len(group) == 1 else ""
    return {
        "title": title,
        "summary": alone or _SUMMARIES.get(title, ""),
        "programs": [item.scenario.name for item in group],
        "start": [{"program": item.scenario.name, "changes": usual_changes(item.scenario)} for item in group[:_OPEN]],
        "first": words()["first_of_walks" if title == _WALK else "first"],
        "claims": words()["claims_of_walks" if title == _WALK else "claims"],
    }


_SUMMARIES = {
    "Torque task": "The foot stays flat on the ground while the actuator follows a torque that ramps up and is held.",
    "Walk": "A leg that walks with the device; the dashed line is what a healthy ankle would do.",
}


def gallery() -> dict[str, bytes]:
    """Return the pages of the gallery by file name, in the order in which they are declared."""
    return {f"{name}.html": _page(entry) for name, entry in declared_workbenches().items()}


def declared_workbenches() -> dict[str, Mapping[str, Any]]:
    """Return title, summary, scenarios and start of each workbench by name."""
    return tomllib.loads(files("ppafo.live").joinpath("gallery.toml").read_text(encoding="utf-8"))


def _page(entry: Mapping[str, Any]) -> bytes:
    return workbench(
        entry["scenarios"], entry.get("overrides", ()), entry["title"], entry.get("start", ()), entry["summary"]
    )
