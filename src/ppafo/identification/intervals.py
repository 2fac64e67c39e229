"""Confidence limits from profile likelihood, and combinations of variables that the recordings do not determine.

For a linear law the covariance gives the limits. For a nonlinear law, such as one in which only a product of two
variables counts, distant values may explain the recordings as well: a limit is the value at which the minimum of the
squares over all other variables is larger by t^2, with Student's factor t (profile likelihood).
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np
from scipy.optimize import lsq_linear

from ppafo.identification.residuals import FitRuns
from ppafo.identification.whitened import Linear, cost_of, squares_of, whitened_errors
from ppafo.signals.recording import Floats

_TRIES, _CORRECTIONS, _LINEARISATIONS = 6, 3, 4
"""Largest numbers of trial points per limit, of steps with the fixed Jacobian, and of steps with a new Jacobian."""

_SHARES = 0.5 ** np.arange(4.0)[:, None]
"""Trial fractions of a step with a new Jacobian [-]; the best is taken."""

_STILL = 0.3
"""Decrease of the squares [-] below which the other variables have converged."""

_FURTHER = 1.3
"""Least factor by which a trial limit is moved outwards while the recordings are still explained [-]."""

_NARROW = 0.1
"""Relative width of the bracket of a limit [-] below which the limit is interpolated linearly."""

_BENT = 1.1
"""Least ratio of profile to linear distance [-] above which the limit follows the profile likelihood."""

_SHOWN_WEIGHT = 0.1
"""Least weight of a variable in a combination [-] for which it is listed."""
_UNKNOWN = 0.5
"""Standard error of a combination of relative variables [-] above which it is not identifiable."""


def interval_ends(runs: FitRuns, point: Floats, linear: Linear, times: float) -> tuple[Floats, Floats]:
    """Return scaled lower and upper confidence limits: ``times`` standard errors, or wider for nonlinear laws.

    Only intervals of unknowns without a prior are widened. A limit that the samples do not determine is the bound.
    """
    covariance = linear.root @ linear.root.T
    wide = times * np.sqrt(np.diag(covariance))
    low, high = np.maximum(point - wide, runs.low), np.minimum(point + wide, runs.high)
    least = cost_of(runs, runs.residuals_at(point), point, linear)
    sides = [(number, ends) for number in np.flatnonzero(runs.prior == 0.0).tolist() for ends in (low, high)]
    fixed = [number for number, _ in sides]
    offsets = np.array([ends[number] - point[number] for number, ends in sides])
    straight = point[:, None] + covariance[:, fixed] / covariance[fixed, fixed] * offsets
    squares, points = _least_beside(runs, straight, fixed, linear)
    for side, (number, ends) in enumerate(sides):
        bound = float((runs.low if ends is low else runs.high)[number])
        if offsets[side] != 0.0:
            at_limit = float(squares[side]), points[:, side]
            ends[number] = _end(runs, point, least, linear, number, bound, at_limit, times)
    return low, high


def _end(
    runs: FitRuns,
    point: Floats,
    least: float,
    linear: Linear,
    number: int,
    bound: float,
    straight: tuple[float, Floats],
    times: float,
) -> float:
    """Return one confidence limit of a variable by profile likelihood, searched from the linear limit to the bound.

    ``least`` is the sum of squares at the estimate; ``straight`` is the sum of squares near the linear limit, and the
    point at which it is reached.
    """
    inner, near = point, 0.0
    outer: Floats | None = None
    far, (squares, reached) = math.inf, straight
    if math.sqrt(max(squares - least, 0.0)) > _BENT * times:
        squares, reached = _least_along(runs, reached, number, linear)
    # At the bound of an excess the samples may say nothing of its size, which the straight line then overestimates.
    is_excess = bool(runs.base[number].any())
    for _ in range(2 * _TRIES if is_excess else _TRIES):
        # By how many standard errors priors and samples tell this point from the estimate.
        parted = math.sqrt(max(squares - least, 0.0))
        if parted * (_BENT if inner is point else 1.0) < times:
            inner, near = reached, parted
            if float(inner[number]) == bound:
                return bound
        elif inner is point and not is_excess:
            return float(reached[number])
        else:
            outer, far = reached, parted
        if outer is not None and abs(outer[number] - inner[number]) < _NARROW * abs(inner[number] - point[number]):
            break
        further = min(max(times / max(near, 0.1), _FURTHER), 2.0)
        tried = point + further * (inner - point) if outer is None else 0.5 * (inner + outer)
        squares, reached = _least_along(runs, np.clip(tried, runs.low, runs.high), number, linear)
    if outer is None:
        return bound
    share = (times - near) / (far - near)
    return float(inner[number] + share * (outer[number] - inner[number]))


def _least_beside(runs: FitRuns, points: Floats, fixed: list[int], linear: Linear) -> tuple[Floats, Floats]:
    """Return the least sum of squares [-] at each scaled point with one variable fixed, and the points that reach it.

    ``fixed`` is the index of the fixed variable of each point. The other variables take Gauss-Newton steps with the
    Jacobian of the estimate. The minimum is infinite if no run succeeds.
    """
    covariance, slopes = linear.root @ linear.root.T, linear.rows[:, 1:]
    low, high, each = runs.low[:, None], runs.high[:, None], np.arange(len(fixed))
    tried = best = np.clip(points, low, high)
    least = np.full(len(fixed), np.inf)
    for _ in range(_CORRECTIONS + 1):
        errors = whitened_errors(runs, runs.residuals_at_points(tried), linear)
        squares = squares_of(runs, errors, tried)
        is_less = squares < least
        least, best = np.where(is_less, squares, least), np.where(is_less, tried, best)
        pull = slopes.T @ errors + np.square(runs.prior)[:, None] * (tried - runs.start[:, None])
        step = -covariance @ pull
        # Of all steps, the one that leaves the number where it is held.
        step -= covariance[:, fixed] / covariance[fixed, fixed] * step[fixed, each]
        # To first order the squares fall by that much; where no run succeeds they are no numbers.
        moves = -np.sum(pull * step, axis=0) > _STILL
        if not moves.any():
            break
        tried = np.where(moves, np.clip(tried + step, low, high), tried)
    return least, best


def _least_along(runs: FitRuns, point: Floats, number: int, linear: Linear) -> tuple[float, Floats]:
    """Return the least sum of squares [-] with one variable of a scaled point fixed, and the point that reaches it.

    The other variables take Gauss-Newton steps within their bounds, each with a new Jacobian, because far from the
    estimate its Jacobian leads out of a curved valley. The minimum is infinite if no run succeeds.
    """
    errors = whitened_errors(runs, runs.residuals_at_points(point[:, None]), linear)
    squares = float(squares_of(runs, errors, point[:, None])[0])
    if not math.isfinite(squares):
        return math.inf, point
    others = np.delete(np.arange(len(point)), number)
    for _ in range(_LINEARISATIONS):
        jacobian = runs.jacobian(point, is_central=False)
        runs.adapt_steps(jacobian, 1.0 / linear.noise)
        slopes = whitened_errors(runs, jacobian, linear)
        axes, triangle = np.linalg.qr(np.concatenate([slopes, np.diag(runs.prior)])[:, others])
        pull = axes.T @ np.concatenate([errors[:, 0], (point - runs.start) * runs.prior])
        low, high = (end - point[others] for end in (runs.low[others], runs.high[others]))
        step = np.zeros(len(point))
        step[others] = lsq_linear(triangle, -pull, (low - 1.0e-300, high + 1.0e-300), method="bvls").x
        tried = np.clip(point + _SHARES * step, runs.low, runs.high).T
        all_errors = whitened_errors(runs, runs.residuals_at_points(tried), linear)
        all_squares = squares_of(runs, all_errors, tried)
        best = int(np.argmin(np.where(np.isfinite(all_squares), all_squares, np.inf)))
        fall = squares - float(all_squares[best])
        if not fall > 0.0:
            break
        point, errors, squares = tried[:, best], all_errors[:, [best]], float(all_squares[best])
        if fall < _STILL:
            break
    return squares, point


def unidentified(covariance: Floats, names: Sequence[str]) -> Iterator[dict[str, float]]:
    """Yield combinations of variables whose standard error is above half their size, as weights by name.

    ``covariance`` is relative to the size of each variable.
    """
    variances, vectors = np.linalg.eigh(covariance)
    for variance, vector in zip(variances[::-1].tolist(), vectors.T[::-1], strict=True):
        if math.sqrt(max(variance, 0.0)) > _UNKNOWN:
            largest = float(vector[np.argmax(np.abs(vector))])
            weights = {name: float(weight) / largest for name, weight in zip(names, vector, strict=True)}
            yield {name: weight for name, weight in weights.items() if abs(weight) >= _SHOWN_WEIGHT}
