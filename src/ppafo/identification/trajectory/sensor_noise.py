"""The noise of one sensor, from what its recordings leave unexplained: level, memory, drift, heavy tails.

Autoregressions of up to 30 samples, their order by the corrected criterion of Akaike, and white noise upon an
Ornstein-Uhlenbeck drift compete; each may have innovations with a t distribution. The least criterion wins.

A shape is that of noise whose innovations have variance 1; samples may weigh differently (``weights``, 1 for plain
normal noise), which is how heavy tails enter: a t distribution is a normal one whose variance is itself drawn.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
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


@dataclass(frozen=True, slots=True)
class SensorNoise:
    """Noise of a sensor: its shape, the level of each recording, degrees of freedom (infinite for normal tails).

    ``levels`` are in units of the given or first estimated noise; all equal where ``is_shared``. ``is_fixed`` is noise
    that was given and is not exceeded. The log ``likelihood`` and ``numbers`` are what the criterion is made of.
    """

    shape: Shape
    levels: Floats
    freedom: float = math.inf
    is_shared: bool = True
    is_fixed: bool = False
    likelihood: float = 0.0
    numbers: int = 1

    @property
    def is_heavy(self) -> bool:
        """Whether its tails are heavier than normal ones."""
        return math.isfinite(self.freedom)

    def in_words(self, interval: float) -> str:
        """Return what the noise is like; ``interval`` [s] is the time between two samples."""
        tails = f", heavy tails (t with {self.freedom:.2g} degrees of freedom)" if self.is_heavy else ""
        unequal = "" if self.is_shared else ", a level for each recording"
        if isinstance(self.shape, Drift):
            size, memory = math.sqrt(self.shape.stationary), -interval / math.log(self.shape.memory)
            return f"white and a drift of {size:.2g} times its size over {memory:.2g} s{tails}{unequal}"
        description = "white" if self.shape.order == 0 else f"autoregression of {self.shape.order}"
        return f"{description}{tails}{unequal}"


def sensor_noise(segments: Sequence[Floats], is_given: bool = False) -> SensorNoise:
    """Return the noise [-] that explains a sensor's residuals best; ``is_given`` says that its size is at least 1."""
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
    candidates = [_autoregression(scaled), drift]
    if any(_gain_of_tails(one, scaled) > _HEAVY for one in candidates):
        candidates += [_heavy_autoregression(scaled, candidates[0]), _heavy_drift(scaled, drift)]
    count = len(whole)

    def criterion_beside_drifts(one: SensorNoise) -> float:
        # The best of so many orders is now and then better than a drift that is there, by chance, and intervals are
        # then too narrow: a number that an autoregression has more than a drift costs what Schwarz's criterion takes.
        more = max(0, one.shape.order - _NUMBERS_OF_DRIFT) if isinstance(one.shape, AutoRegression) else 0
        return _criterion(one.likelihood, one.numbers, count) + (math.log(count) - 2.0) * more

    best = min(candidates, key=criterion_beside_drifts)
    likelihood = best.likelihood - sum(len(one) * math.log(level) for one, level in zip(segments, levels, strict=True))
    return SensorNoise(best.shape, best.levels * levels, best.freedom, is_shared, False, likelihood, best.numbers)


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


def profile_likelihood(shape: Shape, segments: Sequence[Floats], weights: Sequence[Floats]) -> tuple[float, float]:
    """Return the log likelihood [-] at the best common level, and that level."""
    squares, logs, count = 0.0, 0.0, 0
    for one, weight in zip(segments, weights, strict=True):
        square, spread = shape.square(one, weight)
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
    shape = from_reflections(reflections[: int(np.argmin(scores))])
    likelihood, level = profile_likelihood(shape, segments, [np.ones(len(one)) for one in segments])
    return _of(shape, level, len(segments), likelihood)


def _drift(segments: list[Floats], is_zeroed: bool) -> SensorNoise:
    """Return the drift of greatest likelihood, with white normal noise upon it."""
    from scipy.optimize import minimize

    ones, longest = [np.ones(len(one)) for one in segments], longest_memory(segments, is_heavy=False)

    def cost(numbers: Floats) -> float:
        inside, away = _within(numbers, longest)
        return away - profile_likelihood(drift_of(inside, is_zeroed), segments, ones)[0]

    grid = [np.array([ratio, memory]) for ratio in (-9.0, -6.0, -3.0, 0.0) for memory in (1.5, 3.5, 5.5)]
    start = min(grid, key=cost)
    found = minimize(cost, start, method="Nelder-Mead", options={"xatol": 0.05, "fatol": 0.02, "maxfev": 120})
    shape = drift_of(_within(found.x, longest)[0], is_zeroed)
    likelihood, level = profile_likelihood(shape, segments, ones)
    return _of(shape, level, len(segments), likelihood)


def _within(numbers: Floats, longest: float) -> tuple[tuple[float, float], float]:
    """Return the logarithms of a drift inside their bounds, and the square of the distance to them."""
    ratio, memory = float(numbers[0]), float(numbers[1])
    inside = min(max(ratio, LOG_RATIO[0]), LOG_RATIO[1]), min(max(memory, 0.0), longest)
    return inside, (ratio - inside[0]) ** 2 + (memory - inside[1]) ** 2


def _gain_of_tails(noise: SensorNoise, segments: Sequence[Floats]) -> float:
    """Return the log likelihood that the best t distribution of the innovations gains over a normal one."""
    errors = np.concatenate([errors_of(noise.shape, one) for one in segments]) / noise.levels[0]
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
