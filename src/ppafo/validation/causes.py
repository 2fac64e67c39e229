"""What single cause would explain recordings of which a model leaves more than noise.

A cause is a model of a sensor, y = h(model; a) + e, or another number of the set: the recorded samples stay as they
are, so that hypotheses are compared by what they leave of the same samples. G = sum over channels of
n [ln max(MS0/s^2, 1) - ln max(MSc/s^2, 1)] - k ln N, with MS the mean square left, s the noise of the samples and k = 1
for a cause with a size. A common delay, and a start that was read from noisy samples, are taken out with every cause.
"""

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ppafo.constants import PASCALS_PER_PSI
from ppafo.errors import PpafoError
from ppafo.model.effects.second_virial import SECOND_VIRIAL
from ppafo.parameters.declaration import AREA_FORM, SONIC_FORM
from ppafo.parameters.device import Device, Orifice
from ppafo.progress import Progress, Report, report_nothing
from ppafo.signals.faults import is_at_limit, is_noisy, plateaus
from ppafo.signals.recording import Floats
from ppafo.simulation.numbers import declared_numbers, number_at, with_numbers
from ppafo.simulation.recorded import COMMAND, DORSIFLEXION_SUPPLY, EXTERNAL_TORQUE, SUPPLY, samples_at_rest
from ppafo.validation.agreement import RecordingAgreement, ReplaySettings, measured_values, replay_of
from ppafo.validation.measured import ANGLE, PRESSURE_1, PRESSURE_2, Measured
from ppafo.validation.replay import Motion, Replay, Replayed, replay_together, replayed_scenario

ONLY_NOISE = 2.0
"""Mean square left over that of the noise up to which nothing but noise is left."""
USUAL_ANGLE, USUAL_PRESSURE, USUAL_GAIN, USUAL_DELAY = math.radians(0.5), 0.3 * PASCALS_PER_PSI, 0.005, 1.0e-3
"""Zeros [rad], [Pa], gain [-] and delay [s] by which sensors of any bench are off: no disagreement."""
_SENSORS = (ANGLE, PRESSURE_1, PRESSURE_2)
_TOGETHER = 32
_STEPS = 2
_DIFFERENCE = 0.02
"""Fraction of the distance between two sizes of a grid over which a derivative is taken."""
_FEWEST_CLIPPED, _OUTLIER, _OVER_STEPS = 5, 6.0, 3.0
_AT_REST = 2.0


@dataclass(frozen=True, slots=True)
class Cause:
    """One cause: its name, what it seems to be in words, and by how much G [-] it explains more than none.

    ``left`` is the largest error over noise [-] of any channel with it; 0 for samples that no sensor made. ``numbers``
    are those of the set that it changes, by path, each with its SI unit. ``same`` are those that the recordings cannot
    tell from it, ``is_usual`` says that any bench has as much.
    """

    name: str
    in_words: str
    gain: float
    left: float
    numbers: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    is_usual: bool = False
    same: "tuple[Cause, ...]" = ()


@dataclass(frozen=True, slots=True)
class Causes:
    """The cause of a disagreement, if one is found; else the ``nearest``; ``tried`` is how many were compared.

    ``is_noise`` says that nothing but noise is left without any.
    """

    found: Cause | None = None
    nearest: Cause | None = None
    tried: int = 0
    is_noise: bool = False


@dataclass(frozen=True, slots=True)
class Sensor:
    """What a sensor makes of a true value: a gain [-] about a value, a zero in the channel's unit, a delay [s]."""

    gain: float = 1.0
    zero: float = 0.0
    about: float = 0.0
    delay: float = 0.0

    def of(self, true: Floats) -> Floats:
        """Return the readings of true values."""
        return self.about + self.gain * (true - self.about) + self.zero

    def true(self, readings: Floats) -> Floats:
        """Return the values of readings."""
        return self.about + (readings - self.zero - self.about) / self.gain


@dataclass(frozen=True, slots=True)
class Change:
    """How record and device differ from the set: sensors by channel, numbers by path [SI], settings of an effect."""

    sensors: Mapping[str, Sensor] = field(default_factory=dict)
    numbers: Mapping[str, float] = field(default_factory=dict)
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    is_swapped: bool = False
    clock: float = 1.0
    motion: Motion | None = None


@dataclass(frozen=True, slots=True)
class Candidate:
    """A cause before its size is known: what a size changes, its words with the place of ``shown`` times the size.

    ``sizes`` are tried first; a cause with one has nothing to fit. A size that ``is_ratio`` is sought as a logarithm.
    ``usual`` is the largest size, or logarithm, that any bench has; ``unit`` is that of the number of the set.
    """

    name: str
    words: str
    change: Callable[[float], Change]
    sizes: tuple[float, ...] = (0.0,)
    is_ratio: bool = False
    shown: float = 1.0
    usual: float = 0.0
    unit: str = ""

    @property
    def grid(self) -> list[float]:
        """Sizes as they are sought."""
        return [math.log(size) if self.is_ratio else size for size in self.sizes]

    def at(self, size: float) -> Change:
        """Return the change of a size that was sought."""
        return self.change(math.exp(size) if self.is_ratio else size)

    def in_words(self, size: float) -> str:
        """Return what a cause of this size seems to be."""
        return self.words.format(self.shown * (math.exp(size) if self.is_ratio else size))


@dataclass(frozen=True, slots=True)
class _Channel:
    name: str
    values: Floats
    noise: float


@dataclass(frozen=True, slots=True)
class _Record:
    """A recording that is compared: its channels, the delay [s] that was found, and how its start may be off."""

    measured: Measured
    channels: tuple[_Channel, ...]
    delay: float
    starts: tuple[Floats, ...] = ()


def causes_of(
    read: Sequence[Measured],
    agreements: Sequence[RecordingAgreement],
    device: Device,
    settings: ReplaySettings,
    report: Report = report_nothing,
) -> Causes:
    """Return what single cause explains all recordings together; none where nothing but noise is left of them."""
    search = _Search(device, settings, [], report)
    for measured, agreement in zip(read, agreements, strict=True):
        search.records.append(search.record_of(measured, agreement))
    none, _ = search.evaluated([Change()])[0]
    if none is not None and float(none.max()) < ONLY_NOISE:
        return Causes(is_noise=True)
    if none is None:
        return Causes()
    faults = tuple(_faults(search.records, none))
    if faults:
        return Causes(replace(faults[0], same=faults[1:]), None, len(none))
    if settings.motion == "measured":
        # The angle is an input, and a delay of the sensors one of an input.
        return Causes()
    report(Progress("searching for causes"))
    tried: list[Cause] = []
    names = set.intersection(*(set(one.recording.names) for one in read))
    # Numbers of the set are compared with sensors: the gain of a command is the area of its valve.
    stages = (_motions(search), _exchanges(device, names), [*_sizes(device, names), *_numbers(search)])
    for stage in (*stages, _effects(device)):
        tried += search.compared(list(stage), none)
        tried.sort(key=lambda one: -one.gain)
        named = [one for one in tried if one.left**2 < ONLY_NOISE and one.gain > 0.0]
        if named:
            # Of those that the recordings cannot tell apart, numbers of the set come first.
            alike = [one for one in named if one.gain > named[0].gain - search.penalty]
            first, *others = sorted(alike, key=lambda one: not one.numbers)
            return Causes(replace(first, same=tuple(others)), None, len(tried))
    return Causes(None, tried[0] if tried else None, len(tried))


@dataclass(frozen=True, slots=True)
class _Search:
    device: Device
    settings: ReplaySettings
    records: list[_Record]
    report: Report

    @property
    def counts(self) -> Floats:
        """Samples of each channel of each recording."""
        return np.array([one.values.size for record in self.records for one in record.channels], dtype=np.float64)

    @property
    def penalty(self) -> float:
        """The logarithm of the number of samples: what a size must explain more, and what two causes may differ by."""
        return math.log(float(self.counts.sum()))

    def record_of(self, measured: Measured, agreement: RecordingAgreement) -> _Record:
        """Return a recording with how its residuals change with the start of each channel, by its standard error."""
        chosen = [one for one in agreement.channels if one.channel in _SENSORS] or list(agreement.channels[:1])
        channels = []
        for one in chosen:
            values = measured_values(measured.recording, one.channel)
            assert values is not None
            channels.append(_Channel(one.channel, values, one.noise))
        bare = _Record(measured, tuple(channels), agreement.delay.correction)
        own = replay_of(measured, self.device, self.settings)
        wanted, count = [own], samples_at_rest(measured.recording)
        for item in channels:
            if item.name in _SENSORS and item.name not in self.settings.initial:
                error = item.noise / math.sqrt(count)
                upper = self.device.actuator.angle_max - error
                way = -error if item.name == ANGLE and own.start.angle > upper else error
                moved = {item.name: getattr(own.start, item.name) + way}
                wanted.append(replace(own, start=replace(own.start, **moved)))
        first, *others = replay_together(wanted)
        columns = [
            _signals(bare, other, Change(), 0.0)[0] - _signals(bare, first, Change(), 0.0)[0]
            for other in others
            if isinstance(first, Replayed) and isinstance(other, Replayed)
        ]
        return replace(bare, starts=tuple(columns))

    def evaluated(self, changes: Sequence[Change]) -> list[tuple[Floats | None, Floats]]:
        """Return, for each change, the mean square left in each channel over that of its noise, and what is left."""
        left: list[tuple[Floats | None, Floats]] = []
        for first in range(0, len(changes), _TOGETHER):
            if first:
                self.report(Progress("searching for causes", first, len(changes)))
            some = changes[first : first + _TOGETHER]
            parts = [self._left(record, some) for record in self.records]
            for place in range(len(some)):
                own = [part[place] for part in parts]
                if any(one is None for one in own):
                    left.append((None, np.zeros(0)))
                    continue
                blocks = [block for one in own if one is not None for block in one]
                squares = np.array([float(np.mean(block * block)) for block in blocks])
                left.append((squares, np.concatenate(blocks)))
        return left

    def _left(self, record: _Record, changes: Sequence[Change]) -> list[list[Floats] | None]:
        replays: dict[int, Replay] = {}
        for place, change in enumerate(changes):
            try:
                replays[place] = self._replay(record.measured, change)
            except PpafoError:
                # Samples that no such device could have made.
                continue
        replayed = dict(zip(replays, replay_together(list(replays.values())), strict=True))
        found: list[list[Floats] | None] = []
        for place, change in enumerate(changes):
            one = replayed.get(place)
            found.append(
                _freed(record, one, change, self.settings.longest_delay) if isinstance(one, Replayed) else None
            )
        return found

    def _replay(self, measured: Measured, change: Change) -> Replay:
        """Return the replay of what the sensors saw, on the device with the numbers of a change."""
        recording = measured.recording
        for name, sensor in change.sensors.items():
            if name in recording:
                values = sensor.true(recording[name])
                values = np.clip(values, -1.0, 1.0) if name == COMMAND else values
                recording = recording.with_channel(name, values, recording.unit(name))
        if change.is_swapped:
            for name, other in _SWAPPED.items():
                recording = recording.with_channel(name, measured.recording[other], measured.recording.unit(other))
        if change.clock != 1.0:
            first = recording.time[0]
            recording = replace(recording, time=first + (recording.time - first) / change.clock)
        settings = self.settings if change.motion is None else replace(self.settings, motion=change.motion)
        wanted = replay_of(replace(measured, recording=recording), self.device, settings)
        device = replace(wanted.device, effects={**wanted.device.effects, **change.effects})
        if change.numbers:
            scenario = replace(replayed_scenario(wanted), device=device)
            device = with_numbers(scenario, change.numbers).device
        return replace(wanted, device=device)

    def compared(self, candidates: Sequence[Candidate], none: Floats) -> list[Cause]:
        """Return the candidates at the sizes that leave least: the best of a grid, then two Gauss-Newton steps.

        A size at an end of its grid is refused.
        """
        best: dict[str, _Tried] = {}
        self._keep_better(best, [(one, size) for one in candidates for size in one.grid], none)
        moved = [one for one in candidates if len(one.sizes) > 1 and one.name in best]
        between = {one.name: _neighbours(one.grid, best[one.name].size) for one in moved}
        for _ in range(_STEPS):
            lengths = {name: _DIFFERENCE * (high - low) for name, (low, high) in between.items()}
            beside = self.evaluated([one.at(best[one.name].size + lengths[one.name]) for one in moved])
            runs = []
            for one, (squares, left) in zip(moved, beside, strict=True):
                if squares is not None:
                    at = best[one.name]
                    slope = (left - at.left) / lengths[one.name]
                    size = at.size - float(slope @ at.left) / max(float(slope @ slope), 1.0e-300)
                    low, high = between[one.name]
                    runs.append((one, min(max(size, low), high)))
            self._keep_better(best, runs, none)
        return [
            Cause(
                name=one.name,
                in_words=one.in_words(at.size),
                gain=at.gain,
                left=math.sqrt(float(at.squares.max())),
                numbers={path: (value, one.unit) for path, value in one.at(at.size).numbers.items() if one.unit},
                is_usual=0.0 < abs(at.size) <= one.usual,
            )
            for one, at in ((one, best[one.name]) for one in candidates if one.name in best)
            if len(one.sizes) == 1 or min(one.grid) < at.size < max(one.grid)
        ]

    def _keep_better(self, best: "dict[str, _Tried]", runs: Sequence[tuple[Candidate, float]], none: Floats) -> None:
        for (one, size), (squares, left) in zip(
            runs, self.evaluated([one.at(size) for one, size in runs]), strict=True
        ):
            if squares is None:
                continue
            parts = np.log(np.maximum(none, 1.0)) - np.log(np.maximum(squares, 1.0))
            gain = float(self.counts @ parts) - (self.penalty if len(one.sizes) > 1 else 0.0)
            if one.name not in best or gain > best[one.name].gain:
                best[one.name] = _Tried(size=size, squares=squares, left=left, gain=gain)


class _Tried(NamedTuple):
    size: float
    squares: Floats
    left: Floats
    gain: float


def _neighbours(sizes: Sequence[float], size: float) -> tuple[float, float]:
    place = sorted(sizes).index(size)
    return sorted(sizes)[max(0, place - 1)], sorted(sizes)[min(len(sizes) - 1, place + 1)]


_SWAPPED = {PRESSURE_1: PRESSURE_2, PRESSURE_2: PRESSURE_1}


def _signals(record: _Record, replayed: Replayed, change: Change, offset: float) -> tuple[Floats, Floats]:
    """Return the readings of all channels over their noise, and how they change with one sample of delay."""
    time, model = record.measured.recording.time, replayed.recording
    true = time[0] + (time - time[0]) / change.clock
    readings, slopes = [], []
    for one in record.channels:
        sensor = change.sensors.get(one.name, Sensor())
        source = _SWAPPED.get(one.name, one.name) if change.is_swapped else one.name
        values = sensor.of(np.interp(true - offset - sensor.delay, model.time, model[source])) / one.noise
        readings.append(values)
        slopes.append(np.gradient(values))
    return np.concatenate(readings), np.concatenate(slopes)


def _freed(record: _Record, replayed: Replayed, change: Change, longest_delay: float) -> list[Floats]:
    """Return what is left in each channel, over its noise, without a common delay and the error of the start.

    The delay that was found may be what a wrong model makes: it is sought from there and from none.
    """
    measured = np.concatenate([one.values / one.noise for one in record.channels])
    interval = float(np.median(np.diff(record.measured.recording.time)))
    options = []
    for first in {0.0, record.delay}:
        offset = first
        for _ in range(_STEPS + 1):
            readings, slope = _signals(record, replayed, change, offset)
            columns = np.vstack([slope, *record.starts])
            left = measured - readings
            sizes = np.linalg.solve(columns @ columns.T + np.eye(len(columns)), columns @ left)
            left = left - sizes @ columns
            offset = min(max(offset - interval * float(sizes[0]), -longest_delay), longest_delay)
        options.append(left)
    return np.split(min(options, key=lambda one: float(one @ one)), len(record.channels))


def _faults(records: Sequence[_Record], none: Floats) -> Iterator[Cause]:
    """Constant channels, clipped samples and isolated outliers of channels that the model does not explain."""
    channels = [(record, one) for record in records for one in record.channels]
    for (record, one), square in zip(channels, none.tolist(), strict=True):
        words = _fault_of(one, record.measured.recording.time) if square >= ONLY_NOISE else ""
        if words:
            file = f" ({record.measured.file})" if len(records) > 1 else ""
            yield Cause(f"samples of {one.name}", f"{one.name} {words}{file}", 0.0, 0.0)


def _fault_of(one: _Channel, time: Floats) -> str:
    values = one.values
    levels, counts = np.unique(values, return_counts=True)
    if len(levels) == 1:
        dead = "its sensor is dead or not connected"
        return (
            f"never changes: the vane was locked (--motion held), or {dead}"
            if one.name == ANGLE
            else f"never changes: {dead}"
        )
    for place, word in ((0, "least"), (-1, "largest")):
        others = int(counts[1:-1].max(initial=1))
        is_many = counts[place] >= _FEWEST_CLIPPED * others
        # A vane runs into its stops, and only noise tells that from a sensor at its limit.
        is_sudden = one.name != ANGLE and any(is_at_limit(values, plateau) for plateau in plateaus(values))
        if is_many and (is_sudden or is_noisy(values[values != levels[place]])):
            return f"is clipped: {counts[place]} samples are exactly its {word} value"
    around = np.lib.stride_tricks.sliding_window_view(np.pad(values, 2, mode="edge"), 5)
    away = np.abs(values - np.median(around, axis=1))
    is_out = (away > _OUTLIER * one.noise) & (away > _OVER_STEPS * np.ptp(around[:, [0, 1, 3, 4]], axis=1))
    if not is_out.any():
        return ""
    count, first = int(is_out.sum()), float(time[int(np.argmax(is_out))])
    return f"has {count} isolated outlier{'s' * (count > 1)}, the first at {first:.6g} s"


def _with_gain(names: Iterable[str], about: float, gain: float) -> Change:
    return Change(dict.fromkeys(names, Sensor(gain, about=about)))


def _with_zero(names: Iterable[str], zero: float) -> Change:
    return Change(dict.fromkeys(names, Sensor(zero=zero)))


def _late(names: Iterable[str], delay: float) -> Change:
    return Change(dict.fromkeys(names, Sensor(delay=delay)))


def _with_number(path: str, own: float, factor: float) -> Change:
    return Change(numbers={path: factor * own})


def _with_effect(name: str, scaled: Iterable[str], given: Mapping[str, float], size: float) -> Change:
    return Change(effects={name: {**given, **dict.fromkeys(scaled, size)}})


def _motions(search: _Search) -> Iterator[Candidate]:
    """A vane that is held, where the model moves it and the recorded angle rests."""
    if search.settings.motion in ("free", "leg"):
        angles = [one for record in search.records for one in record.channels if one.name == ANGLE]
        if angles and all(float(np.std(one.values)) < _AT_REST * one.noise for one in angles):
            words = "the vane seems to be locked, for its recorded angle rests (--motion held)"
            yield Candidate("motion", words, lambda _: Change(motion="held"))


_UNITS = {
    "kPa read as psi": PASCALS_PER_PSI / 1.0e3,
    "psi read as kPa": 1.0e3 / PASCALS_PER_PSI,
    "bar read as psi": PASCALS_PER_PSI / 1.0e5,
    "psi read as bar": 1.0e5 / PASCALS_PER_PSI,
    "kPa read as bar": 1.0e2,
    "bar read as kPa": 1.0e-2,
}


def _groups(names: Collection[str]) -> Iterator[tuple[str, tuple[str, ...], str]]:
    """Pressure sensors that may be wrong together: in words, by channel, and the verb that goes with them."""
    chambers = tuple(name for name in (PRESSURE_1, PRESSURE_2) if name in names)
    supplies = tuple(name for name in (SUPPLY, DORSIFLEXION_SUPPLY) if name in names)
    every = {(name,) for name in (*chambers, *supplies)} | {chambers, supplies, (*chambers, *supplies)}
    for group in sorted(every - {()}, key=lambda one: (-len(one), one)):
        is_all = len(group) > 1 and len(group) == len(chambers) + len(supplies)
        words = "all pressures" if is_all else " and ".join(group)
        yield words, group, "seem" if len(group) > 1 else "seems"


def _exchanges(device: Device, names: Collection[str]) -> Iterator[Candidate]:
    """Units, gauge or absolute, swapped channels and signs: mistakes without a size."""
    room, actuator = device.supply.atmospheric_pressure, device.actuator
    for group_words, group, verb in _groups(names):
        for unit, factor in _UNITS.items():
            words = f"{group_words} {verb} to be {unit}"
            yield Candidate(words, words, partial(_with_gain, group, room), (factor,))
        for kind, zero in (("gauge read as absolute", -room), ("absolute read as gauge", room)):
            words = f"{group_words} {verb} to be {kind}"
            yield Candidate(words, words, partial(_with_zero, group), (zero,))
    if PRESSURE_1 in names and PRESSURE_2 in names:
        yield Candidate("swap", "pressure_1 and pressure_2 seem to be swapped", lambda _: Change(is_swapped=True))
    for name in (COMMAND, EXTERNAL_TORQUE):
        if name in names:
            words = f"{name} seems to have the wrong sign"
            yield Candidate(f"sign of {name}", words, partial(_with_gain, [name], 0.0), (-1.0,))
    if ANGLE in names:
        middle = 0.5 * (actuator.angle_min + actuator.angle_max)
        words = "the angle seems to be counted from the other end"
        yield Candidate("end of angle", words, partial(_with_gain, [ANGLE], middle), (-1.0,))


def _both_ways(*sizes: float) -> tuple[float, ...]:
    return (*(-size for size in reversed(sizes)), *sizes)


_ZEROS = _both_ways(0.003, 0.01, 0.03, 0.1, 0.3, 0.6)
"""In radians, full openings and gauge pressures of the supply."""
_GAINS = (0.3, 0.6, 0.8, 0.95, 0.98, 1.02, 1.05, 1.25, 1.6, 3.0)
_DELAYS = _both_ways(0.001, 0.003, 0.006, 0.012, 0.025)
_LONG_DELAYS = _both_ways(0.015, 0.03, 0.05, 0.08, 0.12)
_RATES = (0.7, 0.85, 0.94, 0.98, 0.995, 1.005, 1.02, 1.06, 1.15, 1.4)


def _sizes(device: Device, names: Collection[str]) -> Iterator[Candidate]:
    """Gain and zero of one sensor, of all pressures, of command and supply; delays and the rate of the clock."""
    supply = device.supply
    room = supply.atmospheric_pressure
    gauge = max(supply.pressure, supply.dorsiflexion_pressure) - room
    sensors = [
        (words, group, verb, room, gauge, "kPa", 1.0e-3, USUAL_PRESSURE, USUAL_GAIN)
        for words, group, verb in _groups(names)
    ]
    if ANGLE in names:
        sensors.append((ANGLE, (ANGLE,), "seems", 0.0, 1.0, "deg", math.degrees(1.0), USUAL_ANGLE, USUAL_GAIN))
    sensors.append((COMMAND, (COMMAND,), "seems", 0.0, 1.0, "of full opening", 1.0, 0.0, 0.0))
    for words, group, verb, about, size, unit, shown, usual_zero, usual_gain in sensors:
        yield Candidate(
            f"zero of {words}",
            f"the zero of {words} seems to be off by {{:+.3g}} {unit}",
            partial(_with_zero, group),
            tuple(size * part for part in _ZEROS),
            shown=shown,
            usual=usual_zero,
        )
        yield Candidate(
            f"gain of {words}",
            f"{words} {verb} to be read {{:.4g}} times too large",
            partial(_with_gain, group, about),
            _GAINS,
            is_ratio=True,
            usual=usual_gain,
        )
    compared = [name for name in _SENSORS if name in names]
    for name in compared:
        words = f"{name} seems to be later than the other channels by {{:.3g}} ms"
        yield Candidate(f"delay of {name}", words, partial(_late, [name]), _DELAYS, shown=1.0e3, usual=USUAL_DELAY)
    words = "all sensors seem to be later than the command by {:.3g} ms"
    yield Candidate("delay of all sensors", words, partial(_late, compared), _LONG_DELAYS, shown=1.0e3)
    words = "the clock of the recording seems to run {:.4g} times as fast"
    yield Candidate("rate of the clock", words, lambda rate: Change(clock=rate), _RATES, is_ratio=True)


_FACTORS = (0.01, 0.05, 0.2, 0.5, 0.8, 0.95, 1.05, 1.25, 2.0, 5.0, 20.0)
_ROOMS = (0.6, 0.7, 0.8, 0.9, 0.95, 1.03, 1.1)
_SECTIONS = ("valve", "actuator", "friction", "foot_plate", "supply", "gas")
_NOT_TRIED = ("actuator.angle_min", "actuator.angle_max", "actuator.restitution")
_ATMOSPHERE = "supply.atmospheric_pressure"
_OF_SUPPLY = {"supply.pressure": SUPPLY, "supply.dorsiflexion_pressure": DORSIFLEXION_SUPPLY}


def _numbers(search: _Search) -> Iterator[Candidate]:
    """Each number of the set, and another atmosphere under sensors of gauge pressure."""
    measured = search.records[0].measured
    wanted = replay_of(measured, search.device, search.settings)
    device = wanted.device
    scenario = replace(replayed_scenario(wanted), device=device)
    other_forms = {
        f"{section}.{item.name}"
        for section, orifice in (("actuator.leak", device.actuator.leak), ("valve", device.valve.orifice))
        for item in (SONIC_FORM if isinstance(orifice, Orifice) else AREA_FORM)
    }
    followed = {path for path, name in _OF_SUPPLY.items() if measured.has(name)}
    followed |= set(_OF_SUPPLY) if measured.has(SUPPLY) and device.supply.has_one_pressure else set()
    declared = declared_numbers(scenario)
    chosen = [path for section in _SECTIONS for path in declared if path.split(".")[0] == section]
    for path in (path for path in chosen if path not in (*_NOT_TRIED, *other_forms, *followed)):
        quantity = declared[path]
        own = number_at(scenario, path)
        factors = tuple(one for one in _FACTORS if quantity.minimum <= one * own <= quantity.maximum)
        if own > 0.0 and len(factors) > 2:
            words = f"{path} seems to be {{:.3g}} times the set's value"
            change = partial(_with_number, path, own)
            yield Candidate(path, words, change, factors, is_ratio=True, unit=quantity.unit or "-")
    room = device.supply.atmospheric_pressure
    pressures = {path: number_at(scenario, path) for path in _OF_SUPPLY if path not in followed}

    def in_room(factor: float) -> Change:
        higher = (factor - 1.0) * room
        numbers = {_ATMOSPHERE: room + higher, **{path: own + higher for path, own in pressures.items()}}
        return Change(dict.fromkeys((PRESSURE_1, PRESSURE_2, *_OF_SUPPLY.values()), Sensor(zero=-higher)), numbers)

    words = "the atmosphere under gauge pressures seems to be {:.4g} kPa"
    yield Candidate("atmosphere", words, in_room, _ROOMS, is_ratio=True, shown=1.0e-3 * room)


_EFFECTS: tuple[tuple[str, str, tuple[str, ...], dict[str, float], tuple[float, ...]], ...] = (
    ("leak_opening", "the leak seems to open at {:.3g} Pa", ("pressure",), {"rise": 0.3}, (1e3, 4e3, 1.6e4, 6e4, 2e5)),
    (
        "stribeck",
        "friction seems to be higher up to {:.2g} rad/s (Stribeck)",
        ("velocity",),
        {"share": 0.9},
        (0.02, 0.1, 0.4, 1.6, 6.0),
    ),
    (
        "seal_friction",
        "friction seems to grow with the pressure between the chambers by {:.2g} N m/Pa",
        ("static_per_pressure", "dynamic_per_pressure"),
        {},
        (1e-8, 5e-8, 2e-7, 1e-6, 5e-6),
    ),
    (
        "second_virial",
        "the gas seems not to be ideal, with {:.2g} times the second virial coefficient of CO2",
        ("share",),
        {"coefficient": SECOND_VIRIAL["CO2"]},
        (0.05, 0.2, 0.7, 2.5, 8.0),
    ),
    (
        "spool_play",
        "the spool seems to have a play of {:.2g} of its command",
        ("width",),
        {},
        (0.005, 0.02, 0.08, 0.2, 0.4),
    ),
)
"""Effects that a device may have and the model has not: the settings that grow with one size, those given, sizes."""


def _effects(device: Device) -> Iterator[Candidate]:
    for name, words, scaled, given, sizes in _EFFECTS:
        if name not in device.effects:
            yield Candidate(name, words, partial(_with_effect, name, scaled, given), sizes, is_ratio=True)
