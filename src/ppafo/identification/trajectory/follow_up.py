"""Questions to a finished fit: the profile likelihood of a number, and which further experiment would say most."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.errors import IdentificationError, nearest_name
from ppafo.identification.estimate import interval_factor
from ppafo.identification.trajectory.fitting import TrajectoryFit
from ppafo.identification.trajectory.information import covariance, data_information, directions_for
from ppafo.identification.trajectory.problem import FITTED_CHANNELS, Range, full_path, reach_of
from ppafo.identification.trajectory.residuals import (
    Floats,
    Measured,
    PreparedExperiment,
    Residuals,
    Samples,
    coordinate_bounds,
    prepare_samples,
    trajectories,
)
from ppafo.identification.trajectory.search import descend, moved_alone
from ppafo.simulation.scenario import Scenario

POINTS_PER_SIDE = 4
REACH = 1.33
"""Half widths of an interval on each side that a profile covers."""


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
    """Return the profile likelihood of one fitted number; each of its points is a search over all the others.

    Numbers are in the SI unit of the parameter. IdentificationError for a path that was not fitted.
    """
    names, full = [item.name for item in fit.optimum.residuals.ranges], full_path(path, fit.scenarios[0])
    if full not in names:
        raise IdentificationError(f"'{path}' was not fitted{nearest_name(full, names)}; fitted: {', '.join(names)}")
    index = names.index(full)
    item, at = fit.optimum.residuals.ranges[index], float(fit.optimum.point[index])
    # The number is held at a few coordinates on each side, going away from its estimate.
    low, high = (float(side[index]) for side in coordinate_bounds(fit.optimum.residuals.ranges))
    fractions = np.arange(1, POINTS_PER_SIDE + 1) / POINTS_PER_SIDE
    error = float(np.sqrt(fit.uncertainty.covariance[index, index]))
    reach = REACH * interval_factor(fit.problem.search.confidence) * error
    down, up = min(reach, at - low), min(reach, high - at)
    below = _side(fit, index, at - down * fractions) if down > 0.0 else {}
    above = _side(fit, index, at + up * fractions) if up > 0.0 else {}
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


def _side(fit: TrajectoryFit, index: int, coordinates: Floats) -> dict[float, float]:
    """Return the rise at coordinates on one side; each search starts where the last ended, moved along the valley."""
    best, curvature = fit.optimum, fit.uncertainty.curvature
    residuals, search = best.residuals, replace(fit.problem.search, loss="linear")
    point = best.point.copy()
    others = np.arange(len(point)) != index
    # The variance of the coordinate over what the curvature of the cost alone would make it.
    inflation = float(fit.uncertainty.covariance[index, index] / covariance(curvature)[index, index])
    # How the other coordinates follow along the floor of the valley.
    part = curvature[np.ix_(others, others)]
    valley = -covariance(part) @ curvature[others, index] if others.any() else np.zeros(0)
    found = {}
    for coordinate in coordinates:
        point[others] += valley * (coordinate - point[index])
        point[index] = coordinate
        held = residuals.hold({index: float(point[index])})
        prior = _half_square(residuals.of_priors(point)) - _half_square(held.of_priors(point[others]))
        if held.ranges:
            low, high = coordinate_bounds(held.ranges)
            start = np.clip(point[others], low, high)
            done = descend(held, start, directions_for(part, moved_alone(start, held.ranges)), search)
            cost, point[others] = done.cost + prior, done.point
        else:
            cost = _half_square(residuals.of_data(point[None, :])[:, 0]) + prior
        found[float(coordinate)] = max(0.0, 2.0 * (cost - best.cost)) / inflation
    return found


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
    fraction = (wanted - roots[last - 1]) / (roots[last] - roots[last - 1])
    return item.number(float(places[last - 1] + fraction * (places[last] - places[last - 1])))


_WIDEST = math.log(100.0)
"""Half width in coordinates that a number is allowed at most: what is not known at all is known to a factor of 100."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """An experiment that could be done: its scenario, the noise of each channel [rad], [Pa], time between samples [s].

    The devices of candidates are those of their scenarios with the fitted numbers put in.
    """

    label: str
    scenario: Scenario
    noise: Mapping[str, float]
    interval: float = 1.0e-3


@dataclass(frozen=True, slots=True)
class Expected:
    """What a candidate would bring.

    ``gain`` is half the growth of the logarithm of the determinant of the information [-] (D-optimality): the volume of
    the region of all parameters shrinks by exp(gain). ``shrinkage`` is, by parameter, the standard error afterwards
    over the one now. ``most_helped`` names the parameter that gains most.
    """

    label: str
    gain: float
    shrinkage: Mapping[str, float]
    most_helped: str


def expected_information(fit: TrajectoryFit, candidates: Sequence[Candidate]) -> tuple[Expected, ...]:
    """Return what each candidate would bring, the most informative first.

    IdentificationError for a candidate without noise in a channel that can be fitted.
    """
    ranges, point = fit.optimum.residuals.ranges, fit.optimum.point
    # What is known: the inverse of the covariance, and an even distribution between the bounds, which keeps all finite.
    low, high = coordinate_bounds(ranges)
    of_bounds = np.diag(12.0 / np.square(np.minimum(high - low, 2.0 * _WIDEST)))
    known = covariance(fit.uncertainty.covariance) + of_bounds
    directions = directions_for(known, moved_alone(point, ranges))
    brought = [_expect(fit, known, candidate, directions) for candidate in candidates]
    return tuple(sorted(brought, key=lambda one: -one.gain))


def _expect(fit: TrajectoryFit, known: Floats, candidate: Candidate, directions: Floats) -> Expected:
    ranges, point = fit.optimum.residuals.ranges, fit.optimum.point
    acting = tuple(item for item in ranges if not item.recordings)
    place = [index for index, item in enumerate(ranges) if not item.recordings]
    residuals = Residuals((_imagine(candidate, acting, point[place]),), acting)
    part = np.diag(np.max(np.abs(directions[place]), axis=1)) if len(place) < len(ranges) else directions
    jacobian = residuals.around(point[place], part).jacobian_of_data()
    after = known.copy()
    after[np.ix_(place, place)] += data_information(jacobian, np.ones(len(jacobian)))
    errors, errors_after = (np.sqrt(np.diag(covariance(matrix))) for matrix in (known, after))
    shrinkage = {item.name: float(fraction) for item, fraction in zip(ranges, errors_after / errors, strict=True)}
    gain = 0.5 * float(np.linalg.slogdet(after)[1] - np.linalg.slogdet(known)[1])
    return Expected(candidate.label, gain, shrinkage, min(shrinkage, key=lambda name: shrinkage[name]))


def _imagine(candidate: Candidate, ranges: tuple[Range, ...], point: Floats) -> PreparedExperiment:
    """Return the candidate as an experiment whose samples are the model's own."""
    unknown = [name for name in candidate.noise if name not in FITTED_CHANNELS]
    if unknown or not candidate.noise or not all(noise > 0.0 for noise in candidate.noise.values()):
        raise IdentificationError(
            f"candidate '{candidate.label}': noise must be above 0 for at least one of {', '.join(FITTED_CHANNELS)}"
        )
    count = math.floor(candidate.scenario.duration / candidate.interval + 1.0e-6)
    time: Floats = candidate.interval * np.arange(count + 1, dtype=np.float64)
    numbers = {item.path: item.number(float(z)) for item, z in zip(ranges, point, strict=True)}
    empty = tuple(Measured(name, np.zeros(time.size), noise) for name, noise in candidate.noise.items())
    samples = Samples(time, empty, reach_of(ranges))
    prepared = prepare_samples(candidate.label, candidate.scenario, samples, numbers)
    signals = trajectories([prepared], ranges, point[None, :])[0]
    filled = tuple(Measured(one.name, signals[one.name][:, 0], one.noise) for one in empty)
    return replace(prepared, samples=replace(samples, channels=filled))
