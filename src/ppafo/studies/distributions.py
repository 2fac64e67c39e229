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
        """Return the value [SI] below which each share lies."""
        ...


@dataclass(frozen=True, slots=True)
class UniformBetween:
    """Equally likely between two bounds."""

    minimum: float
    maximum: float

    def values(self, uniform: Floats) -> Floats:
        """Return the value [SI] below which each share lies."""
        return self.minimum + (self.maximum - self.minimum) * uniform


@dataclass(frozen=True, slots=True)
class LogUniformBetween:
    """The logarithm equally likely between two bounds above 0."""

    minimum: float
    maximum: float

    def values(self, uniform: Floats) -> Floats:
        """Return the value [SI] below which each share lies."""
        return self.minimum * np.exp(math.log(self.maximum / self.minimum) * uniform)


@dataclass(frozen=True, slots=True)
class NormalAround:
    """Normal with mean and standard deviation."""

    mean: float
    standard_deviation: float

    def values(self, uniform: Floats) -> Floats:
        """Return the value [SI] below which each share lies."""
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
        """Return the value [SI] below which each share lies; computed in the tail that keeps its digits."""
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
        """Return the value [SI] below which each share lies."""
        from scipy.special import ndtri

        return np.asarray(self.median * np.exp(math.log(self.factor) * ndtri(uniform)))


@dataclass(frozen=True, slots=True)
class TriangularBetween:
    """A density that rises to the mode and falls from it."""

    minimum: float
    mode: float
    maximum: float

    def values(self, uniform: Floats) -> Floats:
        """Return the value [SI] below which each share lies."""
        width = self.maximum - self.minimum
        left = (self.mode - self.minimum) / width
        rising = self.minimum + np.sqrt(uniform * width * (self.mode - self.minimum))
        falling = self.maximum - np.sqrt((1.0 - uniform) * width * (self.maximum - self.mode))
        return np.where(uniform < left, rising, falling)


@dataclass(frozen=True, slots=True)
class OneOf:
    """One of some values; ``shares`` are the cumulated weights, the last one 1."""

    choices: tuple[float, ...]
    shares: tuple[float, ...]

    def values(self, uniform: Floats) -> Floats:
        """Return the value [SI] below which each share lies."""
        number = np.searchsorted(np.asarray(self.shares[:-1]), uniform, side="right")
        return np.asarray(self.choices)[number]


@dataclass(frozen=True, slots=True)
class WholeNumbersBetween:
    """Equally likely whole numbers, both ends among them."""

    minimum: float
    maximum: float

    def values(self, uniform: Floats) -> Floats:
        """Return the value below which, with itself, each share lies."""
        return np.minimum(np.floor(self.minimum + (self.maximum - self.minimum + 1.0) * uniform), self.maximum)
