"""The noise of one sensor: shape, level of each recording, tails, and what grows with the slope or with the level."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.identification.noise.shapes import Drift, Shape, drift_of, longest_memory, within_bounds
from ppafo.identification.noise.t_distribution import LEAST
from ppafo.signals.recording import Floats

SAMPLES_FOR_EACH = 8
"""Samples that a recording has at least for each number of an autoregression."""
LOG_JITTER = (math.log(1.0e-9), math.log(0.1))
"""Logarithms of the least and the largest time [s] by which stamps may be off."""
_SMALLEST_LEVEL = 1.0e-6
"""Level over its root mean square below which a gain changes nothing."""


@dataclass(frozen=True, slots=True)
class Course:
    """What a sensor should show in one recording, over its noise: level [-] and slope [1/s] at each sample.

    ``first`` is the place of its first sample among those of all experiments: channels of one experiment share them.
    """

    level: Floats
    slope: Floats
    first: int = 0


def course_of(time: Floats, level: Floats, first: int = 0) -> Course:
    """Return the course of a level [-] over time [s]; a slope is the mean square of those before and after a sample."""
    slopes = np.diff(level) / np.diff(time)
    before, after = np.concatenate([slopes[:1], slopes]), np.concatenate([slopes, slopes[-1:]])
    return Course(level, np.copysign(np.sqrt(0.5 * (before**2 + after**2)), before + after), first)


@dataclass(frozen=True, slots=True)
class SensorNoise:
    """Noise of a sensor: its shape, the level of each recording, degrees of freedom (infinite for normal tails).

    ``levels`` are in units of the given or first estimated noise; all equal where ``is_shared``. ``is_fixed`` is noise
    that was given and is not exceeded. The log ``likelihood`` and ``numbers`` are what the criterion is made of.
    ``jitter`` [s] is by how much time stamps are off for a level of 1, ``has_gain`` that the drift is one of the gain,
    in units of the root mean square of the level; ``courses`` is what both grow with, by recording.
    """

    shape: Shape
    levels: Floats
    freedom: float = math.inf
    is_shared: bool = True
    is_fixed: bool = False
    likelihood: float = 0.0
    numbers: int = 1
    jitter: float = 0.0
    has_gain: bool = False
    courses: tuple[Course, ...] = ()

    @property
    def grows(self) -> bool:
        """Whether it grows with the slope or with the level."""
        return self.jitter > 0.0 or self.has_gain

    @property
    def size_of_level(self) -> float:
        """Root mean square of the level [-] over all recordings."""
        total = sum(float(one.level @ one.level) for one in self.courses)
        return math.sqrt(total / sum(len(one.level) for one in self.courses))

    def rows(self, values: Floats, weights: Floats, recording: int) -> tuple[Floats, float]:
        """Return columns of a recording whitened for a level of 1, and the logarithm of the product of the spreads."""
        if not self.grows:
            return self.shape.rows(values, weights)
        divisors, precisions, logs = self._growth(recording)
        rows, spread = self.shape.rows(values / divisors[:, None], weights * precisions)
        return rows, spread + logs

    def square(self, segment: Floats, weights: Floats, recording: int) -> tuple[float, float]:
        """Return the sum of the squares of the whitened samples, and what ``rows`` returns of the spreads."""
        if not self.grows:
            return self.shape.square(segment, weights)
        divisors, precisions, logs = self._growth(recording)
        square, spread = self.shape.square(segment / divisors, weights * precisions)
        return square, spread + logs

    def _growth(self, recording: int) -> tuple[Floats, Floats, float]:
        """Return what samples are divided by, the precision of their white part then, and the logarithms of the former.

        The drift of a gain is one of the samples over the level.
        """
        course = self.courses[recording]
        precisions = 1.0 / (1.0 + np.square(self.jitter * course.slope))
        if not self.has_gain:
            return np.ones(len(precisions)), precisions, 0.0
        divisors = np.maximum(np.abs(course.level) / self.size_of_level, _SMALLEST_LEVEL)
        return divisors, precisions * divisors**2, float(np.sum(np.log(divisors)))

    def common_part(self, recording: int) -> Floats:
        """Return the part [-] of each whitened sample that is the time stamp's, with the sign of the slope."""
        course = self.courses[recording]
        of_stamps, unknown = self.jitter * course.slope, 0.0
        if isinstance(self.shape, Drift):
            memory, change, _ = self.shape.numbers
            rest = memory**2 + change - 1.0
            unknown = 0.5 * (rest + math.sqrt(rest * rest + 4.0 * change))
        of_drift = unknown * np.square(course.level / self.size_of_level) if self.has_gain else unknown
        return np.asarray(of_stamps / np.sqrt(1.0 + of_stamps**2 + of_drift))

    @property
    def is_heavy(self) -> bool:
        """Whether its tails are heavier than normal ones."""
        return math.isfinite(self.freedom)

    def in_words(self, interval: float) -> str:
        """Return what the noise is like; ``interval`` [s] is the time between two samples."""
        tails = f", heavy tails (t with {self.freedom:.2g} degrees of freedom)" if self.is_heavy else ""
        unequal = "" if self.is_shared else ", a level for each recording"
        stamps = f", time stamps off by {1e3 * self.jitter * float(np.mean(self.levels)):.2g} ms"
        rest = f"{tails}{unequal}{stamps if self.jitter > 0.0 else ''}"
        if isinstance(self.shape, Drift):
            size, memory = math.sqrt(self.shape.stationary), -interval / math.log(self.shape.memory)
            if self.has_gain:
                longest = interval * max(len(one.level) for one in self.courses)
                over = math.sqrt(min(1.0, longest / memory)) * size * float(np.mean(self.levels)) / self.size_of_level
                return f"white and a gain that drifts by {100.0 * over:.2g} % over {min(memory, longest):.2g} s{rest}"
            return f"white and a drift of {size:.2g} times its size over {memory:.2g} s{rest}"
        description = "white" if self.shape.order == 0 else f"autoregression of {self.shape.order}"
        return f"{description}{rest}"


def without_common_stamps(rows: Floats, places: Sequence[Sequence[slice]], noises: Sequence[SensorNoise]) -> None:
    """Take from whitened columns (samples, columns) what channels share because a sample of all was early or late.

    Each channel in turn shows how late a sample was, in standard deviations, and the next is freed of it.
    """
    late = [(parts, noise) for parts, noise in zip(places, noises, strict=True) if noise.jitter > 0.0]
    if len(late) < 2:
        return
    count = max(one.first + len(one.slope) for _, noise in late for one in noise.courses)
    expected, unknown = np.zeros((count, rows.shape[1])), np.ones(count)
    for parts, noise in late:
        for number, place in enumerate(parts):
            course, share = noise.courses[number], noise.common_part(number)
            at = slice(course.first, course.first + len(share))
            left = rows[place] - share[:, None] * expected[at]
            variance = 1.0 - share**2 * (1.0 - unknown[at])
            rows[place] = left / np.sqrt(variance)[:, None]
            gain = unknown[at] * share / variance
            expected[at] += gain[:, None] * left
            unknown[at] -= gain * share * unknown[at]


def profile_likelihood(
    noise: SensorNoise, segments: Sequence[Floats], weights: Sequence[Floats]
) -> tuple[float, float]:
    """Return the log likelihood [-] at the best common level, and that level."""
    squares, logs, count = 0.0, 0.0, 0
    for number, (one, weight) in enumerate(zip(segments, weights, strict=True)):
        square, spread = noise.square(one, weight, number)
        squares, logs, count = squares + square, logs + spread, count + len(one)
    variance = max(squares / count, LEAST)
    return -0.5 * count * (math.log(2.0 * math.pi * variance) + 1.0) - logs, math.sqrt(variance)


def unscaled(shape: Shape, segments: Sequence[Floats]) -> SensorNoise:
    """Return normal noise of a shape with a level of 1 in each recording."""
    return SensorNoise(shape, np.ones(len(segments)))


def at_best_level(noise: SensorNoise, segments: Sequence[Floats]) -> SensorNoise:
    """Return normal noise of a shape at its best common level, with what the criterion needs."""
    likelihood, level = profile_likelihood(noise, segments, [np.ones(len(one)) for one in segments])
    numbers = noise.shape.order + 1 + (noise.jitter > 0.0)
    return replace(noise, levels=np.full(len(segments), level), likelihood=likelihood, numbers=numbers)


def numbers_of(noise: SensorNoise) -> Floats:
    """Return the logarithms of ratio and memory of a drift, then that of the jitter where there is one."""
    shape = noise.shape
    numbers = [math.log(shape.ratio), -math.log(-math.log(shape.memory))] if isinstance(shape, Drift) else []
    return np.array([*numbers, math.log(noise.jitter)] if noise.jitter > 0.0 else numbers)


def with_numbers(noise: SensorNoise, numbers: Floats) -> SensorNoise:
    """Return noise of white samples or a drift with the numbers that ``numbers_of`` returns."""
    shape = noise.shape
    if isinstance(shape, Drift):
        shape = drift_of((float(numbers[0]), float(numbers[1])), shape.is_zeroed)
    return replace(noise, shape=shape, jitter=math.exp(float(numbers[-1])) if noise.jitter > 0.0 else 0.0)


def best_from(grid: Sequence[Floats], noise: SensorNoise, segments: Sequence[Floats]) -> SensorNoise:
    """Return the noise of greatest likelihood whose numbers are searched from the best of a grid."""
    from scipy.optimize import minimize

    ones, longest = [np.ones(len(one)) for one in segments], longest_memory(segments, is_heavy=False)

    def inside(numbers: Floats) -> tuple[Floats, float]:
        within = numbers.copy()
        if isinstance(noise.shape, Drift):
            within[:2] = within_bounds(numbers, longest)[0]
        if noise.jitter > 0.0:
            within[-1] = min(max(float(numbers[-1]), LOG_JITTER[0]), LOG_JITTER[1])
        return within, float(np.sum(np.square(numbers - within)))

    def cost(numbers: Floats) -> float:
        within, away = inside(numbers)
        return away - profile_likelihood(with_numbers(noise, within), segments, ones)[0]

    start = min(grid, key=cost)
    options = {"xatol": 0.05, "fatol": 0.02, "maxfev": 60 * len(start)}
    found = minimize(cost, start, method="Nelder-Mead", options=options)
    return at_best_level(with_numbers(noise, inside(found.x)[0]), segments)


def criterion(likelihood: float, numbers: int, count: int) -> float:
    """Return the corrected criterion of Akaike [-] of a log likelihood, to compare kinds of noise: less is better."""
    return -2.0 * likelihood + 2.0 * numbers * count / max(1.0, count - numbers - 1.0)
