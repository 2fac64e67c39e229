"""Distributions as quantile functions, from probabilities in (0, 1) to values in SI units.

Each class has ``values(uniform)``, which takes and returns an array of any shape.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Distribution(Protocol):
    """Distribution given by its quantile function."""

    def values(self, uniform: Floats) -> Floats:
        """Return the quantile [SI] at each probability."""
        ...


@dataclass(frozen=True, slots=True)
class UniformBetween:
    """Uniform distribution between two bounds [SI]."""

    minimum: float
    maximum: float

    def values(self, uniform: Floats) -> Floats:
        """Return the quantile [SI] at each probability."""
        return self.minimum + (self.maximum - self.minimum) * uniform


@dataclass(frozen=True, slots=True)
class LogUniformBetween:
    """Distribution whose logarithm is uniform between two bounds above 0."""

    minimum: float
    maximum: float

    def values(self, uniform: Floats) -> Floats:
        """Return the quantile [SI] at each probability."""
        return self.minimum * np.exp(math.log(self.maximum / self.minimum) * uniform)


@dataclass(frozen=True, slots=True)
class NormalAround:
    """Normal distribution with mean and standard deviation [SI]."""

    mean: float
    standard_deviation: float

    def values(self, uniform: Floats) -> Floats:
        """Return the quantile [SI] at each probability."""
        from scipy.special import ndtri

        return np.asarray(self.mean + self.standard_deviation * ndtri(uniform))


@dataclass(frozen=True, slots=True)
class NormalBetween:
    """Normal distribution truncated to two bounds [SI]; mean and standard deviation are values before truncation."""

    mean: float
    standard_deviation: float
    minimum: float
    maximum: float

    def values(self, uniform: Floats) -> Floats:
        """Return the quantile [SI] at each probability, computed in the tail with the smaller rounding error."""
        from scipy.special import ndtr, ndtri

        # Above the mean, 1 - ndtr would cancel: the upper tail is the lower tail of the mirrored distribution.
        low = (self.minimum - self.mean) / self.standard_deviation
        high = (self.maximum - self.mean) / self.standard_deviation
        if low > 0.0:
            score = -ndtri(ndtr(-low) + (ndtr(-high) - ndtr(-low)) * uniform)
        else:
            score = ndtri(ndtr(low) + (ndtr(high) - ndtr(low)) * uniform)
        return np.asarray(np.clip(self.mean + self.standard_deviation * score, self.minimum, self.maximum))


@dataclass(frozen=True, slots=True)
class LogNormalAround:
    """Log-normal distribution given by its median [SI] and its geometric standard deviation."""

    median: float
    factor: float

    def values(self, uniform: Floats) -> Floats:
        """Return the quantile [SI] at each probability."""
        from scipy.special import ndtri

        return np.asarray(self.median * np.exp(math.log(self.factor) * ndtri(uniform)))


@dataclass(frozen=True, slots=True)
class ShiftedDistribution:
    """Another distribution minus a constant ``zero``, such as an absolute pressure minus the atmospheric pressure."""

    other: Distribution
    zero: float

    def values(self, uniform: Floats) -> Floats:
        """Return the quantile [SI] at each probability."""
        return self.other.values(uniform) - self.zero


@dataclass(frozen=True, slots=True)
class TriangularBetween:
    """Triangular distribution: its density rises linearly to the mode and falls linearly from there."""

    minimum: float
    mode: float
    maximum: float

    def values(self, uniform: Floats) -> Floats:
        """Return the quantile [SI] at each probability."""
        width = self.maximum - self.minimum
        left = (self.mode - self.minimum) / width
        rising = self.minimum + np.sqrt(uniform * width * (self.mode - self.minimum))
        falling = self.maximum - np.sqrt((1.0 - uniform) * width * (self.maximum - self.mode))
        return np.where(uniform < left, rising, falling)


@dataclass(frozen=True, slots=True)
class OneOf:
    """Discrete distribution over ``choices`` [SI]; ``cumulated`` are the cumulative weights, ending at 1."""

    choices: tuple[float, ...]
    cumulated: tuple[float, ...]

    def values(self, uniform: Floats) -> Floats:
        """Return the quantile [SI] at each probability."""
        # Without the last weight: rounding may leave the sum just below 1, and a draw above it would have no value.
        number = np.searchsorted(np.asarray(self.cumulated[:-1]), uniform, side="right")
        return np.asarray(self.choices)[number]


@dataclass(frozen=True, slots=True)
class WholeNumbersBetween:
    """Discrete uniform distribution of integers, ends included."""

    minimum: float
    maximum: float

    def values(self, uniform: Floats) -> Floats:
        """Return the quantile, an integer, at each probability."""
        return np.minimum(np.floor(self.minimum + (self.maximum - self.minimum + 1.0) * uniform), self.maximum)
