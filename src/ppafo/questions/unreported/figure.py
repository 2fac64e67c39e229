"""What the paper left unsaid, as a figure: each setting as allowed and as its results imply it, and the results."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.style import BLUE, GREY, VERMILION, house_style
from ppafo.questions.unreported.evidence import improvement, saving
from ppafo.questions.unreported.implications import Implication, implications_of
from ppafo.questions.unreported.settings import SETTINGS, Floats, Setting
from ppafo.questions.unreported.solve import Family

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE = (9.6, 7.6)
_COLUMNS = 4
_BINS = 30
_SHOWN_DOTS = 4000


def unreported_figure(family: Family) -> "Figure":
    """Return the panels of all settings, allowed in grey and implied in blue, and one of the two main results."""
    rows = -(-(len(SETTINGS) + 1) // _COLUMNS)
    from matplotlib.figure import Figure

    with house_style():
        figure = Figure(figsize=_SIZE)
        figure.subplots_adjust(left=0.03, right=0.98, top=0.9, bottom=0.07, hspace=0.62, wspace=0.22)
        panels = figure.subplots(rows, _COLUMNS).ravel().tolist()
        weights = family.weights
        for axes, setting, result in zip(panels, SETTINGS, implications_of(family), strict=False):
            _setting(axes, setting, family.draws[setting.name], weights, result)
        _results(panels[len(SETTINGS)], family)
        for axes in panels[len(SETTINGS) + 1 :]:
            axes.set_axis_off()
        figure.text(
            0.01,
            0.985,
            "What the paper left unsaid: prior in grey, posterior in blue (simulated; effective sample size "
            f"{family.effective:.0f})",
            va="top",
            fontsize=11,
        )
        return figure


def _setting(axes: "Axes", setting: Setting, values: Floats, weights: Floats, result: Implication) -> None:
    axes.set_title(f"{setting.name}{f' ({setting.unit})' if setting.unit else ''}", fontsize=9.5)
    axes.set_xlabel(result.verdict, fontsize=9, color=BLUE if result.verdict == "implied" else GREY)
    axes.set_yticks([])
    if setting.choices:
        places = np.arange(len(setting.choices))
        axes.bar(places, np.full(places.size, 1.0 / places.size), width=0.85, color=GREY, alpha=0.3)
        axes.bar(places, result.fractions, width=0.5, color=BLUE)
        names = setting.words or [f"{choice:g}" for choice in setting.choices]
        axes.set_xticks(places, [_short(name) for name in names], fontsize=7.5)
        return
    scale = np.log10 if setting.is_logarithmic else np.asarray
    edges = np.linspace(scale(setting.low), scale(setting.high), _BINS + 1)
    axes.hist(edges[:-1], bins=list(edges), weights=np.full(_BINS, 1.0 / _BINS), color=GREY, alpha=0.3)
    axes.hist(scale(values), bins=list(edges), weights=weights, color=BLUE)
    if setting.is_logarithmic:
        ticks = np.array(
            [value for value in (0.3, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0) if setting.low <= value <= setting.high]
        )
        axes.set_xticks(np.log10(ticks), [f"{tick:g}" for tick in ticks])


def _short(words: str) -> str:
    """Return the words on two lines."""
    parts = words.split()
    half = (len(parts) + 1) // 2
    return " ".join(parts[:half]) + ("\n" + " ".join(parts[half:]) if parts[half:] else "")


def _results(axes: "Axes", family: Family) -> None:
    better, less = improvement(family.metrics), saving(family.metrics)
    even = slice(0, min(family.even, _SHOWN_DOTS))
    axes.plot(less[even], better[even], ".", markersize=1.5, color=GREY, alpha=0.5)
    likely = np.argsort(-family.weights)[: _SHOWN_DOTS // 8]
    likely = likely[family.weights[likely] > 0.0]
    axes.plot(less[likely], better[likely], ".", markersize=2.0, color=BLUE)
    axes.plot([63.0], [15.0], "+", markersize=11, markeredgewidth=1.6, color=VERMILION)
    axes.set_xlim(-20.0, 100.0)
    axes.set_ylim(-60.0, 60.0)
    axes.set_title("improvement (%) over saving (%)", fontsize=9.5)
    axes.set_xlabel("+ the paper", fontsize=9, color=VERMILION)
