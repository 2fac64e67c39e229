"""Figures of a linear model: its frequency response, and how far it holds."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.layout import Margins, figure_of_free_panels, figure_of_panels
from ppafo.answers.style import BLACK, BLUE, GREY, VERMILION, house_style, mark_kind
from ppafo.questions.linearise.solve import LinearModel
from ppafo.questions.linearise.steps import steps_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_POINTS = 400
_DECADES = (0.1, 10.0)
_FASTEST = 100.0
"""Largest frequency [Hz] that is shown, unless the poles lie higher."""
_SHOWN = (-5, -1)
"""Which of the steps are drawn over time: one in the middle of the three decades, and the largest."""


def frequency_figure(model: LinearModel) -> "Figure":
    """Return the response of the torque to the command: size and phase, and the phase with what is left out."""
    from matplotlib.ticker import MultipleLocator

    poles = np.abs(model.poles) / (2.0 * np.pi)
    lowest = min(float(np.min(poles[poles > 0.0], initial=1.0)), 1.0)
    frequencies = np.geomspace(_DECADES[0] * lowest, _FASTEST, _POINTS)
    response = model.response(frequencies)
    late = model.delays.command + model.delays.signals + 0.5 * model.delays.period
    phase = np.degrees(np.unwrap(np.angle(response)))
    with house_style():
        margins = Margins(left=0.9, right=0.25, top=0.4, bottom=0.55, row_gap=0.25, label=0.6)
        figure, panels = figure_of_panels((7.0, 5.0), margins, 2)
        size, angle = panels[0][0], panels[1][0]
        size.loglog(frequencies, np.abs(response), color=BLUE)
        size.set_ylabel("torque per command (N m)")
        angle.semilogx(frequencies, phase, color=BLUE, label="plant")
        angle.semilogx(
            frequencies,
            phase - 360.0 * frequencies * late,
            color=VERMILION,
            linestyle="--",
            label=f"with {1.0e3 * late:.3g} ms of dead time, late measurements and half a sample",
        )
        angle.set_ylim(max(-360.0, float(np.min(phase)) - 90.0), float(np.max(phase)) + 20.0)
        angle.set_ylabel("phase (deg)")
        angle.yaxis.set_major_locator(MultipleLocator(45.0))
        angle.set_xlabel("frequency (Hz)")
        angle.legend(loc="lower left")
        mark_kind(figure, "simulated")
        return figure


def steps_figure(model: LinearModel) -> "Figure":
    """Return steps of the command on the lanes and of the linear model, and their difference over the amplitude."""
    steps = steps_of(model)
    with house_style():
        margins = Margins(left=0.9, right=0.25, top=0.4, bottom=0.55, row_gap=0.0, column_gap=1.0)
        figure, panels = figure_of_free_panels((9.0, 3.8), margins, 1, 2)
        over_time, over_amplitude = panels[0]
        for number, colour in zip(_SHOWN, (BLUE, VERMILION), strict=True):
            share = steps.amplitudes[number] / steps.amplitudes[-1] * 0.3
            label = f"command {100.0 * share:+.3g} %"
            over_time.plot(steps.times, steps.lanes[number] / steps.amplitudes[number], color=colour, label=label)
        over_time.plot(steps.times, steps.linear[-1] / steps.amplitudes[-1], "--", color=BLACK, label="linear")
        over_time.set_xlabel("time after the step (s)")
        over_time.set_ylabel("change of torque per command (N m)")
        over_time.legend(loc="lower right")
        over_amplitude.loglog(steps.sizes, steps.errors, "o", color=BLUE, markersize=4, label="largest difference")
        square = steps.errors[0] * (steps.sizes / steps.sizes[0]) ** 2
        over_amplitude.loglog(steps.sizes, square, "--", color=GREY, label="square of the amplitude")
        over_amplitude.set_xlabel("largest change of torque in a step (N m)")
        over_amplitude.set_ylabel("lanes less linear model (N m)")
        over_amplitude.legend(loc="upper left")
        mark_kind(figure, "simulated")
        return figure
