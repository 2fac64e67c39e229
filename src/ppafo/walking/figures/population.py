"""Outcomes of many wearers: histograms over their walks, and two outcomes over a trait of the wearer."""

import textwrap
from typing import TYPE_CHECKING

import numpy as np

from ppafo.report.kind import Kind
from ppafo.report.panels import Mark, Panel, draw_panels
from ppafo.report.style import GREY, VERMILION
from ppafo.walking.walk import SHOWN, Population

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_QUANTILES = (0.05, 0.5, 0.95)
_ROWS = (
    ("gas", "positive_push_off_work", ("stride_time", "gas")),
    ("net_push_off_work", "toe_clearance", ("body_mass", "positive_push_off_work")),
)
"""Outcomes, and pairs of a trait and an outcome."""
_BINS = 40
"""Bins of a histogram."""
_MAXIMUM_POINTS = 2000
"""Wearers that are drawn as points at most; of more an even selection."""
_OWN = {"linestyle": "", "marker": "o", "markersize": 6, "clip_on": False, "zorder": 5}


def population_figure(population: Population) -> "Figure":
    """Return four histograms with quantiles, and two pictures of outcome over trait."""
    panels = []
    for *outcomes, pair in _ROWS:
        panels += [_histogram(population, name) for name in outcomes]
        panels.append(_pair(population, *pair))
    return draw_panels(
        panels,
        across=3,
        size=(2.2, 2.2),
        title=f"{population.scenario.name}: {population.count} wearers, {population.minutes:.3g} min each",
        note="lines: 5th, 50th and 95th percentiles; dot: the wearer of the configuration",
    )


def _histogram(population: Population, name: str) -> Panel:
    values = population.outcomes[name]
    counts, edges = np.histogram(values, _BINS)
    marks = [Mark("bars", edges, counts)]
    for fraction in _QUANTILES:
        width = 1.4 if fraction == 0.5 else 0.9
        marks.append(Mark("at", float(np.quantile(values, fraction)), colour=GREY, style={"linewidth": width}))
    marks.append(Mark("line", values[:1], np.zeros(1), colour=VERMILION, style=_OWN))
    return Panel(_kind_of(name), Kind("Wearers"), marks, then=_set_ticks)


def _pair(population: Population, trait: str, outcome: str) -> Panel:
    x, y = population.traits[trait], population.outcomes[outcome]
    # A picture of a million points shows no more than one of two thousand.
    thin = slice(None, None, max(1, x.size // _MAXIMUM_POINTS))
    points = {"linestyle": "", "marker": ".", "markersize": 2.5, "alpha": 0.35, "markeredgewidth": 0.0}
    marks = [Mark("line", x[thin], y[thin], style=points), Mark("line", x[:1], y[:1], colour=VERMILION, style=_OWN)]
    return Panel(_kind_of(trait), _kind_of(outcome), marks, then=_set_ticks)


def _kind_of(name: str) -> Kind:
    title, quantity, _ = SHOWN[name]
    return Kind("\n".join(textwrap.wrap(title, 34)), "", quantity)


def _set_ticks(axes: "Axes") -> None:
    axes.locator_params(nbins=5)
