"""Result of a tuning: gains and metrics before and after, and the result of each start of the search."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from ppafo.analyses.tune.problem import Gains, ObjectiveTerm, Problem
from ppafo.metrics import Metric
from ppafo.report.kind import ConfidenceInterval
from ppafo.simulation.simulate import Result
from ppafo.studies.limits import MetricLimit

INFEASIBLE = 1.0e6
"""Lowest cost of a candidate that violates a constraint."""
FRESH_DRAWS = 1024
"""Number of draws outside the search, over which the tuned gains are evaluated."""
_AS_GOOD = 0.01
"""Relative excess over the best cost within which another start counts as equally good."""


@dataclass(frozen=True, slots=True)
class SearchStart:
    """Result of one start of the search.

    ``fractions`` (gains,): best candidate, as fractions of the ranges
    ``cost``: cost of the best candidate
    ``candidates``: number of candidates tried
    ``generations``: best cost of each generation
    ``is_settled``: True if the candidates converged, False if the generations ran out
    """

    fractions: tuple[float, ...]
    cost: float
    candidates: int
    generations: tuple[float, ...]
    is_settled: bool


def agreement(starts: Sequence[SearchStart]) -> float:
    """Return the largest difference of a gain between the best and equally good starts, as a fraction of its range.

    A start is equally good if its cost is within a hundredth of the best cost. A large difference means that very
    different gains reach the same cost, so the objective does not determine them. ``starts`` are sorted with the best
    first.
    """
    best = starts[0]
    # Of an infeasible cost only what the violation adds is compared: a hundredth of the offset would take in all.
    scale = best.cost - INFEASIBLE if best.cost >= INFEASIBLE else best.cost
    as_good = [start for start in starts if start.cost <= best.cost + _AS_GOOD * abs(scale)]
    return max(float(np.max(np.abs(np.subtract(start.fractions, best.fractions)))) for start in as_good)


@dataclass(frozen=True, slots=True)
class UnreachableDraws:
    """Draws in which the reference requires more torque than the supply allows, for any gains.

    ``fraction``: fraction of all draws
    ``explains``: metrics of violated constraints that no gains can satisfy, or that the other draws satisfy
    """

    fraction: float
    explains: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class GainResult:
    """Gains [SI] with their metrics and the violation of constraints.

    ``values``: metrics of the search [SI]: of the nominal device, or at their unfavourable end over the draws
    ``fresh``: metrics over draws that the search did not use [SI]; empty without draws
    ``judged``: metrics compared with the constraints over fresh draws; for a loop that swings in the second half
        of the hold, the error at a single instant does not count
    ``objective``, ``violation``, ``share_without_value``: objective, violation, and fraction of runs without a value,
        in the search
    ``fresh_violation``, ``fresh_share_without_value``: violation and fraction over fresh draws, or in the search
        without draws
    ``off``: fraction by which the runs exceed the tracking limits; 0 if they follow their reference
    ``share_off``: fraction of all draws, of the search and fresh, in which the run does not follow its reference
    ``torque_ceiling``: draws in which the reference is out of reach
    ``share_of_noise``: fraction of the variance over fresh draws that is due to sensor noise, by metric
    ``metrics``, ``result``: metrics and result of one run of the nominal device
    """

    gains: Gains
    values: Mapping[str, float]
    fresh: Mapping[str, float]
    judged: Mapping[str, float]
    objective: float
    violation: float
    off: float
    share_off: float
    share_without_value: float
    fresh_violation: float
    fresh_share_without_value: float
    torque_ceiling: UnreachableDraws
    share_of_noise: Mapping[str, ConfidenceInterval]
    metrics: Mapping[str, Metric]
    result: Result = field(compare=False, repr=False)

    @property
    def is_feasible_in_search(self) -> bool:
        """True if all constraints are satisfied and no run failed in the search."""
        return self.violation == 0.0 and self.share_without_value == 0.0

    @property
    def useless(self) -> str:
        """Verdict on a nominal run that should follow its reference and does not; empty for others."""
        tracking = self.result.tracking
        return tracking.sentence if tracking.is_useless else ""

    @property
    def is_feasible(self) -> bool:
        """True if all constraints are satisfied, no run failed and the reference is followed, also over fresh draws."""
        in_fresh = self.fresh_violation == 0.0 and self.fresh_share_without_value == 0.0
        return self.is_feasible_in_search and in_fresh and self.off == 0.0


@dataclass(frozen=True, slots=True)
class Tuned:
    """Result of a tuning: gains before and after, starts of the search, and remarks; numbers in SI units.

    ``overrides``: overrides that turn the scenario of the tuning file into the tuned one
    ``bounds_reached``: gains that ended at a bound, with the bound; a better value may lie beyond
    ``scales``: scales of the goals
    ``starts``: starts of the search, the best first
    ``runs``: number of all simulated runs
    """

    tuning: str
    scenario: str
    verdict: str
    is_feasible: bool
    overrides: list[str]
    bounds_reached: dict[str, Literal["minimum", "maximum"]]
    scales: dict[str, float]
    goals: list[ObjectiveTerm]
    constraints: list[MetricLimit]
    robust: dict[str, str | None] | None
    effort: dict[str, Any]
    before: GainResult
    after: GainResult
    starts: list[SearchStart]
    runs: int
    remarks: list[str]
    problem: Problem = field(compare=False, repr=False)

    @property
    def lines(self) -> list[str]:
        """Gains found, as overrides ``PATH=VALUE`` to paste."""
        return self.problem.lines(self.after.gains)
