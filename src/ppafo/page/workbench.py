"""Workbench page: scenarios and walks in tabs, with labels and content."""

import contextlib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ppafo.arguments import Overrides, checked
from ppafo.errors import PpafoError, ScenarioError, UnitError
from ppafo.loading import load_scenario
from ppafo.page.content import PageSimulation, page_content, program_content, usual_values
from ppafo.page.html import block_of, packed_once, page_of
from ppafo.page.motions import is_walk, tab_title, usual_changes
from ppafo.page.opening import computed_opening, first_settings, opening_like, opening_of
from ppafo.page.setting import Interval
from ppafo.page.still import still_of
from ppafo.page.wasm import module_of
from ppafo.page.words import stored_data, words
from ppafo.parameters.joint import ANKLE, JointNames
from ppafo.plugins import Plugins, name_plugins
from ppafo.report.finding import LivePart
from ppafo.simulation.scenario import Scenario
from ppafo.units import from_si, parse_quantity, split_pressure_kind
from ppafo.units.shown import shown_in, shown_unit

TITLE = "The powered ankle-foot orthosis, live"
"""Title of a page of ankle devices."""
DEFAULT = ("torque-task-solenoid", "torque-task-proportional", "step-response", "solenoid")
MOST_SCENARIOS = 24
_OPEN = 2
"""Number of configurations displayed initially in a tab."""
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


@checked
def workbench(scenarios: Sequence[str | Path] = DEFAULT, *, overrides: Overrides = (), plugins: Plugins = ()) -> bytes:
    """Create an interactive HTML page that simulates scenarios again as their numbers change.

    Scenarios with the same kind of motion share a tab. The first two scenarios of a tab are displayed initially.

    Arguments:
        scenarios: names or files of scenarios and walks
        overrides: changes of all scenarios, as texts or a dictionary
        plugins: modules of your own, files or names, whose objects files may name

    Returns:
        the page, in UTF-8

    Raises:
        ScenarioError: no scenario, too many, or two of one name
        ProgramError: a program that the page needs and that cannot be built here

    >>> import ppafo
    >>> ppafo.workbench("torque-task-proportional")[:15]
    b'<!DOCTYPE html>'
    """
    name_plugins(plugins)
    content, modules, still = _content([str(scenario) for scenario in scenarios], tuple(overrides), "page")
    return page_of(content["title"], content, modules, still)


def live_part(scenarios: "Sequence[str | Scenario]") -> LivePart | None:
    """Return a page section with the most important controls; None if a program cannot be built.

    Of several scenarios with the same name only the first is included.
    """
    # Backwards, so that of two with one name the first stays.
    named = {
        named_scenario if isinstance(named_scenario, str) else named_scenario.name: named_scenario
        for named_scenario in reversed(scenarios)
    }
    try:
        content, modules, _ = _content(list(reversed(named.values())), (), "block")
    except PpafoError:
        return None
    remark = ""
    for named_scenario in named.values():
        shorter = usual_values(named_scenario).get("run.duration") if isinstance(named_scenario, Scenario) else None
        if isinstance(named_scenario, Scenario) and shorter is not None and shorter < named_scenario.run.duration:
            part = f"{shorter:g} s of the {named_scenario.run.duration:g} s above"
            remark = max(remark, f"The workbench begins with {part}: increase run.duration to compare the numbers.")
    html, policy = block_of(content, modules)
    return LivePart(policy, html, remark)


def _content(
    scenarios: "Sequence[str | Scenario]", overrides: Sequence[str], form: str
) -> tuple[dict[str, Any], dict[str, str], str]:
    """Return page or block content, packed modules by name, and the picture of the first tab.

    Identical programs share one module. Raises ScenarioError for no scenario, too many, or two of one name.
    """
    if not 1 <= len(scenarios) <= MOST_SCENARIOS:
        raise ScenarioError(f"a workbench has 1 to {MOST_SCENARIOS} scenarios, not {len(scenarios)}")
    loaded = [load_scenario(scenario, overrides) if isinstance(scenario, str) else scenario for scenario in scenarios]
    repeated = [name for name, count in Counter(scenario.name for scenario in loaded).items() if count > 1]
    if repeated:
        raise ScenarioError(f"two scenarios are named '{repeated[0]}'; a workbench needs different names")
    simulated = []
    for scenario in loaded:
        with shown_in(scenario.device.shown):
            module = module_of(scenario)
        # A name of one's own stays as it is.
        known = scenario.name in _LABELS
        label = scenario.device.joint.said(_LABELS[scenario.name]) if known else scenario.name
        simulated.append(PageSimulation(scenario, module, label))
    intervals = known_intervals()
    names: dict[str, str] = {}
    programs = []
    for program in simulated:
        name = names.setdefault(packed_once(program.module.wasm), f"module-{len(names) + 1}")
        with shown_in(program.scenario.device.shown):
            programs.append(program_content(program, name, intervals))
    joints = {program.scenario.device.joint.name for program in simulated}
    joint = joints.pop() if len(joints) == 1 else ""
    title = (
        TITLE if joint == ANKLE.name else f"The powered {joint} orthosis, live" if joint else "Powered orthoses, live"
    )
    content = page_content(title, form, _tabs(simulated), programs, joint or "joint")
    by_name = {program.scenario.name: program for program in simulated}
    described = {program["name"]: program for program in programs}
    stills = []
    for tab in content["tabs"]:
        started = [by_name[entry["program"]] for entry in tab["start"]]
        shown = [described[entry["program"]] for entry in tab["start"]]
        # A report computes nothing: a block opens like the shipped scenario.
        openings = [
            opening_like(program.module)
            if form == "block"
            else opening_of(program.scenario, program.module, usual_values(program.scenario), tab["claims"])
            for program in started
        ]
        tab["first"] = first_settings(openings, shown)
        # A question is asked where one of the programs has all the settings that it changes, in their units.
        units = [
            {entry["key"]: entry["unit"] for entry in program["settings"] if entry["kept"] != "zero"}
            for program in shown
        ]
        tab["questions"] = [
            question
            for question in tab["questions"]
            if any(_fits(question["changes"], units_of_program) for units_of_program in units)
        ]
        with shown_in(started[0].scenario.device.shown):
            stills.append(still_of(tab, openings, shown, joint))
    return content, {name: text for text, name in names.items()}, stills[0]


def openings_of(names: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Compute the initial states of bundled scenarios and walks on a page, by name."""
    openings = {}
    for name in names:
        simulated = PageSimulation(load_scenario(name), module_of(load_scenario(name)), name)
        content = page_content(TITLE, "page", _tabs([simulated]), [program_content(simulated, "", {})])
        claims = content["tabs"][0]["claims"]
        openings[name] = computed_opening(
            simulated.scenario, simulated.module, usual_values(simulated.scenario), claims
        )
    return openings


def known_intervals() -> Mapping[str, Interval]:
    """Return 95 % intervals [SI] by key, for numbers without a stated uncertainty in the set.

    ``scripts/known_intervals.py`` writes them to a file, because the underlying study takes long to read.
    """
    return {path: (low, high) for path, (low, high) in stored_data("intervals.json").items()}


def _fits(changes: Mapping[str, str], units: Mapping[str, str]) -> bool:
    """Return whether all changed settings are among ``units`` [SI], with fitting units."""
    with contextlib.suppress(KeyError, UnitError):
        for key, text in changes.items():
            parse_quantity(text, units[key] or "1")
        return True
    return False


def _question(question: Mapping[str, Any], atmosphere: float) -> dict[str, Any]:
    """Return text and changes of a question, with the supply pressure in its display unit."""
    text, changes = question["text"], dict(question["changes"])
    key, unit = "supply.pressure", shown_unit("Pa_a")
    bare, kind = split_pressure_kind(unit)
    if key in changes:
        # Rounded: a supply of 65 psi is one of 4.5 bar.
        level = from_si(parse_quantity(changes[key], "Pa_a", atmosphere), unit, "Pa_a", atmosphere)
        level = float(f"{level:.2g}")
        changes[key] = f"{level:.15g} {unit}"
        text = text.replace(f"{{{key}}}", f"{level:.15g} {bare}{' abs' if kind == 'a' else ''}")
    return {"text": text, "changes": changes}


def _tabs(simulated: Sequence[PageSimulation]) -> list[dict[str, Any]]:
    groups: dict[tuple[str, JointNames], list[PageSimulation]] = {}
    for program in simulated:
        groups.setdefault((tab_title(program.scenario), program.scenario.device.joint), []).append(program)
    tabs = []
    for (title, _), group in groups.items():
        alone = " ".join(group[0].scenario.description.split()).replace("psi_g", "psi") if len(group) == 1 else ""
        starts = [program.scenario for program in group[:_OPEN]]
        device = group[0].scenario.device
        atmosphere = device.supply.atmospheric_pressure
        # No supply far above the device's own: another device has its limits elsewhere, for example a measured one.
        highest = 2.0 * device.supply.pressure - atmosphere
        with shown_in(device.shown):
            questions = [
                _question(question, atmosphere)
                for question in words()["questions"]
                if title in question["tabs"]
                and parse_quantity(question["changes"].get("supply.pressure", "0 Pa_a"), "Pa_a", atmosphere) < highest
            ]
        tabs.append(
            {
                "title": device.joint.said(title),
                "summary": alone or _SUMMARIES.get(title, ""),
                "programs": [program.scenario.name for program in group],
                "start": [{"program": scenario.name, "changes": usual_changes(scenario)} for scenario in starts],
                "claims": words()["claims_of_walks" if is_walk(starts[0]) else "claims"],
                "questions": questions,
            }
        )
    return tabs


_SUMMARIES = {
    "Torque task": "The foot stays flat on the ground while the actuator follows a torque that ramps up and stays.",
    "Walk": "A leg that walks with the device; the dashed line is what a healthy ankle would do.",
}
