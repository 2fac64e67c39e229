"""The answer of a design study: designs that stand for the front, the suggestion, how it was found, the doubts."""

import csv
import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.analyses.design.front.problem import GAS, SEARCHED_STREAMS, DesignProblem, Variable
from ppafo.analyses.design.front.search import PATIENCE, Floats
from ppafo.analyses.parts.solve import doubts_data, doubts_sections, titles_section
from ppafo.parameters.parts import Part
from ppafo.report import Answer, Column, Figure, Section, Table
from ppafo.report.display_units import display_values, quantity_of_unit, quantity_text, title_with_unit
from ppafo.report.solved import Solved
from ppafo.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, VERMILION, house_style, mark_kind
from ppafo.simulation.simulate import Result
from ppafo.version import __version__

if TYPE_CHECKING:
    from collections.abc import Callable

    import matplotlib.figure
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

SHOWN_OBJECTIVES = {"error": "torque", "gas": "gas mass", "mass": "part mass"}
"""What a design is judged by, with the kind of quantity as which a person is shown it."""


@dataclass(frozen=True, slots=True)
class DesignPoint:
    """A design that no other design found beats: parts, chosen numbers [SI] by path, error [N m], gas and mass [kg].

    ``tasks`` has error and gas of each task by its name. Where sensors are noisy all are means over ``FRESH_STREAMS``
    new streams of noise, and ``spread`` has the standard deviations of error and gas from one stream to another.
    """

    valve: Part
    actuator: Part
    numbers: Mapping[str, float]
    error: float
    gas: float
    mass: float
    tasks: Mapping[str, tuple[float, float]]
    spread: tuple[float, float] | None = None

    @property
    def objectives(self) -> tuple[float, float, float]:
        """Error [N m], gas per task [kg], mass [kg]."""
        return self.error, self.gas, self.mass


@dataclass(frozen=True, slots=True, eq=False)
class Rerun:
    """The suggestion run once more in a task: the command that repeats it, and its result."""

    task: str
    command: str
    result: Result


@dataclass(frozen=True, slots=True, repr=False)
class Design(Solved):
    """The result of a design study.

    ``front`` is in order of error. ``shown`` are places in it that stand for all of it in a table, ``knee`` is the
    place of the suggestion and ``reason`` states why. ``growth`` has pairs of designs evaluated and hypervolume [-];
    ``failures`` maps the reason of a failed run to the task it failed in. ``streams`` is how many new streams of noise
    the front was judged over, 0 without noise, and ``fallen`` how many of its designs did not stand there.
    ``suggested`` is the suggestion run once more in each task.
    """

    problem: DesignProblem
    front: tuple[DesignPoint, ...]
    shown: tuple[int, ...]
    knee: int
    reason: str
    growth: tuple[tuple[int, float], ...]
    settled: bool
    designs: int
    runs: int
    failed: int
    failures: Mapping[str, str]
    seconds: float
    streams: int = 0
    fallen: int = 0
    suggested: tuple[Rerun, ...] = ()

    @property
    def doubtful(self) -> tuple[tuple[Part, str], ...]:
        """Figures that are quoted or assumed, of the parts on the front and of those that every design carries."""
        used = {part.name for point in self.front for part in (point.valve, point.actuator)}
        used |= {part.name for part in self.problem.carried}
        return tuple((part, name) for part in self.problem.parts if part.name in used for name in part.doubtful)


def objective_table(front: tuple[DesignPoint, ...]) -> Floats:
    """Return the objectives of designs, (designs, 3)."""
    return np.array([point.objectives for point in front]).reshape(-1, 3)


_SIZE = (9.0, 7.4)
_COLOURS = (BLUE, VERMILION, GREEN, ORANGE, "#CC79A7", "#56B4E9", BLACK, GREY)
_MARKERS = ("o", "^", "s", "D", "v", "P")
_LOGARITHMIC_FROM = 10.0
_AXES = tuple(zip(("Error", "Gas per task", "Mass"), SHOWN_OBJECTIVES.values(), strict=True))
_PANELS = (
    ("A", "Error against gas per task", 0, 1),
    ("B", "Error against mass", 0, 2),
    ("C", "Gas per task against mass", 1, 2),
)
_MAXIMUM_TICKS_OF_ONE_DECADE = 1.5
"""Decades above which a logarithmic axis has ticks at powers of ten only."""


def design_figure(design: Design) -> "matplotlib.figure.Figure":
    """Return three views of the front, coloured by valve and shaped by actuator, and the growth of the hypervolume."""
    import matplotlib.figure

    with house_style():
        figure = matplotlib.figure.Figure(figsize=_SIZE)
        names = _names(design)
        figure.subplots_adjust(left=0.08, right=0.97, bottom=0.075, top=0.83, wspace=0.25, hspace=0.36)
        panels = figure.subplots(2, 2).ravel()
        columns = zip(objective_table(design.front).T, SHOWN_OBJECTIVES.values(), strict=True)
        table = np.stack([display_values(values, quantity) for values, quantity in columns], axis=1)
        for axes, (letter, title, x, y) in zip(panels, _PANELS, strict=False):
            _view(axes, design, table, x, y)
            axes.set_title(f"$\\bf{{{letter}}}$   {title}", pad=8)
        _growth(panels[3], design)
        titles = {part.name: part.title for point in design.front for part in (point.valve, point.actuator)}
        valves, actuators = ([titles[name] for name in group] for group in names)
        _legend(figure, valves, actuators, panels[0])
        mark_kind(figure, "simulated")
    return figure


def _names(design: Design) -> tuple[list[str], list[str]]:
    """Return the valves and the actuators on the front, in the order of the problem."""
    valves = [item.valve.name for item in design.problem.combinations]
    actuators = [item.actuator.name for item in design.problem.combinations]
    used = {point.valve.name for point in design.front} | {point.actuator.name for point in design.front}
    return [name for name in dict.fromkeys(valves) if name in used], [
        name for name in dict.fromkeys(actuators) if name in used
    ]


def _view(axes: "Axes", design: Design, table: Floats, x: int, y: int) -> None:
    valves, actuators = _names(design)
    for number, valve in enumerate(valves):
        for other, actuator in enumerate(actuators):
            members = [
                place
                for place, point in enumerate(design.front)
                if point.valve.name == valve and point.actuator.name == actuator
            ]
            axes.plot(
                table[members, x],
                table[members, y],
                linestyle="none",
                marker=_MARKERS[other % len(_MARKERS)],
                markersize=3.2,
                markeredgewidth=0.0,
                color=_COLOURS[number % len(_COLOURS)],
                alpha=0.75,
            )
    knee = table[design.knee]
    axes.plot(knee[x], knee[y], marker="o", markersize=13, markerfacecolor="none", color=BLACK, markeredgewidth=1.4)
    axes.set_xlabel(title_with_unit(*_AXES[x]))
    axes.set_ylabel(title_with_unit(*_AXES[y]))
    _scale(axes.set_xscale, axes.xaxis, table[:, x])
    _scale(axes.set_yscale, axes.yaxis, table[:, y])


def _scale(set_scale: "Callable[[str], None]", axis: "Axis", values: Floats) -> None:
    """Make an axis logarithmic where its values span much, with plain numbers at its ticks."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    if not (values.min() > 0.0 and values.max() > _LOGARITHMIC_FROM * values.min()):
        return
    set_scale("log")
    is_long = np.log10(values.max() / values.min()) > _MAXIMUM_TICKS_OF_ONE_DECADE
    axis.set_major_locator(LogLocator(subs=(1.0,) if is_long else (1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _place: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def _growth(axes: "Axes", design: Design) -> None:
    designs = [count / 1000.0 for count, _ in design.growth]
    fractions = [fraction for _, fraction in design.growth]
    axes.plot(designs, fractions, color=BLUE, marker="o", markersize=3)
    axes.set_title("$\\bf{D}$   Hypervolume of the front", pad=8)
    axes.set_xlabel("Designs tried (thousands)")
    axes.set_ylabel("Fraction of the box")
    axes.locator_params(axis="x", nbins=5)


def _legend(figure: "matplotlib.figure.Figure", valves: list[str], actuators: list[str], axes: "Axes") -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], linestyle="none", marker="s", markersize=7, color=_COLOURS[number % len(_COLOURS)], label=name)
        for number, name in enumerate(valves)
    ]
    handles += [
        Line2D([], [], linestyle="none", marker=_MARKERS[number % len(_MARKERS)], markersize=6, color=GREY, label=name)
        for number, name in enumerate(actuators)
    ]
    handles.append(
        Line2D(
            [], [], linestyle="none", marker="o", markersize=11, markerfacecolor="none", color=BLACK, label="suggested"
        )
    )
    left = axes.get_position().x0
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(left - 0.01, 0.975), ncols=3, columnspacing=1.4)


_CAPTION = (
    "A to C: the front, each dot a design. D: the fraction of the box between the best and the worst values of the "
    "first, evenly spread designs that the front dominates, over the number of designs tried."
)
_MEANS = (
    "Error and gas are weighted means over the tasks. Friction, leak and stops follow the scenarios' "
    "device, whatever the actuator. What the data sheet of a valve does not state (dead band, delay) is taken as "
    "ideal; the sensors are the scenarios'."
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
            *_suggestion(design),
            _method_section(design),
            *doubts_sections(design.doubtful),
            titles_section(part for point in points for part in (point.valve, point.actuator)),
        ),
        data=_data(design),
        files={"front.csv": lambda: front_table(design).encode()},
    )


def _suggestion(design: Design) -> Iterator[Section]:
    """Yield the suggestion as it ran once more in each task, with its figure and the command that repeats it."""
    error = design.problem.error
    for number, rerun in enumerate(design.suggested, 1):
        found = rerun.result.metrics
        gas = quantity_text(found[GAS].value, "gas mass")
        numbers = f"error {quantity_text(found[error].value, 'torque')}, gas {gas}"
        stem = "suggested" if number == 1 else f"suggested-{number}"
        yield Section(
            "The suggestion, run once more" if number == 1 else "",
            remarks=(f"in '{rerun.task}': {numbers}; this command repeats the run",),
            code=rerun.command,
        )
        caption = f"The suggestion in the task '{rerun.task}'."
        yield Section(f"The run in '{rerun.task}'", figure=Figure(stem, caption, rerun.result.plot), is_detail=True)


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
