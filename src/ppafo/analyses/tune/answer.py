"""Report of a tuning: gains and metrics before and after, convergence of the search, and overrides to paste."""

import json
import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.analyses.tune.problem import Problem
from ppafo.analyses.tune.result import FRESH_DRAWS, INFEASIBLE, GainResult, SearchStart, Tuned, agreement
from ppafo.loading import reloaded, usage_text
from ppafo.metrics.metric import controlled_in
from ppafo.model.controlled import CONTROLLED, TORQUE
from ppafo.report.finding import Column, Finding, Section, columns_of
from ppafo.report.kind import TIME, Kind, of_metric
from ppafo.report.panels import Mark, Panel
from ppafo.report.setting_names import label_of
from ppafo.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILION
from ppafo.simulation.tracking.pair_step import coarse_pair
from ppafo.studies.intervals import fraction_text
from ppafo.units.shown import in_units, quantity_of_unit
from ppafo.wording import count_of, percentage, without_exponent

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Figures of a tuning: the task before and after, the course of the search, and the gains between their bounds.

_COMMAND, _GAS = Kind("Valve command"), Kind("Gas supplied", "kg", "gas mass")
_DECADE = 10.0
_START_LINES: tuple[tuple[str, Any], ...] = (
    (GREEN, "--"),
    (PURPLE, ":"),
    (ORANGE, "-."),
    (GREY, (0, (6, 1, 1, 1, 1, 1))),
)
"""Colours and dashes of the starts of a search; the gains before and after have other colours."""
_BEYOND = 0.05
"""Fraction of the range by which previous gains outside the bounds are plotted beyond the bounds, at most."""


def task_panels(before: GainResult, after: GainResult) -> list[Panel]:
    """Return panels of controlled quantity, command and gas over time, before and after, for the nominal device."""
    recording = after.result.recording
    controlled = controlled_in(recording) or CONTROLLED[TORQUE]
    words, unit = controlled.words, controlled.level.unit
    level = Kind(words[:1].upper() + words[1:], unit, quantity_of_unit(unit))
    followed = _traces(controlled.name, before, after)
    if controlled.reference in recording:
        dashed = {"linestyle": "--", "linewidth": 1.2}
        reference = recording[controlled.reference]
        followed.append(Mark("line", recording.time, reference, label="reference", colour=BLACK, style=dashed))
    return [
        Panel(TIME, level, followed, legend="figure", shares_x=True),
        Panel(TIME, _COMMAND, _traces("command", before, after), legend="", shares_x=True),
        Panel(TIME, _GAS, _traces("supplied_mass", before, after), legend="", shares_x=True),
    ]


def _traces(channel: str, before: GainResult, after: GainResult) -> list[Mark]:
    """Return the curves of a channel over time, with the gains before and after tuning."""
    marks = []
    # Broader below, so that both show where they agree.
    for setting, colour, label, width in ((before, VERMILION, "before", 1.8), (after, BLUE, "after", 1.1)):
        recording = setting.result.recording
        style = {"linewidth": width, "drawstyle": "steps-post" if channel == "command" else "default"}
        marks.append(Mark("line", recording.time, recording[channel], label=label, colour=colour, style=style))
    return marks


def search_panels(
    problem: Problem, before: GainResult, after: GainResult, starts: Sequence[SearchStart]
) -> list[Panel]:
    """Return panels of the best cost of each start over its generations, and of the gains between their bounds."""
    costs_of_starts = []
    for number, start in enumerate(starts):
        costs = np.array(start.generations)
        costs[costs >= INFEASIBLE] = np.nan  # no candidate keeps the constraints yet
        colour, dashes = _START_LINES[number % len(_START_LINES)]
        label = f"start {number + 1}" if len(starts) <= len(_START_LINES) else ""
        style = {"linewidth": 1.3, "linestyle": dashes}
        costs_of_starts.append(Mark("line", np.arange(costs.size), costs, label=label, colour=colour, style=style))
    thin = {"linewidth": 0.8}
    costs_of_starts.append(Mark("level", y=before.objective, label="before", colour=BLACK, style=thin))

    def scale(axes: "Axes") -> None:
        axes.locator_params(axis="x", integer=True)
        # Below a decade a logarithmic axis has no tick that reads as a number.
        if axes.dataLim.ymax > _DECADE * axes.dataLim.ymin > 0.0:
            axes.set_yscale("log")

    searched = problem.searched
    rows = np.arange(len(searched))[::-1]
    ends = [
        gain.fraction(float(gain.value(np.array(start.fractions[row]))))
        for start in starts
        for row, gain in enumerate(searched)
    ]
    previous = [float(np.clip(gain.fraction(gain.before), -_BEYOND, 1.0 + _BEYOND)) for gain in searched]
    tuned = [gain.fraction(after.gains[gain.path]) for gain in searched]
    dots: dict[str, Any] = {"linestyle": "", "marker": "o", "markersize": 7}
    ticks: dict[str, Any] = {"linestyle": "", "marker": "|", "markersize": 11}
    marks = (
        *(Mark("line", [0.0, 1.0], [row, row], colour=GREY, style={"linewidth": 1.0}) for row in rows),
        Mark("line", ends, np.tile(rows, len(starts)), label="end of a start", colour=BLACK, style=ticks),
        Mark("line", previous, rows, label="before", colour=VERMILION, style={**dots, "marker": "s"}),
        Mark("line", tuned, rows, label="after", colour=BLUE, style=dots),
    )

    names, ends_of_axis = [label_of(gain.path) for gain in searched], ["minimum", "maximum"]
    every = {"yticks": rows, "yticklabels": names, "ylim": (-0.6, len(searched) - 0.4), "xticks": [0.0, 1.0]}
    return [
        Panel(Kind("Generation"), Kind(), costs_of_starts, "Objective, best so far", legend="inside", then=scale),
        Panel(Kind("Between bounds"), Kind(), marks, then=lambda axes: axes.set(**every, xticklabels=ends_of_axis)),
    ]


_DIFFERENT = 0.1
"""Difference as a fraction of the range above which two starts count as ended at different gains."""
_SEARCH_CAPTION = (
    "Above: the best objective so far in each start. Below: where the gains lie between their bounds; a gain "
    "before that is beyond a bound is drawn beside it."
)


@in_units(lambda tuned: tuned.problem.scenario.device.shown)
def finding_of(tuned: Tuned) -> Finding[Tuned]:
    """Return the result of a tuning as a finding; it has passed if the gains satisfy all constraints."""
    problem, before, after = tuned.problem, tuned.before, tuned.after
    scenario, reached = problem.scenario, tuned.bounds_reached
    rows = []
    for gain in problem.searched:
        numbers = (gain.before, after.gains[gain.path], gain.minimum, gain.maximum)
        end = f"at its {reached[gain.path]}" if gain.path in reached else ""
        rows.append((gain.path, *map(gain.place.quote, numbers), end))
    # The scenario's file, or the name of one that comes with the package, finds it again.
    name, motion_kind = scenario.origin.file or scenario.name, scenario.motion.motion_kind
    # Texts of TOML and of Python alike.
    used = usage_text(reloaded(scenario, problem.lines(after.gains)))
    listed = ", ".join(json.dumps(line, ensure_ascii=False) for line in tuned.overrides)
    pasted = (
        f"# {tuned.verdict}\n\n# on the command line\n{used}\n\n# in a study file\noverrides = [{listed}]\n\n"
        f"# in Python\n{motion_kind.python_call.format(name=name, overrides=listed)}\n"
    )
    return Finding(
        name="tune",
        kicker="Tuning",
        title=problem.name,
        said=(tuned.verdict, *([problem.description] if problem.description else [])),
        parts=(
            Section("Gains", columns_of(("gain", "before", "after", "minimum", "maximum", ""), rows)),
            Section(
                "Before and after",
                _metric_columns(problem, before, after),
                panels=partial(task_panels, before, after),
                name="task",
                caption="The nominal device.",
                size=(5.4, 1.9),
            ),
            Section(
                "The search",
                remarks=tuned.remarks,
                panels=partial(search_panels, problem, before, after, tuned.starts),
                name="search",
                caption=_SEARCH_CAPTION,
                size=(5.4, max(2.2, 0.9 + 0.3 * len(problem.searched))),
            ),
            Section("To use the gains", code=used),
        ),
        found=tuned,
        passed=after.is_feasible and not after.useless,
        files={"overrides.txt": pasted.encode},
        overrides=problem.changes,
    )


def verdict(problem: Problem, before: GainResult, after: GainResult) -> str:
    """Return the result of a tuning as a sentence."""
    name = problem.name
    if after.share_without_value:
        failing = percentage(after.share_without_value, 3)
        return f"{name}: with the best gains found, {failing} of the runs fail, oscillate, or lack a required metric"
    if after.off:
        where = _in_draws(problem, after.share_off)
        beyond = f"the tracking limits are exceeded by {percentage(after.off, 3)}{where}"
        why = f"{after.useless or beyond}{_by_ceiling(problem, after)}"
        return f"{name}: no gains within the bounds let the loop follow its reference; with the best gains found, {why}"
    if not after.is_feasible_in_search:
        broken = f"the best gains found exceed the limits by {percentage(after.violation, 3)}"
        return f"{name}: no gains within the bounds satisfy all constraints; {broken}{_by_ceiling(problem, after)}"
    if not after.is_feasible:
        return (
            f"{name}: the gains found satisfy all constraints over the draws of the search, but not over "
            f"{FRESH_DRAWS:,} fresh draws{_by_ceiling(problem, after)}"
        )
    if after.useless:
        return f"{name}: with the best gains found, {after.useless}"
    return f"{name}: {_change(problem, before, after)}"


def _in_draws(problem: Problem, fraction: float) -> str:
    """Return the end of a clause on a fraction of the draws; empty without draws."""
    return "" if problem.spread is None else f" in {percentage(fraction, 2)} of the draws"


def _change(problem: Problem, before: GainResult, after: GainResult) -> str:
    """Return a sentence on the improvement, for gains that satisfy all constraints."""
    if before.off:
        missed = f"with the previous gains it did not{_in_draws(problem, before.share_off)}"
        return f"the loop follows its reference, {missed}; objective {after.objective:.4g}"
    if not before.is_feasible:
        return (
            "the gains found satisfy all constraints, which the previous gains did not; objective "
            f"{after.objective:.4g}"
        )
    # Beyond a bound the gains before are no candidates, and the best within may be worse.
    if after.objective >= before.objective:
        return "nothing better than the previous gains was found within the bounds"
    words = f"objective {before.objective:.4g} before, {after.objective:.4g} after"
    if before.objective == 0.0:
        return words
    change = 100.0 * (after.objective - before.objective) / abs(before.objective)
    return f"{words} ({without_exponent(change, '+.3g')} %)"


def _by_ceiling(problem: Problem, after: GainResult) -> str:
    """Return a clause on the torque ceiling if it explains the violated constraints; empty otherwise."""
    ceiling = after.torque_ceiling
    if not ceiling.explains:
        return ""
    return (
        "; the torque ceiling is the cause: the reference requires more torque than the actuator gives at the supply "
        f"pressure{_in_draws(problem, ceiling.fraction)}, which no gains can change"
    )


def _metric_columns(problem: Problem, before: GainResult, after: GainResult) -> list[Column]:
    """Return the columns of a table with a row for each metric of the goals and constraints."""
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


def remarks_of(
    problem: Problem, after: GainResult, starts: Sequence[SearchStart], runs: int, reached: Mapping[str, str]
) -> list[str]:
    """Return remarks on convergence, bounds that were reached, ambiguous gains, draws and violated constraints."""
    settled = sum(start.is_settled for start in starts)
    remarks = [
        f"{count_of(len(starts), 'start')}, {sum(start.candidates for start in starts):,} "
        f"candidates, {runs:,} runs; {settled} of {len(starts)} converged before the maximum number of "
        "generations"
    ]
    remarks += filter(None, (coarse_pair(problem.scenario, problem.before), problem.scenario.origin.replaced))
    for path, bound in reached.items():
        remarks.append(
            f"{path} ended at its {bound}: a better value may lie beyond; widen the bounds if the device allows it"
        )
    difference = agreement(starts)
    if difference > _DIFFERENT:
        remarks.append(
            f"starts whose objectives agree within 1 % differ by up to {100.0 * difference:.0f} % of the range between "
            "the bounds: the objective does not determine the gains uniquely"
        )
    spread = problem.spread
    if spread is not None:
        drawn = f"study '{spread.study}'" if spread.study else "the sensor noise"
        remarks.append(
            f"every candidate ran over the same {spread.draws} draws of {drawn}; 'fresh' is over {FRESH_DRAWS:,} "
            "draws that the search did not use"
        )
    fractions = ", ".join(f"{name} {fraction_text(fraction)}" for name, fraction in after.share_of_noise.items())
    if fractions:
        remarks.append(f"fraction of the variance over the fresh draws that is due to sensor noise: {fractions}")
    broken = [
        f"{constraint.metric} is {_number(constraint.metric, after.judged[constraint.metric])}, not {constraint.words}"
        for constraint in problem.constraints
        if after.fresh and not constraint.is_kept(after.judged[constraint.metric])
    ]
    printed = after.fresh or after.values
    remarks += [
        f"the loop still oscillates in the second half of the hold, so {name} depends on the instant: the RMS error of "
        f"that half, {_number(name, judged)}, counts instead"
        for name, judged in after.judged.items()
        if judged > printed[name]
    ]
    if after.fresh and after.fresh_share_without_value:
        broken.append(f"{percentage(after.fresh_share_without_value, 2)} of the runs fail, oscillate or lack a metric")
    return [*remarks, *(f"violated on fresh draws: {text}" for text in broken)]


def _number(name: str, value: float | None) -> str:
    return "" if value is None or math.isnan(value) else of_metric(name).number(value)
