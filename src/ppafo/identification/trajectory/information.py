"""What recordings say about coordinates: information matrix, its inverse, steps along its principal axes.

All matrices are those of the coordinates of ``Range``: logarithms, or numbers over their size.
"""

import math

import numpy as np

from ppafo.identification.noise.sample_loops import sample_loops
from ppafo.identification.trajectory.residuals import Floats, Mask, Neighbourhood, Residuals, prior_coordinates

ROBUST_SCALE = 1.345
"""Residual, in standard deviations, beyond which a robust loss counts less: 95 % efficient for normal noise."""

SMALLEST_STEP, LARGEST_STEP = 1.0e-6, 5.0e-2
STEP_IN_ERRORS = 1.0
"""Step of a difference in standard errors, and its limits in coordinates."""

SMALLEST_FRACTION = 1.0e-12
"""Eigenvalues of the scaled information below this fraction of the largest are noise of the differences."""

FIXED = 1.0e-9
"""Share below which an eigenvalue fixes nothing, so that a solution does not move along its direction."""

_SMALLEST_PIVOT = 1.0e-4

LEAST = 1.0e-12
"""Information of a coordinate that changes nothing at all, so that its variance stays a number."""


def principal_axes(information: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the scale [unit] of each coordinate, and eigenvalues (growing) and vectors of the scaled information."""
    scale = np.sqrt(np.maximum(np.diag(information), LEAST))
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    return scale, values, vectors


def _largest(values: Floats) -> float:
    """Return the largest eigenvalue [-] of a scaled information, or 1, what it is where anything is known."""
    return max(float(values[-1]), 1.0) if values.size else 1.0


def loss_weights(residuals: Floats, loss: str) -> Floats:
    """Return the weight [-] of each residual in the information, 1 where no robust loss holds it back."""
    size = np.abs(residuals) / ROBUST_SCALE
    if loss == "huber":
        return 1.0 / np.maximum(size, 1.0)
    if loss == "soft_l1":
        return np.asarray(1.0 / np.sqrt(1.0 + size * size))
    return np.ones_like(residuals)


def robust_cost(residuals: Floats, loss: str) -> float:
    """Return half the sum of the squares of residuals [-], or what a robust loss makes of it."""
    squares = np.square(residuals / ROBUST_SCALE)
    if loss == "huber":
        costs = np.where(squares <= 1.0, squares, 2.0 * np.sqrt(squares) - 1.0)
    elif loss == "soft_l1":
        costs = 2.0 * (np.sqrt(1.0 + squares) - 1.0)
    else:
        costs = squares
    return 0.5 * ROBUST_SCALE**2 * float(np.sum(costs))


def data_information(jacobian: Floats, weights: Floats) -> Floats:
    """Return the information matrix of the samples (coordinates, coordinates), in inverse squares of their units."""
    return np.asarray(jacobian.T @ (weights[:, None] * jacobian))


def prior_information(residuals: Residuals) -> Floats:
    """Return the information matrix of the priors (coordinates, coordinates), in inverse squares of their units."""
    _, deviation, _ = prior_coordinates(residuals.ranges)
    return np.diag(1.0 / np.square(deviation))


def precision(near: Neighbourhood, loss: str) -> Floats:
    """Return the information of samples and priors together at a point, in inverse squares of the units."""
    weights = loss_weights(near.of_data, loss)
    return data_information(near.jacobian_of_data(), weights) + prior_information(near.residuals)


def directions_for(information: Floats, is_fixed: Mask) -> Floats:
    """Return steps of differences, in units of the coordinates, along the principal directions, as columns.

    Each step is one standard error in its direction, within limits. Where a vane breaks away or hits a stop the
    residual has kinks in time, and a step far below the standard error would ask whether a sample sits on a kink; one
    of this size asks what an interval asks. Along the principal directions, numbers that trade against each other
    exactly are moved together and change nothing, where differences one by one would leave the noise of large numbers
    that cancel. ``is_fixed`` coordinates, those at a bound, are moved alone.
    """
    directions = np.diag(np.where(is_fixed, SMALLEST_STEP, 0.0))
    free = np.flatnonzero(~is_fixed)
    part = information[np.ix_(free, free)]
    scale, values, vectors = principal_axes(part)
    errors = 1.0 / np.sqrt(np.maximum(values, SMALLEST_FRACTION * _largest(values)))
    found = STEP_IN_ERRORS * errors * vectors / scale[:, None]
    size = np.max(np.abs(found), axis=0, initial=0.0)
    directions[np.ix_(free, free)] = found * (np.clip(size, SMALLEST_STEP, LARGEST_STEP) / size)
    return directions


def covariance(information: Floats) -> Floats:
    """Return the inverse of an information matrix [unit^2]; a direction without information gets a huge variance."""
    scale, values, vectors = principal_axes(information)
    kept = np.maximum(values, SMALLEST_FRACTION * _largest(values))
    return np.asarray((vectors / kept) @ vectors.T / np.outer(scale, scale))


def standard_errors(information: Floats) -> Floats:
    """Return the standard errors, in units of the coordinates, that an information matrix stands for."""
    return np.asarray(np.sqrt(np.diag(covariance(information))))


def correlation(matrix: Floats) -> Floats:
    """Return the correlation matrix [-] of a covariance matrix."""
    errors = np.sqrt(np.diag(matrix))
    return np.asarray(np.clip(matrix / np.outer(errors, errors), -1.0, 1.0))


def autocorrelation(residuals: Floats) -> float:
    """Return the correlation [-] of residuals with their neighbours in time, 0 for white noise."""
    away = residuals - residuals.mean()
    size = float(np.sum(away * away))
    return float(np.sum(away[1:] * away[:-1]) / size) if size > 0.0 else 0.0


def inverse_with_root(precision: Floats) -> tuple[Floats, Floats]:
    """Return the inverse of a precision [unit^2] and a root of it; huge along a direction that nothing fixes."""
    root = solution_with_root(precision, np.zeros(len(precision)))[1]
    return root @ root.T, root


def solution(precision: Floats, product: Floats) -> Floats:
    """Return the solution of a linear system, in units of the coordinates; it does not move where nothing fixes it."""
    return solution_with_root(precision, product)[0]


def solution_with_root(precision: Floats, product: Floats) -> tuple[Floats, Floats]:
    """Return what ``solution`` does, and the root of the inverse that ``inverse_with_root`` does, at half the cost."""
    scale, values, vectors = principal_axes(precision)
    is_fixed = values > FIXED * _largest(values)
    inverses = np.where(is_fixed, 1.0 / np.where(is_fixed, values, 1.0), 0.0)
    found = (vectors * inverses) @ (vectors.T @ (product / scale)) / scale
    root = vectors / np.sqrt(np.maximum(values, SMALLEST_FRACTION * _largest(values))) / scale[:, None]
    return np.asarray(found), np.asarray(root)


def likelihood_without_columns(whole: Floats) -> float:
    """Return the log likelihood of residuals with all columns integrated out, but for a constant.

    ``whole`` has the products of the columns with each other, priors in them, and with the residuals, which come last.
    """
    found = np.full(1, math.nan)
    sample_loops().likelihood_left(np.ascontiguousarray(whole), np.empty(whole.shape), found, _SMALLEST_PIVOT)
    if not math.isnan(found[0]):
        return float(found[0])
    scale, values, vectors = principal_axes(whole[:-1, :-1])
    kept = np.maximum(values, SMALLEST_FRACTION * _largest(values))
    along = vectors.T @ (whole[:-1, -1] / scale)
    size = float(np.sum(np.where(values > FIXED * _largest(values), along * along / kept, 0.0)))
    return 0.5 * (size - float(whole[-1, -1]) - float(np.sum(np.log(kept)))) - float(np.sum(np.log(scale)))
