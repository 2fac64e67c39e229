"""Student's t distribution, for tails heavier than normal ones: a normal one whose variance is itself drawn."""

import math
from functools import cache

import numpy as np

from ppafo.identification.noise.sample_loops import sample_loops
from ppafo.signals.recording import Floats

FREEDOMS = np.array([1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 7.0, 10.0, 15.0, 25.0, 50.0, 100.0])
"""Degrees of freedom of a t distribution that are tried; more cannot be distinguished from a normal one."""
_QUADRATURE = 12
_TABLE = (1.0, 200.0, 60)
_ROUNDS_OF_T = 12
_LARGE_PRODUCT = 1.0e100
LEAST = 1.0e-30
"""Variance [-] that is none."""


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


def t_likelihood(errors: Floats, freedoms: Floats) -> Floats:
    """Return the log likelihood [-] of errors under t distributions of scale 1, one for each of ``freedoms``."""
    from scipy.special import gammaln

    half = 0.5 * freedoms
    constant = gammaln(half + 0.5) - gammaln(half) - 0.5 * np.log(freedoms * np.pi)
    return np.asarray(len(errors) * constant - (half + 0.5) * _sums_of_logs(np.square(errors), freedoms))


def fit_scaled_t(errors: Floats) -> tuple[Floats, Floats]:
    """Return log likelihood and best scale for each of the degrees of freedom that are tried."""
    from scipy.special import gammaln

    squares, count = np.square(errors), len(errors)
    variances = np.full(len(FREEDOMS), float(np.median(squares)) / 0.45 + LEAST)
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
