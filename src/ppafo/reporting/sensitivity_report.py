"""Sensitivity as text, as JSON and as files."""

from typing import Any

import numpy as np

from ppafo.documents.json_text import json_text
from ppafo.reporting.analysis_page import Section, analysis_page
from ppafo.reporting.metric_numbers import metric_difference, metric_unit
from ppafo.reporting.sensitivity_figure import sensitivity_figure
from ppafo.reporting.style import rendered
from ppafo.reporting.text_table import text_table
from ppafo.simulation.document import plain
from ppafo.studies.sensitivity.analyse import OfMetric, Sensitivity

JSON, TEXT, REPORT = "sensitivity.json", "sensitivity.txt", "report.html"
FILES = ("sensitivity.png", "sensitivity.svg", JSON, TEXT, REPORT)
_TITLES = {
    "total": "total",
    "first": "first order",
    "mean_effect": "mean effect",
    "spread": "spread of effect",
    "shapley": "Shapley effect",
}


def sensitivity_text(found: Sensitivity) -> list[str]:
    """Return a table for each metric, the most important value first, and what is not settled."""
    lines = [*lead(found)]
    for metric in found.metrics:
        lines += ["", heading(found, metric), *text_table(table_head(found, metric), table_rows(found, metric))]
        lines += remarks(found, metric)
    return lines


def lead(found: Sensitivity) -> list[str]:
    """Return what was done, and what became of runs that failed."""
    settings, method = found.settings, found.method
    return [
        f"{found.name}: {method.name}, {settings.samples:,} {method.sizes_told}, {found.runs:,} runs of "
        f"{len(found.paths)} uncertain values; bands with {100.0 * settings.confidence:g} % confidence",
        f"{found.failures:,} runs failed; up to {100.0 * settings.most_failed:g} % are allowed, and every "
        f"{method.block_told} with one is left out whole",
    ]


def heading(found: Sensitivity, metric: OfMetric) -> str:
    """Return the name of a metric with its mean and standard deviation."""
    unit = metric_unit(metric.metric)
    spread = f"sd {metric_difference(metric.metric, metric.sd):.3g} {unit}".rstrip()
    dropped = f"; {metric.dropped_blocks:,} of {found.settings.samples:,} {found.method.sizes_told} left out"
    return f"{metric.metric}: {spread}{dropped if metric.dropped_blocks else ''}"


def table_head(found: Sensitivity, metric: OfMetric) -> list[str]:
    """Return the head of the table of a metric."""
    unit = metric_unit(metric.metric) if found.method.name == "morris" else ""
    names = []
    for name in metric.indices.values:
        names.append(f"{_TITLES[name]} ({unit})" if unit else _TITLES[name])
        names += ["band"] if name in metric.indices.bands else []
    return ["value", *names]


def table_rows(found: Sensitivity, metric: OfMetric) -> list[list[str]]:
    """Return a row for each uncertain value, the most important one first."""
    order = np.argsort(-metric.indices.values[found.method.shown[0]])
    return [[found.paths[row], *_cells(found, metric, int(row))] for row in order]


def remarks(found: Sensitivity, metric: OfMetric) -> list[str]:
    """Return what these numbers leave open."""
    said = []
    unsettled = found.unsettled(metric)
    if unsettled:
        pairs = ", ".join(f"{first} and {second}" for first, second in unsettled)
        said.append(f"not settled at this size, their bands overlap: {pairs}")
    if "first" in metric.indices.values:
        alone = float(np.sum(metric.indices.values["first"]))
        said.append(f"first orders add up to {alone:.3f}; what is missing to 1 comes of values acting together")
    return said


def sensitivity_document(found: Sensitivity) -> dict[str, Any]:
    """Return the indices as plain data; those of Morris in the SI unit of the metric."""
    return {
        "study": found.name,
        "method": found.method.name,
        "settings": plain(found.settings),
        "paths": list(found.paths),
        "runs": found.runs,
        "failed": found.failures,
        "policy": "above the allowed share refused; below, every block with a failed run is left out whole",
        "metrics": [
            {
                "metric": metric.metric,
                "mean": metric.mean,
                "standard_deviation": metric.sd,
                "runs_without_value": metric.dropped_runs,
                "settling": [
                    {
                        "blocks": each.blocks,
                        "used": each.used,
                        "indices": {name: plain(values.tolist()) for name, values in each.indices.values.items()},
                        "bands": {name: plain(values.tolist()) for name, values in each.indices.bands.items()},
                    }
                    for each in metric.settling
                ],
            }
            for metric in found.metrics
        ],
    }


def sensitivity_files(found: Sensitivity) -> dict[str, bytes]:
    """Return everything that ``ppafo sensitivity`` writes, by name."""
    drawn = rendered(sensitivity_figure(found), ("png", "svg"))
    sections = [
        Section(heading(found, metric), remarks(found, metric), table_head(found, metric), table_rows(found, metric))
        for metric in found.metrics
    ]
    caption = (
        "Left: the indices with their bands. Right: the largest of them, in the colours of their names, from "
        "ever more of the sample: whether they have settled."
    )
    sections.append(Section("Indices, and how they settle", figure=drawn["svg"], caption=caption))
    text = "\n".join(sensitivity_text(found))
    return {
        **{f"sensitivity.{kind}": content for kind, content in drawn.items()},
        JSON: f"{json_text(sensitivity_document(found))}\n".encode(),
        TEXT: f"{text}\n".encode(),
        REPORT: analysis_page("Sensitivity", f"What matters in {found.name}", lead(found), sections),
    }


def _cells(found: Sensitivity, metric: OfMetric, row: int) -> list[str]:
    def shown(value: float) -> float:
        return metric_difference(metric.metric, value) if found.method.name == "morris" else value

    cells = []
    for name, values in metric.indices.values.items():
        value = shown(values[row])
        cells.append(f"{value:.3g}" if found.method.name == "morris" else f"{round(value, 3) + 0.0:.3f}")
        band = metric.indices.bands.get(name)
        if band is not None:
            reach = shown(band[row])
            cells.append(f"± {reach:.2g}" if found.method.name == "morris" else f"± {reach:.3f}")
    return cells
