"""Figures of a trajectory fit: samples as dots, the model as a line, what is left below; how estimates correlate."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.layout import Margins, figure_of_panels
from ppafo.answers.style import ACTUAL, BLACK, CHAMBER_1, CHAMBER_2, GREY, house_style, mark_kind
from ppafo.constants import PASCALS_PER_PSI, STANDARD_ATMOSPHERE
from ppafo.errors import DataError
from ppafo.signals import Recording, RecordingKind
from ppafo.signals.recording import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH, _VALUES, _LEFT_OVER = 7.2, 1.5, 0.62
_MARGINS = Margins(left=0.78, right=0.2, top=0.62, bottom=0.52, row_gap=0.36, label=0.58)
_MATRIX_CELL, _LETTER, _MATRIX_TOP = 0.62, 0.08, 0.5
"""Inches."""

_DOT, _SAMPLE = 1.6, 3.6
_MAXIMUM_DOTS = 90
"""Samples shown beside the line; what is left is shown of all."""
_KIND_WORDS = {"measured": "measured", "simulated": "simulated samples", "synthetic": "synthetic measurement"}
_NAMED = 0.3
"""Correlations from this size on are written into their cell."""


@dataclass(frozen=True, slots=True)
class _ChannelPanel:
    """How a channel is drawn: channel, title, units, values per SI unit, zero in SI units, colour."""

    channel: str
    title: str
    unit: str
    unit_of_difference: str
    factor: float
    zero: float
    colour: str


def trajectory_fit_figure(
    measurement: Recording, model: Recording, atmosphere: float = STANDARD_ATMOSPHERE
) -> "Figure":
    """Return samples, model and residuals of one experiment over time, two panels for each channel that was fitted.

    Both recordings have the same times. Gauge pressure counts from ``atmosphere`` [Pa absolute].
    """
    if not np.array_equal(measurement.time, model.time):
        raise DataError(f"{model.label}: is not at the times of {measurement.label}")
    shown = [one for one in _channels(atmosphere) if one.channel in measurement]
    with house_style():
        heights = [_VALUES, _LEFT_OVER] * len(shown)
        rows = 2 * len(shown)
        height = sum(heights) + (rows - 1) * _MARGINS.row_gap + _MARGINS.top + _MARGINS.bottom
        figure, grid = figure_of_panels((_WIDTH, height), _MARGINS, rows, heights=heights)
        panels = [axes for (axes,) in grid]
        for one, values, left in zip(shown, panels[::2], panels[1::2], strict=True):
            _draw(one, (values, left), measurement, model)
        panels[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.1, handlelength=1.6)
        panels[-1].set_xlabel("Time (s)")
        panels[-1].set_xlim(measurement.time[0], measurement.time[-1])
        inch = 1.0 / height
        figure.text(0.12 / _WIDTH, 1.0 - 0.12 * inch, measurement.label, ha="left", va="top", fontweight="bold")
        mark_kind(figure, measurement.kind)
        return figure


def correlation_figure(names: Sequence[str], correlation: Floats, kind: RecordingKind = "measured") -> "Figure":
    """Return the correlation matrix of estimates as a picture; strong colours are numbers that trade off.

    ``kind`` is that of the recordings.
    """
    from matplotlib.figure import Figure

    count = len(names)
    name_width = 0.45 + _LETTER * max(len(name) for name in names)
    width, height = name_width + count * _MATRIX_CELL + 0.2, _MATRIX_TOP + count * _MATRIX_CELL + 0.35
    with house_style():
        figure = Figure(figsize=(width, height))
        place = (name_width / width, 0.35 / height, count * _MATRIX_CELL / width, count * _MATRIX_CELL / height)
        axes = figure.add_axes(place)
        axes.imshow(correlation, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
        axes.grid(visible=False)
        axes.set_yticks(range(count), [f"{name}  {index + 1}" for index, name in enumerate(names)])
        axes.set_xticks(range(count), [str(index + 1) for index in range(count)])
        for row, column in np.argwhere(np.abs(correlation) >= _NAMED):
            if row != column:
                _write(axes, int(row), int(column), float(correlation[row, column]))
        figure.text(
            0.12 / width, 1.0 - 0.12 / height, "Correlation of the estimates", ha="left", va="top", fontweight="bold"
        )
        mark_kind(figure, kind)
        return figure


def _write(axes: "Axes", row: int, column: int, number: float) -> None:
    colour = "white" if abs(number) > 0.6 else BLACK
    axes.text(column, row, f"{number:+.2f}", ha="center", va="center", fontsize=8.5, color=colour)


def _channels(atmosphere: float) -> tuple[_ChannelPanel, ...]:
    degrees, gauge = float(np.degrees(1.0)), 1.0 / PASCALS_PER_PSI
    return (
        _ChannelPanel("angle", "Vane angle", "deg", "deg", degrees, 0.0, ACTUAL),
        _ChannelPanel("pressure_1", "Pressure in chamber 1", "psig", "psi", gauge, atmosphere, CHAMBER_1),
        _ChannelPanel("pressure_2", "Pressure in chamber 2", "psig", "psi", gauge, atmosphere, CHAMBER_2),
    )


def _draw(one: _ChannelPanel, panels: "tuple[Axes, Axes]", measurement: Recording, model: Recording) -> None:
    values, left = panels
    samples, fitted = (one.factor * (recording[one.channel] - one.zero) for recording in (measurement, model))
    some = slice(None, None, -(-measurement.time.size // _MAXIMUM_DOTS))
    times, word = measurement.time[some], _KIND_WORDS[measurement.kind]
    values.plot(
        times,
        samples[some],
        "o",
        color=BLACK,
        markersize=_SAMPLE,
        markerfacecolor="none",
        markeredgewidth=0.7,
        label=word,
    )
    values.plot(measurement.time, fitted, color=one.colour, linewidth=1.2, label="model")
    values.set_title(f"{one.title} ({one.unit})")
    left.plot(measurement.time, fitted - samples, ".", color=one.colour, markersize=_DOT)
    left.axhline(0.0, color=GREY, linewidth=0.8)
    largest = 1.1 * float(np.max(np.abs(fitted - samples))) or 1.0
    left.set_ylim(-largest, largest)
    left.set_title(f"model minus sample ({one.unit_of_difference})", fontsize=9)
    left.locator_params(axis="y", nbins=3)
