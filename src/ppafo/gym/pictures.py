"""Picture of an episode as image bytes: the joint at its angle, and angle and error over time."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.parameters.device import Device
from ppafo.report.style import BLUE, GREY, VERMILION, house_style
from ppafo.signals.recording import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SIZE = (6.4, 3.6)
"""Width and height of a picture [inches]."""
_RESOLUTION = 100
"""Dots per inch: 640 by 360 pixels, even numbers as video formats require."""
_SHAFT = 0.15
"""Radius of the shaft relative to the radius of the housing [-]."""
_NEUTRAL = 90.0
"""Neutral ankle angle [deg]."""


class EpisodeFrame(NamedTuple):
    """Frame of an episode: time [s], joint angle [rad], and error in the unit of the task."""

    time: float
    angle: float
    error: float


def picture(moments: Sequence[EpisodeFrame], unit: str, period: float, device: Device) -> NDArray[np.uint8]:
    """Draw the frames of an episode, at least one, as a picture (height, width, 3).

    ``unit`` is the unit of the errors, "rad" or "N m"; ``period`` [s] is the shortest time axis.
    Only the vane is drawn on both sides of its shaft; other actuators turn a lever.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    times, angles, errors = np.array(moments).T
    error_scale, error_unit = (float(np.degrees(1.0)), "deg") if unit == "rad" else (1.0, unit)
    end = max(float(times[-1]), period)
    with house_style():
        figure = Figure(figsize=_SIZE, dpi=_RESOLUTION, layout="constrained")
        canvas: Any = FigureCanvasAgg(figure)
        panels: Any = figure.subplot_mosaic([["joint", "angle"], ["joint", "error"]], width_ratios=[1.0, 1.8])
        axes = panels["joint"]
        angle = float(angles[-1])
        turn = np.linspace(0.0, 2.0 * np.pi, 121)
        lever: Floats = np.array([-1.0 if device.actuator.kind == "vane" else 0.0, 1.0])
        axes.plot(np.cos(turn), np.sin(turn), color=GREY)
        axes.plot(lever * np.cos(angle), lever * np.sin(angle), color=BLUE, linewidth=6.0, solid_capstyle="butt")
        axes.plot(_SHAFT * np.cos(turn), _SHAFT * np.sin(turn), color=GREY)
        axes.set_aspect("equal")
        axes.set_axis_off()
        axes.set_title(f"{device.joint.name.capitalize()} at {np.degrees(angle):.0f} deg")
        panels["angle"].plot(times, np.degrees(angles), color=BLUE)
        _finish(panels["angle"], end, "Angle (deg)", _NEUTRAL)
        panels["angle"].tick_params(labelbottom=False)
        panels["error"].plot(times, error_scale * errors, color=VERMILION)
        _finish(panels["error"], end, f"Error ({error_unit})", 0.0)
        panels["error"].set_xlabel("Time (s)")
        canvas.draw()
        # Without transparency, and a copy, since the canvas owns its buffer.
        return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()


def _finish(axes: "Axes", end: float, label: str, level: float) -> None:
    """Label the axes of a curve over time up to ``end`` [s], with a horizontal line at ``level``."""
    axes.axhline(level, color=GREY, linewidth=0.8, linestyle="--")
    axes.set_ylabel(label)
    axes.set_xlim(0.0, end)
    axes.locator_params(axis="x", nbins=5)
