"""Uniform numbers of the draws from ``first`` on, in any order of asking: draw number j is always the same.

Random numbers come from Philox, a generator that can start anywhere (Salmon et al., SC 2011). SciPy's Sobol sequence
can only be wound forward, which is kept cheap by remembering where it stands. SciPy's Latin hypercube holds all draws
in memory at once; here the order of the strata is a permutation that can be asked number by number.
"""

import threading
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from ppafo.studies.sweep.sampling.distributions import Floats
from ppafo.studies.sweep.sampling.permutation import permuted
from ppafo.studies.sweep.study import Sample

_WORDS_PER_STEP = 4
_FRACTION_BITS = 53
_SOBOL_BITS = 32
MOST_SOBOL_DIMENSIONS = 21201
_MOST_ENGINES = 64
"""Wound engines that are remembered; the one that was made first goes first."""


def uniform_numbers(sample: Sample, dimensions: int, first: int, count: int) -> Floats:
    """Return numbers in (0, 1), shape (count, dimensions), for the draws from ``first`` on."""
    if sample.method == "sobol":
        return _sobol(sample, dimensions, first, count)
    uniform = _random(sample.seed, dimensions, first, count)
    if sample.method == "latin_hypercube":
        return _in_strata(uniform, sample, first)
    return uniform


def _random(seed: int, dimensions: int, first: int, count: int) -> Floats:
    """Return Philox numbers: a draw takes a whole number of its steps of four words."""
    steps = -(-dimensions // _WORDS_PER_STEP)
    generator = np.random.Philox(key=seed)
    generator.advance(first * steps)
    words = np.asarray(generator.random_raw(count * steps * _WORDS_PER_STEP), dtype=np.uint64)
    top = (words >> np.uint64(64 - _FRACTION_BITS)).astype(np.float64)
    uniform = np.clip((top + 0.5) * 2.0**-_FRACTION_BITS, None, 1.0 - 2.0**-_FRACTION_BITS)
    return uniform.reshape(count, steps * _WORDS_PER_STEP)[:, :dimensions]


def _in_strata(uniform: Floats, sample: Sample, first: int) -> Floats:
    """Return a Latin hypercube: in every dimension each of the ``runs`` strata holds one draw."""
    draws = np.arange(first, first + uniform.shape[0], dtype=np.uint64)
    strata = np.stack([permuted(draws, sample.runs, sample.seed, axis) for axis in range(uniform.shape[1])], axis=1)
    return (strata.astype(np.float64) + uniform) / sample.runs


@dataclass(slots=True)
class _Wound:
    """Scipy's Sobol engines by what made them, wound to where they were last asked."""

    engines: dict[tuple[int, int], Any]
    lock: Any


_WOUND = _Wound({}, threading.Lock())


def _sobol(sample: Sample, dimensions: int, first: int, count: int) -> Floats:
    """Return scrambled Sobol numbers, moved by half of their last bit so that none is 0."""
    from scipy.stats import qmc

    key = (sample.seed, dimensions)
    with _WOUND.lock:
        engine = _WOUND.engines.get(key)
        if engine is None or engine.num_generated > first:
            engine = qmc.Sobol(dimensions, scramble=True, bits=_SOBOL_BITS, rng=np.random.default_rng(sample.seed))
            _WOUND.engines[key] = engine
            if len(_WOUND.engines) > _MOST_ENGINES:
                del _WOUND.engines[next(iter(_WOUND.engines))]
        if first > engine.num_generated:
            engine.fast_forward(first - engine.num_generated)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # that a stretch of the sequence is no power of two
            return np.asarray(engine.random(count)) + 2.0 ** -(_SOBOL_BITS + 1)
