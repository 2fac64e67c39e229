"""The search for the optimum: several starts, each refined with scipy's bounded least squares.

It resumes with the noise of each sensor: whitened residuals, new slopes, until nothing moves any more. Hum, lines in
the spectrum of a sensor such as those of the mains, is taken out.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.engine.lane_rows import LANES
from ppafo.errors import IdentificationError
from ppafo.identification.linear_systems import inverse_of_steps
from ppafo.identification.noise.choice import Left, sensor_noise, sensor_noises
from ppafo.identification.noise.heavy_tails import sample_weights
from ppafo.identification.noise.sensor_noise import Course, SensorNoise, course_of, without_common_stamps
from ppafo.identification.noise.shapes import errors_of, from_reflections, reflections_of
from ppafo.identification.trajectory.information import (
    ROBUST_SCALE,
    directions_for,
    inverse_with_root,
    precision,
    robust_cost,
    solution,
    standard_errors,
)
from ppafo.identification.trajectory.posterior import LinearModel, whiten
from ppafo.identification.trajectory.problem import Range, Search, is_nuisance, is_of_sensor
from ppafo.identification.trajectory.residuals import (
    FIRST_STEP,
    Floats,
    Mask,
    Neighbourhood,
    PreparedExperiment,
    Residuals,
    coordinate_bounds,
    prior_coordinates,
)
from ppafo.progress import Progress, Report, report_nothing

DRAWS_PER_START = 8
STAGES = 3
PASSES = 2
AT_BOUND = 1.0e-4
"""Fraction of a number, or of the way between its bounds if that is less, within which it counts as being at one."""

_TOLERANCES = (1.0e-4, 3.0e-8)
"""Of the first stage, which only comes near, and of the others."""

_SETTLED = 0.05
"""A further stage that moves no coordinate by more than this fraction of its standard error is the last."""
_WIDEST_DRAW = 1.5
_NOTABLE = 1.0e-3
_EXPLAINED = 1.5**2
"""Mean square of the residuals over their noise up to which they are no more than noise."""


@dataclass(frozen=True, slots=True)
class Optimum:
    """Where a search ended: coordinates, cost (half the sum of squares, or of the loss), runs, information."""

    residuals: Residuals
    point: Floats
    cost: float
    evaluations: int
    information: Floats
    has_converged: bool


def optimum(residuals: Residuals, search: Search, report: Report = report_nothing) -> Optimum:
    """Return the best optimum of all starts; ``report`` hears what is being done.

    IdentificationError where the model diverges at every start.
    """
    best: Optimum | None = None
    nested = _without_nuisances(residuals, search, report)
    evaluations = 0 if nested is None else nested.evaluations
    starts = [*_starts(residuals, search), *([] if nested is None else [nested.point])]
    for number, start in enumerate(starts, start=1):
        least = "" if best is None else f", lowest misfit so far {best.cost:.6g}"
        report(Progress(f"trajectory fit: start {number} of {len(starts)}{least}"))
        found = _refine(residuals, start, search)
        evaluations += found.evaluations
        if best is None or found.cost < best.cost:
            best = found
    if best is None:
        raise IdentificationError("the model diverges at every start; check start values and bounds (ppafo sets audit)")
    others = _without_one(residuals, best, search, report)
    evaluations += sum(one.evaluations for one in others)
    for one in others:
        if one.cost < best.cost * (1.0 - _NOTABLE):
            found = _refine(residuals, one.point, search)
            evaluations += found.evaluations
            best = found if found.cost < best.cost else best
    fewer = others if nested is None else (nested, *others)
    has_converged = best.has_converged and not any(one.cost < best.cost * (1.0 - _NOTABLE) for one in fewer)
    return Optimum(best.residuals, best.point, best.cost, evaluations, best.information, has_converged)


def _without_one(residuals: Residuals, best: Optimum, search: Search, report: Report) -> tuple["Descent", ...]:
    """Return where the search ends with one number at a time held at its start.

    None where the residuals are no larger than the noise, for then no fit can be notably lower.
    """
    count = len(residuals.ranges)
    if count < 2 or 2.0 * best.cost <= _EXPLAINED * residuals.channel_slices()[-1].stop:
        return ()
    report(Progress("trajectory fit: with one number at a time held at its start"))
    wanted = [index for index, item in enumerate(residuals.ranges) if not item.is_tolerance]
    found = (_descend_holding(residuals, np.arange(count) == index, search) for index in wanted)
    return tuple(one for one in found if one is not None)


@dataclass(frozen=True, slots=True)
class Descent:
    """Where scipy's trust region ended from one start."""

    point: Floats
    cost: float
    evaluations: int
    has_converged: bool


def descend(
    residuals: Residuals, start: Floats, directions: Floats, search: Search, tolerance: float = _TOLERANCES[-1]
) -> Descent:
    """Return where the trust region ends from one start, with fixed steps of differences.

    Points and directions are in units of the coordinates, ``tolerance`` is relative [-].
    """
    from scipy.optimize import least_squares

    low, high = coordinate_bounds(residuals.ranges)
    margin = np.where(np.isfinite(high - low), 1.0e-9 * (high - low), 0.0)
    tried: dict[bytes, Neighbourhood] = {}

    def around(point: Floats) -> Neighbourhood:
        """Run a point and its differences together: a Jacobian is requested nearly wherever a residual was."""
        key = point.tobytes()
        if key not in tried:
            tried.clear()
            tried[key] = residuals.around(point, directions)
        return tried[key]

    done = least_squares(
        lambda point: around(point).all_residuals(),
        np.clip(start, low + margin, high - margin),
        jac=lambda point: around(point).jacobian(),
        bounds=(low, high),
        method="trf",
        loss=search.loss,
        f_scale=1.0 if search.loss == "linear" else ROBUST_SCALE,
        xtol=tolerance,
        ftol=tolerance,
        gtol=tolerance,
        max_nfev=search.maximum_evaluations,
    )
    return Descent(done.x, float(done.cost), int(done.nfev), done.status > 0)


def _without_nuisances(residuals: Residuals, search: Search, report: Report) -> Descent | None:
    """Return where the search ends with all nuisances held at their start, as a start with them free.

    A fit with more numbers that ends above one with fewer has not found its least. None where no nuisance is fitted, or
    nothing else. Tolerances start where the bench states them, and stay free.
    """
    is_held = np.array([is_nuisance(item) and not item.is_tolerance for item in residuals.ranges])
    if not is_held.any() or is_held.all():
        return None
    report(Progress("trajectory fit: with initial states and time offsets held"))
    return _descend_holding(residuals, is_held, search)


def _descend_holding(residuals: Residuals, is_held: Mask, search: Search) -> Descent | None:
    """Return where the search ends with some numbers held at the start; None where the model diverges there."""
    point, free = residuals.start, ~is_held
    fewer = residuals.hold({index: float(point[index]) for index in np.flatnonzero(is_held).tolist()})
    if not np.isfinite(fewer.of_data(point[None, free])).all():
        return None
    found = descend(fewer.quick(), point[free], np.diag(np.full(int(free.sum()), FIRST_STEP)), search, _TOLERANCES[0])
    point[free] = found.point
    # The quick runs found it, the exact ones say what it costs; infinite where these diverge.
    left = np.concatenate([fewer.of_data(found.point[None, :])[:, 0], fewer.of_priors(found.point)])
    cost = robust_cost(left, search.loss) if np.isfinite(left).all() else math.inf
    return Descent(point, cost, found.evaluations, found.has_converged)


def is_at_bound(point: Floats, ranges: Sequence[Range]) -> Mask:
    """Return which coordinates, in their units, are at a bound."""
    low, high = coordinate_bounds(ranges)
    return np.asarray(np.minimum(point - low, high - point) <= AT_BOUND * np.minimum(high - low, 1.0))


def moved_alone(point: Floats, ranges: Sequence[Range]) -> Mask:
    """Return which coordinates, in their units, get a step of their own: those at a bound, and those of sensors.

    The latter change no run, so that one run serves all of them.
    """
    return is_at_bound(point, ranges) | np.array([is_of_sensor(item) for item in ranges], dtype=np.bool_)


def _refine(residuals: Residuals, start: Floats, search: Search) -> Optimum:
    """Return the optimum from one start; steps of differences follow the numbers, in stages."""
    directions = np.diag(np.full(len(start), FIRST_STEP))
    evaluations = 0
    for stage in range(STAGES):
        used, tolerance = (residuals, _TOLERANCES[1]) if stage else (residuals.quick(), _TOLERANCES[0])
        found = descend(used, start, directions, search, tolerance)
        evaluations += found.evaluations
        # Information and the steps that suit it: two passes, since each needs the other.
        fixed, quick = moved_alone(found.point, residuals.ranges), residuals.quick()
        for _ in range(PASSES):
            directions = directions_for(precision(quick.around(found.point, directions), search.loss), fixed)
        information = precision(residuals.around(found.point, directions), search.loss)
        moved = np.abs(found.point - start) / standard_errors(information)
        start = found.point
        if stage > 0 and bool(np.all(moved <= _SETTLED)):
            break
    return Optimum(residuals, found.point, found.cost, evaluations, information, found.has_converged)


def _starts(residuals: Residuals, search: Search) -> list[Floats]:
    """Return the given start and the best of many draws around it, all of which are tried in one block."""
    first = residuals.start
    starts = [first] if np.isfinite(residuals.of_data(first[None, :])).all() else []
    if search.other_starts == 0:
        if not starts:
            raise IdentificationError("the model diverges at the start values; check them (ppafo sets audit)")
        return starts
    # Drawn between the bounds, on the log scale at most a factor of 4.5 from the start.
    low, high = coordinate_bounds(residuals.ranges)
    low, high = np.maximum(low, first - _WIDEST_DRAW), np.minimum(high, first + _WIDEST_DRAW)
    random = np.random.default_rng(search.seed)
    points = low + (high - low) * random.random((DRAWS_PER_START * search.other_starts, len(first)))
    # In blocks: the records of hundreds of runs at once would fill the memory.
    blocks = [points[begin : begin + LANES] for begin in range(0, len(points), LANES)]
    costs = np.concatenate([np.sum(np.square(residuals.of_data(block)), axis=0) for block in blocks])
    order = [int(index) for index in np.argsort(costs) if np.isfinite(costs[index])]
    return [*starts, *(points[index] for index in order[: search.other_starts])]


MAXIMUM_LINES = 3
CHANCE = 1.0e-4
"""Chance at which noise alone would be taken for hum, for each sensor."""

_PADDED = 4
_FEWEST_CYCLES = 5.0
_CELLS = 12
_FEWEST_SAMPLES = 64


def hum_of(segments: Sequence[Floats]) -> tuple[float, ...]:
    """Return the frequencies of hum [cycles per sample] in a sensor's recordings."""
    found: list[float] = []
    if min(len(one) for one in segments) < _FEWEST_SAMPLES:
        return ()
    for _ in range(MAXIMUM_LINES):
        left = [without_hum(one, tuple(found)) for one in segments]
        line = _strongest_line(left)
        if line is None:
            break
        found.append(line)
    return tuple(found)


def hum_columns(count: int, frequencies: Sequence[float]) -> Floats:
    """Return a cosine and a sine [-] of each frequency [cycles per sample] at ``count`` samples, (samples, columns)."""
    phases = 2.0 * math.pi * np.outer(np.arange(count), np.array(frequencies))
    return np.hstack([np.cos(phases), np.sin(phases)])


def without_hum(segment: Floats, frequencies: Sequence[float]) -> Floats:
    """Return the samples, in their unit, less what sinusoids of these frequencies [cycles per sample] explain."""
    if not frequencies:
        return segment
    columns = hum_columns(len(segment), frequencies)
    return np.asarray(segment - columns @ np.linalg.lstsq(columns, segment, rcond=None)[0])


def _strongest_line(segments: Sequence[Floats]) -> float | None:
    """Return the line that stands highest above its neighbourhood, None where chance may have made it."""
    from scipy.ndimage import median_filter
    from scipy.optimize import minimize_scalar
    from scipy.stats import gamma

    reflections, _ = reflections_of(list(segments), 1)
    white = [errors_of(from_reflections(reflections), one)[1:] for one in segments]
    shortest = min(len(one) for one in white)
    size = _PADDED * max(len(one) for one in white)
    power = np.zeros(size // 2 + 1)
    for one in white:
        power += np.square(np.abs(np.fft.rfft((one - one.mean()) * np.hanning(len(one)), size))) / len(one)
    parts = float(len(white))
    around = median_filter(power, size=2 * _CELLS * _PADDED + 1, mode="nearest")
    height = power / np.maximum(around, 1.0e-300) * gamma.ppf(0.5, parts)
    edge = math.ceil(_FEWEST_CYCLES * size / shortest)
    height[:edge] = height[-edge:] = 0.0
    best = int(np.argmax(height))
    if gamma.sf(height[best], parts) * shortest > CHANCE:
        return None

    def power_left(place: float) -> float:
        return sum(float(np.sum(np.square(without_hum(one, (place,))))) for one in white)

    # Near the highest point of the spectrum, where sinusoids explain most.
    bounds = best / size - 1.0 / size, best / size + 1.0 / size
    return float(minimize_scalar(power_left, bounds=bounds, method="bounded").x)


MAXIMUM_ROUNDS = 8
ESTIMATED_ROUNDS = 2
"""Rounds after which the noise stays as it is, so that the others can settle."""

SETTLED = 0.03
"""Fraction of a standard error below which a step is the last."""

ROUGH = 0.5
"""The same where no step lowers the cost, although the slopes say so."""

_HALVINGS = 5
_GAP = 3.0
_ALIKE = 0.01


@dataclass(frozen=True, slots=True)
class Sensor:
    """One sensor: channel, time between samples [s], the places of its recordings, its noise and its hum [Hz].

    ``weights`` are those of the samples and ``courses`` what it should show, by recording. A recording with a gap
    counts as two; one sample between two is left out.
    """

    channel: str
    interval: float
    places: tuple[slice, ...]
    is_given: bool
    noise: SensorNoise
    weights: tuple[Floats, ...] = ()
    hum: tuple[float, ...] = ()
    courses: tuple[Course, ...] = ()

    @property
    def in_words(self) -> str:
        """What its noise is like."""
        hum = "".join(f", hum at {frequency:.4g} Hz" for frequency in self.hum)
        return f"{self.noise.in_words(self.interval)}{hum}"


@dataclass(frozen=True, slots=True)
class Whitening:
    """Makes columns of residuals white: all of variance 1, without what hum explains."""

    sensors: tuple[Sensor, ...]

    def of(self, values: Floats) -> Floats:
        """Return columns (samples, columns) whitened [-]."""
        found = np.zeros_like(values)
        for sensor in self.sensors:
            parts = zip(sensor.places, sensor.noise.levels, sensor.weights, strict=True)
            for number, (place, level, weight) in enumerate(parts):
                rows = sensor.noise.rows(values[place], weight, number)[0] / level
                if sensor.hum:
                    columns = hum_columns(len(weight), [one * sensor.interval for one in sensor.hum])
                    basis = np.linalg.qr(sensor.noise.rows(columns, weight, number)[0])[0]
                    rows = rows - basis @ (basis.T @ rows)
                found[place] = rows
        without_common_stamps(found, [one.places for one in self.sensors], [one.noise for one in self.sensors])
        return found


@dataclass(frozen=True, slots=True)
class WhitenedFit:
    """Where the search with noise ended: whitened optimum, its linear model (hum in it), sensors, and rounds."""

    optimum: Optimum
    model: LinearModel
    sensors: tuple[Sensor, ...]
    rounds: int

    @property
    def noises(self) -> tuple[SensorNoise, ...]:
        """The noise of each sensor."""
        return tuple(sensor.noise for sensor in self.sensors)


def weigh(found: Optimum, given: Sequence[frozenset[str]]) -> WhitenedFit:
    """Return the optimum that the noise of each sensor makes of one that was found with white noise.

    ``given`` has, for each experiment, the channels whose noise was given: it is not taken to be less.
    """
    residuals, point = found.residuals, found.point
    fixed = moved_alone(point, residuals.ranges)
    near = residuals.around(point, directions_for(found.information, fixed))
    sensors = _sensors(residuals.experiments, given)
    for number in range(1, MAXIMUM_ROUNDS + 1):
        if number <= ESTIMATED_ROUNDS:
            sensors = _with_courses(sensors, residuals.experiments, near.of_data)
        sensors = _estimate_noise(sensors, near.of_data, number <= ESTIMATED_ROUNDS)
        model = _linear_model(near, sensors)
        step, information = _step(near, model, sensors)
        errors = np.sqrt(np.diag(inverse_with_root(information)[0]))
        has_settled = bool(np.all(np.abs(step) <= SETTLED * errors))
        if has_settled or number == MAXIMUM_ROUNDS:
            break
        directions = directions_for(information, moved_alone(near.point + step, residuals.ranges))
        further = _damp_step(near, step, directions, Whitening(sensors))
        if further is None:
            # Where the runs are rough no step lowers the cost any more: this is as near as one comes.
            has_settled = bool(np.all(np.abs(step) <= ROUGH * errors))
            break
        near = further
    whole = replace(residuals, whitening=Whitening(sensors))
    optimum = Optimum(
        residuals=whole,
        point=near.point,
        cost=_cost(near, Whitening(sensors)),
        evaluations=found.evaluations + number,
        information=information,
        has_converged=found.has_converged and has_settled,
    )
    return WhitenedFit(optimum, model, sensors, number)


def _sensors(experiments: Sequence[PreparedExperiment], given: Sequence[frozenset[str]]) -> tuple[Sensor, ...]:
    """Return the sensors: recordings of one channel, sampled alike, share one."""
    found: dict[tuple[str, int, bool], list[slice]] = {}
    intervals: dict[tuple[str, int, bool], float] = {}
    first = 0
    for prepared, known in zip(experiments, given, strict=True):
        gaps = np.diff(prepared.time)
        interval = float(np.median(gaps))
        breaks = np.flatnonzero(gaps > _GAP * interval) + 1
        ends = [0, *(int(place) for place in breaks), len(prepared.time)]
        for channel in prepared.channels:
            key = (channel.name, round(np.log(interval) / _ALIKE), channel.name in known)
            intervals.setdefault(key, interval)
            parts = [slice(first + start, first + end) for start, end in itertools.pairwise(ends)]
            found.setdefault(key, []).extend(part for part in parts if part.stop - part.start > 1)
            first += len(prepared.time)
    white = sensor_noise([np.ones(2)])
    return tuple(
        Sensor(key[0], intervals[key], tuple(places), key[2], white) for key, places in found.items() if places
    )


def _with_courses(
    sensors: Sequence[Sensor], experiments: Sequence[PreparedExperiment], residuals: Floats
) -> tuple[Sensor, ...]:
    """Return the sensors with what the model says that they show; places of channels in one experiment are alike."""
    found: list[dict[int, Course]] = [{} for _ in sensors]
    start = stamps = 0
    for prepared in experiments:
        for channel in prepared.channels:
            stop = start + len(prepared.time)
            level = residuals[start:stop] + channel.values / channel.noise
            for sensor, courses in zip(sensors, found, strict=True):
                for place in sensor.places:
                    if start <= place.start < stop:
                        part = slice(place.start - start, place.stop - start)
                        courses[place.start] = course_of(prepared.time[part], level[part], stamps + part.start)
            start = stop
        stamps += len(prepared.time)
    return tuple(
        replace(sensor, courses=tuple(courses[place.start] for place in sensor.places))
        for sensor, courses in zip(sensors, found, strict=True)
    )


def _estimate_noise(sensors: Sequence[Sensor], residuals: Floats, is_estimated: bool) -> tuple[Sensor, ...]:
    """Return the sensors with their noise and hum estimated from residuals, or with their weights alone."""
    quiet, hums = [], []
    for sensor in sensors:
        segments = [residuals[place] for place in sensor.places]
        hum = tuple(one / sensor.interval for one in hum_of(segments)) if is_estimated else sensor.hum
        quiet.append([without_hum(one, [frequency * sensor.interval for frequency in hum]) for one in segments])
        hums.append(hum)
    noises: Sequence[SensorNoise] = [sensor.noise for sensor in sensors]
    if is_estimated:
        parts = zip(quiet, sensors, strict=True)
        noises = sensor_noises([Left(own, sensor.is_given, sensor.courses) for own, sensor in parts])
    return tuple(
        replace(sensor, noise=noise, hum=hum, weights=tuple(sample_weights(noise, own)))
        for sensor, noise, hum, own in zip(sensors, noises, hums, quiet, strict=True)
    )


def _linear_model(near: Neighbourhood, sensors: Sequence[Sensor]) -> LinearModel:
    """Return the linear model at a point, with a column for each sinusoid of hum in each recording."""
    residuals, count = near.of_data, len(near.point)
    added = []
    for sensor in sensors:
        for place in sensor.places if sensor.hum else ():
            columns = np.zeros((len(residuals), 2 * len(sensor.hum)))
            columns[place] = hum_columns(place.stop - place.start, [one * sensor.interval for one in sensor.hum])
            added.append(columns)
    columns = np.hstack([near.jacobian_of_data(), *added, residuals[:, None]])
    _, deviation, has = prior_coordinates(near.residuals.ranges)
    pull, precision = np.zeros(columns.shape[1] - 1), np.zeros(columns.shape[1] - 1)
    pull[:count][has] = near.residuals.of_priors(near.point) / deviation[has]
    precision[:count] = 1.0 / np.square(deviation)
    return LinearModel(columns, tuple(one.places for one in sensors), pull, np.diag(precision))


def _step(near: Neighbourhood, model: LinearModel, sensors: Sequence[Sensor]) -> tuple[Floats, Floats]:
    """Return the step to the least of the whitened cost inside the bounds, and the information of the coordinates."""
    from scipy.optimize import lsq_linear

    count = len(near.point)
    rows = whiten(model, [one.noise for one in sensors], [one.weights for one in sensors])
    products = rows.T @ rows
    precision, pull = products[:-1, :-1] + model.precision, products[:-1, -1] + model.pull
    step = -solution(precision, pull)[:count]
    information = precision[:count, :count]
    if len(pull) > count:
        across = precision[:count, count:]
        information = information - across @ inverse_with_root(precision[count:, count:])[0] @ across.T
        pull = pull[:count] - across @ solution(precision[count:, count:], pull[count:])
    low, high = coordinate_bounds(near.residuals.ranges)
    if np.all((near.point + step >= low) & (near.point + step <= high)):
        return step, information
    root = inverse_with_root(information)[1]
    room = np.minimum(low - near.point, 0.0), np.maximum(high - near.point, 0.0) + 1.0e-15
    return np.asarray(lsq_linear(inverse_of_steps(root), -root.T @ pull, bounds=room).x), information


def _damp_step(near: Neighbourhood, step: Floats, directions: Floats, whitening: Whitening) -> Neighbourhood | None:
    """Return the neighbourhood after a step, halved until the cost does not rise; None where it always does."""
    low, high = coordinate_bounds(near.residuals.ranges)
    before = _cost(near, whitening)
    for halving in range(_HALVINGS):
        tried = near.residuals.around(np.clip(near.point + 0.5**halving * step, low, high), directions)
        if _cost(tried, whitening) <= before * (1.0 + 1.0e-9):
            return tried
    return None


def _cost(near: Neighbourhood, whitening: Whitening) -> float:
    """Return half the sum of the whitened squares and of those of the priors; infinite where the run fails."""
    if not np.isfinite(near.of_data).all():
        return np.inf
    left = whitening.of(near.of_data[:, None])
    return 0.5 * float(np.sum(left * left) + np.sum(np.square(near.residuals.of_priors(near.point))))
