"""Animation (GIF) of the leg without and with the device, with the chamber pressures and the state of the valve."""

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.constants import PASCALS_PER_PSI
from ppafo.model.valves.kind import VENTS_ABOVE
from ppafo.report.display_units import axis_unit, display_value, display_values
from ppafo.report.style import BLACK, GREY, house_style
from ppafo.walking.figures.legs import (
    CHAMBERS,
    DRAGGING,
    DRAGS,
    GHOST,
    LegPostures,
    draw_ground,
    last_phases,
    leg_artists,
    legs_of,
)
from ppafo.walking.figures.mean_stride import WITH, WITHOUT
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import WalkComparison

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from PIL.Image import Image

_SIZE, _RESOLUTION = (7.2, 4.6), 90
"""Width and height [inch], and pixels per inch."""
_STRIDES, _PER_STRIDE = 2, 30
"""Number of strides, and number of frames of a stride."""
_COLOURS = 48
"""Number of colours in the palette."""
_NEARLY_WHITE = 248
"""Level (0 to 255) of all three colour channels above which a pixel is made white, for a uniform background."""
_SLOWED = 2.0
"""Duration of the animation divided by the duration of the walk [-]."""
_VIEW = (-0.62, 0.62, -0.12, 0.78)
"""Lowest and highest x and y in a panel [m]."""
_TICK = 0.35
"""Distance between the marks on the ground [m]."""
_VALVE = {0: ("closed", "#ffffff"), 1: ("plantarflexion", "#8fbfe0"), -1: ("dorsiflexion", "#f0b48a")}
_VENTED = ("vented", "#e4e4e4")
"""Name and colour of each valve state: by sign of the command, and for a vent command."""


@dataclass(frozen=True, slots=True, eq=False)
class _Scene:
    """Animated panel with a walking leg."""

    axes: "Axes"
    legs: LegPostures
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
        worn.foot.set_color(DRAGS if self.legs.drags[index] else self.colour)
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
        # The command is constant between samples.
        samples = np.searchsorted(worn.recording.time, turns * stride_time, side="right") - 1
        commands = worn.recording["command"][samples]
        figure, scenes, cursor, lamp = _stage(comparison, turns)
        canvas: Any = FigureCanvasAgg(figure)
        canvas.draw()
        background = canvas.copy_from_bbox(figure.bbox)
        images = []
        for index, command in enumerate(commands):
            canvas.restore_region(background)
            for scene in scenes:
                for artist in scene.show(index):
                    scene.axes.draw_artist(artist)
            cursor.set_xdata([index / _PER_STRIDE] * 2)
            name, colour = _VENTED if command > VENTS_ABOVE else _VALVE[int(np.sign(command))]
            lamp.set_text(f"valve: {name}")
            lamp.get_bbox_patch().set_facecolor(colour)
            cursor.axes.draw_artist(cursor)
            cursor.axes.draw_artist(lamp)
            images.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"))
    # A GIF counts hundredths of a second.
    milliseconds = 10 * round(100.0 * _SLOWED * stride_time / _PER_STRIDE)
    palette = _palette(images[:: _PER_STRIDE // 2])
    frames = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    buffer = io.BytesIO()
    frames[0].save(
        buffer, "GIF", save_all=True, append_images=frames[1:], duration=milliseconds, loop=0, optimize=False
    )
    return buffer.getvalue()


def _palette(images: "list[Image]") -> "Image":
    """Return an image whose palette suits all these images, with pure white and the red of a dragging foot."""
    from PIL import Image

    sheet = Image.fromarray(np.concatenate([np.asarray(image) for image in images]))
    palette = sheet.quantize(_COLOURS, dither=Image.Dither.NONE)
    levels = palette.getpalette() or []
    colours = [levels[start : start + 3] for start in range(0, len(levels), 3)][:_COLOURS]
    # Nearly white is an average with edges, which would tint the background.
    colours = [[255] * 3 if min(colour) > _NEARLY_WHITE else colour for colour in colours]
    colours.append([int(DRAGS[digit : digit + 2], 16) for digit in (1, 3, 5)])
    palette.putpalette([level for colour in colours for level in colour])
    return palette


def _stage(comparison: WalkComparison, turns: np.ndarray) -> "tuple[Figure, list[_Scene], Any, Any]":
    """Return the figure, its two scenes, the time cursor over the pressures, and the text on the valve."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=_SIZE, dpi=_RESOLUTION)
    left, right = (figure.add_axes((x, 0.34, 0.48, 0.6)) for x in (0.01, 0.51))
    scenes = [
        _scene(left, comparison.without_device, turns, "without the device", WITHOUT),
        _scene(right, comparison.with_device, turns, "with the device", WITH),
    ]
    traces = figure.add_axes((0.09, 0.115, 0.89, 0.18))
    worn, configuration = comparison.with_device, comparison.with_device.scenario
    fine = np.linspace(turns[0], turns[-1], 400)
    atmosphere = configuration.device.supply.atmospheric_pressure
    for channel, name, look in CHAMBERS:
        # An actuator may have a single chamber.
        if channel not in worn.recording:
            continue
        times = fine * walk_of(configuration).gait.stride_time
        pressures = np.interp(times, worn.recording.time, worn.recording[channel])
        values = display_values(pressures, "pressure")
        traces.plot(fine - turns[0], values, color=look.colour, linestyle=look.line, linewidth=1.3, label=name)
    traces.set_xlim(0.0, turns[-1] - turns[0])
    lowest_top = display_value(atmosphere + 10.0 * PASCALS_PER_PSI, "pressure")
    traces.set_ylim(top=max(lowest_top, traces.get_ylim()[1]))
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
        f"{configuration.name}, half speed, simulated; dark red: {DRAGGING}",
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
