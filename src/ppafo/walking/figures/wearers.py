"""Histograms of what many wearers get, and how it goes with what they are."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.display_units import display_values, title_with_unit
from ppafo.answers.style import BLUE, GREY, VERMILION, house_style, mark_kind
from ppafo.walking.population import Population

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = {
    "gas": ("Gas per stride", "gas mass", 3),
    "push_off_work": ("Work on the wearer in push-off", "energy", 2),
    "slap_rate": ("Rate of the foot as it comes down", "angular velocity", 0),
    "toe_clearance": ("Lowest toe height in mid-swing, relative to healthy", "body length", 1),
    "toe_landing": ("Strides that begin on the toes", "fraction", 0),
    "body_mass": ("Body mass", "mass", 1),
    "shank_length": ("Shank", "body length", 1),
    "stride_time": ("Stride time", "time", 3),
    "stance_share": ("Stance", "fraction", 1),
}
"""Title, kind of quantity, and digits behind the point of what is known of every wearer."""

_SIZE = (9.4, 5.6)
_DRAWN_QUANTILES = (0.05, 0.5, 0.95)
_HISTOGRAMS = ("gas", "push_off_work", "slap_rate", "toe_clearance")
_PAIRS = (("stride_time", "gas"), ("body_mass", "push_off_work"))
_BINS = 40
_MAXIMUM_POINTS = 2000


def population_figure(population: Population) -> "Figure":
    """Return four histograms with quantiles, and two pictures of outcome over trait."""
    from matplotlib.figure import Figure

    with house_style():
        figure = Figure(figsize=_SIZE)
        figure.subplots_adjust(left=0.06, right=0.985, top=0.885, bottom=0.095, hspace=0.36, wspace=0.27)
        grid = figure.subplots(2, 3).ravel().tolist()
        for axes, name in zip((grid[0], grid[1], grid[3], grid[4]), _HISTOGRAMS, strict=True):
            _histogram(axes, population, name)
        for axes, (trait, outcome) in zip((grid[2], grid[5]), _PAIRS, strict=True):
            _scatter(axes, population, trait, outcome)
        width, height = _SIZE
        title = f"{population.scenario.name}: {population.count} wearers, {population.minutes:.3g} min each"
        figure.text(0.12 / width, 1.0 - 0.12 / height, title, ha="left", va="top", fontweight="bold")
        remark = "lines: 5th, 50th and 95th percentiles; dot: the wearer of the configuration"
        figure.text(0.12 / width, 1.0 - 0.36 / height, remark, ha="left", va="top", fontsize=9, color=GREY)
        mark_kind(figure, "simulated")
        return figure


def _histogram(axes: "Axes", population: Population, name: str) -> None:
    title, quantity, _ = SHOWN[name]
    values = display_values(population.outcomes[name], quantity)
    axes.hist(values, bins=_BINS, color=BLUE, alpha=0.55)
    for fraction in _DRAWN_QUANTILES:
        axes.axvline(float(np.quantile(values, fraction)), color=GREY, linewidth=1.4 if fraction == 0.5 else 0.9)
    axes.plot(values[0], 0.0, "o", color=VERMILION, markersize=6, clip_on=False, zorder=5)
    axes.set_xlabel(title_with_unit(title, quantity), fontsize=9)
    axes.set_ylabel("Wearers", fontsize=9)
    axes.locator_params(nbins=5)


def _scatter(axes: "Axes", population: Population, trait: str, outcome: str) -> None:
    (across, across_quantity, _), (up, up_quantity, _) = SHOWN[trait], SHOWN[outcome]
    x = display_values(population.traits[trait], across_quantity)
    y = display_values(population.outcomes[outcome], up_quantity)
    thin = slice(None, None, max(1, x.size // _MAXIMUM_POINTS))
    axes.plot(x[thin], y[thin], ".", color=BLUE, markersize=2.5, alpha=0.35, markeredgewidth=0.0)
    axes.plot(x[0], y[0], "o", color=VERMILION, markersize=6)
    axes.set_ylabel(title_with_unit(up, up_quantity), fontsize=9)
    axes.set_xlabel(title_with_unit(across, across_quantity), fontsize=9)
    axes.locator_params(nbins=5)
