"""The memory of noise: autoregressions, and white noise upon an Ornstein-Uhlenbeck drift.

A shape is that of noise whose innovations have variance 1; samples may weigh differently (``weights``, 1 for plain
normal noise), which is how heavy tails enter.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.identification.linear_systems import solution_of
from ppafo.identification.noise.sample_loops import sample_loops
from ppafo.identification.noise.t_distribution import t_nodes
from ppafo.signals.recording import Floats

_LEAST_VARIANCE = 1.0e-300
LOG_RATIO = (-20.0, 12.0)


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
    def numbers(self) -> tuple[float, float, float]:
        """What the loops take: memory [-], and variances of a change and of the start over that of the white noise."""
        return self.memory, self.ratio, self.ratio if self.is_zeroed else self.stationary

    def rows(self, values: Floats, weights: Floats) -> tuple[Floats, float]:
        """Return whitened columns [-] (samples, columns) and the logarithm of the product of the samples' spreads."""
        errors, expected, found = np.empty(values.shape), np.zeros(values.shape[1]), np.empty(1)
        sample_loops().innovations(np.ascontiguousarray(values), weights, expected, errors, found, *self.numbers)
        return errors, float(found[0])

    def square(self, segment: Floats, weights: Floats) -> tuple[float, float]:
        """Return the sum of the squares of the whitened samples, and what ``rows`` returns of the spreads."""
        found = np.empty(2)
        sample_loops().sum_of_innovations(np.ascontiguousarray(segment), weights, found, *self.numbers)
        return float(found[0]), float(found[1])

    def path(self, values: Floats, weights: Floats, normals: Floats) -> tuple[Floats, Floats]:
        """Return the drift [unit of values], drawn given the samples, and its variance; normals of 0 give its mean."""
        path, spread = np.empty(len(values)), np.empty(len(values))
        sample_loops().smooth(values, 1.0 / weights, normals, path, spread, *self.numbers)
        return path, spread

    def heavy_likelihood(self, values: Floats, level: float, freedom: float) -> float:
        """Return the log likelihood [-] of samples whose white part has a t distribution, by a sum of normal ones."""
        weights, nodes = t_nodes(freedom)
        found = np.empty(1)
        sample_loops().mixture_likelihood(values / level, weights, nodes, found, *self.numbers)
        return float(found[0]) - len(values) * math.log(level)


Shape = AutoRegression | Drift


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
    # Levinson's recursion backwards.
    left: Floats = np.array(coefficients)
    reflections = np.zeros(len(left))
    for stage in range(len(left) - 1, -1, -1):
        last = reflections[stage] = left[stage]
        if abs(last) >= 1.0:
            return None
        before = left[:stage]
        left = (before + last * before[::-1]) / (1.0 - last * last)
    return from_reflections(reflections)


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
    return reflections, np.maximum(left, _LEAST_VARIANCE)


def regression_of(segments: Sequence[Floats], weights: Sequence[Floats], order: int) -> tuple[Floats, Floats]:
    """Return the coefficients [-] of an autoregression by weighted least squares, and their precision at level 1.

    Samples of a smooth curve do not determine them all: those before a sample say the same of it.
    """
    precision, product = np.zeros((order, order)), np.zeros(order)
    for one, weight in zip(segments, weights, strict=True):
        before, after = previous_samples(one, order), weight[order:]
        precision += before.T @ (after[:, None] * before)
        product += before.T @ (after * one[order:])
    return solution_of(precision, product), precision


def previous_samples(segment: Floats, order: int) -> Floats:
    """Return what predicts a sample [its unit], (samples after the first ``order``, order), the latest first."""
    windows = np.lib.stride_tricks.sliding_window_view(segment[:-1], order)
    return windows[:, ::-1]


def errors_of(shape: Shape, segment: Floats) -> Floats:
    """Return the whitened samples [-] with all weights 1."""
    return shape.rows(segment[:, None], np.ones(len(segment)))[0][:, 0]


def drift_of(numbers: Floats | tuple[float, float], is_zeroed: bool) -> Drift:
    """Return the drift with these logarithms of the ratio [-] and of the memory in samples."""
    return Drift(math.exp(float(numbers[0])), math.exp(-math.exp(-float(numbers[1]))), is_zeroed)


def within_bounds(numbers: Floats, longest: float) -> tuple[tuple[float, float], float]:
    """Return the logarithms of a drift inside their bounds, and the square of the distance to them."""
    ratio, memory = float(numbers[0]), float(numbers[1])
    inside = min(max(ratio, LOG_RATIO[0]), LOG_RATIO[1]), min(max(memory, 0.0), longest)
    return inside, (ratio - inside[0]) ** 2 + (memory - inside[1]) ** 2


def longest_memory(segments: Sequence[Floats], is_heavy: bool) -> float:
    """Return the logarithm of the longest memory [samples] of a drift that is tried, with heavy tails or without."""
    return math.log((1.0 if is_heavy else 50.0) * max(len(one) for one in segments))
