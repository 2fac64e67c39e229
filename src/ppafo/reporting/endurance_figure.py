"""The figure of a bottle's course: temperature, pressure, and what is left in it."""

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ppafo.constants import GRAMS_PER_KILOGRAM, PASCALS_PER_PSI, STANDARD_ATMOSPHERE
from ppafo.reporting.layout import Margins, figure_of_panels
from ppafo.reporting.style import BLUE, GREEN, GREY, ORANGE, VERMILION, house_style, label_lines, mark_kind
from ppafo.signals.recording import Floats
from ppafo.studies.endurance import Endurance

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SECONDS_PER_MINUTE = 60.0
ICE_POINT = 273.15
"""K at 0 degC."""

_WIDTH, _LEFT, _RIGHT = 7.2, 0.62, 0.2
_PANEL, _GAP, _TOP, _BOTTOM, _REMARK_LINE = 1.5, 0.45, 0.75, 0.62, 0.17
"""Inches."""

_REMARK_WIDTH = 105
_PANELS = 3


def minutes_text(seconds: float) -> str:
    """Return minutes with three digits, and whole ones where there are more."""
    minutes = seconds / SECONDS_PER_MINUTE
    return f"{minutes:.0f}" if minutes >= 999.5 else f"{minutes:.3g}"


def endurance_figure(made: Endurance) -> "Figure":
    """Return the figure of the course that was asked for; below it stands how it ended."""
    recording = made.discharge.recording
    minutes = recording.time / SECONDS_PER_MINUTE
    remarks = textwrap.wrap(f"End: {made.discharge.ending.message}.", _REMARK_WIDTH)
    bottom = _BOTTOM + _REMARK_LINE * len(remarks)
    height = _TOP + _PANELS * _PANEL + (_PANELS - 1) * _GAP + bottom
    with house_style():
        figure, rows = figure_of_panels((_WIDTH, height), Margins(_LEFT, _RIGHT, _TOP, bottom, _GAP), _PANELS)
        grid = [axes for (axes,) in rows]
        _draw_temperature(grid[0], made, minutes)
        _draw_bottle_pressure(grid[1], made, minutes)
        _draw_mass(grid[2], made, minutes)
        for axes in grid:
            axes.locator_params(axis="y", nbins=5)
        grid[-1].set_xlabel("Time (min)")
        grid[-1].set_xlim(0.0, float(minutes[-1]))
        figure.text(0.12 / _WIDTH, 1.0 - 0.12 / height, _title(made), va="top", fontsize=13, fontweight="bold")
        figure.text(0.12 / _WIDTH, 0.1 / height, "\n".join(remarks), va="bottom", fontsize=9, color=VERMILION)
        mark_kind(figure, recording.kind)
        return figure


def _title(made: Endurance) -> str:
    grams = made.draw.mass_per_step * GRAMS_PER_KILOGRAM
    return f"{made.bottle.name}: {grams:.3g} g a step of {made.draw.step_time:.3g} s"


def _draw_temperature(axes: "Axes", made: Endurance, minutes: Floats) -> None:
    recording = made.discharge.recording
    axes.axhline(made.bottle.room_temperature - ICE_POINT, color=GREY, linestyle=":", linewidth=1.2, label="room")
    axes.plot(minutes, recording["wall_temperature"] - ICE_POINT, color=ORANGE, label="wall")
    axes.plot(minutes, recording["bottle_temperature"] - ICE_POINT, color=BLUE, label="content")
    axes.set_title("Temperature of the bottle (degC)")
    label_lines(axes)


def _draw_bottle_pressure(axes: "Axes", made: Endurance, minutes: Floats) -> None:
    regulator = made.bottle.regulator
    pressure = made.discharge.recording["bottle_pressure"]
    needed = regulator.set_pressure + regulator.pressure_margin
    axes.axhline(_psig(needed), color=VERMILION, linestyle="--", linewidth=1.2, label="needed")
    axes.plot(minutes, _gauge(pressure), color=BLUE, label="bottle")
    axes.set_ylim(0.0, 1.06 * _psig(float(np.max(pressure))))
    axes.set_title("Pressure in the bottle (psig)")
    label_lines(axes)


def _draw_mass(axes: "Axes", made: Endurance, minutes: Floats) -> None:
    recording = made.discharge.recording
    names: Sequence[tuple[str, str, str]] = (
        ("bottle_mass", "gas in all", BLUE),
        ("liquid_mass", "liquid", GREEN),
    )
    for name, label, colour in names:
        if name in recording:
            axes.plot(minutes, recording[name] * GRAMS_PER_KILOGRAM, color=colour, label=label)
    axes.set_ylim(0.0, 1.06 * made.bottle.mass * GRAMS_PER_KILOGRAM)
    axes.set_title("Left in the bottle (g)")
    label_lines(axes)


def _psig(pressure: float) -> float:
    return (pressure - STANDARD_ATMOSPHERE) / PASCALS_PER_PSI


def _gauge(pressure: Floats) -> Floats:
    return (pressure - STANDARD_ATMOSPHERE) / PASCALS_PER_PSI
