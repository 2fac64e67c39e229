"""Shank and foot as a stick figure: how a leg is drawn, and which legs belong to a stride of a walk."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ppafo.answers.style import GREY, house_style, mark_kind
from ppafo.signals.recording import Floats
from ppafo.walking.comparison import Comparison
from ppafo.walking.figures.mean_stride import WITH, WITHOUT
from ppafo.walking.gait_series import gait_timing
from ppafo.walking.motion import walk_of
from ppafo.walking.posture import Posture, ankle_path
from ppafo.walking.result import WalkResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Polygon

GHOST = "#5a5a5a"
"""The healthy foot: dark enough to be seen on a coloured one, in front of which it is drawn."""
DRAGS = "#a4001d"
DRAG_LIMIT = -0.01
"""Toes below the ground by more than this [m] are shown as dragging; hip and knee could give less."""


_STRIP_SIZE = (10.4, 3.75)
_FRAMES = 10
_SLOT = 0.62
"""Width of the ground under one frame [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Legs:
    """Postures of one walk and of the healthy gait at the same instants, and their running phases [strides]."""

    turns: Floats
    worn: Posture
    healthy: Posture


def legs_of(result: WalkResult, turns: Floats) -> Legs:
    """Return the legs of a walk at running phases [strides], counted from the start of the recording."""
    configuration, recording = result.scenario, result.recording
    gait = walk_of(configuration).gait
    path = ankle_path(gait, gait_timing(gait), walk_of(configuration).wearer)
    times = turns * gait.stride_time
    shank, angle, healthy = (
        np.interp(times, recording.time, recording[name]) for name in ("shank_angle", "angle", "healthy_angle")
    )
    return Legs(turns, path.posture(turns, shank, angle), path.posture(turns, shank, healthy))


def last_phases(result: WalkResult, strides: int, per_stride: int) -> Floats:
    """Return running phases [strides] of some strides near the end of a walk, an equal number in each.

    They are the last ones in a row that had help, where there are as many.
    """
    last = int(result.recording.time[-1] / walk_of(result.scenario).gait.stride_time + 1.0e-6)
    count = min(strides, max(1, last - 1))
    last = _last_helped(result.helped, last, count)
    return np.asarray(last - count + np.arange(count * per_stride) / per_stride)


def _last_helped(helped: NDArray[np.bool_], last: int, count: int) -> int:
    """Return the end [strides] of the last ``count`` strides with help up to ``last``; that where there are none."""
    if helped.all():
        return last
    # The walk begins with a stride of its own, at a heel strike that is not counted.
    ends = [end for end in range(last, count, -1) if helped[end - count - 1 : end - 1].sum() == count]
    return ends[0] if ends else last


@dataclass(frozen=True, slots=True, eq=False)
class LegArtists:
    """The lines of one leg: shank, and the foot as a wedge of ankle, heel and toes."""

    shank: "Line2D"
    foot: "Polygon"
    joint: "Line2D"

    def place(self, posture: Posture, index: int, offset: float) -> None:
        """Move the leg to one instant; ``offset`` [m] is taken from x."""
        knee, ankle, heel, toe = (points[index] - (offset, 0.0) for points in _joints(posture))
        self.shank.set_data([knee[0], ankle[0]], [knee[1], ankle[1]])
        self.foot.set_xy([ankle, heel, toe])
        self.joint.set_data([knee[0], ankle[0]], [knee[1], ankle[1]])

    def colour(self, shade: str) -> None:
        """Paint the foot."""
        self.foot.set_facecolor(shade)
        self.foot.set_edgecolor(shade)


def leg_artists(axes: "Axes", colour: str, width: float, is_ghost: bool = False) -> LegArtists:
    """Add the lines of one leg to an axes, of a line width [points]; ``place`` puts them somewhere."""
    from matplotlib.patches import Polygon

    order, foot_order = (2.0, 3.2) if is_ghost else (3.0, 3.0)
    (shank,) = axes.plot([], [], color=colour, linewidth=width, zorder=order, solid_capstyle="round")
    foot = Polygon(
        np.zeros((3, 2)),
        facecolor="none" if is_ghost else colour,
        edgecolor=colour,
        linewidth=0.6 * width,
        joinstyle="round",
        zorder=foot_order,
    )
    axes.add_patch(foot)
    size = 0.0 if is_ghost else 1.6 * width
    (joint,) = axes.plot([], [], "o", color="white", markeredgecolor=colour, markersize=size, zorder=3.5)
    return LegArtists(shank, foot, joint)


def draw_ground(axes: "Axes", left: float, right: float) -> None:
    """Draw the ground between two places [m]."""
    axes.plot([left, right], [0.0, 0.0], color=GREY, linewidth=1.0, zorder=1)
    axes.fill_between([left, right], [-0.25, -0.25], [0.0, 0.0], color="#f1f1f1", linewidth=0.0, zorder=0)


def drags(legs: Legs, index: int) -> bool:
    """Return whether the toes are more than 1 cm below the ground."""
    return bool(legs.worn.toe[index, 1] < DRAG_LIMIT)


def _joints(posture: Posture) -> tuple[Floats, ...]:
    return posture.knee, posture.ankle, posture.heel, posture.toe


def frames_figure(comparison: Comparison) -> "Figure":
    """Return ten instants of one stride, without the device above and with it below."""
    from matplotlib.figure import Figure

    with house_style():
        figure = Figure(figsize=_STRIP_SIZE)
        figure.subplots_adjust(left=0.012, right=0.988, top=0.86, bottom=0.01, hspace=0.04)
        rows = figure.subplots(2, 1, sharex=True)
        _row(rows[0], comparison.without_device, "without the device", WITHOUT)
        _row(rows[1], comparison.with_device, "with the device", WITH)
        width, height = _STRIP_SIZE
        name = comparison.with_device.scenario.name
        figure.text(0.12 / width, 1 - 0.12 / height, f"{name}: one stride", ha="left", va="top", fontweight="bold")
        remark = "grey outline: the healthy foot; cross: toes more than 1 cm below ground; percent of the stride below"
        figure.text(0.12 / width, 1 - 0.36 / height, remark, ha="left", va="top", fontsize=9, color=GREY)
        mark_kind(figure, comparison.with_device.recording.kind)
        return figure


def _row(axes: "Axes", result: WalkResult, label: str, colour: str) -> None:
    turns = last_phases(result, 1, _FRAMES)
    legs = legs_of(result, turns)
    draw_ground(axes, 0.0, _SLOT * turns.size)
    for index in range(turns.size):
        middle = _SLOT * (index + 0.47)
        offset = legs.healthy.ankle[index, 0] - middle
        leg_artists(axes, GHOST, 1.5, is_ghost=True).place(legs.healthy, index, offset)
        leg_artists(axes, colour, 3.0).place(legs.worn, index, offset)
        if drags(legs, index):
            toe = legs.worn.toe[index] - (offset, 0.0)
            axes.plot(toe[0], toe[1], "x", color=DRAGS, markersize=9, markeredgewidth=2.2, zorder=5)
        percent = f"{100.0 * (turns[index] % 1.0):.0f} %"
        axes.text(middle, -0.135, percent, ha="center", va="top", fontsize=8.5, color=GREY)
    axes.text(0.0, 0.66, label, ha="left", va="top", color=colour, fontsize=10.5)
    axes.set_xlim(0.0, _SLOT * turns.size)
    axes.set_ylim(-0.22, 0.68)
    axes.set_aspect("equal", adjustable="box")
    axes.set_axis_off()
