"""What recordings say of coordinates when the noise of each sensor is itself uncertain.

The model is taken as linear around its optimum. Noise and coordinates are then drawn in turn, each given the other
(Gibbs sampling): weights of samples where tails are heavy, coefficients of autoregressions, size and memory of drifts,
levels. Given the noise the coordinates are normal, so that the whole is a mixture of normal distributions.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.identification.noise.heavy_tails import sample_weights
from ppafo.identification.noise.sensor_noise import (
    LOG_JITTER,
    SensorNoise,
    numbers_of,
    profile_likelihood,
    with_numbers,
    without_common_stamps,
)
from ppafo.identification.noise.shapes import (
    LOG_RATIO,
    AutoRegression,
    Drift,
    errors_of,
    from_coefficients,
    from_reflections,
    longest_memory,
    regression_of,
)
from ppafo.identification.noise.t_distribution import FREEDOMS, t_likelihood
from ppafo.identification.trajectory.information import (
    LEAST,
    inverse_with_root,
    likelihood_without_columns,
    solution_with_root,
)
from ppafo.identification.trajectory.residuals import Floats

CHAINS, DRAWS, HEAVY_DRAWS, SETTLING = 2, 100, 300, 20
"""Chains, draws of each that count, the same where weights of samples are drawn too, and draws before them."""

_PROPOSALS, _SHOWN = 3, 10
_STEP = 0.3
_SHARE_OF_ERROR = 1.5
_FEW, _LARGEST = 3, 0.99999
"""Samples of an autoregression that is drawn with the columns left out, and its largest reflection coefficient."""


@dataclass(frozen=True, slots=True)
class LinearModel:
    """Slopes of the residuals of all samples and, as the last of ``columns``, the residuals themselves.

    The first columns are the coordinates of the fit, counted from its point; then come those of hum. ``sensors`` has,
    for each sensor, the places of its recordings among the samples. ``pull`` and ``precision`` (columns, columns) are
    the gradient and the curvature of half the square of the priors' residuals.
    """

    columns: Floats
    sensors: tuple[tuple[slice, ...], ...]
    pull: Floats
    precision: Floats

    @property
    def residuals(self) -> Floats:
        """Residuals [-] of the samples at the point, over their standard deviation."""
        return self.columns[:, -1]

    @property
    def slopes(self) -> Floats:
        """Slopes of the residuals [-] with respect to the coordinates."""
        return self.columns[:, :-1]

    def segments(self, values: Floats, sensor: int) -> list[Floats]:
        """Return the samples of a sensor, recording by recording, in the unit of the values."""
        return [values[place] for place in self.sensors[sensor]]


@dataclass(frozen=True, slots=True)
class Mixture:
    """Normal distributions of coordinates, counted from a point: means (parts, coordinates), covariances, a draw each.

    ``chain`` says to which chain of draws each part belongs.
    """

    means: Floats
    covariances: Floats
    draws: Floats
    chain: "np.ndarray[tuple[int], np.dtype[np.intp]]"

    @property
    def mean(self) -> Floats:
        """Mean of all coordinates, in their units."""
        return np.asarray(self.means.mean(axis=0))

    @property
    def covariance(self) -> Floats:
        """Covariance of all coordinates, in products of their units."""
        away = self.means - self.mean
        return np.asarray(self.covariances.mean(axis=0) + away.T @ away / len(away))

    def below(self, index: int, at: Floats) -> Floats:
        """Return the probability that a coordinate lies below each of some places."""
        from scipy.special import ndtr

        spread = np.sqrt(self.covariances[:, index, index])
        return np.asarray(ndtr((at[:, None] - self.means[:, index]) / spread).mean(axis=1))

    def quantile(self, index: int, fraction: float, low: float = -math.inf, high: float = math.inf) -> float:
        """Return the place below which a coordinate lies with a probability, given that it lies between two bounds."""
        from scipy.optimize import brentq

        first, last = self.below(index, np.array([low, high]))
        wanted = first + fraction * (last - first)
        error = 12.0 * math.sqrt(float(self.covariance[index, index]))
        ends = max(low, float(self.mean[index]) - error), min(high, float(self.mean[index]) + error)
        if not ends[0] < ends[1] or last - first < LEAST:
            return float(np.clip(self.mean[index], low, high))

        def away(place: float) -> float:
            return float(self.below(index, np.array([place]))[0] - wanted)

        if away(ends[0]) >= 0.0:
            return ends[0]
        return ends[1] if away(ends[1]) <= 0.0 else float(brentq(away, *ends, xtol=1.0e-6 * error))


@dataclass(frozen=True, slots=True)
class NoiseDraw:
    """One draw of the noise of all sensors, the weights of their samples, and where it puts the mean of all columns."""

    noises: tuple[SensorNoise, ...]
    weights: tuple[tuple[Floats, ...], ...]
    mean: Floats


def draw_posterior(
    model: LinearModel, noises: Sequence[SensorNoise], kept: int, seed: int, chains: int = CHAINS, count: int = DRAWS
) -> tuple[Mixture, tuple[NoiseDraw, ...]]:
    """Return the distribution of the first ``kept`` columns with the noise drawn anew each time, and some draws."""
    means, covariances, draws, chain = [], [], [], []
    shown = []
    for number in range(chains):
        random = np.random.default_rng([seed, number])
        states = [_State.of(noise, model, sensor) for sensor, noise in enumerate(noises)]
        for turn in range(SETTLING + count):
            states = _with_memory(model, states, random)
            mean, covariance, root = _distribution_given_noise(model, states)
            if turn >= SETTLING and turn % _SHOWN == 0:
                noise, weights = tuple(one.noise for one in states), tuple(one.weights for one in states)
                shown.append(NoiseDraw(noise, weights, mean))
            draw = mean + root @ random.standard_normal(len(mean))
            left = model.residuals + model.slopes @ draw
            states = [_draw_noise(model, state, sensor, draw, left, random) for sensor, state in enumerate(states)]
            if turn >= SETTLING:
                means.append(mean[:kept])
                covariances.append(covariance[:kept, :kept])
                draws.append(draw[:kept])
                chain.append(number)
    parts = Mixture(np.array(means), np.array(covariances), np.array(draws), np.array(chain, dtype=np.intp))
    return parts, tuple(shown)


def whiten(model: LinearModel, noises: Sequence[SensorNoise], weights: Sequence[Sequence[Floats]]) -> Floats:
    """Return the columns whitened by the noise of the sensors, of variance 1 [-] each."""
    found = np.zeros_like(model.columns)
    for places, noise, parts in zip(model.sensors, noises, weights, strict=True):
        for number, (place, level, weight) in enumerate(zip(places, noise.levels, parts, strict=True)):
            found[place] = noise.rows(model.columns[place], weight, number)[0] / level
    without_common_stamps(found, model.sensors, noises)
    return found


@dataclass(frozen=True, slots=True)
class _State:
    """The noise of one sensor as it is drawn now.

    ``weights`` are those of its samples, ``products`` those of all whitened columns with each other (the residuals
    last), ``spread`` the sum of the logarithms of what whitening divides by. A drift, or an autoregression of few
    samples, has ``numbers`` and the ``step`` of their proposals.
    """

    noise: SensorNoise
    weights: tuple[Floats, ...]
    products: Floats
    spread: float
    numbers: Floats
    step: Floats

    @classmethod
    def of(cls, noise: SensorNoise, model: LinearModel, sensor: int) -> "_State":
        """Return the state in which a chain begins."""
        segments = model.segments(model.residuals, sensor)
        weights = tuple(sample_weights(noise, segments))
        products = _products(model, noise, weights, sensor)
        numbers = np.zeros(0) if noise.is_fixed else _numbers_of(noise)
        if not numbers.size:
            return cls(noise, weights, *products, numbers, np.zeros((0, 0)))
        scaled = [one / level for one, level in zip(segments, noise.levels, strict=True)]
        step = (
            _proposal(numbers, noise, scaled, weights)
            if isinstance(noise.shape, Drift) or noise.grows
            else np.diag(_SHARE_OF_ERROR * np.cosh(numbers) / math.sqrt(sum(len(one) for one in scaled)))
        )
        return cls(noise, weights, *products, numbers, step)


def _numbers_of(noise: SensorNoise) -> Floats:
    """Return the numbers in which noise is drawn with the columns left out; none for a long autoregression."""
    shape = noise.shape
    if isinstance(shape, Drift) or noise.grows:
        return numbers_of(noise)
    last = [float(shape.predictors[stage, stage - 1]) for stage in range(1, shape.order + 1)]
    return np.arctanh(last) if 0 < shape.order <= _FEW else np.zeros(0)


def _noise_of(numbers: Floats, noise: SensorNoise, longest: float) -> tuple[SensorNoise, float] | None:
    """Return the noise with these numbers and the logarithm of its prior, None where the prior is 0.

    The prior is even in the reflection coefficients of an autoregression, and in the logarithm of the memory of a
    drift; then in the standard deviation of its steps or, where heavy tails hide more of it, in its whole variance. It
    is even in the jitter. Priors that favour smaller drifts make intervals too narrow.
    """
    if isinstance(noise.shape, Drift) or noise.grows:
        changed, prior = with_numbers(noise, numbers), 0.0
        if noise.jitter > 0.0:
            if not LOG_JITTER[0] <= numbers[-1] <= LOG_JITTER[1]:
                return None
            prior += float(numbers[-1])
        if isinstance(changed.shape, Drift):
            if not (LOG_RATIO[0] <= numbers[0] <= LOG_RATIO[1] and 0.0 <= numbers[1] <= longest):
                return None
            prior += math.log(changed.shape.stationary) if noise.is_heavy else 0.5 * float(numbers[0])
        return changed, prior
    reflections = np.tanh(numbers)
    if np.abs(reflections).max() > _LARGEST:
        return None
    return replace(noise, shape=from_reflections(reflections)), float(np.sum(np.log1p(-np.square(reflections))))


def _products(model: LinearModel, noise: SensorNoise, weights: Sequence[Floats], sensor: int) -> tuple[Floats, float]:
    """Return the products of the whitened columns of a sensor, and the logarithm of what they were divided by."""
    width = model.columns.shape[1]
    products, spread = np.zeros((width, width)), 0.0
    for number, (place, level, weight) in enumerate(zip(model.sensors[sensor], noise.levels, weights, strict=True)):
        rows, logarithm = noise.rows(model.columns[place], weight, number)
        products += rows.T @ rows / level**2
        spread += logarithm
    return products, spread


def _draw_noise(
    model: LinearModel, state: _State, sensor: int, draw: Floats, left: Floats, random: np.random.Generator
) -> _State:
    """Return the noise of a sensor drawn anew, given a draw of the columns and what is ``left``; its drift stays."""
    noise, segments = state.noise, model.segments(left, sensor)
    if noise.is_fixed:
        return state
    if noise.is_shared and not noise.is_heavy and (isinstance(noise.shape, Drift) or noise.shape.order <= _FEW):
        return _with_level(state, draw, sum(len(one) for one in segments), random)
    scaled = [one / level for one, level in zip(segments, noise.levels, strict=True)]
    weights = state.weights
    if noise.is_heavy:
        freedom, weights = _tails(noise, scaled, weights, random)
        noise = replace(noise, freedom=freedom)
    if isinstance(noise.shape, AutoRegression) and noise.shape.order > _FEW:
        noise = replace(noise, shape=_regression(noise.shape, scaled, weights, random))
    noise = _with_levels(noise, segments, weights, random)
    products, spread = _products(model, noise, weights, sensor)
    return replace(state, noise=noise, weights=weights, products=products, spread=spread)


def _with_level(state: _State, draw: Floats, count: int, random: np.random.Generator) -> _State:
    """Return the state with its one level drawn; the products of the columns have all that this needs."""
    whole = np.append(draw, 1.0)
    square = float(whole @ state.products @ whole)
    ratio = math.sqrt(0.5 * max(square, LEAST) / random.gamma(0.5 * count))
    noise = replace(state.noise, levels=state.noise.levels * ratio)
    return replace(state, noise=noise, products=state.products / ratio**2)


def _distribution_given_noise(model: LinearModel, states: Sequence[_State]) -> tuple[Floats, Floats, Floats]:
    """Return mean, covariance and a root of it of the columns given the noise."""
    if sum(state.noise.jitter > 0.0 for state in states) > 1:
        # Channels share their time stamps, and are no longer a sum.
        rows = whiten(model, [state.noise for state in states], [state.weights for state in states])
        products = rows.T @ rows
    else:
        products = np.sum([state.products for state in states], axis=0)
    mean, root = solution_with_root(products[:-1, :-1] + model.precision, products[:-1, -1] + model.pull)
    return -mean, root @ root.T, root


def _with_memory(model: LinearModel, states: Sequence[_State], random: np.random.Generator) -> list[_State]:
    """Return the states with the numbers of every shape that has few drawn; the columns are left out of that.

    Given the columns slow noise looks quicker than it is, for they have taken part of it, and would stay so for long.
    """
    found = list(states)
    for sensor, state in enumerate(states):
        if not state.numbers.size:
            continue
        others = np.sum([one.products for place, one in enumerate(found) if place != sensor], axis=0)
        longest = longest_memory(model.segments(model.residuals, sensor), state.noise.is_heavy)
        here = _noise_of(state.numbers, state.noise, longest)
        likelihood = _without_columns(model, others + state.products) - state.spread + (here[1] if here else 0.0)
        for turn in range(_PROPOSALS + _may_be_gain(state.noise)):
            numbers, kind = state.numbers, state.noise
            if turn < _PROPOSALS:
                numbers = numbers + state.step @ random.standard_normal(len(numbers))
            else:
                kind = _with_other_growth(kind, random)
            tried = _noise_of(numbers, kind, longest)
            if tried is None:
                continue
            noise = tried[0]
            products, spread = _products(model, noise, state.weights, sensor)
            other = _without_columns(model, others + products) - spread + tried[1]
            if math.log(random.random()) < other - likelihood:
                moved = replace(state, noise=noise, products=products, spread=spread, numbers=numbers)
                state, likelihood = moved, other  # noqa: PLW2901
        found[sensor] = state
    return found


def _may_be_gain(noise: SensorNoise) -> bool:
    """Return whether a drift of a sensor could be one of its gain instead, and the other way round."""
    return isinstance(noise.shape, Drift) and not noise.is_heavy and any(one.level.any() for one in noise.courses)


def _with_other_growth(noise: SensorNoise, random: np.random.Generator) -> SensorNoise:
    """Return a drift as one of the gain, or that of a gain as one of the sensor, which begins at 0 or anywhere."""
    assert isinstance(noise.shape, Drift)
    shape = replace(noise.shape, is_zeroed=bool(random.random() < 0.5))
    return replace(noise, shape=shape, has_gain=not noise.has_gain)


def _without_columns(model: LinearModel, products: Floats) -> float:
    """Return the log likelihood of noise with all columns integrated out, but for a constant."""
    whole = products.copy()
    whole[:-1, :-1] += model.precision
    whole[:-1, -1] += model.pull
    whole[-1, :-1] += model.pull
    return likelihood_without_columns(whole)


def _tails(
    noise: SensorNoise, scaled: Sequence[Floats], weights: Sequence[Floats], random: np.random.Generator
) -> tuple[float, tuple[Floats, ...]]:
    """Return degrees of freedom and weights; the weights are left out when the former are drawn."""
    errors = []
    for one, weight in zip(scaled, weights, strict=True):
        if isinstance(noise.shape, Drift):
            errors.append(one - noise.shape.path(one, weight, random.standard_normal(len(one)))[0])
        else:
            errors.append(errors_of(noise.shape, one))
    likelihoods = t_likelihood(np.concatenate(errors), FREEDOMS)
    chances = np.exp(likelihoods - likelihoods.max())
    freedom = float(random.choice(FREEDOMS, p=chances / chances.sum()))
    return freedom, tuple(
        random.gamma(0.5 * (freedom + 1.0), size=len(one)) * 2.0 / (freedom + np.square(one)) + LEAST for one in errors
    )


def _regression(
    shape: AutoRegression, scaled: Sequence[Floats], weights: Sequence[Floats], random: np.random.Generator
) -> AutoRegression:
    """Return coefficients drawn given all but the first samples, which then accept them or not."""
    mean, precision = regression_of(scaled, weights, shape.order)
    found = from_coefficients(mean + inverse_with_root(precision)[1] @ random.standard_normal(shape.order))
    if found is None:
        return shape
    gain = 0.0
    for one, weight in zip(scaled, weights, strict=True):
        new, old = (each.square(one[: shape.order], weight[: shape.order]) for each in (found, shape))
        gain += (-0.5 * new[0] - new[1]) - (-0.5 * old[0] - old[1])
    return found if math.log(random.random()) < gain else shape


def _proposal(numbers: Floats, noise: SensorNoise, scaled: Sequence[Floats], weights: Sequence[Floats]) -> Floats:
    """Return a root of the covariance of proposals, from the curvature of the likelihood of drift and jitter."""

    def at(move: Floats) -> float:
        return profile_likelihood(with_numbers(noise, numbers + _STEP * move), scaled, weights)[0]

    count = len(numbers)
    ways, middle = np.eye(count), at(np.zeros(count))
    curvature = np.diag([at(way) + at(-way) - 2.0 * middle for way in ways])
    for first in range(count):
        for second in range(first):
            both, apart = ways[first] + ways[second], ways[first] - ways[second]
            cross = 0.25 * (at(both) + at(-both) - at(apart) - at(-apart))
            curvature[first, second] = curvature[second, first] = cross
    values, vectors = np.linalg.eigh(-curvature / _STEP**2)
    return np.asarray(1.7 * vectors / np.sqrt(np.clip(values, 0.3, 1.0e4)))


def _with_levels(
    noise: SensorNoise, segments: Sequence[Floats], weights: Sequence[Floats], random: np.random.Generator
) -> SensorNoise:
    """Return the noise with its levels drawn, one for all recordings or one for each."""
    pairs = zip(segments, weights, strict=True)
    sums = np.array([noise.square(one, weight, number)[0] for number, (one, weight) in enumerate(pairs)])
    counts = np.array([float(len(one)) for one in segments])
    if noise.is_shared:
        level = math.sqrt(0.5 * sums.sum() / random.gamma(0.5 * counts.sum()))
        return replace(noise, levels=np.full(len(sums), level))
    return replace(noise, levels=np.sqrt(0.5 * sums / random.gamma(0.5 * counts)))
