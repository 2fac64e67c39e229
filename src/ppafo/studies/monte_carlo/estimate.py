"""Draws in batches that double, one look at the interval after each, and an end when it is narrow enough.

To look again and again and stop when one likes what one sees makes an ordinary interval too narrow. Here the number of
looks is bounded before the first draw, and each look takes an equal part of the allowed error (Bonferroni's
inequality): with the stated confidence all intervals of the trace hold at once, the one at which it stopped too.
"""

import math
from dataclasses import dataclass

import numpy as np

from ppafo.errors import StudyError
from ppafo.studies.monte_carlo.statistic import Statistic
from ppafo.studies.sweep.sampling.distributions import Floats
from ppafo.studies.uncertainty.draws import MOST_DRAWS, Uncertainty
from ppafo.studies.uncertainty.intervals import Interval
from ppafo.studies.uncertainty.outcomes import Model, Outcomes, check_confidence, check_failures, check_share, joined

FEWEST_DRAWS = 32


@dataclass(frozen=True, slots=True)
class StoppingRule:
    """When to stop: at an interval of this width, or after ``most`` draws.

    ``width`` is in the SI unit of the statistic, or a share of its value where ``is_relative``. The first look is after
    ``first`` draws, each later one after twice as many; ``confidence`` holds for all looks together. Draws are refused
    where more than the share ``most_failed`` of them fails.
    """

    width: float
    is_relative: bool
    first: int = 256
    most: int = 2**20
    confidence: float = 0.95
    most_failed: float = 0.01

    def __post_init__(self) -> None:
        """Refuse a rule that can never be met or that asks for nothing."""
        if not (math.isfinite(self.width) and self.width > 0.0):
            raise StudyError(f"width = {self.width!r}: must be more than 0")
        if not FEWEST_DRAWS <= self.first <= self.most <= MOST_DRAWS:
            raise StudyError(
                f"first = {self.first!r} and most = {self.most!r} draws: must be at least {FEWEST_DRAWS}, the first "
                f"not more than the most, and the most not above {MOST_DRAWS:,}"
            )
        check_confidence(self.confidence)
        check_share(self.most_failed, "most_failed")

    @property
    def sizes(self) -> tuple[int, ...]:
        """The numbers of draws at which it is looked at the interval, at most."""
        found = [self.first]
        while found[-1] < self.most:
            found.append(min(2 * found[-1], self.most))
        return tuple(found)

    @property
    def confidence_of_look(self) -> float:
        """Confidence of each single look, so that all of them together keep ``confidence``."""
        return 1.0 - (1.0 - self.confidence) / len(self.sizes)

    def is_met(self, interval: Interval) -> bool:
        """Tell whether an interval is narrow enough."""
        return interval.width <= self.width * (abs(interval.value) if self.is_relative else 1.0)


@dataclass(frozen=True, slots=True)
class Look:
    """What was seen after some draws: how many, how many of them without a value, and the interval [SI]."""

    draws: int
    missing: int
    interval: Interval


@dataclass(frozen=True, slots=True)
class MonteCarlo:
    """The looks one after the other, whether the last one met the rule, and the values of the metric (draws,) [SI]."""

    metric: str
    statistic: Statistic
    rule: StoppingRule
    seed: int
    looks: tuple[Look, ...]
    outcomes: Outcomes

    @property
    def last(self) -> Look:
        """The look at which it stopped."""
        return self.looks[-1]

    @property
    def is_met(self) -> bool:
        """Tell whether the interval became narrow enough."""
        return self.rule.is_met(self.last.interval)

    @property
    def values(self) -> Floats:
        """The values that there are [SI]."""
        found = self.outcomes.metrics[self.metric]
        return found[np.isfinite(found)]


def draw_until(
    model: Model, uncertainty: Uncertainty, metric: str, statistic: Statistic, rule: StoppingRule, seed: int
) -> MonteCarlo:
    """Draw from one stream until the rule is met or there are no more looks.

    Runs that fail have no value: up to the share that the rule allows they are left out and counted, above it
    StudyError.
    """
    looks: list[Look] = []
    pieces: list[Outcomes] = []
    for size in rule.sizes:
        done = looks[-1].draws if looks else 0
        pieces.append(model(uncertainty.random_columns(done, size - done, seed)))
        looks.append(_look(joined(pieces), metric, statistic, rule))
        if rule.is_met(looks[-1].interval):
            break
    return MonteCarlo(metric, statistic, rule, seed, tuple(looks), joined(pieces))


def _look(outcomes: Outcomes, metric: str, statistic: Statistic, rule: StoppingRule) -> Look:
    check_failures(outcomes, rule.most_failed, "Monte Carlo")
    found = outcomes.metrics[metric]
    values = found[np.isfinite(found)]
    missing = outcomes.runs - values.size
    if missing > rule.most_failed * outcomes.runs:
        raise StudyError(
            f"Monte Carlo: {missing:,} of {outcomes.runs:,} runs have no '{metric}'; choose another metric"
        )
    return Look(outcomes.runs, missing, statistic.estimate(values, rule.confidence_of_look))
