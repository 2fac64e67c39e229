"""What is estimated of a metric: its mean, a quantile, or the probability that it is above or below a value.

A mean is estimated from randomised Sobol replicates, which know that of a smooth function far better than as many
independent draws. The intervals of quantiles and probabilities are exact for independent draws, and get those.
"""

import re
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ppafo.errors import StudyError
from ppafo.metrics import METRICS
from ppafo.studies.distributions import Floats
from ppafo.studies.draws import REPLICATES, Columns, Uncertainty
from ppafo.studies.intervals import (
    Interval,
    effective_sample_size,
    fraction_interval,
    quantile_interval,
    replicates_interval,
)
from ppafo.studies.outcomes import level_of

GRAMMAR = "'mean', 'quantile 0.95', 'probability above VALUE' or 'probability below VALUE'"

_QUANTILE = re.compile(r"quantile\s+(\d*\.?\d+)")
_PROBABILITY = re.compile(r"probability\s+(above|below)\s+(\S.*)")


class Statistic(Protocol):
    """A number about a distribution; ``unit`` is the SI unit of its interval."""

    @property
    def label(self) -> str:
        """The statistic in words that ``parse_statistic`` reads."""
        ...

    @property
    def unit(self) -> str:
        """SI unit of the statistic, '-' for a plain number."""
        ...

    def columns(self, uncertainty: Uncertainty, first: int, count: int, seed: int) -> Columns:
        """Return the draws from number ``first`` on that its interval is made for."""
        ...

    def estimate(self, values: Floats, confidence: float) -> Interval:
        """Return estimate and interval from the values (draws,) of the metric [SI] at these draws; nan has no value."""
        ...

    def effective_size(self, values: Floats) -> float:
        """Return how many of the values determine the estimate; all where its interval is exact."""
        ...


@dataclass(frozen=True, slots=True)
class Mean:
    """The mean of a metric; its interval comes from independent replicates and rests on the central limit theorem."""

    unit: str
    label: str = "mean"

    def columns(self, uncertainty: Uncertainty, first: int, count: int, seed: int) -> Columns:
        """Return draws of randomised Sobol replicates."""
        return uncertainty.replicated_columns(first, count, seed)

    def estimate(self, values: Floats, confidence: float) -> Interval:
        """Return estimate and interval [SI]."""
        return replicates_interval(values, REPLICATES, confidence)

    def effective_size(self, values: Floats) -> float:
        """Return how many of the values determine the mean."""
        return effective_sample_size(values[np.isfinite(values)])


@dataclass(frozen=True, slots=True)
class Quantile:
    """The value of a metric below which a fraction of the runs lies."""

    unit: str
    fraction: float

    @property
    def label(self) -> str:
        """The statistic in words."""
        return f"quantile {self.fraction:g}"

    def columns(self, uncertainty: Uncertainty, first: int, count: int, seed: int) -> Columns:
        """Return independent draws."""
        return uncertainty.random_columns(first, count, seed)

    def estimate(self, values: Floats, confidence: float) -> Interval:
        """Return estimate and interval [SI]."""
        return quantile_interval(values[np.isfinite(values)], self.fraction, confidence)

    def effective_size(self, values: Floats) -> float:
        """Return the number of values: the interval is exact."""
        return float(np.count_nonzero(np.isfinite(values)))


@dataclass(frozen=True, slots=True)
class Probability:
    """The probability that a metric is above (or else below) a value [SI]; ``text`` is the value as it was written."""

    threshold: float
    is_above: bool
    text: str
    unit: str = "-"

    @property
    def label(self) -> str:
        """The statistic in words."""
        return f"probability {'above' if self.is_above else 'below'} {self.text}"

    def columns(self, uncertainty: Uncertainty, first: int, count: int, seed: int) -> Columns:
        """Return independent draws."""
        return uncertainty.random_columns(first, count, seed)

    def estimate(self, values: Floats, confidence: float) -> Interval:
        """Return estimate and interval, from 0 to 1."""
        known = values[np.isfinite(values)]
        hits = known > self.threshold if self.is_above else known < self.threshold
        return fraction_interval(int(np.count_nonzero(hits)), known.size, confidence)

    def effective_size(self, values: Floats) -> float:
        """Return the number of values: the interval is exact."""
        return float(np.count_nonzero(np.isfinite(values)))


def parse_statistic(text: str, metric: str, atmosphere: float | None) -> Statistic:
    """Return the statistic of a metric that a text names; StudyError where it names none.

    A gauge pressure counts from ``atmosphere`` [Pa absolute], as in ``studies.outcomes.level_of``.
    """
    words, unit = text.strip(), METRICS[metric].unit
    if words == "mean":
        return Mean(unit)
    quantile = _QUANTILE.fullmatch(words)
    if quantile is not None and 0.0 < float(quantile[1]) < 1.0:
        return Quantile(unit, float(quantile[1]))
    probability = _PROBABILITY.fullmatch(words)
    if probability is not None:
        threshold = level_of(probability[2], metric, f"statistic '{text}'", atmosphere)
        return Probability(threshold, probability[1] == "above", probability[2])
    raise StudyError(f"statistic '{text}' is not known; give {GRAMMAR}, with a fraction above 0 and below 1")
