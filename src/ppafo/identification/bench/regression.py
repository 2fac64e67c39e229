"""Straight-line regression with intervals that stay honest where readings are not independent of each other."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.signals.recording import Floats

Labels = NDArray[np.int64]
_FEWEST_CLUSTERS = 3


@dataclass(frozen=True, slots=True)
class Regression:
    """Coefficients in the order of the design's columns, half widths of their intervals, and the residuals."""

    coefficients: Floats
    half_widths: Floats
    residuals: Floats
    widest: str

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
    return Regression(coefficients, stacked.max(axis=0), residuals, name)


def quantile(confidence: float, freedom: int) -> float:
    """Return the two-sided quantile of Student's distribution."""
    from scipy.stats import t

    return float(t.ppf(0.5 + confidence / 2.0, freedom))


def labels_of(parts: Sequence[Labels]) -> Labels:
    """Return one label for each combination of labels."""
    _, labels = np.unique(np.stack(parts), axis=1, return_inverse=True)
    return np.asarray(labels, dtype=np.int64).reshape(-1)


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
