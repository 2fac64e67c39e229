"""A few strides as an animation (GIF): the leg without and with the device, chamber pressures and valve below."""

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.answers.style import BLACK, CHAMBER_1, CHAMBER_2, GREY, house_style
from ppafo.constants import PASCALS_PER_PSI
from ppafo.model.command import VENTS_ABOVE
from ppafo.walking.comparison import Comparison
from ppafo.walking.figures.legs import DRAGS, GHOST, Legs, drags, draw_ground, last_phases, leg_artists, legs_of
from ppafo.walking.figures.mean_stride import WITH, WITHOUT
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WalkResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from PIL.Image import Image

_SIZE, _RESOLUTION = (7.2, 4.6), 90
_STRIDES, _PER_STRIDE = 2, 30
_COLOURS = 48
_NEARLY_WHITE = 248
_SLOWED = 2.0
_VIEW = (-0.62, 0.62, -0.12, 0.78)
_TICK = 0.35
"""Distance of the marks on the ground [m]."""

_VALVE = {0: ("closed", "#ffffff"), 1: ("plantarflexion", "#8fbfe0"), -1: ("dorsiflexion", "#f0b48a")}
_VENTED = ("vented", "#e4e4e4")


@dataclass(frozen=True, slots=True, eq=False)
class _Scene:
    """One panel with a leg that walks through it."""

    axes: "Axes"
    legs: Legs
    artists: tuple[Any, Any]
    ticks: Any
    colour: str
    centre: np.ndarray

    def show(self, index: int) -> list[Any]:
        """Place ground marks and legs; returns what has to be drawn."""
        offset = float(self.centre[index])
        marks = np.arange(np.ceil((offset + _VIEW[0]) / _TICK), (offset + _VIEW[1]) / _TICK) * _TICK - offset
        self.ticks.set_data(marks, np.full(marks.size, -0.018))
        ghost, worn = self.artists
        ghost.place(self.legs.healthy, index, offset)
        worn.place(self.legs.worn, index, offset)
        worn.colour(DRAGS if drags(self.legs, index) else self.colour)
        parts = (ghost.shank, worn.shank, worn.foot, ghost.foot, worn.joint)
        return [self.ticks, *parts]


def animation(comparison: Comparison) -> bytes:
    """Return the GIF; two strides at half speed."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    with house_style():
        turns = last_phases(comparison.with_device, _STRIDES, _PER_STRIDE)
        figure, scenes, cursor, lamp = _stage(comparison, turns)
        canvas: Any = FigureCanvasAgg(figure)
        canvas.draw()
        empty = canvas.copy_from_bbox(figure.bbox)
        images = []
        commands = _commands(comparison.with_device, turns)
        for index in range(turns.size):
            canvas.restore_region(empty)
            for scene in scenes:
                for artist in scene.show(index):
                    scene.axes.draw_artist(artist)
            cursor.set_xdata([index / _PER_STRIDE] * 2)
            name, colour = _valve_state(commands[index])
            lamp.set_text(f"valve: {name}")
            lamp.get_bbox_patch().set_facecolor(colour)
            cursor.axes.draw_artist(cursor)
            cursor.axes.draw_artist(lamp)
            images.append(_image(canvas))
        return _gif(images, walk_of(comparison.with_device.scenario).gait.stride_time)


def _stage(comparison: Comparison, turns: np.ndarray) -> "tuple[Figure, list[_Scene], Any, Any]":
    from matplotlib.figure import Figure

    figure = Figure(figsize=_SIZE, dpi=_RESOLUTION)
    pairs = ((comparison.without_device, "without", WITHOUT), (comparison.with_device, "with", WITH))
    scenes = []
    for place, (result, word, colour) in enumerate(pairs):
        axes = figure.add_axes((0.01 + 0.5 * place, 0.34, 0.48, 0.6))
        scenes.append(_scene(axes, result, turns, f"{word} the device", colour))
    traces = figure.add_axes((0.09, 0.115, 0.89, 0.18))
    _traces(traces, comparison.with_device, turns)
    cursor = traces.axvline(0.0, color=BLACK, linewidth=1.2, animated=True)
    box = {"boxstyle": "round,pad=0.3", "facecolor": "#ffffff", "edgecolor": GREY, "linewidth": 0.8}
    lamp = traces.text(
        0.995, 1.24, "", transform=traces.transAxes, ha="right", va="center", fontsize=9, bbox=box, animated=True
    )
    name = comparison.with_device.scenario.name
    figure.text(
        0.012,
        0.985,
        f"{name}, half speed, simulated; dark red: toes more than 1 cm below ground",
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


def _traces(axes: "Axes", result: WalkResult, turns: np.ndarray) -> None:
    recording, configuration = result.recording, result.scenario
    fine = np.linspace(turns[0], turns[-1], 400)
    atmosphere = configuration.device.supply.atmospheric_pressure
    names = (("pressure_1", "plantarflexion", CHAMBER_1), ("pressure_2", "dorsiflexion", CHAMBER_2))
    for channel, name, colour in names:
        values = np.interp(fine * walk_of(configuration).gait.stride_time, recording.time, recording[channel])
        axes.plot(fine - turns[0], (values - atmosphere) / PASCALS_PER_PSI, color=colour, linewidth=1.3, label=name)
    axes.set_xlim(0.0, turns[-1] - turns[0])
    axes.set_ylim(top=max(10.0, axes.get_ylim()[1]))
    axes.set_xlabel("strides", fontsize=8.5, labelpad=1.0)
    axes.set_ylabel("psi, gauge", fontsize=8.5)
    axes.tick_params(labelsize=8)
    axes.locator_params(axis="y", nbins=3)
    axes.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.02), ncols=2, borderaxespad=0.0, handlelength=1.4, fontsize=8.5
    )


def _commands(result: WalkResult, turns: np.ndarray) -> np.ndarray:
    times = turns * walk_of(result.scenario).gait.stride_time
    return result.recording["command"][np.searchsorted(result.recording.time, times, side="right") - 1]


def _valve_state(command: float) -> tuple[str, str]:
    return _VENTED if command > VENTS_ABOVE else _VALVE[int(np.sign(command))]


def _image(canvas: Any) -> "Image":
    from PIL import Image

    return Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB").copy()


def _together(images: "list[Image]") -> "Image":
    """Return images one below the other."""
    from PIL import Image

    width, height = images[0].size
    sheet = Image.new("RGB", (width, height * len(images)))
    for index, image in enumerate(images):
        sheet.paste(image, (0, index * height))
    return sheet


def _gif(images: "list[Image]", stride_time: float) -> bytes:
    """All frames on the palette of one, so that only what moves takes room."""
    from PIL import Image

    palette = _together(images[:: _PER_STRIDE // 5]).quantize(_COLOURS, dither=Image.Dither.NONE)
    tones = palette.getpalette() or []
    triples = [tones[start : start + 3] for start in range(0, len(tones), 3)]
    # What is nearly white is white, for averages with its edges would tint the background; a small red foot is kept.
    kept = [[255] * 3 if min(triple) > _NEARLY_WHITE else triple for triple in triples[:_COLOURS]]
    kept.append([int(DRAGS[place : place + 2], 16) for place in (1, 3, 5)])
    palette.putpalette([tone for triple in kept for tone in triple])
    frames = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    buffer = io.BytesIO()
    milliseconds = 10 * round(100.0 * _SLOWED * stride_time / _PER_STRIDE)  # a GIF counts hundredths of a second
    frames[0].save(
        buffer, "GIF", save_all=True, append_images=frames[1:], duration=milliseconds, loop=0, optimize=False
    )
    return buffer.getvalue()
