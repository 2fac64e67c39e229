"""Distributions as quantile functions, from probabilities in (0, 1) to values in SI units."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Distribution:
    """Distribution of a kind of ``[[vary]]``: the numbers of its quantile function [SI], less a constant ``zero``.

    A ``zero`` is, for example, the atmospheric pressure of an absolute pressure that is wanted as a gauge pressure.
    """

    kind: str
    numbers: tuple[Any, ...]
    zero: float = 0.0

    def values(self, uniform: Floats) -> Floats:
        """Return the quantile [SI] at each probability, an array of any shape."""
        return np.asarray(_QUANTILES[self.kind](uniform, *self.numbers) - self.zero)

    def fraction(self, value: float) -> float:
        """Return the probability of a value [SI] of a (log-)uniform one; below 0 or above 1 beyond its bounds."""
        low, high = self.numbers
        level = value + self.zero
        if self.kind == "log_uniform":
            return math.log(level / low) / math.log(high / low) if level > 0.0 else -math.inf
        return float((level - low) / (high - low))


def _normal(uniform: Floats, mean: float, deviation: float) -> Any:
    from scipy.special import ndtri

    return mean + deviation * ndtri(uniform)


def _log_normal(uniform: Floats, median: float, factor: float) -> Any:
    """Return quantiles around a median with a geometric standard deviation."""
    return median * np.exp(_normal(uniform, 0.0, math.log(factor)))


def _truncated_normal(uniform: Floats, mean: float, deviation: float, minimum: float, maximum: float) -> Any:
    """Return quantiles between two bounds, computed in the tail with the smaller rounding error."""
    from scipy.special import ndtr, ndtri

    # Above the mean, 1 - ndtr would cancel: the upper tail is the lower tail of the mirrored distribution.
    low = (minimum - mean) / deviation
    high = (maximum - mean) / deviation
    side = -1.0 if low > 0.0 else 1.0
    score = side * ndtri(ndtr(side * low) + (ndtr(side * high) - ndtr(side * low)) * uniform)
    return np.clip(mean + deviation * score, minimum, maximum)


def _triangular(uniform: Floats, minimum: float, mode: float, maximum: float) -> Any:
    width = maximum - minimum
    left = (mode - minimum) / width
    rising = minimum + np.sqrt(uniform * width * (mode - minimum))
    falling = maximum - np.sqrt((1.0 - uniform) * width * (maximum - mode))
    return np.where(uniform < left, rising, falling)


def _choice(uniform: Floats, choices: tuple[float, ...], cumulated: tuple[float, ...]) -> Any:
    """Return one of the choices; ``cumulated`` are the cumulative weights, ending at 1."""
    # Without the last weight: rounding may leave the sum just below 1, and a draw above it would have no value.
    return np.asarray(choices)[np.searchsorted(np.asarray(cumulated[:-1]), uniform, side="right")]


_QUANTILES: Mapping[str, Callable[..., Any]] = {
    "uniform": lambda uniform, low, high: low + (high - low) * uniform,
    "log_uniform": lambda uniform, low, high: low * np.exp(math.log(high / low) * uniform),
    "normal": _normal,
    "truncated_normal": _truncated_normal,
    "log_normal": _log_normal,
    "triangular": _triangular,
    "choice": _choice,
    # Whole numbers, both ends included.
    "whole_numbers": lambda uniform, low, high: np.minimum(np.floor(low + (high - low + 1.0) * uniform), high),
}
"""Quantile function of each kind, of its probabilities and numbers."""
