"""The answer of a sensitivity analysis: a table for each metric, the most important value first, and what is open."""

from typing import Any

import numpy as np

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import change_text, display_difference, display_unit
from ppafo.answers.shown_metrics import metric_quantity
from ppafo.questions.sensitivity.analyse import OfMetric, Sensitivity
from ppafo.questions.sensitivity.figure import sensitivity_figure
from ppafo.questions.sensitivity.methods import Indices
from ppafo.simulation.document import plain

_TITLES = {
    "total": "total",
    "first": "first order",
    "mean_effect": "mean effect",
    "spread": "spread of effect",
    "shapley": "Shapley effect",
}
_CAPTION = (
    "Left: the indices with their bands. Right: the largest of them, in the colours of their names, from growing "
    "parts of the sample: whether they have converged."
)


def answer_of(found: Sensitivity) -> Answer:
    """Return the answer of a sensitivity analysis; indices of Morris are in the SI unit of the metric in its data."""
    figure = Figure("sensitivity", _CAPTION, lambda: sensitivity_figure(found))
    return Answer(
        name="sensitivity",
        kicker="Sensitivity",
        title=f"What matters in {found.name}",
        lead=tuple(lead(found)),
        sections=(
            *(_metric_section(found, metric) for metric in found.metrics),
            Section("Indices and their convergence", figure=figure, is_detail=True),
        ),
        data=_data(found),
    )


def _metric_section(found: Sensitivity, metric: OfMetric) -> Section:
    head = tuple(map(Column, table_head(found, metric)))
    rows = tuple(map(tuple, table_rows(found, metric)))
    return Section(heading(found, metric), table=Table(head, rows), remarks=tuple(remarks(found, metric)))


def lead(found: Sensitivity) -> list[str]:
    """Return what was done, and what became of runs that failed."""
    settings, method = found.settings, found.method
    return [
        f"{found.name}: {method.name}, {settings.samples:,} {method.sizes_label}, {found.runs:,} runs of "
        f"{len(found.paths)} uncertain values; bands with {100.0 * settings.confidence:g} % confidence",
        f"{found.failures:,} runs failed; up to {100.0 * settings.maximum_failed:g} % are allowed, and every "
        f"{method.block_label} with a failed run is left out",
    ]


def heading(found: Sensitivity, metric: OfMetric) -> str:
    """Return the name of a metric with its mean and standard deviation."""
    spread = f"sd {change_text(metric.sd, metric_quantity(metric.metric))}"
    dropped = f"; {metric.dropped_blocks:,} of {found.settings.samples:,} {found.method.sizes_label} left out"
    return f"{metric.metric}: {spread}{dropped if metric.dropped_blocks else ''}"


def table_head(found: Sensitivity, metric: OfMetric) -> list[str]:
    """Return the head of the table of a metric."""
    unit = display_unit(metric_quantity(metric.metric)) if found.method.name == "morris" else ""
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
    unsettled = found.overlapping_pairs(metric)
    if unsettled:
        pairs = ", ".join(f"{first} and {second}" for first, second in unsettled)
        said.append(f"not converged at this size, their bands overlap: {pairs}")
    if "first" in metric.indices.values:
        said.append(_interactions(metric.indices))
    return said


def _interactions(indices: Indices) -> str:
    """Return what is left for interactions; a rest within the error of the sum may be none."""
    alone = float(np.sum(indices.values["first"]))
    error = float(np.linalg.norm(indices.bands["first"]))
    if alone + error < 1.0:
        return f"first-order indices sum to {alone:.3f} ± {error:.2g}; the rest comes from interactions"
    return f"first-order indices sum to {alone:.3f} ± {error:.2g}: interactions, if any, are within this error"


def _data(found: Sensitivity) -> dict[str, Any]:
    return {
        "study": found.name,
        "method": found.method.name,
        "settings": plain(found.settings),
        "paths": list(found.paths),
        "runs": found.runs,
        "failed": found.failures,
        "policy": "above the maximum fraction refused; below, every block with a failed run is left out",
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


def _cells(found: Sensitivity, metric: OfMetric, row: int) -> list[str]:
    def to_display(value: float) -> float:
        return display_difference(value, metric_quantity(metric.metric)) if found.method.name == "morris" else value

    cells = []
    for name, values in metric.indices.values.items():
        value = to_display(values[row])
        cells.append(f"{value:.3g}" if found.method.name == "morris" else f"{round(value, 3) + 0.0:.3f}")
        band = metric.indices.bands.get(name)
        if band is not None:
            reach = to_display(band[row])
            cells.append(f"± {reach:.2g}" if found.method.name == "morris" else f"± {reach:.3f}")
    return cells
