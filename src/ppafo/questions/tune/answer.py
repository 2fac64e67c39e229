"""The answer of a tuning: gains and metrics before and after, how the search went, and lines to paste."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import display_value, display_values, metric_quantity, title_with_unit
from ppafo.answers.setting_names import label_of
from ppafo.answers.style import (
    BLACK,
    BLUE,
    COLOURS,
    GREY,
    VERMILION,
    Margins,
    figure_of_free_panels,
    figure_of_panels,
    house_style,
    label_lines,
    mark_kind,
)
from ppafo.parameters.overrides import over
from ppafo.questions.question import Solved
from ppafo.questions.tune.problem import Gains, Limit, Problem
from ppafo.simulation.scenario import plain, worn_kind
from ppafo.simulation.simulate import Result
from ppafo.studies.distributions import Interval, fraction_text
from ppafo.units import percentage

if TYPE_CHECKING:
    import matplotlib.figure
    from matplotlib.axes import Axes

INFEASIBLE = 1.0e6
"""Where the costs of candidates begin that break a constraint."""


def keeps(item: Limit, value: float) -> bool:
    """Tell whether a value [SI] keeps a constraint."""
    return value <= item.limit if item.is_most else value >= item.limit


@dataclass(frozen=True, slots=True)
class Start:
    """Where one start ended: fractions of the way (gains,), cost, candidates tried, best cost of each generation.

    ``is_settled`` says whether its candidates had come together, or whether it ran out of generations.
    """

    fractions: tuple[float, ...]
    cost: float
    candidates: int
    generations: tuple[float, ...]
    is_settled: bool


def agreement(starts: Sequence[Start]) -> float:
    """Return the largest difference of a fraction of the way between the best start and those as good as it.

    As good is a cost within a hundredth; large where very different gains do as well, which the goal then leaves open.
    """
    best = starts[0]
    beyond = best.cost - INFEASIBLE if best.cost >= INFEASIBLE else best.cost
    as_good = [item for item in starts if item.cost <= best.cost + 0.01 * abs(beyond)]
    return max(float(np.max(np.abs(np.subtract(item.fractions, best.fractions)))) for item in as_good)


FRESH_DRAWS = 1024
"""Draws that the search never saw, over which the result is judged in the end."""


@dataclass(frozen=True, slots=True)
class Ceiling:
    """Draws in which the reference needs more torque than the supply can hold, whatever the gains.

    ``fraction`` is theirs of all; ``explains`` are the metrics of the constraints that they alone break: no gains can
    keep them, or the other draws do.
    """

    fraction: float
    explains: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Setting:
    """Gains [SI] and what they give.

    ``values`` are the metrics by which the search judges them [SI]: as the device is said to be, or at their bad end
    over the draws of the search; ``fresh`` the same over draws that the search did not use (empty without draws).
    ``objective`` is that of the search. ``violation`` and ``without_value`` are those of the search first, of the fresh
    draws second (the same again without draws). ``noise`` is the fraction of the variance over the fresh draws that is
    due to sensor noise, by metric. ``result`` is one run of the nominal device.
    """

    gains: Gains
    values: Mapping[str, float]
    fresh: Mapping[str, float]
    objective: float
    violation: tuple[float, float]
    without_value: tuple[float, float]
    ceiling: Ceiling
    noise: Mapping[str, Interval]
    result: Result

    @property
    def is_feasible_in_search(self) -> bool:
        """True where all constraints are kept and no run fails over what the search saw."""
        return self.violation[0] == 0.0 and self.without_value[0] == 0.0

    @property
    def is_feasible(self) -> bool:
        """True where all constraints are kept and no run fails, over fresh draws too."""
        return self.is_feasible_in_search and self.violation[1] == 0.0 and self.without_value[1] == 0.0


@dataclass(frozen=True, slots=True, repr=False)
class Tuning(Solved):
    """What a search came to. ``starts`` are best first; ``runs`` counts all simulated runs."""

    problem: Problem
    scales: Mapping[str, float]
    before: Setting
    after: Setting
    starts: tuple[Start, ...]
    runs: int

    @property
    def bounds_reached(self) -> dict[str, Literal["minimum", "maximum"]]:
        """The gains that ended at a bound, and at which: a better one may lie beyond."""
        found = {item.path: item.bound_reached(self.after.gains[item.path]) for item in self.problem.searched}
        return {path: bound for path, bound in found.items() if bound is not None}

    @property
    def lines(self) -> list[str]:
        """The gains found, as overrides ``PATH=VALUE`` to paste."""
        return self.problem.lines(self.after.gains)

    @property
    def overrides(self) -> tuple[str, ...]:
        """Every override that makes the tuned scenario of its file: the gains over those of the problem."""
        return over(self.problem.overrides, self.lines, valve=self.problem.scenario.device.valve_name)


_WIDTH, _PANEL, _LETTER = 7.2, 1.7, 0.083
_MARGINS = Margins(left=0.75, right=0.2, top=0.55, bottom=0.55, row_gap=0.45)
_PANELS = (
    ("torque", title_with_unit("Actuator torque", "torque"), "torque"),
    ("command", "Valve command (-1 to 1)", ""),
    ("supplied_mass", title_with_unit("Gas supplied", "gas mass"), "gas mass"),
)


def task_figure(tuning: Tuning) -> "matplotlib.figure.Figure":
    """Return torque, command and gas over time with the gains before and after, on the nominal device."""
    height = _MARGINS.top + len(_PANELS) * _PANEL + (len(_PANELS) - 1) * _MARGINS.row_gap + _MARGINS.bottom
    with house_style():
        figure, rows = figure_of_panels((_WIDTH, height), _MARGINS, len(_PANELS))
        for (channel, title, quantity), (axes,) in zip(_PANELS, rows, strict=True):
            for setting, colour, name in ((tuning.before, VERMILION, "before"), (tuning.after, BLUE, "after")):
                recording = setting.result.recording
                steps = "steps-post" if channel == "command" else "default"
                axes.plot(
                    recording.time,
                    display_values(np.asarray(recording[channel]), quantity),
                    color=colour,
                    label=name,
                    linewidth=1.3,
                    drawstyle=steps,
                )
            axes.set_title(title)
        recording = tuning.after.result.recording
        first = rows[0][0]
        if "reference" in recording:
            first.plot(recording.time, recording["reference"], "--", color=BLACK, label="reference", linewidth=1.2)
        label_lines(first)
        rows[-1][0].set_xlabel("Time (s)")
        mark_kind(figure, "simulated")
        return figure


def search_figure(tuning: Tuning) -> "matplotlib.figure.Figure":
    """Return the cost of each start over its generations, and the gains between their bounds."""
    paths = [item.path for item in tuning.problem.searched]
    names = 0.55 + _LETTER * max(len(label_of(path)) for path in paths)
    margins = Margins(left=0.85, right=0.45, top=0.55, bottom=0.55, row_gap=0.0, column_gap=names)
    height = margins.top + margins.bottom + max(2.3, 0.4 * len(paths))
    with house_style():
        figure, ((course, places),) = figure_of_free_panels((3.2 + 3.2 + names + 1.3, height), margins, 1, 2)
        for number, start in enumerate(tuning.starts):
            costs = np.array(start.generations)
            costs[costs >= INFEASIBLE] = np.nan  # no candidate keeps the constraints yet
            course.plot(np.arange(costs.size), costs, color=COLOURS[number % len(COLOURS)], linewidth=1.3)
        course.axhline(tuning.before.objective, color=GREY, linestyle="--", linewidth=1.0)
        if course.dataLim.ymin > 0.0:
            course.set_yscale("log")
        course.set_title("Objective, best so far; dashed: before")
        course.set_xlabel("Generation")
        _draw_places(places, tuning)
        mark_kind(figure, "simulated")
        return figure


def _draw_places(axes: "Axes", tuning: Tuning) -> None:
    searched = tuning.problem.searched
    rows = np.arange(len(searched))[::-1]
    for row, item in zip(rows, searched, strict=True):
        axes.plot([0.0, 1.0], [row, row], "-", color=GREY, linewidth=1.0)
        for start in tuning.starts:
            axes.plot(
                item.fraction(float(item.value(np.array(start.fractions[searched.index(item)])))),
                row,
                "|",
                color=GREY,
                markersize=11,
            )
        axes.plot(
            np.clip(item.fraction(item.before), -0.05, 1.05), row, "o", color=VERMILION, markersize=7, label="before"
        )
        axes.plot(item.fraction(tuning.after.gains[item.path]), row, "o", color=BLUE, markersize=7, label="after")
    axes.set_yticks(rows, [label_of(item.path) for item in searched])
    axes.set_ylim(-0.6, len(searched) - 0.4)
    axes.set_xticks([0.0, 1.0], ["minimum", "maximum"])
    axes.set_title("Between bounds")
    handles, labels = axes.get_legend_handles_labels()
    legend = axes.legend(handles[:2], labels[:2], ncols=2, borderaxespad=0.1, handlelength=0.8, columnspacing=1.0)
    legend.set_loc("lower right")
    legend.set_bbox_to_anchor((1.0, 1.0))


_DIFFERENT = 0.1
"""Fraction of the way between the bounds from which on two starts are said to have ended in different places."""
_COURSE = "Left: the best objective so far in each start. Right: where the gains lie between their bounds."


def answer_of(tuning: Tuning) -> Answer:
    """Return the answer of a tuning; it has passed where the gains satisfy all constraints, over fresh draws too."""
    problem = tuning.problem
    task = Figure("task", "The nominal device.", lambda: task_figure(tuning))
    course = Figure("search", _COURSE, lambda: search_figure(tuning))
    file = problem.scenario.origin.file or problem.scenario.name
    return Answer(
        name="tune",
        kicker="Tuning",
        title=problem.name,
        lead=(verdict(tuning), *([problem.description] if problem.description else [])),
        sections=(
            Section("Gains", table=_gains(tuning)),
            Section("Before and after", table=_metrics(tuning), figure=task),
            Section("The search", remarks=tuple(remarks(tuning)), figure=course),
            Section(
                "To use the gains",
                code=f"ppafo {_verb(problem)} {file} {_options(tuning)}",
            ),
        ),
        data=_data(tuning),
        passed=tuning.after.is_feasible,
        files={"overrides.txt": lambda: _overrides(tuning).encode()},
    )


def verdict(tuning: Tuning) -> str:
    """Return the result in a sentence."""
    before, after, name = tuning.before, tuning.after, tuning.problem.name
    if after.without_value[0]:
        failing = percentage(after.without_value[0], 3)
        return f"{name}: with the best gains found, {failing} of the runs fail or lack a goal or a constraint"
    if not after.is_feasible_in_search:
        broken = f"the best found exceed the limits by {percentage(after.violation[0], 3)}"
        return f"{name}: no gains within the bounds satisfy all constraints; {broken}{_by_ceiling(tuning)}"
    if not after.is_feasible:
        return (
            f"{name}: the gains found satisfy all constraints over the draws of the search, but not over "
            f"{FRESH_DRAWS:,} fresh ones{_by_ceiling(tuning)}"
        )
    if not before.is_feasible:
        return (
            f"{name}: the gains found satisfy all constraints, which the previous gains did not; objective "
            f"{after.objective:.4g}"
        )
    if after.objective >= before.objective:
        return f"{name}: nothing better than the previous gains was found within the bounds"
    change = (after.objective - before.objective) / abs(before.objective) if before.objective else math.nan
    return f"{name}: objective {before.objective:.4g} before, {after.objective:.4g} after ({100.0 * change:+.3g} %)"


def _by_ceiling(tuning: Tuning) -> str:
    """Return that the torque ceiling is why, where the draws below it are what breaks the constraints."""
    ceiling = tuning.after.ceiling
    if not ceiling.explains:
        return ""
    where = "" if tuning.problem.spread is None else f" in {percentage(ceiling.fraction, 2)} of the draws"
    return (
        "; the torque ceiling is the cause: the reference requires more than the torque constant times the gauge "
        f"pressure of the supply{where}, which no gains can change"
    )


def _gains(tuning: Tuning) -> Table:
    """Return a row for each searched number: before, after, bounds, and whether it ended at one."""
    reached = tuning.bounds_reached
    rows = [
        (
            item.path,
            *map(item.place.quote, (item.before, tuning.after.gains[item.path], item.minimum, item.maximum)),
            f"at its {reached[item.path]}" if item.path in reached else "",
        )
        for item in tuning.problem.searched
    ]
    return Table(tuple(map(Column, ("gain", "before", "after", "minimum", "maximum", ""))), tuple(rows))


def _metrics(tuning: Tuning) -> Table:
    """Return a row for each metric of the goals and constraints."""
    spread = tuning.problem.spread
    head: tuple[str, ...] = ("metric", "before", "after", "constraint")
    if spread is not None:
        fresh = ("before, fresh draws", "after, fresh draws")
        head = ("metric", f"before ({spread.measure})", "after", *fresh, "constraint", "before, nominal")
        head = (*head, "after, nominal")
    rows = [_metric_row(tuning, name) for name in tuning.problem.metrics]
    return Table(tuple(map(Column, head)), tuple(rows))


def remarks(tuning: Tuning) -> list[str]:
    """Return how the search went and what it leaves open."""
    problem, starts = tuning.problem, tuning.starts
    settled = sum(start.is_settled for start in starts)
    said = [
        f"{len(starts)} start{'' if len(starts) == 1 else 's'}, {sum(start.candidates for start in starts):,} "
        f"candidates, {tuning.runs:,} runs; {settled} of {len(starts)} converged before the maximum number of "
        "generations"
    ]
    for path, bound in tuning.bounds_reached.items():
        said.append(
            f"{path} ended at its {bound}: a better value may lie beyond; widen the bounds if the device allows it"
        )
    apart = agreement(starts)
    if apart > _DIFFERENT:
        said.append(
            f"starts whose objectives agree within 1 % differ by up to {100.0 * apart:.0f} % of the range between "
            "the bounds: the objective does not determine the gains uniquely"
        )
    spread = problem.spread
    if spread is not None:
        over = f"study '{spread.study}'" if spread.study else "the sensor noise"
        said.append(
            f"every candidate ran over the same {spread.draws} draws of {over}; 'fresh' is over {FRESH_DRAWS:,} "
            "draws that the search did not use"
        )
    fractions = ", ".join(f"{name} {fraction_text(fraction)}" for name, fraction in tuning.after.noise.items())
    said += (
        [f"fraction of the variance over the fresh draws that is due to sensor noise: {fractions}"] if fractions else []
    )
    return [*said, *(f"violated on fresh draws: {text}" for text in _violations_on_fresh(tuning))]


def _violations_on_fresh(tuning: Tuning) -> list[str]:
    """Return what the result breaks over fresh draws: constraints, and runs that fail."""
    after = tuning.after
    values, lacking = after.fresh, after.without_value[1]
    broken = [
        f"{item.metric} {_limit(item)}, it is {_number(item.metric, values[item.metric])}"
        for item in tuning.problem.constraints
        if item.metric in values and not keeps(item, values[item.metric])
    ]
    return [*broken, *([f"{percentage(lacking, 2)} of the runs fail or lack a metric"] if values and lacking else [])]


def _verb(problem: Problem) -> str:
    """Return the command, and the function, that runs the scenario once."""
    return "simulate" if worn_kind(problem.scenario) is None else "walk"


def _options(tuning: Tuning) -> str:
    """Return the gains as options of a command."""
    return " ".join(f'--set "{line}"' for line in tuning.overrides)


def _overrides(tuning: Tuning) -> str:
    """Return the gains for a command line, a study file and Python."""
    lines = tuning.overrides
    listed, verb = ", ".join(f'"{line}"' for line in lines), _verb(tuning.problem)
    given = "" if verb == "simulate" else "overrides="
    return (
        f"# {verdict(tuning)}\n\n# on the command line\n{_options(tuning)}\n\n# in a study file\noverrides = "
        f"[{listed}]\n\n# in Python\nppafo.{verb}({tuning.problem.scenario.name!r}, {given}[{listed}])\n"
    )


def _data(tuning: Tuning) -> dict[str, Any]:
    problem = tuning.problem
    return {
        "tuning": problem.name,
        "scenario": problem.scenario.name,
        "verdict": verdict(tuning),
        "is_feasible": tuning.after.is_feasible,
        "overrides": list(tuning.overrides),
        "bounds_reached": dict(tuning.bounds_reached),
        "scales": dict(tuning.scales),
        "goals": plain(list(problem.goals)),
        "constraints": plain(list(problem.constraints)),
        "robust": None
        if problem.spread is None
        else {"study": problem.spread.study or None, "measure": problem.spread.measure},
        "effort": problem.effort.model_dump(),
        "before": _setting_data(tuning.before),
        "after": _setting_data(tuning.after),
        "starts": [plain(start) for start in tuning.starts],
        "runs": tuning.runs,
        "remarks": remarks(tuning),
    }


def _metric_row(tuning: Tuning, name: str) -> tuple[str, ...]:
    sides = (tuning.before, tuning.after)
    limits = ", ".join(_limit(item) for item in tuning.problem.constraints if item.metric == name)
    first = [title_with_unit(name, metric_quantity(name)), *(_number(name, side.values.get(name)) for side in sides)]
    if tuning.problem.spread is None:
        return (*first, limits)
    nominal = [side.result.metrics.get(name) for side in sides]
    fresh = [_number(name, side.fresh.get(name)) for side in sides]
    return (*first, *fresh, limits, *(_number(name, None if item is None else item.value) for item in nominal))


def _number(name: str, value: float | None) -> str:
    return "" if value is None or math.isnan(value) else f"{display_value(value, metric_quantity(name)):.4g}"


def _limit(item: Limit) -> str:
    return f"at {'most' if item.is_most else 'least'} {item.text}"


def _setting_data(setting: Setting) -> dict[str, Any]:
    return {
        "gains": plain(setting.gains),
        "values": plain(setting.values),
        "fresh": plain(setting.fresh),
        "objective": setting.objective,
        "violation": setting.violation[0],
        "share_without_value": setting.without_value[0],
        "fresh_violation": setting.violation[1],
        "fresh_share_without_value": setting.without_value[1],
        "torque_ceiling": plain(setting.ceiling),
        "share_of_noise": {name: plain(fraction) for name, fraction in setting.noise.items()},
        "metrics": {name: plain(metric) for name, metric in setting.result.metrics.items()},
    }
