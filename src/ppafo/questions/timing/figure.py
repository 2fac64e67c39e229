"""Errors of event times as bars: for each wearer and way one bar for each timing."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.style import BLUE, GREY, VERMILION, house_style, mark_kind
from ppafo.control.walking.catalog import TIMINGS
from ppafo.questions.timing.solve import WEARERS, Timing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLOURS = (GREY, BLUE, VERMILION)
_WIDTH = 0.26
_MILLISECONDS = 1.0e3


def timing_figure(timing: Timing) -> "Figure":
    """Return the figure: RMS errors of all events, one panel for each wearer, one group of bars for each way."""
    from matplotlib.figure import Figure

    with house_style():
        figure = Figure(figsize=(8.4, 3.8))
        figure.subplots_adjust(left=0.08, right=0.98, top=0.84, bottom=0.14, wspace=0.08)
        panels = figure.subplots(1, len(WEARERS), sharey=True)
        for axes, wearer in zip(panels, WEARERS, strict=True):
            ways = list(dict.fromkeys(item.way for item in timing.ways))
            for number, name in enumerate(TIMINGS):
                heights = [_MILLISECONDS * timing.pooled(wearer, name, [way]) for way in ways]
                places = np.arange(len(ways)) + (number - 1.0) * _WIDTH
                axes.bar(places, heights, _WIDTH, color=_COLOURS[number % len(_COLOURS)], label=name)
            axes.set_xticks(range(len(ways)), ways)
            axes.set_title(wearer)
            axes.grid(visible=False, axis="x")
        panels[0].set_ylabel("RMS error of event times (ms)")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="upper right", ncols=len(TIMINGS))
        mark_kind(figure, "simulated")
        return figure
