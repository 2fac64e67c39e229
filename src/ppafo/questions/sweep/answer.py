"""The answer of a sweep: counts, a table of metrics for each configuration, what varied and what was assumed."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import display_difference, display_value
from ppafo.answers.shown_metrics import metric_quantity, metric_unit
from ppafo.answers.writing import files_of
from ppafo.questions.sweep.figure import study_figure
from ppafo.questions.sweep.results import SUMMARY, StudyResults

FIGURE = "figure"
_HEAD = ("metric", "unit", "runs", "mean", "sd")


def answer_of(results: StudyResults) -> Answer:
    """Return the answer of a sweep; it has passed where any run completed."""
    return Answer(
        name="sweep",
        kicker="Study",
        title=results.name,
        lead=(f"{results.name}: {count_sentence(results)}", *_failure_remarks(results)),
        sections=(
            _description(results),
            *(_metrics(results, name, metrics) for name, metrics in results.metrics.items()),
            Section(
                "How to read it",
                (
                    f"Quantile: {results.summary['quantile_definition']}. Only completed runs that have the metric "
                    "are counted.",
                ),
                is_detail=True,
            ),
            _varied_section(results),
            _sampling_section(results),
            _assumptions_section(results),
            _rows(results),
        ),
        data={**results.summary, "folder": results.place.address},
        passed=results.summary["completed"] > 0,
    )


def write_report(results: StudyResults) -> None:
    """Write figure, page and summary beside the results, in a folder that resumes and is known by its ``study.json``.

    No file names the place: the same study makes the same bytes anywhere.
    """
    answer = replace(answer_of(results), name=Path(SUMMARY).stem, data=results.summary)
    for name, content in files_of(answer).items():
        results.place.write(name, content)


def count_sentence(results: StudyResults) -> str:
    """Return how many runs there are and how they ended."""
    parts = [f"{results.summary[key]:,} {key}" for key in ("completed", "diverged", "refused") if results.summary[key]]
    return f"{results.document['runs']:,} runs: {', '.join(parts)}"


def metric_cells(name: str, item: Mapping[str, Any], columns: int) -> tuple[str, ...]:
    """Return the cells of a metric in shown units; empty where no run has it."""
    quantity = metric_quantity(name)
    first = (name, metric_unit(name), f"{item['count']:,}")
    if item["count"] == 0:
        return (*first, *[""] * (columns - len(first)))
    deviation = f"{display_difference(item['sd'], quantity):.3g}" if "sd" in item else ""
    quantiles = (f"{display_value(value, quantity):.4g}" for value in item["quantiles"].values())
    return (*first, f"{display_value(item['mean'], quantity):.4g}", deviation, *quantiles)


def _failure_remarks(results: StudyResults) -> list[str]:
    runs, completed = results.document["runs"], results.summary["completed"]
    if completed == runs:
        return []
    first = results.summary["failures"][0]
    return [
        f"{runs - completed:,} of {runs:,} runs failed and have no metrics; the first is run {first['run']}: "
        f"{first['reason']}"
    ]


def _description(results: StudyResults) -> Section:
    """Return what the study is for, its figure, and the first runs that failed."""
    described = " ".join(results.document["study"].get("description", "").split())
    failed = [f"run {item['run']} ({item['configuration']}): {item['reason']}" for item in results.summary["failures"]]
    caption = (
        "Distributions of the metrics, their dependence on the varied values, and quantiles over time where requested."
    )
    return Section(
        paragraphs=(described,) if described else (),
        remarks=tuple(failed),
        figure=Figure(FIGURE, caption, lambda: study_figure(results)),
        is_detail=True,
    )


def _metrics(results: StudyResults, name: str, metrics: Mapping[str, Mapping[str, Any]]) -> Section:
    head = _head(results)
    rows = tuple(metric_cells(metric, item, len(head)) for metric, item in metrics.items())
    completed = f"{name}: {results.summary['completed_by_configuration'][name]:,} runs completed"
    return Section(table=Table(tuple(map(Column, head)), rows, left=2), paragraphs=(completed,))


def _head(results: StudyResults) -> tuple[str, ...]:
    described = [item for own in results.metrics.values() for item in own.values() if item["count"]]
    fractions = list(described[0]["quantiles"]) if described else []
    return (*_HEAD, *(f"{100 * float(fraction):g} %" for fraction in fractions))


def _varied_section(results: StudyResults) -> Section:
    rows = tuple(_varied_row(item) for item in results.document["study"].get("vary", ()))
    return _detail("What varied", ("path", "kind", ""), rows)


def _varied_row(item: Mapping[str, Any]) -> tuple[str, str, str]:
    others = [f"{key.replace('_', ' ')} {value}" for key, value in item.items() if key not in ("path", "kind")]
    return item["path"], item["kind"], ", ".join(others)


def _sampling_section(results: StudyResults) -> Section:
    study = results.document["study"]
    said = [
        f"Correlation of {item['between'][0]} with {item['between'][1]}: {item['coefficient']}, of their normal scores."
        for item in study.get("correlations", ())
    ]
    sample = study.get("sample")
    if sample:
        method, seed = sample["method"].replace("_", " "), sample.get("seed", 1)
        said.append(f"Sampled by {method}: {sample['runs']} draws, seed {seed}.")
    return Section(paragraphs=tuple(said), is_detail=True)


def _assumptions_section(results: StudyResults) -> Section:
    """Return what the base scenarios assume, once where several assume the same."""
    names: dict[tuple[str, str, str], list[str]] = {}
    for name, scenario in results.document["scenarios"].items():
        for item in scenario["assumptions"]:
            names.setdefault((item["path"], item["value"], item["note"]), []).append(name)
    rows = tuple((*assumption, ", ".join(own)) for assumption, own in names.items())
    return _detail("What the base scenarios assume", ("value", "", "why", "in"), rows)


def _rows(results: StudyResults) -> Section:
    facts = (
        ("rows of all runs", "runs/*.parquet"),
        ("summary", SUMMARY),
        ("study", f"study.json, sha256 {results.document['sha256'][:16]}"),
    )
    return Section("Files", table=Table((), facts), is_detail=True)


def _detail(heading: str, head: Sequence[str], rows: tuple[tuple[str, ...], ...]) -> Section:
    if not rows:
        return Section()
    return Section(heading, table=Table(tuple(map(Column, head)), rows, left=len(head)), is_detail=True)
