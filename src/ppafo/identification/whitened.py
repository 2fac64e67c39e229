"""Residuals and their Jacobian with the noise made white: the linear problem at a point, and its least squares."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from ppafo.identification.noise import Noise, noise_of, whiten
from ppafo.identification.residuals import FitRuns, Flags
from ppafo.signals.recording import Floats

_OF_ANY_SIZE = 1.0e8
"""Standard deviation of an error of which nothing is known, over the noise [-]."""
_ROUNDS = 20
"""Rounds of noise and numbers at most; most fits settle in a few."""

_RANK = 1.0e-13
"""Eigenvalue [-] of scaled numbers from which they are seen."""


class Linear(NamedTuple):
    """Residuals and Jacobian whitened [-] side by side, root of the covariance of scaled numbers, noise by channel.

    ``shared`` are columns [-] of what rows have in common: errors of all samples of a recording, and samples that are
    left out. Rows less ``shared`` times their products with it have errors that are independent.
    """

    rows: Floats
    shared: Floats
    root: Floats
    noise: Floats
    sensors: dict[str, Noise]


def linear_at(work: FitRuns, point: Floats, left: Floats, slopes: Floats) -> tuple[Linear, Floats]:
    """Return the problem whitened at a point, and the step to its least squares within the bounds.

    What the numbers absorb of the noise is missing in the residuals; its expectation J C J' is added until both agree
    (expectation and maximisation), so that slow noise is not taken for little noise.
    """
    step, hidden = np.zeros(len(point)), np.zeros((len(left), 0))
    limits = work.low - point - 1.0e-300, work.high - point + 1.0e-300
    # A sample with a number of its own, of no known size, says nothing: so it is left out of any noise.
    own_numbers = np.zeros((len(left), len(work.left_out)))
    own_numbers[work.left_out, np.arange(len(work.left_out))] = _OF_ANY_SIZE
    common = work.shared()
    for _ in range(_ROUNDS):
        series = np.column_stack([left + slopes @ step, hidden])
        series[work.left_out] = 0.0
        noise, sizes = work.deviations(series)
        known, scaled = {}, np.column_stack([left, slopes, common]) / noise[:, None]
        rows = np.column_stack([scaled, own_numbers])
        for channel in work.channels:
            of_channel = work.rows_of(channel)
            kind = noise_of([series[part] / noise[part, None] for part in of_channel], work.memory, work.is_motion)
            known[channel] = replace(kind, deviation=sizes[channel])
            for part in of_channel:
                rows[part] = whiten(rows[part], kind)
        # With D = U S V' the covariance is 1 + D D', and 1 - U (1 - 1 / sqrt(1 + S^2)) U' makes it 1.
        axes, triangle = np.linalg.qr(rows[:, 1 + len(point) :])
        turned, spread, _ = np.linalg.svd(triangle)
        shared = axes @ (turned * np.sqrt(1.0 - 1.0 / np.hypot(1.0, spread)))
        rows = rows[:, : 1 + len(point)]
        rows = rows - shared @ (shared.T @ rows)
        root, _ = root_of_inverse(rows[:, 1:].T @ rows[:, 1:] + np.diag(np.square(work.prior)))
        hidden = slopes @ root
        before = step
        solved = lsq_linear(
            np.concatenate([rows[:, 1:], np.diag(work.prior)]),
            -np.concatenate([rows[:, 0], (point - work.mean) * work.prior]),
            limits,
            method="bvls",
        )
        step = np.asarray(solved.x)
        if np.abs((step - before) @ np.linalg.pinv(root)).max() < 0.01 and series.shape[1] > 1:
            break
    return Linear(rows=rows, shared=shared, root=root, noise=noise, sensors=known), step


def root_of_inverse(curvature: Floats) -> tuple[Floats, Flags]:
    """Return a matrix whose product with its transpose is the inverse, and which of its columns are seen at all.

    The others are large, of numbers or combinations that nothing fixes.
    """
    sizes = np.sqrt(np.maximum(np.diag(curvature), 0.0))
    size = np.where(sizes > 1.0e-9 * sizes.max(initial=0.0), sizes, sizes.max(initial=1.0e-9) or 1.0)
    values, vectors = np.linalg.eigh(curvature / size / size[:, None])
    return np.asarray(vectors / np.sqrt(np.maximum(values, _RANK)) / size[:, None]), np.asarray(values > _RANK)


def whitened_errors(work: FitRuns, left: Floats, linear: Linear) -> Floats:
    """Return residuals [SI] (rows, points) as independent errors [-], by the noise of a linear problem."""
    scaled = left / linear.noise[:, None]
    kinds = {channel: replace(noise, deviation=1.0) for channel, noise in linear.sensors.items()}
    errors = np.concatenate([whiten(scaled[block.rows], kinds[block.channel]) for block in work.blocks])
    return np.asarray(errors - linear.shared @ (linear.shared.T @ errors))


def squares_of(work: FitRuns, errors: Floats, points: Floats) -> Floats:
    """Return the sums of squares [-] of whitened errors (rows, points) and of priors, for each scaled point."""
    away = (points - work.mean[:, None]) * work.prior[:, None]
    return np.asarray(np.square(errors).sum(axis=0) + np.square(away).sum(axis=0))


def cost_of(work: FitRuns, left: Floats, point: Floats, linear: Linear) -> float:
    """Return the sum of squares [-] of whitened residuals [SI] (rows,) and priors at one scaled point."""
    return float(squares_of(work, whitened_errors(work, left[:, None], linear), point[:, None])[0])
