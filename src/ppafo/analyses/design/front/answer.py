"""A design study: designs that stand for the front, the suggestion, how it was found, the doubts."""

import csv
import io
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.analyses.design.front.problem import GAS, OBJECTIVES, DesignProblem
from ppafo.analyses.design.front.search import PATIENCE
from ppafo.analyses.design.looks import COLOURS, RING
from ppafo.analyses.design.trials import STREAMS
from ppafo.analyses.parts.sections import doubts_data, part_titles, parts_to_check
from ppafo.parameters.parts import Part
from ppafo.report import finding
from ppafo.report.display_units import quantity_of_unit
from ppafo.report.finding import Cell, Column, Finding, columns_of
from ppafo.report.kind import Kind
from ppafo.report.panels import Mark, Panel
from ppafo.report.style import BLACK, GREY
from ppafo.signals.recording import Floats
from ppafo.simulation.simulate import Result
from ppafo.units.shown import in_units
from ppafo.version import __version__

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis


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


@dataclass(frozen=True, slots=True)
class Design:
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

    def json_document(self) -> dict[str, Any]:
        """Return the front and how it was found as plain data in SI."""
        problem = self.problem
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
            "suggested": self.knee,
            "reason": self.reason,
            "shown": list(self.shown),
            "noise_streams": self.streams,
            "front": [
                {
                    "valve": point.valve.name,
                    "actuator": point.actuator.name,
                    "numbers": dict(point.numbers),
                    **dict(zip(OBJECTIVES, point.objectives, strict=True)),
                    "from_noise": None if point.spread is None else {"error": point.spread[0], "gas": point.spread[1]},
                    "tasks": {name: {"error": error, "gas": gas} for name, (error, gas) in point.tasks.items()},
                }
                for point in self.front
            ],
            "search": {
                "designs": self.designs,
                "runs": self.runs,
                "failed_runs": self.failed,
                "failures": [{"reason": reason, "task": task} for reason, task in self.failures.items()],
                "seed": problem.search.seed,
                "settled": self.settled,
                "hypervolume": [{"designs": count, "share": fraction} for count, fraction in self.growth],
            },
            "doubtful": doubts_data(self.doubtful),
            "versions": {"ppafo": __version__},
        }


_MARKERS = ("o", "^", "s", "D", "v", "P")
_LOGARITHMIC_FROM = 10.0
"""Largest value over the smallest from which an axis is logarithmic."""
_VIEWS = (
    ("A   Error against gas per task", "error", "gas"),
    ("B   Error against mass", "error", "mass"),
    ("C   Gas per task against mass", "gas", "mass"),
)
_MAXIMUM_TICKS_OF_ONE_DECADE = 1.5
"""Decades above which a logarithmic axis has ticks at powers of ten only."""


def design_panels(design: Design) -> list[Panel]:
    """Return three views of the front, coloured by valve and shaped by actuator, and the growth of the hypervolume."""
    count, fraction = np.array(design.growth).reshape(-1, 2).T
    growth = Mark("line", count / 1000.0, fraction, style={"marker": "o", "markersize": 3})
    views = [_view(design, *view, legend="figure" if number == 0 else "") for number, view in enumerate(_VIEWS)]
    title = "D   Hypervolume of the front"
    return [*views, Panel(Kind("Designs tried (thousands)"), Kind("Fraction of the box"), [growth], title)]


def _view(design: Design, title: str, x: str, y: str, legend: str) -> Panel:
    places = np.array([[getattr(point, name) for name in (x, y)] for point in design.front])
    pairs = [(point.valve, point.actuator) for point in design.front]
    # Looks are given in the order of the problem, so that a valve keeps its colour in all views.
    groups = [(combination.valve, combination.actuator) for combination in design.problem.combinations]
    valves, actuators = (
        {group[side].name: group[side].title for group in groups if group[side] in used}
        for side, used in enumerate(zip(*pairs, strict=True))
    )
    looks = {name: COLOURS[number % len(COLOURS)] for number, name in enumerate(valves)}
    shapes = {name: _MARKERS[number % len(_MARKERS)] for number, name in enumerate(actuators)}

    def dots(label: str, colour: str, shown: Floats, **style: Any) -> Mark:
        return Mark("line", shown[:, 0], shown[:, 1], (), label, colour, {"linestyle": "", **style})

    marks = []
    for (valve, look), (actuator, shape) in product(looks.items(), shapes.items()):
        here = [pair[0].name == valve and pair[1].name == actuator for pair in pairs]
        small = {"marker": shape, "markersize": 3.2, "markeredgewidth": 0.0, "alpha": 0.75}
        marks.append(dots("", look, places[here], **small))
    # Marks without a place name the colours and the shapes in the legend.
    marks += [dots(valves[name], look, places[:0], marker="s", markersize=7) for name, look in looks.items()]
    marks += [dots(actuators[name], GREY, places[:0], marker=look, markersize=6) for name, look in shapes.items()]
    marks.append(dots("suggested", BLACK, places[[design.knee]], **RING | {"markersize": 13}))

    def scale(axes: "Axes") -> None:
        _scale(axes.set_xscale, axes.xaxis, places[:, 0])
        _scale(axes.set_yscale, axes.yaxis, places[:, 1])

    return Panel(OBJECTIVES[x], OBJECTIVES[y], marks, title, legend=legend, then=scale)


def _scale(set_scale: "Callable[[str], None]", axis: "Axis", values: Floats) -> None:
    """Make an axis logarithmic where its values span much, with plain numbers at its ticks."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    if not (values.min() > 0.0 and values.max() > _LOGARITHMIC_FROM * values.min()):
        return
    # Powers of ten alone on a long axis, 1, 2 and 5 on a short one, which might have a single tick else.
    set_scale("log")
    is_long = np.log10(values.max() / values.min()) > _MAXIMUM_TICKS_OF_ONE_DECADE
    axis.set_major_locator(LogLocator(subs=(1.0,) if is_long else (1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _place: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


_CAPTION = (
    "A to C: the front, each dot a design. D: the fraction of the box between the best and the worst values of the "
    "first, evenly spread designs that the front dominates, over the number of designs tried."
)
_MEANS = (
    "Error and gas are weighted means over the tasks. Friction, leak and stops follow the scenarios' "
    "device, whatever the actuator. What the data sheet of a valve does not state (dead band, delay) is taken as "
    "ideal; the sensors are the scenarios'."
)


@in_units(lambda design: next(iter(design.problem.tasks[0].scenarios.values())).device.shown)
def finding_of(design: Design) -> Finding[Design]:
    """Return a design study in words, tables and panels."""
    problem, points = design.problem, [design.front[number] for number in design.shown]
    carried = ", ".join(part.title for part in problem.carried)
    front = (
        "No other design found beats one below in tracking error, gas per task and mass together: less of one of the "
        "three costs more of another."
    )
    front += f" Every design carries {carried}; their mass is in the table." if carried else ""
    tasks = [
        (task.name, task.weight, ", ".join(f"{scenario.name} ({kind})" for kind, scenario in task.scenarios.items()))
        for task in problem.tasks
    ]
    titles = ("task", ("weight", Kind(quantity="fraction", form=".0f")), "scenario for each kind of valve")
    again = f"Random seed {problem.search.seed} reproduces these designs. Made with: ppafo design {problem.file}"
    return Finding(
        name="design",
        kicker="Design study",
        title=problem.name,
        said=(problem.description,) if problem.description else (),
        parts=(
            finding.Part("The front", said=[front], is_detail=True),
            finding.Part(
                "Designs",
                _columns(design, points),
                marked=[row for row, point in enumerate(design.shown) if point == design.knee],
                left=2,
            ),
            finding.Part(remarks=_remarks(design)),
            finding.Part(
                "Error, gas and mass",
                panels=partial(design_panels, design),
                name="front",
                caption=_CAPTION,
                across=2,
                size=(4.5, 3.5),
                is_detail=True,
            ),
            *_suggestion(design),
            finding.Part("Method", columns_of(titles, tasks), remarks=(_MEANS, again), is_detail=True),
            *parts_to_check(design.doubtful),
            part_titles(part for point in points for part in (point.valve, point.actuator)),
        ),
        found=design,
        files={"front.csv": partial(_table_bytes, design)},
    )


def _table_bytes(design: Design) -> bytes:
    return front_table(design).encode()


def _suggestion(design: Design) -> Iterator[finding.Part]:
    """Yield the suggestion as it ran once more in each task, with its figure and the command that repeats it."""
    for number, rerun in enumerate(design.suggested, 1):
        metrics = rerun.result.metrics
        error, gas = (
            OBJECTIVES["error"].text(metrics[design.problem.error].value),
            OBJECTIVES["gas"].text(metrics[GAS].value),
        )
        yield finding.Part(
            "The suggestion, run once more" if number == 1 else "",
            remarks=[f"in '{rerun.task}': error {error}, gas {gas}; this command repeats the run"],
            code=rerun.command,
        )
        yield finding.Part(
            f"The run in '{rerun.task}'",
            name="suggested" if number == 1 else f"suggested-{number}",
            caption=f"The suggestion in the task '{rerun.task}'.",
            draw=rerun.result.plot,
            is_detail=True,
        )


def front_table(design: Design) -> str:
    """Return the whole front as comma-separated text in SI units, named in the header."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    numbers = [f"{variable.path} [{variable.unit or '-'}]" for variable in design.problem.variables]
    spread = ["error from noise [N m]", "gas from noise [kg]"] if design.streams else []
    writer.writerow(["valve", "actuator", "error [N m]", "gas [kg]", "mass [kg]", *spread, *numbers])
    for point in design.front:
        values = [point.numbers.get(variable.path, "") for variable in design.problem.variables]
        writer.writerow([point.valve.name, point.actuator.name, *point.objectives, *(point.spread or ()), *values])
    return buffer.getvalue()


def _columns(design: Design, points: list[DesignPoint]) -> list[Column]:
    """Return parts, objectives and chosen numbers; None where a number means nothing for the valve."""
    titles: list[str | tuple[str, Kind]] = ["valve", "actuator"]
    titles += [(kind.words.lower(), kind) for kind in OBJECTIVES.values()]
    rows: list[list[Cell]] = [[point.valve.name, point.actuator.name, *point.objectives] for point in points]
    if design.streams:
        titles.append(("error from noise", replace(OBJECTIVES["error"], form=".2g")))
        rows = [[*row, point.spread[0] if point.spread else None] for row, point in zip(rows, points, strict=True)]
    for variable in design.problem.variables:
        # Its path without the section, with its unit.
        words, quantity = variable.path.partition(".")[2].replace("_", " "), quantity_of_unit(variable.unit)
        own_unit = "" if quantity or variable.unit in ("", "1") else f" ({variable.unit})"
        titles.append((f"{words}{own_unit}", Kind(quantity=quantity)))
        rows = [[*row, point.numbers.get(variable.path)] for row, point in zip(rows, points, strict=True)]
    return columns_of(titles, rows)


def _remarks(design: Design) -> list[str]:
    """Return the suggestion, how the search ended, how noise was dealt with, and how many runs failed."""
    grew = (
        f"this fraction grew by less than {100.0 * design.problem.search.tolerance:.2g} % over the last {PATIENCE} "
        "generations"
        if design.settled
        else "this fraction was still growing when the maximum number of generations was reached"
    )
    remarks = [
        f"suggested: {design.reason}",
        f"{len(design.front):,} of {design.designs:,} designs tried ({design.runs:,} runs, {design.seconds:.0f} s) "
        f"are not dominated by any other; they cover {design.growth[-1][1]:.4f} of the box of the first designs, "
        f"and {grew}",
    ]
    if design.streams:
        fallen = f"; {design.fallen} that were good in the first streams alone are left out" if design.fallen else ""
        remarks.append(
            f"sensors are noisy: every design was tried in the same {STREAMS} noise streams, keeping the "
            f"constraints in each; error and gas above are means over {design.streams} new ones, in which the front "
            f"was made again{fallen}. Error from noise is the standard deviation from one stream to another"
        )
    if design.failed:
        reason, task = next(iter(design.failures.items()))
        remarks.append(
            f"{design.failed:,} of {design.runs:,} runs failed and their designs were left out; the first "
            f"({task}): {reason}"
        )
    return remarks
