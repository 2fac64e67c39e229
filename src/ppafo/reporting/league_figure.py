"""The league as a figure: error against gas, with the curve that no control of the valve can pass."""

from typing import TYPE_CHECKING

import numpy as np

from ppafo.reporting.style import BLACK, BLUE, GREY, VERMILION, house_style, mark_kind
from ppafo.studies.league import League, Standing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

_SIZE = (8.0, 5.4)
_GRAMS = 1.0e3
_MARGIN, _LEAST_RANGE = 1.2, 4.0
"""Factors: around everything drawn, and the least that an axis spans."""
_NAMED = ((10.0, (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0)), (200.0, (1.0, 2.0, 5.0)), (float("inf"), (1.0,)))
"""Which multiples of the powers of ten are named on an axis that spans less than a factor."""
COLOURS = {"proportional": BLUE, "solenoid": VERMILION}
MARKERS = "osD^v<>PX*hd"


def league_figure(league: League) -> "Figure":
    """Return the figure: a mark for each controller, its 5 to 95 % range on drawn devices, and the lower bounds."""
    from matplotlib.figure import Figure

    with house_style():
        figure = Figure(figsize=_SIZE)
        figure.subplots_adjust(left=0.09, right=0.66, top=0.9, bottom=0.11)
        axes = figure.subplots()
        for valve in league.bounds:
            _draw_bound(axes, league, valve)
        for number, standing in enumerate(league.standings):
            _draw_standing(axes, standing, MARKERS[number % len(MARKERS)])
        _scale(axes)
        for valve in league.bounds:
            _draw_end(axes, league, valve)
        axes.set_xlabel("RMS torque error (N m)")
        axes.set_ylabel("Gas taken from the supply (g)")
        axes.set_title("Error against gas: below and left of a line nothing is possible")
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, handlelength=1.6)
        mark_kind(figure, "simulated")
        return figure


def _scale(axes: "Axes") -> None:
    """Make both axes logarithmic, with numbers as people write them."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(*_limits(axes, 0))
    axes.set_ylim(*_limits(axes, 1))
    for axis in (axes.xaxis, axes.yaxis):
        named_logarithms(axis)


def named_logarithms(axis: "Axis") -> None:
    """Name so many numbers on a logarithmic axis as fit, written as people write them."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    lowest, highest = axis.get_view_interval()
    axis.set_major_locator(LogLocator(subs=next(subs for most, subs in _NAMED if highest < most * lowest)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def _draw_bound(axes: "Axes", league: League, valve: str) -> None:
    bound = league.bounds[valve].bound
    optima = [bound.least_error, *bound.curve]
    errors = [optimum.rms_error for optimum in optima]
    gas = [_GRAMS * optimum.gas for optimum in optima]
    colour = COLOURS.get(valve, GREY)
    axes.plot(errors, gas, color=colour, label=f"lower bound, {valve}")


def _draw_end(axes: "Axes", league: League, valve: str) -> None:
    """Draw how the bound goes on from the least error: upwards, or to the left where that error counts as none."""
    bound = league.bounds[valve].bound
    error, gas = bound.least_error.rms_error, _GRAMS * bound.least_error.gas
    left, top = axes.get_xlim()[0], axes.get_ylim()[1]
    end = ([left, error], [gas, gas]) if bound.is_attainable else ([error, error], [gas, top])
    axes.plot(*end, color=COLOURS.get(valve, GREY), linewidth=0.9, linestyle=":")


def _limits(axes: "Axes", which: int) -> tuple[float, float]:
    """Return the limits of an axis that leave a margin around everything drawn, at least a factor of 4 apart."""
    drawn = [float(value) for line in axes.lines for value in np.asarray(line.get_xydata())[:, which]]
    lowest, highest = min(drawn) / _MARGIN, max(drawn) * _MARGIN
    widened = max(1.0, (_LEAST_RANGE * lowest / highest) ** 0.5)
    return lowest / widened, highest * widened


def _draw_standing(axes: "Axes", standing: Standing, marker: str) -> None:
    error, gas = standing.value("rms_error"), standing.value("gas_supplied")
    if error is None or gas is None:
        return
    colour = COLOURS.get(standing.entrant.valve, BLACK)
    robust = standing.robustness
    if robust is not None and not robust.failed:
        axes.plot([robust.error(0.05), robust.error(0.95)], [_GRAMS * gas] * 2, color=colour, linewidth=0.9, alpha=0.6)
    axes.plot(
        [error],
        [_GRAMS * gas],
        marker=marker,
        linestyle="none",
        color=colour,
        markerfacecolor="white",
        markersize=6.5,
        label=standing.entrant.name,
    )
