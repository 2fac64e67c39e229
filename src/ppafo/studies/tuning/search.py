"""The search: differential evolution, every generation one ensemble, from several independent starts."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ppafo.studies.sweep.sampling.distributions import Floats
from ppafo.studies.tuning.judging import FAILED, INFEASIBLE
from ppafo.studies.tuning.problem import Effort

Costs = Callable[[Floats], Floats]
"""Shares of the way (candidates, gains) in, costs (candidates,) out."""

_TOLERANCE = 1.0e-3
"""A start has ended where the costs of its candidates differ by no more than this share of their mean."""


@dataclass(frozen=True, slots=True)
class Start:
    """Where one start ended: shares of the way (gains,), cost, candidates tried, best cost of each generation.

    ``is_settled`` says whether its candidates had come together, or whether it ran out of generations.
    """

    shares: tuple[float, ...]
    cost: float
    candidates: int
    generations: tuple[float, ...]
    is_settled: bool


def search(costs: Costs, before: Sequence[float], effort: Effort) -> list[Start]:
    """Return what came of each start, the best first; the same every time for a seed.

    ``before`` are the shares of the values before tuning; they are among the first candidates where they lie within
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
        shares = np.clip(np.atleast_2d(columns.T), 0.0, 1.0)
        found = costs(shares)
        tried += len(shares)
        course.append(min([float(np.min(found)), *course[-1:]]))
        return found

    is_settled = False

    def stop(intermediate_result: Any) -> bool:
        nonlocal is_settled
        is_settled = have_come_together(intermediate_result.population_energies)
        return is_settled

    is_within = all(0.0 <= share <= 1.0 for share in before)
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
    """Return the largest difference of a share of the way between the best start and those as good as it.

    As good is a cost within a hundredth; large where very different gains do as well, which the goal then leaves open.
    """
    best = starts[0]
    beyond = best.cost - INFEASIBLE if best.cost >= INFEASIBLE else best.cost
    as_good = [item for item in starts if item.cost <= best.cost + 0.01 * abs(beyond)]
    return max(float(np.max(np.abs(np.subtract(item.shares, best.shares)))) for item in as_good)
