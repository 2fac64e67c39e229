"""The results of a study as text, as JSON and as a page; figure and page are written into its folder."""

from collections.abc import Mapping
from typing import Any

import ppafo
from ppafo.reporting.page import inline_figure, rendered_page
from ppafo.reporting.study_figure import study_figure
from ppafo.reporting.study_units import shown_metric
from ppafo.reporting.style import rendered
from ppafo.studies.sweep.results import StudyResults

FIGURE, REPORT = "figure", "report.html"
TEMPLATE = "study.html.jinja"
_FORMATS = ("png", "svg")
_HEAD = ("metric", "unit", "runs", "mean", "sd")


def study_text(results: StudyResults) -> str:
    """Return counts and a table of metrics for each configuration."""
    lines = [f"{results.name}: {counted(results)}"]
    for name, metrics in results.metrics.items():
        rows = [list(_head(results)), *(metric_cells(results, metric, item) for metric, item in metrics.items())]
        widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
        lines += ["", f"{name}: {results.summary['completed_by_configuration'][name]:,} runs completed"]
        lines += ["  ".join(_padded(row, widths)).rstrip() for row in rows if metrics]
    return "\n".join([*lines, "", f"written: {results.place.address} (runs/*.parquet, summary.json, {REPORT})"])


def study_document(results: StudyResults) -> dict[str, Any]:
    """Return what ``--json`` prints: the summary and where the results are."""
    return {**results.summary, "folder": results.place.address}


def counted(results: StudyResults) -> str:
    """Return how many runs there are and how they ended."""
    parts = [f"{results.summary[key]:,} {key}" for key in ("completed", "diverged", "refused") if results.summary[key]]
    return f"{results.document['runs']:,} runs: {', '.join(parts)}"


def metric_cells(results: StudyResults, name: str, item: Mapping[str, Any]) -> list[str]:
    """Return the cells of a metric in shown units; empty where no run has it."""
    zero, unit = shown_metric(name, 0.0).value, shown_metric(name).unit
    if item["count"] == 0:
        return [name, unit, "0", *[""] * (len(_head(results)) - 3)]
    values = [shown_metric(name, item["mean"]).value]
    sd = f"{shown_metric(name, item['sd']).value - zero:.3g}" if "sd" in item else ""
    quantiles = [shown_metric(name, value).value for value in item["quantiles"].values()]
    return [name, unit, f"{item['count']:,}", f"{values[0]:.4g}", sd, *(f"{value:.4g}" for value in quantiles)]


def write_report(results: StudyResults) -> None:
    """Write figure and page beside the results."""
    drawn = rendered(study_figure(results), _FORMATS)
    for file_format, content in drawn.items():
        results.place.write(f"{FIGURE}.{file_format}", content)
    results.place.write(REPORT, study_page(results, drawn["svg"]).encode())


def study_page(results: StudyResults, figure: bytes) -> str:
    """Return the page as HTML; ``figure`` is the content of an SVG file."""
    tables = [
        {
            "name": name,
            "completed": results.summary["completed_by_configuration"][name],
            "rows": [metric_cells(results, metric, item) for metric, item in metrics.items()],
        }
        for name, metrics in results.metrics.items()
    ]
    return rendered_page(
        TEMPLATE,
        {
            "name": results.name,
            "description": " ".join(results.document["study"].get("description", "").split()),
            "counted": counted(results),
            "failures": results.summary["failures"],
            "head": _head(results),
            "tables": tables,
            "vary": [
                {key: str(value) for key, value in item.items()} for item in results.document["study"].get("vary", ())
            ],
            "sample": results.document["study"].get("sample", {}),
            "correlations": results.document["study"].get("correlations", []),
            "assumed": _assumed(results),
            "figure": inline_figure(figure),
            "quantile_definition": results.summary["quantile_definition"],
            "sha256": results.document["sha256"],
            "versions": f"ppafo {ppafo.__version__}",
        },
    )


def _assumed(results: StudyResults) -> list[dict[str, Any]]:
    """Return what the base scenarios assume, once where several assume the same."""
    names: dict[tuple[str, str, str], list[str]] = {}
    for name, scenario in results.document["scenarios"].items():
        for item in scenario["assumptions"]:
            names.setdefault((item["path"], item["value"], item["note"]), []).append(name)
    return [{"path": path, "value": value, "note": note, "names": own} for (path, value, note), own in names.items()]


def _head(results: StudyResults) -> tuple[str, ...]:
    described = [item for own in results.metrics.values() for item in own.values() if item["count"]]
    shares = list(described[0]["quantiles"]) if described else []
    return (*_HEAD, *(f"{100 * float(share):g} %" for share in shares))


def _padded(row: list[str], widths: list[int]) -> list[str]:
    texts = [f"{cell:<{width}}" for cell, width in zip(row[:2], widths[:2], strict=True)]
    return [*texts, *(f"{cell:>{width}}" for cell, width in zip(row[2:], widths[2:], strict=True))]
