"""Draws from the distributions of a study, as columns of values; draw number j is the same in any order of requests.

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
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import StudyError
from ppafo.simulation.numbers import NOISE_SEED
from ppafo.simulation.scenario import LARGEST_SEED, Scenario, sensor_noise
from ppafo.studies.distributions import Distribution, Floats
from ppafo.studies.study import RandomValue, SamplingPlan, Study, with_followers

# Limits of the number of draws: two per replicate, and the largest number with balanced Sobol replicates.
FEWEST_DRAWS = 32
MAXIMUM_DRAWS = 2**26
# Few enough that each keeps the evenness of a Sobol sequence, enough for Student's interval (2.13 for 95 %).
REPLICATES = 16
"""Number of independent scrambles of the Sobol sequence to which draws are assigned in turn."""
NOISE_DRAWS = 512
"""Largest number of draws repeated with another noise seed, for the noise fraction of the variance to a few percent."""
MAXIMUM_SOBOL_DIMENSIONS = 21201
"""Largest number of dimensions with direction numbers in SciPy (Joe and Kuo, 2008)."""
_ROUNDS = 6
"""Rounds of a Feistel network: four are a pseudo-random permutation (Luby and Rackoff, 1988), six leave a margin."""
_WORDS_PER_STEP = 4
"""Number of 64-bit words from one step of Philox."""
_FRACTION_BITS = 53
"""Bits of a float's significand, including the implicit one."""
_SMALLEST = 2.0**-_FRACTION_BITS
"""Distance of a uniform number from 0 and 1 at least, whose normal scores would be infinite."""
_SOBOL_BITS = 32
"""Number of bits of a Sobol sequence, which repeats after 2**32 draws."""
_ENGINES: dict[tuple[int, int], Any] = {}
"""SciPy's Sobol engines by seed and dimensions, at their last position."""
_LOCK = threading.Lock()
_MAXIMUM_ENGINES = 64
"""Number of cached engines; the oldest one is dropped first."""
_LEAST_SPREAD = 1.0e-6
"""Smallest conditional standard deviation of a normal score, given the others, for a positive definite correlation."""
_NOISE_LEVELS = {"sensors.angle_noise", "sensors.pressure_noise", "sensors.force_noise"}
_KEY = 1
"""Seed of the permutation that maps a noise seed to the seed of another noise stream."""
Words = NDArray[np.uint64]
Factor = tuple[tuple[float, ...], ...]
Columns = dict[str, Floats]


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Distributions of varied paths, and the Cholesky factor of their correlated normal scores (None: uncorrelated).

    ``same`` maps a path to the path whose draws it shares. Paths in ``gauge`` hold gauge pressures relative to the
    atmosphere of each run.
    """

    drawn: tuple[RandomValue, ...]
    scores: Factor | None = None
    same: Mapping[str, str] = field(default_factory=dict)
    gauge: frozenset[str] = frozenset()

    @property
    def paths(self) -> tuple[str, ...]:
        """Varied paths that have a distribution."""
        return tuple(drawn.path for drawn in self.drawn)

    @property
    def has_noise(self) -> bool:
        """True if each draw has its own seed of the sensor noise."""
        return NOISE_SEED in self.paths

    def columns(self, uniform: Floats) -> Columns:
        """Return values [SI] (draws,) by path from uniform numbers in (0, 1), shape (draws, paths)."""
        if self.scores is not None:
            from scipy.special import ndtr, ndtri

            scores = ndtri(uniform)
            columns = []
            for row in self.scores:
                # Term by term: the rounding of a matrix product may depend on the number of draws.
                total = row[0] * scores[:, 0]
                for column in range(1, len(row)):
                    if row[column] != 0.0:
                        total = total + row[column] * scores[:, column]
                columns.append(total)
            uniform = np.clip(ndtr(np.stack(columns, axis=1)), _SMALLEST, 1.0 - _SMALLEST)
        rows = zip(self.drawn, np.ascontiguousarray(uniform.T), strict=True)
        return with_followers({number.path: number.distribution.values(row) for number, row in rows}, self.same)

    def random_columns(self, first: int, count: int, seed: int) -> Columns:
        """Return independent draws ``first`` to ``first + count - 1`` of the sequence given by ``seed``."""
        sample = SamplingPlan("random", first + count, seed)
        return self.columns(uniform_numbers(sample, len(self.drawn), first, count))

    def replicated_columns(self, count: int, seed: int) -> Columns:
        """Return ``count`` draws of randomised Sobol replicates, and the first of them again with other sensor noise.

        Draw j is point j // REPLICATES of scramble j % REPLICATES. The scrambles are independent, so that the spread
        between their means estimates the error of a mean (Owen, 1997). Without noise nothing follows the draws.
        """
        # Dealt out in turn: any number of draws from the start has all replicates to within one draw.
        uniform = np.empty((count, len(self.drawn)))
        for replicate in range(min(REPLICATES, count)):
            own = slice(replicate, count, REPLICATES)
            length = len(range(count)[own])
            sample = SamplingPlan("sobol", length, replicate_seed(seed, replicate))
            uniform[own] = uniform_numbers(sample, len(self.drawn), 0, length)
        columns = self.columns(uniform)
        if not self.has_noise:
            return columns
        again = {path: column[:NOISE_DRAWS] for path, column in columns.items()}
        again[NOISE_SEED] = other_noise(again[NOISE_SEED])
        return {path: np.concatenate([column, again[path]]) for path, column in columns.items()}

    def with_noise_of(self, scenarios: Iterable[Scenario], paths: Sequence[str] = ()) -> "Uncertainty":
        """Return the distributions with an independent noise seed for each draw, if any of the scenarios has noise.

        ``paths`` are further varied paths; a seed among all of them is left unchanged.
        """
        varied = {*self.paths, *paths}
        # An open-loop controller uses no sensor; levels may be arrays (runs,).
        closed = [scenario for scenario in scenarios if not scenario.controller.is_open_loop]
        is_noisy = any(np.any(np.asarray(sensor_noise(scenario)) > 0.0) for scenario in closed)
        if NOISE_SEED in varied or not (is_noisy or (closed and varied & _NOISE_LEVELS)):
            return self
        noise = RandomValue(NOISE_SEED, Distribution("whole_numbers", (0.0, float(LARGEST_SEED))))
        alone = (*(0.0,) * len(self.drawn), 1.0)
        scores = self.scores
        factor = None if scores is None else (*((*row, 0.0) for row in scores), alone)
        return replace(self, drawn=(*self.drawn, noise), scores=factor)


def uncertainty_of(study: Study) -> Uncertainty:
    """Return the distributions of a study; StudyError if it has none, or has a grid, which has no probabilities."""
    # A grid has values and no probabilities: a mean over it would be of the grid, not of the device.
    if study.axes:
        raise StudyError(
            f"study '{study.name}': '{study.axes[0].path}' is varied over a grid or list, which has no probabilities"
        )
    if not study.drawn:
        raise StudyError(f"study '{study.name}': no value has a distribution")
    return Uncertainty(study.drawn, study.scores, study.same, study.gauge)


def seeds_of_noise(scenarios: Iterable[Scenario], paths: Sequence[str], count: int, seed: int) -> Floats:
    """Return seeds of the first ``count`` noise streams (streams,) of the sequence given by ``seed``.

    The array is empty if no controller of the scenarios receives noise, or if the noise is among the varied ``paths``.
    """
    noise = Uncertainty(()).with_noise_of(scenarios, paths)
    return noise.random_columns(0, count, seed)[NOISE_SEED] if noise.has_noise else np.zeros(0)


def replicate_seed(seed: int, replicate: int) -> int:
    """Return the seed of one replicate, independent of the seeds of the others."""
    return int(np.random.SeedSequence([seed, replicate]).generate_state(1, np.uint64)[0])


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
    # Middles of 2**53 equal cells.
    top = (words >> np.uint64(64 - _FRACTION_BITS)).astype(np.float64)
    uniform = np.clip((top + 0.5) * _SMALLEST, None, 1.0 - _SMALLEST)
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
    result = numbers.copy()
    outside = np.arange(numbers.size)
    # The network permutes a power of four of numbers, so those that end above the size go through it again.
    while outside.size:
        left = result[outside] >> half
        right = result[outside] & mask
        for key in keys:
            left, right = right, left ^ (_mix(right ^ key) & mask)
        result[outside] = (left << half) | right
        outside = outside[result[outside] >= size]
    return result


def _mix(words: Words) -> Words:
    words = (words ^ (words >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    words = (words ^ (words >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return words ^ (words >> np.uint64(31))


def other_noise(seeds: Floats) -> Floats:
    """Return the seed of another noise stream for each seed."""
    return permute(seeds.astype(np.uint64), LARGEST_SEED + 1, _KEY, 0).astype(np.float64)


def cholesky_factor(matrix: Floats) -> Factor | None:
    """Return the lower Cholesky factor of a correlation matrix, row by row; None if not positive definite."""
    try:
        factor = np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return None
    is_definite = float(np.min(np.diag(factor), initial=1.0)) >= _LEAST_SPREAD
    return tuple(map(tuple, factor.tolist())) if is_definite else None
