"""Uniform random numbers for draws; draw number j is the same in any order of requests.

Random numbers come from Philox, a generator that can start anywhere (Salmon et al., SC 2011). SciPy's Sobol sequence
can only be advanced forward, so its engines and their positions are cached. SciPy's Latin hypercube stores all draws in
memory at once; here the order of the strata is a permutation of 0 .. n - 1 that maps one number without computing the
others: a Feistel network on the next even number of bits, applied repeatedly until the result is below n (cycle
walking; Black and Rogaway, CT-RSA 2002). Words are mixed as in SplitMix64 (Steele et al., OOPSLA 2014).

Correlations apply to normal scores: a Gaussian copula, which leaves each distribution unchanged.

A scenario has a fixed seed, so that a single run can be repeated. A result about a device must not depend on a single
noise realisation: with noisy sensors, every draw gets its own noise stream.
"""

import threading
import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.simulation.numbers import NOISE_SEED
from ppafo.simulation.scenario import LARGEST_SEED, Scenario, sensor_noise
from ppafo.studies.distributions import Distribution, Floats
from ppafo.studies.study import RandomValue, SamplingPlan

Words = NDArray[np.uint64]
Factor = tuple[tuple[float, ...], ...]
_ROUNDS = 6
"""Rounds of a Feistel network: four are a pseudo-random permutation (Luby and Rackoff, 1988), six leave a margin."""
_WORDS_PER_STEP = 4
"""Number of 64-bit words from one step of Philox."""
_FRACTION_BITS = 53
"""Bits of a float's significand, including the implicit one."""
_SOBOL_BITS = 32
"""Number of bits of a Sobol sequence, which repeats after 2**32 draws."""
MAXIMUM_SOBOL_DIMENSIONS = 21201
"""Largest number of dimensions with direction numbers in SciPy (Joe and Kuo, 2008)."""
_ENGINES: dict[tuple[int, int], Any] = {}
"""SciPy's Sobol engines by seed and dimensions, at their last position."""
_LOCK = threading.Lock()
_MAXIMUM_ENGINES = 64
"""Number of cached engines; the oldest one is dropped first."""
_LEAST_SPREAD = 1.0e-6
"""Smallest conditional standard deviation of a normal score, given the others, for a positive definite correlation."""
_NOISE_LEVELS = ("sensors.angle_noise", "sensors.pressure_noise", "sensors.force_noise")
_KEY = 1
"""Seed of the permutation that maps a noise seed to the seed of another noise stream."""
NOISE_DRAWS = 512
"""Largest number of draws repeated with another noise seed, for the noise fraction of the variance to a few percent."""


def uniform_numbers(sample: SamplingPlan, dimensions: int, first: int, count: int) -> Floats:
    """Return uniform random numbers in (0, 1), shape (count, dimensions), for the draws from ``first`` on."""
    if sample.method == "sobol":
        from scipy.stats import qmc

        key = (sample.seed, dimensions)
        with _LOCK:
            engine = _ENGINES.get(key)
            if engine is None or engine.num_generated > first:
                engine = qmc.Sobol(dimensions, scramble=True, bits=_SOBOL_BITS, rng=np.random.default_rng(sample.seed))
                _ENGINES[key] = engine
                if len(_ENGINES) > _MAXIMUM_ENGINES:
                    del _ENGINES[next(iter(_ENGINES))]
            if first > engine.num_generated:
                engine.fast_forward(first - engine.num_generated)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # that a stretch of the sequence is no power of two
                return np.asarray(engine.random(count)) + 2.0 ** -(_SOBOL_BITS + 1)
    # Philox numbers: a draw takes a whole number of its steps of four words.
    steps = -(-dimensions // _WORDS_PER_STEP)
    generator = np.random.Philox(key=sample.seed)
    generator.advance(first * steps)
    words = np.asarray(generator.random_raw(count * steps * _WORDS_PER_STEP), dtype=np.uint64)
    # Middles of 2**53 equal cells: neither 0 nor 1 is drawn, whose normal scores would be infinite.
    top = (words >> np.uint64(64 - _FRACTION_BITS)).astype(np.float64)
    uniform = np.clip((top + 0.5) * 2.0**-_FRACTION_BITS, None, 1.0 - 2.0**-_FRACTION_BITS)
    uniform = uniform.reshape(count, steps * _WORDS_PER_STEP)[:, :dimensions]
    if sample.method != "latin_hypercube":
        return uniform
    # A Latin hypercube: in every dimension each of the ``runs`` strata holds one draw.
    draws = np.arange(first, first + count, dtype=np.uint64)
    strata = np.stack([permute(draws, sample.runs, sample.seed, axis) for axis in range(dimensions)], axis=1)
    return (strata.astype(np.float64) + uniform) / sample.runs


def permute(numbers: Words, size: int, seed: int, stream: int) -> Words:
    """Return the images of numbers below ``size`` under a pseudo-random permutation given by seed and stream."""
    half = np.uint64(max(1, -(-(size - 1).bit_length() // 2)))
    keys = _mix(np.arange(1, _ROUNDS + 1, dtype=np.uint64) + np.uint64((seed << 24) + (stream << 8)))
    mask = (np.uint64(1) << half) - np.uint64(1)
    result, outside = numbers.copy(), np.arange(numbers.size)
    # The network permutes a power of four of numbers, so those that end above the size go through it again.
    while outside.size:
        left, right = result[outside] >> half, result[outside] & mask
        for key in keys:
            left, right = right, left ^ (_mix(right ^ key) & mask)
        result[outside] = (left << half) | right
        outside = outside[result[outside] >= size]
    return result


def _mix(words: Words) -> Words:
    words = (words ^ (words >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    words = (words ^ (words >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return words ^ (words >> np.uint64(31))


def cholesky_factor(matrix: Floats) -> Factor | None:
    """Return the lower Cholesky factor of a correlation matrix, row by row; None if not positive definite."""
    try:
        factor = np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return None
    if float(np.min(np.diag(factor), initial=1.0)) < _LEAST_SPREAD:
        return None
    return tuple(tuple(float(number) for number in row) for row in factor)


def correlate(uniform: Floats, factor: Factor) -> Floats:
    """Return uniform numbers of the same shape (draws, paths) with correlated normal scores.

    Sums are term by term: the rounding of a matrix product may depend on the number of draws.
    """
    from scipy.special import ndtr, ndtri

    scores = ndtri(uniform)
    columns = []
    for row in factor:
        total = row[0] * scores[:, 0]
        for column in range(1, len(row)):
            if row[column] != 0.0:
                total = total + row[column] * scores[:, column]
        columns.append(total)
    smallest = 2.0**-53
    return np.asarray(np.clip(ndtr(np.stack(columns, axis=1)), smallest, 1.0 - smallest))


def with_noise(
    drawn: tuple[RandomValue, ...], scores: Factor | None, scenarios: Iterable[Scenario], paths: Sequence[str]
) -> tuple[tuple[RandomValue, ...], Factor | None]:
    """Return distributions and Cholesky factor with independent sensor noise appended, if any scenario has noise.

    ``paths`` are all varied paths; a seed among them is left unchanged.
    """
    # An open-loop controller uses no sensor; levels may be arrays (runs,).
    closed = [scenario for scenario in scenarios if not scenario.controller.is_open_loop]
    is_noisy = bool(closed) and any(path in _NOISE_LEVELS for path in paths)
    for scenario in closed:
        is_noisy = is_noisy or bool(np.any(np.asarray(sensor_noise(scenario)) > 0.0))
    if NOISE_SEED in paths or not is_noisy:
        return drawn, scores
    noise = RandomValue(NOISE_SEED, Distribution("whole_numbers", (0.0, float(LARGEST_SEED))))
    if scores is None:
        return (*drawn, noise), None
    alone = (*(0.0,) * len(drawn), 1.0)
    return (*drawn, noise), (*((*row, 0.0) for row in scores), alone)


def with_new_noise(columns: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return the first ``NOISE_DRAWS`` draws, each with another noise stream and otherwise unchanged."""
    first = {path: column[:NOISE_DRAWS] for path, column in columns.items()}
    return first | {NOISE_SEED: other_noise(first[NOISE_SEED])}


def other_noise(seeds: Floats) -> Floats:
    """Return the seed of another noise stream for each seed."""
    return permute(seeds.astype(np.uint64), LARGEST_SEED + 1, _KEY, 0).astype(np.float64)
