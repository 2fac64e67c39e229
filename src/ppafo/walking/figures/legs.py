"""Stick figures of the leg in a walk and in the healthy gait, and instants of a stride as single frames."""

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.report.style import BLACK, GREY, font_size, house_style, mark_kind, print_scale, printed_width
from ppafo.signals.recording import Floats
from ppafo.walking.figures.mean_stride import WITH, WITHOUT
from ppafo.walking.gait_series import Posture, ankle_path, gait_timing
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import WalkComparison

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_GHOST = "#5a5a5a"
"""Colour of the healthy foot: dark enough to be visible in front of a coloured foot."""
_DRAGS = "#a4001d"
"""Colour of the cross on toes that would drag."""

# Width of the figure [inch], margin at its sides [widths], and height of its title and remark [inch].
_WIDTH = 5.7
_EDGE = 0.015
_HEAD = 0.66
# Number of legs in the picture of one stride, and in a narrower one.
_FRAMES = 10
_FEW_FRAMES = 5
_SLOT = 0.62
"""Width of the ground under one frame [m]."""
_VIEW = (-0.36, 0.86)
"""Lowest and highest point of a row [m]: below the ground is the percent of the stride, above the legs the name."""


def legs_of(result: WalkResult, turns: Floats) -> tuple[Posture, Posture, list[bool]]:
    """Return the postures in a walk and in the healthy gait at running phases [strides] of the recording.

    The last list is True at instants of mid-swing with toes below the ground, as in the metric ``lowest_toes``.
    """
    motion = walk_of(result.scenario)
    recording = result.recording
    timing = gait_timing(motion.gait)
    path = ankle_path(motion.gait, timing, motion.wearer)
    # All strides have the stride time of the gait.
    times = turns * motion.gait.stride_time
    names = ("shank_angle", "angle", "healthy_angle")
    shank, angle, healthy = (np.interp(times, recording.time, recording[name]) for name in names)
    worn = path.posture(turns, shank, angle)
    phases = turns % 1.0
    must_clear = (phases >= timing.clearance_from) & (phases < timing.clearance_to)
    return worn, path.posture(turns, shank, healthy), (must_clear & (worn.toe[:, 1] < 0.0)).tolist()


def phases_of_last_stride(result: WalkResult, count: int) -> Floats:
    """Return ``count`` evenly spaced running phases [strides] in the last whole stride."""
    # 1e-6: a last stride that is short by rounding counts.
    last = int(result.recording.time[-1] / walk_of(result.scenario).gait.stride_time + 1.0e-6)
    return np.asarray(last - 1 + np.arange(count) / count)


def _draw_leg(
    axes: "Axes", posture: Posture, index: int, offset: float, colour: str, width: float, is_ghost: bool = False
) -> None:
    """Draw the leg at ``index``, shifted by -``offset`` [m]: shank, foot as a wedge of ankle, heel and toes, joints."""
    from matplotlib.patches import Polygon

    joints = posture.knee, posture.ankle, posture.heel, posture.toe
    knee, ankle, heel, toe = (points[index] - (offset, 0.0) for points in joints)
    shank = [knee[0], ankle[0]], [knee[1], ankle[1]]
    # The ghost is an outline: its shank is behind the other leg, its foot in front of it.
    order, foot_order = (2.0, 3.2) if is_ghost else (3.0, 3.0)
    axes.plot(*shank, color=colour, linewidth=width, zorder=order, solid_capstyle="round")
    face = "none" if is_ghost else colour
    look: dict[str, Any] = {"edgecolor": colour, "linewidth": 0.6 * width, "joinstyle": "round", "zorder": foot_order}
    axes.add_patch(Polygon([ankle, heel, toe], facecolor=face, **look))
    if not is_ghost:
        axes.plot(*shank, "o", color="white", markeredgecolor=colour, markersize=1.6 * width, zorder=3.5)


def frames_figure(comparison: WalkComparison) -> "Figure":
    """Return a figure of instants of one stride, without the device (top) and with the device (bottom)."""
    from matplotlib.figure import Figure

    with house_style():
        width = printed_width(_WIDTH)
        scale = print_scale()
        count = _FRAMES if width >= _WIDTH else _FEW_FRAMES
        # As high as the legs of a row are in frames of this width.
        row = (1.0 - 2.0 * _EDGE) * width * (_VIEW[1] - _VIEW[0]) / (_SLOT * count)
        height = scale * _HEAD + 2.0 * row
        figure = Figure(figsize=(width, height))
        figure.subplots_adjust(left=_EDGE, right=1.0 - _EDGE, top=1.0 - scale * _HEAD / height, bottom=0.01, hspace=0.0)
        rows = figure.subplots(2, 1, sharex=True)
        _draw_frames(rows[0], comparison.without_device, "without the device", WITHOUT, count)
        _draw_frames(rows[1], comparison.with_device, "with the device", WITH, count)
        worn = comparison.with_device
        width = width / scale
        height = height / scale
        # About 15 letters of the remark go on an inch.
        remark = textwrap.fill("outline: healthy foot; cross: toes below ground in mid-swing", round(15.0 * width))
        for text, top, letters, colour in (
            (f"{worn.scenario.name}: one stride", 0.12, 11.0, BLACK),
            (remark, 0.36, 9.0, GREY),
        ):
            style: dict[str, Any] = {"fontsize": font_size(letters), "color": colour, "parse_math": False}
            figure.text(0.12 / width, 1.0 - top / height, text, ha="left", va="top", **style)
        mark_kind(figure, worn.recording.kind)
        return figure


def _draw_frames(axes: "Axes", result: WalkResult, label: str, colour: str, count: int) -> None:
    """Draw ``count`` legs of one stride side by side, each with the healthy leg and its percent of the stride."""
    turns = phases_of_last_stride(result, count)
    if count < _FRAMES:
        # Of few instants some are in the middle of stance, of push-off and of the swing.
        turns = turns + 0.5 / count
    worn, healthy, drags = legs_of(result, turns)
    ground = [0.0, _SLOT * turns.size]
    axes.plot(ground, [0.0, 0.0], color=GREY, linewidth=1.0, zorder=1)
    axes.fill_between(ground, [-0.25, -0.25], [0.0, 0.0], color="#f1f1f1", linewidth=0.0, zorder=0)
    for index in range(turns.size):
        middle = _SLOT * (index + 0.47)
        offset = healthy.ankle[index, 0] - middle
        _draw_leg(axes, healthy, index, offset, _GHOST, 1.0, is_ghost=True)
        _draw_leg(axes, worn, index, offset, colour, 2.2)
        if drags[index]:
            toe = worn.toe[index] - (offset, 0.0)
            axes.plot(toe[0], toe[1], "x", color=_DRAGS, markersize=7, markeredgewidth=1.8, zorder=5)
        percent = f"{100.0 * (turns[index] % 1.0):.0f} %"
        axes.text(middle, -0.19, percent, ha="center", va="top", fontsize=font_size(8.5), color=GREY)
    axes.text(0.0, 0.8, label, ha="left", va="top", color=colour, fontsize=font_size(10.0))
    axes.set_xlim(0.0, _SLOT * turns.size)
    axes.set_ylim(*_VIEW)
    axes.set_aspect("equal", adjustable="box")
    axes.set_axis_off()
