"""A drawing of the paper's device: gas circuit in symbols of fluid power (ISO 1219-1), and the leg that wears it."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.style import BLACK, CHAMBER_1, CHAMBER_2, GREY, PROPORTIONAL, SOLENOID, house_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE = (9.2, 4.4)
"""Inches; the drawing is in the same units, with the origin at the lower left."""
_BOX = 0.42


def device_figure() -> "Figure":
    """Return the drawing: bottle, regulators, the two choices of valve, rotary actuator; shank and foot with angles."""
    from matplotlib.figure import Figure

    with house_style():
        figure = Figure(figsize=_SIZE)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set(xlim=(0.0, _SIZE[0]), ylim=(0.0, _SIZE[1]), aspect="equal")
        axes.axis("off")
        _supply(axes)
        _valves(axes)
        _actuator(axes, 6.15, 2.15)
        _leg(axes)
        return figure


def _line(
    axes: "Axes", *points: tuple[float, float], colour: str = BLACK, width: float = 1.3, dashed: bool = False
) -> None:
    x, y = zip(*points, strict=True)
    axes.plot(x, y, color=colour, linewidth=width, linestyle=(0, (4, 2)) if dashed else "-", solid_capstyle="butt")


def _arrow(axes: "Axes", start: tuple[float, float], end: tuple[float, float], colour: str = BLACK) -> None:
    shape = {
        "arrowstyle": "-|>,head_width=0.13,head_length=0.26",
        "color": colour,
        "linewidth": 1.1,
        "shrinkA": 0,
        "shrinkB": 0,
    }
    axes.annotate("", end, start, arrowprops=shape)


def _words(
    axes: "Axes", x: float, y: float, text: str, colour: str = BLACK, size: float = 8.5, align: str = "center"
) -> None:
    axes.text(x, y, text, ha=align, va="center", fontsize=size, color=colour)


def _box(axes: "Axes", x: float, y: float, colour: str = BLACK) -> None:
    """A square of side ``_BOX`` with its lower left corner at (x, y)."""
    _line(axes, (x, y), (x + _BOX, y), (x + _BOX, y + _BOX), (x, y + _BOX), (x, y), colour=colour)


def _spring(axes: "Axes", x: float, y: float, direction: float) -> None:
    steps = np.arange(7)
    axes.plot(x + direction * 0.045 * steps, y + 0.07 * np.array([0, 1, -1, 1, -1, 1, 0]), color=BLACK, linewidth=1.0)


def _exhaust(axes: "Axes", x: float, y: float) -> None:
    """A silencer to the atmosphere: a short line, and an open triangle that points away."""
    _line(axes, (x, y), (x, y - 0.1))
    _line(axes, (x - 0.07, y - 0.1), (x + 0.07, y - 0.1), (x, y - 0.22), (x - 0.07, y - 0.1), width=1.0)


def _supply(axes: "Axes") -> None:
    """The bottle, a pressure source, and a regulator for each direction."""
    from matplotlib.patches import FancyBboxPatch

    axes.add_patch(
        FancyBboxPatch((0.32, 1.45), 0.46, 1.5, boxstyle="round,pad=0,rounding_size=0.2", fill=False, linewidth=1.3)
    )
    _line(axes, (0.47, 2.95), (0.47, 3.08), (0.63, 3.08), (0.63, 2.95))
    _words(axes, 0.55, 2.2, "CO$_2$", size=10.0)
    _words(axes, 0.55, 1.25, "bottle, 9 oz", GREY)
    _line(axes, (0.55, 3.08), (0.55, 3.45), (1.25, 3.45))
    _line(axes, (0.95, 3.45), (0.95, 0.85), (1.25, 0.85))
    axes.plot([0.95], [3.45], "o", color=BLACK, markersize=4)
    for y, name, look in ((3.45, "plantarflexion", CHAMBER_1), (0.85, "dorsiflexion", CHAMBER_2)):
        _box(axes, 1.25, y - 0.5 * _BOX, look.colour)
        _arrow(axes, (1.27, y), (1.25 + _BOX - 0.02, y), look.colour)
        _line(axes, (1.25 + 0.5 * _BOX, y + 0.5 * _BOX), (1.25 + 0.5 * _BOX, y + 0.5 * _BOX + 0.05))
        axes.plot(
            1.25 + 0.5 * _BOX + 0.06 * np.array([0, 1, -1, 1, -1, 0]),
            y + 0.5 * _BOX + 0.05 + 0.04 * np.arange(6),
            color=BLACK,
            linewidth=1.0,
        )
        _line(
            axes,
            (1.25 + _BOX, y - 0.1),
            (1.8, y - 0.1),
            (1.8, y - 0.36),
            (1.46, y - 0.36),
            (1.46, y - 0.21),
            dashed=True,
            width=0.8,
        )
        _words(axes, 1.46, y + 0.62, "regulator", GREY)
        _words(axes, 1.86, y - 0.25, "$P_s$", look.colour, align="left")
        _words(axes, 4.85, 2.15 + 0.7 * (y - 2.15) + 0.4 * np.sign(y - 2.15), name, look.colour, align="left")


def _valves(axes: "Axes") -> None:
    """Two 3/2 valves with solenoid and spring, or one proportional 5/3 valve in their place."""
    for y, name, look, wire in ((3.45, "valve A, 3/2", CHAMBER_1, 2.55), (0.85, "valve B, 3/2", CHAMBER_2, 1.75)):
        x = 3.1
        _line(
            axes,
            (1.25 + _BOX, y),
            (2.72, y),
            (2.72, y - 0.5 * _BOX - 0.16),
            (x + _BOX + 0.12, y - 0.5 * _BOX - 0.16),
            (x + _BOX + 0.12, y - 0.5 * _BOX),
            colour=look.colour,
        )
        for left in (x, x + _BOX):
            _box(axes, left, y - 0.5 * _BOX, SOLENOID.colour)
        low, high = y - 0.5 * _BOX, y + 0.5 * _BOX
        _arrow(axes, (x + 0.12, low), (x + 0.21, high), SOLENOID.colour)
        _line(axes, (x + 0.33, low), (x + 0.33, low + 0.1), width=1.0)
        _line(axes, (x + 0.28, low + 0.1), (x + 0.38, low + 0.1), width=1.0)
        _arrow(axes, (x + _BOX + 0.21, high), (x + _BOX + 0.33, low), SOLENOID.colour)
        _line(axes, (x + _BOX + 0.07, low + 0.1), (x + _BOX + 0.17, low + 0.1), width=1.0)
        _line(axes, (x + _BOX + 0.12, low), (x + _BOX + 0.12, low + 0.1), width=1.0)
        _exhaust(axes, x + _BOX + 0.33, low)
        _line(
            axes,
            (x - 0.26, low + 0.08),
            (x, low + 0.08),
            (x, high - 0.08),
            (x - 0.26, high - 0.08),
            (x - 0.26, low + 0.08),
            width=1.0,
        )
        _line(axes, (x - 0.2, low + 0.08), (x - 0.06, high - 0.08), width=1.0)
        _spring(axes, x + 2 * _BOX, y, 1.0)
        top = x + _BOX + 0.21
        _line(axes, (top, high), (top, high + 0.2), (4.75, high + 0.2), (4.75, wire), (5.35, wire), colour=look.colour)
        _words(axes, x + _BOX, high + 0.38, name, SOLENOID.colour)
    x, y = 2.35, 2.15
    for number in range(3):
        _box(axes, x + number * _BOX, y - 0.5 * _BOX, PROPORTIONAL.colour)
    low, high = y - 0.5 * _BOX, y + 0.5 * _BOX
    for offset, tilt in ((0.0, 1.0), (2 * _BOX, -1.0)):
        _arrow(axes, (x + offset + 0.21, low), (x + offset + 0.21 - tilt * 0.11, high), PROPORTIONAL.colour)
        _arrow(
            axes, (x + offset + 0.21 + tilt * 0.11, high), (x + offset + 0.21 + tilt * 0.11, low), PROPORTIONAL.colour
        )
    for place in (0.1, 0.32):
        _line(axes, (x + _BOX + place, high), (x + _BOX + place, high - 0.1), width=1.0)
        _line(axes, (x + _BOX + place - 0.05, high - 0.1), (x + _BOX + place + 0.05, high - 0.1), width=1.0)
    for edge in (low - 0.05, high + 0.05):
        _line(axes, (x, edge), (x + 3 * _BOX, edge), colour=PROPORTIONAL.colour, width=1.0)
    for left in (x - 0.24, x + 3 * _BOX):
        _line(
            axes,
            (left, low + 0.08),
            (left + 0.24, low + 0.08),
            (left + 0.24, high - 0.08),
            (left, high - 0.08),
            (left, low + 0.08),
            width=1.0,
        )
        _arrow(axes, (left + 0.02, low + 0.02), (left + 0.22, high - 0.02))
    _words(axes, x + 1.5 * _BOX, y - 0.42, "or one proportional 5/3 valve\nin place of A and B", PROPORTIONAL.colour)


def _actuator(axes: "Axes", x: float, y: float) -> None:
    """The semi-rotary actuator with two chambers and a leak past the vane."""
    from matplotlib.patches import Wedge

    radius = 0.72
    axes.add_patch(Wedge((x, y), radius, 90.0, 270.0, facecolor="white", edgecolor=BLACK, linewidth=1.3))
    vane = np.radians(165.0)
    axes.add_patch(Wedge((x, y), radius, 90.0, 165.0, facecolor=CHAMBER_1.colour, alpha=0.25, linewidth=0.0))
    axes.add_patch(Wedge((x, y), radius, 165.0, 270.0, facecolor=CHAMBER_2.colour, alpha=0.25, linewidth=0.0))
    _line(axes, (x, y), (x + radius * np.cos(vane), y + radius * np.sin(vane)), width=2.4)
    axes.plot([x], [y], "o", color=BLACK, markersize=7, markerfacecolor="white", zorder=4)
    for height, name, look in ((0.34, "$P_1$, $V_1$", CHAMBER_1), (-0.38, "$P_2$, $V_2$", CHAMBER_2)):
        _words(axes, x - 0.31, y + height, name, look.colour, size=9.0)
    for height, look in ((0.4, CHAMBER_1), (-0.4, CHAMBER_2)):
        _line(axes, (5.35, y + height), (x - np.sqrt(radius**2 - height**2), y + height), colour=look.colour)
    _line(axes, (x + 0.07, y), (7.25, y), width=2.4)
    _words(axes, x + 0.02, y + 0.95, "rotary actuator")
    _words(axes, x + 0.02, y - 0.95, "leak past the vane,\nfriction, end stops", GREY)
    _words(axes, 6.72, y + 0.14, "$T$", size=10.0)


def _leg(axes: "Axes") -> None:
    """Shank and foot in the sagittal plane, with the angles of the model."""
    from matplotlib.patches import Arc

    knee, ankle = (7.55, 3.95), (7.75, 1.6)
    foot = (8.75, 1.05)
    _line(axes, (7.25, 2.15), (7.25, ankle[1]), (ankle[0] - 0.08, ankle[1]), width=1.2, dashed=True)
    for start, end in ((knee, ankle), (ankle, foot)):
        axes.plot(*zip(start, end, strict=True), color=BLACK, linewidth=5.0, solid_capstyle="round")
    for place in (knee, ankle):
        axes.plot(*place, "o", color=BLACK, markersize=9, markerfacecolor="white", zorder=4)
    _line(axes, knee, (knee[0], 2.5), colour=GREY, width=0.9, dashed=True)
    axes.add_patch(Arc(knee, 2.6, 2.6, theta1=270.0, theta2=275.0, color=GREY, linewidth=1.0))
    axes.add_patch(Arc(ankle, 1.0, 1.0, theta1=-29.0, theta2=95.0, color=BLACK, linewidth=1.0))
    _words(axes, 7.78, 2.75, r"$\varphi$", GREY, size=10.0, align="left")
    _words(axes, 8.3, 1.95, r"ankle angle $\theta$", align="left", size=9.0)
    _words(axes, 7.95, 3.2, "shank", align="left")
    _words(axes, 8.6, 1.42, "foot", align="left")
    _words(axes, 8.05, 0.62, "plantarflexion:\n" + r"$\theta$ grows, chamber 1 fills", CHAMBER_1.colour)
