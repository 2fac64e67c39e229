"""Intervals of a mean, a share and a quantile from independent draws."""

import math
from dataclasses import dataclass

import numpy as np

from ppafo.studies.sweep.sampling.distributions import Floats


@dataclass(frozen=True, slots=True)
class Interval:
    """An estimate and the ends of its confidence interval, all in one unit; an end may be infinite."""

    value: float
    low: float
    high: float

    @property
    def width(self) -> float:
        """Distance of the two ends."""
        return self.high - self.low


def mean_interval(values: Floats, confidence: float) -> Interval:
    """Return the mean with Student's interval: exact for normal values, else by the central limit theorem."""
    from scipy.special import stdtrit

    mean = float(np.mean(values))
    if values.size < 2:
        return Interval(mean, -math.inf, math.inf)
    error = float(np.std(values, ddof=1)) / math.sqrt(values.size)
    reach = float(stdtrit(values.size - 1, 0.5 + 0.5 * confidence)) * error
    return Interval(mean, mean - reach, mean + reach)


def share_interval(hits: int, draws: int, confidence: float) -> Interval:
    """Return a share with the exact interval of Clopper and Pearson (1934)."""
    from scipy.special import betaincinv

    tail = 0.5 - 0.5 * confidence
    low = float(betaincinv(hits, draws - hits + 1, tail)) if hits > 0 else 0.0
    high = float(betaincinv(hits + 1, draws - hits, 1.0 - tail)) if hits < draws else 1.0
    return Interval(hits / draws, low, high)


def quantile_interval(values: Floats, share: float, confidence: float) -> Interval:
    """Return a quantile with the interval of two order statistics, which holds for any distribution.

    The number of draws below the quantile is binomial (David and Nagaraja, Order Statistics, section 7.1). An end is
    infinite where there are too few draws for it.
    """
    from scipy.stats import binom

    ordered, tail = np.sort(values), 0.5 - 0.5 * confidence
    lower = int(binom.ppf(tail, values.size, share))
    upper = int(binom.ppf(1.0 - tail, values.size, share)) + 1
    return Interval(
        float(np.quantile(ordered, share)),
        float(ordered[lower - 1]) if lower >= 1 else -math.inf,
        float(ordered[upper - 1]) if upper <= values.size else math.inf,
    )
