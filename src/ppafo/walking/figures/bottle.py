"""The bottle of a walk over time: pressures, temperatures, the peak of the torque in each stride, and gas."""

import textwrap
from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.display_units import axis_unit, display_value, display_values
from ppafo.answers.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    VERMILION,
    Margins,
    figure_of_panels,
    house_style,
    label_lines,
    mark_kind,
)
from ppafo.signals.recording import Floats
from ppafo.walking.result import WalkResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH, _PANEL, _REMARK_LINE, _REMARK_WIDTH = 8.4, 1.35, 0.17, 118
_MARGINS = Margins(left=0.75, right=0.2, top=0.75, bottom=0.62, row_gap=0.4, label=0.55)
_PANELS = 5
_LONG = 120.0
"""Time [s] above which the axis is in minutes."""


def peak_torques(result: WalkResult) -> Floats:
    """Return the largest torque [N m] of each whole stride (strides,)."""
    edges = result.starts
    if edges.size < 2:
        return np.zeros(0)
    return np.maximum.reduceat(result.recording["torque"], edges)[:-1]


def bottle_figure(result: WalkResult) -> "Figure":
    """Return the figure of a walk on its bottle; below it stands what ended it."""
    assert result.supply is not None, "drawn for a walk on a bottle"
    ending = result.supply.ending
    remarks = textwrap.wrap(f"End: {ending.message}.", _REMARK_WIDTH)
    bottom = _MARGINS.bottom + _REMARK_LINE * len(remarks)
    margins = Margins(_MARGINS.left, _MARGINS.right, _MARGINS.top, bottom, _MARGINS.row_gap, label=_MARGINS.label)
    height = _MARGINS.top + _PANELS * _PANEL + (_PANELS - 1) * _MARGINS.row_gap + bottom
    end = float(result.recording.time[-1])
    scale, unit = (60.0, "min") if end > _LONG else (1.0, "s")
    with house_style():
        figure, rows = figure_of_panels((_WIDTH, height), margins, _PANELS)
        grid = [axes for (axes,) in rows]
        _draw_supply(grid[0], result, scale)
        _draw_bottle_pressure(grid[1], result, scale)
        _draw_temperatures(grid[2], result, scale)
        _draw_torque(grid[3], result, scale)
        _draw_gas(grid[4], result, scale)
        for axes in grid:
            axes.locator_params(axis="y", nbins=5)
            axes.axvline(ending.time / scale, color=VERMILION, linewidth=1.0)
        grid[-1].set_xlabel(f"Time ({unit})")
        grid[-1].set_xlim(0.0, 1.005 * end / scale)
        title = f"{result.scenario.name} on {result.supply.supply.bottle.name}"
        figure.text(0.12 / _WIDTH, 1.0 - 0.12 / height, title, va="top", fontsize=13, fontweight="bold")
        figure.text(0.12 / _WIDTH, 0.1 / height, "\n".join(remarks), va="bottom", fontsize=9, color=VERMILION)
        mark_kind(figure, result.recording.kind)
        return figure


def _draw_supply(axes: "Axes", result: WalkResult, scale: float) -> None:
    """Draw what the line behind the regulator has: highest and lowest of each stride, and what is held at most."""
    recording, supply, edges = result.recording, result.supply, result.starts
    assert supply is not None, "drawn for a walk on a bottle"
    held = display_values(supply.values["regulated_pressure"], "pressure")
    axes.plot(supply.times / scale, held, color=GREY, linestyle="--", linewidth=1.2, label="held at most")
    line = display_values(recording["line_pressure_1"], "pressure")
    if edges.size > 1:
        times = recording.time[edges[:-1]] / scale
        lowest, highest = (pick.reduceat(line, edges)[:-1] for pick in (np.minimum, np.maximum))
        axes.fill_between(times, lowest, highest, color=BLUE, alpha=0.3, linewidth=0.0, label="line, in a stride")
    axes.set_title(f"Pressure behind the regulator ({axis_unit('pressure')})")
    label_lines(axes)


def _draw_bottle_pressure(axes: "Axes", result: WalkResult, scale: float) -> None:
    supply = result.supply
    assert supply is not None, "drawn for a walk on a bottle"
    regulator = supply.supply.bottle.regulator
    needed = display_value(regulator.set_pressure + regulator.pressure_margin, "pressure")
    pressure = display_values(supply.values["bottle_pressure"], "pressure")
    axes.axhline(needed, color=VERMILION, linestyle="--", linewidth=1.2, label="needed")
    axes.plot(supply.times / scale, pressure, color=BLUE, label="bottle")
    axes.set_ylim(0.0, 1.06 * float(pressure.max()))
    axes.set_title(f"Pressure in the bottle ({axis_unit('pressure')})")
    label_lines(axes)


def _draw_temperatures(axes: "Axes", result: WalkResult, scale: float) -> None:
    supply = result.supply
    assert supply is not None, "drawn for a walk on a bottle"
    lines = (
        ("bottle_temperature", "bottle", BLUE, "-"),
        ("regulator_temperature", "regulator", BLACK, "-"),
        ("outlet_temperature", "gas behind it", ORANGE, "-"),
        ("gas_temperature", "gas at the device", GREEN, "-"),
    )
    for name, label, colour, style in lines:
        values = display_values(supply.values[name], "temperature")
        axes.plot(supply.times / scale, values, color=colour, linestyle=style, label=label)
    if supply.supply.line.freezes > 0.5:
        ice = display_value(supply.supply.line.temperatures[0], "temperature")
        axes.axhline(ice, color=VERMILION, linestyle="--", linewidth=1.2, label="dry ice")
    axes.set_title(f"Temperature ({axis_unit('temperature')})")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=5, borderaxespad=0.1, handlelength=1.2)


def _draw_torque(axes: "Axes", result: WalkResult, scale: float) -> None:
    peaks = peak_torques(result)
    times = result.recording.time[result.starts[:-1]] / scale if peaks.size else peaks
    axes.plot(times, peaks, color=BLUE, marker=".", markersize=2.5, linewidth=0.8)
    axes.set_ylim(0.0, 1.1 * float(peaks.max(initial=0.1)))
    axes.set_title("Peak torque of each stride (N m)")


def _draw_gas(axes: "Axes", result: WalkResult, scale: float) -> None:
    supply = result.supply
    assert supply is not None, "drawn for a walk on a bottle"
    for name, label, colour in (("bottle_mass", "total gas", BLUE), ("liquid_mass", "liquid", GREEN)):
        if name in supply.values:
            values = display_values(supply.values[name], "gas mass")
            axes.plot(supply.times / scale, values, color=colour, label=label)
    axes.set_ylim(0.0, 1.06 * display_value(supply.supply.mass, "gas mass"))
    axes.set_title(f"Left in the bottle ({axis_unit('gas mass')})")
    label_lines(axes)
