"""Straight-line regression with intervals that stay honest where readings are not independent of each other."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.signals.recording import Floats

Labels = NDArray[np.int64]
_FEWEST_CLUSTERS = 3

CHANCE = 0.01
"""How often a law that is right may be said to miss the readings by more than they scatter [-]."""


@dataclass(frozen=True, slots=True)
class Regression:
    """Coefficients in the order of the design's columns, half widths of their intervals, and the residuals.

    ``widened`` says how many times as wide each interval is as independent readings would have it, 1 where the line
    misses the cells by no more than the readings scatter in them.
    """

    coefficients: Floats
    half_widths: Floats
    residuals: Floats
    widest: str
    widened: Floats

    @property
    def scatter(self) -> float:
        """Standard deviation of the residuals, in the unit of what was fitted."""
        freedom = max(1, self.residuals.size - self.coefficients.size)
        return float(np.sqrt(self.residuals @ self.residuals / freedom))

    def differs_from_zero(self, index: int) -> bool:
        """Whether the interval of a coefficient leaves zero out."""
        return bool(abs(self.coefficients[index]) > self.half_widths[index])


def regress(
    design: Floats, values: Floats, clusters: Labels, cells: Labels, confidence: float, judged_by: int = 0
) -> Regression:
    """Return the least-squares fit with, for each coefficient, the widest of three intervals.

    1. Readings independent of each other. 2. Readings of one cluster (a repetition, a stroke) share an error: the
    cluster-robust covariance, where there are three clusters or more. 3. Readings of one cell (a pressure, one
    branch) share an error, as they do where the straight line does not quite hold: the regression of the cells' means.
    ``widest`` names the one that counted for the coefficient ``judged_by``.
    """
    inverse = np.asarray(np.linalg.inv(design.T @ design), dtype=np.float64)
    coefficients = inverse @ (design.T @ values)
    residuals = values - design @ coefficients
    candidates = {
        "independent readings": _independent(design, inverse, residuals, confidence),
        "scatter between repetitions": _clustered(design, inverse, residuals, clusters, confidence),
        "departure of pressure levels from a straight line": _of_cells(design, values, cells, confidence),
    }
    stacked = np.array(list(candidates.values()))
    name = list(candidates)[int(np.argmax(stacked[:, judged_by]))]
    half_widths = stacked.max(axis=0)
    widened = np.ones_like(half_widths)
    if _misses(residuals, cells, design.shape[1]):
        np.divide(half_widths, stacked[0], out=widened, where=stacked[0] > 0.0)
    return Regression(coefficients, half_widths, residuals, name, widened)


def quantile(confidence: float, freedom: int) -> float:
    """Return the two-sided quantile of Student's distribution."""
    from scipy.stats import t

    return float(t.ppf(0.5 + confidence / 2.0, freedom))


def exceeds_chance(between: float, within: float, freedom: int, inner_freedom: int, chance: float) -> bool:
    """Return whether a mean square between groups is larger than that within them, but for a chance [-]; F test."""
    from scipy.stats import f

    return between > within and (within <= 0.0 or bool(f.sf(between / within, freedom, inner_freedom) <= chance))


def labels_of(parts: Sequence[Labels]) -> Labels:
    """Return one label for each combination of labels."""
    _, labels = np.unique(np.stack(parts), axis=1, return_inverse=True)
    return np.asarray(labels, dtype=np.int64).reshape(-1)


def _misses(residuals: Floats, cells: Labels, columns: int) -> bool:
    """Return whether the line misses the cells by more than the readings scatter in them: the test of lack of fit."""
    counts = np.bincount(cells)
    freedom, inner = counts.size - columns, residuals.size - counts.size
    if freedom < 1 or inner < 1:
        return False
    means = np.bincount(cells, weights=residuals) / counts
    between, within = counts @ means**2 / freedom, float(((residuals - means[cells]) ** 2).sum()) / inner
    return exceeds_chance(float(between), within, freedom, inner, CHANCE)


def _independent(design: Floats, inverse: Floats, residuals: Floats, confidence: float) -> Floats:
    freedom = design.shape[0] - design.shape[1]
    variance = residuals @ residuals / freedom
    return np.asarray(quantile(confidence, freedom) * np.sqrt(variance * np.diag(inverse)))


def _clustered(design: Floats, inverse: Floats, residuals: Floats, clusters: Labels, confidence: float) -> Floats:
    count, columns = design.shape
    groups = int(clusters.max()) + 1
    if groups < _FEWEST_CLUSTERS or groups >= count:
        return np.zeros(columns)
    scores = np.zeros((groups, columns))
    np.add.at(scores, clusters, design * residuals[:, None])
    correction = groups / (groups - 1) * (count - 1) / (count - columns)
    covariance = correction * inverse @ (scores.T @ scores) @ inverse
    return np.asarray(quantile(confidence, groups - 1) * np.sqrt(np.diag(covariance)))


def _of_cells(design: Floats, values: Floats, cells: Labels, confidence: float) -> Floats:
    columns = design.shape[1]
    groups = int(cells.max()) + 1
    if groups <= columns or groups >= values.size:
        return np.zeros(columns)
    counts = np.bincount(cells)
    means = np.stack([np.bincount(cells, weights=column) / counts for column in (*design.T, values)])
    mean_design, mean_values = means[:-1].T, means[-1]
    if np.linalg.matrix_rank(mean_design) < columns:
        return np.zeros(columns)
    inverse = np.asarray(np.linalg.inv(mean_design.T @ mean_design), dtype=np.float64)
    residuals = mean_values - mean_design @ (inverse @ (mean_design.T @ mean_values))
    return _independent(mean_design, inverse, residuals, confidence)
