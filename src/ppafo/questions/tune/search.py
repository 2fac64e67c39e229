"""How candidates are judged, and the search: differential evolution, every generation one ensemble, several starts.

A candidate that satisfies all constraints is always better than one that does not; among those that do not, less
violation is better; a candidate with a run that fails is worse than all (Deb's rules, 2000).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.parameters.device import VANE
from ppafo.questions.tune.problem import Constraint, Effort, Goal, Problem, Spread
from ppafo.simulation.plan import profile_bounds
from ppafo.simulation.scenario import Scenario
from ppafo.studies.distributions import Floats

INFEASIBLE = 1.0e6
"""Where the costs of candidates begin that break a constraint."""
FAILED = 1.0e12
"""Where the costs of candidates begin of which a run fails; the fraction of such runs is added."""


@dataclass(frozen=True, slots=True)
class Runs:
    """Metrics by name and failures of candidates, each (candidates, draws); one draw without uncertainty."""

    metrics: Mapping[str, Floats]
    failed: NDArray[np.bool_]

    @property
    def without_value(self) -> Floats:
        """Fraction of the runs of each candidate that failed or lack a metric (candidates,)."""
        lacking = self.failed | np.any([~np.isfinite(values) for values in self.metrics.values()], axis=0)
        return np.asarray(np.mean(lacking, axis=1))


@dataclass(frozen=True, slots=True)
class Judgement:
    """Objective, violation and what both are made of, each (candidates,): metric at its bad end by name [SI]."""

    objective: Floats
    violation: Floats
    without_value: Floats

    @property
    def cost(self) -> Floats:
        """One number by which candidates are compared."""
        usual = np.where(self.violation > 0.0, INFEASIBLE + self.violation, self.objective)
        return np.where(self.without_value > 0.0, FAILED * (1.0 + self.without_value), usual)

    @property
    def is_feasible(self) -> NDArray[np.bool_]:
        """Which candidates satisfy all constraints and never fail."""
        return np.asarray((self.violation == 0.0) & (self.without_value == 0.0))


def keeps(item: Constraint, value: float) -> bool:
    """Tell whether a value [SI] keeps a constraint."""
    return value <= item.limit if item.is_most else value >= item.limit


def shortfall(scenario: Scenario) -> Floats:
    """Return what the supply lacks of the largest reference [N m] in each run (runs,); 0 for nothing.

    With one chamber at its supply and the other at the atmosphere the vane holds at most the torque constant times the
    difference of the two (equation (2)), whatever the controller does. Of another actuator no such limit is known here.
    """
    if scenario.device.actuator.kind != VANE:
        return np.zeros(1)
    supply, constant = scenario.device.supply, scenario.device.actuator.torque_constant
    lowest, highest = profile_bounds(scenario.reference)
    above = highest - constant * (supply.pressure - supply.atmospheric_pressure)
    below = -lowest - constant * (supply.dorsiflexion_pressure - supply.atmospheric_pressure)
    return np.atleast_1d(np.maximum(0.0, np.maximum(above, below)))


def bad_ends(values: Floats, spread: Spread | None, is_high: bool) -> Floats:
    """Return the value of a metric by which candidates are judged (candidates,) from (candidates, draws) [SI]."""
    return values[:, 0] if spread is None else spread.bad_end(values, is_high)


def judge(runs: Runs, problem: Problem, scales: Mapping[str, float]) -> Judgement:
    """Return objective and violation of candidates; ``scales`` are the sizes of the goals by metric [SI]."""
    failing = runs.without_value
    known = {name: np.where(failing[:, None] > 0.0, 0.0, values) for name, values in runs.metrics.items()}
    objective = sum((_term(goal, known, problem.spread, scales) for goal in problem.goals), np.zeros(failing.size))
    violation = sum((_excess(item, known, problem.spread) for item in problem.constraints), np.zeros(failing.size))
    return Judgement(np.asarray(objective), np.asarray(violation), failing)


def _term(goal: Goal, values: Mapping[str, Floats], spread: Spread | None, scales: Mapping[str, float]) -> Floats:
    return goal.weight * bad_ends(values[goal.metric], spread, goal.weight > 0.0) / scales[goal.metric]


def _excess(item: Constraint, values: Mapping[str, Floats], spread: Spread | None) -> Floats:
    """Return by how much a constraint is broken, as a fraction of its limit (candidates,); 0 where it is kept."""
    reached = bad_ends(values[item.metric], spread, item.is_most)
    beyond = reached - item.limit if item.is_most else item.limit - reached
    return np.maximum(0.0, beyond) / (abs(item.limit) or 1.0)


Costs = Callable[[Floats], Floats]
"""Fractions of the way (candidates, gains) in, costs (candidates,) out."""

_TOLERANCE = 1.0e-3
"""A start has ended where the costs of its candidates differ by no more than this fraction of their mean."""


@dataclass(frozen=True, slots=True)
class Start:
    """Where one start ended: fractions of the way (gains,), cost, candidates tried, best cost of each generation.

    ``is_settled`` says whether its candidates had come together, or whether it ran out of generations.
    """

    fractions: tuple[float, ...]
    cost: float
    candidates: int
    generations: tuple[float, ...]
    is_settled: bool


def search(costs: Costs, before: Sequence[float], effort: Effort) -> list[Start]:
    """Return what came of each start, the best first; the same every time for a seed.

    ``before`` are the fractions of the values before tuning; they are among the first candidates where they lie within
    the bounds. Differential evolution (Storn and Price, 1997) as in SciPy only ever compares costs.
    """
    seeds = np.random.SeedSequence(effort.seed).spawn(effort.starts)
    found = [_start(costs, before, effort, np.random.default_rng(seed)) for seed in seeds]
    return sorted(found, key=lambda start: start.cost)


def _start(costs: Costs, before: Sequence[float], effort: Effort, random: np.random.Generator) -> Start:
    from scipy.optimize import differential_evolution

    course: list[float] = []
    tried = 0

    def generation(columns: Floats) -> Floats:
        nonlocal tried
        fractions = np.clip(np.atleast_2d(columns.T), 0.0, 1.0)
        found = costs(fractions)
        tried += len(fractions)
        course.append(min([float(np.min(found)), *course[-1:]]))
        return found

    is_settled = False

    def stop(intermediate_result: Any) -> bool:
        nonlocal is_settled
        is_settled = have_come_together(intermediate_result.population_energies)
        return is_settled

    is_within = all(0.0 <= fraction <= 1.0 for fraction in before)
    result = differential_evolution(
        generation,
        [(0.0, 1.0)] * len(before),
        x0=np.asarray(before) if is_within else None,
        init="latinhypercube",
        popsize=effort.candidates_per_gain,
        maxiter=effort.generations,
        tol=0.0,
        callback=stop,
        polish=False,
        updating="deferred",
        vectorized=True,
        rng=random,
    )
    return Start(tuple(map(float, result.x)), float(result.fun), tried, tuple(course), is_settled)


def have_come_together(costs: Floats) -> bool:
    """Tell whether candidates cost the same; where all break a constraint, by how much they break it."""
    if np.max(costs) >= FAILED or np.min(costs) < INFEASIBLE <= np.max(costs):
        return False
    beyond = costs - INFEASIBLE if np.min(costs) >= INFEASIBLE else costs
    return float(np.std(beyond)) <= _TOLERANCE * abs(float(np.mean(beyond)))


def agreement(starts: Sequence[Start]) -> float:
    """Return the largest difference of a fraction of the way between the best start and those as good as it.

    As good is a cost within a hundredth; large where very different gains do as well, which the goal then leaves open.
    """
    best = starts[0]
    beyond = best.cost - INFEASIBLE if best.cost >= INFEASIBLE else best.cost
    as_good = [item for item in starts if item.cost <= best.cost + 0.01 * abs(beyond)]
    return max(float(np.max(np.abs(np.subtract(item.fractions, best.fractions)))) for item in as_good)
