"""A stride as a strip of stick figures: with the device, without it, and the healthy foot as a ghost behind both."""

from typing import TYPE_CHECKING

from ppafo.reporting.style import GREY, house_style, mark_kind
from ppafo.reporting.walk_figure import WITH, WITHOUT
from ppafo.reporting.walk_legs import DRAGS, GHOST, drags, draw_ground, leg_artists, legs_of, settled_turns
from ppafo.walking.comparison import Comparison
from ppafo.walking.walk import WalkResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE = (10.4, 3.75)
_FRAMES = 10
_SLOT = 0.62
"""Width of the ground under one frame [m]."""


def frames_figure(comparison: Comparison) -> "Figure":
    """Return ten instants of one stride, without the device above and with it below."""
    from matplotlib.figure import Figure

    with house_style():
        figure = Figure(figsize=_SIZE)
        figure.subplots_adjust(left=0.012, right=0.988, top=0.86, bottom=0.01, hspace=0.04)
        rows = figure.subplots(2, 1, sharex=True)
        _row(rows[0], comparison.without_device, "without the device", WITHOUT)
        _row(rows[1], comparison.with_device, "with the device", WITH)
        width, height = _SIZE
        name = comparison.with_device.configuration.name
        figure.text(0.12 / width, 1 - 0.12 / height, f"{name}: one stride", ha="left", va="top", fontweight="bold")
        remark = "grey outline: the healthy foot; cross: toes more than 1 cm below ground; percent of the stride below"
        figure.text(0.12 / width, 1 - 0.36 / height, remark, ha="left", va="top", fontsize=9, color=GREY)
        mark_kind(figure, comparison.with_device.recording.kind)
        return figure


def _row(axes: "Axes", result: WalkResult, label: str, colour: str) -> None:
    turns = settled_turns(result, 1, _FRAMES)
    legs = legs_of(result, turns)
    draw_ground(axes, 0.0, _SLOT * turns.size)
    for index in range(turns.size):
        middle = _SLOT * (index + 0.47)
        offset = legs.healthy.ankle[index, 0] - middle
        leg_artists(axes, GHOST, 1.8, is_ghost=True).place(legs.healthy, index, offset)
        leg_artists(axes, colour, 3.0).place(legs.worn, index, offset)
        if drags(legs, index):
            toe = legs.worn.toe[index] - (offset, 0.0)
            axes.plot(toe[0], toe[1], "x", color=DRAGS, markersize=9, markeredgewidth=2.2, zorder=5)
        percent = f"{100.0 * (turns[index] % 1.0):.0f} %"
        axes.text(middle, -0.135, percent, ha="center", va="top", fontsize=8.5, color=GREY)
    axes.text(0.3, 0.66, label, ha="left", va="top", color=colour, fontsize=10.5)
    axes.set_xlim(0.0, _SLOT * turns.size)
    axes.set_ylim(-0.22, 0.68)
    axes.set_aspect("equal", adjustable="box")
    axes.set_axis_off()
