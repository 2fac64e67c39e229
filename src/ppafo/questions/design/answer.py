"""The answer of a design study: designs that stand for the front, the suggestion, how it was found, the doubts."""

import csv
import io
from typing import Any

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import quantity_of_unit
from ppafo.questions.design.evaluation import SEARCHED_STREAMS
from ppafo.questions.design.figure import design_figure
from ppafo.questions.design.search import PATIENCE
from ppafo.questions.design.solve import SHOWN_OBJECTIVES, Design, DesignPoint
from ppafo.questions.design.variables import Variable
from ppafo.questions.parts.answer import doubts_data, doubts_sections, titles_section
from ppafo.version import __version__

_CAPTION = (
    "A to C: the front, each dot a design. D: the fraction of the box between the best and the worst values of the "
    "first, evenly spread designs that the front dominates, over the number of designs tried."
)
_MEANS = (
    "Error and gas are weighted means over the tasks. Friction, leak and stops are those of the scenarios' "
    "device, whatever the actuator. What the data sheet of a valve does not state (dead band, delay) is taken as "
    "ideal; the sensors are those of the scenarios."
)


def answer_of(design: Design) -> Answer:
    """Return the answer of a design study."""
    problem, points = design.problem, [design.front[place] for place in design.shown]
    marked = tuple(row for row, place in enumerate(design.shown) if place == design.knee)
    rows = tuple(_row(design, point) for point in points)
    figure = Figure("front", _CAPTION, lambda: design_figure(design))
    return Answer(
        name="design",
        kicker="Design study",
        title=problem.name,
        lead=(problem.description,) if problem.description else (),
        sections=(
            Section("The front", (_front_sentence(design),), is_detail=True),
            Section("Designs", table=Table(_head(design), rows, marked, left=2)),
            Section(
                remarks=(f"suggested: {design.reason}", _search_sentence(design), *_noise(design), *_failures(design))
            ),
            Section("Error, gas and mass", figure=figure, is_detail=True),
            _method_section(design),
            *doubts_sections(design.doubtful),
            titles_section(part for point in points for part in (point.valve, point.actuator)),
        ),
        data=_data(design),
        files={"front.csv": lambda: front_table(design).encode()},
    )


def front_table(design: Design) -> str:
    """Return the whole front as comma-separated text in SI units, named in the header."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    numbers = [f"{item.path} [{item.unit or '-'}]" for item in design.problem.variables]
    spread = ["error from noise [N m]", "gas from noise [kg]"] if design.streams else []
    writer.writerow(["valve", "actuator", "error [N m]", "gas [kg]", "mass [kg]", *spread, *numbers])
    for point in design.front:
        values = [point.numbers.get(item.path, "") for item in design.problem.variables]
        writer.writerow([point.valve.name, point.actuator.name, *point.objectives, *(point.spread or ()), *values])
    return buffer.getvalue()


def _head(design: Design) -> tuple[Column, ...]:
    titles = zip(("error", "gas per task", "mass"), SHOWN_OBJECTIVES.values(), (".3g", ".3g", ".4g"), strict=True)
    objectives = [Column(*title) for title in titles]
    spread = [Column("error from noise", SHOWN_OBJECTIVES["error"], ".2g")] if design.streams else []
    return Column("valve"), Column("actuator"), *objectives, *spread, *map(_variable_column, design.problem.variables)


def _variable_column(variable: Variable) -> Column:
    """Return the column of a chosen number: its path without the section, with its unit."""
    words, quantity = variable.path.partition(".")[2].replace("_", " "), quantity_of_unit(variable.unit)
    has_own_unit = not quantity and variable.unit not in ("", "1")
    return Column(f"{words} ({variable.unit})" if has_own_unit else words, quantity)


def _row(design: Design, point: DesignPoint) -> tuple[str | float | None, ...]:
    """Return parts, objectives and chosen numbers; None where a number means nothing for the valve."""
    numbers = [point.numbers.get(item.path) for item in design.problem.variables]
    spread = [] if point.spread is None else [point.spread[0]]
    return point.valve.name, point.actuator.name, *point.objectives, *spread, *numbers


def _front_sentence(design: Design) -> str:
    carried = ", ".join(part.title for part in design.problem.carried)
    return (
        "No other design found beats one below in tracking error, gas per task and mass together: less of one of the "
        "three costs more of "
        f"another.{f' Every design carries {carried}; their mass is in the table.' if carried else ''}"
    )


def _search_sentence(design: Design) -> str:
    tolerance = 100.0 * design.problem.search.tolerance
    ending = (
        f"this fraction grew by less than {tolerance:.2g} % over the last {PATIENCE} generations"
        if design.settled
        else "this fraction was still growing when the maximum number of generations was reached"
    )
    return (
        f"{len(design.front):,} of {design.designs:,} designs tried ({design.runs:,} runs, {design.seconds:.0f} s) "
        f"are not dominated by any other; they cover {design.growth[-1][1]:.4f} of the box of the first designs, "
        f"and {ending}"
    )


def _noise(design: Design) -> list[str]:
    """Return how noise was dealt with; nothing without it."""
    if not design.streams:
        return []
    fallen = f"; {design.fallen} that were good in the first streams alone are left out" if design.fallen else ""
    return [
        f"sensors are noisy: every design was tried in the same {SEARCHED_STREAMS} noise streams, keeping the "
        f"constraints in each; error and gas above are means over {design.streams} new ones, in which the front was "
        f"made again{fallen}. Error from noise is the standard deviation from one stream to another"
    ]


def _failures(design: Design) -> list[str]:
    if not design.failed:
        return []
    reason, task = next(iter(design.failures.items()))
    return [
        f"{design.failed:,} of {design.runs:,} runs failed and their designs were left out; the first "
        f"({task}): {reason}"
    ]


def _method_section(design: Design) -> Section:
    problem = design.problem
    head = (Column("task"), Column("weight", "fraction", ".0f"), Column("scenario for each kind of valve"))
    rows = tuple(
        (task.name, task.weight, ", ".join(f"{scenario.name} ({kind})" for kind, scenario in task.scenarios.items()))
        for task in problem.tasks
    )
    again = f"Random seed {problem.search.seed} reproduces these designs. Made with: ppafo design {problem.file}"
    return Section("Method", table=Table(head, rows), remarks=(_MEANS, again), is_detail=True)


def _data(design: Design) -> dict[str, Any]:
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
        "noise_streams": design.streams,
        "front": [_point_data(point) for point in design.front],
        "search": {
            "designs": design.designs,
            "runs": design.runs,
            "failed_runs": design.failed,
            "failures": [{"reason": reason, "task": task} for reason, task in design.failures.items()],
            "seed": problem.search.seed,
            "settled": design.settled,
            "hypervolume": [{"designs": count, "share": fraction} for count, fraction in design.growth],
        },
        "doubtful": doubts_data(design.doubtful),
        "versions": {"ppafo": __version__},
    }


def _point_data(point: DesignPoint) -> dict[str, Any]:
    return {
        "valve": point.valve.name,
        "actuator": point.actuator.name,
        "numbers": dict(point.numbers),
        "error": point.error,
        "gas": point.gas,
        "mass": point.mass,
        "from_noise": None if point.spread is None else {"error": point.spread[0], "gas": point.spread[1]},
        "tasks": {name: {"error": error, "gas": gas} for name, (error, gas) in point.tasks.items()},
    }
