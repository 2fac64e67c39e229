"""What is wrong where a set and a recording do not agree: single changes are tried, and their likelihoods compared.

A change is a mistake of the record (channels swapped, a sign, a unit, a zero, a gain, a delay), one number of the set,
or one effect that the model lacks. Nothing is fitted but its size. What a bench may always have, a common delay and a
start known to the noise of its samples, is taken out with every change, and with the set as it is.
"""

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.errors import PpafoError
from ppafo.identification.estimate import limit_for
from ppafo.identification.linear_systems import solution_of
from ppafo.identification.noise.choice import Left, sensor_noises
from ppafo.identification.noise.sensor_noise import Course, SensorNoise, course_of
from ppafo.identification.trajectory.directions.catalogue import EFFECT_DIRECTIONS
from ppafo.identification.trajectory.directions.changes import changes_by_size
from ppafo.identification.trajectory.directions.zero import LARGEST_ZERO, size_of_angle, size_of_pressure
from ppafo.identification.trajectory.problem import (
    Experiment,
    broken_rule,
    declared_numbers,
    number_at,
    with_numbers,
)
from ppafo.identification.trajectory.residuals import Floats, PreparedExperiment, prepare, signals_at
from ppafo.model.catalog import find_effects
from ppafo.signals.recording import Recording
from ppafo.simulation.recorded import ANGLE, COMMAND, DORSIFLEXION_SUPPLY, EXTERNAL_TORQUE, SUPPLY, supply_paths
from ppafo.simulation.scenario import FreeMotion, Scenario

ALARM = 5.0e-4
"""Chance of a false alarm over all changes together, as for the other comparisons."""
_COMPARED = 8
"""Changes with the least squares of which the likelihood is compared."""
_FACTORS = (0.02, 0.2, 0.5, 0.8, 0.95, 1.05, 1.25, 2.0, 5.0)
_SEARCHES, _ROUNDS, _BETWEEN = 4, 3, 6
_ROOM_ROUNDS = 6
_LONGEST, _SHIFTS = 0.02, 41
_JUST_NOISE = 1.1
"""Standard deviation of what is left, over the noise, up to which nothing is searched if it is white too."""
_SAME = 0.02
"""Standard errors of a sample by which two changes differ that nothing can tell apart."""
_NEWS = 0.1
"""Fraction of the largest fault of a record that can be believed up to which every bench has it."""
_GAIN = 0.01
_OFFSET_APART, _ROOM = 0.5, 2.0e-3
"""Fraction of a sample from which a delay is one, and seconds by which it may be found to be another."""
_PRESSURES = ("pressure_1", "pressure_2")
_ATMOSPHERE, _ROOMS = "supply.atmospheric_pressure", (60.0e3, 110.0e3, 11)
"""Atmospheres [Pa] from 4,000 m to below the sea: first and last that are tried, and how many."""
_PSI = 6894.757
_UNITS = (
    ("kPa read as psi", 1.0e3 / _PSI),
    ("psi read as kPa", _PSI / 1.0e3),
    ("bar read as psi", 1.0e5 / _PSI),
    ("psi read as bar", _PSI / 1.0e5),
    ("kPa read as bar", 1.0e-2),
    ("bar read as kPa", 1.0e2),
)
_STARTS = {"pressure_1": "initial.pressure_1", "pressure_2": "initial.pressure_2", ANGLE: "motion.angle"}
_SECTIONS = ("gas", "actuator", "friction", "foot_plate", "supply", "valves")
_NOT_TRIED = ("actuator.angle_min", "actuator.angle_max", "actuator.restitution")


@dataclass(frozen=True, slots=True)
class Explanation:
    """One change: what it seems to be, in words, and by how much [-] it raises twice the logarithm of the likelihood.

    ``numbers`` are those of the set that it changes, by path, each with its SI unit; none for a mistake of the record
    or an effect.
    ``others`` are names of changes that do the same.
    """

    name: str
    in_words: str
    gain: float
    numbers: Mapping[str, tuple[float, str]]
    others: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Explanations:
    """Changes that explain recordings better than the set as it is, the best first; ``limit`` is the gain of a chance.

    ``tried`` is how many were.
    """

    found: tuple[Explanation, ...]
    limit: float
    tried: int

    @property
    def alike(self) -> tuple[Explanation, ...]:
        """Those that the best is not certainly better than, itself the first."""
        return tuple(one for one in self.found if one.gain > self.found[0].gain - self.limit)


@dataclass(frozen=True, slots=True)
class _Tried:
    """A change as it is tried: residuals [-] with it (samples,), and what would be said."""

    name: str
    in_words: str
    left: Floats
    numbers: Mapping[str, tuple[float, str]]
    is_news: bool = True


def explanations_of(experiments: Sequence[Experiment], delays: Sequence[float]) -> Explanations:
    """Return what single change would explain recordings better than their scenarios do, all of them together.

    ``delays`` [s] are those of the measurements, as far as they were seen. The noise of each channel is what it is at
    least. IdentificationError where a scenario cannot be run.
    """
    whole = _Whole.of(experiments, delays).with_finer_delays()
    base = whole.base()
    left = base.left
    noises = whole.noises(left)
    if all(one.shape.order == 0 and not one.grows and float(one.levels.max()) < _JUST_NOISE for one in noises):
        return Explanations((), limit_for(ALARM) ** 2, 0)
    tried = [
        *_mistakes(experiments, delays, float(left @ left)),
        *_other_room(experiments, delays),
        *_faults_of_channels(whole, base),
        *_numbers(whole),
        *_effects(whole, base),
    ]
    tried.sort(key=lambda one: float(one.left @ one.left))
    limit, without = limit_for(ALARM / max(1, len(tried))) ** 2, _likelihood(noises)
    found: list[tuple[Explanation, Floats]] = []
    for one in [one for one in tried if one.is_news][:_COMPARED]:
        same = [place for place, (_, other) in enumerate(found) if float(np.std(one.left - other)) < _SAME]
        if same:
            known, kept = found[same[0]]
            found[same[0]] = replace(known, others=(*known.others, one.name)), kept
            continue
        gain = _likelihood(whole.noises(one.left)) - without - 2.0
        if gain > limit:
            found.append((Explanation(one.name, one.in_words, gain, one.numbers), one.left))
    return Explanations(tuple(sorted((one for one, _ in found), key=lambda one: -one.gain)), limit, len(tried))


@dataclass(frozen=True, slots=True)
class _Whole:
    """All experiments made ready, each with its delay as it was found and with none."""

    prepared: tuple[PreparedExperiment, ...]
    delays: tuple[float, ...]

    @classmethod
    def of(cls, experiments: Sequence[Experiment], delays: Sequence[float]) -> "_Whole":
        """Make them ready."""
        made = [prepare(one, {}, abs(delay) + _ROOM) for one, delay in zip(experiments, delays, strict=True)]
        return cls(tuple(made), tuple(delays))

    def with_finer_delays(self) -> "_Whole":
        """Return the same with delays at which the set as it is leaves least: where flow begins, a tenth is seen."""
        found = []
        for prepared, delay in zip(self.prepared, self.delays, strict=True):
            finer = _offsets(prepared, delay)[-1]
            half = 0.5 * float(np.median(np.diff(prepared.time)))
            for _ in range(_ROUNDS if finer else 0):
                at = replace(prepared, time_offset=finer)
                signals = {name: values[:, 0] for name, values in signals_at(at, {}, 1).items()}
                left = _residuals(at, {name: values[:, None] for name, values in signals.items()})[:, 0]
                late = _nuisances(at, signals, np.zeros((len(left), 0)))[:, 0]
                moved = finer + half * float(late @ left) / max(float(late @ late), 1.0e-30)
                finer = min(max(moved, delay - _ROOM), delay + _ROOM)
            found.append(finer)
        return replace(self, delays=tuple(found))

    def least_squares(self) -> float:
        """Return the sum of the squares [-] of the residuals of the set as it is, with nothing taken out."""
        total = 0.0
        for prepared, delay in zip(self.prepared, self.delays, strict=True):
            options = [replace(prepared, time_offset=offset) for offset in _offsets(prepared, delay)]
            total += min(float(np.sum(np.square(_residuals(one, signals_at(one, {}, 1))))) for one in options)
        return total

    def base(self) -> "_Base":
        """Return the residuals of the set as it is."""
        raw, parts, every_start = [], [], []
        first = 0
        for prepared, delay in zip(self.prepared, self.delays, strict=True):
            options = []
            for offset in _offsets(prepared, delay):
                at = replace(prepared, time_offset=offset)
                by_channel = _starts_of(at)
                signals = {name: values[:, 0] for name, values in signals_at(at, {}, 1).items()}
                left = _residuals(at, {name: values[:, None] for name, values in signals.items()})[:, 0]
                columns = _nuisances(at, signals, np.column_stack([*by_channel.values(), np.zeros(len(left))]))
                options.append((float(np.sum(np.square(_less(columns, left)))), left, columns, by_channel))
            _, left, columns, by_channel = min(options, key=lambda one: one[0])
            every_start.append(by_channel)
            raw.append(left)
            parts.append((slice(first, first + len(left)), columns))
            first += len(left)

        names = {name for of_one in every_start for name in of_one}
        nothing = [np.zeros(len(one)) for one in raw]
        starts_of = {
            name: np.concatenate([one.get(name, none) for one, none in zip(every_start, nothing, strict=True)])
            for name in names
        }
        return _Base(np.concatenate(raw), tuple(parts), starts_of)

    def left(self, columns: Mapping[str, Floats], count: int) -> Floats:
        """Return the residuals [-] (samples, runs) without a common delay and the error of the start; NaN if one fails.

        A delay may be what a wrong number makes, so each experiment takes the better of the one found and none.
        """
        parts = []
        for prepared, delay in zip(self.prepared, self.delays, strict=True):
            options = []
            for offset in _offsets(prepared, delay):
                at = replace(prepared, time_offset=offset)
                options.append(_without_nuisances(at, signals_at(at, columns, count), count))
            squares = [np.einsum("ij,ij->j", one, one) for one in options]
            better = np.argmin(np.nan_to_num(np.array(squares), nan=np.inf), axis=0)
            parts.append(np.column_stack([options[which][:, run] for run, which in enumerate(better.tolist())]))
        return np.concatenate(parts)

    def noises(self, left: Floats) -> tuple[SensorNoise, ...]:
        """Return the noise of any kind that explains residuals [-] (samples,) of each channel best."""
        channels: dict[str, list[tuple[Floats, Course]]] = {}
        first = 0
        for prepared in self.prepared:
            for channel in prepared.channels:
                part = left[first : first + len(prepared.time)]
                course = course_of(prepared.time, part + channel.values / channel.noise)
                channels.setdefault(channel.name, []).append((part, course))
                first += len(prepared.time)
        return sensor_noises(
            [
                Left([part for part, _ in parts], is_given=True, courses=[course for _, course in parts])
                for parts in channels.values()
            ]
        )


@dataclass(frozen=True, slots=True)
class _Base:
    """Residuals [-] of the set as it is (``raw``), what delays and starts make of them by experiment, and each start.

    ``starts`` has the change of all residuals with the start of a channel, for the noise of one of its samples.
    """

    raw: Floats
    parts: tuple[tuple[slice, Floats], ...]
    starts: Mapping[str, Floats]

    def freed(self, left: Floats) -> Floats:
        """Return residuals without what a delay and the error of the start could make of them."""
        return np.concatenate([_less(columns, left[place]) for place, columns in self.parts])

    @property
    def left(self) -> Floats:
        """Those of the set as it is, freed."""
        return self.freed(self.raw)


def _likelihood(noises: Sequence[SensorNoise]) -> float:
    """Return twice the log likelihood [-] less what Akaike's criterion takes for the noise."""
    return sum(2.0 * (one.likelihood - one.numbers) for one in noises)


def _offsets(prepared: PreparedExperiment, delay: float) -> tuple[float, ...]:
    """Return the delays [s] that are tried: none, and the one that was found where it is no part of a sample."""
    return (0.0, delay) if abs(delay) > _OFFSET_APART * float(np.median(np.diff(prepared.time))) else (0.0,)


def _without_nuisances(prepared: PreparedExperiment, signals: Mapping[str, Floats], count: int) -> Floats:
    """Return the residuals [-] (samples, runs) less what a delay and the start could make of them."""
    left = _residuals(prepared, signals)
    by_channel = _starts_of(prepared)
    starts = np.column_stack([*by_channel.values(), np.zeros(len(left))])
    for run in range(count):
        if np.isfinite(left[:, run]).all():
            columns = _nuisances(prepared, {name: values[:, run] for name, values in signals.items()}, starts)
            left[:, run] = _less(columns, left[:, run])
    return left


def _residuals(prepared: PreparedExperiment, signals: Mapping[str, Floats]) -> Floats:
    parts = [(signals[one.name] - one.values[:, None]) / one.noise for one in prepared.channels]
    return np.concatenate(parts)


def _nuisances(prepared: PreparedExperiment, signals: Mapping[str, Floats], starts: Floats) -> Floats:
    """Return what half a sample of delay and one standard error of each start change (samples, columns) [-]."""
    half = 0.5 * float(np.median(np.diff(prepared.time)))
    slopes = [np.gradient(signals[one.name], prepared.time) / one.noise for one in prepared.channels]
    return np.column_stack([half * np.concatenate(slopes), starts])


def _less(columns: Floats, left: Floats) -> Floats:
    """Return residuals less what columns of sizes about 1 explain."""
    products = columns.T @ columns + np.eye(columns.shape[1])
    return np.asarray(left - columns @ solution_of(products, columns.T @ left))


def _starts_of(prepared: PreparedExperiment) -> dict[str, Floats]:
    """Return the change of the residuals [-] with the start of each channel, for the noise of one of its samples."""
    noises = {one.name: one.noise for one in prepared.channels}
    paths = {name: path for name, path in _STARTS.items() if name in noises}
    motion = prepared.scenario.motion
    if not isinstance(motion, FreeMotion) or motion.leg is not None:
        paths.pop(ANGLE, None)
    columns = {path: np.full(len(paths) + 1, number_at(prepared.scenario, path)) for path in paths.values()}
    for place, (name, path) in enumerate(paths.items()):
        columns[path][place] += noises[name]
    signals = signals_at(prepared, columns, len(paths) + 1)
    values = np.concatenate([signals[one.name] / one.noise for one in prepared.channels])
    changes = values[:, :-1] - values[:, -1:]
    return {name: change for name, change in zip(paths, changes.T, strict=True) if np.isfinite(change).all()}


def _with(recording: Recording, **values: Floats) -> Recording:
    for name, series in values.items():
        recording = recording.with_channel(name, series, recording.unit(name))
    return recording


def _mistakes(experiments: Sequence[Experiment], delays: Sequence[float], least: float) -> Iterator[_Tried]:
    """Mistakes of the record that change what a run follows: channels swapped, signs, units; those below ``least``."""
    for name, in_words, change in _changes_of_record(experiments):
        try:
            changed = tuple(change(one) for one in experiments)
            whole = _Whole.of(changed, delays)
            if not whole.least_squares() < least:
                continue
            left = whole.base().left
        except PpafoError:
            # A record that no such device could have made.
            continue
        if np.isfinite(left).all():
            yield _Tried(name, in_words, left, {})


def _changes_of_record(
    experiments: Sequence[Experiment],
) -> Iterator[tuple[str, str, Callable[[Experiment], Experiment]]]:
    names = set.intersection(*(set(one.recording.names) for one in experiments))
    compared = [name for name in _PRESSURES if name in names]
    if len(compared) == 2:
        yield "swap", "pressure_1 and pressure_2 seem to be swapped", _swapped
    if COMMAND in names:
        yield "sign of command", "the command seems to have the wrong sign", lambda one: _negative(one, COMMAND)
    if EXTERNAL_TORQUE in names and all(EXTERNAL_TORQUE in one.inputs for one in experiments):
        yield (
            "sign of external_torque",
            "external_torque seems to have the wrong sign",
            lambda one: _negative(one, EXTERNAL_TORQUE),
        )
    if ANGLE in names:
        yield "end of angle", "the angle seems to be counted from the other end", _from_other_end
    supplies = [name for name in (SUPPLY, DORSIFLEXION_SUPPLY) if name in names]
    every = [*compared, *supplies]
    groups = [every, *([compared] if supplies else []), *([supplies] if supplies and compared else [])]
    groups += [[name] for name in every if [name] not in groups]
    for group in groups:
        which = "all pressures" if group == every and len(every) > 1 else " and ".join(group)
        verb = "seem" if len(group) > 1 else "seems"
        for unit, factor in _UNITS:

            def other_unit(one: Experiment, group: list[str] = group, factor: float = factor) -> Experiment:
                room = one.scenario.device.supply.atmospheric_pressure
                return _with_pressures(one, group, lambda values: room + factor * (values - room), factor)

            yield f"unit of {', '.join(group)}", f"{which} {verb} to be {unit}", other_unit
        for words, sign in (("gauge pressures read as absolute", 1.0), ("absolute pressures read as gauge", -1.0)):

            def other_kind(one: Experiment, group: list[str] = group, sign: float = sign) -> Experiment:
                room = one.scenario.device.supply.atmospheric_pressure
                return _with_pressures(one, group, lambda values: values + sign * room)

            yield f"kind of {', '.join(group)}", f"{which} {verb} to be {words}", other_kind


def _other_room(experiments: Sequence[Experiment], delays: Sequence[float]) -> Iterator[_Tried]:
    """Another atmosphere for sensors that read gauge pressure: every absolute pressure moves with it."""
    own = experiments[0].scenario.device.supply.atmospheric_pressure

    def left_in(room: float) -> Floats | None:
        try:
            left = _Whole.of([_in_room(one, room - own) for one in experiments], delays).base().left
        except PpafoError:
            return None
        return left if np.isfinite(left).all() else None

    found: dict[float, Floats] = {}
    rooms, gap = np.linspace(*_ROOMS), 0.0
    for _ in range(_ROOM_ROUNDS):
        tried = {room: left_in(room) for room in rooms.tolist()}
        found |= {room: left for room, left in tried.items() if left is not None}
        if not found:
            return
        best = min(found, key=lambda room: float(found[room] @ found[room]))
        gap = 0.5 * float(rooms[1] - rooms[0]) if len(rooms) > 2 else 0.5 * gap
        rooms = np.array([best - gap, best + gap])
    words = (
        f"{_ATMOSPHERE} seems to be {best / own:.3g} times that of the set, under gauge pressures as they were recorded"
    )
    yield _Tried(
        f"{_ATMOSPHERE} of gauge pressures", words, found[best], {_ATMOSPHERE: (best, "Pa_a")}, abs(best - own) > gap
    )


def _in_room(one: Experiment, higher: float) -> Experiment:
    """Return an experiment whose atmosphere is higher by so much [Pa], and all its pressures with it."""
    supply = one.scenario.device.supply
    numbers = {
        _ATMOSPHERE: supply.atmospheric_pressure + higher,
        "supply.pressure": supply.pressure + higher,
        "supply.dorsiflexion_pressure": supply.dorsiflexion_pressure + higher,
    }
    scenario = with_numbers(one.scenario, numbers)
    first, second = one.scenario.initial_pressure_1 + higher, one.scenario.initial_pressure_2 + higher
    names = [name for name in (*_PRESSURES, SUPPLY, DORSIFLEXION_SUPPLY) if name in one.recording.names]
    return replace(
        one,
        recording=_with(one.recording, **{name: one.recording[name] + higher for name in names}),
        scenario=replace(scenario, initial_pressure_1=first, initial_pressure_2=second),
    )


def _negative(one: Experiment, name: str) -> Experiment:
    return replace(one, recording=_with(one.recording, **{name: -one.recording[name]}))


def _from_other_end(one: Experiment) -> Experiment:
    actuator, scenario = one.scenario.device.actuator, one.scenario
    both_ends = actuator.angle_min + actuator.angle_max
    if isinstance(scenario.motion, FreeMotion):
        scenario = with_numbers(scenario, {"motion.angle": both_ends - number_at(scenario, "motion.angle")})
    return replace(one, recording=_with(one.recording, **{ANGLE: both_ends - one.recording[ANGLE]}), scenario=scenario)


def _swapped(one: Experiment) -> Experiment:
    first, second = (one.recording[name] for name in _PRESSURES)
    scenario = one.scenario
    begins = scenario.initial_pressure_2, scenario.initial_pressure_1
    noise = {**one.noise}
    if all(name in noise for name in _PRESSURES):
        noise["pressure_1"], noise["pressure_2"] = noise["pressure_2"], noise["pressure_1"]
    return replace(
        one,
        recording=_with(one.recording, pressure_1=second, pressure_2=first),
        scenario=replace(scenario, initial_pressure_1=begins[0], initial_pressure_2=begins[1]),
        noise=noise,
    )


def _with_pressures(
    one: Experiment, names: Sequence[str], change: Callable[[Floats], Floats], factor: float = 1.0
) -> Experiment:
    """Return an experiment whose recorded pressures are others, its start with them, and their noise by a factor."""
    recording = _with(one.recording, **{name: change(one.recording[name]) for name in names})
    begins = {"pressure_1": one.scenario.initial_pressure_1, "pressure_2": one.scenario.initial_pressure_2}
    begins |= {name: float(change(np.array([begins[name]]))[0]) for name in names if name in begins}
    scenario = replace(one.scenario, initial_pressure_1=begins["pressure_1"], initial_pressure_2=begins["pressure_2"])
    noise = {name: size * (factor if name in names else 1.0) for name, size in one.noise.items()}
    return replace(one, recording=recording, scenario=scenario, noise=noise)


def _faults_of_channels(whole: _Whole, base: _Base) -> Iterator[_Tried]:
    """A zero, a gain and a delay of one channel in all recordings."""
    # A delay of one channel is half taken for one of all.
    without_delay = replace(whole, delays=(0.0,) * len(whole.delays)).base() if any(whole.delays) else base
    places: dict[str, list[tuple[slice, PreparedExperiment]]] = {}
    first = 0
    for prepared in whole.prepared:
        for channel in prepared.channels:
            places.setdefault(channel.name, []).append((slice(first, first + len(prepared.time)), prepared))
            first += len(prepared.time)
    for name, parts in places.items():
        ones, levels, begins = np.zeros(len(base.raw)), np.zeros(len(base.raw)), np.zeros(len(base.raw))
        for place, prepared in parts:
            channel = next(one for one in prepared.channels if one.name == name)
            ones[place], levels[place] = 1.0 / channel.noise, channel.values / channel.noise
        # A start that was read off the channel is wrong with it.
        start = base.starts.get(name, begins)
        for place, prepared in parts:
            channel = next(one for one in prepared.channels if one.name == name)
            begins[place] = number_at(prepared.scenario, _STARTS[name]) / channel.noise if name in base.starts else 0.0
        noise = next(one.noise for one in parts[0][1].channels if one.name == name)
        zero, left = _by(ones - start / noise, base)
        words = (size_of_angle if name == ANGLE else size_of_pressure)(zero)
        is_news = abs(zero) > _NEWS * LARGEST_ZERO[name]
        yield _Tried(f"zero of {name}", f"the zero of {name} seems to be off by {words}", left, {}, is_news)
        gain, left = _by(levels - begins.max(initial=0.0) * start, base)
        words = f"{name} seems to be read {1.0 / max(1.0 - gain, 1.0e-3):.4g} times too large"
        yield _Tried(f"gain of {name}", words, left, {}, abs(gain) > _NEWS * _GAIN)
        options = [_delayed(name, parts, one) for one in (base, without_delay)]
        yield min(options, key=lambda one: float(one.left @ one.left))


def _by(column: Floats, base: _Base) -> tuple[float, Floats]:
    """Return how much of a column is too much in the samples, and what is left without it."""
    free, left = base.freed(column), base.left
    size = -float(free @ left) / max(float(free @ free), 1.0e-30)
    return size, left + size * free


def _delayed(name: str, parts: Sequence[tuple[slice, PreparedExperiment]], base: _Base) -> _Tried:
    """The delay of one channel that leaves least."""

    def at(delay: float) -> Floats:
        found = base.raw.copy()
        for place, prepared in parts:
            channel = next(one for one in prepared.channels if one.name == name)
            model = base.raw[place] * channel.noise + channel.values
            found[place] = (np.interp(prepared.time - delay, prepared.time, model) - channel.values) / channel.noise
        return base.freed(found)

    delays = np.linspace(-_LONGEST, _LONGEST, _SHIFTS)
    for _ in range(_ROUNDS):
        costs = [float(one @ one) for one in (at(float(delay)) for delay in delays)]
        best = int(np.argmin(costs))
        chosen = float(delays[best])
        delays = np.linspace(delays[max(0, best - 1)], delays[min(len(delays) - 1, best + 1)], 2 * _BETWEEN + 1)
    interval = float(np.median(np.diff(parts[0][1].time)))
    words = f"{name} seems to be {'later' if chosen > 0.0 else 'earlier'} than the other channels by "
    is_news = abs(chosen) > _NEWS * interval
    return _Tried(f"delay of {name}", f"{words}{1e3 * abs(chosen):.2g} ms", at(chosen), {}, is_news)


def _numbers(whole: _Whole) -> Iterator[_Tried]:
    """Each number of the set at the factor that leaves least."""
    scenario = whole.prepared[0].scenario
    followed = {path for one in whole.prepared if one.recorded is not None for path in _followed(one)}
    paths = {}
    for path in declared_numbers(scenario):
        value = number_at(scenario, path)
        if path.split(".")[0] in _SECTIONS and path not in (*_NOT_TRIED, *followed) and value > 0.0:
            paths[path] = value
    known, kept = {path: np.append(_FACTORS, 1.0) for path in paths}, len(paths)
    factors = {path: np.array(_FACTORS) for path in paths}
    for turn in range(_SEARCHES):
        lanes = [(path, float(factor)) for path, own in factors.items() for factor in own]
        columns = {path: np.full(len(lanes), paths[path]) for path in factors}
        is_allowed = np.array([_is_allowed(scenario, path, factor * paths[path]) for path, factor in lanes])
        for lane, (path, factor) in enumerate(lanes):
            columns[path][lane] *= factor if is_allowed[lane] else 1.0
        left = whole.left(columns, len(lanes))
        squares = np.where(is_allowed, np.einsum("ij,ij->j", left, left), np.inf)
        squares = np.where(np.isfinite(squares), squares, np.inf)
        best: dict[str, int] = {}
        for lane in np.argsort(squares).tolist():
            best.setdefault(lanes[lane][0], lane)
        if turn < _SEARCHES - 1:
            # Those that leave least are searched further between the neighbours of the best factor, which may be 1.
            kept = max(_COMPARED // 2, kept // 2)
            nearer = {}
            for path in list(best)[:kept]:
                found = np.sort(known[path])
                place = int(np.argmin(np.abs(found - lanes[best[path]][1])))
                ends = found[max(0, place - 1)], found[min(len(found) - 1, place + 1)]
                nearer[path] = known[path] = np.geomspace(*ends, _BETWEEN + 2)
            factors = nearer
    for path, lane in best.items():
        if np.isfinite(squares[lane]):
            factor = lanes[lane][1]
            end = " or less" if factor <= _FACTORS[0] else " or more" if factor >= _FACTORS[-1] else ""
            words = f"{path} seems to be {factor:.3g} times that of the set{end}"
            unit = declared_numbers(scenario)[path].unit
            yield _Tried(path, words, left[:, lane], {path: (factor * paths[path], unit)})


def _is_allowed(scenario: Scenario, path: str, number: float) -> bool:
    quantity = declared_numbers(scenario)[path]
    is_inside = quantity.minimum <= number <= quantity.maximum
    return is_inside and not broken_rule(with_numbers(scenario, {path: number}).device)


def _followed(one: PreparedExperiment) -> tuple[str, ...]:
    """Paths of the numbers that a run takes from its recording."""
    assert one.recorded is not None
    found = tuple(supply_paths(one.scenario.device)) if one.recorded.has(SUPPLY) else ()
    names = {"plant.supply_pressure": "supply.pressure", "plant.dorsiflexion_pressure": "supply.dorsiflexion_pressure"}
    return (*found, *(names.get(path, path) for path in found))


def _effects(whole: _Whole, base: _Base) -> Iterator[_Tried]:
    """Each effect of the catalogue of directions at the size that leaves least, in straight lines between sizes."""
    find_effects(path for direction in EFFECT_DIRECTIONS for path in direction.neutral)
    for direction, changes in changes_by_size(whole.prepared, EFFECT_DIRECTIONS):
        own = [(0.0, np.zeros(len(base.raw)))] + [(size, base.freed(change)) for size, change in changes]
        found = _best_between(base.left, own)
        if found is not None:
            size, left = found
            words = direction.seems.format(size=direction.size_in_words(size))
            yield _Tried(direction.name, words, left, {})


def _best_between(base: Floats, known: Sequence[tuple[float, Floats]]) -> tuple[float, Floats] | None:
    """Return the size between those known that leaves least, with what it leaves; None where no size does anything."""
    best, least = None, float(base @ base)
    for (low, before), (high, after) in itertools.pairwise(known):
        way = after - before
        length = float(way @ way)
        if length <= 0.0:
            continue
        share = min(max(-float((base + before) @ way) / length, 0.0), 1.0)
        left = base + before + share * way
        if float(left @ left) < least:
            least, best = float(left @ left), (low + share * (high - low), left)
    return best
