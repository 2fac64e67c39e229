"""Shapes of sensor noise, and how they whiten: autoregression, or white noise upon a drift.

A shape is that of noise whose innovations have variance 1; samples may weigh differently (``weights``, 1 for plain
normal noise), which is how heavy tails enter: a t distribution is a normal one whose variance is itself drawn.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from ppafo.identification.trajectory.preparation import Floats
from ppafo.identification.trajectory.sample_loops import sample_loops

_QUADRATURE = 12
_TABLE = (1.0, 200.0, 60)
_LEAST = 1.0e-300


@dataclass(frozen=True, slots=True)
class AutoRegression:
    """Noise whose samples follow from those before: ``predictors[m]`` is the best one from m samples.

    ``spreads[m]`` is the standard deviation of its error over that of the longest, which is 1: the first samples of a
    recording have few before them.
    """

    predictors: Floats
    spreads: Floats

    @property
    def order(self) -> int:
        """Samples from which the next is predicted."""
        return len(self.spreads) - 1

    def rows(self, values: Floats, weights: Floats) -> tuple[Floats, float]:
        """Return whitened columns [-] (samples, columns) and the logarithm of the product of the samples' spreads."""
        errors, found = np.empty(values.shape), np.empty(1)
        given = np.ascontiguousarray(values), weights, self.predictors, self.spreads
        sample_loops().prediction_errors(*given, errors, found)
        return errors, float(found[0])

    def square(self, segment: Floats, weights: Floats) -> tuple[float, float]:
        """Return the sum of the squares of the whitened samples, and what ``rows`` returns of the spreads."""
        errors, spread = self.rows(segment[:, None], weights)
        return float(np.vdot(errors, errors)), spread


@dataclass(frozen=True, slots=True)
class Drift:
    """White noise of variance 1 upon an Ornstein-Uhlenbeck drift.

    ``ratio`` is the variance of the change of the drift from sample to sample over that of the white noise,
    ``memory`` the fraction of it that is left after one sample. ``is_zeroed``: it begins at 0 in each recording, as
    that of a sensor whose zero is set before; else anywhere.
    """

    ratio: float
    memory: float
    is_zeroed: bool = False

    @property
    def order(self) -> int:
        """Numbers besides the level."""
        return 2

    @property
    def stationary(self) -> float:
        """Variance of the drift over that of the white noise [-]."""
        return self.ratio / (1.0 - self.memory**2)

    @property
    def first(self) -> float:
        """Variance of the drift at the first sample over that of the white noise [-]."""
        return self.ratio if self.is_zeroed else self.stationary

    def rows(self, values: Floats, weights: Floats) -> tuple[Floats, float]:
        """Return whitened columns [-] (samples, columns) and the logarithm of the product of the samples' spreads."""
        errors, expected, found = np.empty(values.shape), np.zeros(values.shape[1]), np.empty(1)
        numbers = self.memory, self.ratio, self.first
        sample_loops().innovations(np.ascontiguousarray(values), weights, expected, errors, found, *numbers)
        return errors, float(found[0])

    def square(self, segment: Floats, weights: Floats) -> tuple[float, float]:
        """Return the sum of the squares of the whitened samples, and what ``rows`` returns of the spreads."""
        found = np.empty(2)
        numbers = self.memory, self.ratio, self.first
        sample_loops().sum_of_innovations(np.ascontiguousarray(segment), weights, found, *numbers)
        return float(found[0]), float(found[1])

    def path(self, values: Floats, weights: Floats, normals: Floats) -> tuple[Floats, Floats]:
        """Return the drift [unit of values], drawn given the samples, and its variance; normals of 0 give its mean."""
        path, spread = np.empty(len(values)), np.empty(len(values))
        numbers = self.memory, self.ratio, self.first
        sample_loops().smooth(values, 1.0 / weights, normals, path, spread, *numbers)
        return path, spread

    def heavy_likelihood(self, values: Floats, level: float, freedom: float) -> float:
        """Return the log likelihood [-] of samples whose white part has a t distribution, by a sum of normal ones."""
        weights, nodes = t_nodes(freedom)
        found, numbers = np.empty(1), (self.memory, self.ratio, self.first)
        sample_loops().mixture_likelihood(values / level, weights, nodes, found, *numbers)
        return float(found[0]) - len(values) * math.log(level)


Shape = AutoRegression | Drift


def t_nodes(freedom: float) -> tuple[Floats, Floats]:
    """Return weights [-] and precisions [-] of normal distributions whose sum is a t distribution, nearly."""
    weights, freedoms, logarithms = _table_of_nodes()
    place = float(np.clip(np.interp(math.log(freedom), freedoms, np.arange(len(freedoms))), 0.0, len(freedoms) - 1.001))
    first = int(place)
    return weights, np.exp(logarithms[first] + (place - first) * (logarithms[first + 1] - logarithms[first]))


@cache
def _table_of_nodes() -> tuple[Floats, Floats, Floats]:
    """Return weights, logarithms of degrees of freedom, and logarithms of the precisions at each of them."""
    from scipy.stats import gamma

    places, weights = np.polynomial.legendre.leggauss(_QUADRATURE)
    freedoms = np.geomspace(*_TABLE)
    nodes = [gamma.ppf(0.5 + 0.5 * places, 0.5 * one) * 2.0 / one for one in freedoms]
    return 0.5 * weights, np.log(freedoms), np.log(np.maximum(nodes, 1.0e-6))


def from_reflections(reflections: Floats) -> AutoRegression:
    """Return the autoregression with these reflection coefficients [-], all between -1 and 1 (Levinson's recursion)."""
    order = len(reflections)
    predictors = np.zeros((order + 1, max(order, 1)))
    for stage, reflection in enumerate(reflections, start=1):
        before = predictors[stage - 1, : stage - 1]
        predictors[stage, : stage - 1] = before - reflection * before[::-1]
        predictors[stage, stage - 1] = reflection
    left = np.concatenate([[1.0], np.cumprod(1.0 - np.square(reflections))])
    return AutoRegression(predictors, np.sqrt(left / left[-1]))


def from_coefficients(coefficients: Floats) -> AutoRegression | None:
    """Return the autoregression with these coefficients [-]; None where noise like that would grow without end."""
    reflections: Floats = _step_down(np.array(coefficients))
    return None if np.any(np.abs(reflections) >= 1.0) else from_reflections(reflections)


def reflections_of(segments: list[Floats], most: int) -> tuple[Floats, Floats]:
    """Return reflection coefficients [-] and the variance left after each, 0 to ``most`` (Burg's method, pooled)."""
    ahead, behind = [one[1:] for one in segments], [one[:-1] for one in segments]
    reflections, left = np.zeros(most), np.zeros(most + 1)
    left[0] = sum(float(one @ one) for one in segments) / sum(len(one) for one in segments)
    for stage in range(most):
        along = sum(float(a @ b) for a, b in zip(ahead, behind, strict=True))
        size = sum(float(a @ a + b @ b) for a, b in zip(ahead, behind, strict=True))
        reflections[stage] = 2.0 * along / size if size > 0.0 else 0.0
        left[stage + 1] = left[stage] * (1.0 - reflections[stage] ** 2)
        pairs = [(a - reflections[stage] * b, b - reflections[stage] * a) for a, b in zip(ahead, behind, strict=True)]
        ahead, behind = [a[1:] for a, _ in pairs], [b[:-1] for _, b in pairs]
    return reflections, np.maximum(left, _LEAST)


def _step_down(coefficients: Floats) -> Floats:
    """Return reflection coefficients [-], up to the first that is 1 or more (Levinson's recursion backwards)."""
    found = np.zeros(len(coefficients))
    for stage in range(len(coefficients) - 1, -1, -1):
        last = found[stage] = coefficients[stage]
        if abs(last) >= 1.0:
            break
        before = coefficients[:stage]
        coefficients = (before + last * before[::-1]) / (1.0 - last * last)
    return found
