"""Several devices of one kind, one estimate of each: what they have in common, how they spread, the next one's value.

The random-effects model: the value of a device is that of its kind plus a deviation of its own, normal with variance
tau^2, and its estimate adds an error of known standard deviation s_i. For every tau^2

    Q(tau^2) = sum_i (y_i - mu(tau^2))^2 / (s_i^2 + tau^2),   mu(tau^2) the mean with these weights,

has the chi-square distribution of n - 1 degrees of freedom, whatever the errors are. Everything follows from that:
the spread is where Q is n - 1 (Paule and Mandel 1982, J. Res. NBS 87, 377), its interval lies between quantiles of
chi-square (Q-profile; Viechtbauer 2007, Statistics in Medicine 26, 37), and intervals of the mean and of the next
device go over all spreads that Q allows (generalized intervals; Iyer, Wang and Mathew 2004, JASA 99, 1060). With
errors far below the spread they are those of Student's t, the next one's with sqrt(1 + 1/n).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.signals.recording import Floats

LEAST_DEVICES = 3
"""With two the interval of the next one is 16 times as wide as they are apart."""
_SPREADS = 120
"""Spreads over which the intervals of mean and next device go, closer to each other where they are improbable."""
_APART = 0.05
"""Chance, over all devices, from which one of them is said not to be of this kind."""


@dataclass(frozen=True, slots=True)
class Spread:
    """What estimates of several devices come to, in the unit of the values.

    ``mean`` and ``spread`` (standard deviation) are of the kind, ``next_device`` is where the next device lies, each
    with its interval. ``chance`` is that of estimates that differ as much if all devices were the same.
    """

    mean: float
    mean_interval: tuple[float, float]
    spread: float
    spread_interval: tuple[float, float]
    next_device: tuple[float, float]
    chance: float

    @property
    def is_common(self) -> bool:
        """Whether the estimates show no difference between the devices."""
        return self.spread_interval[0] == 0.0


def spread_of_devices(values: Sequence[float], errors: Sequence[float], confidence: float = 0.95) -> Spread:
    """Return mean, spread and the interval of the next device, from the ``values`` and standard ``errors`` of some.

    Both are in one unit, errors at least zero. IdentificationError for fewer than three devices.
    """
    from scipy.stats import chi2

    if len(values) < LEAST_DEVICES:
        raise IdentificationError(f"{len(values)} devices do not show how they spread; at least {LEAST_DEVICES} do")
    scale = max(float(np.ptp(values)), *errors)
    if scale == 0.0:
        only = float(values[0])
        return Spread(only, (only, only), 0.0, (0.0, 0.0), (only, only), 1.0)
    at, own = _scaled(values, errors, scale)
    freedom, tail = len(at) - 1, 0.5 * (1.0 - confidence)
    levels = np.array([freedom, chi2.ppf(1.0 - tail, freedom), chi2.ppf(tail, freedom)])
    variances = _variances_where(at, own, levels)
    mean = float(_means(at, own, variances[:1])[0][0])
    of_mean, of_next = _allowed(at, own)
    chance = float(chi2.sf(_excess(at, own, np.zeros(1))[0], freedom))
    deviations = scale * np.sqrt(variances)
    return Spread(
        scale * mean,
        (scale * of_mean.quantile(tail), scale * of_mean.quantile(1.0 - tail)),
        float(deviations[0]),
        (float(deviations[1]), float(deviations[2])),
        (scale * of_next.quantile(tail), scale * of_next.quantile(1.0 - tail)),
        chance,
    )


def devices_apart(values: Sequence[float], errors: Sequence[float]) -> tuple[int, ...]:
    """Return the places of devices that lie beyond what all the others let expect, their own error included.

    That happens to one device in 20 populations of a single kind (Bonferroni). Values and errors are as above.
    """
    count = len(values)
    scale = max(float(np.ptp(values)), *errors)
    if count <= LEAST_DEVICES or scale == 0.0:
        return ()
    at, own = _scaled(values, errors, scale)
    found = []
    for place in range(count):
        _, of_next = _allowed(np.delete(at, place), np.delete(own, place))
        below = of_next.with_error(float(own[place])).below(float(at[place]))
        if 2.0 * min(below, 1.0 - below) < _APART / count:
            found.append(place)
    return tuple(found)


def _scaled(values: Sequence[float], errors: Sequence[float], scale: float) -> tuple[Floats, Floats]:
    """Return values and errors [-]; an error is never zero, so that weights are finite."""
    return np.asarray(values, float) / scale, np.maximum(np.asarray(errors, float) / scale, 1.0e-9)


@dataclass(frozen=True, slots=True)
class _Mixture:
    """Normal distributions by their weights, which sum to 1, means and standard deviations."""

    weights: Floats
    means: Floats
    deviations: Floats

    def below(self, value: float) -> float:
        """Return the chance of a lower value [-]."""
        from scipy.special import ndtr

        return float(self.weights @ ndtr((value - self.means) / self.deviations))

    def quantile(self, level: float) -> float:
        """Return the value that is exceeded with the chance 1 - ``level``."""
        from scipy.optimize import brentq

        reach = 1.0 + abs(NormalDist().inv_cdf(level))
        low, high = (float(f(self.means + sign * reach * self.deviations)) for f, sign in ((np.min, -1), (np.max, 1)))
        return float(brentq(lambda value: self.below(value) - level, low, high, xtol=1e-12, rtol=1e-12))

    def with_error(self, error: float) -> "_Mixture":
        """Return the distribution with an independent error of this standard deviation added."""
        return _Mixture(self.weights, self.means, np.hypot(self.deviations, error))


def _allowed(values: Floats, errors: Floats) -> tuple[_Mixture, _Mixture]:
    """Return where mean and next device lie, over spreads as probable as Q makes them."""
    from scipy.stats import chi2

    steps = np.pi * (np.arange(_SPREADS) + 0.5) / _SPREADS
    weights = np.sin(steps) / np.sin(steps).sum()
    levels = chi2.ppf(np.square(np.sin(0.5 * steps)), len(values) - 1)
    variances = _variances_where(values, errors, levels)
    means, precisions = _means(values, errors, variances)
    return (
        _Mixture(weights, means, np.sqrt(1.0 / precisions)),
        _Mixture(weights, means, np.sqrt(1.0 / precisions + variances)),
    )


def _means(values: Floats, errors: Floats, variances: Floats) -> tuple[Floats, Floats]:
    """Return the weighted mean, and its precision, for each variance between devices."""
    weights = 1.0 / (np.square(errors) + variances[:, None])
    precisions = weights.sum(axis=1)
    return weights @ values / precisions, precisions


def _excess(values: Floats, errors: Floats, variances: Floats) -> Floats:
    """Return Q [-] for each variance between devices; it falls as the variance grows."""
    means, _ = _means(values, errors, variances)
    squares = np.square(values - means[:, None])
    return np.asarray((squares / (np.square(errors) + variances[:, None])).sum(axis=1))


def _variances_where(values: Floats, errors: Floats, levels: Floats) -> Floats:
    """Return the variance between devices at which Q has each level, zero where it is below that from the start."""
    # Q is at most the sum of squares over the variance.
    high = np.square(values - values.mean()).sum() / levels + 1.0e-30
    low = 1.0e-24 * high
    for _ in range(100):
        middle = np.sqrt(low * high)
        is_above = _excess(values, errors, middle) > levels
        low, high = np.where(is_above, middle, low), np.where(is_above, high, middle)
        if np.all(high < low * (1.0 + 1.0e-10)):
            break
    return np.where(_excess(values, errors, np.zeros(1))[0] > levels, np.sqrt(low * high), 0.0)


def coefficient_of_variation(deviation: float) -> float:
    """Return the standard deviation over the mean [-] of a number whose logarithm spreads by ``deviation``."""
    return math.sqrt(math.expm1(deviation**2))
