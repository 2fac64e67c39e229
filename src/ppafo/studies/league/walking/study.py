"""Lets every walking controller walk, on drawn wearers and devices too, and holds them against the lower bound."""

import shlex
from collections.abc import Callable, Mapping, Sequence

from ppafo.errors import ParameterError, ScenarioError, SimulationError
from ppafo.studies.league.study import DRAWS, checked_draws
from ppafo.studies.league.walking.bound import Reached, walking_bound
from ppafo.studies.league.walking.draws import drawn_measures
from ppafo.studies.league.walking.entrants import WALKING_ENTRANTS, WalkingEntrant
from ppafo.studies.league.walking.nominal import walked_measures
from ppafo.studies.league.walking.playing import played
from ppafo.studies.league.walking.standing import WalkingBounded, WalkingLeague, WalkingStanding
from ppafo.studies.league.walking.task import WalkingTask
from ppafo.walking.configuration import Configuration


def walking_league(
    task: WalkingTask,
    draws: int = DRAWS,
    entrants: Sequence[WalkingEntrant] = WALKING_ENTRANTS,
    say: Callable[[str], None] = lambda _: None,
) -> WalkingLeague:
    """Return the league of a walking task; ``draws`` wearers and devices show the robustness, 0 for none.

    ScenarioError for bad input; an entrant that cannot walk, or whose walk diverges, is left out, and why is said.
    """
    checked_draws(draws)
    standings, absent = [], {}
    for entrant in entrants:
        say(f"{entrant.name}: the task and {draws} drawn wearers and devices")
        try:
            configuration = task.configuration(entrant.kind, entrant.valve)
            standings.append(_standing(task, entrant, configuration, draws, say))
        except (ParameterError, ScenarioError, SimulationError) as error:
            absent[entrant.name] = str(error)
    if not standings:
        raise ScenarioError(f"{task.file}: no entrant can walk: {next(iter(absent.values()), 'none was given')}")
    standings.sort(key=lambda standing: standing.measures["torque_error"])
    bounds, reason = _bounds(task, standings, say)
    return WalkingLeague(task, tuple(standings), absent, draws, bounds, reason)


def _standing(
    task: WalkingTask, entrant: WalkingEntrant, configuration: Configuration, draws: int, say: Callable[[str], None]
) -> WalkingStanding:
    found = walked_measures(task, configuration)
    robustness = drawn_measures(task, configuration, draws, say) if draws else None
    return WalkingStanding(entrant, configuration, found, robustness, _command(task, entrant))


def _command(task: WalkingTask, entrant: WalkingEntrant) -> str:
    """The command that walks this entrant again."""
    words = ["ppafo", "walk", "--config", task.file, *(() if task.gait is None else ("--gait", task.gait))]
    words += ["--minutes", f"{task.seconds / 60.0:g}"]
    overrides = task.overrides_for(entrant.kind, entrant.valve)
    return shlex.join([*words, *(word for override in overrides for word in ("--set", override))])


def _reached(measures: Mapping[str, float]) -> Reached:
    names = ("lagged_error", "toe_height", "torque_lag", "mid_stance_torque")
    return Reached(*(measures[name] for name in names))


def _bounds(
    task: WalkingTask, standings: Sequence[WalkingStanding], say: Callable[[str], None]
) -> tuple[Mapping[str, WalkingBounded], str]:
    """The bound of every valve that is used, or why there is none."""
    bounds, reasons = {}, []
    for valve in dict.fromkeys(standing.entrant.valve for standing in standings):
        reached = {
            standing.entrant.name: _reached(standing.measures)
            for standing in standings
            if standing.entrant.valve == valve and _is_bounded(standing)
        }
        try:
            bound = walking_bound(task, valve, reached, say)
        except (ScenarioError, SimulationError) as error:
            reasons.append(f"{valve}: {error}")
            continue
        say(f"lower bound, {valve}: played on the engine")
        optima = (bound.least_error, *bound.curve)
        bounds[valve] = WalkingBounded(bound, tuple(played(task, valve, optimum) for optimum in optima))
    return bounds, "; ".join(reasons)


def _is_bounded(standing: WalkingStanding) -> bool:
    """A stride of the bound strikes with the heel; a walk that takes no gas has none to save."""
    return standing.measures["toe_strikes"] == 0.0 and standing.measures["gas"] > 0.0
