"""Plays every entrant on one task, on drawn devices too, and holds them against the lower bound."""

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.errors import ParameterError, ScenarioError, SimulationError
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.overriding import split_override
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import simulate, simulate_many
from ppafo.studies.league.draws import NOISE_DRAWS, drawn_devices, drawn_factors, drawn_seeds
from ppafo.studies.league.entrants import ENTRANTS, Entrant
from ppafo.studies.league.learning import Learning, learn, table_of
from ppafo.studies.league.lower_bound import lower_bound, played
from ppafo.studies.league.standing import Bounded, League, Robustness, Standing
from ppafo.studies.sweep.noise import is_noisy, other_noise

TASK = "torque-task-proportional"
DRAWS = 100
MOST_DRAWS = 100_000
SPECIAL = ("controller.", "device.valve")


def league(
    scenario: str | Path = TASK,
    overrides: Sequence[str] = (),
    draws: int = DRAWS,
    entrants: Sequence[Entrant] = ENTRANTS,
    say: Callable[[str], None] = lambda _: None,
) -> League:
    """Return the league of a task: a scenario by name or file, with overrides that are not of controller or valve.

    ``draws`` devices around the scenario's own show the robustness, 0 for none. ScenarioError or ParameterError for bad
    input; an entrant that cannot play the scenario is left out, and why is said.
    """
    _check(scenario, overrides, draws)
    tasks, absent = _tasks(scenario, overrides, entrants)
    standings = []
    for entrant, task in tasks.items():
        say(f"{entrant.name}: the task and {draws} drawn devices")
        standings.append(_standing(entrant, task, scenario, overrides, draws))
    standings.sort(key=lambda standing: standing.value("rms_error") or 0.0)
    bounds, reason = _bounds(standings, say)
    return League(str(scenario), tuple(overrides), tuple(standings), absent, draws, bounds, reason)


def checked_draws(draws: int) -> int:
    """The number of draws; ScenarioError where it is none that a league takes."""
    if not 0 <= draws <= MOST_DRAWS:
        raise ScenarioError(f"draws = {draws}: must be from 0 to {MOST_DRAWS}")
    return draws


def _check(scenario: str | Path, overrides: Sequence[str], draws: int) -> None:
    checked_draws(draws)
    for override in overrides:
        path, _ = split_override(override)
        if path.startswith(SPECIAL):
            raise ScenarioError(
                f"override '{override}': every entrant of the league brings its own controller and valve"
            )
    if "reference" not in load_scenario(scenario, overrides).origin.content:
        raise ScenarioError(
            f"{scenario}: has no [reference], so there is nothing for a league of controllers to follow"
        )


def _tasks(
    scenario: str | Path, overrides: Sequence[str], entrants: Sequence[Entrant]
) -> tuple[dict[Entrant, Scenario], dict[str, str]]:
    """The scenario as each entrant plays it, and why the others cannot."""
    tasks, absent = {}, {}
    for entrant in entrants:
        try:
            tasks[entrant] = load_scenario(scenario, [*entrant.overrides, *overrides])
        except (ParameterError, ScenarioError) as error:
            absent[entrant.name] = str(error)
    if not tasks:
        raise ScenarioError(f"{scenario}: no entrant can play it: {next(iter(absent.values()), 'none was given')}")
    return tasks, absent


def _standing(entrant: Entrant, task: Scenario, scenario: str | Path, overrides: Sequence[str], draws: int) -> Standing:
    learning: Learning | None = learn(task) if entrant.learns else None
    final = task if learning is None else learning.scenario
    learnt = [] if learning is None else [f"controller.{name}={value!r}" for name, value in table_of(final).items()]
    words = [word for override in (*entrant.overrides, *learnt, *overrides) for word in ("--set", override)]
    command = shlex.join(["ppafo", "simulate", str(scenario), *words])
    return Standing(entrant, simulate(final), command, _robustness(final, draws) if draws else None, learning)


def _robustness(task: Scenario, draws: int) -> Robustness:
    """Return what the entrant makes of the drawn devices, each with noise of its own where it hears any."""
    devices = drawn_devices(task, drawn_factors(draws))
    if not is_noisy([task]):
        return Robustness(*_played_on(devices))
    seeds = drawn_seeds(draws)
    errors, gas = _played_on(_heard(devices, seeds))
    again, _ = _played_on(_heard(devices[:NOISE_DRAWS], other_noise(seeds)[:NOISE_DRAWS]))
    return Robustness(errors, gas, again)


def _played_on(devices: Sequence[Scenario]) -> tuple[Floats, Floats]:
    """RMS errors [N m] and gas [kg] of scenarios; inf where a run diverged."""
    results = simulate_many(devices)
    good = np.array([result.status.is_completed for result in results])
    errors, gas = (
        np.array([result.metrics[name].value for result in results]) for name in ("rms_error", "gas_supplied")
    )
    return np.where(good, errors, np.inf), np.where(good, gas, np.inf)


def _heard(devices: Sequence[Scenario], seeds: Floats) -> list[Scenario]:
    """Scenarios, each with a noise stream of its own."""
    pairs = zip(devices, seeds.tolist(), strict=True)
    return [replace(item, sensors=replace(item.sensors, seed=int(seed))) for item, seed in pairs]


def _bounds(standings: Sequence[Standing], say: Callable[[str], None]) -> tuple[Mapping[str, Bounded], str]:
    """The bound of every valve that is played, or why there is none."""
    bounds, reasons = {}, []
    for valve in dict.fromkeys(standing.entrant.valve for standing in standings):
        own = [standing for standing in standings if standing.entrant.valve == valve]
        task = own[0].result.scenario
        reached = [value for standing in own if (value := standing.value("rms_error")) is not None]
        try:
            bound = lower_bound(task, reached, say)
        except SimulationError as error:
            reasons.append(f"{valve}: {error}")
            continue
        optima = (bound.least_error, *bound.curve) if valve == "proportional" else ()
        bounds[valve] = Bounded(bound, tuple(played(task, optimum) for optimum in optima))
    return bounds, "; ".join(reasons)
