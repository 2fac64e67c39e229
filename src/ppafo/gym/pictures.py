"""What an episode looks like: the vane at its angle, and angle and error over time, as the bytes of a picture."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.report.style import BLUE, GREY, VERMILION, house_style

SIZE, RESOLUTION = (6.4, 3.6), 100
"""Inches, and dots an inch: 640 by 360 points, even numbers as films want them."""


def picture(trail: Sequence[tuple[float, float, float]], unit: str, period: float) -> NDArray[np.uint8]:
    """Return a picture (height, width, 3) of an episode: times [s], angles [rad] and errors in a unit, in order.

    ``period`` [s] is the shortest span of time that is shown.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    times, angles, errors = np.array(trail).T
    with house_style():
        figure = Figure(figsize=SIZE, dpi=RESOLUTION, layout="constrained")
        canvas: Any = FigureCanvasAgg(figure)
        grid: Any = figure.subplot_mosaic([["vane", "angle"], ["vane", "error"]], width_ratios=[1.0, 1.8])
        # Housing, dual vane and shaft; the angle grows in plantarflexion, 90 deg is neutral.
        vane, angle = grid["vane"], float(angles[-1])
        turn, along = np.linspace(0.0, 2.0 * np.pi, 121), np.array([-1.0, 1.0])
        vane.plot(np.cos(turn), np.sin(turn), color=GREY)
        vane.plot(along * np.cos(angle), along * np.sin(angle), color=BLUE, linewidth=6.0, solid_capstyle="butt")
        vane.plot(0.15 * np.cos(turn), 0.15 * np.sin(turn), color=GREY)
        vane.set_aspect("equal")
        vane.set_axis_off()
        vane.set_title(f"Vane at {np.degrees(angle):.0f} deg")
        shown, shown_unit = (np.degrees(errors), "deg") if unit == "rad" else (errors, unit)
        for name, values, label in (
            ("angle", np.degrees(angles), "Angle (deg)"),
            ("error", shown, f"Error ({shown_unit})"),
        ):
            axes = grid[name]
            axes.plot(times, values, color=BLUE if name == "angle" else VERMILION)
            axes.axhline(0.0 if name == "error" else 90.0, color=GREY, linewidth=0.8, linestyle="--")
            axes.set_ylabel(label)
            axes.set_xlim(0.0, max(float(times[-1]), period))
        grid["angle"].tick_params(labelbottom=False)
        grid["error"].set_xlabel("Time (s)")
        canvas.draw()
        # Without transparency, and a copy, since the canvas owns its buffer.
        return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()
