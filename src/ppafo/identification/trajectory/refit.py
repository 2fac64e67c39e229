"""A fit with one effect more, all numbers, size and forms of the effect at once, and by how much it is likelier.

A point of the search has the coordinates of the fit, then the logarithms of the forms of the effect and of its size.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.identification.linear_systems import inverse_of_steps
from ppafo.identification.noise.choice import Left, sensor_noises
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
from ppafo.identification.trajectory.information import directions_for, inverse_with_root, solution
from ppafo.identification.trajectory.posterior import LinearModel, whiten
from ppafo.identification.trajectory.problem import Search, with_numbers
from ppafo.identification.trajectory.residuals import (
    FIRST_STEP,
    Floats,
    Mask,
    PreparedExperiment,
    Residuals,
    columns_in,
    coordinate_bounds,
    signals_at,
)
from ppafo.identification.trajectory.search import WhitenedFit, descend
from ppafo.simulation.numbers import number_at

_STEP = 6.0e-4
"""Step of a difference in coordinates from afar: impacts bend, and one of a percent would be another experiment."""
_OF_SIZE = 0.03
"""The same of a size, as a fraction of it."""
_ROUNDS = 3
_TURNS = 25
_STARTS = 2
"""Sizes of an effect from which a fit with it is searched from afar at most."""
_DAMPINGS = (0.0, 1.0e-3, 1.0e-2, 0.1, 1.0, 10.0, 100.0)
"""Of the steps that are tried (Levenberg and Marquardt), in shares of the information of each number."""
_SETTLED = 0.3
"""Fall of the squares [-] below which a search is at its end: no number moves by a notable part of its error."""
_SLOW, _PATIENCE = 0.02, 3
"""Fraction of what is left by which a step must lower it, and how many in a row may not."""
_QUICK, _NEAR = Search(), 1.0e-4
"""Of a search with the size held, that only comes near."""
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
    likelihood rises, less 2 for each number that is new. ``is_of_any_form`` says that the form of the effect is one of
    these, so that the errors know of it. ``explains`` says whether hardly more than white noise is left,
    or little of what is left without it; ``is_all`` whether no more is left than white noise leaves.
    """

    size: float
    error: float
    point: Floats
    errors: Floats
    gain: float
    is_of_any_form: bool
    explains: bool
    is_all: bool


def likelihood_with(found: WhitenedFit, model: LinearModel, more: Floats) -> Likelihood:
    """Return the likelihood of a linear model with ``more`` columns of residuals (samples, columns) of unknown sizes.

    The noise of each sensor may be of any kind.
    """
    whole = replace(model, columns=np.hstack([model.slopes, more, model.residuals[:, None]]))
    white = from_reflections(np.zeros(0))
    of_one = [tuple(np.ones(place.stop - place.start) for place in places) for places in model.sensors]
    # The noise of a fit without the effect may have taken up what it explains, and would lead back to itself.
    begins = (
        (found.noises, tuple(sensor.weights for sensor in found.sensors)),
        (tuple(SensorNoise(white, np.ones(len(places))) for places in model.sensors), tuple(of_one)),
    )
    pulled, best = len(model.pull), None
    for begin in begins:
        noises, weights = begin
        for _ in range(_ROUNDS):
            move, covariance = _least(whole, noises, weights)
            left = whole.residuals + whole.slopes @ move
            parts = [whole.segments(left, place) for place in range(len(model.sensors))]
            noises = sensor_noises(
                [Left(own, one.is_given, one.courses) for own, one in zip(parts, found.sensors, strict=True)]
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
    """Return the fit with an effect of the device, searched from the fit without it; None where no run succeeds.

    It begins at the best of the sizes of its direction and ``start``, for a line through a curve may point the wrong
    way, and under white noise: flexible noise has taken up what the effect would explain. ``starts`` are the slopes of
    starts that were read off a recording, ``without`` is the likelihood without the effect.
    """
    runs, first = _Runs.of(found, direction), found.optimum.point
    low, high = _ends(direction)
    begins = np.array([runs.begin(first, size) for size in (min(max(start, low), high), *direction.sizes)])
    nearest = int(np.argmin(_squares(runs.residuals(begins), np.hstack([found.model.slopes, starts]))))
    # Where the form is free as well, a way from the size that is nearest in a straight line may end far from the best.
    middle = 1 + len(direction.sizes) // 2
    places = {nearest, middle} if direction.forms else {nearest}
    tried = [_refit_from(found, starts, runs, begins[place], without) for place in sorted(places)]
    return max((one for one in tried if one is not None), key=lambda one: one.gain, default=None)


def refit_from_afar(found: WhitenedFit, starts: Floats, direction: Direction, without: Likelihood) -> Refit | None:
    """Return the same, searched from where the fit itself began; None where no run succeeds.

    Numbers that were fitted without a large effect may be at their bounds, from where the way is long and bent. So all
    numbers are first fitted with each size held, and the best of these begin.
    """
    runs, held = _Runs.of(found, direction), []
    for size in direction.sizes:
        fitted = runs.with_size(size)
        if np.isfinite(fitted.of_data(fitted.start[None, :])).all():
            steps = np.diag(np.full(len(fitted.start), FIRST_STEP))
            ended = descend(fitted, fitted.start, steps, _QUICK, _NEAR)
            held.append((ended.cost, ended.point, size))
    best: Refit | None = None
    for _, point, size in sorted(held, key=lambda one: one[0])[:_STARTS]:
        tried = _refit_from(found, starts, runs, runs.begin(point, size), without)
        if tried is not None and (best is None or tried.gain > best.gain):
            best = tried
        if best is not None and best.is_all:
            break
    return best


def _ends(direction: Direction) -> tuple[float, float]:
    """Return the sizes between which a search stays."""
    return _SMALLEST * direction.sizes[0], _LARGEST * direction.largest


def _refit_from(found: WhitenedFit, starts: Floats, runs: "_Runs", begin: Floats, without: Likelihood) -> Refit | None:
    """Return the fit with an effect, searched from a point."""
    kept, forms = len(found.optimum.point), runs.direction.forms
    own = kept + len(forms)
    hum = found.model.slopes[:, kept:]
    free, width = np.hstack([hum, starts]), own + hum.shape[1]
    # The priors of what the linear model has, its coordinates and hum, and behind them those of the forms.
    of_model = [*range(kept), *range(own, width)]
    precision, pull_at = np.zeros((width, width)), np.zeros(width)
    precision[np.ix_(of_model, of_model)], pull_at[of_model] = found.model.precision, found.model.pull
    for place, form in enumerate(forms, start=kept):
        precision[place, place] = 1.0 / math.log(form.factor) ** 2
    first = runs.begin(found.optimum.point, 1.0)[:own]
    bounds = zip(coordinate_bounds(found.optimum.residuals.ranges), _ends(runs.direction), strict=True)
    of_forms = [[math.log(form.low) for form in forms], [math.log(form.high) for form in forms]]
    low, high = (np.array([*ends, *of_forms[side], math.log(size)]) for side, (ends, size) in enumerate(bounds))
    expected = float(len(found.model.residuals))
    at, slow = begin, 0
    steps, is_near = np.diag([*(_STEP for _ in range(kept)), *(_OF_SIZE for _ in range(kept, own + 1))]), False
    for turn in range(_TURNS):
        near = _around(runs, at, steps)
        if near is None:
            return None
        left, slopes = near
        if is_near:
            steps = _fine_steps(slopes, free, precision[:own, :own], (at <= low) | (at >= high))
        shift = at[:own] - first
        pull = pull_at.copy()
        pull[:own] += precision[:own, :own] @ shift
        if turn < _TURNS - 1 and slow < _PATIENCE:
            priors = first, pull_at[:own], precision[:own, :own]
            moved, cost, fall = _best_step(runs, at, (left, slopes, free), priors, (low, high))
            if fall > _SETTLED:
                slow = slow + 1 if fall < _SLOW * max(cost - expected, 0.0) else 0
                at = moved
                continue
        if not is_near and turn < _TURNS - 1:
            # Differences over more than a standard error make errors too small, and the end is not where they say.
            steps = _fine_steps(slopes, free, precision[:own, :own], (at <= low) | (at >= high))
            is_near, slow = True, 0
            continue
        near = _around(runs, at, steps)
        if near is None:
            return None
        left, slopes = near
        columns = np.hstack([slopes[:, :own], hum, left[:, None]])
        model = replace(found.model, columns=columns, pull=pull, precision=precision)
        likely = likelihood_with(found, model, np.column_stack([slopes[:, own], starts]))
        excess = _squares(left[:, None], free)[0] - expected
        # The priors were given for the first point: what they have lost since then is part of the likelihood.
        of_priors_here = float(shift @ (2.0 * pull_at[:own] + precision[:own, :own] @ shift))
        deviations = np.sqrt(np.maximum(np.diag(likely.covariance), 0.0))
        reached = np.clip(at + np.append(likely.move[:own], likely.move[width]), low, high)
        return Refit(
            size=math.exp(reached[own]),
            error=math.exp(reached[own]) * float(deviations[width]),
            point=reached[:kept],
            errors=deviations[:kept],
            gain=likely.value - of_priors_here - without.value - 2.0 * (1 + len(forms)),
            is_of_any_form=bool(forms),
            explains=replace(likely, excess=excess).explains_beside(without),
            is_all=excess < _OF_CHANCE * math.sqrt(2.0 * likely.samples),
        )
    raise AssertionError("the last turn returns")


def _best_step(
    runs: "_Runs",
    at: Floats,
    linear: tuple[Floats, Floats, Floats],
    priors: tuple[Floats, Floats, Floats],
    bounds: tuple[Floats, Floats],
) -> tuple[Floats, float, float]:
    """Return where the best of the damped steps from a point leads, the cost [-] at the point, and its fall.

    ``linear`` are residuals, slopes and what is free at the point; ``priors`` the point that they are counted from,
    their pull there and their precision; ``bounds`` the lowest and the highest coordinates.
    """
    (left, slopes, free), (first, pull, precision) = linear, priors
    count = len(first)
    shift = at[:count] - first
    moves = _damped_steps(slopes, free, left, pull + precision @ shift, precision)
    tried = np.clip(at + moves, *bounds)
    shifts = np.vstack([tried[:, :count] - first, shift])
    of_priors = 2.0 * shifts @ pull + np.einsum("ij,jk,ik->i", shifts, precision, shifts)
    costs = np.array(_squares(np.column_stack([runs.residuals(tried), left]), free)) + of_priors
    best = int(np.argmin(costs[:-1]))
    return tried[best], float(costs[-1]), float(costs[-1] - costs[best])


def _damped_steps(moving: Floats, free: Floats, left: Floats, pull: Floats, precision: Floats) -> Floats:
    """Return the steps (dampings, coordinates) of Levenberg and Marquardt along columns, what is free taken out.

    The last of ``moving`` (samples, coordinates) is the size, of which there is no prior; ``pull`` and ``precision``
    are those of the others.
    """
    information = _information(moving, free, precision)
    product = moving.T @ _without(free, left[:, None])[:, 0]
    product[: len(pull)] += pull
    own = np.diag(np.diag(information))
    return np.array([-solution(information + damping * own, product) for damping in _DAMPINGS])


def _fine_steps(slopes: Floats, free: Floats, precision: Floats, is_fixed: Mask) -> Floats:
    """Return steps of differences of one standard error along the principal directions."""
    return directions_for(_information(slopes, free, precision), is_fixed)


def _information(moving: Floats, free: Floats, precision: Floats) -> Floats:
    """Return the information of columns with what is free taken out, and that of the priors of all but the last."""
    columns, count = _without(free, moving), len(precision)
    information = np.asarray(columns.T @ columns)
    information[:count, :count] += precision
    return information


def _without(free: Floats, columns: Floats) -> Floats:
    """Return columns (samples, columns) less what free ones explain of them."""
    if not free.shape[1]:
        return columns
    return np.asarray(columns - free @ np.linalg.lstsq(free, columns, rcond=1.0e-12)[0])


def _squares(values: Floats, free: Floats) -> list[float]:
    """Return the squares [-] that are left of columns with free ones as they suit best; infinite for a failed run."""
    is_run: Mask = np.asarray(np.isfinite(values).all(axis=0))
    left = _without(free, np.where(is_run, values, 0.0))
    return [float(one @ one) if ok else math.inf for one, ok in zip(left.T, is_run.tolist(), strict=True)]


def _around(runs: "_Runs", at: Floats, steps: Floats) -> tuple[Floats, Floats] | None:
    """Return residuals [-] at a point and their slopes there (samples, coordinates); None for a failed run.

    ``steps`` are those of the differences, in units of the coordinates, as columns.
    """
    values = runs.residuals(np.vstack([at + steps.T, at - steps.T, at]))
    if not np.isfinite(values).all():
        return None
    return values[:, -1], 0.5 * (values[:, : len(at)] - values[:, len(at) : -1]) @ inverse_of_steps(steps)


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

    def with_size(self, size: float) -> Residuals:
        """Return the residuals of the fit on a device that has the effect with a size."""
        made = [
            replace(one, scenario=with_numbers(one.scenario, self.direction.settings(size, one.scenario)))
            for one in self.made
        ]
        return Residuals(tuple(made), self.found.optimum.residuals.ranges).quick()

    def begin(self, point: Floats, size: float) -> Floats:
        """Return a point of a search from coordinates of the fit and a size, with the usual forms."""
        return np.array([*point, *(math.log(form.usual) for form in self.direction.forms), math.log(size)])

    def residuals(self, points: Floats) -> Floats:
        """Return residuals [-] (samples, points) at points (points, coordinates); NaN for a failure."""
        parts = []
        ranges, forms = self.found.optimum.residuals.ranges, self.direction.forms
        kept, sizes = points.shape[1] - 1 - len(forms), np.exp(points[:, -1])
        for one in self.made:
            columns = columns_in(one.label, ranges, points[:, :kept])
            columns |= {form.path: np.exp(points[:, kept + place]) for place, form in enumerate(forms)}
            for lane, size in enumerate(sizes.tolist()):
                for path, number in self.direction.settings(size, one.scenario).items():
                    columns.setdefault(path, np.full(len(sizes), number_at(one.scenario, path)))[lane] = number
            signals = signals_at(one, columns, len(sizes))
            parts += [(signals[c.name] - c.values[:, None]) / c.noise for c in one.channels]
        return np.concatenate(parts)
