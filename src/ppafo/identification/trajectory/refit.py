"""A fit with one effect more: all numbers and the size of the effect at once, and by how much it is likelier."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.identification.noise.choice import sensor_noise
from ppafo.identification.noise.heavy_tails import sample_weights
from ppafo.identification.noise.sensor_noise import SensorNoise
from ppafo.identification.noise.shapes import from_reflections
from ppafo.identification.trajectory.directions.catalogue import EFFECT_DIRECTIONS
from ppafo.identification.trajectory.directions.changes import (
    can_have,
    fitted_experiment,
    with_heat,
    with_unfelt,
)
from ppafo.identification.trajectory.directions.heat import HEAT
from ppafo.identification.trajectory.directions.kind import Direction
from ppafo.identification.trajectory.information import inverse_with_root, solution
from ppafo.identification.trajectory.posterior import LinearModel, whiten
from ppafo.identification.trajectory.residuals import (
    Floats,
    Mask,
    PreparedExperiment,
    columns_in,
    coordinate_bounds,
    signals_at,
)
from ppafo.identification.trajectory.search import WhitenedFit
from ppafo.simulation.numbers import number_at

_STEP = 6.0e-4
"""Step of a difference in coordinates: impacts bend, so that one of a percent would be another experiment."""
_OF_SIZE = 0.03
"""The same of a size, as a fraction of it."""
_ROUNDS = 3
_TURNS = 8
_STARTS = 3
"""Sizes of an effect from which a fit with it is searched at most."""
_FRACTIONS = (1.0, 0.5, 0.2, 0.05)
"""Of a step that is tried, the longest that lowers the misfit most."""
_SETTLED = 0.1
"""Standard errors by which a step moves the size when it is the last."""
_SMALLEST, _LARGEST = 0.1, 3.0
"""Size that a search may end at, over the least and the largest of its direction."""
_REST = 0.1
"""Share of what a model leaves beyond white noise below which the rest is explained."""
_OF_CHANCE = 4.0
"""The same in standard errors of what white noise leaves."""
_NOTHING = 1.0e-9


@dataclass(frozen=True, slots=True)
class Likelihood:
    """A linear model with the noise that suits it best.

    ``value`` is twice the log likelihood [-] less what Akaike's criterion takes for noise, ``move`` the change of its
    coordinates to its least, ``covariance`` that of all columns then. ``excess`` [-] are the squares that no numbers
    explain, over what white noise of the sensors would leave.
    """

    value: float
    move: Floats
    covariance: Floats
    excess: float
    samples: int

    def explains_beside(self, without: "Likelihood") -> bool:
        """Return whether hardly more than white noise is left, or little of what is left ``without`` what is new."""
        return self.excess < max(_REST * without.excess, _OF_CHANCE * math.sqrt(2.0 * self.samples))


@dataclass(frozen=True, slots=True)
class Refit:
    """What a fit with one effect found: ``point`` and standard ``errors`` of all coordinates with it.

    ``size`` and its ``error`` are in the SI unit of the effect; ``gain`` [-] is by how much twice the logarithm of the
    likelihood rises, less 2 for the number that is new. ``explains`` says whether hardly more than white noise is left.
    """

    size: float
    error: float
    point: Floats
    errors: Floats
    gain: float
    explains: bool


def likelihood_with(found: WhitenedFit, model: LinearModel, more: Floats) -> Likelihood:
    """Return the likelihood of a linear model with ``more`` columns of residuals (samples, columns) of unknown sizes.

    The noise of each sensor may be of any kind.
    """
    whole = replace(model, columns=np.hstack([model.slopes, more, model.residuals[:, None]]))
    noises, weights = found.noises, tuple(sensor.weights for sensor in found.sensors)
    pulled, best = len(model.pull), None
    for _ in range(_ROUNDS):
        move, covariance = _least(whole, noises, weights)
        left = whole.residuals + whole.slopes @ move
        parts = [whole.segments(left, place) for place in range(len(model.sensors))]
        noises = tuple(
            sensor_noise(own, one.is_given, one.courses) for own, one in zip(parts, found.sensors, strict=True)
        )
        weights = tuple(tuple(sample_weights(noise, own)) for noise, own in zip(noises, parts, strict=True))
        of_priors = float(move[:pulled] @ (2.0 * model.pull + model.precision @ move[:pulled]))
        value = 2.0 * sum(one.likelihood - one.numbers for one in noises) - of_priors
        if best is None or value > best.value:
            best = Likelihood(value, move, covariance, _excess(whole), len(whole.residuals))
    assert best is not None
    return best


def _least(
    whole: LinearModel, noises: Sequence[SensorNoise], weights: Sequence[Sequence[Floats]]
) -> tuple[Floats, Floats]:
    """Return where a linear model is least under some noise, and the covariance of all its columns there.

    Pull and precision of priors are those of its first columns.
    """
    pulled = len(whole.pull)
    units = np.maximum(np.max(np.abs(whole.slopes), axis=0, initial=0.0), _NOTHING)
    units[:pulled] = 1.0
    rows = whiten(whole, noises, weights)
    rows[:, :-1] /= units
    information, product = rows[:, :-1].T @ rows[:, :-1], rows[:, :-1].T @ rows[:, -1]
    information[:pulled, :pulled] += whole.precision
    product[:pulled] += whole.pull
    return -solution(information, product) / units, inverse_with_root(information)[0] / np.outer(units, units)


def _excess(whole: LinearModel) -> float:
    """Return the squares [-] that no numbers explain, over what white noise of the sensors would leave."""
    columns = whole.slopes
    left: Floats = whole.residuals - columns @ np.linalg.lstsq(columns, whole.residuals, rcond=1.0e-12)[0]
    return float(left @ left) - float(len(left) - columns.shape[1])


def refit_with(
    found: WhitenedFit, starts: Floats, direction: Direction, start: float, without: Likelihood
) -> Refit | None:
    """Return the fit with an effect of the device; None where no run succeeds with it.

    It is searched from the best of the sizes of its direction and ``start``, for a line through a curve may point the
    wrong way, and under white noise: flexible noise has taken up what the effect would explain. Where that explains
    too little it is searched from the next best. ``starts`` are the slopes of starts that were read off a recording,
    ``without`` is the likelihood without the effect.
    """
    runs = _Runs.of(found, direction)
    first = found.optimum.point
    ends = _SMALLEST * direction.sizes[0], _LARGEST * direction.largest
    sizes = np.array([min(max(start, ends[0]), ends[1]), *direction.sizes])
    values = runs.residuals(np.repeat(first[None, :], len(sizes), axis=0), sizes)
    costs = _squares(values, np.hstack([found.model.slopes, starts]))
    best: Refit | None = None
    for place in np.argsort(costs, kind="stable")[:_STARTS]:
        tried = _refit_from(found, starts, runs, float(sizes[place]), ends, without)
        if tried is not None and (best is None or tried.gain > best.gain):
            best = tried
        if best is not None and best.explains:
            break
    return best


def _refit_from(
    found: WhitenedFit, starts: Floats, runs: "_Runs", size: float, ends: tuple[float, float], without: Likelihood
) -> Refit | None:
    """Return the fit with an effect, searched from one size of it, which stays between two ``ends``."""
    first, kept = found.optimum.point, len(found.optimum.point)
    hum, precision, pull_at = found.model.slopes[:, kept:], found.model.precision, found.model.pull
    low, high = coordinate_bounds(found.optimum.residuals.ranges)
    point = first
    white = [SensorNoise(from_reflections(np.zeros(0)), np.ones(len(one.places))) for one in found.sensors]
    even = [[np.ones(place.stop - place.start) for place in one.places] for one in found.sensors]
    for turn in range(_TURNS):
        near = _around(runs, point, size)
        if near is None:
            return None
        left, slopes, of_size = near
        shift = point - first
        pull = pull_at.copy()
        pull[:kept] += precision[:kept, :kept] @ shift
        model = replace(found.model, columns=np.hstack([slopes, hum, left[:, None]]), pull=pull)
        more = np.column_stack([of_size, starts])
        whole = replace(model, columns=np.hstack([model.slopes, more, left[:, None]]))
        move, covariance = _least(whole, white, even)
        step = float(np.clip(size + move[len(pull)], *ends)) - size
        is_last = abs(step) < _SETTLED * math.sqrt(max(float(covariance[len(pull), len(pull)]), 0.0))
        if turn < _TURNS - 1 and not is_last:
            reached = np.clip(point + move[:kept], low, high)
            moves = [(point + share * (reached - point), size + share * step) for share in _FRACTIONS]
            values = runs.residuals(np.array([one for one, _ in moves]), np.array([one for _, one in moves]))
            costs = _squares(np.column_stack([values, left]), np.hstack([hum, starts]))
            best = int(np.argmin(costs))
            if best < len(moves):
                point, size = moves[best]
                continue
        likely = likelihood_with(found, model, more)
        # The priors were given for the first point: what they have lost since then is part of the likelihood.
        of_priors = float(shift @ (2.0 * pull_at[:kept] + precision[:kept, :kept] @ shift))
        deviations = np.sqrt(np.maximum(np.diag(likely.covariance), 0.0))
        return Refit(
            size=float(np.clip(size + likely.move[len(pull)], *ends)),
            error=float(deviations[len(pull)]),
            point=np.clip(point + likely.move[:kept], low, high),
            errors=deviations[:kept],
            gain=likely.value - of_priors - without.value - 2.0,
            explains=likely.explains_beside(without),
        )
    raise AssertionError("the last turn returns")


def _squares(values: Floats, free: Floats) -> list[float]:
    """Return the squares [-] that are left of columns with free ones as they suit best; infinite for a failed run."""
    is_run: Mask = np.asarray(np.isfinite(values).all(axis=0))
    ran = np.where(is_run, values, 0.0)
    left = ran - free @ np.linalg.lstsq(free, ran, rcond=1.0e-12)[0] if free.shape[1] else ran
    return [float(one @ one) if ok else math.inf for one, ok in zip(left.T, is_run.tolist(), strict=True)]


def _around(runs: "_Runs", point: Floats, size: float) -> tuple[Floats, Floats, Floats] | None:
    """Return residuals [-] at a point and a size, their slopes over coordinates and size; None for a failed run."""
    count = len(point)
    steps = np.vstack([np.eye(count) * _STEP, -np.eye(count) * _STEP, np.zeros((3, count))])
    sizes = np.full(2 * count + 3, size)
    sizes[2 * count : 2 * count + 2] *= (1.0 + _OF_SIZE, 1.0 - _OF_SIZE)
    values = runs.residuals(point + steps, sizes)
    if not np.isfinite(values).all():
        return None
    slopes = (values[:, :count] - values[:, count : 2 * count]) / (2.0 * _STEP)
    of_size = (values[:, 2 * count] - values[:, 2 * count + 1]) / (2.0 * _OF_SIZE * size)
    return values[:, -1], slopes, of_size


@dataclass(frozen=True, slots=True)
class _Runs:
    """The experiments of a fit on a program in which an effect acts."""

    found: WhitenedFit
    direction: Direction
    made: tuple[PreparedExperiment, ...]

    @classmethod
    def of(cls, found: WhitenedFit, direction: Direction) -> "_Runs":
        """Make them ready, on the program that the search of directions has compiled."""
        residuals = found.optimum.residuals
        made = []
        for one in residuals.experiments:
            fitted = fitted_experiment(one, residuals, found.optimum.point)
            if direction is HEAT:
                scenario, effects = with_heat(fitted.scenario), [direction]
            else:
                scenario, effects = fitted.scenario, [it for it in EFFECT_DIRECTIONS if can_have(fitted.scenario, it)]
            made.append(one if scenario is None or direction not in effects else with_unfelt(fitted, scenario, effects))
        return cls(found, direction, tuple(made))

    def residuals(self, points: Floats, sizes: Floats) -> Floats:
        """Return residuals [-] (samples, points) at points (points, coordinates) with sizes; NaN for a failure."""
        parts = []
        for one in self.made:
            columns = columns_in(one.label, self.found.optimum.residuals.ranges, points)
            for lane, size in enumerate(sizes.tolist()):
                for path, number in self.direction.settings(size, one.scenario).items():
                    columns.setdefault(path, np.full(len(sizes), number_at(one.scenario, path)))[lane] = number
            signals = signals_at(one, columns, len(sizes))
            parts += [(signals[c.name] - c.values[:, None]) / c.noise for c in one.channels]
        return np.concatenate(parts)
