"""Expected information: which further experiment would narrow the intervals of a fit most, before anyone does it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.trajectory.columns import trajectories
from ppafo.identification.trajectory.experiment import FITTED_CHANNELS
from ppafo.identification.trajectory.information import covariance, data_information, directions_for
from ppafo.identification.trajectory.preparation import Floats, Measured, Prepared, Samples, prepared_times
from ppafo.identification.trajectory.ranges import Range, reach_of
from ppafo.identification.trajectory.residuals import Residuals, coordinate_bounds
from ppafo.identification.trajectory.result import TrajectoryFit
from ppafo.identification.trajectory.search import is_at_bound
from ppafo.simulation.scenario import Scenario

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
    """Return what each candidate would bring, the most informative first."""
    ranges, point = fit.optimum.residuals.ranges, fit.optimum.point
    known = _known(fit) + _what_bounds_say(ranges)
    directions = directions_for(known, is_at_bound(point, ranges))
    brought = [_expected(fit, known, candidate, directions) for candidate in candidates]
    return tuple(sorted(brought, key=lambda one: -one.gain))


def _known(fit: TrajectoryFit) -> Floats:
    """Return the information that the covariance of a fit stands for."""
    return covariance(fit.uncertainty.covariance)


def _expected(fit: TrajectoryFit, known: Floats, candidate: Candidate, directions: Floats) -> Expected:
    ranges, point = fit.optimum.residuals.ranges, fit.optimum.point
    acting = tuple(item for item in ranges if not item.recordings)
    place = [index for index, item in enumerate(ranges) if not item.recordings]
    residuals = Residuals((_imagined(candidate, acting, point[place]),), acting)
    part = np.diag(np.max(np.abs(directions[place]), axis=1)) if len(place) < len(ranges) else directions
    jacobian = residuals.around(point[place], part).jacobian_of_data()
    after = known.copy()
    after[np.ix_(place, place)] += data_information(jacobian, np.ones(len(jacobian)))
    errors, errors_after = (np.sqrt(np.diag(covariance(matrix))) for matrix in (known, after))
    shrinkage = {item.name: float(share) for item, share in zip(ranges, errors_after / errors, strict=True)}
    gain = 0.5 * float(np.linalg.slogdet(after)[1] - np.linalg.slogdet(known)[1])
    return Expected(candidate.label, gain, shrinkage, min(shrinkage, key=lambda name: shrinkage[name]))


def _imagined(candidate: Candidate, ranges: tuple[Range, ...], point: Floats) -> Prepared:
    """Return the candidate as an experiment whose samples are the model's own."""
    unknown = [name for name in candidate.noise if name not in FITTED_CHANNELS]
    if unknown or not candidate.noise or not all(noise > 0.0 for noise in candidate.noise.values()):
        raise IdentificationError(
            f"candidate '{candidate.label}': noise must be above 0 for some of {', '.join(FITTED_CHANNELS)}"
        )
    count = math.floor(candidate.scenario.duration / candidate.interval + 1.0e-6)
    time: Floats = candidate.interval * np.arange(count + 1, dtype=np.float64)
    numbers = {item.path: item.number(float(z)) for item, z in zip(ranges, point, strict=True)}
    empty = tuple(Measured(name, np.zeros(time.size), noise) for name, noise in candidate.noise.items())
    samples = Samples(time, empty, reach_of(ranges))
    prepared = prepared_times(candidate.label, candidate.scenario, samples, numbers)
    signals = trajectories([prepared], ranges, point[None, :])[0]
    filled = tuple(Measured(one.name, signals[one.name][:, 0], one.noise) for one in empty)
    return replace(prepared, samples=replace(samples, channels=filled))


def _what_bounds_say(ranges: Sequence[Range]) -> Floats:
    """Return the information of the bounds alone, as of an even distribution between them; it keeps all finite."""
    low, high = coordinate_bounds(ranges)
    return np.diag(12.0 / np.square(np.minimum(high - low, 2.0 * _WIDEST)))
