"""Statistics of a metric: mean, quantile or probability, each with its draws and its confidence interval.

A mean is estimated from randomised Sobol replicates, which are much more accurate than independent draws for a smooth
function. The interval is never narrower than for independent draws, because a dominant rare value cannot be excluded
beforehand. Quantiles and probabilities are estimated from independent draws, for which their intervals are exact.
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ppafo.errors import StudyError
from ppafo.metrics import METRICS
from ppafo.report.kind import ConfidenceInterval
from ppafo.studies.distributions import Floats
from ppafo.studies.draws import REPLICATES
from ppafo.studies.intervals import effective_sample_size, floored_interval, fraction_interval, quantile_interval
from ppafo.studies.limits import level_of

FEWEST_SEEN = 10_000
"""Smallest number of draws for a trusted mean: an event of one run in 3,300 would have occurred (95 %)."""
FURTHEST_UNSEEN = 100.0
"""Largest assumed distance from the mean of values not drawn, divided by the standard deviation [-]."""
GRAMMAR = "'mean', 'quantile 0.95', 'probability above VALUE' or 'probability below VALUE'"
_QUANTILE = re.compile(r"quantile\s+([0-9]*\.?[0-9]+)")
_PROBABILITY = re.compile(r"probability\s+(above|below)\s+(\S.*)")


@dataclass(frozen=True, slots=True)
class Statistic:
    """Statistic of a distribution, with its estimator.

    ``label``: text that ``parse_statistic`` reads
    ``unit``: SI unit of the interval ('-': dimensionless)
    ``estimate``: function of the values (draws,) of the metric [SI], nan for missing, and a confidence
    ``is_of_replicates``: True for means, from Sobol replicates with an interval by the central limit theorem; False for
        exact intervals from independent draws
    ``threshold``: threshold of a probability [SI]; None for other statistics
    """

    label: str
    unit: str
    estimate: Callable[[Floats, float], ConfidenceInterval] = field(compare=False)
    is_of_replicates: bool = False
    threshold: float | None = None

    def unseen(self, values: Floats, confidence: float) -> float:
        """Return an upper bound of the change of a mean [SI] by values that were not drawn; 0 for other statistics.

        No interval of a mean holds without a bound on its values (Bahadur and Savage, 1956). An event that none of n
        draws shows has a probability up to 1 - (1 - confidence)^(1/n) (Clopper and Pearson), and its values are assumed
        to lie within ``FURTHEST_UNSEEN`` standard deviations of the mean.
        """
        known = values[np.isfinite(values)]
        if not self.is_of_replicates or not known.size:
            return 0.0
        share = -math.expm1(math.log1p(-confidence) / known.size)
        return share * FURTHEST_UNSEEN * float(np.std(known))

    def effective_size(self, values: Floats) -> float:
        """Return the effective sample size of the estimate; the number of values if the interval is exact.

        For a mean of few values that are all equal the result is 0, since a later value may lie anywhere.
        """
        known = values[np.isfinite(values)]
        if self.is_of_replicates and 0 < known.size < FEWEST_SEEN and float(np.ptp(known)) == 0.0:
            return 0.0
        return effective_sample_size(known) if self.is_of_replicates else float(known.size)


def probability_of(threshold: float, is_above: bool, text: str) -> Statistic:
    """Return the statistic for the probability of a metric above (or else below) a value [SI], given as ``text``."""

    def interval(values: Floats, level: float) -> ConfidenceInterval:
        # Strictly beyond: a metric that counts may be exactly at the threshold in many runs.
        known = values[np.isfinite(values)]
        hits = known > threshold if is_above else known < threshold
        return fraction_interval(int(np.count_nonzero(hits)), known.size, level)

    words = f"probability {'above' if is_above else 'below'} {text}"
    return Statistic(words, "-", interval, threshold=threshold)


def parse_statistic(text: str, metric: str, atmosphere: float | None) -> Statistic:
    """Return the statistic of a metric from its text; StudyError for an unknown statistic.

    A gauge pressure refers to ``atmosphere`` [Pa absolute], as in ``studies.limits.level_of``.
    """
    words, unit = text.strip(), METRICS[metric].unit
    if words == "mean":
        return Statistic("mean", unit, lambda values, level: floored_interval(values, REPLICATES, level), True)
    quantile = _QUANTILE.fullmatch(words)
    if quantile is not None and 0.0 < (fraction := float(quantile[1])) < 1.0:
        return Statistic(
            f"quantile {fraction:g}",
            unit,
            lambda values, level: quantile_interval(values[np.isfinite(values)], fraction, level),
        )
    if (probability := _PROBABILITY.fullmatch(words)) is not None:
        threshold = level_of(probability[2], metric, f"statistic '{text}'", atmosphere)
        return probability_of(threshold, probability[1] == "above", probability[2])
    raise StudyError(f"statistic '{text}': must be {GRAMMAR}, with a fraction above 0 and below 1")
