"""The answer of a comparison: a table for each task, paired statistics, error against gas, the changes."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import (
    display_difference,
    display_unit,
    display_values,
    metric_column,
    metric_quantity,
    metric_title,
    metric_words,
)
from ppafo.answers.style import (
    BLACK,
    COLOURS,
    GREY,
    Margins,
    figure_of_free_panels,
    house_style,
    label_lines,
    mark_kind,
)
from ppafo.live.workbench import live_part
from ppafo.metrics import Metric
from ppafo.questions.question import Solved
from ppafo.simulation.scenario import Scenario, plain
from ppafo.simulation.simulate import Status
from ppafo.studies.distributions import (
    FEWEST_EFFECTIVE,
    Floats,
    Interval,
    effective_sample_size,
    fraction_interval,
    fraction_text,
    noise_interval,
    replicates_interval,
)
from ppafo.studies.draws import REPLICATES, Outcomes

if TYPE_CHECKING:
    import matplotlib.figure
    from matplotlib.axes import Axes

Masks = NDArray[np.bool_]
OUTER_QUANTILES = (0.05, 0.95)
"""The quantiles over the draws that tables show beside a median."""


@dataclass(frozen=True, slots=True)
class Paired:
    """One metric of a configuration against that of the baseline, over the pairs in which both have it.

    ``difference`` is the mean of configuration less baseline [SI] with its confidence interval; ``change`` the median
    over the draws of the same as a fraction of the baseline (nan where that is 0), ``change_low`` and ``change_high``
    its 5 and 95 % quantiles: how uncertain the change is, however many draws are made. ``better`` is the probability
    that the configuration is better in a draw, with its confidence interval: how well that is known from these draws;
    None where neither end of the metric is better. ``equal`` is the fraction of draws in which both are the same.
    ``effective_size`` is how many pairs determine the mean difference, ``noise`` the fraction of the variance of the
    difference that is due to sensor noise, None where there is none.
    """

    metric: str
    pairs: int
    difference: Interval
    change: float
    change_low: float
    change_high: float
    better: Interval | None
    equal: float
    effective_size: float
    noise: Interval | None = None


def pareto_front(points: Floats) -> Masks:
    """Return which points (points, goals) are not dominated: no other is at least as low in all goals, lower in one."""
    front = np.zeros(len(points), dtype=np.bool_)
    for row, point in enumerate(points):
        if np.all(np.isfinite(point)):
            is_dominating = np.all(points <= point, axis=1) & np.any(points < point, axis=1)
            front[row] = not bool(np.any(is_dominating))
    return front


def compare_pairs(
    metric: str,
    baseline: Floats,
    other: Floats,
    better: int,
    confidence: float,
    other_noise: tuple[Floats, Floats] | None = None,
) -> Paired | None:
    """Return the statistics of values (draws,) [SI], nan where there is none; None without any pair.

    The draws are dealt out to replicates in turn. ``other_noise`` are both again, for the first draws with other noise.
    ``better`` is -1 where less is better, 1 where more is, 0 where neither is. A draw in which both are the same counts
    for neither.
    """
    both = np.isfinite(baseline) & np.isfinite(other)
    first, second = baseline[both], other[both]
    if first.size == 0:
        return None
    change = (second - first)[first != 0.0] / np.abs(first[first != 0.0])
    low, middle, high = (
        np.quantile(change, (OUTER_QUANTILES[0], 0.5, OUTER_QUANTILES[1])) if change.size else (np.nan,) * 3
    )
    difference = other - baseline
    noise = None
    if other_noise is not None:
        again = other_noise[1] - other_noise[0]
        noise = noise_interval(difference[: again.size], again, confidence)
    wins = int(np.count_nonzero(better * (second - first) > 0.0))
    return Paired(
        metric=metric,
        pairs=first.size,
        difference=replicates_interval(difference, REPLICATES, confidence),
        change=float(middle),
        change_low=float(low),
        change_high=float(high),
        better=fraction_interval(wins, first.size, confidence) if better else None,
        equal=float(np.mean(first == second)),
        effective_size=effective_sample_size(second - first),
        noise=noise,
    )


def best_probabilities(values: Sequence[Floats], better: int, confidence: float) -> list[Interval]:
    """Return the probability of each configuration to be the best in a draw; ties count for all of them."""
    table = better * np.stack(values)
    table = table[:, np.all(np.isfinite(table), axis=0)]
    draws = table.shape[1]
    if draws == 0:
        return []
    is_best = table == np.max(table, axis=0)
    return [fraction_interval(int(np.count_nonzero(row)), draws, confidence) for row in is_best]


COMPARED: dict[str, int] = {
    "rms_error": -1,
    "rms_error_ramp": -1,
    "rms_error_hold": -1,
    "peak_error": -1,
    "gas_supplied": -1,
    "mechanical_work": 0,
    "gas_per_work": -1,
    "switchings": -1,
    "gas": -1,
    "positive_push_off_work": 1,
    "net_push_off_work": 1,
    "push_off_error": -1,
    "toe_clearance": 1,
    "stays_up": 1,
    "lowest_toes": 1,
    "muscle_work": -1,
}
"""Metrics of the table: -1 where less is better, 1 where more is, 0 where neither is better as such."""


@dataclass(frozen=True, slots=True)
class Case:
    """A configuration on a task: its metrics by name, how the run ended, and its runs over the draws, if any.

    ``renoised`` are the first draws again, each with another noise stream; None where no controller receives noise.
    """

    task: str
    configuration: str
    scenario: Scenario
    metrics: Mapping[str, Metric]
    status: Status
    outcomes: Outcomes | None
    renoised: Outcomes | None = None


@dataclass(frozen=True, slots=True, repr=False)
class Comparison(Solved):
    """All cases, task by task in the order of the configurations, one of which is the ``baseline``.

    ``draws`` is 0 without uncertainty; ``varied`` are the uncertain paths but the noise; ``confidence`` is that of
    the intervals.
    """

    metrics: tuple[str, ...]
    configurations: tuple[str, ...]
    baseline: str
    tasks: Mapping[str, tuple[str, ...]]
    cases: tuple[Case, ...]
    draws: int
    seed: int
    varied: tuple[str, ...]
    confidence: float

    def of_task(self, task: str) -> tuple[Case, ...]:
        """Return the cases of a task."""
        return tuple(case for case in self.cases if case.task == task)

    def pairs(self, task: str, configuration: str) -> list[Paired]:
        """Return the statistics of a configuration against the baseline on a task; none without uncertainty."""
        baseline, other = (self._case(task, name) for name in (self.baseline, configuration))
        first, second = baseline.outcomes, other.outcomes
        if first is None or second is None:
            return []
        again: dict[str, tuple[Floats, Floats]] = {}
        if baseline.renoised is not None and other.renoised is not None:
            sides = (baseline.renoised.metrics, other.renoised.metrics)
            again = {name: (sides[0][name], sides[1][name]) for name in self.metrics}
        found = [
            compare_pairs(
                name, first.metrics[name], second.metrics[name], COMPARED[name], self.confidence, again.get(name)
            )
            for name in self.metrics
        ]
        return [item for item in found if item is not None]

    def best(self, task: str, metric: str) -> dict[str, Interval]:
        """Return the probability of each configuration to be the best in a metric on a task."""
        drawn = [self._case(task, name).outcomes for name in self.configurations]
        values: list[Floats] = [item.metrics[metric] for item in drawn if item is not None]
        if len(values) < len(drawn) or not COMPARED[metric]:
            return {}
        return dict(
            zip(self.configurations, best_probabilities(values, COMPARED[metric], self.confidence), strict=False)
        )

    def _case(self, task: str, configuration: str) -> Case:
        return next(case for case in self.of_task(task) if case.configuration == configuration)


_MARKS = "osD^vP"
_ERROR, _GAS = "rms_error", "gas_supplied"
_MAXIMUM_DOTS = 1500
_WIDTH, _PANEL = 7.2, 2.9
_MARGINS = Margins(left=0.75, right=0.2, top=0.55, bottom=0.55, row_gap=0.95, column_gap=0.6)
_BINS = 40
_SHOWN = (0.5, 99.5)
"""Percentiles between which changes are drawn: a few far ones would make all others one bar."""


def has_errors(comparison: Comparison) -> bool:
    """Tell whether there is an error to draw: controllers without a reference have none."""
    return _ERROR in comparison.metrics


def pareto_figure(comparison: Comparison) -> "matplotlib.figure.Figure":
    """Return error against gas, a panel for each task."""
    tasks = list(comparison.tasks)
    height = _MARGINS.top + len(tasks) * _PANEL + (len(tasks) - 1) * _MARGINS.row_gap + _MARGINS.bottom
    with house_style():
        figure, grid = figure_of_free_panels((_WIDTH, height), _MARGINS, len(tasks), 1)
        for task, (axes,) in zip(tasks, grid, strict=True):
            _draw_pareto(axes, comparison, task)
        mark_kind(figure, "simulated")
        return figure


def change_figure(comparison: Comparison) -> "matplotlib.figure.Figure":
    """Return histograms of the change against the baseline, error left and gas right."""
    tasks = list(comparison.tasks)
    height = _MARGINS.top + len(tasks) * 2.2 + (len(tasks) - 1) * _MARGINS.row_gap + _MARGINS.bottom
    with house_style():
        figure, grid = figure_of_free_panels((_WIDTH, height), _MARGINS, len(tasks), 2)
        for task, row in zip(tasks, grid, strict=True):
            for metric, axes in zip((_ERROR, _GAS), row, strict=True):
                _draw_change(axes, comparison, task, metric)
            row[0].set_ylabel("Draws")
        mark_kind(figure, "simulated")
        return figure


def _draw_pareto(axes: "Axes", comparison: Comparison, task: str) -> None:
    cases = [case for case in comparison.of_task(task) if case.status.is_completed]
    points = np.array([_point(case) for case in cases]).reshape(-1, 2)
    for number, case in enumerate(cases):
        colour, mark = COLOURS[number % len(COLOURS)], _MARKS[number % len(_MARKS)]
        if case.outcomes is not None:
            gas = _in_display_unit(case.outcomes.metrics[_GAS][:_MAXIMUM_DOTS], _GAS)
            error = _in_display_unit(case.outcomes.metrics[_ERROR][:_MAXIMUM_DOTS], _ERROR)
            axes.plot(gas, error, ".", color=colour, alpha=0.35, markersize=4, markeredgewidth=0)
        axes.plot(*points[number], mark, color=colour, markersize=8, markeredgecolor="white", label=case.configuration)
    front = points[pareto_front(points)]
    front = front[np.argsort(front[:, 0])]
    axes.plot(front[:, 0], front[:, 1], "-", color=GREY, linewidth=1.0, zorder=1)
    axes.set_xlabel(metric_title(_GAS))
    axes.set_ylabel(metric_title(_ERROR))
    axes.set_title(_task_title(comparison, task))
    axes.margins(0.08)
    # In the panel, where there is room: names beside the title ran over it.
    axes.legend(loc="best", frameon=True, framealpha=0.85, edgecolor="none")


def _task_title(comparison: Comparison, task: str) -> str:
    return f"Task: {task}" if len(list(comparison.tasks)) > 1 else ""


def _point(case: Case) -> tuple[float, float]:
    gas, error = (_in_display_unit(np.array([case.metrics[name].value]), name)[0] for name in (_GAS, _ERROR))
    return float(gas), float(error)


def _in_display_unit(values: Floats, name: str) -> Floats:
    return display_values(values, metric_quantity(name))


def _draw_change(axes: "Axes", comparison: Comparison, task: str, metric: str) -> None:
    cases = {case.configuration: case for case in comparison.of_task(task)}
    baseline = cases[comparison.baseline]
    ends: list[float] = []
    for number, name in enumerate(comparison.configurations):
        own, first = cases[name].outcomes, baseline.outcomes
        if name == comparison.baseline or own is None or first is None:
            continue
        colour = COLOURS[number % len(COLOURS)]
        change = _change(first.metrics[metric], own.metrics[metric])
        if change.size == 0:
            continue
        reach = np.percentile(change, _SHOWN)
        bins = min(_BINS, max(8, round(1.5 * change.size**0.5)))
        axes.hist(change, bins=bins, range=(reach[0], reach[1]), color=colour, alpha=0.55, label=name)
        ends += reach.tolist()
        if metric in baseline.metrics and metric in cases[name].metrics:
            nominal = _change(np.array([baseline.metrics[metric].value]), np.array([cases[name].metrics[metric].value]))
            for value in nominal:
                axes.axvline(value, color=colour, linestyle="--", linewidth=1.2, label="as declared")
            ends += nominal.tolist()
    if ends:
        # Zero is drawn where it is near: far from all changes it would squeeze them into a few pixels.
        low, high = min(ends), max(ends)
        span = high - low or 1.0
        axes.set_xlim(low - 0.08 * span, high + 0.08 * span)
        if low - 0.5 * span <= 0.0 <= high + 0.5 * span:
            axes.axvline(0.0, color=BLACK, linewidth=0.8)
            axes.set_xlim(min(low, 0.0) - 0.08 * span, max(high, 0.0) + 0.08 * span)
    axes.set_xlabel(f"{metric_words(metric)}, change from {comparison.baseline} (%)")
    axes.set_title(_task_title(comparison, task) if metric == _ERROR else "")
    if metric == _GAS:
        label_lines(axes)


def _change(baseline: Floats, other: Floats) -> Floats:
    both = np.isfinite(baseline) & np.isfinite(other) & (baseline != 0.0)
    return np.asarray(100.0 * (other[both] - baseline[both]) / np.abs(baseline[both]))


_PAIRED_HEAD = (
    "metric",
    "unit",
    "nominal change",
    "change over the draws: median (5 to 95 %)",
    "mean difference",
    "probability of being better",
)
_READING = (
    "The intervals of the mean difference and of the probability show how precisely the draws estimate them; they "
    "shrink with more draws. The change from 5 to 95 % of the draws shows the effect of the uncertain values; it "
    "does not shrink."
)
_NOISE = (
    "sensors are noisy: every draw has its own noise, the same in all configurations; the nominal change is "
    "one realisation"
)


def answer_of(comparison: Comparison) -> Answer:
    """Return the answer of a comparison."""
    names = comparison.configurations
    explained = (_READING,) if comparison.draws else ()
    pareto = (
        "Marks: the nominal device; dots: draws. The line joins the configurations that no other beats in "
        "both error and gas."
    )
    change = "Change against the baseline in each draw; the dashed line is the nominal device."
    sections = []
    if has_errors(comparison):
        drawn = Figure("pareto", pareto, lambda: pareto_figure(comparison))
        sections.append(Section("Error against gas", figure=drawn, is_detail=True))
    # Whether there are draws whose changes can be drawn.
    if comparison.draws > 0 and has_errors(comparison):
        drawn = Figure("change", change, lambda: change_figure(comparison))
        sections.append(Section("Spread of the change", figure=drawn, is_detail=True))
    return Answer(
        name="compare",
        kicker="Comparison",
        title=" and ".join(names) if len(names) == 2 else f"{len(names)} configurations against {comparison.baseline}",
        lead=(lead(comparison),),
        sections=(
            *(section for task in comparison.tasks for section in _task_sections(comparison, task)),
            *sections,
            Section(remarks=tuple(all_remarks(comparison))),
            Section("How to read it", explained, is_detail=True) if explained else Section(),
        ),
        data={
            "units": "SI: N m, kg, J; fractions from 0 to 1",
            "configurations": list(comparison.configurations),
            "baseline": comparison.baseline,
            "draws": comparison.draws,
            "seed": comparison.seed,
            "remarks": all_remarks(comparison),
            "varied": list(comparison.varied),
            "confidence": comparison.confidence,
            "tasks": [_task_document(comparison, task) for task in comparison.tasks],
        },
        passed=all(case.status.is_completed for case in comparison.cases),
        live=lambda: live_part([case.scenario for case in comparison.cases]),
    )


def _task_sections(comparison: Comparison, task: str) -> list[Section]:
    columns = (Column("configuration"), *map(metric_column, comparison.metrics), Column("status"))
    rows = tuple(
        (case.configuration, *(_value(case, name) for name in comparison.metrics), case.status.kind)
        for case in comparison.of_task(task)
    )
    # The head of the table of pairs: with the fraction of noise where a controller receives any.
    head = tuple(map(Column, (*_PAIRED_HEAD, "spread due to noise") if _has_noise(comparison) else _PAIRED_HEAD))
    where = "" if len(comparison.tasks) == 1 else f", {task}"
    paired = {name: paired_rows(comparison, task, name) for name in _others(comparison)}
    best = tuple(f"best: {text}" for text in best_sentences(comparison, task))
    return [
        Section(f"Task: {task}", table=Table(columns, rows)),
        *(
            Section(f"{name} against {comparison.baseline}{where}", table=Table(head, tuple(map(tuple, rows))))
            for name, rows in paired.items()
            if rows
        ),
        *([Section(remarks=best)] if best else []),
    ]


def _value(case: Case, name: str) -> float | None:
    metric = case.metrics.get(name)
    return None if metric is None else metric.value


def all_remarks(comparison: Comparison) -> list[str]:
    """Return what is not as one would expect: runs that failed, and configurations that do not do the same."""
    unlike = [_task_mismatch(comparison, task) for task in comparison.tasks]
    return [
        *(text for text in unlike if text),
        *(text for case in comparison.cases for text in _remarks(case)),
        *(text for task in comparison.tasks for text in _skewness_warnings(comparison, task)),
        *([_NOISE] if _has_noise(comparison) else []),
    ]


def lead(comparison: Comparison) -> str:
    """Return in a sentence what is compared over what."""
    count = len(comparison.configurations)
    tasks = f"{len(comparison.tasks)} task{'' if len(comparison.tasks) == 1 else 's'}"
    words = f"{count} configurations on {tasks}, baseline {comparison.baseline}"
    if not comparison.draws:
        return f"{words}; the nominal device, without uncertainty"
    if not comparison.varied:
        return f"{words}; the nominal device, over {comparison.draws:,} draws of the sensor noise"
    values = f"{len(comparison.varied)} uncertain value{'' if len(comparison.varied) == 1 else 's'}"
    noise = " and of the sensor noise" if _has_noise(comparison) else ""
    return (
        f"{words}; {comparison.draws:,} draws of {values}{noise}, the same for all; "
        f"each interval with {100.0 * comparison.confidence:g} % confidence"
    )


def paired_rows(comparison: Comparison, task: str, configuration: str) -> list[list[str]]:
    """Return a row for each metric: change without and with uncertainty, mean difference, probability of a gain."""
    cases = {case.configuration: case for case in comparison.of_task(task)}
    nominal = [cases[name].metrics for name in (comparison.baseline, configuration)]
    rows = []
    for item in comparison.pairs(task, configuration):
        said = [metrics[item.metric].value if item.metric in metrics else math.nan for metrics in nominal]
        noise = [] if item.noise is None else [fraction_text(item.noise)]
        rows.append([*_paired_row(item, *said), *(noise or ["-"] * _has_noise(comparison))])
    return rows


def best_sentences(comparison: Comparison, task: str) -> list[str]:
    """Return how probable each configuration is the best in error and in gas, where there are more than two."""
    if len(comparison.configurations) < 3:
        return []
    found = [
        (name, comparison.best(task, name)) for name in ("rms_error", "gas_supplied") if name in comparison.metrics
    ]
    return [
        f"{name}: "
        + ", ".join(f"{configuration} {_probability(fraction)}" for configuration, fraction in fractions.items())
        for name, fractions in found
        if fractions
    ]


def _others(comparison: Comparison) -> list[str]:
    return [name for name in comparison.configurations if name != comparison.baseline]


def _paired_row(item: Paired, baseline: float, other: float) -> list[str]:
    quantity = metric_quantity(item.metric)
    difference = [
        display_difference(value, quantity)
        for value in (item.difference.value, item.difference.low, item.difference.high)
    ]
    nominal = _percent((other - baseline) / abs(baseline)) if baseline else ""
    spread = f"{_percent(item.change)} ({_percent(item.change_low)} to {_percent(item.change_high)})"
    better = "" if item.better is None else "equal in all" if item.equal == 1.0 else _probability(item.better)
    shown = f"{difference[0]:+.3g} [{difference[1]:+.3g}, {difference[2]:+.3g}]"
    return [item.metric, display_unit(quantity), nominal, "" if math.isnan(item.change) else spread, shown, better]


def _percent(fraction: float) -> str:
    return "" if math.isnan(fraction) else f"{100.0 * fraction:+.3g} %"


def _probability(fraction: Interval) -> str:
    return f"{fraction.value:.4g} [{fraction.low:.4g}, {fraction.high:.4g}]"


def _remarks(case: Case) -> list[str]:
    remarks = [] if case.status.is_completed else [f"{case.configuration}, {case.task}: {case.status.message}"]
    if case.outcomes is not None and case.outcomes.failures:
        remarks.append(
            f"{case.configuration}, {case.task}: {case.outcomes.failures:,} of {case.outcomes.runs:,} draws failed "
            f"and are left out of every pair; the first: {case.outcomes.reason}"
        )
    return remarks


def _task_mismatch(comparison: Comparison, task: str) -> str:
    """Return a warning where a task asks another thing of some configurations."""
    references = {
        case.configuration: (case.scenario.reference, case.scenario.duration) for case in comparison.of_task(task)
    }
    others = [name for name, what in references.items() if what != references[comparison.baseline]]
    if not others:
        return ""
    return (
        f"task '{task}': {', '.join(others)} follow a different reference, or run for a different time, than "
        f"{comparison.baseline}: the differences come partly from the task"
    )


def _has_noise(comparison: Comparison) -> bool:
    return any(case.renoised is not None for case in comparison.cases)


def _skewness_warnings(comparison: Comparison, task: str) -> list[str]:
    """Return a warning for each mean difference that a few draws decide."""
    return [
        f"{name}, task '{task}': the mean difference of {item.metric} has an effective sample size of "
        f"{item.effective_size:.3g} of {item.pairs:,} draws: do not trust its interval; the probability of being "
        "better is not affected"
        for name in _others(comparison)
        for item in comparison.pairs(task, name)
        if item.effective_size < min(FEWEST_EFFECTIVE, 0.5 * item.pairs)
    ]


def _task_document(comparison: Comparison, task: str) -> dict[str, Any]:
    cases = comparison.of_task(task)
    goals = ("rms_error", "gas_supplied")
    points = np.array(
        [[case.metrics[name].value if name in case.metrics else np.nan for name in goals] for case in cases]
    )
    return {
        "task": task,
        "overrides": list(comparison.tasks[task]),
        "cases": [_case_document(case) for case in cases],
        "pareto_front": [
            case.configuration for case, is_front in zip(cases, pareto_front(points), strict=True) if is_front
        ],
        "pairs": {name: [plain(item) for item in comparison.pairs(task, name)] for name in _others(comparison)},
        "best": {
            name: {key: plain(fraction) for key, fraction in comparison.best(task, name).items()}
            for name in comparison.metrics
            if COMPARED[name] and comparison.draws
        },
    }


def _case_document(case: Case) -> dict[str, Any]:
    return {
        "configuration": case.configuration,
        "status": plain(case.status),
        "metrics": {name: plain(metric) for name, metric in case.metrics.items() if name in COMPARED},
        "failed_draws": case.outcomes.failures if case.outcomes is not None else 0,
    }
