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
from ppafo.identification.noise.shapes import Drift, errors_of, from_reflections
from ppafo.signals.recording import Floats

_LEAST_JITTER = 3.0e-5
"""Time [s] below which stamps that are off look like a model that is a little wrong where it is steepest: that is said
to be a misfit, for it may be one, and hardly any clock is so good and yet noisy."""
_JITTER = 2.0
"""Standard errors of the score of jitter from which it is tried."""


def growing_noises(
    segments: Sequence[Floats], courses: Sequence[Course], levels: Floats, plain: Sequence[SensorNoise]
) -> list[SensorNoise]:
    """Return white noise and drifts that grow with slope or level, where what ``plain`` noise leaves says so.

    ``plain`` is an autoregression and a drift. A drift of the gain is tried where noise is not white, jitter where the
    squares of what is left are larger where the slope is (the score of a little jitter).
    """
    if not courses:
        return []
    count = sum(len(one) for one in segments)
    scaled = tuple(
        Course(one.level / level, one.slope / level, one.first) for one, level in zip(courses, levels, strict=True)
    )
    best = min(plain, key=lambda one: criterion(one.likelihood, one.numbers, count))
    drift = next(one for one in plain if isinstance(one.shape, Drift))
    found = []
    if best.shape.order > 0 and any(one.level.any() for one in scaled):
        grid = [numbers_of(drift), *(np.array([ratio, 5.5]) for ratio in (-9.0, -6.0, -3.0))]
        for is_zeroed in (False, True):
            gain = replace(unscaled(Drift(1.0, 0.5, is_zeroed), segments), has_gain=True, courses=scaled)
            found.append(best_from(grid, gain, segments))
        found = [max(found, key=lambda one: one.likelihood)]
    errors = np.concatenate([errors_of(best.shape, one) for one in segments]) / best.levels[0]
    uneven = np.concatenate([np.square(one.slope) for one in scaled])
    uneven -= uneven.mean()
    spread = math.sqrt(2.0 * float(uneven @ uneven))
    if spread > 0.0 and float(uneven @ np.square(errors)) > _JITTER * spread:
        white = replace(unscaled(from_reflections(np.zeros(0)), segments), courses=scaled)
        steepest = math.sqrt(max(float(np.max(np.square(one.slope))) for one in scaled))
        sizes = [math.log(size / steepest) for size in (0.5, 2.0, 8.0, 30.0)]
        found += [
            best_from(
                [np.append(numbers_of(one), size) for size in sizes],
                replace(one, jitter=1.0, courses=scaled),
                segments,
            )
            for one in (white, drift, *found)
        ]
    return [one for one in found if one.jitter == 0.0 or one.jitter >= _LEAST_JITTER]
