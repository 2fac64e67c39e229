"""Drawing of the paper's device: gas circuit with ISO 1219-1 symbols, and the leg with the device."""

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ppafo.report.style import BLACK, CHAMBER_1, CHAMBER_2, GREY, PROPORTIONAL, SOLENOID, house_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE = (9.2, 4.85)
"""Size of the drawing [inches]; its coordinates have the same unit, with the origin at the lower left."""
_MIDDLE = 2.4
"""Height of the proportional valve and of the shaft above the lower edge [inches]."""
_UPPER, _LOWER = 3.9, 0.9
_BRANCHES = (
    ("plantarflexion", "valve A, 3/2", CHAMBER_1.colour, _UPPER),
    ("dorsiflexion", "valve B, 3/2", CHAMBER_2.colour, _LOWER),
)
"""Direction, its solenoid valve, colour and height of the two branches of the circuit."""
_BOX, _HALF = 0.42, 0.21
"""Side length of the square of a valve symbol, and half of it [inches]."""
_REGULATED, _TO_ACTUATOR = 2.25, 4.75
"""Horizontal positions [inches] of the couplings between regulators and valves, and between valves and actuator."""


def device_figure() -> "Figure":
    """Return the drawing: bottle, regulators, both valve variants, rotary actuator; shank and foot with angles."""
    from matplotlib.figure import Figure

    with house_style():
        figure = Figure(figsize=_SIZE)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set(xlim=(0.0, _SIZE[0]), ylim=(0.0, _SIZE[1]), aspect="equal")
        axes.axis("off")
        _supply(axes)
        for branch in _BRANCHES:
            _regulator(axes, *branch)
            _solenoid_valve(axes, *branch)
        _proportional_valve(axes, 2.95, _MIDDLE)
        _actuator(axes, 6.15, _MIDDLE)
        _leg(axes)
        return figure


def _line(
    axes: "Axes", *points: tuple[float, float], colour: str = BLACK, width: float = 1.3, dashed: bool = False
) -> None:
    x, y = zip(*points, strict=True)
    axes.plot(x, y, color=colour, linewidth=width, linestyle=(0, (4, 2)) if dashed else "-", solid_capstyle="butt")


def _pipe(axes: "Axes", *turns: float, colour: str = BLACK, width: float = 1.3, dashed: bool = False) -> None:
    """Draw a line of horizontal and vertical segments.

    ``turns`` are x and y of the start, then x, y, x, ... of the corners in turn.
    """
    points = [(turns[0], turns[1])]
    for corner, turn in enumerate(turns[2:]):
        x, y = points[-1]
        points.append((turn, y) if corner % 2 == 0 else (x, turn))
    _line(axes, *points, colour=colour, width=width, dashed=dashed)


def _arrow(axes: "Axes", start: tuple[float, float], end: tuple[float, float], colour: str = BLACK) -> None:
    head = "-|>,head_width=0.13,head_length=0.26"
    shape = {"arrowstyle": head, "color": colour, "linewidth": 1.1, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", end, start, arrowprops=shape)


def _words(
    axes: "Axes", x: float, y: float, text: str, colour: str = BLACK, size: float = 8.5, align: str = "center"
) -> None:
    axes.text(x, y, text, ha=align, va="center", fontsize=size, color=colour)


def _box(axes: "Axes", x: float, y: float, wide: float, high: float, colour: str = BLACK, width: float = 1.3) -> None:
    """Draw a rectangle with lower left corner at (x, y)."""
    _pipe(axes, x, y, x + wide, y + high, x, y, colour=colour, width=width)


def _rings(axes: "Axes", places: Sequence[tuple[float, float]], colour: str, size: float) -> None:
    """Draw open circles for couplings of lines, the shaft and joints of the leg."""
    x, y = zip(*places, strict=True)
    axes.plot(x, y, "o", color=colour, markersize=size, markerfacecolor="white", linestyle="none", zorder=4)


def _blocked(axes: "Axes", x: float, y: float, step: float, half: float) -> None:
    """Draw a port that is closed in a valve position: a short line with a bar across its end."""
    _line(axes, (x, y), (x, y + step), width=1.0)
    _line(axes, (x - half, y + step), (x + half, y + step), width=1.0)


def _exhaust(axes: "Axes", x: float, y: float) -> None:
    """Draw a silencer to the atmosphere: a short line, and an open triangle that points outwards."""
    _line(axes, (x, y), (x, y - 0.1))
    _line(axes, (x - 0.07, y - 0.1), (x + 0.07, y - 0.1), (x, y - 0.22), (x - 0.07, y - 0.1), width=1.0)


def _supply(axes: "Axes") -> None:
    """Draw the bottle, a pressure source, and the lines to the regulators."""
    from matplotlib.patches import FancyBboxPatch

    shape = "round,pad=0,rounding_size=0.2"
    axes.add_patch(FancyBboxPatch((0.32, 1.65), 0.46, 1.5, boxstyle=shape, fill=False, linewidth=1.3))
    _box(axes, 0.47, 3.15, 0.16, 0.13)
    _words(axes, 0.55, _MIDDLE, "CO$_2$", size=10.0)
    _words(axes, 0.55, 1.45, "bottle, 9 oz", GREY)
    _pipe(axes, 0.55, 3.28, 0.55, _UPPER, 1.25)
    _pipe(axes, 1.02, _UPPER, 1.02, _LOWER, 1.25)
    axes.plot([1.02], [_UPPER], "o", color=BLACK, markersize=4)


def _regulator(axes: "Axes", name: str, _valve: str, colour: str, y: float) -> None:
    """Draw a regulator with spring and dashed pilot line from its outlet."""
    x, right, top = 1.25, 1.25 + _BOX, y + _HALF
    _box(axes, x, y - _HALF, _BOX, _BOX, colour)
    _arrow(axes, (x + 0.02, y), (right - 0.02, y), colour)
    _line(axes, (x + _HALF, top), (x + _HALF, top + 0.05))
    coils = x + _HALF + 0.06 * np.array([0, 1, -1, 1, -1, 0]), top + 0.05 + 0.04 * np.arange(6)
    axes.plot(*coils, color=BLACK, linewidth=1.0)
    _pipe(axes, right, y - 0.1, 1.8, y - 0.36, 1.46, y - 0.21, dashed=True, width=0.8)
    _words(axes, 1.46, y + 0.62, "regulator", GREY)
    _words(axes, 1.86, y - 0.25, "$P_s$", colour, align="left")
    _words(axes, _TO_ACTUATOR + 0.1, y - 0.25 * np.sign(y - _MIDDLE), name, colour, align="left")


def _solenoid_valve(axes: "Axes", _name: str, valve: str, colour: str, y: float) -> None:
    """Draw a 3/2 valve with solenoid and spring, between regulator and chamber."""
    x, orange = 3.1, SOLENOID.colour
    centre, low, high = x + _BOX, y - _HALF, y + _HALF
    _pipe(axes, 1.25 + _BOX, y, 2.72, low - 0.16, centre + 0.12, low, colour=colour)
    for edge in (x, centre):
        _box(axes, edge, low, _BOX, _BOX, orange)
    _arrow(axes, (x + 0.12, low), (x + 0.21, high), orange)
    _arrow(axes, (centre + 0.21, high), (centre + 0.33, low), orange)
    _blocked(axes, x + 0.33, low, 0.1, 0.05)
    _blocked(axes, centre + 0.12, low, 0.1, 0.05)
    _exhaust(axes, centre + 0.33, low)
    _box(axes, x - 0.26, low + 0.08, 0.26, _BOX - 0.16, width=1.0)
    _line(axes, (x - 0.2, low + 0.08), (x - 0.06, high - 0.08), width=1.0)
    coils = centre + _BOX + 0.045 * np.arange(7), y + 0.07 * np.array([0, 1, -1, 1, -1, 1, 0])
    axes.plot(*coils, color=BLACK, linewidth=1.0)
    wire = _MIDDLE + 0.4 * np.sign(y - _MIDDLE)
    _pipe(axes, centre + 0.21, high, centre + 0.21, high + 0.2, _TO_ACTUATOR, wire, 5.35, colour=colour)
    _words(axes, centre, high + 0.38, valve, orange)


def _proportional_valve(axes: "Axes", x: float, y: float) -> None:
    """Draw the 5/3 valve with work ports on top, and below the exhaust port between two supply ports."""
    blue, low, high = PROPORTIONAL.colour, y - _HALF, y + _HALF
    centre, right, end = x + _BOX, x + 2 * _BOX, x + 3 * _BOX
    first, second = 0.11, 0.31
    plantarflexion, exhaust, dorsiflexion = 0.07, 0.21, 0.35
    for left in (x, centre, right):
        _box(axes, left, low, _BOX, _BOX, blue)
    _arrow(axes, (x + plantarflexion, low), (x + first, high), blue)
    _arrow(axes, (x + second, high), (x + exhaust, low), blue)
    _arrow(axes, (right + dorsiflexion, low), (right + second, high), blue)
    _arrow(axes, (right + first, high), (right + exhaust, low), blue)
    for place in (x + dorsiflexion, right + plantarflexion, centre + 0.07, centre + 0.21, centre + 0.35):
        _blocked(axes, place, low, 0.09, 0.045)
    for place in (centre + first, centre + second):
        _blocked(axes, place, high, -0.09, 0.045)
    # Two lines along the symbol say that it stands between its positions too.
    for edge in (low - 0.05, high + 0.05):
        _line(axes, (x, edge), (end, edge), colour=blue, width=1.0)
    for left in (x - 0.24, end):
        _box(axes, left, low + 0.08, 0.24, _BOX - 0.16, width=1.0)
        _arrow(axes, (left + 0.02, low + 0.02), (left + 0.22, high - 0.02))
    _exhaust(axes, centre + exhaust, low)
    for port, below, coupled in ((plantarflexion, 0.45, _UPPER), (dorsiflexion, 0.58, _LOWER)):
        _pipe(axes, centre + port, low, centre + port, y - below, _REGULATED, coupled, colour=blue)
    _pipe(axes, centre + first, high, centre + first, y + 0.62, _TO_ACTUATOR, colour=blue)
    beside = _TO_ACTUATOR - 0.15
    _pipe(axes, centre + second, high, centre + second, y + 0.4, beside, y - 0.62, _TO_ACTUATOR, colour=blue)
    regulated = [(_REGULATED, _UPPER), (_REGULATED, _LOWER)]
    _rings(axes, [*regulated, (_TO_ACTUATOR, y + 0.62), (_TO_ACTUATOR, y - 0.62)], blue, 6.0)
    _words(axes, 3.3, y + 0.85, "or one proportional 5/3 valve\nin place of A and B", blue)


def _actuator(axes: "Axes", x: float, y: float) -> None:
    """Draw the semi-rotary actuator with two chambers and a leak across the vane."""
    from matplotlib.patches import Wedge

    radius, vane = 0.72, np.radians(165.0)
    axes.add_patch(Wedge((x, y), radius, 90.0, 270.0, facecolor="white", edgecolor=BLACK, linewidth=1.3))
    chambers = (
        (90.0, 165.0, 0.4, 0.34, "$P_1$, $V_1$", CHAMBER_1.colour),
        (165.0, 270.0, -0.4, -0.38, "$P_2$, $V_2$", CHAMBER_2.colour),
    )
    for start, end, port, height, name, colour in chambers:
        axes.add_patch(Wedge((x, y), radius, start, end, facecolor=colour, alpha=0.25, linewidth=0.0))
        _words(axes, x - 0.31, y + height, name, colour, size=9.0)
        _line(axes, (5.35, y + port), (x - np.sqrt(radius**2 - port**2), y + port), colour=colour)
    _line(axes, (x, y), (x + radius * np.cos(vane), y + radius * np.sin(vane)), width=2.4)
    _rings(axes, [(x, y)], BLACK, 7.0)
    _line(axes, (x + 0.07, y), (7.25, y), width=2.4)
    _words(axes, x + 0.02, y + 0.95, "rotary actuator")
    _words(axes, x + 0.02, y - 0.95, "leak past the vane,\nfriction, end stops", GREY)
    _words(axes, 6.72, y + 0.14, "$T$", size=10.0)


def _leg(axes: "Axes") -> None:
    """Draw shank and foot in the sagittal plane, with the angles of the model."""
    from matplotlib.patches import Arc

    knee, ankle, toes = (7.55, 4.2), (7.75, 1.85), (8.75, 1.3)
    _pipe(axes, 7.25, _MIDDLE, 7.25, ankle[1], ankle[0] - 0.08, width=1.2, dashed=True)
    for start, end in pairwise((knee, ankle, toes)):
        axes.plot(*zip(start, end, strict=True), color=BLACK, linewidth=5.0, solid_capstyle="round")
    _rings(axes, [knee, ankle], BLACK, 9.0)
    _line(axes, knee, (knee[0], 2.75), colour=GREY, width=0.9, dashed=True)
    axes.add_patch(Arc(knee, 2.6, 2.6, theta1=270.0, theta2=275.0, color=GREY, linewidth=1.0))
    axes.add_patch(Arc(ankle, 1.0, 1.0, theta1=-29.0, theta2=95.0, color=BLACK, linewidth=1.0))
    _words(axes, 7.78, 3.0, r"$\varphi$", GREY, size=10.0, align="left")
    _words(axes, 8.3, 2.2, r"ankle angle $\theta$", align="left", size=9.0)
    _words(axes, 7.95, 3.45, "shank", align="left")
    _words(axes, 8.6, 1.67, "foot", align="left")
    _words(axes, 8.05, 0.87, "plantarflexion:\n" + r"$\theta$ grows, chamber 1 fills", CHAMBER_1.colour)
