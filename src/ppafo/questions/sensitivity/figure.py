"""The figure of a sensitivity analysis: a row for each metric, indices to the left, how they settle to the right."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.display_units import axis_unit, display_difference
from ppafo.answers.layout import Margins, figure_of_free_panels
from ppafo.answers.shown_metrics import metric_quantity
from ppafo.answers.style import BLUE, COLOURS, ORANGE, house_style, mark_kind
from ppafo.questions.sensitivity.analyse import OfMetric, Sensitivity
from ppafo.studies.distributions import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH, _RIGHT_PANEL = 9.6, 1.0
_LETTER, _LINE = 0.083, 0.27
_MAXIMUM_LINES = 5
_TITLES = {
    "total": "total",
    "first": "first order",
    "mean_effect": "mean effect",
    "spread": "spread",
    "shapley": "Shapley effect",
}


def sensitivity_figure(found: Sensitivity) -> "Figure":
    """Return the figure; the left names are those of the uncertain values."""
    names = 0.25 + _LETTER * max(len(path) for path in found.paths)
    margins = Margins(left=names, right=0.2, top=0.55, bottom=0.55, row_gap=0.95, column_gap=0.75)
    panel = max(2.0, _LINE * len(found.paths))
    rows = len(found.metrics)
    height = margins.top + rows * panel + (rows - 1) * margins.row_gap + margins.bottom
    with house_style():
        figure, grid = figure_of_free_panels((_WIDTH, height), margins, rows, 2)
        for metric, (bars, course) in zip(found.metrics, grid, strict=True):
            _draw_indices(bars, found, metric)
            _draw_settling(course, found, metric)
        mark_kind(figure, "simulated")
        return figure


def _draw_indices(axes: "Axes", found: Sensitivity, metric: OfMetric) -> None:
    shown = found.method.shown
    order = np.argsort(metric.indices.values[shown[0]])
    places = np.arange(order.size)
    for name, colour, shift in zip(shown, (BLUE, ORANGE), (0.14, -0.14), strict=False):
        values = _in_display_unit(found, metric, metric.indices.values[name])[order]
        band = metric.indices.bands.get(name)
        reach = None if band is None else _in_display_unit(found, metric, band)[order]
        axes.errorbar(
            values, places + shift, xerr=reach, fmt="o", color=colour, markersize=5, elinewidth=1.4, label=_TITLES[name]
        )
    axes.set_yticks(places, [found.paths[row] for row in order])
    for label, colour in zip(reversed(axes.get_yticklabels()), COLOURS[:_MAXIMUM_LINES], strict=False):
        label.set_color(colour)
    axes.axvline(0.0, color="#9a9a9a", linewidth=0.8)
    axes.set_xlabel(_unit(found, metric))
    axes.set_title(metric.metric)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.1, handlelength=1.0)


def _draw_settling(axes: "Axes", found: Sensitivity, metric: OfMetric) -> None:
    name = found.method.shown[0]
    order = np.argsort(-metric.indices.values[name])[:_MAXIMUM_LINES]
    sizes = [each.blocks for each in metric.settling]
    for colour, row in zip(COLOURS, order, strict=False):
        values = _in_display_unit(found, metric, np.array([each.indices.values[name][row] for each in metric.settling]))
        bands = _in_display_unit(found, metric, np.array([each.indices.bands[name][row] for each in metric.settling]))
        axes.plot(sizes, values, "o-", color=colour, markersize=3.5, linewidth=1.2, label=found.paths[row])
        axes.fill_between(sizes, values - bands, values + bands, color=colour, alpha=0.15, linewidth=0)
    axes.set_xscale("log", base=2)
    axes.set_xlabel(f"{found.method.sizes_label[:1].upper()}{found.method.sizes_label[1:]}")
    axes.set_title(f"{_TITLES[name][:1].upper()}{_TITLES[name][1:]}, {order.size} largest")


def _in_display_unit(found: Sensitivity, metric: OfMetric, values: Floats) -> Floats:
    return values * display_difference(1.0, metric_quantity(metric.metric)) if found.method.name == "morris" else values


def _unit(found: Sensitivity, metric: OfMetric) -> str:
    if found.method.name != "morris":
        return "Fraction of the variance"
    unit = axis_unit(metric_quantity(metric.metric))
    return f"Change over the range ({unit})" if unit else "Change over the range"
