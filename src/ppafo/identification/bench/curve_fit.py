"""Curves fitted to samples, with intervals that allow for residuals that follow each other and a law that misses.

Readings side by side are put into blocks. Were the law right, the means of blocks of m readings would scatter by
1/sqrt(m) of what single readings do; a misfit that lasts over many readings makes them scatter more. The test is that
of lack of fit (between over within blocks, F distributed; Draper and Smith, Applied Regression Analysis, ch. 2). Where
it fails, the variance is that between blocks, with as many degrees of freedom as there are blocks less parameters:
the Birge ratio (Birge, Phys. Rev. 40, 1932) of the block means, and batch means for readings that follow each other.

What a law absorbs of its own misfit no residual shows. So the fit is repeated without each block in turn: a law that
misses gives other values on other parts of a recording (jackknife over blocks; Kuensch, Ann. Statist. 17, 1989).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ppafo.identification.bench.result import Number
from ppafo.identification.linear_systems import inverse_of
from ppafo.signals.recording import Floats

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

Indices = NDArray[np.intp]

_FEWEST_BLOCKS = 8
_MAXIMUM_BLOCKS = 64
"""More would find what follows from sample to sample, for which there is an interval of its own."""

_FEWEST_IN_A_BLOCK = 2
_DRAWS = 4000


CHANCE = 0.01
"""How often a law that is right may be reported to miss the readings by more than they scatter [-]."""


@dataclass(frozen=True, slots=True)
class LackOfFit:
    """Mean square of the block means times their size, its degrees of freedom, and the blocks (indices of samples).

    Without blocks the law misses by no more than the scatter, and the mean square is that of the residuals.
    """

    mean_square: float
    freedom: int
    blocks: tuple[Indices, ...]

    @property
    def is_seen(self) -> bool:
        """Whether the law misses by more than the scatter."""
        return bool(self.blocks)

    def deviation(self, confidence: float) -> float:
        """Return half the width of an interval for a reading's mean error, in the unit of the residuals."""
        return quantile(confidence, self.freedom) * float(np.sqrt(self.mean_square))


def lack_of_fit(residuals: Floats, parameters: int, confidence: float, along: Sequence[Floats] = ()) -> LackOfFit:
    """Return the lack of fit [-] that widens intervals most, over numbers of blocks, along samples and other orders.

    ``along`` are variables over which a misfit may run besides, such as a pressure. Readings that have some are steady
    ones, whose noise may differ from place to place; in a course of time a misfit may fill one block alone.
    """
    size = residuals.size
    widest = LackOfFit(float(residuals @ residuals) / max(1, size - parameters), max(1, size - parameters), ())
    orders = [np.arange(size), *(np.argsort(values, kind="stable") for values in along)]
    # From few blocks to as many as leave two readings in each, and a limit.
    counts: list[int] = []
    count = max(_FEWEST_BLOCKS, 2 * parameters)
    while count * _FEWEST_IN_A_BLOCK <= size and (not counts or count <= _MAXIMUM_BLOCKS):
        counts.append(count)
        count *= 2
    chance = CHANCE / max(1, len(counts) * len(orders))
    for order in orders:
        for count in counts:
            blocks = tuple(np.array_split(order, count))
            parts = [residuals[block] for block in blocks]
            freedom, inner = count - parameters, size - count
            between = sum(float(part.sum()) ** 2 / part.size for part in parts) / freedom
            within = sum(float(((part - part.mean()) ** 2).sum()) for part in parts) / inner
            if not exceeds_chance(between, within, freedom, inner, chance):
                continue
            if along and not _exceeds_uneven_noise(parts, chance):
                continue
            found = LackOfFit(between, freedom, blocks)
            if found.deviation(confidence) > widest.deviation(confidence):
                widest = found
    return widest


def quantile(confidence: float, freedom: int) -> float:
    """Return the two-sided quantile [-] of Student's distribution."""
    from scipy.stats import t

    return float(t.ppf(0.5 + confidence / 2.0, freedom))


def exceeds_chance(between: float, within: float, freedom: int, inner_freedom: int, chance: float) -> bool:
    """Return whether a mean square between groups is larger than that within them, but for a chance [-]; F test."""
    from scipy.stats import f

    return between > within and (within <= 0.0 or bool(f.sf(between / within, freedom, inner_freedom) <= chance))


def jackknife(values_without: Sequence[Floats], confidence: float) -> Floats:
    """Return half widths (numbers,), in their units, from the values fitted without each block in turn."""
    stacked = np.array(values_without)
    count = stacked.shape[0]
    variance = (count - 1) / count * ((stacked - stacked.mean(axis=0)) ** 2).sum(axis=0)
    return np.asarray(quantile(confidence, count - 1) * np.sqrt(variance))


def _exceeds_uneven_noise(parts: list[Floats], chance: float) -> bool:
    """Return whether the blocks' means scatter more than noise does that is larger in some blocks than in others.

    The F test takes one variance for all. Here each block has its own: were all errors independent, the sum of the
    squared means times their size would be one of squared normal numbers, weighted by the blocks' mean squares.
    """
    weights = np.array([float(part @ part) / part.size for part in parts])
    seen = sum(float(part.sum()) ** 2 / part.size for part in parts)
    draws = np.random.default_rng(1).standard_normal((_DRAWS, weights.size))
    return bool(np.mean(draws**2 @ weights >= seen) <= chance)


CLEARLY_WORSE = 10.0
"""Difference in Akaike's criterion from which one law is refused in favour of another."""

_MAXIMUM_CORRELATION = 0.999


@dataclass(frozen=True, slots=True)
class CurveFit:
    """Values, half widths, correlation of the errors, residuals; ``effective`` samples count as independent ones.

    ``widened`` says for each value how many times as wide its interval is as independent samples would have it, 1 where
    the law misses them by no more than they scatter. ``spread`` are standard errors for residuals of size one.
    """

    values: Floats
    half_widths: Floats
    correlation: Floats
    residuals: Floats
    effective: float
    widened: Floats
    spread: Floats

    @property
    def rms(self) -> float:
        """Root mean square of the residuals, in the unit of what was fitted."""
        return float(np.sqrt(np.mean(self.residuals**2)))

    def number(self, index: int, path: str, unit: str, text: str) -> Number:
        """Return a fitted value, in its unit, that cannot be negative, as a number of the result."""
        half, widened = self.half_widths[index], self.widened[index]
        return Number(path, unit, self.values[index], half, text, lowest=0.0, widened=widened)


ResidualsOf = Callable[[Floats], Floats]


def _least_squares(
    residuals_of: ResidualsOf, start: Floats, lower: Floats, upper: Floats, kept: "NDArray[np.bool_] | slice"
) -> "OptimizeResult":
    """Return the bounded least squares over the samples that are kept."""
    from scipy.optimize import least_squares

    return least_squares(
        lambda values: residuals_of(values)[kept],
        np.clip(start, lower, upper),
        bounds=(lower, upper),
        x_scale="jac",
        xtol=1e-12,
        ftol=1e-12,
        gtol=1e-12,
        max_nfev=400,
    )


def fit_curve(
    residuals_of: ResidualsOf,
    start: Floats,
    lower: Floats,
    upper: Floats,
    confidence: float,
    along: Sequence[Floats] = (),
) -> CurveFit:
    """Return the bounded least-squares fit; for each value, in its unit, the widest of three intervals.

    1. The variance is that of as many samples as are worth one on their own, where each resembles the one before.
    Where the law misses the samples by more than they scatter, in their order or ``along`` other variables
    (``lack_of_fit``): 2. the variance between blocks of samples; 3. how the values change without each block.
    """
    fit = solve_curve(residuals_of, start, lower, upper, confidence)
    missing = lack_of_fit(fit.residuals, start.size, confidence, along)
    if not missing.is_seen:
        return fit
    size, spread = fit.residuals.size, fit.spread
    freedom = max(1, size - spread.size)
    independent = quantile(confidence, freedom) * float(np.sqrt(fit.residuals @ fit.residuals / freedom)) * spread
    without = []
    for block in missing.blocks:
        kept = np.ones(size, dtype=np.bool_)
        kept[block] = False
        without.append(np.asarray(_least_squares(residuals_of, fit.values, lower, upper, kept).x))
    candidates = (fit.half_widths, missing.deviation(confidence) * spread, jackknife(without, confidence))
    half_widths = np.max(np.stack(candidates), axis=0)
    widened = half_widths / np.where(independent > 0.0, independent, half_widths)
    return replace(fit, half_widths=half_widths, widened=widened)


def solve_curve(residuals_of: ResidualsOf, start: Floats, lower: Floats, upper: Floats, confidence: float) -> CurveFit:
    """Return the bounded least-squares fit, each value in its unit with the first of these intervals."""
    found = _least_squares(residuals_of, start, lower, upper, slice(None))
    residuals, jacobian = np.asarray(found.fun), np.asarray(found.jac)
    inverse = inverse_of(jacobian.T @ jacobian)
    spread = np.sqrt(np.maximum(np.diag(inverse), 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = inverse / np.outer(spread, spread)
    effective = effective_samples(residuals)
    freedom = max(1.0, effective - spread.size)
    variance = np.mean(residuals**2) * residuals.size / freedom
    return CurveFit(
        values=np.asarray(found.x),
        half_widths=float(quantile(confidence, max(1, int(freedom))) * np.sqrt(variance)) * spread,
        correlation=correlation,
        residuals=residuals,
        effective=effective,
        widened=np.ones(spread.size),
        spread=spread,
    )


def effective_samples(residuals: Floats) -> float:
    """Return the effective sample size [-] of residuals, from how much each resembles the one before."""
    total = float(residuals @ residuals)
    if residuals.size < 3 or total == 0.0:
        return float(residuals.size)
    likeness = float(residuals[1:] @ residuals[:-1]) / total
    likeness = min(max(likeness, 0.0), _MAXIMUM_CORRELATION)
    return max(3.0, residuals.size * (1.0 - likeness) / (1.0 + likeness))
