"""A drawing of the paper's device: gas circuit in symbols of fluid power (ISO 1219-1), and the leg that wears it."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.report.style import BLACK, CHAMBER_1, CHAMBER_2, GREY, PROPORTIONAL, SOLENOID, house_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE = (9.2, 4.85)
"""Inches; the drawing is in the same units, with the origin at the lower left."""
_MIDDLE = 2.4
"""Height of the proportional valve and of the shaft."""
_BRANCHES = (("plantarflexion", "valve A, 3/2", CHAMBER_1, 3.9), ("dorsiflexion", "valve B, 3/2", CHAMBER_2, 0.9))
"""Direction, its solenoid valve, colour and height of the two branches of the circuit."""
_BOX = 0.42
_SPOOL = 2.95
"""Left edge of the three positions of the proportional valve."""
_REGULATED, _TO_ACTUATOR = 2.25, 4.75
"""Where the lines between regulators and valves, and between valves and actuator, are coupled."""


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
        _actuator(axes, 6.15, _MIDDLE)
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
        FancyBboxPatch((0.32, 1.65), 0.46, 1.5, boxstyle="round,pad=0,rounding_size=0.2", fill=False, linewidth=1.3)
    )
    _line(axes, (0.47, 3.15), (0.47, 3.28), (0.63, 3.28), (0.63, 3.15))
    _words(axes, 0.55, _MIDDLE, "CO$_2$", size=10.0)
    _words(axes, 0.55, 1.45, "bottle, 9 oz", GREY)
    upper, lower = (height for _, _, _, height in _BRANCHES)
    _line(axes, (0.55, 3.28), (0.55, upper), (1.25, upper))
    _line(axes, (1.02, upper), (1.02, lower), (1.25, lower))
    axes.plot([1.02], [upper], "o", color=BLACK, markersize=4)
    for name, _, look, y in _BRANCHES:
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
        _words(axes, _TO_ACTUATOR + 0.1, y - 0.25 * np.sign(y - _MIDDLE), name, look.colour, align="left")


def _valves(axes: "Axes") -> None:
    """Two 3/2 valves with solenoid and spring, or one proportional 5/3 valve in their place, on the same four lines."""
    for _, name, look, y in _BRANCHES:
        x = 3.1
        supplied, below = x + _BOX + 0.12, y - 0.5 * _BOX - 0.16
        _line(
            axes,
            (1.25 + _BOX, y),
            (2.72, y),
            (2.72, below),
            (supplied, below),
            (supplied, y - 0.5 * _BOX),
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
        top, wire = x + _BOX + 0.21, _MIDDLE + 0.4 * np.sign(y - _MIDDLE)
        _line(
            axes,
            (top, high),
            (top, high + 0.2),
            (_TO_ACTUATOR, high + 0.2),
            (_TO_ACTUATOR, wire),
            (5.35, wire),
            colour=look.colour,
        )
        _words(axes, x + _BOX, high + 0.38, name, SOLENOID.colour)
    _proportional_valve(axes, _SPOOL, _MIDDLE)


def _proportional_valve(axes: "Axes", x: float, y: float) -> None:
    """The 5/3 valve: work ports on top, and below one exhaust between the ports of the two regulators."""
    blue = PROPORTIONAL.colour
    low, high = y - 0.5 * _BOX, y + 0.5 * _BOX
    for number in range(3):
        _box(axes, x + number * _BOX, low, blue)
    first, second = 0.11, 0.31
    plantarflexion, exhaust, dorsiflexion = 0.07, 0.21, 0.35
    right = x + 2 * _BOX
    _arrow(axes, (x + plantarflexion, low), (x + first, high), blue)
    _arrow(axes, (x + second, high), (x + exhaust, low), blue)
    _arrow(axes, (right + dorsiflexion, low), (right + second, high), blue)
    _arrow(axes, (right + first, high), (right + exhaust, low), blue)
    centre = x + _BOX
    blocked_below = (x + dorsiflexion, right + plantarflexion, *(centre + at for at in (0.07, 0.21, 0.35)))
    for places, edge, step in ((blocked_below, low, 0.09), ((centre + first, centre + second), high, -0.09)):
        for place in places:
            _line(axes, (place, edge), (place, edge + step), width=1.0)
            _line(axes, (place - 0.045, edge + step), (place + 0.045, edge + step), width=1.0)
    for edge in (low - 0.05, high + 0.05):
        _line(axes, (x, edge), (x + 3 * _BOX, edge), colour=blue, width=1.0)
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
    _exhaust(axes, centre + exhaust, low)
    upper, lower = (height for _, _, _, height in _BRANCHES)
    left, beside = _REGULATED, _TO_ACTUATOR - 0.15
    couplings = ((left, upper), (left, lower), (_TO_ACTUATOR, y + 0.62), (_TO_ACTUATOR, y - 0.62))
    _line(
        axes,
        (centre + plantarflexion, low),
        (centre + plantarflexion, y - 0.45),
        (left, y - 0.45),
        couplings[0],
        colour=blue,
    )
    _line(
        axes,
        (centre + dorsiflexion, low),
        (centre + dorsiflexion, y - 0.58),
        (left, y - 0.58),
        couplings[1],
        colour=blue,
    )
    _line(axes, (centre + first, high), (centre + first, y + 0.62), couplings[2], colour=blue)
    _line(
        axes,
        (centre + second, high),
        (centre + second, y + 0.4),
        (beside, y + 0.4),
        (beside, y - 0.62),
        couplings[3],
        colour=blue,
    )
    axes.plot(
        *zip(*couplings, strict=True),
        "o",
        color=blue,
        markersize=6,
        markerfacecolor="white",
        linestyle="none",
        zorder=4,
    )
    _words(axes, 3.3, y + 0.85, "or one proportional 5/3 valve\nin place of A and B", blue)


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

    knee, ankle = (7.55, 4.2), (7.75, 1.85)
    foot = (8.75, 1.3)
    _line(axes, (7.25, _MIDDLE), (7.25, ankle[1]), (ankle[0] - 0.08, ankle[1]), width=1.2, dashed=True)
    for start, end in ((knee, ankle), (ankle, foot)):
        axes.plot(*zip(start, end, strict=True), color=BLACK, linewidth=5.0, solid_capstyle="round")
    for place in (knee, ankle):
        axes.plot(*place, "o", color=BLACK, markersize=9, markerfacecolor="white", zorder=4)
    _line(axes, knee, (knee[0], 2.75), colour=GREY, width=0.9, dashed=True)
    axes.add_patch(Arc(knee, 2.6, 2.6, theta1=270.0, theta2=275.0, color=GREY, linewidth=1.0))
    axes.add_patch(Arc(ankle, 1.0, 1.0, theta1=-29.0, theta2=95.0, color=BLACK, linewidth=1.0))
    _words(axes, 7.78, 3.0, r"$\varphi$", GREY, size=10.0, align="left")
    _words(axes, 8.3, 2.2, r"ankle angle $\theta$", align="left", size=9.0)
    _words(axes, 7.95, 3.45, "shank", align="left")
    _words(axes, 8.6, 1.67, "foot", align="left")
    _words(axes, 8.05, 0.87, "plantarflexion:\n" + r"$\theta$ grows, chamber 1 fills", CHAMBER_1.colour)
