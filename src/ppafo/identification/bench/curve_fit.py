"""Curves fitted to samples, with intervals that allow for residuals that follow each other and a law that misses."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ppafo.identification.bench.lack_of_fit import LackOfFit, jackknifed, lack_of_fit
from ppafo.identification.bench.regression import quantile
from ppafo.signals.recording import Floats

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

CLEARLY_WORSE = 10.0
"""Difference in Akaike's criterion from which one law is refused in favour of another."""

_MOST_CORRELATION = 0.999


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
    at_bound: tuple[bool, ...]
    widened: Floats
    spread: Floats

    @property
    def rms(self) -> float:
        """Root mean square of the residuals, in the unit of what was fitted."""
        return float(np.sqrt(np.mean(self.residuals**2)))


@dataclass(frozen=True, slots=True)
class _Bounded:
    """What is fitted: residuals over values, and the bounds of the values."""

    residuals_of: Callable[[Floats], Floats]
    lower: Floats
    upper: Floats

    def solved(self, start: Floats, kept: "NDArray[np.bool_] | slice" = slice(None)) -> "OptimizeResult":
        """Return the least squares over the samples that are kept."""
        from scipy.optimize import least_squares

        return least_squares(
            lambda values: self.residuals_of(values)[kept],
            np.clip(start, self.lower, self.upper),
            bounds=(self.lower, self.upper),
            x_scale="jac",
            xtol=1e-12,
            ftol=1e-12,
            gtol=1e-12,
            max_nfev=400,
        )


def fit_curve(
    residuals_of: Callable[[Floats], Floats],
    start: Floats,
    lower: Floats,
    upper: Floats,
    confidence: float,
    along: Sequence[Floats] = (),
) -> CurveFit:
    """Return the bounded least-squares fit with, for each value, the widest of three intervals.

    1. The variance is that of as many samples as are worth one on their own, where each resembles the one before.
    Where the law misses the samples by more than they scatter, in their order or ``along`` other variables
    (``lack_of_fit``): 2. the variance between blocks of samples; 3. how the values change without each block.
    """
    fit = solve_curve(residuals_of, start, lower, upper, confidence)
    missing = lack_of_fit(fit.residuals, start.size, confidence, along)
    return _widened(fit, _Bounded(residuals_of, lower, upper), missing, confidence) if missing.is_seen else fit


def solve_curve(
    residuals_of: Callable[[Floats], Floats], start: Floats, lower: Floats, upper: Floats, confidence: float
) -> CurveFit:
    """Return the bounded least-squares fit with the first of these intervals; enough to compare laws with."""
    found = _Bounded(residuals_of, lower, upper).solved(start)
    residuals, inverse = np.asarray(found.fun), _inverse(np.asarray(found.jac))
    spread = np.sqrt(np.maximum(np.diag(inverse), 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = inverse / np.outer(spread, spread)
    return CurveFit(
        values=np.asarray(found.x),
        half_widths=_following(residuals, spread.size, confidence) * spread,
        correlation=correlation,
        residuals=residuals,
        effective=effective_samples(residuals),
        at_bound=tuple(bool(flag) for flag in found.active_mask != 0),
        widened=np.ones(spread.size),
        spread=spread,
    )


def _following(residuals: Floats, parameters: int, confidence: float) -> float:
    """Return the half width per unit of the design for samples that each resemble the one before."""
    freedom = max(1.0, effective_samples(residuals) - parameters)
    variance = np.mean(residuals**2) * residuals.size / freedom
    return float(quantile(confidence, max(1, int(freedom))) * np.sqrt(variance))


def _widened(fit: CurveFit, problem: _Bounded, missing: LackOfFit, confidence: float) -> CurveFit:
    """Return the fit with the intervals that hold where the law misses the samples."""
    spread = fit.spread
    freedom = max(1, fit.residuals.size - spread.size)
    independent = quantile(confidence, freedom) * float(np.sqrt(fit.residuals @ fit.residuals / freedom)) * spread
    without = []
    for block in missing.blocks:
        kept = np.ones(fit.residuals.size, dtype=np.bool_)
        kept[block] = False
        without.append(np.asarray(problem.solved(fit.values, kept).x))
    candidates = (fit.half_widths, missing.deviation(confidence) * spread, jackknifed(without, confidence))
    half_widths = np.max(np.stack(candidates), axis=0)
    widened = half_widths / np.where(independent > 0.0, independent, half_widths)
    return replace(fit, half_widths=half_widths, widened=widened)


def effective_samples(residuals: Floats) -> float:
    """Return how many independent samples the residuals are worth, from how much each resembles the one before."""
    total = float(residuals @ residuals)
    if residuals.size < 3 or total == 0.0:
        return float(residuals.size)
    likeness = float(residuals[1:] @ residuals[:-1]) / total
    likeness = min(max(likeness, 0.0), _MOST_CORRELATION)
    return max(3.0, residuals.size * (1.0 - likeness) / (1.0 + likeness))


def _inverse(jacobian: Floats) -> Floats:
    """Return (J'J)^-1 on scaled columns; a direction that the samples do not see gets a huge variance, not none."""
    scale = np.sqrt((jacobian**2).sum(axis=0))
    scale = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh((jacobian / scale).T @ (jacobian / scale))
    floor = max(float(values.max()), 1e-300) * 1e-14
    inverse = (vectors / np.maximum(values, floor)) @ vectors.T
    return np.asarray(inverse / np.outer(scale, scale))
