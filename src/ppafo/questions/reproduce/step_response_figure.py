"""Figure 7 of the paper: the step response in four panels, as simulated."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.layout import Margins, figure_of_panels
from ppafo.answers.style import ACTUAL, BLACK, CHAMBER_1, CHAMBER_2, GREY, house_style, mark_kind
from ppafo.constants import PASCALS_PER_PSI
from ppafo.questions.reproduce.step_response import Levels, StepEvents
from ppafo.signals import Recording
from ppafo.signals.recording import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE = (7.6, 5.6)
_MARGINS = Margins(left=0.68, right=0.15, top=0.58, bottom=0.52, row_gap=0.42, column_gap=0.78)
"""Inches."""
_SHOWN_BEFORE_STEP = 0.03
"""Fraction of the time axis before the step, so that a rise within the first milliseconds does not hide in the axis."""
_SHOWN_AFTER_STOP = 0.8
"""Fraction of the time until the stop that is shown beyond it; what follows is rest."""
_MILLISECONDS = 1.0e3
_NAMED = "BC"
"""Panels with room at the lower right for the names of both curves."""


def step_response_figure(
    recording: Recording, levels: Levels, events: StepEvents | None, synthetic: Recording | None = None
) -> "Figure":
    """Return figure 7: angle, pressure difference, and both pressures over time; ``events`` are marked where known.

    ``synthetic`` is a measurement on the virtual rig, shown as dots in front of the lines of the model.
    """
    with house_style():
        figure, grid = figure_of_panels(_SIZE, _MARGINS, rows=2, columns=2)
        panels = [axes for row in grid for axes in row]
        for axes, curve in zip(panels, _curves(recording, levels), strict=True):
            axes.plot(_MILLISECONDS * recording.time, curve.values, color=curve.colour)
            axes.set_title(f"$\\bf{{{curve.letter}}}$   {curve.name}")
            axes.set_ylabel(curve.unit)
            axes.margins(y=0.06)
        for axes in grid[-1]:
            axes.set_xlabel("Time after the step (ms)")
        last = _MILLISECONDS * _last_time(recording, events)
        panels[0].set_xlim(-_SHOWN_BEFORE_STEP * last, last)
        if events is not None:
            _mark(panels, events)
        if synthetic is None:
            mark_kind(figure, recording.kind)
        else:
            _add_synthetic(panels, synthetic, levels, last)
            mark_kind(figure, synthetic.kind)
        return figure


def _add_synthetic(panels: "list[Axes]", synthetic: Recording, levels: Levels, last: float) -> None:
    """Draw a synthetic measurement as dots and name both where there is room."""
    shown = _MILLISECONDS * synthetic.time <= last
    for axes, curve in zip(panels, _curves(synthetic, levels), strict=True):
        axes.lines[0].set_label("model")
        times = _MILLISECONDS * synthetic.time[shown]
        label = "synthetic measurement"
        axes.plot(times, curve.values[shown], ".", color=BLACK, markersize=2.6, zorder=3, label=label)
        if curve.letter in _NAMED:
            axes.legend(loc="lower right", handlelength=1.2)


@dataclass(frozen=True, slots=True)
class _Curve:
    """What one panel shows."""

    letter: str
    name: str
    unit: str
    values: Floats
    colour: str


def _curves(recording: Recording, levels: Levels) -> tuple[_Curve, ...]:
    difference = (recording["pressure_1"] - recording["pressure_2"]) / PASCALS_PER_PSI
    pressure_1, pressure_2 = (_gauge(recording, name, levels) for name in ("pressure_1", "pressure_2"))
    return (
        _Curve("A", "Vane angle", "deg", np.degrees(recording["angle"]), ACTUAL),
        _Curve("B", "Pressure difference, $P_1 - P_2$", "psi", difference, ACTUAL),
        _Curve("C", "Pressure in chamber 1, $P_1$", "psig", pressure_1, CHAMBER_1),
        _Curve("D", "Pressure in chamber 2, $P_2$", "psig", pressure_2, CHAMBER_2),
    )


def _gauge(recording: Recording, name: str, levels: Levels) -> Floats:
    return (recording[name] - levels.atmosphere) / PASCALS_PER_PSI


def _last_time(recording: Recording, events: StepEvents | None) -> float:
    last = float(recording.time[-1])
    return last if events is None else min(last, events.stop_time * (1.0 + _SHOWN_AFTER_STOP))


def _mark(panels: "list[Axes]", events: StepEvents) -> None:
    """Mark breakaway and stop in every panel, and name them in the first."""
    for axes in panels:
        for time in (events.breakaway_time, events.stop_time):
            axes.axvline(_MILLISECONDS * time, color=GREY, linewidth=0.8, linestyle=(0, (4, 3)), alpha=0.7, zorder=0.5)
    named = ((events.breakaway_time, "vane breaks away", 0.93), (events.stop_time, "vane stops", 0.07))
    for time, name, height in named:
        panels[0].annotate(
            name,
            (_MILLISECONDS * time, height),
            xycoords=("data", "axes fraction"),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontsize=8.5,
            color=GREY,
        )
