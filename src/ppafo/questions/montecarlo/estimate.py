"""Draws in batches that double, one look at the interval after each, and an end when it is narrow enough.

Looking repeatedly and stopping at a favourable interval makes an ordinary interval too narrow. Here the number of
looks is bounded before the first draw, and each look takes an equal part of the allowed error (Bonferroni's
inequality): with the stated confidence all intervals of the trace hold at once, the one at which it stopped too.
"""

import math
from dataclasses import dataclass

import numpy as np

from ppafo.answers import Solved
from ppafo.errors import StudyError
from ppafo.questions.montecarlo.statistic import Statistic
from ppafo.studies.distributions import Floats
from ppafo.studies.draws import MAXIMUM_DRAWS, Columns, Uncertainty, with_new_noise
from ppafo.studies.intervals import FEWEST_EFFECTIVE, Interval, noise_interval
from ppafo.studies.outcomes import Model, Outcomes, check_confidence, check_failures, check_fraction, join

FEWEST_DRAWS = 32
NOISE_DRAWS = 512
"""Draws that are run again with other noise, at most: its fraction of the variance is then known to some percent."""


@dataclass(frozen=True, slots=True)
class StoppingRule:
    """When to stop: at an interval of this width, or after ``maximum`` draws.

    ``width`` is in the SI unit of the statistic, or a fraction of its value where ``is_relative``. The first look is
    after ``first`` draws, each later one after twice as many; ``confidence`` holds for all looks together. Draws are
    refused where more than the fraction ``maximum_failed`` of them fails.
    """

    width: float
    is_relative: bool
    first: int = 256
    maximum: int = 2**20
    confidence: float = 0.95
    maximum_failed: float = 0.01

    def __post_init__(self) -> None:
        """Refuse a rule that can never be met or that asks for nothing."""
        if not (math.isfinite(self.width) and self.width > 0.0):
            raise StudyError(f"width = {self.width!r}: must be more than 0")
        if not FEWEST_DRAWS <= self.first <= self.maximum <= MAXIMUM_DRAWS:
            raise StudyError(
                f"first = {self.first!r} and maximum = {self.maximum!r} draws: must be at least {FEWEST_DRAWS}, the "
                f"first not more than the maximum, and the maximum not above {MAXIMUM_DRAWS:,}"
            )
        check_confidence(self.confidence)
        check_fraction(self.maximum_failed, "maximum_failed")

    @property
    def sizes(self) -> tuple[int, ...]:
        """The numbers of draws at which it is looked at the interval, at most."""
        found = [self.first]
        while found[-1] < self.maximum:
            found.append(min(2 * found[-1], self.maximum))
        return tuple(found)

    @property
    def confidence_of_look(self) -> float:
        """Confidence of each single look, so that all of them together keep ``confidence``."""
        return 1.0 - (1.0 - self.confidence) / len(self.sizes)

    def is_narrow(self, interval: Interval) -> bool:
        """Tell whether an interval is narrow enough."""
        return interval.width <= self.width * (abs(interval.value) if self.is_relative else 1.0)


@dataclass(frozen=True, slots=True)
class Look:
    """What was seen after some draws: how many, how many of them without a value, and the interval [SI].

    ``effective_size`` is how many of them determine the estimate: fewer than there are where a few large values decide.
    """

    draws: int
    missing: int
    interval: Interval
    effective_size: float

    @property
    def is_carried(self) -> bool:
        """Tell whether enough draws determine the estimate; an interval without width is carried by all."""
        return self.effective_size >= min(FEWEST_EFFECTIVE, 0.5 * (self.draws - self.missing))


@dataclass(frozen=True, slots=True)
class MonteCarlo(Solved):
    """The looks one after the other, whether the last one met the rule, and the values of the metric (draws,) [SI].

    ``noise`` is the fraction of the variance that is due to sensor noise; None where there is none.
    """

    metric: str
    statistic: Statistic
    rule: StoppingRule
    seed: int
    looks: tuple[Look, ...]
    outcomes: Outcomes
    noise: Interval | None

    @property
    def last(self) -> Look:
        """The look at which it stopped."""
        return self.looks[-1]

    @property
    def is_met(self) -> bool:
        """Tell whether the interval became narrow enough, and can be believed."""
        return self.rule.is_narrow(self.last.interval) and self.last.is_carried

    @property
    def values(self) -> Floats:
        """The values that there are [SI]."""
        found = self.outcomes.metrics[self.metric]
        return found[np.isfinite(found)]


def draw_until(
    model: Model, uncertainty: Uncertainty, metric: str, statistic: Statistic, rule: StoppingRule, seed: int
) -> MonteCarlo:
    """Draw from one stream until the rule is met or there are no more looks.

    An interval that few draws determine is not trusted, however narrow it is: drawing continues.
    Runs that fail have no value: up to the fraction that the rule allows they are left out and counted, above it
    StudyError.
    """
    looks: list[Look] = []
    pieces: list[Outcomes] = []
    drawn: Columns = {}
    for size in rule.sizes:
        done = looks[-1].draws if looks else 0
        columns = statistic.columns(uncertainty, done, size - done, seed)
        drawn = drawn or columns
        pieces.append(model(columns))
        looks.append(_look(join(pieces), metric, statistic, rule))
        if rule.is_narrow(looks[-1].interval) and looks[-1].is_carried:
            break
    outcomes = join(pieces)
    noise = None
    if uncertainty.has_noise:
        again = model(with_new_noise(drawn, NOISE_DRAWS)).metrics[metric]
        noise = noise_interval(outcomes.metrics[metric][: again.size], again, rule.confidence)
    return MonteCarlo(metric, statistic, rule, seed, tuple(looks), outcomes, noise)


def _look(outcomes: Outcomes, metric: str, statistic: Statistic, rule: StoppingRule) -> Look:
    check_failures(outcomes, rule.maximum_failed, "Monte Carlo")
    found = outcomes.metrics[metric]
    values = found[np.isfinite(found)]
    missing = outcomes.runs - values.size
    if missing > rule.maximum_failed * outcomes.runs:
        raise StudyError(
            f"Monte Carlo: {missing:,} of {outcomes.runs:,} runs have no '{metric}'; choose another metric"
        )
    interval = statistic.estimate(found, rule.confidence_of_look)
    return Look(outcomes.runs, missing, interval, statistic.effective_size(found))
