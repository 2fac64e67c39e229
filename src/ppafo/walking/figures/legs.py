"""Stick figures of the leg: over the strip of gait phases of figure 1A, as single frames, and as an animation (GIF)."""

import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ppafo.constants import PASCALS_PER_PSI
from ppafo.model.valves.kind import VENTS_ABOVE
from ppafo.report.display_units import axis_unit, display_value, display_values
from ppafo.report.style import (
    BLACK,
    CHAMBER_1,
    CHAMBER_2,
    GREY,
    FigureMargins,
    figure_of_panels,
    house_style,
    mark_kind,
)
from ppafo.signals.recording import Floats
from ppafo.walking.figures.mean_stride import WITH, WITHOUT
from ppafo.walking.gait_series import Posture, ankle_path, gait_timing
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WalkResult
from ppafo.walking.strides import PHASES, settled, times_of_phases
from ppafo.walking.walk import WalkComparison

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Polygon

GHOST = "#5a5a5a"
"""Colour of the healthy foot: dark enough to be visible in front of a coloured foot."""
DRAGS = "#a4001d"
DRAG_LIMIT = -0.01
"""Toe height [m] below which the toes are drawn as dragging; hip and knee could compensate for less."""


_STRIP_SIZE = (10.4, 3.75)
_FRAMES = 10
"""Number of legs in the picture of one stride."""
_SLOT = 0.62
"""Width of the ground under one frame [m]."""

_PHASES_SIZE = (9.4, 6.0)
_MARGINS = FigureMargins(left=1.3, right=0.2, top=0.55, bottom=0.52, row_gap=0.22, label=0.5)
_HEIGHTS = (1.75, 0.7, 0.7, 0.7, 1.35)
_PERCENT = 100.0 * PHASES
_STRIP_FRAMES = 8
_NARROW, _NARROWEST = 9.0, 2.5
"""Width of a block [percent of the stride] below which its name is vertical, and below which the name is left out."""

_ANIMATION_SIZE, _RESOLUTION = (7.2, 4.6), 90
_STRIDES, _PER_STRIDE = 2, 30
_COLOURS = 48
"""Number of colours in the palette of the animation."""
_NEARLY_WHITE = 248
"""Level (0 to 255) of all three colour channels above which a pixel is made white, for a uniform background."""
_SLOWED = 2.0
"""Duration of the animation divided by the duration of the walk [-]."""
_VIEW = (-0.62, 0.62, -0.12, 0.78)
_TICK = 0.35
"""Distance between the marks on the ground [m]."""

_CHAMBERS = (("pressure_1", "plantarflexion", CHAMBER_1), ("pressure_2", "dorsiflexion", CHAMBER_2))
"""Channel, name and colour of each chamber."""

_VALVE = {0: ("closed", "#ffffff"), 1: ("plantarflexion", "#8fbfe0"), -1: ("dorsiflexion", "#f0b48a")}
_VENTED = ("vented", "#e4e4e4")


@dataclass(frozen=True, slots=True, eq=False)
class _Legs:
    """Postures in a walk and in the healthy gait at the same instants, and their running phases [strides]."""

    turns: Floats
    worn: Posture
    healthy: Posture


def legs_of(result: WalkResult, turns: Floats) -> _Legs:
    """Return the postures of a walk at running phases [strides], counted from the start of the recording."""
    configuration, recording = result.scenario, result.recording
    gait = walk_of(configuration).gait
    path = ankle_path(gait, gait_timing(gait), walk_of(configuration).wearer)
    # A walk of equal strides has one stride time, of the gait that leads it.
    times = turns * gait.stride_time
    shank, angle, healthy = (
        np.interp(times, recording.time, recording[name]) for name in ("shank_angle", "angle", "healthy_angle")
    )
    return _Legs(turns, path.posture(turns, shank, angle), path.posture(turns, shank, healthy))


def last_phases(result: WalkResult, strides: int, per_stride: int) -> Floats:
    """Return evenly spaced running phases [strides] in a number of strides near the end of a walk.

    These are the last consecutive assisted strides, if there are enough.
    """
    # Rounding must not take the last stride away.
    last = int(result.recording.time[-1] / walk_of(result.scenario).gait.stride_time + 1.0e-6)
    count = min(strides, max(1, last - 1))
    if not result.helped.all():
        # The walk begins with a stride of its own, at a heel strike that is not counted.
        ends = range(last, count, -1)
        last = next((end for end in ends if result.helped[end - count - 1 : end - 1].sum() == count), last)
    return np.asarray(last - count + np.arange(count * per_stride) / per_stride)


@dataclass(frozen=True, slots=True, eq=False)
class _LegArtists:
    """Matplotlib lines of one leg: shank, foot as a wedge of ankle, heel and toes, and ankle joint."""

    shank: "Line2D"
    foot: "Polygon"
    joint: "Line2D"

    def place(self, posture: Posture, index: int, offset: float) -> None:
        """Move the leg to the posture at ``index``, with x shifted by -``offset`` [m]."""
        joints = posture.knee, posture.ankle, posture.heel, posture.toe
        knee, ankle, heel, toe = (points[index] - (offset, 0.0) for points in joints)
        self.shank.set_data([knee[0], ankle[0]], [knee[1], ankle[1]])
        self.foot.set_xy([ankle, heel, toe])
        self.joint.set_data([knee[0], ankle[0]], [knee[1], ankle[1]])


def leg_artists(axes: "Axes", colour: str, width: float, is_ghost: bool = False) -> _LegArtists:
    """Add the lines of one leg to the axes, with a line width [points]; ``place`` sets their position."""
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
    return _LegArtists(shank, foot, joint)


def draw_ground(axes: "Axes", left: float, right: float) -> None:
    """Draw the ground from ``left`` to ``right`` [m]."""
    axes.plot([left, right], [0.0, 0.0], color=GREY, linewidth=1.0, zorder=1)
    axes.fill_between([left, right], [-0.25, -0.25], [0.0, 0.0], color="#f1f1f1", linewidth=0.0, zorder=0)


def drags(legs: _Legs, index: int) -> bool:
    """Return True if the toes are more than 1 cm below the ground."""
    return bool(legs.worn.toe[index, 1] < DRAG_LIMIT)


def frames_figure(comparison: WalkComparison) -> "Figure":
    """Return a figure of ten instants of one stride, without the device (top) and with the device (bottom)."""
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


@dataclass(frozen=True, slots=True)
class _StateBand:
    """State in a row of the strip: name, abbreviation for a narrow block, colour, and predicate on channel values."""

    name: str
    short: str
    colour: str
    holds: Callable[[Floats], NDArray[np.bool_]]


def _is(value: float) -> Callable[[Floats], NDArray[np.bool_]]:
    return lambda values: values == value


_FREE, _DORSI, _PLANTAR = "#e4e4e4", "#f0b48a", "#8fbfe0"
_ROWS: Mapping[str, tuple[str, tuple[_StateBand, ...]]] = {
    "Controller": (
        "controller_phase",
        (
            _StateBand("1 heel strike", "1 heel", "#f6d5bd", _is(1.0)),
            _StateBand("4 free motion", "4 free", _FREE, _is(2.0)),
            _StateBand("2 push-off", "2 push", _PLANTAR, _is(3.0)),
            _StateBand("3 swing", "3 swing", _DORSI, _is(0.0)),
        ),
    ),
    "Foot": (
        "contact",
        (
            _StateBand("on the heel", "heel", "#cfe3c9", _is(1.0)),
            _StateBand("flat", "flat", "#9fcf94", _is(2.0)),
            _StateBand("on the toes", "toes", "#63ad59", _is(3.0)),
            _StateBand("in the air", "air", "#f3f3f3", _is(0.0)),
        ),
    ),
    "Valve": (
        "command",
        (
            _StateBand("vented", "vented", _FREE, lambda command: command > VENTS_ABOVE),
            _StateBand("closed", "closed", "#ffffff", _is(0.0)),
            _StateBand(
                "plantarflexion", "plantar", _PLANTAR, lambda command: (command > 0.0) & (command <= VENTS_ABOVE)
            ),
            _StateBand("dorsiflexion", "dorsi", _DORSI, lambda command: command < 0.0),
        ),
    ),
}


def strip_figure(result: WalkResult) -> "Figure":
    """Return the strip of gait phases of a walk; where strides differ, colours show the fraction of the strides."""
    with house_style():
        figure, grid = figure_of_panels(_PHASES_SIZE, _MARGINS, len(_HEIGHTS), heights=_HEIGHTS)
        rows = [axes for (axes,) in grid]
        _legs(rows[0], result)
        for axes, (label, (channel, states)) in zip(rows[1:4], _ROWS.items(), strict=True):
            _band(axes, label, _shares(result, channel, states), states)
        _pressures(rows[4], result)
        rows[4].set_xlabel("Stride (%)")
        rows[4].set_xlim(0.0, 100.0)
        width, height = _PHASES_SIZE
        title = f"{result.scenario.name}: functional tasks of the paper's figure 1A over the stride"
        figure.text(0.12 / width, 1.0 - 0.12 / height, title, ha="left", va="top", fontweight="bold")
        remark = "height of each colour: fraction of strides"
        figure.text(0.12 / width, 1.0 - 0.34 / height, remark, ha="left", va="top", fontsize=8.5, color=GREY)
        mark_kind(figure, result.recording.kind)
        return figure


def _shares(result: WalkResult, channel: str, states: tuple[_StateBand, ...]) -> Floats:
    """Return the fraction of assisted strides in each state at ``PHASES``, shape (states, phases); 0 without data."""
    chosen = settled(result.helped)
    if channel not in result.recording or not chosen.any():
        return np.zeros((len(states), PHASES.size))
    time = result.recording.time
    stride = np.searchsorted(time, times_of_phases(time, result.starts)[chosen], side="right") - 1
    values = result.recording[channel][stride]
    return np.array([np.mean(state.holds(values), axis=0) for state in states])


def _band(axes: "Axes", label: str, fractions: Floats, states: tuple[_StateBand, ...]) -> None:
    below = np.zeros(PHASES.size)
    for state, fraction in zip(states, fractions, strict=True):
        axes.fill_between(_PERCENT, below, below + fraction, color=state.colour, linewidth=0.0, step="mid")
        # Write the name into every block that is wide enough and holds for most strides.
        middle = below + 0.5 * fraction
        inside = np.flatnonzero(np.diff(np.concatenate([[0], (fraction > 0.5).astype(int), [0]])))
        for first, last in zip(inside[::2], inside[1::2], strict=True):
            left, right = _PERCENT[first], _PERCENT[last - 1]
            if right - left >= _NARROWEST:
                text, turn = (state.name, 0) if right - left >= _NARROW else (state.short, 90)
                label_at = 0.5 * (left + right), float(np.mean(middle[first:last]))
                axes.text(*label_at, text, ha="center", va="center", fontsize=9.0 if turn == 0 else 8.0, rotation=turn)
        below = below + fraction
    if not below.any():
        axes.text(50.0, 0.5, "no gait phases in this controller", ha="center", va="center", fontsize=9.0, color=GREY)
    axes.set_ylim(0.0, 1.0)
    axes.set_yticks([])
    axes.grid(visible=False)
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="x", length=0.0)
    axes.set_ylabel(label, rotation=0, ha="right", va="center")
    axes.yaxis.set_label_coords(-0.012, 0.5)


def _legs(axes: "Axes", result: WalkResult) -> None:
    """Draw stick figures above the strip, each at its instant, in axes scaled in metres over the same percent axis."""
    turns = last_phases(result, 1, _STRIP_FRAMES) + 0.5 / _STRIP_FRAMES
    legs = legs_of(result, turns)
    panel_width = _PHASES_SIZE[0] - _MARGINS.left - _MARGINS.right
    panel_height = axes.get_position().height * _PHASES_SIZE[1]
    height = 0.7
    metres = height * panel_width / panel_height
    inner = axes.inset_axes((0.0, 0.0, 1.0, 1.0))
    draw_ground(inner, 0.0, metres)
    for index in range(turns.size):
        offset = legs.healthy.ankle[index, 0] - metres * (turns[index] % 1.0)
        leg_artists(inner, GHOST, 1.6, is_ghost=True).place(legs.healthy, index, offset)
        leg_artists(inner, WITH, 2.6).place(legs.worn, index, offset)
    inner.set_xlim(0.0, metres)
    inner.set_ylim(-0.12, height - 0.12)
    inner.set_axis_off()
    axes.set_axis_off()


def _pressures(axes: "Axes", result: WalkResult) -> None:
    atmosphere = result.scenario.device.supply.atmospheric_pressure
    for channel, name, look in _CHAMBERS:
        if channel in result.averages:
            mean = display_values(result.averages[channel].mean, "pressure")
            axes.plot(_PERCENT, mean, color=look.colour, linestyle=look.line, label=name)
    axes.axhline(display_value(atmosphere, "pressure"), color=GREY, linewidth=0.8)
    axes.set_ylabel(f"Chambers\n({axis_unit('pressure')})", rotation=0, ha="right", va="center")
    axes.yaxis.set_label_coords(-0.045, 0.5)
    axes.locator_params(axis="y", nbins=4)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=2, borderaxespad=0.1, handlelength=1.6)


@dataclass(frozen=True, slots=True, eq=False)
class _Scene:
    """Animated panel with a walking leg."""

    axes: "Axes"
    legs: _Legs
    artists: tuple[Any, Any]
    ticks: Any
    colour: str
    centre: np.ndarray

    def show(self, index: int) -> list[Any]:
        """Update ground marks and legs to frame ``index``; return the changed artists."""
        offset = float(self.centre[index])
        marks = np.arange(np.ceil((offset + _VIEW[0]) / _TICK), (offset + _VIEW[1]) / _TICK) * _TICK - offset
        self.ticks.set_data(marks, np.full(marks.size, -0.018))
        ghost, worn = self.artists
        ghost.place(self.legs.healthy, index, offset)
        worn.place(self.legs.worn, index, offset)
        worn.foot.set_color(DRAGS if drags(self.legs, index) else self.colour)
        parts = (ghost.shank, worn.shank, worn.foot, ghost.foot, worn.joint)
        return [self.ticks, *parts]


def animation(comparison: WalkComparison) -> bytes:
    """Return an animated GIF of two strides at half speed."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    worn = comparison.with_device
    stride_time = walk_of(worn.scenario).gait.stride_time
    with house_style():
        turns = last_phases(worn, _STRIDES, _PER_STRIDE)
        # The command that is held at each instant: the last sample at or before it.
        places = np.searchsorted(worn.recording.time, turns * stride_time, side="right") - 1
        commands = worn.recording["command"][places]
        figure, scenes, cursor, lamp = _stage(comparison, turns)
        canvas: Any = FigureCanvasAgg(figure)
        canvas.draw()
        empty = canvas.copy_from_bbox(figure.bbox)
        images = []
        for index in range(turns.size):
            canvas.restore_region(empty)
            for scene in scenes:
                for artist in scene.show(index):
                    scene.axes.draw_artist(artist)
            cursor.set_xdata([index / _PER_STRIDE] * 2)
            command = commands[index]
            name, colour = _VENTED if command > VENTS_ABOVE else _VALVE[int(np.sign(command))]
            lamp.set_text(f"valve: {name}")
            lamp.get_bbox_patch().set_facecolor(colour)
            cursor.axes.draw_artist(cursor)
            cursor.axes.draw_artist(lamp)
            images.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"))
        sheet = Image.fromarray(np.concatenate([np.asarray(image) for image in images[:: _PER_STRIDE // 5]]))
        palette = sheet.quantize(_COLOURS, dither=Image.Dither.NONE)
        tones = palette.getpalette() or []
        triples = [tones[start : start + 3] for start in range(0, len(tones), 3)]
        # What is nearly white is white, for averages with its edges would tint the background; a red foot is kept.
        kept = [[255] * 3 if min(triple) > _NEARLY_WHITE else triple for triple in triples[:_COLOURS]]
        kept.append([int(DRAGS[digit : digit + 2], 16) for digit in (1, 3, 5)])
        palette.putpalette([tone for triple in kept for tone in triple])
        frames = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
        buffer = io.BytesIO()
        milliseconds = 10 * round(100.0 * _SLOWED * stride_time / _PER_STRIDE)  # a GIF counts hundredths of a second
        frames[0].save(
            buffer, "GIF", save_all=True, append_images=frames[1:], duration=milliseconds, loop=0, optimize=False
        )
        return buffer.getvalue()


def _stage(comparison: WalkComparison, turns: np.ndarray) -> "tuple[Figure, list[_Scene], Any, Any]":
    from matplotlib.figure import Figure

    figure = Figure(figsize=_ANIMATION_SIZE, dpi=_RESOLUTION)
    pairs = ((comparison.without_device, "without", WITHOUT), (comparison.with_device, "with", WITH))
    scenes = []
    for index, (result, word, colour) in enumerate(pairs):
        axes = figure.add_axes((0.01 + 0.5 * index, 0.34, 0.48, 0.6))
        scenes.append(_scene(axes, result, turns, f"{word} the device", colour))
    traces = figure.add_axes((0.09, 0.115, 0.89, 0.18))
    worn, configuration = comparison.with_device, comparison.with_device.scenario
    fine = np.linspace(turns[0], turns[-1], 400)
    atmosphere = configuration.device.supply.atmospheric_pressure
    for channel, name, look in _CHAMBERS:
        # An actuator may have one chamber.
        if channel not in worn.recording:
            continue
        times = fine * walk_of(configuration).gait.stride_time
        pressures = np.interp(times, worn.recording.time, worn.recording[channel])
        shown = display_values(pressures, "pressure")
        traces.plot(fine - turns[0], shown, color=look.colour, linestyle=look.line, linewidth=1.3, label=name)
    traces.set_xlim(0.0, turns[-1] - turns[0])
    least = display_value(atmosphere + 10.0 * PASCALS_PER_PSI, "pressure")
    traces.set_ylim(top=max(least, traces.get_ylim()[1]))
    traces.set_xlabel("strides", fontsize=8.5, labelpad=1.0)
    traces.set_ylabel(f"pressure\n({axis_unit('pressure')})", fontsize=8.5)
    traces.tick_params(labelsize=8)
    traces.locator_params(axis="y", nbins=3)
    traces.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.02), ncols=2, borderaxespad=0.0, handlelength=1.4, fontsize=8.5
    )
    cursor = traces.axvline(0.0, color=BLACK, linewidth=1.2, animated=True)
    box = {"boxstyle": "round,pad=0.3", "facecolor": "#ffffff", "edgecolor": GREY, "linewidth": 0.8}
    lamp = traces.text(
        0.995, 1.24, "", transform=traces.transAxes, ha="right", va="center", fontsize=9, bbox=box, animated=True
    )
    figure.text(
        0.012,
        0.985,
        f"{configuration.name}, half speed, simulated; dark red: toes more than 1 cm below ground",
        ha="left",
        va="top",
        fontsize=9,
        color=GREY,
    )
    return figure, scenes, cursor, lamp


def _scene(axes: "Axes", result: WalkResult, turns: np.ndarray, label: str, colour: str) -> _Scene:
    legs = legs_of(result, turns)
    stride = np.diff(legs.healthy.ankle[[0, _PER_STRIDE - 1], 0])[0] * _PER_STRIDE / (_PER_STRIDE - 1)
    axes.set_xlim(*_VIEW[:2])
    axes.set_ylim(*_VIEW[2:])
    axes.set_aspect("equal", adjustable="box")
    axes.set_axis_off()
    draw_ground(axes, *_VIEW[:2])
    axes.text(_VIEW[0] + 0.02, _VIEW[3] - 0.03, label, color=colour, ha="left", va="top", fontsize=10.5)
    (ticks,) = axes.plot([], [], "|", color=GREY, markersize=5, zorder=1)
    artists = (leg_artists(axes, GHOST, 2.0, is_ghost=True), leg_artists(axes, colour, 4.0))
    for artist in [ticks, *(part for leg in artists for part in (leg.shank, leg.foot, leg.joint))]:
        artist.set_animated(True)
    start = float(np.mean(legs.healthy.ankle[:_PER_STRIDE, 0] - stride * (turns[:_PER_STRIDE] - turns[0])))
    return _Scene(axes, legs, artists, ticks, colour, start + stride * (turns - turns[0]))
