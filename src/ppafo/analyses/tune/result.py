"""Result of a tuning: gains and metrics before and after, and the end of each start of the search."""

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
"""Draws that the search never saw, over which the result is judged in the end."""
_AS_GOOD = 0.01
"""Fraction of the best cost within which another start ended as well."""


@dataclass(frozen=True, slots=True)
class SearchStart:
    """End of one start: fractions of the bounds (gains,), cost, candidates tried, best cost of each generation.

    ``is_settled`` says whether its candidates had come together, or whether it ran out of generations.
    """

    fractions: tuple[float, ...]
    cost: float
    candidates: int
    generations: tuple[float, ...]
    is_settled: bool


def agreement(starts: Sequence[SearchStart]) -> float:
    """Return the largest difference of a fraction of the way between the best start and those as good as it.

    As good is a cost within a hundredth; large where very different gains do as well, which the goal then leaves open.
    ``starts`` are best first.
    """
    best = starts[0]
    # Of an infeasible cost only what the violation adds is compared: a hundredth of the offset would take in all.
    beyond = best.cost - INFEASIBLE if best.cost >= INFEASIBLE else best.cost
    as_good = [start for start in starts if start.cost <= best.cost + _AS_GOOD * abs(beyond)]
    return max(float(np.max(np.abs(np.subtract(start.fractions, best.fractions)))) for start in as_good)


@dataclass(frozen=True, slots=True)
class UnreachableDraws:
    """Draws in which the reference needs more torque than the supply can hold, whatever the gains.

    ``fraction`` is theirs of all; ``explains`` are the metrics of the constraints that they alone break: no gains can
    keep them, or the other draws do.
    """

    fraction: float
    explains: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class GainResult:
    """Gains [SI] and what they give.

    ``values`` are the metrics of the search [SI]: as the device is said to be, or at their bad end over the draws of
    the search; ``fresh`` the same over draws that the search did not use (empty without draws). ``judged`` are those
    by which constraints are judged there: of a loop that oscillates on the hold no single instant counts as its error.
    ``off`` is the share by which the runs exceed the limits of tracking, 0 where they follow their reference.
    ``objective`` belongs to the search; what is called fresh, to the fresh draws (the same again without draws).
    ``share_of_noise`` is the fraction of the variance over the fresh draws that is due to sensor noise, by metric.
    ``metrics`` belong to ``result``, one run of the nominal device.
    """

    gains: Gains
    values: Mapping[str, float]
    fresh: Mapping[str, float]
    judged: Mapping[str, float]
    objective: float
    violation: float
    off: float
    share_without_value: float
    fresh_violation: float
    fresh_share_without_value: float
    torque_ceiling: UnreachableDraws
    share_of_noise: Mapping[str, ConfidenceInterval]
    metrics: Mapping[str, Metric]
    result: Result = field(compare=False, repr=False)

    @property
    def is_feasible_in_search(self) -> bool:
        """True where all constraints are kept and no run fails over what the search saw."""
        return self.violation == 0.0 and self.share_without_value == 0.0

    @property
    def useless(self) -> str:
        """Verdict on the nominal run where it does not follow its reference, "" where it does."""
        tracking = self.result.tracking
        return tracking.sentence if tracking is not None and tracking.is_useless else ""

    @property
    def is_feasible(self) -> bool:
        """True where all constraints are kept, no run fails and the reference is followed, over fresh draws too."""
        in_fresh = self.fresh_violation == 0.0 and self.fresh_share_without_value == 0.0
        return self.is_feasible_in_search and in_fresh and self.off == 0.0


@dataclass(frozen=True, slots=True)
class Tuned:
    """Result of a search, in SI units. ``starts`` are best first; ``runs`` counts all simulated runs.

    ``overrides`` make the tuned scenario of its file; ``bounds_reached`` are the gains that ended at a bound, and at
    which: a better one may lie beyond.
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
        """The gains found, as overrides ``PATH=VALUE`` to paste."""
        return self.problem.lines(self.after.gains)
