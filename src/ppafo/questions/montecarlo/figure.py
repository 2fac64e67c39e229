"""The figure of a Monte Carlo estimate: how its interval closes, and what was drawn."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.display_units import display_difference, display_value, display_values
from ppafo.answers.layout import Margins, figure_of_free_panels
from ppafo.answers.shown_metrics import metric_quantity, metric_title
from ppafo.answers.style import BLUE, GREY, VERMILION, house_style, mark_kind
from ppafo.questions.montecarlo.estimate import MonteCarlo
from ppafo.studies.distributions import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE = (8.4, 3.5)
_MARGINS = Margins(left=0.85, right=0.2, top=0.55, bottom=0.55, row_gap=0.0, column_gap=0.95)
_MAXIMUM_BINS = 80


def monte_carlo_figure(estimate: MonteCarlo) -> "Figure":
    """Return trace and histogram side by side."""
    with house_style():
        figure, ((trace, drawn),) = figure_of_free_panels(_SIZE, _MARGINS, 1, 2)
        _draw_trace(trace, estimate)
        _draw_values(drawn, estimate)
        mark_kind(figure, "simulated")
        return figure


def _draw_trace(axes: "Axes", estimate: MonteCarlo) -> None:
    draws = [look.draws for look in estimate.looks]
    rows = [(look.interval.value, look.interval.low, look.interval.high) for look in estimate.looks]
    values = _in_display_unit(estimate, np.array(rows))
    known = np.isfinite(values).all(axis=1)
    axes.vlines(np.array(draws)[known], values[known, 1], values[known, 2], color=BLUE, linewidth=3, alpha=0.45)
    axes.plot(draws, values[:, 0], "o-", color=BLUE, markersize=5, linewidth=1.0)
    reach = 0.5 * estimate.rule.width * (abs(values[-1, 0]) if estimate.rule.is_relative else _scale(estimate))
    axes.axhspan(values[-1, 0] - reach, values[-1, 0] + reach, color=GREY, alpha=0.18, linewidth=0)
    axes.set_xscale("log", base=2)
    axes.set_xlabel("Draws")
    axes.set_title(f"{estimate.statistic.label[:1].upper()}{estimate.statistic.label[1:]}")
    axes.set_ylabel("Probability" if estimate.statistic.unit == "-" else metric_title(estimate.metric))


def _draw_values(axes: "Axes", estimate: MonteCarlo) -> None:
    values = display_values(estimate.values, metric_quantity(estimate.metric))
    axes.hist(values, bins=min(_MAXIMUM_BINS, max(10, int(np.sqrt(values.size)))), color=BLUE, alpha=0.55)
    threshold = getattr(estimate.statistic, "threshold", None)
    if estimate.statistic.unit != "-" or threshold is None:
        axes.axvline(
            float(_in_display_unit(estimate, np.array(estimate.last.interval.value))), color=VERMILION, linewidth=1.4
        )
    else:
        axes.axvline(display_value(threshold, metric_quantity(estimate.metric)), color=VERMILION, linewidth=1.4)
    axes.set_xlabel(metric_title(estimate.metric))
    axes.set_ylabel("Draws")
    axes.set_title(f"{values.size:,} values")


def _in_display_unit(estimate: MonteCarlo, values: Floats) -> Floats:
    if estimate.statistic.unit == "-":
        return values
    return display_values(values, metric_quantity(estimate.metric))


def _scale(estimate: MonteCarlo) -> float:
    return 1.0 if estimate.statistic.unit == "-" else display_difference(1.0, metric_quantity(estimate.metric))
