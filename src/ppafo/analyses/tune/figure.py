"""Figures of a tuning: the task before and after, the course of the search, and the gains between their bounds."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.analyses.tune.problem import Problem
from ppafo.analyses.tune.result import INFEASIBLE, Setting, Start
from ppafo.metrics.metric import controlled_in
from ppafo.model.controlled import CONTROLLED, TORQUE
from ppafo.report.display_units import quantity_of_unit
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Mark, Panel
from ppafo.report.setting_names import label_of
from ppafo.report.style import BLACK, BLUE, COLOURS, GREY, VERMILION

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COMMAND, _GAS = Kind("Valve command"), Kind("Gas supplied", "kg", "gas mass")
_BEYOND = 0.05
"""Fraction of the range between the bounds by which gains before the tuning are shown outside at most."""


def task_panels(before: Setting, after: Setting) -> list[Panel]:
    """Return what is controlled, command and gas over time with the gains before and after, on the nominal device."""
    recording = after.result.recording
    controlled = controlled_in(recording) or CONTROLLED[TORQUE]
    words, unit = controlled.words, controlled.level.unit
    level = Kind(words[:1].upper() + words[1:], unit, quantity_of_unit(unit))
    followed = _courses(controlled.channel, before, after)
    if controlled.reference in recording:
        dashed = {"linestyle": "--", "linewidth": 1.2}
        reference = recording[controlled.reference]
        followed.append(Mark("line", recording.time, reference, label="reference", colour=BLACK, style=dashed))
    return [
        Panel(TIME, level, followed, legend="above"),
        Panel(TIME, _COMMAND, _courses("command", before, after), legend=""),
        Panel(TIME, _GAS, _courses("supplied_mass", before, after), legend=""),
    ]


def _courses(channel: str, before: Setting, after: Setting) -> list[Mark]:
    """Return a channel over time, before and after."""
    style = {"linewidth": 1.3, "drawstyle": "steps-post" if channel == "command" else "default"}
    marks = []
    for setting, colour, label in ((before, VERMILION, "before"), (after, BLUE, "after")):
        recording = setting.result.recording
        marks.append(Mark("line", recording.time, recording[channel], label=label, colour=colour, style=style))
    return marks


def search_panels(problem: Problem, before: Setting, after: Setting, starts: Sequence[Start]) -> list[Panel]:
    """Return the best cost of each start over its generations, and where the gains lie between their bounds."""
    return [_cost_panel(before, starts), _bounds_panel(problem, after, starts)]


def _cost_panel(before: Setting, starts: Sequence[Start]) -> Panel:
    marks = []
    for number, start in enumerate(starts):
        costs = np.array(start.generations)
        costs[costs >= INFEASIBLE] = np.nan  # no candidate keeps the constraints yet
        colour = COLOURS[number % len(COLOURS)]
        marks.append(Mark("line", np.arange(costs.size), costs, colour=colour, style={"linewidth": 1.3}))
    dashed = {"linestyle": "--", "linewidth": 1.0}
    marks.append(Mark("level", y=before.objective, colour=GREY, style=dashed))

    def scale(axes: "Axes") -> None:
        if axes.dataLim.ymin > 0.0:
            axes.set_yscale("log")

    return Panel(Kind("Generation"), Kind(), marks, "Objective, best so far; dashed: before", then=scale)


def _bounds_panel(problem: Problem, after: Setting, starts: Sequence[Start]) -> Panel:
    """Return where the gains lie between their bounds: before, after, and where each start ended."""
    searched = problem.searched
    rows = np.arange(len(searched))[::-1]
    ends = [
        gain.fraction(float(gain.value(np.array(start.fractions[row]))))
        for start in starts
        for row, gain in enumerate(searched)
    ]
    before = [float(np.clip(gain.fraction(gain.before), -_BEYOND, 1.0 + _BEYOND)) for gain in searched]
    found = [gain.fraction(after.gains[gain.path]) for gain in searched]
    dots: dict[str, Any] = {"linestyle": "", "marker": "o", "markersize": 7}
    ticks: dict[str, Any] = {"linestyle": "", "marker": "|", "markersize": 11}
    marks = (
        *(Mark("line", [0.0, 1.0], [row, row], colour=GREY, style={"linewidth": 1.0}) for row in rows),
        Mark("line", ends, np.tile(rows, len(starts)), colour=GREY, style=ticks),
        Mark("line", before, rows, label="before", colour=VERMILION, style=dots),
        Mark("line", found, rows, label="after", colour=BLUE, style=dots),
    )

    def name_gains(axes: "Axes") -> None:
        axes.set_yticks(rows, [label_of(gain.path) for gain in searched])
        axes.set_ylim(-0.6, len(searched) - 0.4)
        axes.set_xticks([0.0, 1.0], ["minimum", "maximum"])

    return Panel(Kind(), Kind(), marks, "Between bounds", then=name_gains)
