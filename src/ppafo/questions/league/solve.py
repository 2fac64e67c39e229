"""Plays every entrant on one task, on drawn devices too, and compares them with the lower bound of their valve."""

import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from ppafo.errors import ParameterError, ScenarioError, SimulationError
from ppafo.progress import Progress, Report, report_nothing
from ppafo.questions.league.answer import Contest, League
from ppafo.questions.league.standing import SEED, Bound, Bounded, Entrant, Standing
from ppafo.questions.league.torque import TASK, torque_contest
from ppafo.questions.league.walking.contest import WalkingContest
from ppafo.questions.league.walking.task import MINUTES, walking_task

DRAWS = 100
MAXIMUM_DRAWS = 100_000


def league(
    scenario: str | Path | None = None,
    overrides: Sequence[str] = (),
    draws: int = DRAWS,
    walk: str | Path | None = None,
    gait: str | Path | None = None,
    minutes: float | None = None,
    seed: int = SEED,
    progress: Report | None = None,
    entrants: Sequence[Entrant] | None = None,
) -> League:
    """Rank controllers on a task: a torque to follow, or a leg that walks where ``walk`` is given.

    ``scenario`` is a name or file with a reference, by default ``torque-task-proportional``; ``overrides`` change it,
    but not controller and valve, which every entrant brings. ``walk`` is the name or file of a walk, with another
    ``gait`` if given, for some ``minutes`` (default 0.2). ``draws`` devices around the task's own, and wearers
    who walk, show the robustness, 0 for none; where sensors are noisy each has its own noise. ScenarioError or
    ParameterError for bad input; an entrant that cannot play is left out, with the reason.
    """
    if walk is None:
        misplaced = "--gait" if gait is not None else "--minutes"
        if gait is not None or minutes is not None:
            raise ScenarioError(f"{misplaced} needs a walk: add --walk")
        return play(torque_contest(scenario or TASK, overrides), draws, seed, entrants, progress)
    if scenario is not None:
        raise ScenarioError(f"{scenario}: a league has one task; give a scenario or --walk, not both")
    task = walking_task(walk, overrides, gait, MINUTES if minutes is None else minutes)
    return play(WalkingContest(task), draws, seed, entrants, progress)


def play(
    contest: Contest,
    draws: int = DRAWS,
    seed: int = SEED,
    entrants: Sequence[Entrant] | None = None,
    progress: Report | None = None,
) -> League:
    """Return the league of a contest; all its entrants unless some are given."""
    if not 0 <= draws <= MAXIMUM_DRAWS:
        raise ScenarioError(f"draws = {draws}: must be from 0 to {MAXIMUM_DRAWS}")
    tell = progress or report_nothing
    chosen = contest.entrants if entrants is None else tuple(entrants)
    standings: list[Standing] = []
    absent: dict[str, str] = {}
    began = time.monotonic()
    for done, entrant in enumerate(chosen):
        tell(Progress(entrant.name, done, len(chosen), elapsed=time.monotonic() - began, noun="controllers"))
        try:
            standings.append(contest.evaluate(entrant, draws, seed, tell))
        except (ParameterError, ScenarioError, SimulationError) as error:
            absent[entrant.name] = str(error)
    if not standings:
        raise ScenarioError(
            f"{contest.name}: no controller can perform the task: {next(iter(absent.values()), 'none was given')}"
        )
    standings.sort(key=lambda standing: standing.measures.get(contest.error, 0.0))
    bounds, reason = _bounds(contest, standings, tell)
    return League(contest, tuple(standings), absent, draws, seed, bounds, reason)


def _bounds(
    contest: Contest, standings: Sequence[Standing], progress: Report
) -> tuple[Mapping[str, Bounded[Bound]], str]:
    """Return the bound of every valve that is played with, or why there is none."""
    bounds, reasons = {}, []
    for valve in dict.fromkeys(standing.entrant.valve for standing in standings):
        own = [standing for standing in standings if standing.entrant.valve == valve]
        try:
            bounds[valve] = contest.bound(valve, own, progress)
        except (ScenarioError, SimulationError) as error:
            reasons.append(f"{valve}: {error}")
    return bounds, "; ".join(reasons)
