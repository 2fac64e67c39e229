"""Profile likelihood: how much worse the best fit becomes when one number is held away from its estimate."""

from dataclasses import dataclass, replace

import numpy as np

from ppafo.errors import IdentificationError, nearest_name
from ppafo.identification.trajectory.information import covariance, directions_for
from ppafo.identification.trajectory.paths import full_path
from ppafo.identification.trajectory.preparation import Floats
from ppafo.identification.trajectory.ranges import Range
from ppafo.identification.trajectory.residuals import coordinate_bounds
from ppafo.identification.trajectory.result import TrajectoryFit
from ppafo.identification.trajectory.search import descend, is_at_bound
from ppafo.identification.trajectory.verdicts import interval_factor

POINTS_PER_SIDE = 4
REACH = 2.6
"""Standard errors on each side that a profile covers; a 95 % interval ends at 1.96 of them."""


@dataclass(frozen=True, slots=True)
class Profile:
    """Rise of the misfit over its least, by number held, all others fitted anew.

    ``numbers`` in ``unit`` grow; ``rises`` are twice the log likelihood lost [-], over the inflation of the fit;
    ``low`` and ``high`` bound the interval in which the rise stays below ``threshold``, None where the profile never
    reaches it on that side: the recordings do not bound the number there.
    """

    path: str
    unit: str
    numbers: Floats
    rises: Floats
    threshold: float
    low: float | None
    high: float | None


def profile(fit: TrajectoryFit, path: str) -> Profile:
    """Return the profile likelihood of one fitted number; each of its points is a search over all the others."""
    index = _index(fit, path)
    item, at = fit.optimum.residuals.ranges[index], float(fit.optimum.point[index])
    below, above = (dict(_side(fit, index, coordinates)) for coordinates in _held(fit, index))
    rises = {**below, at: 0.0, **above}
    places = np.array(sorted(rises))
    heights = np.array([rises[place] for place in places])
    threshold = interval_factor(fit.problem.search.confidence) ** 2
    middle = int(np.searchsorted(places, at))
    return Profile(
        path=item.name,
        unit=item.unit,
        numbers=np.array([item.number(float(place)) for place in places]),
        rises=heights,
        threshold=threshold,
        low=_crossing(item, places[middle::-1], heights[middle::-1], threshold),
        high=_crossing(item, places[middle:], heights[middle:], threshold),
    )


def _index(fit: TrajectoryFit, path: str) -> int:
    names = [item.name for item in fit.optimum.residuals.ranges]
    full = full_path(path, fit.scenarios[0])
    if full not in names:
        raise IdentificationError(f"'{path}' was not fitted{nearest_name(full, names)}; fitted: {', '.join(names)}")
    return names.index(full)


def _held(fit: TrajectoryFit, index: int) -> tuple[Floats, Floats]:
    """Return the coordinates at which a number is held, below and above its estimate, going away from it."""
    at = float(fit.optimum.point[index])
    low, high = (float(side[index]) for side in coordinate_bounds(fit.optimum.residuals.ranges))
    error = float(np.sqrt(fit.uncertainty.covariance[index, index]))
    shares = np.arange(1, POINTS_PER_SIDE + 1) / POINTS_PER_SIDE
    down, up = min(REACH * error, at - low), min(REACH * error, high - at)
    return (at - down * shares if down > 0.0 else shares[:0]), (at + up * shares if up > 0.0 else shares[:0])


def _side(fit: TrajectoryFit, index: int, coordinates: Floats) -> list[tuple[float, float]]:
    """Return coordinate and rise on one side; each search starts where the last one ended, moved along the valley."""
    best, curvature = fit.optimum, fit.uncertainty.curvature
    point = best.point.copy()
    others = np.arange(len(point)) != index
    inflation = _inflation(fit, index)
    valley = _valley(curvature, index, others)
    found = []
    for coordinate in coordinates:
        point[others] += valley * (coordinate - point[index])
        point[index] = coordinate
        cost, point[others] = _best_of_others(fit, index, point)
        found.append((float(coordinate), max(0.0, 2.0 * (cost - best.cost)) / inflation))
    return found


def _inflation(fit: TrajectoryFit, index: int) -> float:
    """Return the variance of a coordinate over what the curvature of the cost alone would make it."""
    uncertainty = fit.uncertainty
    return float(uncertainty.covariance[index, index] / covariance(uncertainty.curvature)[index, index])


def _valley(information: Floats, index: int, others: "np.ndarray[tuple[int], np.dtype[np.bool_]]") -> Floats:
    """Return how the other coordinates follow one that is moved, along the floor of the valley."""
    if not others.any():
        return np.zeros(0)
    return np.asarray(-covariance(information[np.ix_(others, others)]) @ information[others, index])


def _best_of_others(fit: TrajectoryFit, index: int, point: Floats) -> tuple[float, Floats]:
    """Return the least cost with one coordinate held, and where the others are then."""
    residuals, search = fit.optimum.residuals, replace(fit.problem.search, loss="linear")
    others = np.arange(len(point)) != index
    held = residuals.holding({index: float(point[index])})
    prior = _half_square(residuals.of_priors(point)) - _half_square(held.of_priors(point[others]))
    if not held.ranges:
        return _half_square(residuals.of_data(point[None, :])[:, 0]) + prior, point[others]
    low, high = coordinate_bounds(held.ranges)
    start = np.clip(point[others], low, high)
    part = fit.uncertainty.curvature[np.ix_(others, others)]
    done = descend(held, start, directions_for(part, is_at_bound(start, held.ranges)), search)
    return done.cost + prior, done.point


def _half_square(values: Floats) -> float:
    return 0.5 * float(values @ values)


def _crossing(item: Range, places: Floats, heights: Floats, threshold: float) -> float | None:
    """Return the number at which the rise passes the threshold, going away from the estimate; None if it never does.

    Between two points the square root of the rise, a straight line for a parabola, is interpolated.
    """
    roots, wanted = np.sqrt(heights), np.sqrt(threshold)
    over = np.flatnonzero(roots >= wanted)
    if not over.size or over[0] == 0:
        return None
    last = int(over[0])
    share = (wanted - roots[last - 1]) / (roots[last] - roots[last - 1])
    return item.number(float(places[last - 1] + share * (places[last] - places[last - 1])))
