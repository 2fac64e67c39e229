"""What a bench may have and the fitted model not: directions in which the residuals are searched, one by one.

A direction is the change of the channels that a little of an effect makes. The score of what is left along it says
whether it shows; how well its size is then known, and what that size would do to each number, say what an interval
hides. Effects of the model are those of `ppafo.model.effects`; those of the record are a clock that is late, a gain
that drifts and a zero that is off.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.identification.noise.choice import sensor_noise
from ppafo.identification.noise.heavy_tails import sample_weights
from ppafo.identification.noise.sensor_noise import SensorNoise
from ppafo.identification.noise.shapes import Drift, from_reflections, reflections_of
from ppafo.identification.trajectory.information import inverse_with_root, solution
from ppafo.identification.trajectory.posterior import whiten
from ppafo.identification.trajectory.problem import TIME_OFFSET, ZERO_OF, with_numbers
from ppafo.identification.trajectory.residuals import (
    Floats,
    PreparedExperiment,
    Residuals,
    numbers_in,
    prepare_samples,
    signals_at,
    trajectories,
)
from ppafo.identification.trajectory.search import WhitenedFit
from ppafo.model.catalog import find_effects
from ppafo.parameters.plant import effects_of
from ppafo.simulation.numbers import number_at
from ppafo.simulation.recorded import COMMAND
from ppafo.simulation.scenario import FreeMotion, Scenario, Thermal

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
_OF_A_BENCH = 0.1
"""Fraction of the largest fault of a record that can be believed up to which a bench has it and no model is wrong."""
_NO_TIME = 1.0e-12


@dataclass(frozen=True, slots=True)
class Direction:
    """One effect of the device that a fitted model may lack.

    ``seems`` says that it shows, ``unless`` what must not be, each with the size as ``size_in_words`` writes it.
    ``sizes`` grow to the largest that can be believed. ``settings`` gives the numbers [SI] of a size by path;
    ``neutral`` those with which the effect acts, and changes nothing. One of the ``valve`` needs a spool.
    """

    name: str
    seems: str
    unless: str
    size_in_words: Callable[[float], str]
    sizes: tuple[float, ...]
    settings: Callable[[float], dict[str, float]]
    neutral: Mapping[str, float]
    valve: str = ""

    @property
    def largest(self) -> float:
        """The largest size that can be believed."""
        return self.sizes[-1]


_WIDE = 1.0e-2
"""Area of a line [m^2] that is no resistance."""
_TRACE = 1.0e-12
"""A setting with which an effect acts and is not felt [SI]."""

EFFECT_DIRECTIONS: tuple[Direction, ...] = (
    Direction(
        name="leak_opening",
        seems="the leak seems to open at {size}",
        unless="the leak does not open at a pressure above {size}",
        size_in_words=lambda size: f"{1e-3 * size:.2g} kPa",
        sizes=(1.5e3, 6.0e3, 2.4e4, 6.0e4),
        settings=lambda size: {"effects.leak_opening.pressure": size},
        neutral={"effects.leak_opening.pressure": _TRACE},
    ),
    Direction(
        name="seal_friction",
        seems="friction seems to grow with the pressure between the chambers by {size}",
        unless="friction does not grow with the pressure between the chambers by more than {size}",
        size_in_words=lambda size: f"{size:.2g} N m/Pa",
        sizes=(1.0e-8, 4.0e-8, 2.0e-7, 1.0e-6),
        settings=lambda size: {
            "effects.seal_friction.static_per_pressure": size,
            "effects.seal_friction.dynamic_per_pressure": size,
        },
        neutral={
            "effects.seal_friction.static_per_pressure": _TRACE**2,
            "effects.seal_friction.dynamic_per_pressure": _TRACE**2,
        },
    ),
    Direction(
        name="stribeck",
        seems="friction near standstill seems to be higher, up to some {size} (Stribeck)",
        unless="friction is not higher near standstill, or up to less than {size} (Stribeck)",
        size_in_words=lambda size: f"{size:.2g} rad/s",
        sizes=(0.02, 0.1, 0.4, 1.6),
        settings=lambda size: {"effects.stribeck.velocity": size, "effects.stribeck.share": 0.9},
        neutral={"effects.stribeck.velocity": 1.0, "effects.stribeck.share": 0.0},
    ),
    Direction(
        name="spool_play",
        seems="the spool seems to have a play of {size} of its command",
        unless="the spool has no play of more than {size} of its command",
        size_in_words=lambda size: f"{100.0 * size:.2g} %",
        sizes=(0.005, 0.02, 0.08, 0.2),
        settings=lambda size: {"effects.spool_play.width": size},
        neutral={"effects.spool_play.width": _TRACE},
        valve="proportional",
    ),
    Direction(
        name="line_resistance",
        seems="a line of {size} seems to lie between valve and chambers",
        unless="no line narrower than {size} lies between valve and chambers",
        size_in_words=lambda size: f"{1.0e6 / max(size, _TRACE):.2g} mm^2",
        sizes=(5.0e3, 1.5e4, 4.0e4, 1.2e5),
        settings=lambda size: {"effects.line_resistance.area": 1.0 / size},
        neutral={"effects.line_resistance.area": _WIDE},
    ),
)
"""Effects of the device, which one program has all at once; the sizes are those that a bench of this kind can have."""

WALLS = 100.0
"""Area of the walls over the volume [1/m] for which a heat transfer coefficient is said: a chamber of some 50 cm^3."""
_COEFFICIENT = "gas_model.heat_transfer_coefficient"
HEAT = Direction(
    name="heat",
    seems="the gas seems to warm and cool, with a heat transfer of {size}",
    unless="the heat transfer between gas and walls is not below {size}",
    size_in_words=lambda size: f"{1.0 / max(size, _TRACE):.2g} W/(m^2 K) at {WALLS:g} 1/m",
    sizes=(1.0e-5, 5.0e-5, 2.5e-4, 1.0 / 60.0),
    settings=lambda size: {_COEFFICIENT: 1.0 / size},
    neutral={_COEFFICIENT: 1.0e8},
)
"""Gas with an energy balance, in one over the coefficient: the isothermal gas of the paper is that of no resistance."""

LATEST = 3.0e-4
"""Delay of a clock [s] that can be believed."""
LARGEST_DRIFT = 0.01
"""Change of a gain over a recording that can be believed, as a fraction."""
LARGEST_ZERO = {"angle": math.radians(1.0), "pressure_1": 3.0e3, "pressure_2": 3.0e3}
"""Error of the zero of a sensor that can be believed [rad], [Pa]."""


@dataclass(frozen=True, slots=True)
class Column:
    """A direction as a change of the residuals [-] per size [SI of the size], and between what its size may be."""

    name: str
    seems: str
    unless: str
    size_in_words: Callable[[float], str]
    low: float
    high: float
    change: Floats

    @property
    def tolerance(self) -> float:
        """Size up to which it is no news: none for an effect of the device, which is never negative."""
        return _OF_A_BENCH * self.high if self.low < 0.0 else 0.0


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
class Doubt:
    """What a fit cannot see of the directions: those that show, and for each coordinate the interval with the others.

    ``findings`` has all of them, ``shown`` those that alarm, the clearest first. ``low`` and ``high`` are the ends of
    intervals in coordinates with whatever size the recordings leave open; ``conditions`` (one for each coordinate)
    say what must not be for the interval without, empty where nothing can leave it.
    """

    findings: tuple[Finding, ...]
    shown: tuple[Finding, ...]
    low: Floats
    high: Floats
    conditions: tuple[str, ...]

    @property
    def misfit(self) -> str:
        """What shows, in a sentence, empty where nothing does."""
        if not self.shown:
            return ""
        first, alike = self.shown[0], [one for one in self.shown[1:] if abs(one.score) > 0.8 * abs(self.shown[0].score)]
        others = f"; so it would look if {' or if '.join(one.in_words for one in alike)}" if alike else ""
        return f"{first.in_words} ({abs(first.score):.2g} standard errors{others})"


def doubt_of(found: WhitenedFit, low: Floats, high: Floats) -> Doubt:
    """Return what the recordings say of all directions, and what they leave open of each parameter.

    ``low`` and ``high`` are the ends of the intervals in coordinates.
    """
    of_model = _of_model(found)
    columns = [*(sizes[0] for sizes in of_model), *_of_record(found)]
    starts = _slopes_of_starts(found.optimum.residuals, found.optimum.point)
    every = _findings(found, starts, columns, [column for sizes in of_model for column in sizes[1:]])
    findings, at_other_sizes = every[: len(columns)], every[len(columns) :]
    limit = _quantile(ALARM / max(1, len(findings)))
    shown = []
    for one in findings:
        if abs(one.score) > limit and abs(one.size) >= one.column.tolerance:
            alike = [other for other in at_other_sizes if other.column.name == one.column.name and other.score > 0.0]
            shown.append(max((one, *alike), key=lambda item: item.score))
    shown.sort(key=lambda one: -abs(one.score))
    # What cannot be, an effect that is negative, counts only where nothing else shows.
    possible = [one for one in shown if one.column.low <= one.size]
    others = [one for one in shown if one.column.low > one.size]
    clear = _not_noise(found, starts, possible, limit) or _not_noise(found, starts, others, limit)
    return Doubt(findings, clear, *_with_open_sizes(findings, found.optimum.point, low, high))


def _not_noise(found: WhitenedFit, starts: Floats, shown: Sequence[Finding], limit: float) -> tuple[Finding, ...]:
    """Return the findings from the first on that explains more than any noise of the sensors could.

    A score takes the noise as known, and that which is left when all directions are taken out is too little where it is
    slow. So noise of any kind is estimated without the effect and with it, and the likelihoods are compared.
    """
    if not shown:
        return ()
    without = _likelihood(found, starts)
    for place, one in enumerate(shown):
        with_it = _likelihood(found, np.column_stack([starts, one.column.change]))
        if with_it - without > limit**2:
            return tuple(shown[place:])
    return ()


def _quantile(chance: float) -> float:
    from scipy.special import ndtri

    return float(-ndtri(0.5 * chance))


def _of_model(found: WhitenedFit) -> list[list[Column]]:
    """Return the directions of the device, by runs with a little of each effect: at the size that is clear, then more.

    A direction bends with its size, so that one which shows is measured at larger ones too. Each change is that from a
    run of the same program in which the effects change nothing.
    """
    residuals, point = found.optimum.residuals, found.optimum.point
    find_effects(path for direction in EFFECT_DIRECTIONS for path in direction.neutral)
    fitted = [_fitted(one, residuals, point) for one in residuals.experiments]
    made = []
    effects = [one for one in EFFECT_DIRECTIONS if any(can_have(item.scenario, one) for item in fitted)]
    for together, prepare in ((effects, as_it_is), ((HEAT,), with_heat)):
        sizes = [(direction, size) for direction in together for size in direction.sizes]
        parts = [changes_with(one, sizes, prepare) for one in fitted]
        changes = list(np.concatenate(parts).T)
        for direction in together:
            found_at = [(size, change) for (one, size), change in zip(sizes, changes, strict=True) if one is direction]
            tried = [(size, change) for size, change in found_at if np.isfinite(change).all()]
            clear = _clear_size(found, tried)
            if clear is not None:
                made.append([_column(direction, change / size) for size, change in tried[clear:]])
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
            fitted = _fitted(one, residuals, point)
            free = {item.path for item in residuals.ranges if item.acts_in(one.label)}
            steps = {path: step for path, step in _START_STEPS.items() if path not in free}
            if not isinstance(fitted.scenario.motion, FreeMotion):
                steps.pop("motion.angle", None)
            for path, step in steps.items():
                at = number_at(fitted.scenario, path)
                values = signals_at(fitted, {path: np.array([at + step, at])}, 2)
                stacked = _stacked(one, values)
                column = np.zeros(total)
                column[first : first + count] = stacked[:, 0] - stacked[:, 1]
                columns.append(column)
        first += count
    finite = [column for column in columns if np.isfinite(column).all() and column.any()]
    return np.column_stack(finite) if finite else np.zeros((total, 0))


def _stacked(prepared: PreparedExperiment, signals: Mapping[str, Floats]) -> Floats:
    """Return the channels over their noise, one below the other (samples, runs)."""
    return np.concatenate([signals[channel.name] / channel.noise for channel in prepared.channels])


def _column(direction: Direction, change: Floats) -> Column:
    texts = direction.seems, direction.unless, direction.size_in_words
    return Column(direction.name, *texts, 0.0, direction.largest, change)


def _fitted(prepared: PreparedExperiment, residuals: Residuals, point: Floats) -> PreparedExperiment:
    """Return an experiment with the fitted numbers in its scenario."""
    numbers = numbers_in(prepared.label, residuals.ranges, point)
    offset = numbers.pop(TIME_OFFSET, prepared.time_offset)
    return replace(prepared, scenario=with_numbers(prepared.scenario, numbers), time_offset=offset)


def can_have(scenario: Scenario, direction: Direction) -> bool:
    """Return whether an effect can be tried: a free vane, the valve that it needs, and it is not on already."""
    is_on = any(effect.name == direction.name for effect in effects_of(scenario.device))
    fits = not direction.valve or scenario.device.valve.kind == direction.valve
    return isinstance(scenario.motion, FreeMotion) and fits and not is_on


def as_it_is(scenario: Scenario) -> Scenario | None:
    """Return the scenario itself."""
    return scenario


def with_heat(scenario: Scenario) -> Scenario | None:
    """Return the scenario with gas whose temperature follows from its energy, None where it has it already."""
    return None if scenario.thermal is not None else replace(scenario, thermal=Thermal(1.0, WALLS))


def changes_with(
    prepared: PreparedExperiment,
    sizes: Sequence[tuple[Direction, float]],
    prepare: Callable[[Scenario], Scenario | None],
) -> Floats:
    """Return the changes of the channels over their noise (samples, sizes), 0 where an effect cannot be."""
    count = sum(len(channel.values) for channel in prepared.channels)
    scenario = prepare(prepared.scenario)
    used = [place for place, (one, _) in enumerate(sizes) if one is HEAT or can_have(prepared.scenario, one)]
    found = np.zeros((count, len(sizes)))
    if scenario is None or not used:
        return found
    neutral = {path: number for place in used for path, number in sizes[place][0].neutral.items()}
    columns = {path: np.full(len(used) + 1, number) for path, number in neutral.items()}
    for run, place in enumerate(used):
        direction, size = sizes[place]
        for path, number in direction.settings(size).items():
            columns[path][run] = number
    made = prepare_samples(prepared.label, with_numbers(scenario, neutral), prepared.samples, {}, prepared.recorded)
    signals = signals_at(replace(made, time_offset=prepared.time_offset), columns, len(used) + 1)
    values = _stacked(prepared, signals)
    found[:, used] = values[:, :-1] - values[:, -1:]
    return found


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


def _of_record(found: WhitenedFit) -> list[Column]:
    """Return the directions of the record: a late clock, a gain that drifts and a zero of each sensor."""
    residuals, point = found.optimum.residuals, found.optimum.point
    experiments = residuals.experiments
    made = []
    if not any(item.path == TIME_OFFSET for item in residuals.ranges):
        late = [_late(one, residuals, point) for one in experiments]
        made.append(
            Column(
                "delay",
                "the clock of the recording seems to be off by {size}",
                "the clock of the recording is not off by more than {size}",
                lambda size: f"{1e3 * size:.2g} ms",
                -LATEST,
                LATEST,
                np.concatenate(late),
            )
        )
    fitted = {item.path for item in residuals.ranges}
    for sensor in dict.fromkeys(sensor.channel for sensor in found.sensors):
        drift, zero = [], []
        for one in experiments:
            away = 2.0 * (one.time - one.time[0]) / max(float(np.ptp(one.time)), _NO_TIME) - 1.0
            for channel in one.channels:
                is_it = float(channel.name == sensor)
                drift.append(is_it * 0.5 * away * channel.values / channel.noise)
                zero.append(is_it * np.ones(len(channel.values)) / channel.noise)
        made.append(
            Column(
                f"gain of {sensor}",
                f"the gain of {sensor} seems to drift by {{size}} over a recording",
                f"the gain of {sensor} does not drift by more than {{size}} over a recording",
                lambda size: f"{100.0 * size:.2g} %",
                -LARGEST_DRIFT,
                LARGEST_DRIFT,
                np.concatenate(drift),
            )
        )
        if f"{ZERO_OF}{sensor}" in fitted:
            continue
        is_angle = sensor == "angle"
        made.append(
            Column(
                f"zero of {sensor}",
                f"the zero of {sensor} seems to be off by {{size}}",
                f"the zero of {sensor} is not off by more than {{size}}",
                size_of_angle if is_angle else size_of_pressure,
                -LARGEST_ZERO[sensor],
                LARGEST_ZERO[sensor],
                np.concatenate(zero),
            )
        )
    return made


def size_of_angle(size: float) -> str:
    """Return an angle [rad] in words."""
    return f"{math.degrees(size):.2g} deg"


def size_of_pressure(size: float) -> str:
    """Return a difference of pressures [Pa] in words."""
    return f"{1e-3 * size:.2g} kPa"


def _late(prepared: PreparedExperiment, residuals: Residuals, point: Floats) -> Floats:
    """Return the change of the channels over their noise per second of delay of the record."""
    numbers = numbers_in(prepared.label, residuals.ranges, point)
    samples = replace(prepared.samples, reach=max(prepared.samples.reach, LATEST))
    finer = prepare_samples(prepared.label, prepared.scenario, samples, numbers, prepared.recorded)
    step = 0.1 * float(np.median(np.diff(prepared.time)))
    ends = [
        _stacked(prepared, values)[:, 0]
        for offset in (step, -step)
        for (values,) in (trajectories([replace(finer, time_offset=offset)], residuals.ranges, point[None, :]),)
    ]
    return np.asarray((ends[0] - ends[1]) / (2.0 * step))


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
    likely = [sensor_noise(parts, sensor.is_given, sensor.courses) for parts, sensor in pairs]
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


def _likelihood(found: WhitenedFit, more: Floats) -> float:
    """Return twice the log likelihood [-] at the best numbers and noise, less what Akaike's criterion takes for noise.

    ``more`` are columns of residuals (samples, columns) of unknown sizes. The noise of each sensor may be of any kind.
    """
    model, pulled = found.model, len(found.model.pull)
    more = more / np.maximum(np.max(np.abs(more), axis=0, initial=0.0), _INVISIBLE)
    whole = replace(model, columns=np.hstack([model.slopes, more, model.residuals[:, None]]))
    columns, residuals = whole.slopes, whole.residuals
    precision = np.zeros((columns.shape[1], columns.shape[1]))
    precision[:pulled, :pulled] = model.precision
    noises, weights, best = list(found.noises), [sensor.weights for sensor in found.sensors], -math.inf
    for _ in range(_ROUNDS):
        rows = whiten(whole, noises, weights)
        product = rows[:, :-1].T @ rows[:, -1]
        product[:pulled] += model.pull
        move = -solution(rows[:, :-1].T @ rows[:, :-1] + precision, product)
        left = residuals + columns @ move
        parts = [whole.segments(left, place) for place in range(len(model.sensors))]
        noises = [sensor_noise(own, one.is_given, one.courses) for own, one in zip(parts, found.sensors, strict=True)]
        weights = [tuple(sample_weights(noise, own)) for noise, own in zip(noises, parts, strict=True)]
        of_priors = float(move[:pulled] @ (2.0 * model.pull + model.precision @ move[:pulled]))
        best = max(best, 2.0 * sum(one.likelihood - one.numbers for one in noises) - of_priors)
    return best


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
