"""The noise of one sensor, from what its recordings leave unexplained: level, memory, drift, heavy tails.

Autoregressions of up to 30 samples, their order by the corrected criterion of Akaike, and white noise upon an
Ornstein-Uhlenbeck drift compete; each may have innovations with a t distribution. White noise and drifts may grow with
the slope, as where time stamps are off, and the drift with the level, as that of a gain. The least criterion wins.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ppafo.identification.noise.growing import growing_noises
from ppafo.identification.noise.heavy_tails import gain_of_tails, heavy_autoregression, heavy_drift
from ppafo.identification.noise.sensor_noise import (
    SAMPLES_FOR_EACH,
    Course,
    SensorNoise,
    at_best_level,
    best_from,
    criterion,
    unscaled,
)
from ppafo.identification.noise.shapes import AutoRegression, Drift, errors_of, from_reflections, reflections_of
from ppafo.identification.noise.t_distribution import LEAST
from ppafo.signals.recording import Floats

MAXIMUM_ORDER = 30
_HEAVY = 4.0
"""Log likelihood that a t distribution must gain before tails are called heavy."""
_NUMBERS_OF_DRIFT = 2
_UNEQUAL = 5.0
"""Standard errors by which the levels of two recordings differ before each gets its own."""
_ERROR_OF_LEVEL = 1.2


def sensor_noise(segments: Sequence[Floats], is_given: bool = False, courses: Sequence[Course] = ()) -> SensorNoise:
    """Return the noise [-] that explains a sensor's residuals best; ``is_given`` says that its size is at least 1.

    With the ``courses`` of its recordings it may grow with slope and level.
    """
    whole = np.concatenate(segments)
    white = from_reflections(np.zeros(0))
    if float(np.mean(whole * whole)) < max(LEAST, 1.0 if is_given else 0.0):
        level, count = 1.0 if is_given else math.sqrt(LEAST), len(whole)
        likelihood = -0.5 * float(whole @ whole) / level**2 - count * (math.log(level) + 0.5 * math.log(2.0 * math.pi))
        return SensorNoise(white, np.full(len(segments), level), is_fixed=True, likelihood=likelihood)
    levels = _relative_levels(segments)
    scaled = [one / level for one, level in zip(segments, levels, strict=True)]
    is_shared = bool(np.all(levels == 1.0))
    drift = max((_drift(scaled, is_zeroed) for is_zeroed in (False, True)), key=lambda one: one.likelihood)
    plain = [_autoregression(scaled), drift]
    growing = growing_noises(scaled, courses, levels, plain)
    best = min((*plain, *growing), key=lambda one: criterion(one.likelihood, one.numbers, len(whole)))
    candidates = [*plain, *growing]
    if any(gain_of_tails(one, scaled) > _HEAVY for one in ([best] if best.grows else plain)):
        candidates += [heavy_autoregression(scaled, plain[0]), heavy_drift(scaled, drift)]
    count = len(whole)

    def criterion_beside_drifts(one: SensorNoise) -> float:
        # The best of so many orders is now and then better than a drift that is there, by chance, and intervals are
        # then too narrow: a number that an autoregression has more than a drift costs what Schwarz's criterion takes.
        more = max(0, one.shape.order - _NUMBERS_OF_DRIFT) if isinstance(one.shape, AutoRegression) else 0
        return criterion(one.likelihood, one.numbers, count) + (math.log(count) - 2.0) * more

    best = min(candidates, key=criterion_beside_drifts)
    likelihood = best.likelihood - sum(len(one) * math.log(level) for one, level in zip(segments, levels, strict=True))
    return replace(best, levels=best.levels * levels, is_shared=is_shared, likelihood=likelihood)


def _relative_levels(segments: Sequence[Floats]) -> Floats:
    """Return the level of each recording over that of all; 1 where they do not differ for certain."""
    if len(segments) == 1:
        return np.ones(1)
    reflections, _ = reflections_of(list(segments), min(1, min(len(one) for one in segments) - 2))
    shape = from_reflections(reflections)
    sizes = np.array([np.log(max(float(np.median(np.abs(errors_of(shape, one)))), LEAST)) for one in segments])
    errors = np.array([_ERROR_OF_LEVEL / math.sqrt(len(one)) for one in segments])
    middle = np.average(sizes, weights=1.0 / errors**2)
    differ = np.max(np.abs(sizes - middle) / errors)
    return np.exp(sizes - middle) if differ > _UNEQUAL else np.ones(len(segments))


def _autoregression(segments: list[Floats]) -> SensorNoise:
    """Return the autoregression with normal innovations whose order has the least criterion."""
    count, shortest = sum(len(one) for one in segments), min(len(one) for one in segments)
    most = max(0, min(MAXIMUM_ORDER, count // SAMPLES_FOR_EACH, shortest - 2))
    reflections, left = reflections_of(segments, most)
    scores = [criterion(-0.5 * count * math.log(left[order]), order + 1, count) for order in range(most + 1)]
    return at_best_level(unscaled(from_reflections(reflections[: int(np.argmin(scores))]), segments), segments)


def _drift(segments: list[Floats], is_zeroed: bool) -> SensorNoise:
    """Return the drift of greatest likelihood, with white normal noise upon it."""
    grid = [np.array([ratio, memory]) for ratio in (-9.0, -6.0, -3.0, 0.0) for memory in (1.5, 3.5, 5.5)]
    return best_from(grid, unscaled(Drift(1.0, 0.5, is_zeroed), segments), segments)
