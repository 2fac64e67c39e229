"""A tuning as a finding: gains and metrics before and after, how the search went, and lines to paste."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ppafo.analyses.tune.problem import Gains, Problem, Term
from ppafo.errors import count_of
from ppafo.metrics import Metric
from ppafo.metrics.metric import controlled_in
from ppafo.model.controlled import CONTROLLED, TORQUE
from ppafo.parameters.overrides import over
from ppafo.report.display_units import quantity_of_unit
from ppafo.report.finding import Column, Finding, Part, columns_of
from ppafo.report.kind import TIME, Interval, Kind, of_metric
from ppafo.report.panels import Mark, Panel
from ppafo.report.setting_names import label_of
from ppafo.report.style import BLACK, BLUE, COLOURS, GREY, VERMILION
from ppafo.simulation.simulate import Result
from ppafo.studies.distributions import fraction_text
from ppafo.studies.draws import Limit
from ppafo.units import percentage
from ppafo.units.shown import in_units

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INFEASIBLE = 1.0e6
"""Where the costs of candidates begin that break a constraint."""


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
    # Of an infeasible cost only what the violation adds is compared: a hundredth of the offset would take in all.
    beyond = best.cost - INFEASIBLE if best.cost >= INFEASIBLE else best.cost
    as_good = [start for start in starts if start.cost <= best.cost + 0.01 * abs(beyond)]
    return max(float(np.max(np.abs(np.subtract(start.fractions, best.fractions)))) for start in as_good)


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
    ``objective`` belongs to the search; what is called fresh, to the fresh draws (the same again without draws).
    ``share_of_noise`` is the fraction of the variance over the fresh draws that is due to sensor noise, by metric.
    ``metrics`` belong to ``result``, one run of the nominal device.
    """

    gains: Gains
    values: Mapping[str, float]
    fresh: Mapping[str, float]
    objective: float
    violation: float
    share_without_value: float
    fresh_violation: float
    fresh_share_without_value: float
    torque_ceiling: Ceiling
    share_of_noise: Mapping[str, Interval]
    metrics: Mapping[str, Metric]
    result: Result = field(compare=False, repr=False)

    @property
    def is_feasible_in_search(self) -> bool:
        """True where all constraints are kept and no run fails over what the search saw."""
        return self.violation == 0.0 and self.share_without_value == 0.0

    @property
    def is_feasible(self) -> bool:
        """True where all constraints are kept and no run fails, over fresh draws too."""
        return self.is_feasible_in_search and self.fresh_violation == 0.0 and self.fresh_share_without_value == 0.0


@dataclass(frozen=True, slots=True)
class Tuned:
    """What a search came to; numbers in SI. ``starts`` are best first; ``runs`` counts all simulated runs.

    ``overrides`` make the tuned scenario of its file; ``bounds_reached`` are the gains that ended at a bound, and at
    which: a better one may lie beyond.
    """

    tuning: str
    scenario: str
    verdict: str
    is_feasible: bool
    overrides: list[str]
    bounds_reached: dict[str, Literal["minimum", "maximum"]]
    scales: dict[str, float]
    goals: list[Term]
    constraints: list[Limit]
    robust: dict[str, str | None] | None
    effort: dict[str, Any]
    before: Setting
    after: Setting
    starts: list[Start]
    runs: int
    remarks: list[str]
    problem: Problem = field(compare=False, repr=False)

    @property
    def lines(self) -> list[str]:
        """The gains found, as overrides ``PATH=VALUE`` to paste."""
        return self.problem.lines(self.after.gains)


_DIFFERENT = 0.1
"""Fraction of the way between the bounds from which on two starts are said to have ended in different places."""
_COURSE = "Left: the best objective so far in each start. Right: where the gains lie between their bounds."


@in_units(lambda problem, *_: problem.scenario.device.shown)
def finding_of(
    problem: Problem, scales: dict[str, float], before: Setting, after: Setting, starts: list[Start], runs: int
) -> Finding[Tuned]:
    """Return what a search came to; it has passed where the gains satisfy all constraints, over fresh draws too."""
    ends = {gain.path: gain.bound_reached(after.gains[gain.path]) for gain in problem.searched}
    reached = {path: bound for path, bound in ends.items() if bound is not None}
    overrides = over(problem.overrides, problem.lines(after.gains), valve=problem.scenario.device.valve_name)
    sentence, remarks = verdict(problem, before, after), _remarks(problem, after, starts, runs, reached)
    return Finding(
        name="tune",
        kicker="Tuning",
        title=problem.name,
        said=(sentence, *([problem.description] if problem.description else [])),
        parts=(
            _gains(problem, after, reached),
            Part(
                "Before and after",
                _metrics(problem, before, after),
                panels=partial(_task, before, after),
                name="task",
                caption="The nominal device.",
                size=(6.9, 2.1),
            ),
            Part(
                "The search",
                remarks=remarks,
                panels=partial(_search_panels, problem, before, after, starts),
                name="search",
                caption=_COURSE,
                across=2,
                size=(4.4, max(2.6, 0.9 + 0.4 * len(problem.searched))),
            ),
            Part("To use the gains", code=_command(problem, overrides)),
        ),
        found=Tuned(
            tuning=problem.name,
            scenario=problem.scenario.name,
            verdict=sentence,
            is_feasible=after.is_feasible,
            overrides=list(overrides),
            bounds_reached=reached,
            scales=scales,
            goals=list(problem.goals),
            constraints=list(problem.constraints),
            robust=None
            if problem.spread is None
            else {"study": problem.spread.study or None, "measure": problem.spread.measure},
            effort=problem.effort.model_dump(),
            before=before,
            after=after,
            starts=starts,
            runs=runs,
            remarks=remarks,
            problem=problem,
        ),
        passed=after.is_feasible,
        files={"overrides.txt": partial(_overrides_file, problem, overrides, sentence)},
    )


def _gains(problem: Problem, after: Setting, reached: Mapping[str, str]) -> Part:
    """Return a row for each gain, before and after, in its bounds; ``reached`` says at which bound it ended."""
    rows = []
    for gain in problem.searched:
        numbers = (gain.before, after.gains[gain.path], gain.minimum, gain.maximum)
        end = f"at its {reached[gain.path]}" if gain.path in reached else ""
        rows.append((gain.path, *map(gain.place.quote, numbers), end))
    return Part("Gains", columns_of(("gain", "before", "after", "minimum", "maximum", ""), rows))


def _verb(problem: Problem) -> str:
    return "walk" if problem.scenario.walks else "simulate"


def _options(overrides: Sequence[str]) -> str:
    return " ".join(f'--set "{override}"' for override in overrides)


def _command(problem: Problem, overrides: Sequence[str]) -> str:
    """Return the command that runs the scenario with the gains that were found."""
    scenario = problem.scenario.origin.file or problem.scenario.name
    return f"ppafo {_verb(problem)} {scenario} {_options(overrides)}"


def _overrides_file(problem: Problem, overrides: Sequence[str], sentence: str) -> bytes:
    """Return lines to paste into a command, a study file or Python, under what the search came to."""
    listed, name = ", ".join(f'"{override}"' for override in overrides), problem.scenario.name
    # The second argument of a walk has a name.
    given = f"overrides=[{listed}]" if problem.scenario.walks else f"[{listed}]"
    return (
        f"# {sentence}\n\n# on the command line\n{_options(overrides)}\n\n# in a study file\noverrides = [{listed}]\n\n"
        f"# in Python\nppafo.{_verb(problem)}({name!r}, {given})\n"
    ).encode()


def verdict(problem: Problem, before: Setting, after: Setting) -> str:
    """Return the result of a search for gains in a sentence."""
    name = problem.name
    if after.share_without_value:
        failing = percentage(after.share_without_value, 3)
        return (
            f"{name}: with the best gains found, {failing} of the runs fail, oscillate, or lack a goal or a constraint"
        )
    if not after.is_feasible_in_search:
        broken = f"the best found exceed the limits by {percentage(after.violation, 3)}"
        return f"{name}: no gains within the bounds satisfy all constraints; {broken}{_by_ceiling(problem, after)}"
    if not after.is_feasible:
        return (
            f"{name}: the gains found satisfy all constraints over the draws of the search, but not over "
            f"{FRESH_DRAWS:,} fresh ones{_by_ceiling(problem, after)}"
        )
    if not before.is_feasible:
        return (
            f"{name}: the gains found satisfy all constraints, which the previous gains did not; objective "
            f"{after.objective:.4g}"
        )
    # Beyond a bound the gains before are no candidates, and the best within may be worse.
    if after.objective >= before.objective:
        return f"{name}: nothing better than the previous gains was found within the bounds"
    change = (after.objective - before.objective) / abs(before.objective) if before.objective else math.nan
    return f"{name}: objective {before.objective:.4g} before, {after.objective:.4g} after ({100.0 * change:+.3g} %)"


def _by_ceiling(problem: Problem, after: Setting) -> str:
    """Return that the torque ceiling is why, where the draws below it are what breaks the constraints."""
    ceiling = after.torque_ceiling
    if not ceiling.explains:
        return ""
    where = "" if problem.spread is None else f" in {percentage(ceiling.fraction, 2)} of the draws"
    return (
        "; the torque ceiling is the cause: the reference requires more than the torque constant times the gauge "
        f"pressure of the supply{where}, which no gains can change"
    )


def _metrics(problem: Problem, before: Setting, after: Setting) -> list[Column]:
    """Return a row for each metric of the goals and constraints."""
    names, spread = problem.metrics, problem.spread
    limits = [
        ", ".join(constraint.words for constraint in problem.constraints if constraint.metric == name) for name in names
    ]

    def column(title: str, values: Mapping[str, float]) -> Column:
        return Column(title, [_number(name, values.get(name)) for name in names])

    kinds = {name: of_metric(name) for name in names}
    titles = [f"{name} ({kind.shown_unit})" if kind.quantity else name for name, kind in kinds.items()]
    metric, constraint = Column("metric", titles), Column("constraint", limits)
    if spread is None:
        return [metric, column("before", before.values), column("after", after.values), constraint]
    nominal = [{name: metric.value for name, metric in side.metrics.items()} for side in (before, after)]
    return [
        metric,
        column(f"before ({spread.measure})", before.values),
        column("after", after.values),
        column("before, fresh draws", before.fresh),
        column("after, fresh draws", after.fresh),
        constraint,
        column("before, nominal", nominal[0]),
        column("after, nominal", nominal[1]),
    ]


def _remarks(
    problem: Problem, after: Setting, starts: Sequence[Start], runs: int, reached: Mapping[str, str]
) -> list[str]:
    """Return how the search went and what it leaves open."""
    settled = sum(start.is_settled for start in starts)
    said = [
        f"{count_of(len(starts), 'start')}, {sum(start.candidates for start in starts):,} "
        f"candidates, {runs:,} runs; {settled} of {len(starts)} converged before the maximum number of "
        "generations"
    ]
    for path, bound in reached.items():
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
        drawn = f"study '{spread.study}'" if spread.study else "the sensor noise"
        said.append(
            f"every candidate ran over the same {spread.draws} draws of {drawn}; 'fresh' is over {FRESH_DRAWS:,} "
            "draws that the search did not use"
        )
    fractions = ", ".join(f"{name} {fraction_text(fraction)}" for name, fraction in after.share_of_noise.items())
    if fractions:
        said.append(f"fraction of the variance over the fresh draws that is due to sensor noise: {fractions}")
    broken = [
        f"{constraint.metric} {constraint.words}, it is {_number(constraint.metric, after.fresh[constraint.metric])}"
        for constraint in problem.constraints
        if constraint.metric in after.fresh and not constraint.is_kept(after.fresh[constraint.metric])
    ]
    if after.fresh and after.fresh_share_without_value:
        broken.append(f"{percentage(after.fresh_share_without_value, 2)} of the runs fail, oscillate or lack a metric")
    return [*said, *(f"violated on fresh draws: {text}" for text in broken)]


def _number(name: str, value: float | None) -> str:
    return "" if value is None or math.isnan(value) else of_metric(name).number(value)


_SHOWN = (
    ("command", Kind("Valve command")),
    ("supplied_mass", Kind("Gas supplied", "kg", "gas mass")),
)


def _task(before: Setting, after: Setting) -> list[Panel]:
    """Return what is controlled, command and gas over time with the gains before and after, on the nominal device."""
    panels = []
    controlled = controlled_in(after.result.recording) or CONTROLLED[TORQUE]
    words, unit = controlled.words, controlled.level.unit
    lead = (controlled.channel, Kind(words[:1].upper() + words[1:], unit, quantity_of_unit(unit)))
    for row, (channel, kind) in enumerate((lead, *_SHOWN)):
        marks = []
        for setting, colour, label in ((before, VERMILION, "before"), (after, BLUE, "after")):
            recording = setting.result.recording
            style = {"linewidth": 1.3, "drawstyle": "steps-post" if channel == "command" else "default"}
            marks.append(Mark("line", recording.time, recording[channel], label=label, colour=colour, style=style))
        recording = after.result.recording
        if not row and controlled.reference in recording:
            dashed = {"linestyle": "--", "linewidth": 1.2}
            reference = Mark("line", recording.time, recording[controlled.reference], (), "reference", BLACK, dashed)
            marks.append(reference)
        panels.append(Panel(TIME, kind, marks, legend="" if row else "above"))
    return panels


def _search_panels(problem: Problem, before: Setting, after: Setting, starts: Sequence[Start]) -> list[Panel]:
    return [_course(before, starts), _places(problem, after, starts)]


def _course(before: Setting, starts: Sequence[Start]) -> Panel:
    """Return the cost of each start over its generations."""
    marks = []
    for number, start in enumerate(starts):
        costs = np.array(start.generations)
        costs[costs >= INFEASIBLE] = np.nan  # no candidate keeps the constraints yet
        colour = COLOURS[number % len(COLOURS)]
        marks.append(Mark("line", np.arange(costs.size), costs, colour=colour, style={"linewidth": 1.3}))
    dashed = {"linestyle": "--", "linewidth": 1.0}
    marks.append(Mark("level", (), before.objective, colour=GREY, style=dashed))

    def scale(axes: "Axes") -> None:
        if axes.dataLim.ymin > 0.0:
            axes.set_yscale("log")

    return Panel(Kind("Generation"), Kind(), marks, "Objective, best so far; dashed: before", then=scale)


def _places(problem: Problem, after: Setting, starts: Sequence[Start]) -> Panel:
    """Return where the gains lie between their bounds: before, after, and where each start ended."""
    searched = problem.searched
    rows = np.arange(len(searched))[::-1]
    ends = [
        gain.fraction(float(gain.value(np.array(start.fractions[row]))))
        for start in starts
        for row, gain in enumerate(searched)
    ]
    first = [float(np.clip(gain.fraction(gain.before), -0.05, 1.05)) for gain in searched]
    last = [gain.fraction(after.gains[gain.path]) for gain in searched]
    dots: dict[str, Any] = {"linestyle": "", "marker": "o", "markersize": 7}
    ticks: dict[str, Any] = {"linestyle": "", "marker": "|", "markersize": 11}
    marks = (
        *(Mark("line", [0.0, 1.0], [row, row], colour=GREY, style={"linewidth": 1.0}) for row in rows),
        Mark("line", ends, np.tile(rows, len(starts)), colour=GREY, style=ticks),
        Mark("line", first, rows, label="before", colour=VERMILION, style=dots),
        Mark("line", last, rows, label="after", colour=BLUE, style=dots),
    )

    def name_gains(axes: "Axes") -> None:
        axes.set_yticks(rows, [label_of(gain.path) for gain in searched])
        axes.set_ylim(-0.6, len(searched) - 0.4)
        axes.set_xticks([0.0, 1.0], ["minimum", "maximum"])

    return Panel(Kind(), Kind(), marks, "Between bounds", then=name_gains)
