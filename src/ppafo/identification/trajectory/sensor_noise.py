"""The noise of one sensor, from what its recordings leave unexplained: level, memory, drift, heavy tails.

Autoregressions of up to 30 samples, their order by the corrected criterion of Akaike, and white noise upon an
Ornstein-Uhlenbeck drift compete; each may have innovations with a t distribution. White noise and drifts may grow with
the slope, as where time stamps are off, and the drift with the level, as that of a gain. The least criterion wins.

A shape is that of noise whose innovations have variance 1; samples may weigh differently (``weights``, 1 for plain
normal noise), which is how heavy tails enter: a t distribution is a normal one whose variance is itself drawn.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from ppafo.identification.trajectory.residuals import Floats
from ppafo.identification.trajectory.sample_loops import sample_loops

_QUADRATURE = 12
_TABLE = (1.0, 200.0, 60)
_LEAST_VARIANCE = 1.0e-300


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


FREEDOMS = np.array([1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 7.0, 10.0, 15.0, 25.0, 50.0, 100.0])
"""Degrees of freedom of a t distribution that are tried; more cannot be distinguished from a normal one."""

MAXIMUM_ORDER = 30
_HEAVY_ORDERS = (0, 1, 2, 3, 5, 8, 12, 20)
_SAMPLES_FOR_EACH, _NUMBERS_OF_DRIFT = 8, 2
_HEAVY = 4.0
"""Log likelihood that a t distribution must gain before tails are called heavy."""
_UNEQUAL = 5.0
"""Standard errors by which the levels of two recordings differ before each gets its own."""
_ERROR_OF_LEVEL = 1.2
_REWEIGHED = 6
_ROUNDS_OF_T = 12
_LARGE_PRODUCT = 1.0e100
_LEAST = 1.0e-30
LOG_RATIO = (-20.0, 12.0)
LOG_JITTER = (math.log(1.0e-9), math.log(0.1))
_LEAST_JITTER = 3.0e-5
"""Time [s] below which stamps that are off look like a model that is a little wrong where it is steepest: that is said
to be a misfit, for it may be one, and hardly any clock is so good and yet noisy."""
_JITTER = 2.0
"""Standard errors of the score of jitter from which it is tried."""
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

    Each channel in turn tells how late a sample was, in standard deviations, and the next is freed of it.
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


def sensor_noise(segments: Sequence[Floats], is_given: bool = False, courses: Sequence[Course] = ()) -> SensorNoise:
    """Return the noise [-] that explains a sensor's residuals best; ``is_given`` says that its size is at least 1.

    With the ``courses`` of its recordings it may grow with slope and level.
    """
    whole = np.concatenate(segments)
    white = from_reflections(np.zeros(0))
    if float(np.mean(whole * whole)) < max(_LEAST, 1.0 if is_given else 0.0):
        level, count = 1.0 if is_given else math.sqrt(_LEAST), len(whole)
        likelihood = -0.5 * float(whole @ whole) / level**2 - count * (math.log(level) + 0.5 * math.log(2.0 * math.pi))
        return SensorNoise(white, np.full(len(segments), level), is_fixed=True, likelihood=likelihood)
    levels = _relative_levels(segments)
    scaled = [one / level for one, level in zip(segments, levels, strict=True)]
    is_shared = bool(np.all(levels == 1.0))
    drift = max((_drift(scaled, is_zeroed) for is_zeroed in (False, True)), key=lambda one: one.likelihood)
    plain = [_autoregression(scaled), drift]
    growing = _growing(scaled, courses, levels, plain)
    best = min((*plain, *growing), key=lambda one: _criterion(one.likelihood, one.numbers, len(whole)))
    candidates = [*plain, *growing]
    if any(_gain_of_tails(one, scaled) > _HEAVY for one in ([best] if best.grows else plain)):
        candidates += [_heavy_autoregression(scaled, plain[0]), _heavy_drift(scaled, drift)]
    count = len(whole)

    def criterion_beside_drifts(one: SensorNoise) -> float:
        # The best of so many orders is now and then better than a drift that is there, by chance, and intervals are
        # then too narrow: a number that an autoregression has more than a drift costs what Schwarz's criterion takes.
        more = max(0, one.shape.order - _NUMBERS_OF_DRIFT) if isinstance(one.shape, AutoRegression) else 0
        return _criterion(one.likelihood, one.numbers, count) + (math.log(count) - 2.0) * more

    best = min(candidates, key=criterion_beside_drifts)
    likelihood = best.likelihood - sum(len(one) * math.log(level) for one, level in zip(segments, levels, strict=True))
    return replace(best, levels=best.levels * levels, is_shared=is_shared, likelihood=likelihood)


def sample_weights(noise: SensorNoise, segments: Sequence[Floats]) -> list[Floats]:
    """Return how much each sample counts [-]: 1 for normal noise, less where a heavy tail threw it far."""
    if not noise.is_heavy:
        return [np.ones(len(one)) for one in segments]
    return [
        _heavy_weights(noise.shape, one / level, noise.freedom)
        for one, level in zip(segments, noise.levels, strict=True)
    ]


def errors_of(shape: Shape, segment: Floats) -> Floats:
    """Return the whitened samples [-] with all weights 1."""
    return shape.rows(segment[:, None], np.ones(len(segment)))[0][:, 0]


def t_likelihood(errors: Floats, freedoms: Floats) -> Floats:
    """Return the log likelihood [-] of errors under t distributions of scale 1, one for each of ``freedoms``."""
    from scipy.special import gammaln

    half = 0.5 * freedoms
    constant = gammaln(half + 0.5) - gammaln(half) - 0.5 * np.log(freedoms * np.pi)
    return np.asarray(len(errors) * constant - (half + 0.5) * _sums_of_logs(np.square(errors), freedoms))


def previous_samples(segment: Floats, order: int) -> Floats:
    """Return what predicts a sample [its unit], (samples after the first ``order``, order), the latest first."""
    windows = np.lib.stride_tricks.sliding_window_view(segment[:-1], order)
    return windows[:, ::-1]


def profile_likelihood(
    noise: SensorNoise, segments: Sequence[Floats], weights: Sequence[Floats]
) -> tuple[float, float]:
    """Return the log likelihood [-] at the best common level, and that level."""
    squares, logs, count = 0.0, 0.0, 0
    for number, (one, weight) in enumerate(zip(segments, weights, strict=True)):
        square, spread = noise.square(one, weight, number)
        squares, logs, count = squares + square, logs + spread, count + len(one)
    variance = max(squares / count, _LEAST)
    return -0.5 * count * (math.log(2.0 * math.pi * variance) + 1.0) - logs, math.sqrt(variance)


def drift_of(numbers: Floats | tuple[float, float], is_zeroed: bool) -> Drift:
    """Return the drift with these logarithms of the ratio [-] and of the memory in samples."""
    return Drift(math.exp(float(numbers[0])), math.exp(-math.exp(-float(numbers[1]))), is_zeroed)


def longest_memory(segments: Sequence[Floats], is_heavy: bool) -> float:
    """Return the logarithm of the longest memory [samples] of a drift that is tried, with heavy tails or without."""
    return math.log((1.0 if is_heavy else 50.0) * max(len(one) for one in segments))


def _criterion(likelihood: float, numbers: int, count: int) -> float:
    return -2.0 * likelihood + 2.0 * numbers * count / max(1.0, count - numbers - 1.0)


def _of(shape: Shape, level: float, parts: int, likelihood: float, freedom: float = math.inf) -> SensorNoise:
    numbers = shape.order + 1 + math.isfinite(freedom)
    return SensorNoise(shape, np.full(parts, level), freedom, likelihood=likelihood, numbers=numbers)


def _relative_levels(segments: Sequence[Floats]) -> Floats:
    """Return the level of each recording over that of all; 1 where they do not differ for certain."""
    if len(segments) == 1:
        return np.ones(1)
    reflections, _ = reflections_of(list(segments), min(1, min(len(one) for one in segments) - 2))
    shape = from_reflections(reflections)
    sizes = np.array([np.log(max(float(np.median(np.abs(errors_of(shape, one)))), _LEAST)) for one in segments])
    errors = np.array([_ERROR_OF_LEVEL / math.sqrt(len(one)) for one in segments])
    middle = np.average(sizes, weights=1.0 / errors**2)
    differ = np.max(np.abs(sizes - middle) / errors)
    return np.exp(sizes - middle) if differ > _UNEQUAL else np.ones(len(segments))


def _autoregression(segments: list[Floats]) -> SensorNoise:
    """Return the autoregression with normal innovations whose order has the least criterion."""
    count, shortest = sum(len(one) for one in segments), min(len(one) for one in segments)
    most = max(0, min(MAXIMUM_ORDER, count // _SAMPLES_FOR_EACH, shortest - 2))
    reflections, left = reflections_of(segments, most)
    scores = [_criterion(-0.5 * count * math.log(left[order]), order + 1, count) for order in range(most + 1)]
    return _at_best_level(_unscaled(from_reflections(reflections[: int(np.argmin(scores))]), segments), segments)


def _unscaled(shape: Shape, segments: Sequence[Floats]) -> SensorNoise:
    return SensorNoise(shape, np.ones(len(segments)))


def _at_best_level(noise: SensorNoise, segments: Sequence[Floats]) -> SensorNoise:
    """Return normal noise of a shape at its best common level, with what the criterion needs."""
    likelihood, level = profile_likelihood(noise, segments, [np.ones(len(one)) for one in segments])
    numbers = noise.shape.order + 1 + (noise.jitter > 0.0)
    return replace(noise, levels=np.full(len(segments), level), likelihood=likelihood, numbers=numbers)


def _drift(segments: list[Floats], is_zeroed: bool) -> SensorNoise:
    """Return the drift of greatest likelihood, with white normal noise upon it."""
    grid = [np.array([ratio, memory]) for ratio in (-9.0, -6.0, -3.0, 0.0) for memory in (1.5, 3.5, 5.5)]
    return _best_from(grid, _unscaled(Drift(1.0, 0.5, is_zeroed), segments), segments)


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


def _best_from(grid: Sequence[Floats], noise: SensorNoise, segments: Sequence[Floats]) -> SensorNoise:
    """Return the noise of greatest likelihood whose numbers are searched from the best of a grid."""
    from scipy.optimize import minimize

    ones, longest = [np.ones(len(one)) for one in segments], longest_memory(segments, is_heavy=False)

    def inside(numbers: Floats) -> tuple[Floats, float]:
        within = numbers.copy()
        if isinstance(noise.shape, Drift):
            within[:2] = _within(numbers, longest)[0]
        if noise.jitter > 0.0:
            within[-1] = min(max(float(numbers[-1]), LOG_JITTER[0]), LOG_JITTER[1])
        return within, float(np.sum(np.square(numbers - within)))

    def cost(numbers: Floats) -> float:
        within, away = inside(numbers)
        return away - profile_likelihood(with_numbers(noise, within), segments, ones)[0]

    start = min(grid, key=cost)
    options = {"xatol": 0.05, "fatol": 0.02, "maxfev": 60 * len(start)}
    found = minimize(cost, start, method="Nelder-Mead", options=options)
    return _at_best_level(with_numbers(noise, inside(found.x)[0]), segments)


def _growing(
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
    best = min(plain, key=lambda one: _criterion(one.likelihood, one.numbers, count))
    drift = next(one for one in plain if isinstance(one.shape, Drift))
    found = []
    if best.shape.order > 0 and any(one.level.any() for one in scaled):
        grid = [numbers_of(drift), *(np.array([ratio, 5.5]) for ratio in (-9.0, -6.0, -3.0))]
        for is_zeroed in (False, True):
            gain = replace(_unscaled(Drift(1.0, 0.5, is_zeroed), segments), has_gain=True, courses=scaled)
            found.append(_best_from(grid, gain, segments))
        found = [max(found, key=lambda one: one.likelihood)]
    errors = np.concatenate([errors_of(best.shape, one) for one in segments]) / best.levels[0]
    uneven = np.concatenate([np.square(one.slope) for one in scaled])
    uneven -= uneven.mean()
    spread = math.sqrt(2.0 * float(uneven @ uneven))
    if spread > 0.0 and float(uneven @ np.square(errors)) > _JITTER * spread:
        white = replace(_unscaled(from_reflections(np.zeros(0)), segments), courses=scaled)
        steepest = math.sqrt(max(float(np.max(np.square(one.slope))) for one in scaled))
        sizes = [math.log(size / steepest) for size in (0.5, 2.0, 8.0, 30.0)]
        found += [
            _best_from(
                [np.append(numbers_of(one), size) for size in sizes],
                replace(one, jitter=1.0, courses=scaled),
                segments,
            )
            for one in (white, drift, *found)
        ]
    return [one for one in found if one.jitter == 0.0 or one.jitter >= _LEAST_JITTER]


def _within(numbers: Floats, longest: float) -> tuple[tuple[float, float], float]:
    """Return the logarithms of a drift inside their bounds, and the square of the distance to them."""
    ratio, memory = float(numbers[0]), float(numbers[1])
    inside = min(max(ratio, LOG_RATIO[0]), LOG_RATIO[1]), min(max(memory, 0.0), longest)
    return inside, (ratio - inside[0]) ** 2 + (memory - inside[1]) ** 2


def _gain_of_tails(noise: SensorNoise, segments: Sequence[Floats]) -> float:
    """Return the log likelihood that the best t distribution of the innovations gains over a normal one."""
    rows = [noise.rows(one[:, None], np.ones(len(one)), number)[0] for number, one in enumerate(segments)]
    errors = np.concatenate(rows)[:, 0] / noise.levels[0]
    likelihoods, _ = _fit_scaled_t(errors)
    normal = -0.5 * len(errors) * (math.log(2.0 * math.pi * float(np.mean(errors * errors))) + 1.0)
    return float(likelihoods.max() - normal)


def _fit_scaled_t(errors: Floats) -> tuple[Floats, Floats]:
    """Return log likelihood and best scale for each of the degrees of freedom that are tried."""
    from scipy.special import gammaln

    squares, count = np.square(errors), len(errors)
    variances = np.full(len(FREEDOMS), float(np.median(squares)) / 0.45 + _LEAST)
    sample_loops().scales_of_t(squares, FREEDOMS, variances, _ROUNDS_OF_T)
    logs = _sums_of_logs(squares, FREEDOMS * variances)
    half = 0.5 * FREEDOMS
    constant = gammaln(half + 0.5) - gammaln(half) - 0.5 * np.log(FREEDOMS * np.pi)
    likelihoods = count * (constant - 0.5 * np.log(variances)) - (half + 0.5) * logs
    return np.asarray(likelihoods), np.sqrt(variances)


def _sums_of_logs(squares: Floats, scales: Floats) -> Floats:
    """Return the sum of log(1 + square / scale) for each scale."""
    totals = np.empty(len(scales))
    sample_loops().sums_of_logs(squares, scales, totals, _LARGE_PRODUCT)
    return totals


def _heavy_autoregression(segments: list[Floats], normal: SensorNoise) -> SensorNoise:
    """Return the autoregression with t innovations whose order has the least criterion."""
    count, shortest = sum(len(one) for one in segments), min(len(one) for one in segments)
    most = min(count // _SAMPLES_FOR_EACH, shortest - 2)
    orders = sorted({order for order in (*_HEAVY_ORDERS, normal.shape.order) if order <= most})
    found = [_heavy_of_order(segments, order) for order in orders]
    return min(found, key=lambda one: _criterion(one.likelihood, one.numbers, count))


def _heavy_of_order(segments: list[Floats], order: int) -> SensorNoise:
    reflections, _ = reflections_of(segments, order)
    shape = from_reflections(reflections)
    for _ in range(_REWEIGHED):
        likelihoods, levels = _fit_scaled_t(np.concatenate([errors_of(shape, one) for one in segments]))
        best = int(np.argmax(likelihoods))
        if order == 0:
            break
        weights = [_heavy_weights(shape, one / levels[best], FREEDOMS[best]) for one in segments]
        shape = from_coefficients(regression_of(segments, weights, order)[0]) or shape
    logs = sum(shape.square(one, np.ones(len(one)))[1] for one in segments)
    return _of(shape, float(levels[best]), len(segments), float(likelihoods[best]) - logs, float(FREEDOMS[best]))


def regression_of(segments: Sequence[Floats], weights: Sequence[Floats], order: int) -> tuple[Floats, Floats]:
    """Return the coefficients [-] of an autoregression by weighted least squares, and their precision at level 1."""
    precision, product = np.zeros((order, order)), np.zeros(order)
    for one, weight in zip(segments, weights, strict=True):
        before, after = previous_samples(one, order), weight[order:]
        precision += before.T @ (after[:, None] * before)
        product += before.T @ (after * one[order:])
    precision += _LEAST * np.eye(order)
    return np.asarray(np.linalg.solve(precision, product), dtype=np.float64), precision


def _heavy_drift(segments: list[Floats], normal: SensorNoise) -> SensorNoise:
    """Return the drift upon which white noise has a t distribution, by a filter that sums normal distributions."""
    from scipy.optimize import minimize

    longest, white = longest_memory(segments, is_heavy=True), normal.shape
    assert isinstance(white, Drift)

    def cost(numbers: Floats) -> float:
        inside, away = _within(numbers, longest)
        shape = drift_of(inside, white.is_zeroed)
        level, freedom = math.exp(numbers[2]), 1.5 + math.exp(min(float(numbers[3]), 5.0))
        return away - sum(shape.heavy_likelihood(one, level, freedom) for one in segments)

    memory = -math.log(-math.log(white.memory))
    start = np.array([math.log(white.ratio) + 1.0, memory, math.log(normal.levels[0]) - 0.4, 0.7])
    simplex = np.vstack([start, start + np.diag([1.0, 0.7, -0.4, 0.7])])
    options = {"xatol": 0.05, "fatol": 0.05, "maxfev": 220, "initial_simplex": simplex}
    found = minimize(cost, start, method="Nelder-Mead", options=options)
    freedom = 1.5 + math.exp(min(float(found.x[3]), 5.0))
    shape = drift_of(_within(found.x, longest)[0], white.is_zeroed)
    return _of(shape, math.exp(found.x[2]), len(segments), -cost(found.x), freedom)


def _heavy_weights(shape: Shape, segment: Floats, freedom: float) -> Floats:
    """Return the expected precision of each sample; ``segment`` is over the level."""
    if isinstance(shape, AutoRegression):
        return np.asarray((freedom + 1.0) / (freedom + np.square(errors_of(shape, segment))))
    weights, nothing = np.ones(len(segment)), np.zeros(len(segment))
    for _ in range(_REWEIGHED):
        path, spread = shape.path(segment, weights, nothing)
        weights = (freedom + 1.0) / (freedom + np.square(segment - path) + spread)
    return weights
