"""The answer of a comparison: a table for each task, the statistics of pairs, error against gas, the changes."""

import math
from collections.abc import Sequence
from typing import Any

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import display_difference, display_unit
from ppafo.answers.shown_metrics import metric_column, metric_quantity
from ppafo.live.workbench import live_part
from ppafo.questions.compare.figure import change_figure, has_changes, has_errors, pareto_figure
from ppafo.questions.compare.paired import Paired, pareto_front
from ppafo.questions.compare.solve import COMPARED, Case, Comparison
from ppafo.simulation.document import plain
from ppafo.studies.intervals import FEWEST_EFFECTIVE, Interval, fraction_text

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
    return Answer(
        name="compare",
        kicker="Comparison",
        title=" and ".join(names) if len(names) == 2 else f"{len(names)} configurations against {comparison.baseline}",
        lead=(lead(comparison),),
        sections=(
            *(section for task in comparison.tasks for section in _task_sections(comparison, task)),
            *_figures(comparison),
            Section(remarks=tuple(all_remarks(comparison))),
            Section("How to read it", explained, is_detail=True) if explained else Section(),
        ),
        data=_data(comparison),
        passed=all(case.status.is_completed for case in comparison.cases),
        live=lambda: live_part([case.scenario for case in comparison.cases]),
    )


def _figures(comparison: Comparison) -> list[Section]:
    pareto = (
        "Marks: the nominal device; dots: draws. The line joins the configurations that no other beats in "
        "both error and gas."
    )
    change = "Change against the baseline in each draw; the dashed line is the nominal device."
    sections = []
    if has_errors(comparison):
        drawn = Figure("pareto", pareto, lambda: pareto_figure(comparison))
        sections.append(Section("Error against gas", figure=drawn, is_detail=True))
    if has_changes(comparison):
        drawn = Figure("change", change, lambda: change_figure(comparison))
        sections.append(Section("Spread of the change", figure=drawn, is_detail=True))
    return sections


def _task_sections(comparison: Comparison, task: str) -> list[Section]:
    columns = (Column("configuration"), *map(metric_column, comparison.metrics), Column("status"))
    rows = tuple(
        (case.configuration, *(_value(case, name) for name in comparison.metrics), case.status.kind)
        for case in comparison.of_task(task)
    )
    head = tuple(map(Column, paired_head(comparison)))
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


def paired_head(comparison: Comparison) -> Sequence[str]:
    """Return the head of the table of pairs: with the fraction of noise where a controller receives any."""
    return (*_PAIRED_HEAD, "spread due to noise") if _has_noise(comparison) else _PAIRED_HEAD


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


def _data(comparison: Comparison) -> dict[str, Any]:
    return {
        "units": "SI: N m, kg, J; fractions from 0 to 1",
        "configurations": list(comparison.configurations),
        "baseline": comparison.baseline,
        "draws": comparison.draws,
        "seed": comparison.seed,
        "remarks": all_remarks(comparison),
        "varied": list(comparison.varied),
        "confidence": comparison.confidence,
        "tasks": [_task_document(comparison, task) for task in comparison.tasks],
    }


def _others(comparison: Comparison) -> list[str]:
    return [name for name in comparison.configurations if name != comparison.baseline]


def _paired_row(item: Paired, baseline: float, other: float) -> list[str]:
    quantity = metric_quantity(item.metric)
    difference = [display_difference(value, quantity) for value in _ends(item.difference)]
    nominal = _percent((other - baseline) / abs(baseline)) if baseline else ""
    spread = f"{_percent(item.change)} ({_percent(item.change_low)} to {_percent(item.change_high)})"
    better = "" if item.better is None else "equal in all" if item.equal == 1.0 else _probability(item.better)
    shown = f"{difference[0]:+.3g} [{difference[1]:+.3g}, {difference[2]:+.3g}]"
    return [item.metric, display_unit(quantity), nominal, "" if math.isnan(item.change) else spread, shown, better]


def _ends(interval: Interval) -> Sequence[float]:
    return (interval.value, interval.low, interval.high)


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
    return {
        "task": task,
        "overrides": list(comparison.tasks[task]),
        "cases": [_case_document(case) for case in cases],
        "pareto_front": _front(cases),
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


def _front(cases: Sequence[Case]) -> list[str]:
    """Return the configurations that no other beats in both error and gas."""
    import numpy as np

    goals = ("rms_error", "gas_supplied")
    points = np.array(
        [[case.metrics[name].value if name in case.metrics else np.nan for name in goals] for case in cases]
    )
    return [case.configuration for case, is_front in zip(cases, pareto_front(points), strict=True) if is_front]
