"""Figures of a comparison: error against gas, and how the change spreads over the draws."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.display_units import display_values
from ppafo.answers.layout import Margins, figure_of_free_panels
from ppafo.answers.shown_metrics import metric_quantity, metric_title, metric_words
from ppafo.answers.style import BLACK, COLOURS, GREY, house_style, label_lines, mark_kind
from ppafo.questions.compare.paired import pareto_front
from ppafo.questions.compare.solve import Case, Comparison
from ppafo.studies.distributions import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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


def has_changes(comparison: Comparison) -> bool:
    """Tell whether there are draws whose changes can be drawn."""
    return comparison.draws > 0 and has_errors(comparison)


def pareto_figure(comparison: Comparison) -> "Figure":
    """Return error against gas, a panel for each task."""
    tasks = list(comparison.tasks)
    height = _MARGINS.top + len(tasks) * _PANEL + (len(tasks) - 1) * _MARGINS.row_gap + _MARGINS.bottom
    with house_style():
        figure, grid = figure_of_free_panels((_WIDTH, height), _MARGINS, len(tasks), 1)
        for task, (axes,) in zip(tasks, grid, strict=True):
            _draw_pareto(axes, comparison, task)
        mark_kind(figure, "simulated")
        return figure


def change_figure(comparison: Comparison) -> "Figure":
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
            axes.plot(gas, error, ".", color=colour, alpha=0.18, markersize=4, markeredgewidth=0)
        axes.plot(*points[number], mark, color=colour, markersize=8, markeredgecolor="white", label=case.configuration)
    front = points[pareto_front(points)]
    front = front[np.argsort(front[:, 0])]
    axes.plot(front[:, 0], front[:, 1], "-", color=GREY, linewidth=1.0, zorder=1)
    axes.set_xlabel(metric_title(_GAS))
    axes.set_ylabel(metric_title(_ERROR))
    axes.set_title(f"Task: {task}")
    axes.margins(0.08)
    label_lines(axes)


def _point(case: Case) -> tuple[float, float]:
    gas, error = (_in_display_unit(np.array([case.metrics[name].value]), name)[0] for name in (_GAS, _ERROR))
    return float(gas), float(error)


def _in_display_unit(values: Floats, name: str) -> Floats:
    return display_values(values, metric_quantity(name))


def _draw_change(axes: "Axes", comparison: Comparison, task: str, metric: str) -> None:
    cases = {case.configuration: case for case in comparison.of_task(task)}
    baseline = cases[comparison.baseline]
    for number, name in enumerate(comparison.configurations):
        own, first = cases[name].outcomes, baseline.outcomes
        if name == comparison.baseline or own is None or first is None:
            continue
        colour = COLOURS[number % len(COLOURS)]
        change = _change(first.metrics[metric], own.metrics[metric])
        if change.size == 0:
            continue
        reach = np.percentile(change, _SHOWN)
        axes.hist(change, bins=_BINS, range=(reach[0], reach[1]), color=colour, alpha=0.55, label=name)
        if metric in baseline.metrics and metric in cases[name].metrics:
            nominal = _change(np.array([baseline.metrics[metric].value]), np.array([cases[name].metrics[metric].value]))
            for value in nominal:
                axes.axvline(value, color=colour, linestyle="--", linewidth=1.2)
    axes.axvline(0.0, color=BLACK, linewidth=0.8)
    axes.set_xlabel(f"{metric_words(metric)} against {comparison.baseline} (%)")
    axes.set_title(f"Task: {task}" if metric == _ERROR else "")
    if metric == _GAS:
        label_lines(axes)


def _change(baseline: Floats, other: Floats) -> Floats:
    both = np.isfinite(baseline) & np.isfinite(other) & (baseline != 0.0)
    return np.asarray(100.0 * (other[both] - baseline[both]) / np.abs(baseline[both]))
