"""Designs of a front as text and as data."""

from collections.abc import Iterable
from typing import Any

import ppafo
from ppafo.parameters.parts import Part
from ppafo.reporting.shown_values import aligned_rows, shown_value
from ppafo.studies.design import Design, DesignPoint, DesignProblem
from ppafo.studies.design.search import PATIENCE

SUGGESTED = "*"
_OBJECTIVES = ("error", "gas per task", "mass")


def design_table(design: Design) -> list[str]:
    """Return the table of designs with a sentence on the suggestion, the search and the doubts, line by line."""
    head = ("", "valve", "actuator", *_OBJECTIVES, *(short_path(path) for path in variable_paths(design)))
    rows = [head, *(_cells(design, place) for place in design.shown)]
    return [
        *aligned_rows(rows, left=3),
        "",
        f"{SUGGESTED} suggested: {design.reason}.",
        search_sentence(design),
        *failure_lines(design),
        *doubt_groups(design.doubtful),
    ]


def variable_paths(design: Design) -> list[str]:
    """Return the paths of the numbers that were chosen."""
    return [item.path for item in design.problem.variables]


def short_path(path: str) -> str:
    """Return a path as the head of a column: without its section."""
    return path.partition(".")[2].replace("_", " ")


def objective_cells(point: DesignPoint) -> tuple[str, str, str]:
    """Return error, gas and mass as text."""
    return shown_value(point.error, "N m"), shown_value(point.gas, "kg"), shown_value(point.mass, "kg")


def number_cells(problem: DesignProblem, point: DesignPoint) -> list[str]:
    """Return the chosen numbers as text, a dash where one means nothing for the valve."""
    return [
        shown_value(point.numbers[item.path], item.unit) if item.path in point.numbers else "-"
        for item in problem.variables
    ]


def search_sentence(design: Design) -> str:
    """Return how the search went, in a sentence or two."""
    volume = design.growth[-1][1]
    tolerance = 100.0 * design.problem.search.tolerance
    ending = (
        f"this share grew by less than {tolerance:.2g} % over the last {PATIENCE} generations"
        if design.settled
        else "this share was still growing when the generations were used up"
    )
    return (
        f"{len(design.front)} designs of {design.designs} tried ({design.runs} runs, {design.seconds:.0f} s) "
        f"are beaten by no other; they cover {volume:.4f} of the box of the first look, and {ending}."
    )


def failure_lines(design: Design) -> list[str]:
    """Return how many runs failed and the first reason, nothing where none did."""
    if not design.failed:
        return []
    reason, task = next(iter(design.failures.items()))
    return [f"{design.failed} of {design.runs} runs failed and count as no design; the first ({task}): {reason}"]


def doubt_groups(doubtful: Iterable[tuple[Part, str]]) -> list[str]:
    """Return figures that are not from a document at hand, a line a part; 'ppafo parts PART' has the reasons."""
    by_part: dict[str, list[str]] = {}
    for part, name in doubtful:
        by_part.setdefault(part.name, []).append(f"{name.replace('_', ' ')} ({part.figures[name].origin})")
    if not by_part:
        return []
    width = max(map(len, by_part))
    lines = [f"  {name:<{width}}  {', '.join(doubts)}" for name, doubts in by_part.items()]
    return ["look up before buying ('ppafo parts PART' gives the reason of each):", *lines]


def doubt_sentence(part: Part, name: str) -> str:
    """Return a figure that is quoted or assumed, with its reason."""
    figure = part.figures[name]
    why = figure.note or figure.source
    value = f"{figure.value:g} {figure.unit}".rstrip()
    return f"{part.name}: {name.replace('_', ' ')} {value} is {figure.origin}: {why}"


def design_document(design: Design) -> dict[str, Any]:
    """Return what ``design.json`` says, in SI units."""
    problem = design.problem
    return {
        "format": "ppafo design",
        "schema_version": 1,
        "name": problem.name,
        "description": problem.description,
        "file": problem.file,
        "units": "SI; pressures absolute, error in N m, gas per task and mass in kg",
        "tasks": [
            {
                "name": task.name,
                "weight": task.weight,
                "scenarios": {kind: scenario.name for kind, scenario in task.scenarios.items()},
            }
            for task in problem.tasks
        ],
        "suggested": design.knee,
        "reason": design.reason,
        "shown": list(design.shown),
        "front": [_point_document(point) for point in design.front],
        "search": {
            "designs": design.designs,
            "runs": design.runs,
            "failed_runs": design.failed,
            "failures": [{"reason": reason, "task": task} for reason, task in design.failures.items()],
            "seed": problem.search.seed,
            "settled": design.settled,
            "hypervolume": [{"designs": count, "share": share} for count, share in design.growth],
        },
        "doubtful": [{"part": part.name, "figure": name, **_figure(part, name)} for part, name in design.doubtful],
        "versions": {"ppafo": ppafo.__version__},
    }


def _figure(part: Part, name: str) -> dict[str, Any]:
    figure: dict[str, Any] = part.figures[name].model_dump(mode="json")
    return figure


def _point_document(point: DesignPoint) -> dict[str, Any]:
    return {
        "valve": point.valve.name,
        "actuator": point.actuator.name,
        "numbers": dict(point.numbers),
        "error": point.error,
        "gas": point.gas,
        "mass": point.mass,
        "tasks": {name: {"error": error, "gas": gas} for name, (error, gas) in point.tasks.items()},
    }


def _cells(design: Design, place: int) -> tuple[str, ...]:
    point = design.front[place]
    mark = SUGGESTED if place == design.knee else ""
    return (
        mark,
        point.valve.name,
        point.actuator.name,
        *objective_cells(point),
        *number_cells(design.problem, point),
    )
