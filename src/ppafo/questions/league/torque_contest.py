"""The league's torque task: a scenario with a reference to follow, as every entrant plays it."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from ppafo.errors import ScenarioError, SimulationError
from ppafo.progress import Report
from ppafo.questions.league.draws import NOISE_DRAWS, draw_devices, draw_factors, draw_seeds, with_noise
from ppafo.questions.league.entrants import ENTRANTS, Entrant
from ppafo.questions.league.learning import learn, table_of
from ppafo.questions.league.lower_bound import LowerBound, lower_bound, play_optimum
from ppafo.questions.league.standing import Bounded, Measures, Robustness, Standing
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.overriding import split_override
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import simulate, simulate_many
from ppafo.studies.noise import is_noisy, other_noise

TASK = "torque-task-proportional"
SPECIAL = ("controller.", "device.valve")
_OF_DRAWS = ("rms_error", "gas_supplied")


@dataclass(frozen=True, slots=True)
class TorqueContest:
    """A torque to follow: a scenario by name or path with overrides, none of controller or valve, and its device."""

    name: str
    overrides: tuple[str, ...]
    device: str
    error: ClassVar[str] = "rms_error"
    gas: ClassVar[str] = "gas_supplied"

    @property
    def entrants(self) -> tuple[Entrant, ...]:
        """Who plays by default."""
        return ENTRANTS

    def scenario_of(self, entrant: Entrant) -> Scenario:
        """Return the scenario as an entrant plays it; ScenarioError or ParameterError where it cannot."""
        return load_scenario(self.name, [*entrant.overrides, *self.overrides])

    def evaluate(self, entrant: Entrant, draws: int, seed: int, _progress: Report) -> Standing:
        """Return how an entrant does, over draws too unless 0; a PpafoError states why it cannot play."""
        task = self.scenario_of(entrant)
        learning = learn(task) if entrant.learns else None
        final = task if learning is None else learning.scenario
        learnt = [] if learning is None else [f"controller.{name}={value!r}" for name, value in table_of(final).items()]
        words = [word for override in (*entrant.overrides, *learnt, *self.overrides) for word in ("--set", override)]
        result = simulate(final)
        if not result.status.is_completed:
            raise SimulationError(result.status.message)
        return Standing(
            entrant=entrant,
            settings=dict(final.control.settings),
            period=final.control.period,
            measures={name: metric.value for name, metric in result.metrics.items()},
            robustness=_robustness(final, draws, seed) if draws else None,
            command=shlex.join(["ppafo", "simulate", self.name, *words]),
            status=result.status.kind,
            learning=learning,
        )

    def bound(self, valve: str, standings: Sequence[Standing], progress: Report) -> Bounded[LowerBound]:
        """Return the bound of a valve, simulated where a valve can follow it; SimulationError where there is none."""
        task = self.scenario_of(standings[0].entrant)
        reached = {item.entrant.name: item.measures[self.error] for item in standings if self.error in item.measures}
        bound = lower_bound(task, list(reached.values()), progress)
        optima = (bound.least_error, *bound.curve) if valve == "proportional" else ()
        least = {name: bound.gas_at(error) for name, error in reached.items()}
        return Bounded(bound, tuple(play_optimum(task, optimum) for optimum in optima), least)


def torque_contest(scenario: str | Path = TASK, overrides: Sequence[str] = ()) -> TorqueContest:
    """Return the contest of a scenario by name or file; ScenarioError or ParameterError for one that is none."""
    for override in overrides:
        path, _ = split_override(override)
        if path.startswith(SPECIAL):
            raise ScenarioError(f"override '{override}': every controller of the league has its own settings and valve")
    task = load_scenario(scenario, overrides)
    if "reference" not in task.origin.content:
        raise ScenarioError(f"{scenario}: has no [reference], so the controllers have nothing to follow")
    return TorqueContest(str(scenario), tuple(overrides), task.device.name)


def _robustness(task: Scenario, draws: int, seed: int) -> Robustness:
    """Return what the entrant makes of the drawn devices, each with its own noise where it receives any."""
    devices = draw_devices(task, draw_factors(draws, seed))
    if not is_noisy([task]):
        return Robustness(_play_on(devices))
    seeds = draw_seeds(draws, seed)
    again = with_noise(devices[:NOISE_DRAWS], other_noise(seeds)[:NOISE_DRAWS])
    return Robustness(_play_on(with_noise(devices, seeds)), _play_on(again))


def _play_on(devices: Sequence[Scenario]) -> tuple[Measures | None, ...]:
    """Return RMS error [N m] and gas [kg] of scenarios; None where a run diverged."""
    return tuple(
        {name: result.metrics[name].value for name in _OF_DRAWS} if result.status.is_completed else None
        for result in simulate_many(devices)
    )
