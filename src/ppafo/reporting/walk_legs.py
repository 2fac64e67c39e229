"""Shank and foot as a stick figure: how a leg is drawn, and which legs belong to a stride of a walk."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ppafo.reporting.style import GREY
from ppafo.signals.recording import Floats
from ppafo.walking.followed_gait import gait_timing
from ppafo.walking.posture import Posture, ankle_path
from ppafo.walking.walk import WalkResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D
    from matplotlib.patches import Polygon

GHOST = "#b9b9b9"
DRAGS = "#a4001d"
DRAG_LIMIT = -0.01
"""Toes below the ground by more than this [m] are shown as dragging; hip and knee could give less."""


@dataclass(frozen=True, slots=True, eq=False)
class Legs:
    """Postures of one walk and of the healthy gait at the same instants, and their running phases [strides]."""

    turns: Floats
    worn: Posture
    healthy: Posture


def legs_of(result: WalkResult, turns: Floats) -> Legs:
    """Return the legs of a walk at running phases [strides], counted from the start of the recording."""
    configuration, recording = result.configuration, result.recording
    gait = configuration.gait
    path = ankle_path(gait, gait_timing(gait), configuration.wearer)
    times = turns * gait.stride_time
    shank, angle, healthy = (
        np.interp(times, recording.time, recording[name]) for name in ("shank_angle", "angle", "healthy_angle")
    )
    return Legs(turns, path.posture(turns, shank, angle), path.posture(turns, shank, healthy))


def settled_turns(result: WalkResult, strides: int, per_stride: int) -> Floats:
    """Return running phases of some strides near the end of a walk, an equal number in each."""
    last = int(result.recording.time[-1] / result.configuration.gait.stride_time + 1.0e-6)
    count = min(strides, max(1, last - 1))
    return np.asarray(last - count + np.arange(count * per_stride) / per_stride)


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
    """Add the lines of one leg to an axes, nowhere yet."""
    from matplotlib.patches import Polygon

    order = 2.0 if is_ghost else 3.0
    (shank,) = axes.plot([], [], color=colour, linewidth=width, zorder=order, solid_capstyle="round")
    foot = Polygon(
        np.zeros((3, 2)),
        facecolor="none" if is_ghost else colour,
        edgecolor=colour,
        linewidth=0.6 * width,
        joinstyle="round",
        zorder=order,
    )
    axes.add_patch(foot)
    size = 0.0 if is_ghost else 1.6 * width
    (joint,) = axes.plot([], [], "o", color="white", markeredgecolor=colour, markersize=size, zorder=order + 0.5)
    return LegArtists(shank, foot, joint)


def draw_ground(axes: "Axes", left: float, right: float) -> None:
    """Draw the ground."""
    axes.plot([left, right], [0.0, 0.0], color=GREY, linewidth=1.0, zorder=1)
    axes.fill_between([left, right], [-0.25, -0.25], [0.0, 0.0], color="#f1f1f1", linewidth=0.0, zorder=0)


def drags(legs: Legs, index: int) -> bool:
    """Tell whether the toes are below the ground while the foot swings."""
    return bool(legs.worn.toe[index, 1] < DRAG_LIMIT)


def _joints(posture: Posture) -> tuple[Floats, ...]:
    return posture.knee, posture.ankle, posture.heel, posture.toe
