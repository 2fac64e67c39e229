"""The figure of a bottle's course: temperature, pressure, and what is left in it."""

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.display_units import axis_unit, display_value, display_values, quantity_text
from ppafo.answers.layout import Margins, figure_of_panels
from ppafo.answers.style import BLUE, GREEN, GREY, ORANGE, VERMILION, house_style, label_lines, mark_kind
from ppafo.questions.endurance.solve import Endurance
from ppafo.signals.recording import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH, _LEFT, _RIGHT = 7.2, 0.62, 0.2
_PANEL, _GAP, _TOP, _BOTTOM, _REMARK_LINE = 1.5, 0.45, 0.75, 0.62, 0.17
"""Inches."""

_REMARK_WIDTH = 105
_PANELS = 3


def endurance_figure(found: Endurance) -> "Figure":
    """Return the figure of the requested course; below it stands how it ended."""
    recording = found.discharge.recording
    minutes = display_values(recording.time, "duration")
    remarks = textwrap.wrap(f"End: {found.discharge.ending.message}.", _REMARK_WIDTH)
    bottom = _BOTTOM + _REMARK_LINE * len(remarks)
    height = _TOP + _PANELS * _PANEL + (_PANELS - 1) * _GAP + bottom
    with house_style():
        figure, rows = figure_of_panels((_WIDTH, height), Margins(_LEFT, _RIGHT, _TOP, bottom, _GAP), _PANELS)
        grid = [axes for (axes,) in rows]
        _draw_temperature(grid[0], found, minutes)
        _draw_bottle_pressure(grid[1], found, minutes)
        _draw_mass(grid[2], found, minutes)
        for axes in grid:
            axes.locator_params(axis="y", nbins=5)
        grid[-1].set_xlabel(f"Time ({axis_unit('duration')})")
        grid[-1].set_xlim(0.0, float(minutes[-1]))
        figure.text(0.12 / _WIDTH, 1.0 - 0.12 / height, _title(found), va="top", fontsize=13, fontweight="bold")
        figure.text(0.12 / _WIDTH, 0.1 / height, "\n".join(remarks), va="bottom", fontsize=9, color=VERMILION)
        mark_kind(figure, recording.kind)
        return figure


def _title(found: Endurance) -> str:
    gas, time = quantity_text(found.draw.mass_per_step, "gas mass"), quantity_text(found.draw.step_time, "time")
    return f"{found.bottle.name}: {gas} per step of {time}"


def _draw_temperature(axes: "Axes", found: Endurance, minutes: Floats) -> None:
    recording = found.discharge.recording
    axes.axhline(
        display_value(found.bottle.room_temperature, "temperature"),
        color=GREY,
        linestyle=":",
        linewidth=1.2,
        label="room",
    )
    axes.plot(minutes, display_values(recording["wall_temperature"], "temperature"), color=ORANGE, label="wall")
    axes.plot(minutes, display_values(recording["bottle_temperature"], "temperature"), color=BLUE, label="content")
    axes.set_title(f"Temperature of the bottle ({axis_unit('temperature')})")
    label_lines(axes)


def _draw_bottle_pressure(axes: "Axes", found: Endurance, minutes: Floats) -> None:
    regulator = found.bottle.regulator
    pressure = found.discharge.recording["bottle_pressure"]
    needed = regulator.set_pressure + regulator.pressure_margin
    axes.axhline(display_value(needed, "pressure"), color=VERMILION, linestyle="--", linewidth=1.2, label="needed")
    axes.plot(minutes, display_values(pressure, "pressure"), color=BLUE, label="bottle")
    axes.set_ylim(0.0, 1.06 * display_value(float(np.max(pressure)), "pressure"))
    axes.set_title(f"Pressure in the bottle ({axis_unit('pressure')})")
    label_lines(axes)


def _draw_mass(axes: "Axes", found: Endurance, minutes: Floats) -> None:
    recording = found.discharge.recording
    names: Sequence[tuple[str, str, str]] = (
        ("bottle_mass", "total gas", BLUE),
        ("liquid_mass", "liquid", GREEN),
    )
    for name, label, colour in names:
        if name in recording:
            axes.plot(minutes, display_values(recording[name], "gas mass"), color=colour, label=label)
    axes.set_ylim(0.0, 1.06 * display_value(found.bottle.mass, "gas mass"))
    axes.set_title(f"Left in the bottle ({axis_unit('gas mass')})")
    label_lines(axes)
