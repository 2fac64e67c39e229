"""Curves fitted to samples in time, with intervals that allow for residuals that follow each other."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ppafo.identification.bench.regression import quantile
from ppafo.signals.recording import Floats

_MOST_CORRELATION = 0.999


@dataclass(frozen=True, slots=True)
class CurveFit:
    """Values, half widths, correlation of the errors, residuals; ``effective`` samples count as independent ones."""

    values: Floats
    half_widths: Floats
    correlation: Floats
    residuals: Floats
    effective: float
    at_bound: tuple[bool, ...]

    @property
    def rms(self) -> float:
        """Root mean square of the residuals, in the unit of what was fitted."""
        return float(np.sqrt(np.mean(self.residuals**2)))


def fit_curve(
    residuals_of: Callable[[Floats], Floats], start: Floats, lower: Floats, upper: Floats, confidence: float
) -> CurveFit:
    """Return the bounded least-squares fit; the variance is that of as many samples as are worth one on its own."""
    from scipy.optimize import least_squares

    inside = np.clip(start, lower, upper)
    found = least_squares(
        residuals_of, inside, bounds=(lower, upper), x_scale="jac", xtol=1e-12, ftol=1e-12, gtol=1e-12, max_nfev=400
    )
    residuals, jacobian = np.asarray(found.fun), np.asarray(found.jac)
    effective = effective_samples(residuals)
    freedom = max(1.0, effective - found.x.size)
    variance = np.mean(residuals**2) * effective / freedom * residuals.size / effective
    covariance = variance * _inverse(jacobian)
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = covariance / np.outer(spread, spread)
    bound = tuple(bool(flag) for flag in found.active_mask != 0)
    half_widths = quantile(confidence, max(1, int(freedom))) * spread
    return CurveFit(np.asarray(found.x), half_widths, correlation, residuals, effective, bound)


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
