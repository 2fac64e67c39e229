"""A league as a figure: error against gas, with the curve that no control of the valve can pass."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.answers.display_units import display_value
from ppafo.answers.style import BLACK, BLUE, GREY, VERMILION, house_style, mark_kind
from ppafo.questions.league.presentation import Look
from ppafo.questions.league.solve import League
from ppafo.questions.league.standing import Bound, Bounded, Standing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

_MARGIN, _LEAST_RANGE = 1.2, 4.0
"""Factors: around everything drawn, and the least that an axis spans."""
_NAMED = ((10.0, (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0)), (200.0, (1.0, 2.0, 5.0)), (float("inf"), (1.0,)))
"""Which multiples of the powers of ten are named on an axis that spans less than a factor."""
_COLOURS = {"proportional": BLUE, "solenoid": VERMILION}
_MARKERS = "osD^v<>PX*hdpH8"


def league_figure(league: League, look: Look) -> "Figure":
    """Return the figure: a mark for each controller, its 5 to 95 % range over the draws, and the lower bounds."""
    from matplotlib.figure import Figure

    with house_style():
        figure = Figure(figsize=look.size)
        figure.subplots_adjust(left=0.09, right=look.right, top=0.9, bottom=0.11)
        axes = figure.subplots()
        for valve, bounded in league.bounds.items():
            errors, gas = _points(bounded)
            axes.plot(errors, gas, color=_COLOURS.get(valve, GREY), label=f"lower bound, {valve}")
        for number, standing in enumerate(league.standings):
            _draw_standing(axes, league, standing, look, _MARKERS[number % len(_MARKERS)])
        if look.is_logarithmic:
            _scale(axes)
            for valve, bounded in league.bounds.items():
                _draw_end(axes, bounded, _COLOURS.get(valve, GREY))
        else:
            axes.set_xscale("log")
            _name_numbers(axes.xaxis)
            axes.set_ylim(bottom=0.0)
            axes.margins(y=0.08)
        axes.set_xlabel(look.error_label)
        axes.set_ylabel(look.gas_label)
        axes.set_title(look.title)
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, handlelength=1.6)
        mark_kind(figure, "simulated")
        return figure


def _points(bounded: Bounded[Bound]) -> tuple[list[float], list[float]]:
    """Return errors and gas of a bound as they are shown."""
    points = bounded.points
    return [display_value(item.rms_error, "torque") for item in points], [
        display_value(item.gas, "gas mass") for item in points
    ]


def _scale(axes: "Axes") -> None:
    """Make both axes logarithmic, with numbers as people write them."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(*_limits(axes, 0))
    axes.set_ylim(*_limits(axes, 1))
    for axis in (axes.xaxis, axes.yaxis):
        _name_numbers(axis)


def _name_numbers(axis: "Axis") -> None:
    """Name so many numbers on a logarithmic axis as fit, written as people write them."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    lowest, highest = axis.get_view_interval()
    axis.set_major_locator(LogLocator(subs=next(subs for most, subs in _NAMED if highest < most * lowest)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def _draw_end(axes: "Axes", bounded: Bounded[Bound], colour: str) -> None:
    """Draw how a bound continues from its minimum error: upwards, or to the left where that error counts as none."""
    (error, *_), (gas, *_) = _points(bounded)
    left, top = axes.get_xlim()[0], axes.get_ylim()[1]
    end = ([left, error], [gas, gas]) if bounded.bound.is_attainable else ([error, error], [gas, top])
    axes.plot(*end, color=colour, linewidth=0.9, linestyle=":")


def _limits(axes: "Axes", which: int) -> tuple[float, float]:
    """Return the limits of an axis that leave a margin around everything drawn, at least a factor of 4 apart."""
    drawn = [float(value) for line in axes.lines for value in np.asarray(line.get_xydata())[:, which]]
    lowest, highest = min(drawn) / _MARGIN, max(drawn) * _MARGIN
    widened = max(1.0, (_LEAST_RANGE * lowest / highest) ** 0.5)
    return lowest / widened, highest * widened


def _draw_standing(axes: "Axes", league: League, standing: Standing, look: Look, marker: str) -> None:
    error, taken = standing.measures.get(look.error), standing.measures.get(league.contest.gas)
    if error is None or taken is None:
        return
    gas, colour = display_value(taken, "gas mass"), _COLOURS.get(standing.entrant.valve, BLACK)
    robust, least = standing.robustness, league.least_gas(standing)
    if robust is not None and not robust.failed:
        across = [robust.not_exceeded(look.error, fraction) for fraction in (0.05, 0.95)]
        axes.plot(across, [gas] * 2, color=colour, linewidth=0.9, alpha=0.6)
    if least is not None and not look.is_logarithmic:
        axes.plot([error] * 2, [display_value(least, "gas mass"), gas], color=colour, linewidth=0.8, linestyle=":")
    axes.plot(
        [error],
        [gas],
        marker=marker,
        linestyle="none",
        color=colour,
        markerfacecolor="white",
        markersize=6.5,
        label=standing.entrant.name,
        clip_on=look.is_logarithmic,
    )
