"""The league on a leg that walks as a figure: torque error against gas, with the curve that no control can pass."""

from typing import TYPE_CHECKING

from ppafo.reporting.league_figure import COLOURS, MARKERS, named_logarithms
from ppafo.reporting.style import BLACK, GREY, house_style, mark_kind
from ppafo.studies.league.walking import WalkingLeague, WalkingStanding

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE = (8.4, 5.6)
_GRAMS = 1.0e3


def walking_league_figure(league: WalkingLeague) -> "Figure":
    """Return the figure: a mark for each controller, its 5 to 95 % range on the draws, and the lower bounds."""
    from matplotlib.figure import Figure

    with house_style():
        figure = Figure(figsize=_SIZE)
        figure.subplots_adjust(left=0.09, right=0.62, top=0.9, bottom=0.11)
        axes = figure.subplots()
        for valve in league.bounds:
            _draw_bound(axes, league, valve)
        for number, standing in enumerate(league.standings):
            _draw_standing(axes, league, standing, MARKERS[number % len(MARKERS)])
        axes.set_xscale("log")
        named_logarithms(axes.xaxis)
        axes.set_ylim(bottom=0.0)
        axes.margins(y=0.08)
        axes.set_xlabel("RMS torque error in push-off, lag taken out (N m)")
        axes.set_ylabel("Gas taken from the supply in a stride (g)")
        axes.set_title("Error against gas; lines: the least gas, toes above the ground and no lag")
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, handlelength=1.6)
        mark_kind(figure, "simulated")
        return figure


def _draw_bound(axes: "Axes", league: WalkingLeague, valve: str) -> None:
    bound = league.bounds[valve].bound
    optima = [bound.least_error, *bound.curve]
    gas = [_GRAMS * optimum.gas for optimum in optima]
    errors = [optimum.rms_error for optimum in optima]
    axes.plot(errors, gas, color=COLOURS.get(valve, GREY), label=f"lower bound, {valve}")


def _draw_standing(axes: "Axes", league: WalkingLeague, standing: WalkingStanding, marker: str) -> None:
    error, gas = standing.measures["lagged_error"], _GRAMS * standing.measures["gas"]
    colour = COLOURS.get(standing.entrant.valve, BLACK)
    robust, least = standing.robustness, league.least_gas(standing)
    if robust is not None and not robust.failed:
        across = [robust.lagged_error(share) for share in (0.05, 0.95)]
        axes.plot(across, [gas] * 2, color=colour, linewidth=0.9, alpha=0.6)
    if least is not None:
        axes.plot([error] * 2, [_GRAMS * least, gas], color=colour, linewidth=0.8, linestyle=":")
    axes.plot(
        [error],
        [gas],
        marker=marker,
        linestyle="none",
        color=colour,
        markerfacecolor="white",
        markersize=6.5,
        label=standing.entrant.name,
        clip_on=False,
    )
