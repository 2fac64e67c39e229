"""What recordings say of effects that a fitted model lacks: what shows, and what an interval hides.

The residuals are searched along directions (``directions``), one by one. The score of what is left along one says
whether it shows; how well its size is then known, and what that size would do to each number, say what an interval
hides. What shows is refitted with it (``refit``), and named if no noise of the sensors explains as much.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.identification.estimate import limit_for
from ppafo.identification.noise.choice import Left, sensor_noises
from ppafo.identification.noise.sensor_noise import SensorNoise
from ppafo.identification.noise.shapes import Drift, from_reflections, reflections_of
from ppafo.identification.trajectory.directions.catalogue import EFFECT_DIRECTIONS, EVERY_DIRECTION
from ppafo.identification.trajectory.directions.changes import (
    can_have,
    changes_by_size,
    fitted_experiment,
    stacked,
)
from ppafo.identification.trajectory.directions.delay import delay_columns
from ppafo.identification.trajectory.directions.gain_drift import drift_column
from ppafo.identification.trajectory.directions.kind import Column
from ppafo.identification.trajectory.directions.zero import zero_columns
from ppafo.identification.trajectory.information import inverse_with_root
from ppafo.identification.trajectory.posterior import whiten
from ppafo.identification.trajectory.refit import Refit, likelihood_with, refit_from_afar, refit_with
from ppafo.identification.trajectory.residuals import Floats, Residuals, signals_at
from ppafo.identification.trajectory.search import WhitenedFit
from ppafo.identification.trajectory.uncertainty import WithEffect
from ppafo.model.catalog import find_effects
from ppafo.simulation.numbers import number_at
from ppafo.simulation.recorded import COMMAND
from ppafo.simulation.scenario import FreeMotion

ALARM = 5.0e-4
"""Chance of a false alarm over all directions together, as for the other comparisons."""
ORDER = 6
"""Of the autoregression that whitens: a long one would take a direction for noise."""
_ROUNDS = 3
_CLEAR = 4.0
"""Standard errors that the change of a direction has at the size at which it is taken."""
_SPAN = 2.0
"""Standard errors of a size on either side that the recordings leave open."""
_INVISIBLE = 1.0e-9
_NOTABLE = 3.0
"""Standard errors of a score from which all effects are fitted: few of a right model, and a fit with each decides."""


@dataclass(frozen=True, slots=True)
class Finding:
    """What the recordings say of one direction.

    ``score`` is what is left along it in standard errors [-], above 0 where the effect itself would take it away;
    ``size`` the one that they prefer and ``error`` its standard error, in the SI unit of the size. ``shifts``
    (parameters,) is by how much a size of 1 moves each coordinate of the fit, ``low`` and ``high`` what sizes are open.
    """

    column: Column
    score: float
    size: float
    error: float
    low: float
    high: float
    shifts: Floats

    @property
    def in_words(self) -> str:
        """That it shows, with its size."""
        return self.column.seems.format(size=self.column.size_in_words(abs(self.size)))


@dataclass(frozen=True, slots=True)
class Shown:
    """A direction that shows: what was found along it, and the fit with it; None for a fault of the record.

    ``gain`` [-] is by how much twice the logarithm of the likelihood rises with it. ``is_possible`` is False for what
    would be a negative effect; ``explains`` says whether hardly more than white noise is left with it.
    """

    finding: Finding
    gain: float
    refit: Refit | None
    is_possible: bool
    explains: bool

    @property
    def in_words(self) -> str:
        """That it shows, with the size of its fit."""
        if not self.is_possible:
            return f"no effect that is searched explains what is left; it is like the opposite of {self.title}"
        if self.refit is None:
            return self.finding.in_words
        column = self.finding.column
        return column.seems.format(size=column.size_in_words(self.refit.size))

    @property
    def title(self) -> str:
        """What it is called in a sentence."""
        return title_of(self.finding.column.name)


@dataclass(frozen=True, slots=True)
class Doubt:
    """What a fit cannot see of the directions: those that show, and for each coordinate the interval with the others.

    ``findings`` has all of them, ``shown`` those that alarm and win against noise, the likeliest first; those beyond
    ``limit`` [-] less likely than it are certainly not what shows. ``low`` and ``high`` are the ends of
    intervals in coordinates with whatever size the recordings leave open; ``conditions`` (one for each coordinate)
    say what must not be for the interval without, empty where nothing can leave it.
    """

    findings: tuple[Finding, ...]
    shown: tuple[Shown, ...]
    limit: float
    low: Floats
    high: Floats
    conditions: tuple[str, ...]

    @property
    def with_effect(self) -> WithEffect | None:
        """The effect that explains what is left, with the fit with it; None for none."""
        first = self.shown[0] if self.shown else None
        if first is None or first.refit is None or not first.explains:
            return None
        rest = "" if first.refit.is_all else ", which leaves more than white noise,"
        is_known = first.refit.is_all and first.refit.is_of_any_form
        return WithEffect(f"{first.title}{rest}", first.refit.point, first.refit.errors if is_known else None)

    @property
    def misfit(self) -> str:
        """What shows, in a sentence, empty where nothing does."""
        if not self.shown:
            return ""
        first, *rest = self.shown
        alike = [one for one in rest if one.gain > first.gain - self.limit and one.explains == first.explains]
        others = f"; so it would look if {' or if '.join(one.in_words for one in alike)}" if alike else ""
        nearest = "no effect that is searched explains all that is left; nearest: " if not first.explains else ""
        nearest = nearest if first.is_possible else ""
        return f"{nearest}{first.in_words} (twice the log likelihood rises by {first.gain:.3g} with it{others})"


def title_of(name: str) -> str:
    """Return what a direction is called in a sentence."""
    titles = {one.name: one.title for one in EVERY_DIRECTION} | {"delay": "a clock that is off"}
    return titles.get(name, name)


def doubt_of(found: WhitenedFit, low: Floats, high: Floats, is_doubtful: bool) -> Doubt:
    """Return what the recordings say of all directions, and what they leave open of each parameter.

    ``low`` and ``high`` are the ends of the intervals in coordinates. ``is_doubtful`` says that parts of the recordings
    seem to want different numbers. Scores at numbers that are wrong may miss what is, so that each effect of the device
    is then fitted, and also where some score is large for chance; whether it shows is the fit's to say.
    """
    of_model = _of_model(found)
    residuals, point = found.optimum.residuals, found.optimum.point
    of_record = delay_columns(residuals, point)
    for sensor in dict.fromkeys(sensor.channel for sensor in found.sensors):
        of_record += [drift_column(sensor, residuals), *zero_columns(sensor, residuals)]
    columns = [*(sizes[0] for sizes in of_model), *of_record]
    starts = _slopes_of_starts(residuals, point)
    every = _findings(found, starts, columns, [column for sizes in of_model for column in sizes[1:]])
    findings, at_other_sizes = every[: len(columns)], every[len(columns) :]
    limit = limit_for(ALARM / max(1, len(findings)))
    alarms, of_device = [], {one.name for one in EVERY_DIRECTION}
    is_doubtful = is_doubtful or any(abs(one.score) > _NOTABLE for one in every if one.column.name in of_device)
    for one in findings:
        is_tried = is_doubtful and one.column.name in of_device
        if is_tried or (abs(one.score) > limit and abs(one.size) >= one.column.tolerance):
            alike = [other for other in at_other_sizes if other.column.name == one.column.name and other.score > 0.0]
            alarms.append(max((one, *alike), key=lambda item: item.score))
    shown = _winners(found, starts, alarms, limit**2)
    return Doubt(findings, shown, limit**2, *_with_open_sizes(findings, point, low, high))


def _winners(found: WhitenedFit, starts: Floats, alarms: Sequence[Finding], limit: float) -> tuple[Shown, ...]:
    """Return the directions that explain more than any noise of the sensors could, the likeliest first.

    A score takes the noise as known, and that which is left when all directions are taken out is too little where it is
    slow. So noise of any kind is estimated without the effect and with it, and the likelihoods are compared: of an
    effect of the device after a fit with it. What cannot be, an effect that is negative, counts only where nothing else
    shows.
    """
    if not alarms:
        return ()
    without, by_name = likelihood_with(found, found.model, starts), {one.name: one for one in EVERY_DIRECTION}

    def shown(one: Finding, refit: Refit | None) -> Shown:
        linear = likelihood_with(found, found.model, np.column_stack([starts, one.column.change]))
        gain, explains = linear.value - without.value - 2.0, linear.explains_beside(without)
        if one.column.name not in by_name:
            return Shown(one, gain, None, is_possible=True, explains=explains)
        if refit is not None and refit.gain > limit:
            return Shown(one, refit.gain, refit, is_possible=True, explains=refit.explains)
        is_possible = one.column.low <= one.size
        return Shown(one, -math.inf if is_possible else gain, None, is_possible, explains=False)

    device = {one.column.name: one for one in alarms if one.column.name in by_name}
    refits = {name: refit_with(found, starts, by_name[name], one.size, without) for name, one in device.items()}
    if not any(one is not None and one.is_all for one in refits.values()):
        for name, near in refits.items():
            far = refit_from_afar(found, starts, by_name[name], without)
            refits[name] = far if near is None or (far is not None and far.gain > near.gain) else near
    every = [shown(one, refits.get(one.column.name)) for one in alarms]
    winners = [one for one in every if one.gain > limit]
    winners = [one for one in winners if one.is_possible] or winners
    return tuple(sorted(winners, key=lambda one: (not one.explains, -one.gain)))


def _of_model(found: WhitenedFit) -> list[list[Column]]:
    """Return the directions of the device, by runs with a little of each effect: at the size that is clear, then more.

    A direction bends with its size, so that one which shows is measured at larger ones too. Each change is that from a
    run of the same program in which the effects change nothing.
    """
    residuals, point = found.optimum.residuals, found.optimum.point
    find_effects(path for direction in EFFECT_DIRECTIONS for path in direction.neutral)
    fitted = [fitted_experiment(one, residuals, point) for one in residuals.experiments]
    effects = [one for one in EFFECT_DIRECTIONS if any(can_have(item.scenario, one) for item in fitted)]
    made = []
    for direction, tried in changes_by_size(fitted, effects):
        clear = _clear_size(found, tried)
        if clear is not None:
            texts = direction.seems, direction.unless, direction.size_in_words
            made.append(
                [
                    Column(direction.name, *texts, 0.0, direction.largest, change / size)
                    for size, change in tried[clear:]
                ]
            )
    return made


_START_STEPS = {"initial.pressure_1": 200.0, "initial.pressure_2": 200.0, "motion.angle": 1.0e-3}
"""Changes of a start [Pa], [rad] over which its slope is taken."""


def _slopes_of_starts(residuals: Residuals, point: Floats) -> Floats:
    """Return the change of the residuals with each start that was read off a recording (samples, starts).

    A run that follows a recorded command begins where its first samples are, which is known no better than they are.
    """
    columns, first = [], 0
    total = residuals.channel_slices()[-1].stop
    for one in residuals.experiments:
        count = sum(len(channel.values) for channel in one.channels)
        if one.recorded is not None and one.recorded.has(COMMAND):
            fitted = fitted_experiment(one, residuals, point)
            free = {item.path for item in residuals.ranges if item.acts_in(one.label)}
            steps = {path: step for path, step in _START_STEPS.items() if path not in free}
            if not isinstance(fitted.scenario.motion, FreeMotion):
                steps.pop("motion.angle", None)
            for path, step in steps.items():
                at = number_at(fitted.scenario, path)
                values = signals_at(fitted, {path: np.array([at + step, at])}, 2)
                both = stacked(one, values)
                column = np.zeros(total)
                column[first : first + count] = both[:, 0] - both[:, 1]
                columns.append(column)
        first += count
    finite = [column for column in columns if np.isfinite(column).all() and column.any()]
    return np.column_stack(finite) if finite else np.zeros((total, 0))


def _clear_size(found: WhitenedFit, changes: Sequence[tuple[float, Floats]]) -> int | None:
    """Return the place of the least change that is clear of the noise, else of the largest; None where none is any."""
    clear = None
    for place, (_, change) in enumerate(changes):
        model = replace(found.model, columns=np.column_stack([change, change]))
        rows = whiten(model, found.noises, [sensor.weights for sensor in found.sensors])[:, 0]
        length = float(np.linalg.norm(rows))
        if length > _INVISIBLE:
            clear = place
        if length > _CLEAR:
            break
    return clear


def _findings(
    found: WhitenedFit, starts: Floats, columns: Sequence[Column], others: Sequence[Column]
) -> tuple[Finding, ...]:
    """Return score, size and shifts of each direction, one by one, on residuals that a short autoregression whitens.

    It is fitted to what is left with all of ``columns`` and all slopes projected out, so that no misfit is noise; those
    of starts that were read off a recording are slopes too. The findings of ``others`` follow those of ``columns``.
    """
    model, kept = found.model, len(found.optimum.point)
    if not columns:
        return ()
    every = (*columns, *others)
    changes = np.column_stack([one.change * max(abs(one.low), one.high) for one in every])
    whole = replace(model, columns=np.hstack([model.slopes, starts, changes, model.residuals[:, None]]))
    first = model.slopes.shape[1] + starts.shape[1]
    used = first + len(columns)
    weights = [sensor.weights for sensor in found.sensors]
    rows = whiten(whole, found.noises, weights)

    def left_of_sensors() -> list[list[Floats]]:
        explained = np.linalg.lstsq(rows[:, :used], rows[:, -1], rcond=1.0e-9)[0]
        left = whole.columns[:, -1] - whole.columns[:, :used] @ explained
        return [whole.segments(left, place) for place in range(len(model.sensors))]

    for _ in range(_ROUNDS):
        noises = [_short_noise(parts) for parts in left_of_sensors()]
        rows = whiten(whole, noises, weights)
    # A slow drift is more than a short autoregression can hold, and would look like a gain that drifts; so would time
    # stamps that are off, where the slope is large, like a late clock.
    pairs = list(zip(left_of_sensors(), found.sensors, strict=True))
    likely = sensor_noises([Left(parts, sensor.is_given, sensor.courses) for parts, sensor in pairs])
    is_long = [isinstance(one.shape, Drift) or one.grows for one in likely]
    noises = [one if is_it else short for one, short, is_it in zip(likely, noises, is_long, strict=True)]
    rows = whiten(whole, noises, weights)
    slopes, d, r = rows[:, :first], rows[:, first:-1], rows[:, -1]
    # Priors hold the numbers as samples do.
    information = slopes.T @ slopes
    information[: len(model.pull), : len(model.pull)] += model.precision
    inverse, _ = inverse_with_root(information)
    responses = inverse @ (slopes.T @ d)
    # At the best numbers the priors pull as the samples do, the other way.
    product = slopes.T @ r
    product[: len(model.pull)] += model.pull
    remaining = r - slopes @ (inverse @ product)
    away = d - slopes @ responses
    made = []
    for place, column in enumerate(every):
        largest = max(abs(column.low), column.high)
        known = max(float(away[:, place] @ d[:, place]), _INVISIBLE)
        score = -float(d[:, place] @ remaining) / math.sqrt(known)
        size, error = largest * score / math.sqrt(known), largest / math.sqrt(known)
        ends = [min(max(size + side * _SPAN * error, column.low), column.high) for side in (-1.0, 1.0)]
        made.append(Finding(column, score, size, error, ends[0], ends[1], responses[:kept, place] / largest))
    return tuple(made)


def _short_noise(segments: Sequence[Floats]) -> SensorNoise:
    """Return the autoregression of order six that residuals of a sensor have."""
    shortest = min(len(one) for one in segments)
    order = max(0, min(ORDER, shortest - 2))
    reflections, left = reflections_of(list(segments), order)
    return SensorNoise(from_reflections(reflections), np.full(len(segments), math.sqrt(float(left[order]))))


def _with_open_sizes(
    findings: Sequence[Finding], point: Floats, low: Floats, high: Floats
) -> tuple[Floats, Floats, tuple[str, ...]]:
    """Return the intervals with any size that is open, and for each coordinate what must not be."""
    lowest, highest, conditions = low.copy(), high.copy(), []
    for index in range(len(point)):
        room = 0.5 * float(high[index] - low[index])
        worst, most = None, 1.0
        for one in findings:
            # The fit without the effect is off by its shift, so the truth lies the other way.
            moved = [-one.shifts[index] * size for size in (one.low, one.high)]
            lowest[index] = min(lowest[index], low[index] + min(moved))
            highest[index] = max(highest[index], high[index] + max(moved))
            reach = max(abs(end) for end in moved) / room if room > 0.0 else 0.0
            if reach > most:
                worst, most = one, reach
        if worst is None:
            conditions.append("")
        else:
            size = room / abs(float(worst.shifts[index]))
            conditions.append(worst.column.unless.format(size=worst.column.size_in_words(size)))
    return lowest, highest, tuple(conditions)
