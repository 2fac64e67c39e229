"""Normal distributions of coordinates and mixtures of them, also where a direction is not fixed at all."""

import math
from dataclasses import dataclass

import numpy as np

from ppafo.identification.trajectory.preparation import Floats

SMALLEST_SHARE, FIXED = 1.0e-12, 1.0e-9
"""Eigenvalues of a scaled precision over the largest: less counts as this much; less than the second fixes nothing."""

LEAST = 1.0e-12


@dataclass(frozen=True, slots=True)
class Mixture:
    """Normal distributions of coordinates, counted from a point: means (parts, coordinates), covariances, a draw each.

    ``chain`` says to which chain of draws each part belongs.
    """

    means: Floats
    covariances: Floats
    draws: Floats
    chain: "np.ndarray[tuple[int], np.dtype[np.intp]]"

    @property
    def mean(self) -> Floats:
        """Mean of all coordinates."""
        return np.asarray(self.means.mean(axis=0))

    @property
    def covariance(self) -> Floats:
        """Covariance of all coordinates."""
        away = self.means - self.mean
        return np.asarray(self.covariances.mean(axis=0) + away.T @ away / len(away))

    def below(self, index: int, at: Floats) -> Floats:
        """Return the probability that a coordinate lies below each of some places."""
        from scipy.special import ndtr

        spread = np.sqrt(self.covariances[:, index, index])
        return np.asarray(ndtr((at[:, None] - self.means[:, index]) / spread).mean(axis=1))

    def quantile(self, index: int, share: float, low: float = -math.inf, high: float = math.inf) -> float:
        """Return the place below which a coordinate lies with a probability, given that it lies between two bounds."""
        from scipy.optimize import brentq

        first, last = self.below(index, np.array([low, high]))
        wanted = first + share * (last - first)
        error = 12.0 * math.sqrt(float(self.covariance[index, index]))
        ends = max(low, float(self.mean[index]) - error), min(high, float(self.mean[index]) + error)
        if not ends[0] < ends[1] or last - first < LEAST:
            return float(np.clip(self.mean[index], low, high))

        def away(place: float) -> float:
            return float(self.below(index, np.array([place]))[0] - wanted)

        if away(ends[0]) >= 0.0:
            return ends[0]
        return ends[1] if away(ends[1]) <= 0.0 else float(brentq(away, *ends, xtol=1.0e-6 * error))


def inverted(precision: Floats) -> tuple[Floats, Floats]:
    """Return the inverse of a precision and a root of it; a direction that nothing fixes gets a huge variance."""
    scale = np.sqrt(np.maximum(np.diag(precision), LEAST))
    values, vectors = np.linalg.eigh(precision / np.outer(scale, scale))
    kept = np.maximum(values, SMALLEST_SHARE * values[-1])
    root = vectors / np.sqrt(kept) / scale[:, None]
    return root @ root.T, root


def solved(precision: Floats, product: Floats) -> Floats:
    """Return the solution of a linear system that does not move along directions that nothing fixes."""
    scale = np.sqrt(np.maximum(np.diag(precision), LEAST))
    values, vectors = np.linalg.eigh(precision / np.outer(scale, scale))
    is_fixed = values > FIXED * values[-1]
    shares = np.where(is_fixed, 1.0 / np.where(is_fixed, values, 1.0), 0.0)
    return np.asarray((vectors * shares) @ (vectors.T @ (product / scale)) / scale)
