"""Distributions as functions from uniform numbers in (0, 1) to values in SI units, the inverses of their fractions.

Each one has ``values(uniform)``, which takes and returns an array of any shape.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Distribution(Protocol):
    """What turns uniform numbers into values."""

    def values(self, uniform: Floats) -> Floats:
        """Return the quantile [SI] at each probability."""
        ...


@dataclass(frozen=True, slots=True)
class UniformBetween:
    """Equally likely between two bounds."""

    minimum: float
    maximum: float

    def values(self, uniform: Floats) -> Floats:
        """Return the quantile [SI] at each probability."""
        return self.minimum + (self.maximum - self.minimum) * uniform


@dataclass(frozen=True, slots=True)
class LogUniformBetween:
    """The logarithm equally likely between two bounds above 0."""

    minimum: float
    maximum: float

    def values(self, uniform: Floats) -> Floats:
        """Return the quantile [SI] at each probability."""
        return self.minimum * np.exp(math.log(self.maximum / self.minimum) * uniform)


@dataclass(frozen=True, slots=True)
class NormalAround:
    """Normal with mean and standard deviation."""

    mean: float
    standard_deviation: float

    def values(self, uniform: Floats) -> Floats:
        """Return the quantile [SI] at each probability."""
        from scipy.special import ndtri

        return np.asarray(self.mean + self.standard_deviation * ndtri(uniform))


@dataclass(frozen=True, slots=True)
class NormalBetween:
    """The part between two bounds of a normal with mean and standard deviation."""

    mean: float
    standard_deviation: float
    minimum: float
    maximum: float

    def values(self, uniform: Floats) -> Floats:
        """Return the quantile [SI] at each probability; computed in the tail that keeps its digits."""
        from scipy.special import ndtr, ndtri

        low = (self.minimum - self.mean) / self.standard_deviation
        high = (self.maximum - self.mean) / self.standard_deviation
        if low > 0.0:
            score = -ndtri(ndtr(-low) + (ndtr(-high) - ndtr(-low)) * uniform)
        else:
            score = ndtri(ndtr(low) + (ndtr(high) - ndtr(low)) * uniform)
        return np.asarray(np.clip(self.mean + self.standard_deviation * score, self.minimum, self.maximum))


@dataclass(frozen=True, slots=True)
class LogNormalAround:
    """Log-normal with its median and the factor that one standard deviation is."""

    median: float
    factor: float

    def values(self, uniform: Floats) -> Floats:
        """Return the quantile [SI] at each probability."""
        from scipy.special import ndtri

        return np.asarray(self.median * np.exp(math.log(self.factor) * ndtri(uniform)))


@dataclass(frozen=True, slots=True)
class Above:
    """Another distribution less a number, as an absolute pressure less the atmosphere."""

    other: Distribution
    zero: float

    def values(self, uniform: Floats) -> Floats:
        """Return the quantile [SI] at each probability."""
        return self.other.values(uniform) - self.zero


@dataclass(frozen=True, slots=True)
class TriangularBetween:
    """A density that rises to the mode and falls from it."""

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
    """One of some values; ``cumulated`` are the cumulated weights, the last one 1."""

    choices: tuple[float, ...]
    cumulated: tuple[float, ...]

    def values(self, uniform: Floats) -> Floats:
        """Return the quantile [SI] at each probability."""
        number = np.searchsorted(np.asarray(self.cumulated[:-1]), uniform, side="right")
        return np.asarray(self.choices)[number]


@dataclass(frozen=True, slots=True)
class WholeNumbersBetween:
    """Equally likely whole numbers, both ends among them."""

    minimum: float
    maximum: float

    def values(self, uniform: Floats) -> Floats:
        """Return the value at each probability of the cumulated weights."""
        return np.minimum(np.floor(self.minimum + (self.maximum - self.minimum + 1.0) * uniform), self.maximum)
