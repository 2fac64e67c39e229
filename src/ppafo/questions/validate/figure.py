"""Measured dots, model line and, below each, what is left between them."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.display_units import axis_unit, display_value, display_values
from ppafo.answers.layout import Margins, figure_of_panels
from ppafo.answers.style import ACTUAL, BLACK, CHAMBER_1, CHAMBER_2, GREY, house_style, mark_kind
from ppafo.signals.recording import Floats
from ppafo.validation import ChannelAgreement, RecordingAgreement
from ppafo.validation.agreement import measured_values
from ppafo.validation.compared import COMPARED, PRESSURE_1, PRESSURE_2

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

KIND_WORDS = {"measured": "measured", "synthetic": "synthetic measurement", "simulated": "simulated, not measured"}
"""What the recording is called beside the model: nobody may take a model's output for a measurement."""

_WIDTH = 7.6
_ROW_HEIGHT = 2.9
_MARGINS = Margins(left=0.68, right=0.15, top=0.72, bottom=0.52, row_gap=0.44, column_gap=0.78)
"""Inches."""
_HEIGHTS = (2.4, 1.0)
_COLOURS = {PRESSURE_1: CHAMBER_1, PRESSURE_2: CHAMBER_2}
_MAXIMUM_DOTS = 400
_NEAR_LIMIT = 0.25
_SHORT = 3.0
"""Recordings shorter than this [s] have an axis in milliseconds."""


def agreement_figure(agreement: RecordingAgreement, atmosphere: float) -> "Figure":
    """Return the figure of one recording: two panels a channel, gauge pressures from ``atmosphere`` [Pa absolute]."""
    channels = agreement.channels
    columns = 1 if len(channels) == 1 else 2
    rows = -(-len(channels) // columns)
    with house_style():
        size = (_WIDTH, _MARGINS.top + _MARGINS.bottom + rows * _ROW_HEIGHT)
        figure, grid = figure_of_panels(size, _MARGINS, 2 * rows, columns, _HEIGHTS * rows)
        scale, unit = (1.0e3, "ms") if agreement.measured.duration < _SHORT else (1.0, "s")
        for number in range(rows * columns):
            row, column = divmod(number, columns)
            upper, lower = grid[2 * row][column], grid[2 * row + 1][column]
            if number >= len(channels):
                upper.set_visible(False)
                lower.set_visible(False)
                continue
            _draw_channel(upper, lower, agreement, channels[number], scale, atmosphere)
        for axes in grid[-1]:
            axes.set_xlabel(f"Time ({unit})")
        _label(figure, grid[0][0], agreement)
        return figure


def _draw_channel(
    upper: "Axes",
    lower: "Axes",
    agreement: RecordingAgreement,
    channel: ChannelAgreement,
    scale: float,
    atmosphere: float,
) -> None:
    name, measured, model = channel.channel, agreement.measured, agreement.model
    quantity = COMPARED[name].quantity
    times = measured.time
    given = measured_values(measured, name)
    if given is None:
        return
    colour = _COLOURS.get(name, ACTUAL)
    line = np.interp(times - agreement.delay.correction, model.time, model[name])
    every = -(-times.size // _MAXIMUM_DOTS)
    upper.plot(
        scale * times[::every],
        _level_in_display_unit(given, name, atmosphere)[::every],
        ".",
        color=BLACK,
        markersize=2.6,
        zorder=2,
    )
    upper.plot(scale * times, _level_in_display_unit(line, name, atmosphere), color=colour, linewidth=1.3, zorder=3)
    upper.set_title(f"{COMPARED[name].title}: RMS {100 * channel.fraction:.2g} %", color=BLACK)
    upper.set_ylabel(_level_unit(name))
    upper.margins(y=0.06)
    residual = display_values(line - given, quantity)
    limit = display_value(channel.limit * channel.full_range, quantity)
    lower.plot(scale * times, residual, color=colour, linewidth=0.9)
    lower.axhline(0.0, color=GREY, linewidth=0.8)
    _mark_limit(lower, limit, float(np.abs(residual).max()))
    lower.set_ylabel(axis_unit(quantity))


def _mark_limit(axes: "Axes", limit: float, largest: float) -> None:
    """Mark the limit of the RMS error where the residual comes near it; else it would only press the residual flat."""
    if largest < _NEAR_LIMIT * limit:
        return
    for level in (-limit, limit):
        axes.axhline(level, color=GREY, linewidth=0.8, linestyle=(0, (4, 3)))


def _label(figure: "Figure", axes: "Axes", agreement: RecordingAgreement) -> None:
    """Name dots and lines once for the whole figure, and say what the recording is."""
    dots, line = axes.lines[0], axes.lines[1]
    inch = 1.0 / figure.get_figheight()
    figure.legend(
        [dots, line],
        [KIND_WORDS[agreement.measured.kind], "model on the recorded inputs"],
        loc="upper left",
        bbox_to_anchor=(0.05, 1.0 - 0.02 * inch),
        ncols=2,
        handlelength=1.6,
        markerscale=2.5,
    )
    mark_kind(figure, agreement.measured.kind)


def _level_in_display_unit(values: Floats, name: str, atmosphere: float) -> Floats:
    """Return the values of a channel as they are drawn; a chamber's gauge pressure counts from the atmosphere there."""
    above = atmosphere if name in (PRESSURE_1, PRESSURE_2) else 0.0
    return display_values(values - above, COMPARED[name].quantity)


def _level_unit(name: str) -> str:
    return axis_unit("pressure" if name in (PRESSURE_1, PRESSURE_2) else COMPARED[name].quantity)
