"""Noise that grows: with the slope, as of time stamps that are off, and with the level, as of a gain that wanders."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ppafo.identification.noise.sensor_noise import (
    Course,
    SensorNoise,
    best_from,
    criterion,
    numbers_of,
    unscaled,
)
from ppafo.identification.noise.shapes import Drift, from_reflections
from ppafo.signals.recording import Floats

LEAST_JITTER = 3.0e-5
"""Time [s] below which stamps that are off look like a model that is a little wrong where it is steepest: that is said
to be a misfit, for it may be one, and hardly any clock is so good and yet noisy."""
JITTER = 2.0
"""Standard errors of the score of jitter, that of all sensors together, from which it is tried."""

_FLAT = 1.0e-6
"""Slope [1/s] that says nothing of time stamps."""


def gain_noises(
    segments: Sequence[Floats], courses: Sequence[Course], plain: Sequence[SensorNoise]
) -> list[SensorNoise]:
    """Return the likeliest drift of the gain where ``plain`` noise, an autoregression and a drift, is not white."""
    count = sum(len(one) for one in segments)
    best = min(plain, key=lambda one: criterion(one.likelihood, one.numbers, count))
    if best.shape.order == 0 or not any(one.level.any() for one in courses):
        return []
    drift = next(one for one in plain if isinstance(one.shape, Drift))
    grid = [numbers_of(drift), *(np.array([ratio, 5.5]) for ratio in (-9.0, -6.0, -3.0))]
    found = []
    for is_zeroed in (False, True):
        gain = replace(unscaled(Drift(1.0, 0.5, is_zeroed), segments), has_gain=True, courses=tuple(courses))
        found.append(best_from(grid, gain, segments))
    return [max(found, key=lambda one: one.likelihood)]


def score_of_jitter(segments: Sequence[Floats], courses: Sequence[Course], noise: SensorNoise) -> tuple[float, float]:
    """Return by how much squares of what is left are larger where the slope is, and the variance of that by chance.

    It is the score of a little jitter beside ``noise``, in 1/s^2, so that those of sensors of one clock add up.
    """
    errors = np.concatenate(
        [noise.rows(one[:, None], np.ones(len(one)), place)[0][:, 0] for place, one in enumerate(segments)]
    )
    uneven = np.concatenate([np.square(one.slope) for one in courses]) / noise.levels[0] ** 2
    uneven -= uneven.mean()
    return float(uneven @ np.square(errors / noise.levels[0])), 2.0 * float(uneven @ uneven)


def jitter_noises(
    segments: Sequence[Floats], courses: Sequence[Course], drifts: Sequence[SensorNoise]
) -> list[SensorNoise]:
    """Return white noise and drifts, each with the time by which stamps are off at random that suits it best."""
    white = replace(unscaled(from_reflections(np.zeros(0)), segments), courses=tuple(courses))
    steepest = math.sqrt(max(float(np.max(np.square(one.slope))) for one in courses))
    sizes = [math.log(size / max(steepest, _FLAT)) for size in (0.5, 2.0, 8.0, 30.0)]
    return [
        best_from(
            [np.append(numbers_of(one), size) for size in sizes],
            replace(one, jitter=1.0, courses=tuple(courses)),
            segments,
        )
        for one in (white, *drifts)
    ]
