"""Statistics of a metric: mean, quantile or probability, each with its draws and its confidence interval.

A mean is estimated from randomised Sobol replicates, which know the mean of a smooth function far better than as many
independent draws; its interval is never narrower than theirs, as nobody knows beforehand that no rare value decides.
The intervals of quantiles and probabilities are exact for independent draws, and get those.
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ppafo.errors import StudyError
from ppafo.metrics import METRICS
from ppafo.report.kind import ConfidenceInterval
from ppafo.studies.distributions import (
    Floats,
    effective_sample_size,
    floored_interval,
    fraction_interval,
    quantile_interval,
)
from ppafo.studies.draws import REPLICATES, Columns, Uncertainty
from ppafo.studies.limits import level_of

FEWEST_SEEN = 10_000
"""Draws from which a mean is believed: one in 3,300 that differs would have come (95 %)."""
FURTHEST_UNSEEN = 100.0
"""Distance from the mean, over the standard deviation [-], up to which values that were not drawn are allowed for."""
GRAMMAR = "'mean', 'quantile 0.95', 'probability above VALUE' or 'probability below VALUE'"
_QUANTILE = re.compile(r"quantile\s+([0-9]*\.?[0-9]+)")
_PROBABILITY = re.compile(r"probability\s+(above|below)\s+(\S.*)")


@dataclass(frozen=True, slots=True)
class Statistic:
    """A number about a distribution: in words that ``parse_statistic`` reads, the SI unit of its interval ('-': plain).

    ``estimate`` takes the values (draws,) of the metric [SI], nan where there is none, and a confidence. Means come
    from replicates, whose interval rests on the central limit theorem; intervals of all else are exact. ``threshold``
    [SI] is what a probability is about.
    """

    label: str
    unit: str
    estimate: Callable[[Floats, float], ConfidenceInterval] = field(compare=False)
    is_of_replicates: bool = False
    threshold: float | None = None

    def columns(self, uncertainty: Uncertainty, first: int, count: int, seed: int) -> Columns:
        """Return the draws from number ``first`` on that its interval is made for: Sobol replicates, or independent."""
        draw = uncertainty.replicated_columns if self.is_of_replicates else uncertainty.random_columns
        return draw(first, count, seed)

    def unseen(self, values: Floats, confidence: float) -> float:
        """Change of a mean [SI] by values that no draw had, at most; 0 of other statistics, whose intervals are exact.

        No interval of a mean holds without a bound on its values (Bahadur and Savage, 1956). Of n draws without it an
        event has a probability up to 1 - (1 - confidence)^(1/n) (Clopper and Pearson), and its values are assumed to
        lie within ``FURTHEST_UNSEEN`` standard deviations of the mean.
        """
        known = values[np.isfinite(values)]
        if not self.is_of_replicates or not known.size:
            return 0.0
        share = -math.expm1(math.log1p(-confidence) / known.size)
        return share * FURTHEST_UNSEEN * float(np.std(known))

    def effective_size(self, values: Floats) -> float:
        """Return how many of the values determine the estimate; all where its interval is exact.

        None of them, for a mean, while all are equal and few: one that comes later may lie anywhere.
        """
        known = values[np.isfinite(values)]
        if self.is_of_replicates and 0 < known.size < FEWEST_SEEN and float(np.ptp(known)) == 0.0:
            return 0.0
        return effective_sample_size(known) if self.is_of_replicates else float(known.size)


def mean_of(unit: str) -> Statistic:
    """Return the statistic of a sweep that is the mean of a metric, in the unit of the metric."""
    return Statistic("mean", unit, lambda values, level: floored_interval(values, REPLICATES, level), True)


def quantile_of(unit: str, fraction: float) -> Statistic:
    """Return the value of a metric below which a fraction of the runs lies."""

    def interval(values: Floats, level: float) -> ConfidenceInterval:
        return quantile_interval(values[np.isfinite(values)], fraction, level)

    return Statistic(f"quantile {fraction:g}", unit, interval)


def probability_of(threshold: float, is_above: bool, text: str) -> Statistic:
    """Return the probability that a metric is above (or else below) a value [SI], written as ``text``."""

    def interval(values: Floats, level: float) -> ConfidenceInterval:
        # Strictly beyond: a metric that counts may be exactly at the threshold in many runs.
        known = values[np.isfinite(values)]
        hits = known > threshold if is_above else known < threshold
        return fraction_interval(int(np.count_nonzero(hits)), known.size, level)

    words = f"probability {'above' if is_above else 'below'} {text}"
    return Statistic(words, "-", interval, threshold=threshold)


def parse_statistic(text: str, metric: str, atmosphere: float | None) -> Statistic:
    """Return the statistic of a metric that a text names; StudyError where it names none.

    A gauge pressure counts from ``atmosphere`` [Pa absolute], as in ``studies.draws.level_of``.
    """
    words, unit = text.strip(), METRICS[metric].unit
    if words == "mean":
        return mean_of(unit)
    quantile = _QUANTILE.fullmatch(words)
    if quantile is not None and 0.0 < float(quantile[1]) < 1.0:
        return quantile_of(unit, float(quantile[1]))
    probability = _PROBABILITY.fullmatch(words)
    if probability is not None:
        threshold = level_of(probability[2], metric, f"statistic '{text}'", atmosphere)
        return probability_of(threshold, probability[1] == "above", probability[2])
    raise StudyError(f"statistic '{text}' is not known; give {GRAMMAR}, with a fraction above 0 and below 1")
