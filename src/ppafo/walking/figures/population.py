"""Figure of the outcomes of many wearers: histograms, and scatter plots of outcomes against a trait of the wearer."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.report.kind import Kind
from ppafo.report.panels import Mark, Panel, draw_panels
from ppafo.report.style import BLACK, VERMILION
from ppafo.walking.population import SHOWN, Population

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_QUANTILES = {0.05: "--", 0.5: "-", 0.95: "--"}
"""Quantiles of the wearers, each with its line style."""
_OUTCOMES = ("gas", "positive_push_off_work", "net_push_off_work", "toe_clearance")
_PAIRS = (("stride_time", "gas"), ("body_mass", "positive_push_off_work"))
"""Pairs of a trait and an outcome."""
_BINS = 40
"""Largest number of bins of a histogram; for few wearers about the square root of their number."""
_MAXIMUM_POINTS = 2000
"""Largest number of wearers drawn as points; of more wearers, an evenly spaced subset is drawn."""
_KINDS = {name: Kind(title, "", quantity) for name, (title, quantity, _) in SHOWN.items()}
_OWN = {"linestyle": "", "marker": "o", "markersize": 6, "clip_on": False, "zorder": 5}


def population_figure(population: Population) -> "Figure":
    """Return the figure of a population: four histograms with quantiles, two scatter plots of outcome against trait."""
    panels = [_histogram(population, name) for name in _OUTCOMES]
    points = {"linestyle": "", "marker": ".", "markersize": 4.0, "alpha": 0.5, "markeredgewidth": 0.0}
    for trait, outcome in _PAIRS:
        x, y = population.traits[trait], population.outcomes[outcome]
        # A picture of a million points shows no more than one of two thousand.
        thin = slice(None, None, max(1, x.size // _MAXIMUM_POINTS))
        marks = [Mark("line", x[thin], y[thin], style=points), Mark("line", x[:1], y[:1], colour=VERMILION, style=_OWN)]
        panels.append(Panel(_KINDS[trait], _KINDS[outcome], marks, then=_set_ticks))
    return draw_panels(
        panels,
        across=2,
        size=(2.7, 1.9),
        title=f"{population.scenario.name}: {population.count} wearers, {population.minutes:.3g} min each",
        note="dashed: 5th and 95th percentile; solid: median; dot: wearer of the configuration",
    )


def _histogram(population: Population, name: str) -> Panel:
    values = population.outcomes[name]
    counts, edges = np.histogram(values, max(1, min(_BINS, round(values.size**0.5))))
    marks = [Mark("bars", edges, counts)]
    for fraction, dashes in _QUANTILES.items():
        look = {"linewidth": 1.2, "linestyle": dashes}
        marks.append(Mark("at", float(np.quantile(values, fraction)), colour=BLACK, style=look))
    marks.append(Mark("line", values[:1], np.zeros(1), colour=VERMILION, style=_OWN))
    return Panel(_KINDS[name], Kind("Wearers"), marks, then=_set_ticks)


def _set_ticks(axes: "Axes") -> None:
    axes.locator_params(nbins=5)
