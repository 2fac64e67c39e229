"""The figure of a sizing study: the suggestion on the profile, and error and gas of every valve over pressure."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.display_units import axis_unit, display_value, display_values
from ppafo.answers.style import ACTUAL, BLACK, BLUE, GREEN, GREY, ORANGE, VERMILION, WANTED, house_style, mark_kind
from ppafo.questions.size.solve import SizedValve, Sizing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE = (9.0, 6.6)
_COLOURS = (BLUE, VERMILION, GREEN, ORANGE, "#CC79A7", "#56B4E9")
_MAXIMUM_OF_LIMIT = 4.0


def sizing_figure(sizing: Sizing) -> "Figure":
    """Return the torque over time above, error and gas over supply pressure below."""
    from matplotlib.figure import Figure

    with house_style():
        figure = Figure(figsize=_SIZE)
        figure.subplots_adjust(left=0.08, right=0.98, bottom=0.085, top=0.92, wspace=0.22, hspace=0.52)
        grid = figure.add_gridspec(2, 2)
        _torque(figure.add_subplot(grid[0, :]), sizing)
        _errors(figure.add_subplot(grid[1, 0]), sizing)
        _gas(figure.add_subplot(grid[1, 1]), sizing)
        mark_kind(figure, "simulated")
    return figure


def _torque(axes: "Axes", sizing: Sizing) -> None:
    problem = sizing.problem
    time = np.linspace(0.0, problem.scenario.duration, 3001)
    axes.plot(time, problem.profile.at(time), color=WANTED, linestyle="--", linewidth=1.2, label="prescribed")
    title = "Torque (N m)"
    if sizing.recording is not None and sizing.choice is not None:
        axes.plot(sizing.recording.time, sizing.recording["torque"], color=ACTUAL, label=sizing.choice.valve.name)
        pressure = display_value(sizing.choice.pressure, "pressure")
        title += f", {sizing.choice.valve.name} at {pressure:.1f} {axis_unit('pressure')}"
    axes.set_title(f"$\\bf{{A}}$   {title}", pad=18)
    axes.set_xlabel("Time (s)")
    axes.margins(x=0.0)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.1, handlelength=1.6)


def _errors(axes: "Axes", sizing: Sizing) -> None:
    limit = sizing.problem.largest_error
    for number, item in enumerate(sizing.valves):
        pressure, error, _ = item.curve
        colour = _COLOURS[number % len(_COLOURS)]
        axes.plot(
            display_values(pressure, "pressure"), error, color=colour, marker=".", markersize=4, label=item.valve.name
        )
        _mark(axes, item, item.error, colour)
    axes.axhline(limit, color=BLACK, linewidth=1.0, linestyle="--")
    axes.set_ylim(0.0, _MAXIMUM_OF_LIMIT * limit)
    axes.set_title("$\\bf{B}$   RMS error (N m), limit dashed", pad=8)
    axes.set_xlabel(f"Supply pressure ({axis_unit('pressure')})")
    axes.legend(loc="upper right", fontsize=8)


def _gas(axes: "Axes", sizing: Sizing) -> None:
    for number, item in enumerate(sizing.valves):
        pressure, error, gas = item.curve
        keeps = error <= sizing.problem.largest_error
        colour = _COLOURS[number % len(_COLOURS)]
        axes.plot(
            display_values(pressure[keeps], "pressure"),
            display_values(gas[keeps], "gas mass"),
            color=colour,
            marker=".",
            markersize=4,
        )
        _mark(axes, item, display_value(item.gas, "gas mass"), colour)
    axes.set_ylim(bottom=0.0)
    axes.set_title("$\\bf{C}$   Gas per repetition (g) within the limit", pad=8)
    axes.set_xlabel(f"Supply pressure ({axis_unit('pressure')})")
    if not any(item.works for item in sizing.valves):
        axes.text(0.5, 0.5, "no valve keeps the limit", transform=axes.transAxes, ha="center", color=GREY)


def _mark(axes: "Axes", item: SizedValve, value: float, colour: str) -> None:
    """Ring the pressure that was chosen for a valve."""
    if item.works:
        axes.plot(
            display_value(item.pressure, "pressure"),
            value,
            marker="o",
            markersize=9,
            markerfacecolor="none",
            color=colour,
            markeredgewidth=1.4,
        )
