"""Whitened residuals and Jacobian: linearised least-squares problem at a point, and its solution."""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from ppafo.identification.noise import Noise, noise_of, whiten
from ppafo.identification.residuals import FitRuns, Flags, Indices
from ppafo.signals.recording import Floats

_OF_ANY_SIZE = 1.0e8
"""Standard deviation of an error of unknown magnitude, relative to the noise [-]."""
_ROUNDS = 20
"""Largest number of iterations between noise and variables; most fits converge in a few."""

SHORT = 0.1
"""Shortest fraction of a step that is tried [-], from which its curvature is found too."""
_SHARES = np.array([1.0, 0.5, 0.25])[:, None]
"""Longer fractions of a step [-]; the best is taken."""
_STILL = 1.0e-3
"""Change of the step between iterations [standard errors] at which noise and variables agree."""
_RANK = 1.0e-13
"""Least eigenvalue of the scaled curvature [-] for a direction to be observable."""


class Linear(NamedTuple):
    """Linearised least-squares problem.

    ``rows``: whitened residuals and Jacobian [-], side by side. ``shared``: columns [-] for correlated errors, common
    to the samples of a recording or covering the samples left out; after subtraction of ``shared @ (shared.T @ x)`` the
    errors are independent. ``root``: square root of the covariance of the scaled variables. ``noise``: noise of each
    row [SI]. ``sensors``: noise model by channel.
    """

    rows: Floats
    shared: Floats
    root: Floats
    noise: Floats
    sensors: dict[str, Noise]


def linear_at(
    runs: FitRuns, point: Floats, residuals: Floats, slopes: Floats, left_out: Indices, like: Mapping[str, Noise]
) -> tuple[Linear, Floats]:
    """Return the whitened problem at a point, and the step to its least-squares solution within the bounds.

    Fitting absorbs part of the noise, which is then missing in the residuals. The expected part J C J' is added and the
    noise re-estimated until both agree (expectation maximisation), so that slow noise is not underestimated. Rows
    ``left_out`` say nothing. Kind and order of the noise are those of ``like`` by channel, if it has any.
    """
    step, hidden = np.zeros(len(point)), np.zeros((len(residuals), 0))
    limits = runs.low - point - 1.0e-300, runs.high - point + 1.0e-300
    # A sample with a number of its own, of no known size, says nothing: so it is left out of any noise.
    own_numbers = np.zeros((len(residuals), len(left_out)))
    own_numbers[left_out, np.arange(len(left_out))] = _OF_ANY_SIZE
    common = runs.shared()
    for _ in range(_ROUNDS):
        series = np.column_stack([residuals + slopes @ step, hidden])
        series[left_out] = 0.0
        noise, sizes = runs.deviations(series)
        sensors, scaled = {}, np.column_stack([residuals, slopes, common]) / noise[:, None]
        rows = np.column_stack([scaled, own_numbers])
        for channel in runs.channels:
            blocks = runs.rows_of(channel)
            own = [series[block] / noise[block, None] for block in blocks]
            model = noise_of(own, runs.memory, runs.is_motion, like.get(channel))
            sensors[channel] = replace(model, deviation=sizes[channel])
            for block in blocks:
                rows[block] = whiten(rows[block], model)
        # With D = U S V' the covariance is 1 + D D', and 1 - U (1 - 1 / sqrt(1 + S^2)) U' makes it 1.
        axes, triangle = np.linalg.qr(rows[:, 1 + len(point) :])
        turned, spread, _ = np.linalg.svd(triangle)
        shared = axes @ (turned * np.sqrt(1.0 - 1.0 / np.hypot(1.0, spread)))
        rows = rows[:, : 1 + len(point)]
        rows = rows - shared @ (shared.T @ rows)
        root, _ = root_of_inverse(rows[:, 1:].T @ rows[:, 1:] + np.diag(np.square(runs.prior)))
        hidden = slopes @ root
        before = step
        solved = lsq_linear(
            np.concatenate([rows[:, 1:], np.diag(runs.prior)]),
            -np.concatenate([rows[:, 0], (point - runs.start) * runs.prior]),
            limits,
            method="bvls",
        )
        step = np.asarray(solved.x)
        if np.abs(np.linalg.pinv(root) @ (step - before)).max() < _STILL and series.shape[1] > 1:
            break
    return Linear(rows=rows, shared=shared, root=root, noise=noise, sensors=sensors), step


def root_of_inverse(curvature: Floats) -> tuple[Floats, Flags]:
    """Return a square root of the inverse of a matrix, and flags of its columns that belong to observable directions.

    The columns of unobservable directions are large.
    """
    sizes = np.sqrt(np.maximum(np.diag(curvature), 0.0))
    size = np.where(sizes > 1.0e-9 * sizes.max(initial=0.0), sizes, sizes.max(initial=1.0e-9) or 1.0)
    values, vectors = np.linalg.eigh(curvature / size / size[:, None])
    return np.asarray(vectors / np.sqrt(np.maximum(values, _RANK)) / size[:, None]), np.asarray(values > _RANK)


def whitened_errors(runs: FitRuns, residuals: Floats, linear: Linear) -> Floats:
    """Return residuals [SI] (rows, points) as independent errors [-], using the noise of a linearised problem."""
    scaled = residuals / linear.noise[:, None]
    models = {channel: replace(noise, deviation=1.0) for channel, noise in linear.sensors.items()}
    errors = np.concatenate([whiten(scaled[block.rows], models[block.channel]) for block in runs.blocks])
    return np.asarray(errors - linear.shared @ (linear.shared.T @ errors))


def squares_of(runs: FitRuns, errors: Floats, points: Floats) -> Floats:
    """Return the sum of squares [-] of whitened errors (rows, points) and priors, for each scaled point."""
    away = (points - runs.start[:, None]) * runs.prior[:, None]
    return np.asarray(np.square(errors).sum(axis=0) + np.square(away).sum(axis=0))


def cost_of(runs: FitRuns, residuals: Floats, point: Floats, linear: Linear) -> float:
    """Return the sum of squares [-] of priors and whitened residuals, given residuals [SI] (rows,) at a point."""
    return float(squares_of(runs, whitened_errors(runs, residuals[:, None], linear), point[:, None])[0])


def fall_of(runs: FitRuns, point: Floats, linear: Linear, step: Floats) -> float:
    """Return by how much the sum of squares [-] of a linearised problem falls along a step from its scaled point."""
    errors = np.column_stack([linear.rows[:, 0], linear.rows[:, 0] + linear.rows[:, 1:] @ step])
    before, after = squares_of(runs, errors, np.column_stack([point, point + step])).tolist()
    return float(before - after)


def best_along(
    runs: FitRuns, point: Floats, residuals: Floats, step: Floats, slopes: Floats, linear: Linear
) -> tuple[float, Floats, Floats]:
    """Return the least sum of squares [-] along a step from a scaled point, its point, and the residuals [SI] there.

    The way bends as the residuals do along the step (geodesic acceleration), because static friction trades off against
    its fall along a curved valley. A variable without a step stays. ``slopes`` is the whitened Jacobian [-] at the
    point. The sum is infinite if no run succeeds, even after a ``SHORT`` fraction of the step.
    """
    ends = np.clip(np.column_stack([point + SHORT * step, point - SHORT * step]).T, runs.low, runs.high).T
    ahead, behind = runs.residuals_at_points(ends).T
    curvature = whitened_errors(runs, ((ahead - residuals) + (behind - residuals))[:, None] / SHORT**2, linear)[:, 0]
    bend = np.zeros(len(point))
    if np.isfinite(curvature).all():
        right_side = np.concatenate([curvature, bend])
        bend -= np.linalg.lstsq(np.concatenate([slopes, np.diag(runs.prior)]), right_side, rcond=None)[0]
        bend[step == 0.0] = 0.0
    tried = np.clip(point + _SHARES * step + 0.5 * np.square(_SHARES) * bend, runs.low, runs.high).T
    points = np.column_stack([tried, ends[:, 0]])
    found = np.column_stack([runs.residuals_at_points(tried), ahead])
    squares = squares_of(runs, whitened_errors(runs, found, linear), points)
    best = int(np.argmin(np.where(np.isfinite(squares), squares, np.inf)))
    return (float(squares[best]) if np.isfinite(squares[best]) else np.inf), points[:, best], found[:, best]
