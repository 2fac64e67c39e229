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
from ppafo.identification.whitened import Linear, best_along, cost_of, whitened_errors
from ppafo.signals.recording import Floats

_TRIES, _STEPS = 10, 12
"""Largest numbers of trial points per limit, and of Gauss-Newton steps of the other variables at each."""

_STILL = 0.02
"""Decrease of the squares [-] below which the other variables have converged."""

_CLOSE = 0.01
"""Relative distance of the profile from its wanted value [-] from which a limit is extrapolated."""

_AWAY = 0.1
"""Least distance of a trial limit from both ends of its bracket, as a fraction of the bracket [-]."""

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
    for number in np.flatnonzero(runs.prior == 0.0).tolist():
        way = covariance[:, number] / covariance[number, number]
        for ends, bound in ((low, runs.low[number]), (high, runs.high[number])):
            if ends[number] != point[number]:
                straight = point + way * (ends[number] - point[number])
                straight[number] = ends[number]
                ends[number] = _end(runs, point, straight, linear, number, float(bound), times)
    return low, high


def _end(
    runs: FitRuns, point: Floats, straight: Floats, linear: Linear, number: int, bound: float, times: float
) -> float:
    """Return one confidence limit of a variable by profile likelihood, searched from the linear limit to the bound.

    ``straight`` is the point at the linear limit. The profile is the root of the increase of the squares: by how many
    standard errors priors and samples tell a point from the estimate.
    """
    least = cost_of(runs, runs.residuals_at(point), point, linear)
    # Points with their profiles: the two last ones below the wanted profile, and the last one above it.
    before = inner = point, 0.0
    outer: tuple[Floats, float] | None = None
    tried = straight
    # At the bound of an excess the samples may say nothing of its size, which the straight line then overestimates.
    is_least = not runs.base[number].any()
    for _ in range(_TRIES):
        squares, reached = _least_along(runs, np.clip(tried, runs.low, runs.high), number, linear)
        profile = math.sqrt(max(squares - least, 0.0))
        if profile >= times and inner[0] is point and is_least:
            return float(reached[number])
        if abs(profile - times) <= _CLOSE * times:
            end = point[number] + times / profile * (reached[number] - point[number])
            return float(min(max(end, runs.low[number]), runs.high[number]))
        if profile >= times:
            outer = reached, profile
        elif float(reached[number]) == bound:
            return bound
        else:
            before, inner = inner, (reached, profile)
        other = before if outer is None else outer
        rise, missing = abs(other[1] - inner[1]), times - inner[1]
        # Between two points the secant stays away from both; beyond them its distance from the estimate may double.
        away = np.abs(np.array([inner[0][number] - point[number], other[0][number] - inner[0][number]]))
        most = away[0] / away[1] if outer is None else 1.0 - _AWAY
        share = min(missing / rise, most) if 0.0 < rise < math.inf else 0.5 * most
        tried = inner[0] + (-share if outer is None else max(share, _AWAY)) * (other[0] - inner[0])
    return bound if outer is None else float(tried[number])


def _least_along(runs: FitRuns, point: Floats, number: int, linear: Linear) -> tuple[float, Floats]:
    """Return the least sum of squares [-] with one variable of a scaled point fixed, and the point that reaches it.

    The other variables take Gauss-Newton steps within their bounds, each with its own Jacobian, because far from the
    estimate its Jacobian leads out of a curved valley. The sum is infinite if no run succeeds.
    """
    residuals = runs.residuals_at_points(point[:, None])[:, 0]
    if not np.isfinite(residuals).all():
        return math.inf, point
    squares = cost_of(runs, residuals, point, linear)
    others = np.delete(np.arange(len(point)), number)
    for _ in range(_STEPS):
        jacobian = runs.jacobian(point, is_central=False)
        runs.adapt_steps(jacobian, 1.0 / linear.noise)
        slopes = whitened_errors(runs, jacobian, linear)
        slopes[:, number] = 0.0
        errors = whitened_errors(runs, residuals[:, None], linear)[:, 0]
        axes, triangle = np.linalg.qr(np.concatenate([slopes, np.diag(runs.prior)])[:, others])
        pull = axes.T @ np.concatenate([errors, (point - runs.start) * runs.prior])
        low, high = (end - point[others] for end in (runs.low[others], runs.high[others]))
        step = np.zeros(len(point))
        step[others] = lsq_linear(triangle, -pull, (low - 1.0e-300, high + 1.0e-300), method="bvls").x
        reached, tried, found = best_along(runs, point, residuals, step, slopes, linear)
        fall = squares - reached
        if not fall > 0.0:
            break
        point, residuals, squares = tried, found, reached
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
