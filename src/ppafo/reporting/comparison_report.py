"""A comparison as text, as JSON and as files: table, paired statistics, figures and a page."""

import math
from collections.abc import Sequence
from typing import Any

from ppafo.documents.json_text import json_text
from ppafo.reporting.analysis_page import Section, analysis_page
from ppafo.reporting.comparison_figure import change_figure, pareto_figure
from ppafo.reporting.metric_numbers import metric_difference, metric_level, metric_title, metric_unit
from ppafo.reporting.monte_carlo_report import shown_share
from ppafo.reporting.style import rendered
from ppafo.reporting.text_table import text_table
from ppafo.simulation.document import plain
from ppafo.studies.comparison.compared import COMPARED
from ppafo.studies.comparison.paired import Paired, pareto_front
from ppafo.studies.comparison.study import Case, Comparison
from ppafo.studies.uncertainty.intervals import FEWEST_CARRYING, Interval

JSON, TEXT, REPORT = "comparison.json", "comparison.txt", "report.html"
FILES = ("pareto.png", "pareto.svg", "change.png", "change.svg", JSON, TEXT, REPORT)
_FORMATS = ("png", "svg")
_PAIRED_HEAD = (
    "metric",
    "unit",
    "change as said",
    "change over the draws: median (5 to 95 %)",
    "mean difference",
    "probability to be better",
)

_READING = (
    "The interval of the mean difference and that of the probability say how well the draws tell them; they shrink "
    "with more draws. The change from 5 to 95 % of the draws says what the uncertain values make of it; it stays."
)


_NOISE = "sensors are noisy: every draw has noise of its own, the same in all configurations; 'as said' is one of them"


def comparison_text(comparison: Comparison) -> list[str]:
    """Return a table for each task, and the paired statistics below it where there are draws."""
    lines = [lead(comparison)]
    for task in comparison.tasks:
        lines += ["", f"task: {task}", *text_table(table_head(comparison), table_rows(comparison, task))]
        for name in _others(comparison):
            rows = paired_rows(comparison, task, name)
            if rows:
                lines += ["", f"{name} against {comparison.baseline}", *text_table(paired_head(comparison), rows)]
        lines += [f"best: {text}" for text in best_sentences(comparison, task)]
    return [*lines, *all_remarks(comparison)]


def all_remarks(comparison: Comparison) -> list[str]:
    """Return what is not as one would expect: runs that failed, and configurations that do not do the same."""
    unlike = [_unlike(comparison, task) for task in comparison.tasks]
    return [
        *(text for text in unlike if text),
        *(text for case in comparison.cases for text in _remarks(case)),
        *(text for task in comparison.tasks for text in _carried_by_few(comparison, task)),
        *([_NOISE] if _has_noise(comparison) else []),
    ]


def lead(comparison: Comparison) -> str:
    """Return in a sentence what is compared over what."""
    count = len(comparison.configurations)
    tasks = f"{len(comparison.tasks)} task{'' if len(comparison.tasks) == 1 else 's'}"
    words = f"{count} configurations on {tasks}, baseline {comparison.baseline}"
    if not comparison.draws:
        return f"{words}; the device as it is said to be, without uncertainty"
    if not comparison.varied:
        return f"{words}; the device as it is said to be, over {comparison.draws:,} draws of the noise of its sensors"
    return (
        f"{words}; {comparison.draws:,} draws of {len(comparison.varied)} uncertain values"
        f"{' and of the noise of the sensors' if _has_noise(comparison) else ''}, the same for all; "
        f"each interval with {100.0 * comparison.confidence:g} % confidence"
    )


def table_head(comparison: Comparison) -> list[str]:
    """Return the head of the table of a task."""
    return ["configuration", *(metric_title(name) for name in comparison.metrics), "status"]


def table_rows(comparison: Comparison, task: str) -> list[list[str]]:
    """Return a row for each configuration on a task: the device as it is said to be."""
    return [
        [case.configuration, *(_cell(case, name) for name in comparison.metrics), case.status.kind]
        for case in comparison.of_task(task)
    ]


def paired_head(comparison: Comparison) -> Sequence[str]:
    """Return the head of the table of pairs: with the share of noise where a controller hears any."""
    return (*_PAIRED_HEAD, "spread that is noise") if _has_noise(comparison) else _PAIRED_HEAD


def paired_rows(comparison: Comparison, task: str, configuration: str) -> list[list[str]]:
    """Return a row for each metric: change without and with uncertainty, mean difference, probability to be better."""
    cases = {case.configuration: case for case in comparison.of_task(task)}
    nominal = [cases[name].metrics for name in (comparison.baseline, configuration)]
    rows = []
    for item in comparison.pairs(task, configuration):
        said = [metrics[item.metric].value if item.metric in metrics else math.nan for metrics in nominal]
        noise = [] if item.noise is None else [shown_share(item.noise)]
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
        f"{name}: " + ", ".join(f"{configuration} {_probability(share)}" for configuration, share in shares.items())
        for name, shares in found
        if shares
    ]


def comparison_document(comparison: Comparison) -> dict[str, Any]:
    """Return the comparison as plain data, in SI units."""
    return {
        "units": "SI: N m, kg, J; shares from 0 to 1",
        "configurations": list(comparison.configurations),
        "baseline": comparison.baseline,
        "draws": comparison.draws,
        "seed": comparison.seed,
        "remarks": all_remarks(comparison),
        "varied": list(comparison.varied),
        "confidence": comparison.confidence,
        "tasks": [_task_document(comparison, task) for task in comparison.tasks],
    }


def comparison_files(comparison: Comparison) -> dict[str, bytes]:
    """Return everything that ``ppafo compare`` writes, by name."""
    pareto, change = pareto_figure(comparison), change_figure(comparison)
    drawn = {name: rendered(figure, _FORMATS) for name, figure in (("pareto", pareto), ("change", change)) if figure}
    files = {f"{name}.{kind}": content for name, kinds in drawn.items() for kind, content in kinds.items()}
    text = "\n".join(comparison_text(comparison))
    return {
        **files,
        JSON: f"{json_text(comparison_document(comparison))}\n".encode(),
        TEXT: f"{text}\n".encode(),
        REPORT: _page(comparison, {name: kinds["svg"] for name, kinds in drawn.items()}),
    }


def _page(comparison: Comparison, figures: dict[str, bytes]) -> bytes:
    sections = [section for task in comparison.tasks for section in _task_sections(comparison, task)]
    if "pareto" in figures:
        caption = "Marks: the device as it is said to be; dots: draws. The line joins what nothing beats in both."
        sections.append(Section("Error against gas", figure=figures["pareto"], caption=caption))
    if "change" in figures:
        caption = "Change against the baseline in each draw; the dashed line is the device as it is said to be."
        sections.append(Section("How the change spreads", figure=figures["change"], caption=caption))
    names = comparison.configurations
    title = " and ".join(names) if len(names) == 2 else f"{len(names)} configurations against {comparison.baseline}"
    explained = [_READING] if comparison.draws else []
    return analysis_page("Comparison", title, [lead(comparison), *explained, *all_remarks(comparison)], sections)


def _task_sections(comparison: Comparison, task: str) -> list[Section]:
    table = Section(
        f"Task: {task}", best_sentences(comparison, task), table_head(comparison), table_rows(comparison, task)
    )
    paired = [(name, paired_rows(comparison, task, name)) for name in _others(comparison)]
    return [
        table,
        *(
            Section(f"{name} against {comparison.baseline}, {task}", (), paired_head(comparison), rows)
            for name, rows in paired
            if rows
        ),
    ]


def _others(comparison: Comparison) -> list[str]:
    return [name for name in comparison.configurations if name != comparison.baseline]


def _cell(case: Case, name: str) -> str:
    metric = case.metrics.get(name)
    return "" if metric is None else f"{metric_level(name, metric.value):.4g}"


def _paired_row(item: Paired, baseline: float, other: float) -> list[str]:
    difference = [metric_difference(item.metric, value) for value in _ends(item.difference)]
    nominal = _percent((other - baseline) / abs(baseline)) if baseline else ""
    spread = f"{_percent(item.change)} ({_percent(item.change_low)} to {_percent(item.change_high)})"
    better = "" if item.better is None else "equal in all" if item.equal == 1.0 else _probability(item.better)
    shown = f"{difference[0]:+.3g} [{difference[1]:+.3g}, {difference[2]:+.3g}]"
    return [item.metric, metric_unit(item.metric), nominal, "" if math.isnan(item.change) else spread, shown, better]


def _ends(interval: Interval) -> Sequence[float]:
    return (interval.value, interval.low, interval.high)


def _percent(share: float) -> str:
    return "" if math.isnan(share) else f"{100.0 * share:+.3g} %"


def _probability(share: Interval) -> str:
    return f"{share.value:.4g} [{share.low:.4g}, {share.high:.4g}]"


def _remarks(case: Case) -> list[str]:
    remarks = [] if case.status.is_completed else [f"{case.configuration}, {case.task}: {case.status.message}"]
    if case.outcomes is not None and case.outcomes.failures:
        remarks.append(
            f"{case.configuration}, {case.task}: {case.outcomes.failures:,} of {case.outcomes.runs:,} draws failed and "
            f"are in no pair; the first: {case.outcomes.reason}"
        )
    return remarks


def _unlike(comparison: Comparison, task: str) -> str:
    """Return a warning where a task asks another thing of some configurations."""
    asked = {case.configuration: (case.scenario.reference, case.scenario.duration) for case in comparison.of_task(task)}
    others = [name for name, what in asked.items() if what != asked[comparison.baseline]]
    if not others:
        return ""
    return (
        f"task '{task}': {', '.join(others)} follow another reference, or for another time, than {comparison.baseline}"
        ": the differences are of the task too"
    )


def _has_noise(comparison: Comparison) -> bool:
    return any(case.renoised is not None for case in comparison.cases)


def _carried_by_few(comparison: Comparison, task: str) -> list[str]:
    """Return a warning for each mean difference that a few draws decide."""
    return [
        f"{name}, task '{task}': as few as {item.carrying:.3g} of {item.pairs:,} draws carry the mean difference of "
        f"{item.metric}, so do not trust its interval; the probability to be better holds"
        for name in _others(comparison)
        for item in comparison.pairs(task, name)
        if item.carrying < min(FEWEST_CARRYING, 0.5 * item.pairs)
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
            name: {key: plain(share) for key, share in comparison.best(task, name).items()}
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
