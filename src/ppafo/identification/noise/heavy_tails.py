"""Noise with heavy tails: autoregressions and drifts whose innovations have a t distribution."""

import math
from collections.abc import Sequence

import numpy as np

from ppafo.identification.noise.sensor_noise import SAMPLES_FOR_EACH, SensorNoise, criterion
from ppafo.identification.noise.shapes import (
    AutoRegression,
    Drift,
    Shape,
    drift_of,
    errors_of,
    from_coefficients,
    from_reflections,
    longest_memory,
    reflections_of,
    regression_of,
    within_bounds,
)
from ppafo.identification.noise.t_distribution import FREEDOMS, fit_scaled_t
from ppafo.signals.recording import Floats

_HEAVY_ORDERS = (0, 1, 2, 3, 5, 8, 12, 20)
_REWEIGHED = 6


def gain_of_tails(noise: SensorNoise, segments: Sequence[Floats]) -> float:
    """Return the log likelihood that the best t distribution of the innovations gains over a normal one."""
    rows = [noise.rows(one[:, None], np.ones(len(one)), number)[0] for number, one in enumerate(segments)]
    errors = np.concatenate(rows)[:, 0] / noise.levels[0]
    likelihoods, _ = fit_scaled_t(errors)
    normal = -0.5 * len(errors) * (math.log(2.0 * math.pi * float(np.mean(errors * errors))) + 1.0)
    return float(likelihoods.max() - normal)


def heavy_autoregression(segments: list[Floats], normal: SensorNoise) -> SensorNoise:
    """Return the autoregression with t innovations whose order has the least criterion."""
    count, shortest = sum(len(one) for one in segments), min(len(one) for one in segments)
    most = min(count // SAMPLES_FOR_EACH, shortest - 2)
    orders = sorted({order for order in (*_HEAVY_ORDERS, normal.shape.order) if order <= most})
    found = [_heavy_of_order(segments, order) for order in orders]
    return min(found, key=lambda one: criterion(one.likelihood, one.numbers, count))


def _heavy_of_order(segments: list[Floats], order: int) -> SensorNoise:
    reflections, _ = reflections_of(segments, order)
    shape = from_reflections(reflections)
    for _ in range(_REWEIGHED):
        likelihoods, levels = fit_scaled_t(np.concatenate([errors_of(shape, one) for one in segments]))
        best = int(np.argmax(likelihoods))
        if order == 0:
            break
        weights = [_heavy_weights(shape, one / levels[best], FREEDOMS[best]) for one in segments]
        shape = from_coefficients(regression_of(segments, weights, order)[0]) or shape
    logs = sum(shape.square(one, np.ones(len(one)))[1] for one in segments)
    return _of(shape, float(levels[best]), len(segments), float(likelihoods[best]) - logs, float(FREEDOMS[best]))


def heavy_drift(segments: list[Floats], normal: SensorNoise) -> SensorNoise:
    """Return the drift upon which white noise has a t distribution, by a filter that sums normal distributions."""
    from scipy.optimize import minimize

    longest, white = longest_memory(segments, is_heavy=True), normal.shape
    assert isinstance(white, Drift)

    def cost(numbers: Floats) -> float:
        inside, away = within_bounds(numbers, longest)
        shape = drift_of(inside, white.is_zeroed)
        level, freedom = math.exp(numbers[2]), 1.5 + math.exp(min(float(numbers[3]), 5.0))
        return away - sum(shape.heavy_likelihood(one, level, freedom) for one in segments)

    memory = -math.log(-math.log(white.memory))
    start = np.array([math.log(white.ratio) + 1.0, memory, math.log(normal.levels[0]) - 0.4, 0.7])
    simplex = np.vstack([start, start + np.diag([1.0, 0.7, -0.4, 0.7])])
    options = {"xatol": 0.05, "fatol": 0.05, "maxfev": 220, "initial_simplex": simplex}
    found = minimize(cost, start, method="Nelder-Mead", options=options)
    freedom = 1.5 + math.exp(min(float(found.x[3]), 5.0))
    shape = drift_of(within_bounds(found.x, longest)[0], white.is_zeroed)
    return _of(shape, math.exp(found.x[2]), len(segments), -cost(found.x), freedom)


def sample_weights(noise: SensorNoise, segments: Sequence[Floats]) -> list[Floats]:
    """Return how much each sample counts [-]: 1 for normal noise, less where a heavy tail threw it far."""
    if not noise.is_heavy:
        return [np.ones(len(one)) for one in segments]
    return [
        _heavy_weights(noise.shape, one / level, noise.freedom)
        for one, level in zip(segments, noise.levels, strict=True)
    ]


def _heavy_weights(shape: Shape, segment: Floats, freedom: float) -> Floats:
    """Return the expected precision of each sample; ``segment`` is over the level."""
    if isinstance(shape, AutoRegression):
        return np.asarray((freedom + 1.0) / (freedom + np.square(errors_of(shape, segment))))
    weights, nothing = np.ones(len(segment)), np.zeros(len(segment))
    for _ in range(_REWEIGHED):
        path, spread = shape.path(segment, weights, nothing)
        weights = (freedom + 1.0) / (freedom + np.square(segment - path) + spread)
    return weights


def _of(shape: Shape, level: float, parts: int, likelihood: float, freedom: float = math.inf) -> SensorNoise:
    numbers = shape.order + 1 + math.isfinite(freedom)
    return SensorNoise(shape, np.full(parts, level), freedom, likelihood=likelihood, numbers=numbers)
