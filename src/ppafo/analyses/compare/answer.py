"""Report of a comparison: table for each task, paired statistics, tracking error against gas, changes."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ppafo.analyses.compare.pairs import RMS_ERRORS, PairedMetric, pareto_front
from ppafo.metrics import Metric
from ppafo.report.display_units import display_difference
from ppafo.report.finding import Column, Finding, Section
from ppafo.report.kind import ConfidenceInterval, Kind, of_metric
from ppafo.report.panels import Mark, Panel
from ppafo.report.style import BLACK, COLOURS, GREY, look_of_valve
from ppafo.simulation.gains import gains_of, remark_on_following_gains
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Status
from ppafo.simulation.tracking import Tracking
from ppafo.simulation.tracking.pair_step import coarse_pair
from ppafo.studies.distributions import Floats
from ppafo.studies.intervals import fraction_text, is_carried
from ppafo.study.runs import Rows
from ppafo.wording import count_of, said_of_configuration, without_exponent

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_GAS = "gas_supplied"
_PROBABILITY = Kind(form=".4g")


@dataclass(frozen=True, slots=True)
class ConfigurationResult:
    """Result of a configuration on a task: nominal run, and runs over the draws.

    ``status``: end of the nominal run
    ``metrics``: metrics of the nominal run
    ``tracking``: verdict on the nominal run
    ``failed_draws``, ``reason``: number of draws whose run failed, and reason of the first failure
    ``following``: number of draws whose run follows its reference; None without a verdict on any
    ``rows``: runs over the draws; None without draws
    ``renoised``: first runs of ``rows`` repeated with other sensor noise; None without noise
    """

    configuration: str
    status: Status
    metrics: Mapping[str, Metric]
    tracking: Tracking
    failed_draws: int
    following: int | None
    reason: str = field(compare=False)
    scenario: Scenario = field(compare=False, repr=False)
    rows: Rows | None = field(compare=False, repr=False)
    renoised: Rows | None = field(compare=False, repr=False)

    @property
    def word(self) -> str:
        """End of the nominal run in words; not recommended if the run does not follow its reference."""
        if not self.tracking.fails or not self.status.is_completed:
            return self.status.kind
        return "beyond reach" if self.follows else self.tracking.kind

    @property
    def follows(self) -> bool:
        """True if the nominal run completes and follows its reference, or misses it only as announced."""
        return self.status.is_completed and not self.tracking.is_useless

    def value(self, metric: str) -> float:
        """Return a metric [SI] of the nominal run; nan if the run does not have the metric."""
        values = self.metrics.get(metric)
        return math.nan if values is None else values.value


@dataclass(frozen=True, slots=True)
class TaskComparison:
    """Results of all configurations on one task.

    ``pareto_front``: configurations that are Pareto-optimal in error and gas
    ``pairs``: paired statistics of each configuration against the baseline; empty without draws
    ``best``: probability of each configuration to be the best, by metric; empty without draws
    """

    task: str
    overrides: list[str]
    cases: list[ConfigurationResult]
    pareto_front: list[str]
    pairs: dict[str, list[PairedMetric]]
    best: dict[str, dict[str, ConfidenceInterval]]

    def case(self, configuration: str) -> ConfigurationResult:
        """Return the result of a configuration by its name."""
        return next(case for case in self.cases if case.configuration == configuration)


@dataclass(frozen=True, slots=True)
class ComparisonResult:
    """Comparison of configurations on tasks with a ``baseline``; numbers in SI.

    ``draws``: number of draws, 0 without uncertainty
    ``varied``: uncertain paths except sensor noise
    ``confidence``: confidence level of the intervals
    """

    units: str
    configurations: list[str]
    baseline: str
    draws: int
    seed: int
    remarks: list[str]
    varied: list[str]
    confidence: float
    tasks: list[TaskComparison]
    metrics: tuple[str, ...] = field(compare=False)

    @property
    def error(self) -> str:
        """Metric of the error of the controlled quantity; empty if the configurations have none in common."""
        return error_of(self.metrics)

    @property
    def has_noise(self) -> bool:
        """True if a controller receives sensor noise."""
        return any(case.renoised is not None for task in self.tasks for case in task.cases)


_READING = (
    "The intervals of the mean difference and of the probability show how precisely the draws estimate them; they "
    "shrink with more draws. The change from 5 to 95 % of the draws shows the effect of the uncertain values; it "
    "does not shrink."
)
_NOISE = (
    "sensors are noisy: every draw has its own noise, the same in all configurations; the nominal change is "
    "one realisation"
)
_PARETO = (
    "Marks: the nominal device; dots: draws. The line joins the configurations that no other configuration beats in "
    "both error and gas."
)


def finding_of(comparison: ComparisonResult) -> Finding[ComparisonResult]:
    """Return a comparison as a finding with sentences, tables and panels."""
    names = comparison.configurations
    tasks, values = count_of(len(comparison.tasks), "task"), count_of(len(comparison.varied), "uncertain value")
    lead = f"{len(names)} configurations on {tasks}, baseline {comparison.baseline}; "
    if not comparison.draws:
        lead += "the nominal device, without uncertainty"
    elif not comparison.varied:
        lead += f"the nominal device, over {comparison.draws:,} draws of the sensor noise"
    else:
        beside = " and of the sensor noise" if comparison.has_noise else ""
        lead += f"{comparison.draws:,} draws of {values}{beside}, the same for all; each "
        lead += f"interval with {100.0 * comparison.confidence:g} % confidence"
    pareto = Section(
        "Error against gas", panels=partial(_pareto_panels, comparison), name="pareto", caption=_PARETO, is_detail=True
    )
    change = Section(
        "Spread of the change",
        panels=partial(_change_panels, comparison),
        name="change",
        caption="Change against the baseline in each draw; the dashed line is the nominal device.",
        across=2,
        size=(3.0, 2.5),
        is_detail=True,
    )
    return Finding(
        name="compare",
        kicker="Comparison",
        title=" and ".join(names) if len(names) == 2 else f"{len(names)} configurations against {comparison.baseline}",
        said=(lead,),
        parts=(
            *(part for task in comparison.tasks for part in _parts(comparison, task)),
            *([pareto] if comparison.error else []),
            *([change] if comparison.error and comparison.draws else []),
            Section(remarks=comparison.remarks),
            Section("How to read it", said=[_READING], is_detail=True) if comparison.draws else Section(),
        ),
        found=comparison,
        passed=all(case.status.is_completed for task in comparison.tasks for case in task.cases),
    )


def _parts(comparison: ComparisonResult, task: TaskComparison) -> list[Section]:
    """Return the tables of a task: metrics, changes against the baseline, probability of being the best."""
    where = "" if len(comparison.tasks) == 1 else f", {task.task}"
    # A column without any number, such as the error of a hold that no task has, says nothing.
    held = [name for name in comparison.metrics if not all(math.isnan(case.value(name)) for case in task.cases)]
    kinds = [(name, of_metric(name)) for name in held]
    following, best = [case for case in task.cases if case.follows], dict[str, str]()
    for metric, kind in ((name, kind) for name, kind in kinds if name in (comparison.error, _GAS)):
        shares, values = task.best.get(metric, {}), {case.configuration: case.value(metric) for case in following}
        if shares and len(comparison.configurations) > 2:
            best[metric] = ", ".join(f"{name} {_PROBABILITY.interval(share)}" for name, share in shares.items())
        elif not comparison.draws and len(values) > 1 and np.isfinite([*values.values()]).all():
            least = min(values.values())
            named = ", ".join(name for name, value in values.items() if value == least)
            best[metric] = f"{named} ({kind.text(least)})"
    of = f" of {comparison.draws:,}"
    follow = ["-" if case.following is None else f"{case.following:,}{of}" for case in task.cases]
    laws = ((case, case.scenario.law) for case in task.cases)
    gains = ((case, gains_of(case.scenario, law)) for case, law in laws if law is not None)
    return [
        Section(
            f"Task: {task.task}",
            [
                Column("configuration", [case.configuration for case in task.cases]),
                *(Column(kind.words, [case.value(name) for case in task.cases], kind) for name, kind in kinds),
                Column("status", [case.word for case in task.cases]),
                *([Column("draws that follow", follow)] if comparison.draws else []),
            ],
            remarks=[f"{case.configuration}: {used.sentence}" for case, used in gains if used is not None],
        ),
        *(
            Section(f"{name} against {comparison.baseline}{where}", _paired(comparison, task, name))
            for name, pairs in task.pairs.items()
            if pairs
        ),
        *([Section(remarks=[f"best: {metric}: {text}" for metric, text in best.items()])] if best else []),
    ]


def _paired(comparison: ComparisonResult, task: TaskComparison, name: str) -> list[Column]:
    """Return the columns of a table with a row for each metric: change, mean difference, probability of improvement."""
    pairs = task.pairs[name]
    kinds = [of_metric(pair.metric, "+.3g") for pair in pairs]
    nominal, spread = [], []
    for kind, pair in zip(kinds, pairs, strict=True):
        base, other = (task.case(configuration).value(pair.metric) for configuration in (comparison.baseline, name))
        # Nothing is a percentage of what is zero within the accuracy of a run.
        scale = abs(display_difference(base, kind.quantity))
        nominal.append(_percent(display_difference(other - base, kind.quantity) / scale) if scale else "-")
        quantiles = f"{_percent(pair.change)} ({_percent(pair.change_low)} to {_percent(pair.change_high)})"
        spread.append(quantiles if math.isfinite(pair.change) and scale else "-")
    better = [
        "-" if pair.better is None else "equal in all" if pair.equal == 1.0 else _PROBABILITY.interval(pair.better)
        for pair in pairs
    ]
    differences = [kind.change_interval(pair.difference) for kind, pair in zip(kinds, pairs, strict=True)]
    columns = [
        Column("metric", [pair.metric for pair in pairs]),
        Column("unit", [kind.shown_unit if kind.quantity else "" for kind in kinds]),
        Column("nominal change", nominal),
        Column("change over the draws: median (5 to 95 %)", spread),
        Column("mean difference", differences),
        Column("probability of being better", better),
    ]
    noise = ["-" if pair.noise is None else fraction_text(pair.noise) for pair in pairs]
    return [*columns, Column("spread due to noise", noise)] if comparison.has_noise else columns


def _percent(fraction: float) -> str:
    return "" if math.isnan(fraction) else f"{without_exponent(100.0 * fraction, '+.3g')} %"


def remarks_of(comparison: ComparisonResult) -> list[str]:
    """Return remarks on differing tasks, failed runs, means that depend on few draws, and noise."""
    remarks, failed, uncertain = [], [], []
    for task in comparison.tasks:
        followed = {case.configuration: (case.scenario.reference, case.scenario.run.duration) for case in task.cases}
        # Compared by reference and duration and not by file: two configurations may name one task differently.
        others = [name for name, reference in followed.items() if reference != followed[comparison.baseline]]
        if others:
            follow, run = ("follows", "runs") if len(others) == 1 else ("follow", "run")
            remarks.append(
                f"task '{task.task}': {', '.join(others)} {follow} a different reference, or {run} for a different "
                f"time, than {comparison.baseline}: the differences come partly from the task"
            )
        for case in task.cases:
            where = f"{case.configuration}, {task.task}"
            with said_of_configuration(case.configuration):
                remarks += [coarse_pair(case.scenario), remark_on_following_gains(case.scenario, comparison.varied)]
                if kept := case.scenario.origin.replaced:
                    remarks.append(f"{where}: {kept}")
                if not case.follows:
                    remarks.append(f"{where}: {case.tracking.sentence}; not counted among the best")
            if not case.status.is_completed:
                failed.append(f"{where}: {case.status.message}")
            if case.failed_draws:
                failed.append(
                    f"{where}: {case.failed_draws:,} of {comparison.draws:,} draws failed and are left out of every "
                    f"pair; the first: {case.reason}"
                )
        uncertain += [
            f"{name}, task '{task.task}': the mean difference of {pair.metric} has an effective sample size of "
            f"{pair.effective_size:.3g} of {pair.pairs:,} draws: do not trust its interval; the probability of being "
            "better is not affected"
            for name, pairs in task.pairs.items()
            for pair in pairs
            if not is_carried(pair.effective_size, pair.pairs)
        ]
    # Several tasks may have the same remark.
    return [*dict.fromkeys(filter(None, remarks)), *failed, *uncertain, *([_NOISE] if comparison.has_noise else [])]


def error_of(metrics: Sequence[str]) -> str:
    """Return the error of the controlled quantity among compared metrics; empty without one."""
    return next((name for name in metrics if name in RMS_ERRORS), "")


def front_of(cases: Sequence[ConfigurationResult], error: str) -> list[str]:
    """Return the configurations that follow their reference and are Pareto-optimal in a metric ``error`` and gas."""
    following = [case for case in cases if case.follows]
    points = np.array([[case.value(name) for name in (error, _GAS)] for case in following]).reshape(-1, 2)
    return [case.configuration for case, is_front in zip(following, pareto_front(points), strict=True) if is_front]


_MARKS = "osD^vP"
_MAXIMUM_DOTS = 1500
_BINS = 40
_TICKS_OF_CHANGE = 4
"""Largest number of tick intervals on the axis of the change, so that labels such as -98.85 do not touch."""
_SHOWN_PERCENTILES = (0.5, 99.5)
"""Percentiles between which changes are plotted; a few distant ones would squeeze all others into one bar."""


# Panels are made by functions with a name: a lambda in a report cannot be pickled.
def _pareto_panels(comparison: ComparisonResult) -> list[Panel]:
    return [_pareto(comparison, task) for task in comparison.tasks]


def _change_panels(comparison: ComparisonResult) -> list[Panel]:
    return [_change(comparison, task, metric) for task in comparison.tasks for metric in (comparison.error, _GAS)]


def _colours(task: TaskComparison) -> dict[str, str]:
    """Return a colour for each configuration: colours of the valves if all differ, else of the palette in order."""
    colours = [look_of_valve(case.scenario.device.valve.kind).colour for case in task.cases]
    if len(set(colours)) < len(colours):
        colours = [COLOURS[row % len(COLOURS)] for row in range(len(colours))]
    return dict(zip((case.configuration for case in task.cases), colours, strict=True))


def _pareto(comparison: ComparisonResult, task: TaskComparison) -> Panel:
    """Return a panel of error over gas, with a mark for each completed configuration and a dot for each draw."""
    cases = [case for case in task.cases if case.status.is_completed]
    front, marks, on_front = front_of(cases, comparison.error), [], []
    colours = _colours(task)
    for number, case in enumerate(cases):
        colour = colours[case.configuration]
        if case.rows is not None:
            dots = {"linestyle": "", "marker": ".", "alpha": 0.35, "markersize": 4, "markeredgewidth": 0}
            gas, error = (case.rows[name][:_MAXIMUM_DOTS] for name in (_GAS, comparison.error))
            marks.append(Mark("line", gas, error, colour=colour, style=dots))
        marker = {"linestyle": "", "marker": _MARKS[number % len(_MARKS)], "markersize": 8, "markeredgecolor": "white"}
        x, y = (case.value(name) for name in (_GAS, comparison.error))
        marks.append(Mark("line", [x], [y], label=case.configuration, colour=colour, style=marker))
        if case.configuration in front:
            on_front.append((x, y))
    # From left to right, so that the front is a line and no zigzag.
    x_front, y_front = np.array(sorted(on_front)).reshape(-1, 2).T
    marks.append(Mark("line", x_front, y_front, colour=GREY, style={"linewidth": 1.0, "zorder": 1}))
    title = f"Task: {task.task}" if len(comparison.tasks) > 1 else ""
    return Panel(of_metric(_GAS), of_metric(comparison.error), marks, title, legend="inside")


def _change(comparison: ComparisonResult, task: TaskComparison, metric: str) -> Panel:
    """Return a panel with histograms of the change of a metric against the baseline; dashed: nominal device."""
    baseline, marks, ends = task.case(comparison.baseline), [], list[float]()
    for name, colour in _colours(task).items():
        case = task.case(name)
        if name == comparison.baseline or case.rows is None or baseline.rows is None:
            continue
        change = _relative(baseline.rows[metric], case.rows[metric])
        if change.size == 0:
            continue
        low, high = np.percentile(change, _SHOWN_PERCENTILES)
        # Fewer bins for fewer draws, so that each has some of them.
        counts, edges = np.histogram(change, min(_BINS, max(8, round(1.5 * change.size**0.5))), (low, high))
        marks.append(Mark("bars", edges, counts, label=name, colour=colour))
        nominal = _relative(*(np.array([side.value(metric)]) for side in (baseline, case)))
        dashed = {"linestyle": "--", "linewidth": 1.2}
        # One dashed line of the legend stands for all.
        said = "" if ends else "nominal device"
        marks += [Mark("at", value, label=said, colour=colour, style=dashed) for value in nominal]
        ends += [float(low), float(high), *nominal.tolist()]
    words = f"{of_metric(metric).words}, change from {comparison.baseline}"
    is_first = metric == comparison.error
    title = f"Task: {task.task}" if len(comparison.tasks) > 1 and is_first else ""

    def limit_changes(axes: "Axes") -> None:
        from matplotlib.ticker import MaxNLocator

        # Zero is shown where it is near: far from all changes it would squeeze them into a few pixels.
        low, high = min(ends, default=0.0), max(ends, default=0.0)
        span = high - low or 1.0
        if low - 0.5 * span <= 0.0 <= high + 0.5 * span:
            axes.axvline(0.0, color=BLACK, linewidth=0.8)
            low, high = min(low, 0.0), max(high, 0.0)
        axes.set_xlim(low - 0.08 * span, high + 0.08 * span)
        axes.xaxis.set_major_locator(MaxNLocator(_TICKS_OF_CHANGE))
        axes.locator_params(axis="y", integer=True)

    axis, draws = Kind(words, "%"), Kind("Draws" if is_first else "")
    return Panel(axis, draws, marks, title, legend="" if is_first else "figure", then=limit_changes if ends else None)


def _relative(baseline: Floats, other: Floats) -> Floats:
    # In pairs: a draw that failed on one side says nothing about a change.
    both = np.isfinite(baseline) & np.isfinite(other) & (baseline != 0.0)
    return np.asarray(100.0 * (other[both] - baseline[both]) / np.abs(baseline[both]))
