"""The figure of a design study: error, gas and mass against each other, and how the search grew."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.display_units import display_values, title_with_unit
from ppafo.answers.style import BLACK, BLUE, GREEN, GREY, ORANGE, VERMILION, house_style, mark_kind
from ppafo.questions.design.front import Floats
from ppafo.questions.design.solve import SHOWN_OBJECTIVES, Design, objective_table

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

_SIZE = (9.0, 7.4)
_COLOURS = (BLUE, VERMILION, GREEN, ORANGE, "#CC79A7", "#56B4E9", BLACK, GREY)
_MARKERS = ("o", "^", "s", "D", "v", "P")
_LOGARITHMIC_FROM = 10.0
_AXES = tuple(zip(("Error", "Gas per task", "Mass"), SHOWN_OBJECTIVES.values(), strict=True))
_PANELS = (
    ("A", "Error against gas per task", 0, 1),
    ("B", "Error against mass", 0, 2),
    ("C", "Gas per task against mass", 1, 2),
)
_MAXIMUM_TICKS_OF_ONE_DECADE = 1.5
"""Decades above which a logarithmic axis has ticks at powers of ten only."""


def design_figure(design: Design) -> "Figure":
    """Return three views of the front, coloured by valve and shaped by actuator, and the growth of the hypervolume."""
    from matplotlib.figure import Figure

    with house_style():
        figure = Figure(figsize=_SIZE)
        names = _names(design)
        figure.subplots_adjust(left=0.08, right=0.97, bottom=0.075, top=0.83, wspace=0.25, hspace=0.36)
        panels = figure.subplots(2, 2).ravel()
        table = _objectives_in_display_units(design)
        for axes, (letter, title, x, y) in zip(panels, _PANELS, strict=False):
            _view(axes, design, table, x, y)
            axes.set_title(f"$\\bf{{{letter}}}$   {title}", pad=8)
        _growth(panels[3], design)
        _legend(figure, names, panels[0])
        mark_kind(figure, "simulated")
    return figure


def _objectives_in_display_units(design: Design) -> Floats:
    columns = zip(objective_table(design.front).T, SHOWN_OBJECTIVES.values(), strict=True)
    return np.stack([display_values(values, quantity) for values, quantity in columns], axis=1)


def _names(design: Design) -> tuple[list[str], list[str]]:
    """Return the valves and the actuators on the front, in the order of the problem."""
    valves = [item.valve.name for item in design.problem.combinations]
    actuators = [item.actuator.name for item in design.problem.combinations]
    used = {point.valve.name for point in design.front} | {point.actuator.name for point in design.front}
    return [name for name in dict.fromkeys(valves) if name in used], [
        name for name in dict.fromkeys(actuators) if name in used
    ]


def _view(axes: "Axes", design: Design, table: Floats, x: int, y: int) -> None:
    valves, actuators = _names(design)
    for number, valve in enumerate(valves):
        for other, actuator in enumerate(actuators):
            members = [
                place
                for place, point in enumerate(design.front)
                if point.valve.name == valve and point.actuator.name == actuator
            ]
            axes.plot(
                table[members, x],
                table[members, y],
                linestyle="none",
                marker=_MARKERS[other % len(_MARKERS)],
                markersize=3.2,
                markeredgewidth=0.0,
                color=_COLOURS[number % len(_COLOURS)],
                alpha=0.75,
            )
    knee = table[design.knee]
    axes.plot(knee[x], knee[y], marker="o", markersize=13, markerfacecolor="none", color=BLACK, markeredgewidth=1.4)
    axes.set_xlabel(title_with_unit(*_AXES[x]))
    axes.set_ylabel(title_with_unit(*_AXES[y]))
    _scale(axes.set_xscale, axes.xaxis, table[:, x])
    _scale(axes.set_yscale, axes.yaxis, table[:, y])


def _scale(set_scale: "Callable[[str], None]", axis: "Axis", values: Floats) -> None:
    """Make an axis logarithmic where its values span much, with plain numbers at its ticks."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    if not (values.min() > 0.0 and values.max() > _LOGARITHMIC_FROM * values.min()):
        return
    set_scale("log")
    is_long = np.log10(values.max() / values.min()) > _MAXIMUM_TICKS_OF_ONE_DECADE
    axis.set_major_locator(LogLocator(subs=(1.0,) if is_long else (1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _place: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def _growth(axes: "Axes", design: Design) -> None:
    designs = [count for count, _ in design.growth]
    fractions = [fraction for _, fraction in design.growth]
    axes.plot(designs, fractions, color=BLUE, marker="o", markersize=3)
    axes.set_title("$\\bf{D}$   Hypervolume of the front", pad=8)
    axes.set_xlabel("Designs tried")
    axes.set_ylabel("Fraction of the box of the first designs")
    axes.locator_params(axis="x", nbins=5)


def _legend(figure: "Figure", names: tuple[list[str], list[str]], axes: "Axes") -> None:
    from matplotlib.lines import Line2D

    valves, actuators = names
    handles = [
        Line2D([], [], linestyle="none", marker="s", markersize=7, color=_COLOURS[number % len(_COLOURS)], label=name)
        for number, name in enumerate(valves)
    ]
    handles += [
        Line2D([], [], linestyle="none", marker=_MARKERS[number % len(_MARKERS)], markersize=6, color=GREY, label=name)
        for number, name in enumerate(actuators)
    ]
    handles.append(
        Line2D(
            [], [], linestyle="none", marker="o", markersize=11, markerfacecolor="none", color=BLACK, label="suggested"
        )
    )
    left = axes.get_position().x0
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(left - 0.01, 0.975), ncols=3, columnspacing=1.4)
