"""Figure 7 of the paper: the step response in four panels, as simulated."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.reporting.figures import PASCALS_PER_PSI
from ppafo.reporting.style import ACTUAL, CHAMBER_1, CHAMBER_2, GREY, house_style, mark_kind
from ppafo.signals import Recording
from ppafo.signals.recording import Floats
from ppafo.studies.reproduction.step_response import Levels, StepEvents

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE = (7.6, 5.4)
"""Inches."""
_SHOWN_BEFORE_STEP = 0.03
"""Share of the time axis before the step, so that a rise within the first milliseconds does not hide in the axis."""
_SHOWN_AFTER_STOP = 0.8
"""Share of the time until the stop that is shown beyond it; what follows is rest."""
_MILLISECONDS = 1.0e3


def step_response_figure(recording: Recording, levels: Levels, events: StepEvents | None) -> "Figure":
    """Return figure 7: angle, pressure difference, and both pressures over time; ``events`` are marked where known."""
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=_SIZE, layout="constrained")
        grid = figure.subplots(2, 2, sharex=True, gridspec_kw={"wspace": 0.06, "hspace": 0.06})
        difference = (recording["pressure_1"] - recording["pressure_2"]) / PASCALS_PER_PSI
        for axes, letter, name, unit, values, colour in (
            (grid[0, 0], "A", "Vane angle", "deg", np.degrees(recording["angle"]), ACTUAL),
            (grid[0, 1], "B", "Pressure difference, $P_1 - P_2$", "psi", difference, ACTUAL),
            (
                grid[1, 0],
                "C",
                "Pressure in chamber 1, $P_1$",
                "psig",
                _gauge(recording, "pressure_1", levels),
                CHAMBER_1,
            ),
            (
                grid[1, 1],
                "D",
                "Pressure in chamber 2, $P_2$",
                "psig",
                _gauge(recording, "pressure_2", levels),
                CHAMBER_2,
            ),
        ):
            axes.plot(_MILLISECONDS * recording.time, values, color=colour)
            axes.set_title(f"$\\bf{{{letter}}}$   {name}")
            axes.set_ylabel(unit)
            axes.margins(y=0.06)
        for axes in grid[1]:
            axes.set_xlabel("Time after the step (ms)")
        last = _MILLISECONDS * _last_time(recording, events)
        grid[0, 0].set_xlim(-_SHOWN_BEFORE_STEP * last, last)
        if events is not None:
            _mark(list(grid.flat), events)
        figure.align_ylabels(grid)
        mark_kind(figure, recording.kind)
        return figure


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
