"""What recordings say about coordinates: information matrix, covariance, how much residuals hang together.

All matrices are those of the coordinates of ``Range``: logarithms, or numbers over their size.
"""

import math

import numpy as np

from ppafo.identification.trajectory.preparation import Floats
from ppafo.identification.trajectory.residuals import Mask, Neighbourhood, Residuals, prior_coordinates

ROBUST_SCALE = 1.345
"""Residual, in standard deviations, beyond which a robust loss counts less: 95 % efficient for normal noise."""

SMALLEST_STEP, LARGEST_STEP = 1.0e-6, 5.0e-2
STEP_IN_ERRORS = 1.0
"""Step of a difference in standard errors, and its limits in coordinates."""

SMALLEST_SHARE = 1.0e-12
"""Eigenvalues of the scaled information below this share of the largest are noise of the differences."""

LEAST = 1.0e-12
"""Information of a coordinate that changes nothing at all, so that its variance stays a number."""

_SIGNIFICANT = 4.0


def loss_weights(residuals: Floats, loss: str) -> Floats:
    """Return the weight [-] of each residual in the information, 1 where no robust loss holds it back."""
    size = np.abs(residuals) / ROBUST_SCALE
    if loss == "huber":
        return 1.0 / np.maximum(size, 1.0)
    if loss == "soft_l1":
        return np.asarray(1.0 / np.sqrt(1.0 + size * size))
    return np.ones_like(residuals)


def loss_curvature(residuals: Floats, loss: str) -> Floats:
    """Return the second derivative of the loss by each residual [-]: 1 where no robust loss holds it back."""
    size = np.abs(residuals) / ROBUST_SCALE
    if loss == "huber":
        return np.asarray(np.where(size <= 1.0, 1.0, 0.0))
    if loss == "soft_l1":
        return np.asarray((1.0 + size * size) ** -1.5)
    return np.ones_like(residuals)


def cost_of(residuals: Floats, loss: str) -> float:
    """Return the cost [-] that is made small: half the sum of squares, or of what a robust loss counts instead."""
    squares = np.square(residuals)
    if loss == "linear":
        return 0.5 * float(np.sum(squares))
    shares = squares / ROBUST_SCALE**2
    if loss == "huber":
        counted = np.where(shares <= 1.0, shares, 2.0 * np.sqrt(shares) - 1.0)
    else:
        counted = 2.0 * (np.sqrt(1.0 + shares) - 1.0)
    return 0.5 * ROBUST_SCALE**2 * float(np.sum(counted))


def data_information(jacobian: Floats, weights: Floats) -> Floats:
    """Return the information matrix of the samples."""
    return np.asarray(jacobian.T @ (weights[:, None] * jacobian))


def prior_information(residuals: Residuals) -> Floats:
    """Return the information matrix of the priors."""
    _, deviation, _ = prior_coordinates(residuals.ranges)
    return np.diag(1.0 / np.square(deviation))


def precision(near: Neighbourhood, loss: str) -> Floats:
    """Return the information of samples and priors together at a point."""
    weights = loss_weights(near.of_data, loss)
    return data_information(near.jacobian_of_data(), weights) + prior_information(near.residuals)


def curvature_and_spread(near: Neighbourhood, loss: str) -> tuple[Floats, Floats]:
    """Return the mean curvature of a robust cost at its least, and the covariance of its gradient.

    With A the first and B the second, estimates scatter with the covariance A^-1 B A^-1, the sandwich, whatever the
    distribution of the errors is (P. J. Huber, Robust Statistics, 1981, chapter 7.6). The errors of a channel are taken
    to share one: a number that only a few samples fix cannot learn its own from these.
    """
    jacobian, left = near.jacobian_of_data(), near.of_data
    curvature, spread = prior_information(near.residuals), prior_information(near.residuals)
    count, freedom = len(left), max(1, len(left) - len(near.point))
    for samples in near.residuals.channel_slices():
        information = jacobian[samples].T @ jacobian[samples]
        squares = np.square(left[samples] * loss_weights(left[samples], loss))
        curvature = curvature + float(np.mean(loss_curvature(left[samples], loss))) * information
        spread = spread + float(np.mean(squares)) * count / freedom * information
    return curvature, spread


def directions_for(information: Floats, is_fixed: Mask) -> Floats:
    """Return steps of differences along the principal directions of an information matrix, as columns.

    Each step is one standard error in its direction, within limits. Where a vane breaks away or hits a stop the
    residual has kinks in time, and a step far below the standard error would ask whether a sample sits on a kink; one
    of this size asks what an interval asks. Along the principal directions, numbers that trade against each other
    exactly are moved together and change nothing, where differences one by one would leave the noise of large numbers
    that cancel. ``is_fixed`` coordinates, those at a bound, are moved alone.
    """
    directions = np.diag(np.where(is_fixed, SMALLEST_STEP, 0.0))
    free = np.flatnonzero(~is_fixed)
    part = information[np.ix_(free, free)]
    scale = np.sqrt(np.maximum(np.diag(part), LEAST))
    values, vectors = np.linalg.eigh(part / np.outer(scale, scale))
    errors = 1.0 / np.sqrt(np.maximum(values, SMALLEST_SHARE * values[-1])) if free.size else values
    found = STEP_IN_ERRORS * errors * vectors / scale[:, None]
    size = np.max(np.abs(found), axis=0, initial=0.0)
    directions[np.ix_(free, free)] = found * (np.clip(size, SMALLEST_STEP, LARGEST_STEP) / size)
    return directions


def covariance(information: Floats) -> Floats:
    """Return the inverse of an information matrix; a direction without information gets a huge variance, not none."""
    scale = np.sqrt(np.maximum(np.diag(information), LEAST))
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    kept = np.maximum(values, SMALLEST_SHARE * values[-1])
    return np.asarray((vectors / kept) @ vectors.T / np.outer(scale, scale))


def sandwich(curvature: Floats, spread: Floats) -> Floats:
    """Return the covariance of estimates from the curvature of the cost and the covariance of its gradient."""
    inverse = covariance(curvature)
    return np.asarray(inverse @ spread @ inverse)


def standard_errors(information: Floats) -> Floats:
    """Return the standard errors that an information matrix stands for."""
    return np.asarray(np.sqrt(np.diag(covariance(information))))


def correlation(matrix: Floats) -> Floats:
    """Return the correlation matrix of a covariance matrix."""
    errors = np.sqrt(np.diag(matrix))
    return np.asarray(np.clip(matrix / np.outer(errors, errors), -1.0, 1.0))


def autocorrelation(residuals: Floats) -> float:
    """Return the correlation [-] of residuals with their neighbours in time, 0 for white noise."""
    away = residuals - residuals.mean()
    size = float(np.sum(away * away))
    return float(np.sum(away[1:] * away[:-1]) / size) if size > 0.0 else 0.0


def dependence(neighbours: float, samples: int) -> float:
    """Return the factor [-] by which variances grow because residuals hang together from sample to sample.

    (1 + r) / (1 - r) for a correlation r of neighbours, because there are fewer independent ones; 1 where r is not
    significant.
    """
    together = min(max(neighbours, 0.0), 0.999)
    significant = together * math.sqrt(samples) > _SIGNIFICANT
    return (1.0 + together) / (1.0 - together) if significant else 1.0
