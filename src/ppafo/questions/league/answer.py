"""A league, whatever its task, and its answer: the table, what it rests on, error against gas, who plays."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ppafo.answers import Answer, Cell, Column, Figure, Section, Table
from ppafo.answers.display_units import display_value
from ppafo.answers.style import GREY, house_style, look_of_valve, mark_kind
from ppafo.progress import Report
from ppafo.questions.league.standing import UNCERTAINTIES, Bound, Bounded, Entrant, Robustness, Standing
from ppafo.questions.question import Solved
from ppafo.simulation.scenario import plain
from ppafo.studies.distributions import fraction_text
from ppafo.version import __version__

if TYPE_CHECKING:
    import matplotlib.figure
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis


class Contest(Protocol):
    """A task for all entrants; ``error`` and ``gas`` name the measures that the bound is for."""

    @property
    def name(self) -> str:
        """What the task is, in words."""

    @property
    def overrides(self) -> tuple[str, ...]:
        """What is changed for all."""

    @property
    def entrants(self) -> tuple[Entrant, ...]:
        """Who plays by default."""

    @property
    def error(self) -> str:
        """The measure by which entrants are ranked, an RMS error [N m]."""

    @property
    def gas(self) -> str:
        """The measure that is the gas taken from the supply [kg]."""

    @property
    def shown_as(self) -> "Presentation":
        """How its league is presented."""

    def evaluate(self, entrant: Entrant, draws: int, seed: int, progress: Report) -> Standing:
        """Return how an entrant does, over draws too unless 0; a PpafoError states why it cannot play."""

    def bound(self, valve: str, standings: Sequence[Standing], progress: Report) -> Bounded[Bound]:
        """Return the bound of a valve that these played with; SimulationError or ScenarioError where there is none."""


@dataclass(frozen=True, slots=True, repr=False)
class League(Solved):
    """All standings in order of their error; ``bounds`` by valve, or why there are none in ``without_bound``.

    ``absent`` gives by name why an entrant could not play.
    """

    contest: Contest
    standings: tuple[Standing, ...]
    absent: Mapping[str, str]
    draws: int
    seed: int
    bounds: Mapping[str, Bounded[Bound]]
    without_bound: str

    def error_above_least(self, standing: Standing) -> float | None:
        """Return the RMS error [N m] above the minimum that its valve can have; None without a bound that counts."""
        error, bounded = standing.measures.get(self.contest.error), self.bounds.get(standing.entrant.valve)
        least = None if bounded is None else bounded.least_error
        return None if least is None or error is None else max(0.0, error - least)

    def least_gas(self, standing: Standing) -> float | None:
        """Return the minimum gas [kg] for what an entrant reached with its valve; None without a bound."""
        bounded = self.bounds.get(standing.entrant.valve)
        return None if bounded is None else bounded.least_gas.get(standing.entrant.name)

    def gas_above_least(self, standing: Standing) -> float | None:
        """Return the gas [kg] above that; None without a bound."""
        gas, least = standing.measures.get(self.contest.gas), self.least_gas(standing)
        return None if gas is None or least is None else gas - least


@dataclass(frozen=True, slots=True)
class TableColumn:
    """A column of the table, and what stands in it [SI]."""

    column: Column
    cell: Callable[[League, Standing], Cell]

    def head(self, league: League) -> Column:
        """Return the head of the column; that of a distance to the bounds lists what they relax."""
        shown: list[Bounded[Bound]] = []
        if self.cell == League.error_above_least:
            shown = [item for item in league.bounds.values() if item.least_error is not None]
        if self.cell == League.gas_above_least:
            shown = [item for item in league.bounds.values() if item.least_gas]
        relaxed = dict.fromkeys(name for bounded in shown for name in bounded.relaxes)
        return replace(self.column, title=f"{self.column.title} ({', '.join(relaxed)})") if relaxed else self.column


@dataclass(frozen=True, slots=True)
class Look:
    """The figure: size and left of the legend, axes in words, the measure across, and how far the bound is drawn.

    ``is_logarithmic`` gas is drawn with the bound going on beyond its minimum error; else gas begins at 0, and a line
    from each mark leads down to the minimum gas of its own.
    """

    size: tuple[float, float]
    right: float
    error: str
    error_label: str
    gas_label: str
    title: str
    is_logarithmic: bool


@dataclass(frozen=True, slots=True)
class Presentation:
    """How the league of a task is presented; each function gives what this task has and others have not."""

    format: str
    introduction: str
    caption: str
    draws_remark: str
    look: Look
    columns: tuple[TableColumn, ...]
    task_data: Callable[[League], dict[str, Any]]
    task_remarks: Callable[[League], Sequence[str]]
    bound_sentence: Callable[[str, Any], str]
    bound_data: Callable[[Any], dict[str, Any]]
    standing_data: Callable[[League, Standing], dict[str, Any]]
    standing_remarks: Callable[[League, Standing], Sequence[str]]
    robustness_data: Callable[[Robustness], dict[str, Any]]


def measure(title: str, name: str, quantity: str = "", form: str = ".4g") -> TableColumn:
    """Return the column of a measure."""
    return TableColumn(Column(title, quantity, form), lambda _, standing: standing.measures.get(name))


def of_draws(title: str, quantity: str, form: str, value: Callable[[Robustness], float]) -> TableColumn:
    """Return a column of what the draws gave; nothing without draws."""
    return TableColumn(
        Column(title, quantity, form),
        lambda _, standing: None if standing.robustness is None else value(standing.robustness),
    )


_MARGIN, _LEAST_RANGE = 1.2, 4.0
"""Factors: around everything drawn, and the least that an axis spans."""
_NAMED = ((10.0, (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0)), (200.0, (1.0, 2.0, 5.0)), (float("inf"), (1.0,)))
"""Which multiples of the powers of ten are named on an axis that spans less than a factor."""
_NAMES_APART = 0.052
"""Distance between two names beside the figure, as a part of its height."""


def league_figure(league: League, look: Look) -> "matplotlib.figure.Figure":
    """Return the figure: a mark for each controller, its 5 to 95 % range over the draws, and the lower bounds."""
    import matplotlib.figure

    with house_style():
        figure = matplotlib.figure.Figure(figsize=look.size)
        figure.subplots_adjust(left=0.09, right=look.right, top=0.9, bottom=0.11)
        axes = figure.subplots()
        for valve, bounded in league.bounds.items():
            errors, gas = _points(bounded)
            axes.plot(errors, gas, color=look_of_valve(valve).colour, label=f"lower bound, {valve}")
        for standing in league.standings:
            _draw_standing(axes, league, standing, look)
        if look.is_logarithmic:
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.set_xlim(*_limits(axes, 0))
            axes.set_ylim(*_limits(axes, 1))
            for axis in (axes.xaxis, axes.yaxis):
                _name_numbers(axis)
            for valve, bounded in league.bounds.items():
                _draw_end(axes, bounded, look_of_valve(valve).colour)
                _draw_sampled(axes, valve, bounded)
        else:
            axes.set_xscale("log")
            _name_numbers(axes.xaxis)
            axes.set_ylim(bottom=0.0)
            axes.margins(y=0.08)
        axes.set_xlabel(look.error_label)
        axes.set_ylabel(look.gas_label)
        axes.set_title(look.title)
        _name_standings(axes, league, look)
        if league.bounds:
            axes.legend(loc="lower left", bbox_to_anchor=(1.03, 0.0), borderaxespad=0.0, handlelength=1.6)
        mark_kind(figure, "simulated")
        return figure


def _points(bounded: Bounded[Bound]) -> tuple[list[float], list[float]]:
    """Return errors and gas of a bound as they are shown."""
    points = bounded.points
    return [display_value(item.rms_error, "torque") for item in points], [
        display_value(item.gas, "gas mass") for item in points
    ]


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


def _draw_sampled(axes: "Axes", valve: str, bounded: Bounded[Bound]) -> None:
    """Draw the error that no decisions at the sample rate of a valve are below, where it is above that of any rate."""
    least, (any_rate, *_) = bounded.least_error, _points(bounded)[0]
    if least is None or display_value(least, "torque") <= 1.001 * any_rate:
        return
    look = look_of_valve(valve)
    axes.axvline(
        display_value(least, "torque"),
        color=look.colour,
        linewidth=1.0,
        linestyle="--",
        label=f"{valve}, at its sample rate",
    )


def _name_standings(axes: "Axes", league: League, look: Look) -> None:
    """Name the marks beside the figure, in the order of their gas, with a line from each name to its mark."""
    shown = [item for item in league.standings if None not in _place(league, item, look)]
    to_axes = axes.transData + axes.transAxes.inverted()
    named = sorted(
        ((float(to_axes.transform(_shown_place(league, item, look))[1]), item) for item in shown),
        key=lambda pair: -pair[0],
    )
    heights: list[float] = []
    for height, _ in named:
        heights.append(min(1.0, height, *(last - _NAMES_APART for last in heights[-1:])))
    # What would be below the lowest place moves those above it up.
    lowest = 0.2
    for number in reversed(range(len(heights))):
        heights[number] = max(heights[number], lowest)
        lowest = heights[number] + _NAMES_APART
    for height, (_, standing) in zip(heights, named, strict=True):
        axes.annotate(
            standing.entrant.name,
            xy=_shown_place(league, standing, look),
            xytext=(1.03, height),
            textcoords="axes fraction",
            va="center",
            fontsize=9,
            color=look_of_valve(standing.entrant.valve).colour,
            arrowprops={
                "arrowstyle": "-",
                "color": GREY,
                "linewidth": 0.5,
                "relpos": (0.0, 0.5),
                "shrinkA": 2.0,
                "shrinkB": 3.5,
            },
        )


def _place(league: League, standing: Standing, look: Look) -> tuple[float | None, float | None]:
    return standing.measures.get(look.error), standing.measures.get(league.contest.gas)


def _shown_place(league: League, standing: Standing, look: Look) -> tuple[float, float]:
    """Return error and gas of a mark as they are shown."""
    error, gas = _place(league, standing, look)
    assert error is not None, "a mark has an error"
    assert gas is not None, "a mark has gas"
    return error, display_value(gas, "gas mass")


def _limits(axes: "Axes", which: int) -> tuple[float, float]:
    """Return the limits of an axis that leave a margin around everything drawn, at least a factor of 4 apart."""
    drawn = [float(value) for line in axes.lines for value in np.asarray(line.get_xydata())[:, which]]
    lowest, highest = min(drawn) / _MARGIN, max(drawn) * _MARGIN
    widened = max(1.0, (_LEAST_RANGE * lowest / highest) ** 0.5)
    return lowest / widened, highest * widened


def _draw_standing(axes: "Axes", league: League, standing: Standing, look: Look) -> None:
    error, taken = _place(league, standing, look)
    if error is None or taken is None:
        return
    gas, of_valve = display_value(taken, "gas mass"), look_of_valve(standing.entrant.valve)
    colour = of_valve.colour
    robust, least = standing.robustness, league.least_gas(standing)
    if robust is not None and not robust.failed:
        across = [robust.not_exceeded(look.error, fraction) for fraction in (0.05, 0.95)]
        axes.plot(across, [gas] * 2, color=colour, linewidth=0.9, alpha=0.6)
    if least is not None and not look.is_logarithmic:
        axes.plot([error] * 2, [display_value(least, "gas mass"), gas], color=colour, linewidth=0.8, linestyle=":")
    axes.plot(
        [error],
        [gas],
        marker=of_valve.marker,
        linestyle="none",
        color=colour,
        markerfacecolor="white",
        markersize=6.5,
        clip_on=look.is_logarithmic,
    )


_NAMES = 2
"""Columns of the table that are names."""


def answer_of(league: League) -> Answer:
    """Return the answer of a league."""
    shown_as, contest = league.contest.shown_as, league.contest
    changed = f" with {', '.join(contest.overrides)}" if contest.overrides else ""
    count, draws = len(league.standings), f", each on {league.draws:,} draws" if league.draws else ""
    figure = Figure("league", shown_as.caption, lambda: league_figure(league, shown_as.look))
    return Answer(
        name="league",
        kicker="League of controllers",
        title=contest.name,
        lead=(f"{count} controller{'' if count == 1 else 's'}{draws}: {contest.name}{changed}",),
        sections=(
            Section(table=league_table(league), remarks=tuple(league_remarks(league))),
            Section("Error against gas", figure=figure, is_detail=True),
            Section("Origin of each controller", table=_sources(league), is_detail=True),
            Section("Commands that repeat each run", code=_commands(league), is_detail=True),
            Section("How to read it", (shown_as.introduction,), is_detail=True),
        ),
        data=_data(league),
    )


def league_table(league: League) -> Table:
    """Return a row for each standing, in order of the error."""
    columns = league.contest.shown_as.columns
    head = (Column("controller"), Column("valve"), *(item.head(league) for item in columns))
    rows = [
        (standing.entrant.name, standing.entrant.valve, *(item.cell(league, standing) for item in columns))
        for standing in league.standings
    ]
    return Table(head, tuple(rows), left=_NAMES)


def league_remarks(league: League) -> list[str]:
    """Return what the numbers rest on: task, bound, draws, noise, what went wrong, who is absent."""
    shown_as = league.contest.shown_as
    remarks = [*shown_as.task_remarks(league)]
    remarks += [shown_as.bound_sentence(valve, bounded) for valve, bounded in league.bounds.items()]
    remarks += [f"no lower bound: {league.without_bound}"] if league.without_bound else []
    if league.draws:
        spread = ", ".join(f"{item.name} {display_value(item.fraction, 'fraction'):.0f} %" for item in UNCERTAINTIES)
        remarks.append(shown_as.draws_remark.format(draws=f"{league.draws:,}", spread=spread))
    fractions = {
        item.entrant.name: item.robustness.noise(league.contest.error)
        for item in league.standings
        if item.robustness is not None
    }
    known = ", ".join(
        f"{name} {fraction_text(fraction)}" for name, fraction in fractions.items() if fraction is not None
    )
    words = "fraction of the error's variance over the draws that is due to sensor noise"
    remarks += [f"{words}: {known}"] if known else []
    for standing in league.standings:
        remarks += shown_as.standing_remarks(league, standing)
        failed = 0 if standing.robustness is None else standing.robustness.failed
        remarks += [f"{standing.entrant.name} diverged in {failed} of the draws"] if failed else []
    return [*remarks, *(f"{name} is absent: {reason}" for name, reason in league.absent.items())]


def _sources(league: League) -> Table:
    head = tuple(map(Column, ("controller", "source", "gains")))
    entrants = [standing.entrant for standing in league.standings]
    return Table(head, tuple((item.name, item.source, item.found) for item in entrants), left=len(head))


def _commands(league: League) -> str:
    return "\n\n".join(f"# {standing.entrant.name}\n{standing.command}" for standing in league.standings)


def _data(league: League) -> dict[str, Any]:
    shown_as = league.contest.shown_as
    return {
        "format": shown_as.format,
        "schema_version": 1,
        **shown_as.task_data(league),
        "draws": league.draws,
        "seed": league.seed,
        "uncertainties": {item.name: item.fraction for item in UNCERTAINTIES},
        "standings": [_standing_data(league, standing) for standing in league.standings],
        "absent": dict(league.absent),
        "lower_bounds": {valve: shown_as.bound_data(bounded) for valve, bounded in league.bounds.items()},
        "without_bound": league.without_bound,
        "versions": {"ppafo": __version__},
    }


def _standing_data(league: League, standing: Standing) -> dict[str, Any]:
    entrant, robust = standing.entrant, standing.robustness
    return {
        "name": entrant.name,
        "controller": entrant.kind,
        "valve": entrant.valve,
        "settings": dict(standing.settings),
        "period": standing.period,
        "source": entrant.source,
        "gains_found": entrant.found,
        "command": standing.command,
        "error_above_least": league.error_above_least(standing),
        "gas_above_least": league.gas_above_least(standing),
        **league.contest.shown_as.standing_data(league, standing),
        "robustness": None if robust is None else _robustness_data(league, robust),
    }


def _robustness_data(league: League, robust: Robustness) -> dict[str, Any]:
    noise = robust.noise(league.contest.error)
    return {
        "failed": robust.failed,
        "share_of_noise": None if noise is None else plain(noise),
        **league.contest.shown_as.robustness_data(robust),
    }
