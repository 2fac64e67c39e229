"""The answer of a league, whatever its task: the table, what it rests on, error against gas, who plays."""

from typing import Any

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import display_value
from ppafo.questions.league.draws import UNCERTAINTIES
from ppafo.questions.league.figure import league_figure
from ppafo.questions.league.presentation import Presentation
from ppafo.questions.league.solve import League
from ppafo.questions.league.standing import Robustness, Standing
from ppafo.questions.league.torque_contest import TorqueContest
from ppafo.questions.league.torque_presentation import TORQUE
from ppafo.questions.league.walking.presentation import WALKING
from ppafo.simulation.document import plain
from ppafo.studies.intervals import fraction_text
from ppafo.version import __version__

_NAMES = 2
"""Columns of the table that are names."""


def presentation_of(league: League) -> Presentation:
    """Return how the league of a task is presented."""
    return TORQUE if isinstance(league.contest, TorqueContest) else WALKING


def answer_of(league: League) -> Answer:
    """Return the answer of a league."""
    shown_as, contest = presentation_of(league), league.contest
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
    columns = presentation_of(league).columns
    head = (Column("controller"), Column("valve"), *(item.column for item in columns))
    rows = [
        (standing.entrant.name, standing.entrant.valve, *(item.cell(league, standing) for item in columns))
        for standing in league.standings
    ]
    return Table(head, tuple(rows), left=_NAMES)


def league_remarks(league: League) -> list[str]:
    """Return what the numbers rest on: task, bound, draws, noise, what went wrong, who is absent."""
    shown_as = presentation_of(league)
    remarks = [*shown_as.task_remarks(league)]
    remarks += [shown_as.bound_sentence(valve, bounded) for valve, bounded in league.bounds.items()]
    remarks += [f"no lower bound: {league.without_bound}"] if league.without_bound else []
    if league.draws:
        spread = ", ".join(f"{item.name} {display_value(item.fraction, 'fraction'):.0f} %" for item in UNCERTAINTIES)
        remarks.append(shown_as.draws_remark.format(draws=f"{league.draws:,}", spread=spread))
    remarks += _noise_remarks(league)
    for standing in league.standings:
        remarks += shown_as.standing_remarks(league, standing)
        failed = 0 if standing.robustness is None else standing.robustness.failed
        remarks += [f"{standing.entrant.name} diverged in {failed} of the draws"] if failed else []
    return [*remarks, *(f"{name} is absent: {reason}" for name, reason in league.absent.items())]


def _noise_remarks(league: League) -> list[str]:
    """Return what fraction of the spread of each entrant's error over the draws is noise; nothing without noise."""
    fractions = {
        item.entrant.name: item.robustness.noise(league.contest.error)
        for item in league.standings
        if item.robustness is not None
    }
    known = ", ".join(
        f"{name} {fraction_text(fraction)}" for name, fraction in fractions.items() if fraction is not None
    )
    words = "fraction of the error's variance over the draws that is due to sensor noise"
    return [f"{words}: {known}"] if known else []


def _sources(league: League) -> Table:
    head = tuple(map(Column, ("controller", "source", "gains")))
    entrants = [standing.entrant for standing in league.standings]
    return Table(head, tuple((item.name, item.source, item.found) for item in entrants), left=len(head))


def _commands(league: League) -> str:
    return "\n\n".join(f"# {standing.entrant.name}\n{standing.command}" for standing in league.standings)


def _data(league: League) -> dict[str, Any]:
    shown_as = presentation_of(league)
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
        **presentation_of(league).standing_data(league, standing),
        "robustness": None if robust is None else _robustness_data(league, robust),
    }


def _robustness_data(league: League, robust: Robustness) -> dict[str, Any]:
    noise = robust.noise(league.contest.error)
    return {
        "failed": robust.failed,
        "share_of_noise": None if noise is None else plain(noise),
        **presentation_of(league).robustness_data(robust),
    }
