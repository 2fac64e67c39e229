"""Shapes of sensor noise, and how they whiten: autoregression, or white noise upon a drift.

A shape is that of noise whose innovations have variance 1; samples may weigh differently (``weights``, 1 for plain
normal noise), which is how heavy tails enter: a t distribution is a normal one whose variance is itself drawn.
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numba import njit

from ppafo.identification.trajectory.preparation import Floats

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
        found: tuple[Floats, float] = _prediction_errors(values, weights, self.predictors, self.spreads)
        return found

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
        found: tuple[Floats, float] = _innovations(values, weights, self.memory, self.ratio, self.first)
        return found

    def square(self, segment: Floats, weights: Floats) -> tuple[float, float]:
        """Return the sum of the squares of the whitened samples, and what ``rows`` returns of the spreads."""
        found: tuple[float, float] = _sum_of_innovations(segment, weights, self.memory, self.ratio, self.first)
        return found

    def path(self, values: Floats, weights: Floats, normals: Floats) -> tuple[Floats, Floats]:
        """Return the drift [unit of values], drawn given the samples, and its variance; normals of 0 give its mean."""
        drawn: tuple[Floats, Floats] = _smooth(values, 1.0 / weights, self.memory, self.ratio, self.first, normals)
        return drawn

    def heavy_likelihood(self, values: Floats, level: float, freedom: float) -> float:
        """Return the log likelihood [-] of samples whose white part has a t distribution, by a sum of normal ones."""
        weights, nodes = t_nodes(freedom)
        total: float = _mixture_likelihood(values / level, self.memory, self.ratio, self.first, weights, nodes)
        return total - len(values) * math.log(level)


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


def compiled(function: Any) -> Any:
    """Return a function compiled once for this computer."""
    return njit(cache=True, error_model="numpy")(function)


@compiled
def _prediction_errors(values: Any, weights: Any, predictors: Any, spreads: Any) -> Any:
    count, width = values.shape
    order = len(spreads) - 1
    out, total = np.empty((count, width)), 0.0
    for sample in range(count):
        stage = min(sample, order)
        root = np.sqrt(weights[sample]) / spreads[stage]
        total -= np.log(root)
        for column in range(width):
            out[sample, column] = values[sample, column]
        for back in range(stage):
            coefficient = predictors[stage, back]
            for column in range(width):
                out[sample, column] -= coefficient * values[sample - 1 - back, column]
        for column in range(width):
            out[sample, column] *= root
    return out, total


@compiled
def _step_down(coefficients: Any) -> Any:
    order = len(coefficients)
    found = np.zeros(order)
    for stage in range(order - 1, -1, -1):
        last = coefficients[stage]
        found[stage] = last
        if abs(last) >= 1.0:
            break
        scaled = 1.0 - last * last
        shorter = np.empty(stage)
        for index in range(stage):
            shorter[index] = (coefficients[index] + last * coefficients[stage - 1 - index]) / scaled
        coefficients = shorter
    return found


@compiled
def _innovations(values: Any, weights: Any, memory: float, change: float, first: float) -> Any:
    count, width = values.shape
    out, expected = np.empty((count, width)), np.zeros(width)
    unknown, logs = first, 0.0
    for sample in range(count):
        total = unknown + 1.0 / weights[sample]
        gain, spread = unknown / total, np.sqrt(total)
        logs += np.log(spread)
        for column in range(width):
            new = values[sample, column] - expected[column]
            out[sample, column] = new / spread
            expected[column] = memory * (expected[column] + gain * new)
        unknown = memory * memory * unknown * (1.0 - gain) + change
    return out, logs


@compiled
def _sum_of_innovations(segment: Any, weights: Any, memory: float, change: float, first: float) -> Any:
    expected, unknown, squares, logs = 0.0, first, 0.0, 0.0
    for sample in range(len(segment)):
        total = unknown + 1.0 / weights[sample]
        gain, new = unknown / total, segment[sample] - expected
        squares += new * new / total
        logs += 0.5 * np.log(total)
        expected = memory * (expected + gain * new)
        unknown = memory * memory * unknown * (1.0 - gain) + change
    return squares, logs


@compiled
def _smooth(values: Any, variances: Any, memory: float, change: float, first: float, normals: Any) -> Any:
    count = len(values)
    mean, left = np.empty(count), np.empty(count)
    expected, unknown = 0.0, first
    for sample in range(count):
        gain = unknown / (unknown + variances[sample])
        mean[sample] = expected + gain * (values[sample] - expected)
        left[sample] = unknown * (1.0 - gain)
        expected = memory * mean[sample]
        unknown = memory * memory * left[sample] + change
    path, spread = np.empty(count), np.empty(count)
    path[-1] = mean[-1] + np.sqrt(left[-1]) * normals[-1]
    spread[-1] = left[-1]
    for sample in range(count - 2, -1, -1):
        ahead = memory * memory * left[sample] + change
        back = memory * left[sample] / ahead
        own = left[sample] * change / ahead
        path[sample] = mean[sample] + back * (path[sample + 1] - memory * mean[sample]) + np.sqrt(own) * normals[sample]
        spread[sample] = own + back * back * spread[sample + 1]
    return path, spread


@compiled
def _mixture_likelihood(values: Any, memory: float, change: float, first: float, weights: Any, nodes: Any) -> float:
    expected, unknown, total = 0.0, first, 0.0
    for sample in range(len(values)):
        new = values[sample] - expected
        density, mean, square = 0.0, 0.0, 0.0
        for part in range(len(nodes)):
            spread = unknown + 1.0 / nodes[part]
            chance = weights[part] * np.exp(-0.5 * new * new / spread) / np.sqrt(2.0 * np.pi * spread) + 1.0e-300
            gain = unknown / spread
            density += chance
            mean += chance * gain * new
            square += chance * (unknown * (1.0 - gain) + (gain * new) ** 2)
        mean /= density
        left = max(square / density - mean * mean, 1.0e-12 * unknown)
        total += np.log(density)
        expected = memory * (expected + mean)
        unknown = memory * memory * left + change
    return total
