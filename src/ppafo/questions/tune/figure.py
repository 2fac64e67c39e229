"""Figures of a tuning: the task before and after, and the course of the search."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.display_units import display_values, title_with_unit
from ppafo.answers.layout import Margins, figure_of_free_panels, figure_of_panels
from ppafo.answers.style import BLACK, BLUE, COLOURS, GREY, VERMILION, house_style, label_lines, mark_kind
from ppafo.questions.tune.search import INFEASIBLE
from ppafo.questions.tune.solve import Tuning

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH, _PANEL, _LETTER = 7.2, 1.7, 0.083
_MARGINS = Margins(left=0.75, right=0.2, top=0.55, bottom=0.55, row_gap=0.45)
_PANELS = (
    ("torque", title_with_unit("Actuator torque", "torque"), "torque"),
    ("command", "Valve command (-1 to 1)", ""),
    ("supplied_mass", title_with_unit("Gas supplied", "gas mass"), "gas mass"),
)


def task_figure(tuning: Tuning) -> "Figure":
    """Return torque, command and gas over time with the gains before and after, on the nominal device."""
    height = _MARGINS.top + len(_PANELS) * _PANEL + (len(_PANELS) - 1) * _MARGINS.row_gap + _MARGINS.bottom
    with house_style():
        figure, rows = figure_of_panels((_WIDTH, height), _MARGINS, len(_PANELS))
        for (channel, title, quantity), (axes,) in zip(_PANELS, rows, strict=True):
            for setting, colour, name in ((tuning.before, VERMILION, "before"), (tuning.after, BLUE, "after")):
                recording = setting.result.recording
                steps = "steps-post" if channel == "command" else "default"
                axes.plot(
                    recording.time,
                    display_values(np.asarray(recording[channel]), quantity),
                    color=colour,
                    label=name,
                    linewidth=1.3,
                    drawstyle=steps,
                )
            axes.set_title(title)
        recording = tuning.after.result.recording
        first = rows[0][0]
        if "reference" in recording:
            first.plot(recording.time, recording["reference"], "--", color=BLACK, label="reference", linewidth=1.2)
        label_lines(first)
        rows[-1][0].set_xlabel("Time (s)")
        mark_kind(figure, "simulated")
        return figure


def search_figure(tuning: Tuning) -> "Figure":
    """Return the cost of each start over its generations, and the gains between their bounds."""
    paths = [item.path for item in tuning.problem.searched]
    names = 0.55 + _LETTER * max(len(path) for path in paths)
    margins = Margins(left=0.85, right=0.45, top=0.55, bottom=0.55, row_gap=0.0, column_gap=names)
    height = margins.top + margins.bottom + max(2.3, 0.4 * len(paths))
    with house_style():
        figure, ((course, places),) = figure_of_free_panels((3.2 + 3.2 + names + 1.3, height), margins, 1, 2)
        _draw_course(course, tuning)
        _draw_places(places, tuning)
        mark_kind(figure, "simulated")
        return figure


def _draw_course(axes: "Axes", tuning: Tuning) -> None:
    for number, start in enumerate(tuning.starts):
        costs = np.array(start.generations)
        costs[costs >= INFEASIBLE] = np.nan  # no candidate keeps the constraints yet
        axes.plot(np.arange(costs.size), costs, color=COLOURS[number % len(COLOURS)], linewidth=1.3)
    axes.axhline(tuning.before.objective, color=GREY, linestyle="--", linewidth=1.0)
    if axes.dataLim.ymin > 0.0:
        axes.set_yscale("log")
    axes.set_title("Objective, best so far; dashed: before")
    axes.set_xlabel("Generation")


def _draw_places(axes: "Axes", tuning: Tuning) -> None:
    searched = tuning.problem.searched
    rows = np.arange(len(searched))[::-1]
    for row, item in zip(rows, searched, strict=True):
        axes.plot([0.0, 1.0], [row, row], "-", color=GREY, linewidth=1.0)
        for start in tuning.starts:
            axes.plot(
                item.fraction(float(item.value(np.array(start.fractions[searched.index(item)])))),
                row,
                "|",
                color=GREY,
                markersize=11,
            )
        axes.plot(
            np.clip(item.fraction(item.before), -0.05, 1.05), row, "o", color=VERMILION, markersize=7, label="before"
        )
        axes.plot(item.fraction(tuning.after.gains[item.path]), row, "o", color=BLUE, markersize=7, label="after")
    axes.set_yticks(rows, [item.path for item in searched])
    axes.set_ylim(-0.6, len(searched) - 0.4)
    axes.set_xticks([0.0, 1.0], ["minimum", "maximum"])
    axes.set_title("Between bounds")
    handles, labels = axes.get_legend_handles_labels()
    legend = axes.legend(handles[:2], labels[:2], ncols=2, borderaxespad=0.1, handlelength=0.8, columnspacing=1.0)
    legend.set_loc("lower right")
    legend.set_bbox_to_anchor((1.0, 1.0))
