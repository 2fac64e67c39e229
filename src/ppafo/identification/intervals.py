"""Where the interval of a number ends, and which combinations of numbers nothing fixes.

At the estimate the law is a straight line, whose intervals are the covariance's. Where the law bends, such as along two
numbers of which the product counts, other numbers may explain as much far beyond it: an end lies where the least
squares with the number held there are larger by t^2, t being Student's factor (profile likelihood).
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ppafo.identification.residuals import Work
from ppafo.identification.whitened import Linear, cost_of, squares_of, whitened_errors
from ppafo.signals.recording import Floats

_TRIES, _CORRECTIONS = 6, 3
"""Points that are tried for an end, and steps of all other numbers while one is held there."""

_STILL = 0.3
"""Fall of the squares [-] below which the others have settled."""

_FURTHER = 1.3
"""Factor at least by which an end that explains the recordings is moved away, so that one is found that does not."""

_NARROW = 0.1
"""Width of the bracket of an end over its distance from the estimate, within which it lies on a straight line."""

_BENT = 1.1
"""Factor by which an end lies beyond the straight line's at least, for it to be moved."""

_UNKNOWN = 0.5
"""Standard error of a combination over the scales of its numbers from which it is not identifiable."""


def interval_ends(work: Work, point: Floats, linear: Linear, times: float) -> tuple[Floats, Floats]:
    """Return the lower and upper ends of all numbers, scaled: ``times`` the standard errors, or more where laws bend.

    Only ends of numbers that are sought are moved, and none inwards. One beyond which nothing tells is its bound.
    """
    covariance = linear.root @ linear.root.T
    wide = times * np.sqrt(np.diag(covariance))
    low, high = np.maximum(point - wide, work.low), np.minimum(point + wide, work.high)
    least = cost_of(work, work.one(point), point, linear)
    for number in np.flatnonzero(work.prior == 0.0).tolist():
        for ends, bound in ((low, work.low[number]), (high, work.high[number])):
            offset = float(ends[number] - point[number])
            if offset != 0.0:
                straight = point + covariance[:, number] / covariance[number, number] * offset
                ends[number] = _end(work, point, least, linear, number, float(bound), straight, times)
    return low, high


def _end(
    work: Work,
    point: Floats,
    least: float,
    linear: Linear,
    number: int,
    bound: float,
    straight: Floats,
    times: float,
) -> float:
    """Return one end of the interval of a number, between the one of the straight line and its bound.

    ``least`` are the squares at the estimate, ``straight`` is the point where the straight line has the end.
    """
    inner, near = point, 0.0
    outer: Floats | None = None
    far, tried = math.inf, straight
    for _ in range(_TRIES):
        squares, reached = _least_beside(work, tried, number, linear)
        # By how many standard errors priors and samples tell this point from the estimate.
        parted = math.sqrt(max(squares - least, 0.0))
        if parted * (_BENT if inner is point else 1.0) < times:
            inner, near = reached, parted
            if float(inner[number]) == bound:
                return bound
        elif inner is point:
            return float(straight[number])
        else:
            outer, far = reached, parted
        if outer is not None and abs(outer[number] - inner[number]) < _NARROW * abs(inner[number] - point[number]):
            break
        further = min(max(times / max(near, 0.1), _FURTHER), 2.0)
        tried = point + further * (inner - point) if outer is None else 0.5 * (inner + outer)
    if outer is None:
        return bound
    share = (times - near) / (far - near)
    return float(inner[number] + share * (outer[number] - inner[number]))


def _least_beside(work: Work, point: Floats, number: int, linear: Linear) -> tuple[float, Floats]:
    """Return the least squares with a number held where it is at a point, and where they are.

    The others take Gauss-Newton steps on the Jacobian of the estimate. Infinite where no run succeeds.
    """
    covariance, slopes = linear.root @ linear.root.T, linear.rows[:, 1:]
    least, best = math.inf, np.clip(point, work.low, work.high)
    tried = best
    for _ in range(_CORRECTIONS + 1):
        errors = whitened_errors(work, work.at(tried[:, None]), linear)
        squares = float(squares_of(work, errors, tried[:, None])[0])
        if squares < least:
            least, best = squares, tried
        pull = slopes.T @ errors[:, 0] + np.square(work.prior) * (tried - work.mean)
        step = -covariance @ pull
        # Of all steps, the one that leaves the number where it is held.
        step -= covariance[:, number] / covariance[number, number] * step[number]
        # To first order the squares fall by that much.
        if not -float(pull @ step) > _STILL:
            break
        tried = np.clip(tried + step, work.low, work.high)
    return least, best


def unidentified(covariance: Floats, names: Sequence[str]) -> Iterator[dict[str, float]]:
    """Return combinations of scaled numbers whose standard error is above half their scale, as weights."""
    variances, vectors = np.linalg.eigh(covariance)
    for variance, vector in zip(variances[::-1].tolist(), vectors.T[::-1], strict=True):
        if math.sqrt(max(variance, 0.0)) > _UNKNOWN:
            largest = float(vector[np.argmax(np.abs(vector))])
            weights = {name: float(one) / largest for name, one in zip(names, vector, strict=True)}
            yield {name: one for name, one in weights.items() if abs(one) >= 0.1}
