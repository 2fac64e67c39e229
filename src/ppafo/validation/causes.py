"""What single cause would explain recordings of which a model leaves more than noise.

A cause is a model of a sensor, y = h(model; a) + e, or another number of the set: the recorded samples stay as they
are, so that hypotheses are compared by what they leave of the same samples. G = sum over channels of
n [ln max(MS0/s^2, 1) - ln max(MSc/s^2, 1)] - k ln N, with MS the mean square left, s the noise of the samples and k = 1
for a cause with a size. A common delay, and a start that was read from noisy samples, are taken out with every cause.
"""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from ppafo.errors import PpafoError
from ppafo.linear_algebra import on_one_thread
from ppafo.parameters.device import Device
from ppafo.progress import Progress, Report, report_nothing
from ppafo.signals.faults import correlated_noise_of, isolated_samples
from ppafo.signals.recording import Floats, Recording
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.recorded.channels import COMMAND
from ppafo.simulation.recorded.clock import usual_interval
from ppafo.simulation.recorded.rest import samples_at_rest
from ppafo.validation.agreement import (
    ENGINE_ERROR,
    ChannelAgreement,
    RecordingAgreement,
    ReplaySettings,
    compare_recording,
    measured_values,
    noise_in,
    replay_of,
)
from ppafo.validation.candidates import SENSORS, Candidate, Change, Sensor, effects, exchanges, joined, numbers, sizes
from ppafo.validation.compared import ANGLE, EXPLAINED_FRACTION, PRESSURE_1, PRESSURE_2
from ppafo.validation.measured import Measured
from ppafo.validation.replay import Replay, Replayed, replay_together, replayed_scenario

Flags = NDArray[np.bool_]

ONLY_NOISE = 2.0
"""Mean square left over the noise's up to which nothing but noise is left: noise that is not white has more."""

_TIMES = {
    "milliseconds read as seconds": (1.0e3, "ms"),
    "seconds read as milliseconds": (1.0e-3, "s"),
}
"""Rate of a clock whose times were read in a wrong unit, and the right one."""

_LESS = 0.5
"""What is left of an error beyond its limit at most, where times in another unit explain it."""

_SHORT_INTERVAL = 2.0e-5
"""Interval of samples [s] up to which times may be seconds read as milliseconds: from fifty samples a second on."""

_TOGETHER = 32
_STEPS = 2
_DIFFERENCE = 0.02
"""Fraction of the distance between two sizes of a grid over which a derivative is taken."""

_SMALL = 0.1
"""Size over the smallest of its grid by which a second change is tried beside a first."""

_BY_CHANCE = 1.0e-3
"""Chance below which a run of equal samples is a limit."""

_PARTING = 1.0e-4
"""Fraction of a squared slope that must lie across the first's, for a second change to be another one."""

_AT_REST = 2.0
"""Standard deviation of the angle over its noise, below which a vane may be locked."""

_SWAPPED = {PRESSURE_1: PRESSURE_2, PRESSURE_2: PRESSURE_1}
_SAMPLES = "samples of "
_FEW_OUTLIERS = 0.01
"""Share of the samples of a channel up to which isolated outliers are what any logger has."""

_STARTS = (-0.05, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.05)
"""Start of a channel whose first samples are wrong, over its range; the ends, which are refused, lie beyond it."""


@dataclass(frozen=True, slots=True)
class Cause:
    """One cause: its name, what it seems to be in words, and by how much G [-] it explains more than none.

    ``left`` is the largest error over noise [-] of any channel with it. ``numbers`` are the numbers of the set that it
    changes, by path, each with its SI unit. ``same`` are those that the recordings cannot tell from it, ``is_usual``
    says that any bench has as much.
    """

    name: str
    in_words: str
    gain: float
    left: float
    numbers: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    is_usual: bool = False
    same: "tuple[Cause, ...]" = ()

    @property
    def is_of_samples(self) -> bool:
        """True where samples are wrong that no sensor made, which they show whatever else is wrong."""
        return self.name.startswith(_SAMPLES)


@dataclass(frozen=True, slots=True)
class Causes:
    """The cause of a disagreement, if one is found; else the ``nearest``; ``tried`` is how many were compared.

    ``is_noise`` says that nothing but noise is left without any.
    """

    found: Cause | None = None
    nearest: Cause | None = None
    tried: int = 0
    is_noise: bool = False


class _Record(NamedTuple):
    """A recording that is compared: channels and values (channels, samples) over their noise.

    ``engine`` is the error of the engine over the noise, ``good`` is 1 for a sample that a sensor made and 0 for
    others, which ``words`` describe; ``has_few`` where these are isolated and so few that any bench has them.
    ``delay`` [s] was found with the model of the set; ``starts`` are how readings change with the standard error of
    each start that was read.
    """

    measured: Measured
    channels: tuple[str, ...]
    values: Floats
    noise: Floats
    engine: Floats
    good: Floats
    words: tuple[str, ...]
    has_few: bool
    delay: float
    starts: tuple[Floats, ...] = ()


class _Left(NamedTuple):
    """What a change leaves, over the noise: the mean square in each channel of each recording, and all errors."""

    squares: Floats
    errors: Floats


class _Tried(NamedTuple):
    """A candidate at the size that leaves least, and by how much G [-] it explains more than none."""

    candidate: Candidate
    size: float
    left: _Left
    gain: float

    @property
    def is_inside(self) -> bool:
        """True for a size that is not at an end of its grid, beyond which a better one may lie."""
        return min(self.candidate.grid) < self.size < max(self.candidate.grid)

    @property
    def is_usual(self) -> bool:
        """True for an error that sensors of any bench have."""
        return self.candidate.is_usual or 0.0 < abs(self.size) <= self.candidate.usual

    @property
    def explains(self) -> bool:
        """True where nothing but noise is left in any channel."""
        return float(self.left.squares.max()) < ONLY_NOISE and self.gain > 0.0


@on_one_thread
def causes_of(
    read: Sequence[Measured],
    agreements: Sequence[RecordingAgreement],
    device: Device,
    settings: ReplaySettings,
    report: Report = report_nothing,
) -> Causes:
    """Return what single cause explains all recordings together; none where nothing but noise is left of them."""
    other_unit = _in_other_unit(read, agreements, device, settings)
    if other_unit is not None:
        return Causes(other_unit, None, 1)
    records = [_record_of(*pair, device, settings) for pair in zip(read, agreements, strict=True)]
    search = _Search(device, settings, records, report)
    none = search.evaluated([Change()])[0]
    if none is None or float(none.squares.max()) < ONLY_NOISE:
        return Causes(is_noise=none is not None)
    report(Progress("searching for causes"))
    names = set.intersection(*(set(one.recording.names) for one in read))
    stages, sized = [list(_samples(records))], list[Candidate]()
    # A measured angle is an input: a delay of the sensors would be one of an input.
    if settings.motion != "measured":
        # Numbers of the set are compared with sensors: the gain of a command is the area of its valve.
        sized = [*sizes(device, names), *numbers(read[0], device, settings)]
        stages += [list(_motions(search)), list(exchanges(device, names)), sized, list(effects(device))]
    tried: list[_Tried] = []
    for stage in stages:
        if stage is sized:
            # Errors that any bench has come before a fault: they need no cause.
            usual = [one for one in sized if one.usual]
            together = search.compared(search.together(usual, none), none.squares)
            if any(one.explains for one in together):
                alone = [one for one in search.compared(usual, none.squares) if one.explains and one.is_usual]
                return Causes(_cause_of(alone or together, search.penalty), None, len(usual))
        tried += search.compared(stage, none.squares)
        named = [one for one in tried if one.explains]
        if named:
            first = max(named, key=lambda one: one.gain)
            # What has no size of its own to fit, a swap or a sign, cannot pass for two other changes.
            is_fitted = len(first.candidate.sizes) > 1 and not first.candidate.name.startswith(_SAMPLES)
            # One Jacobian, at the first cause, shows what a second one would add and what could replace it.
            slopes = search.slopes(first.candidate.at(first.size), first.left, sized) if is_fitted else []
            if search.needs_another(first, slopes):
                return Causes(None, _cause_of([first], search.penalty), len(tried))
            # With errors of sensors that any bench has, other small changes may explain as much as one alone.
            others = search.beside_usual(slopes, none, {one.candidate.name for one in named})
            return Causes(_cause_of(named, search.penalty, others), None, len(tried))
    # What is wrong with samples is seen in them, whatever else is wrong.
    nearest = max(tried, key=lambda one: (one.candidate.name.startswith(_SAMPLES), one.gain), default=None)
    # Of a measured angle only samples were searched: that no change explains the recordings would say too much.
    is_silent = settings.motion == "measured"
    return Causes() if nearest is None or is_silent else Causes(None, _cause_of([nearest], search.penalty), len(tried))


def _in_other_unit(
    read: Sequence[Measured], agreements: Sequence[RecordingAgreement], device: Device, settings: ReplaySettings
) -> Cause | None:
    """Return that times are milliseconds read as seconds or the reverse, where the model agrees with these only.

    It must then explain half of the variance of every signal, which one that stands still does not, with less than half
    of each error that was beyond its limit. It comes first, for other causes would be sought in runs of a thousand
    times the length of the recording, or a thousandth.
    """
    if all(one.passes for one in agreements):
        return None
    # Hardly any bench samples so often, and a run a thousand times as long is not made for others.
    is_short = max(usual_interval(one.recording.time) for one in read) <= _SHORT_INTERVAL
    name = "seconds read as milliseconds" if is_short else "milliseconds read as seconds"
    rate, unit = _TIMES[name]
    try:
        others = [
            compare_recording(replace(one, recording=_at_rate(one.recording, rate)), device, settings) for one in read
        ]
    except PpafoError:
        return None
    gain, left = 0.0, 0.0
    for one, other in zip(agreements, others, strict=True):
        for was, now in zip(one.channels, other.channels, strict=True):
            explains = now.rms**2 < (1.0 - EXPLAINED_FRACTION) * now.variation**2
            if not (was.passes or now.rms < _LESS * was.rms) or not (now.passes or explains):
                return None
            if was.channel in SENSORS:
                gain += 2.0 * len(one.measured) * math.log(max(was.in_noise, 1.0) / max(now.in_noise, 1.0))
            left = max(left, now.in_noise)
    remedy = f'write time [{unit}] in the header, or unit = "{unit}" for time in a column map'
    return Cause(name, f"times seem to be {name} ({remedy})", gain, left)


def _at_rate(recording: Recording, rate: float) -> Recording:
    """Return a recording whose clock ran so many times as fast as its times say, in true time."""
    first = recording.time[0]
    return replace(recording, time=first + (recording.time - first) / rate)


def _cause_of(named: Sequence[_Tried], penalty: float, others: Sequence[_Tried] = ()) -> Cause:
    """Return the best of those that explain recordings, with all that the recordings cannot tell from it.

    ``others`` explain them beside what any bench has, and come after those that do alone.
    """
    best, alone = max(one.gain for one in named), {one.candidate.name for one in named}
    # Of those that the recordings cannot tell apart, numbers of the set come first.
    alike = sorted(
        (one for one in [*named, *others] if one.gain > best - penalty),
        key=lambda one: (one.candidate.name not in alone, not one.candidate.at(one.size).numbers, -one.gain),
    )
    first, *rest = (
        Cause(
            name=one.name,
            in_words=one.in_words(at.size),
            gain=at.gain,
            left=math.sqrt(float(at.left.squares.max())),
            numbers={path: (value, one.unit) for path, value in one.at(at.size).numbers.items() if one.unit},
            is_usual=at.is_usual,
        )
        for at, one in ((at, at.candidate) for at in alike)
    )
    return replace(first, same=tuple(rest))


@dataclass(frozen=True, slots=True)
class _Search:
    device: Device
    settings: ReplaySettings
    records: list[_Record]
    report: Report

    @property
    def penalty(self) -> float:
        """The logarithm of the number of samples: what a size must explain more, and what two causes may differ by."""
        return math.log(sum(one.values.size for one in self.records))

    def evaluated(self, changes: Sequence[Change]) -> list[_Left | None]:
        """Return what each change leaves; None for one of a device that cannot have made such a recording."""
        found: list[_Left | None] = []
        for first in range(0, len(changes), _TOGETHER):
            if first:
                self.report(Progress("searching for causes", first, len(changes)))
            some = changes[first : first + _TOGETHER]
            wanted = [self._replay(record, change) for change in some for record in self.records]
            runs = iter(replay_together([one for one in wanted if one is not None]))
            replayed = [None if one is None else next(runs) for one in wanted]
            for place, change in enumerate(some):
                own = replayed[place * len(self.records) : (place + 1) * len(self.records)]
                parts = [
                    _left(record, one, change, self.settings.longest_delay)
                    for record, one in zip(self.records, own, strict=True)
                    if isinstance(one, Replayed)
                ]
                is_whole = len(parts) == len(self.records)
                found.append(_Left(*map(np.concatenate, zip(*parts, strict=True))) if is_whole else None)
        return found

    def _replay(self, record: _Record, change: Change) -> Replay | None:
        """Return the replay of what the sensors saw, on the device with the numbers of a change; None for no device."""
        recording, settings = record.measured.recording, self.settings
        for name, sensor in change.sensors.items():
            if name in recording:
                values = sensor.true(recording[name])
                values = np.clip(values, -1.0, 1.0) if name == COMMAND else values
                recording = recording.with_channel(name, values, recording.unit(name))
        if change.is_swapped:
            own = {name: recording[other] for name, other in _SWAPPED.items()}
            for name, values in own.items():
                recording = recording.with_channel(name, values, recording.unit(name))
        if change.clock != 1.0:
            recording = _at_rate(recording, change.clock)
        if change.start is not None:
            settings = replace(settings, initial={**_starts(record, self.device, change.start), **settings.initial})
        try:
            settings = replace(settings, motion=change.motion or settings.motion)
            wanted = replay_of(replace(record.measured, recording=recording), self.device, settings)
            device = replace(wanted.device, effects={**wanted.device.effects, **change.effects})
            if change.numbers:
                scenario = replace(replayed_scenario(wanted), device=device)
                device = with_numbers(scenario, change.numbers).device
        except PpafoError:
            return None
        return replace(wanted, device=device)

    def compared(self, candidates: Sequence[Candidate], none: Floats) -> list[_Tried]:
        """Return the candidates at the sizes that leave least: the best of a grid, then two Gauss-Newton steps.

        ``none`` are the mean squares without any. A size at an end of its grid is refused.
        """
        best: dict[str, _Tried] = {}
        runs = [(one, size) for one in candidates for size in one.grid]
        for step in range(_STEPS + 1):
            for (one, size), left in zip(runs, self.evaluated([one.at(size) for one, size in runs]), strict=True):
                if left is not None:
                    gain = self._gain(left, none) - self.penalty * (len(one.sizes) > 1)
                    now, before = _Tried(candidate=one, size=size, left=left, gain=gain), best.get(one.name)
                    # Sizes that leave nothing but noise are equal: one inside the grid is known better than its ends.
                    if before is None or (gain, now.is_inside) > (before.gain, before.is_inside):
                        best[one.name] = now
            if step < _STEPS:
                runs = self._improved([one for one in best.values() if len(one.candidate.sizes) > 1])
        return [one for one in best.values() if len(one.candidate.sizes) == 1 or one.is_inside]

    def _gain(self, left: _Left, none: Floats) -> float:
        """Return by how much more than none a change explains, before its size is paid for."""
        counts = np.concatenate([np.full(len(one.channels), one.values.shape[1]) for one in self.records])
        return float(counts @ (np.log(np.maximum(none, 1.0)) - np.log(np.maximum(left.squares, 1.0))))

    def _improved(self, moved: Sequence[_Tried]) -> list[tuple[Candidate, float]]:
        """Return the size of each candidate after a Gauss-Newton step, no further than its neighbours in the grid."""
        ends = []
        for one in moved:
            grid = sorted(one.candidate.grid)
            place = int(np.argmin(np.abs(np.array(grid) - one.size)))
            ends.append((grid[max(0, place - 1)], grid[min(len(grid) - 1, place + 1)]))
        lengths = [_DIFFERENCE * (high - low) for low, high in ends]
        beside = self.evaluated([one.candidate.at(one.size + size) for one, size in zip(moved, lengths, strict=True)])
        runs = []
        for one, left, length, (low, high) in zip(moved, beside, lengths, ends, strict=True):
            if left is not None:
                slope = (left.errors - one.left.errors) / length
                size = one.size - float(slope @ one.left.errors) / max(float(slope @ slope), 1.0e-300)
                runs.append((one.candidate, min(max(size, low), high)))
        return runs

    def slopes(self, change: Change, left: _Left, beside: Sequence[Candidate]) -> list[tuple[Candidate, Floats]]:
        """Return how the errors that a change leaves grow with the size of each of others beside it."""
        steps = [_SMALL * min(map(abs, one.grid)) for one in beside]
        moved = self.evaluated([joined(change, one.at(step)) for one, step in zip(beside, steps, strict=True)])
        return [
            (one, (other.errors - left.errors) / step)
            for one, step, other in zip(beside, steps, moved, strict=True)
            if other is not None
        ]

    def together(self, usual: Sequence[Candidate], none: _Left) -> list[Candidate]:
        """Return the errors that any bench has, all at once, each as large as explains most; none without a sensor."""
        slopes = self.slopes(Change(), none, usual)
        if not slopes:
            return []
        change = reduce(joined, [one.at(size) for one, size, _ in _bounded(slopes, none.errors)])
        words = "zeros, gains and delays of several sensors seem to be off"
        return [Candidate("several sensors", words, lambda _: change, (1.0,), usual=1.0)]

    def beside_usual(
        self, slopes: Sequence[tuple[Candidate, Floats]], none: _Left, named: Collection[str]
    ) -> list[_Tried]:
        """Return the changes larger than on any bench that explain recordings beside what any bench has, at no cost.

        Their sizes are those of straight lines; a run says whether they explain. Those ``named`` are known.
        """
        usual, found = [pair for pair in slopes if pair[0].usual], list[tuple[Candidate, float, Change]]()
        for one, column in slopes:
            if one.name in named:
                continue
            beside = [pair for pair in usual if pair[0] is not one]
            (_, size, _), *others = fitted = _bounded([(replace(one, usual=math.inf), column), *beside], none.errors)
            left = none.errors + sum(step * slope for _, step, slope in fitted)
            # A straight line leaves some more; what leaves far more is no small change, nor is what its grid does not
            # reach: of a logarithm such a size would be no number any more.
            is_inside = min(one.grid) < size < max(one.grid)
            if is_inside and float(left @ left) < 2.0 * ONLY_NOISE * len(left) and abs(size) > one.usual:
                change = reduce(joined, [other.at(step) for other, step, _ in others], one.at(size))
                found.append((one, size, change))
        runs = self.evaluated([change for _, _, change in found])
        tried = [
            _Tried(candidate=one, size=size, left=left, gain=self._gain(left, none.squares) - self.penalty)
            for (one, size, _), left in zip(found, runs, strict=True)
            if left is not None
        ]
        return [one for one in tried if one.explains and one.is_inside]

    def needs_another(self, first: _Tried, slopes: Sequence[tuple[Candidate, Floats]]) -> bool:
        """Return whether a second change, larger than on any bench, explains what a first leaves.

        To first order in both sizes. As two causes are told apart, its G must be larger by ln N; its size costs as much
        and the choice among p candidates 2 ln p (extended BIC, Chen and Chen 2008). What both leave over the noise is
        correlation, for which a square counts less. What the engine may be off needs no cause.
        """
        errors = first.left.errors
        if not slopes:
            return False
        step = _SMALL * min(map(abs, first.candidate.grid))
        near = self.evaluated([first.candidate.at(first.size + step)])[0]
        own = np.zeros_like(errors) if near is None else near.errors - errors
        own /= max(float(np.linalg.norm(own)), 1.0e-300)
        # Beside a second change the first would have another size: what it can take over is no merit of the second.
        rest = errors - (own @ errors) * own
        threshold = 2.0 * (self.penalty + math.log(len(slopes)))
        engine = sum(float(np.square(one.engine) @ one.good.sum(axis=1)) for one in self.records)
        for one, column in slopes:
            across = column - (own @ column) * own
            size = float(across @ across)
            # What does the same as the first leaves rounding, along which anything may seem to be explained.
            if size > _PARTING * float(column @ column):
                along = float(across @ rest)
                explained = along * along / size
                noise = max((float(rest @ rest) - explained) / len(errors), 1.0)
                if abs(along / size) > one.usual and explained > engine + threshold * noise * noise:
                    return True
        return False


def _bounded(slopes: Sequence[tuple[Candidate, Floats]], errors: Floats) -> list[tuple[Candidate, float, Floats]]:
    """Return candidates with the sizes, no larger than usual, that leave least of errors on straight lines, and slopes.

    One whose usual size is infinite has no bound.
    """
    # In units of its limit, or of its slope, each has one size, whatever its own unit is.
    scales = np.array(
        [one.usual if math.isfinite(one.usual) else 1.0 / max(float(np.linalg.norm(at)), 1e-300) for one, at in slopes]
    )
    most = np.array([1.0 if math.isfinite(one.usual) else math.inf for one, _ in slopes])
    columns = np.stack([column for _, column in slopes], axis=1)
    sizes = lsq_linear(columns * scales, -errors, (-most, most)).x * scales
    return [(one, float(size), column) for (one, column), size in zip(slopes, sizes, strict=True)]


def _record_of(measured: Measured, agreement: RecordingAgreement, device: Device, settings: ReplaySettings) -> _Record:
    """Return a recording with its samples that no sensor made, and how readings change with each start."""
    recording = measured.recording
    chosen = [one for one in agreement.channels if one.channel in SENSORS] or list(agreement.channels[:1])
    series, noise, good, words, has_few = list[Floats](), list[float](), list[Flags](), list[str](), True
    for one in chosen:
        values = measured_values(recording, one.channel)
        assert values is not None
        model = np.interp(
            recording.time - agreement.delay.correction, agreement.model.time, agreement.model[one.channel]
        )
        residuals = values - model
        # Samples in a channel that the model explains are right, however they look.
        wrong = None if one.in_noise**2 < ONLY_NOISE else _wrong_samples(values, residuals, one, recording.time)
        is_good = np.ones(len(values), dtype=bool) if wrong is None else np.logical_not(wrong.samples)
        series.append(values)
        good.append(is_good)
        if wrong is None:
            noise.append(one.noise)
        else:
            noise.append(max(noise_in(values[is_good], one.full_range), correlated_noise_of(residuals[is_good])))
            words.append(f"{one.channel} {wrong.words}")
            has_few = has_few and wrong.is_isolated and float(wrong.samples.mean()) < _FEW_OUTLIERS
    names, sizes = tuple(one.channel for one in chosen), np.array(noise)
    ranges = np.array([one.full_range for one in chosen])
    record = _Record(
        measured=measured,
        channels=names,
        values=np.stack(series) / sizes[:, None],
        noise=sizes,
        engine=ENGINE_ERROR * ranges / sizes,
        good=np.stack(good).astype(np.float64),
        words=tuple(words),
        has_few=has_few,
        delay=agreement.delay.correction,
    )
    own, count = replay_of(measured, device, settings), samples_at_rest(recording)
    wanted = [own]
    for name, size in zip(names, noise, strict=True):
        if name in SENSORS and name not in settings.initial:
            error = size / math.sqrt(count)
            # A vane at its upper stop can only be moved down.
            way = -1.0 if name == ANGLE and own.start.angle > device.actuator.angle_max - error else 1.0
            wanted.append(replace(own, start=replace(own.start, **{name: getattr(own.start, name) + way * error})))
    first, *others = replay_together(wanted)
    columns = [
        _readings(record, other, Change(), 0.0) - _readings(record, first, Change(), 0.0)
        for other in others
        if isinstance(first, Replayed) and isinstance(other, Replayed)
    ]
    return record._replace(starts=tuple(columns))


def _starts(record: _Record, device: Device, share: float) -> dict[str, float]:
    """Return the start [SI] of channels with wrong samples there: of the good ones, else a ``share`` of the range."""
    actuator, supply, count = device.actuator, device.supply, samples_at_rest(record.measured.recording)
    given = {}
    for name, values, good in zip(record.channels, record.values * record.noise[:, None], record.good, strict=True):
        of_sensor = values[:count][good[:count] > 0.0]
        if name in SENSORS and len(of_sensor) < count:
            low, high = supply.atmospheric_pressure, max(supply.pressure, supply.dorsiflexion_pressure)
            if name == ANGLE:
                low, high = actuator.angle_min, actuator.angle_max
            given[name] = float(of_sensor.mean()) if len(of_sensor) else low + share * (high - low)
    return given


def _readings(record: _Record, replayed: Replayed, change: Change, offset: float) -> Floats:
    """Return what the sensors of a change make of the model (channels, samples), over the noise."""
    time, model = record.measured.recording.time, replayed.recording
    true = time[0] + (time - time[0]) / change.clock
    rows = []
    for name in record.channels:
        sensor = change.sensors.get(name, Sensor())
        source = model[_SWAPPED.get(name, name) if change.is_swapped else name]
        rows.append(sensor.of(np.interp(true - offset - sensor.delay, model.time, source)))
    return np.asarray(np.stack(rows) / record.noise[:, None])


def _left(record: _Record, replayed: Replayed, change: Change, longest_delay: float) -> _Left:
    """Return what is left of a recording without a common delay and the error of the start.

    The delay that was found may be what a wrong model makes: it is sought from there and from none.
    """
    interval = float(np.median(np.diff(record.measured.recording.time)))
    good = np.ones_like(record.good) if change.start is None else record.good
    options = []
    for first in {0.0, record.delay}:
        offset = first
        for _ in range(_STEPS + 1):
            readings = _readings(record, replayed, change, offset)
            columns = (np.stack([np.gradient(readings, axis=1), *record.starts]) * good).reshape(-1, good.size)
            left = ((record.values - readings) * good).ravel()
            sizes = np.linalg.solve(columns @ columns.T + np.eye(len(columns)), columns @ left)
            left = left - sizes @ columns
            offset = min(max(offset - interval * float(sizes[0]), -longest_delay), longest_delay)
        options.append(left)
    left = min(options, key=lambda one: float(one @ one))
    squares = np.square(left.reshape(good.shape)).sum(axis=1) / np.maximum(good.sum(axis=1), 1.0)
    return _Left(squares, left)


class _Wrong(NamedTuple):
    """What is wrong with samples of a channel in words, with which, and whether each stands by itself."""

    words: str
    samples: Flags
    is_isolated: bool = False


def _wrong_samples(values: Floats, residuals: Floats, one: ChannelAgreement, time: Floats) -> _Wrong | None:
    """Return samples of a channel that no sensor made: constant, clipped, or isolated among samples or residuals."""
    edges = np.flatnonzero(np.diff(values))
    lengths, levels = np.diff(np.concatenate([[-1], edges, [len(values) - 1]])), values[[*edges, -1]]
    if len(levels) == 1:
        held = "the vane was locked (--motion locked), or " if one.channel == ANGLE else ""
        words = f"never changes: {held}its sensor is dead or not connected"
        return _Wrong(words, np.ones(len(values), dtype=bool))
    # A coarse converter repeats other values too. That all else agrees tells a stop of the vane from a sensor's.
    low, high, count = levels.min(), levels.max(), len(values)
    inner = lengths[(levels > low) & (levels < high)]
    repeated = max(1.0 - len(inner) / max(int(inner.sum()), 1), 1.0 / count)
    runs = [(end, word, int(lengths[levels == end].max())) for end, word in ((low, "least"), (high, "largest"))]
    ends = [(end, word) for end, word, longest in runs if count * repeated ** (longest - 1) < _BY_CHANCE]
    if ends:
        said = " and ".join(f"{int((values == end).sum())} samples are exactly its {word} value" for end, word in ends)
        return _Wrong(f"is clipped: {said}", np.isin(values, [end for end, _ in ends]))
    is_out, on_flank = isolated_samples(values, one.noise), isolated_samples(residuals, one.noise)
    # On a flank an outlier shows only beside a model that follows it; at the ends a delay makes one of a step.
    is_out[1:-1] |= on_flank[1:-1]
    count = int(is_out.sum())
    if not count:
        return None
    first = f"{float(time[int(np.argmax(is_out))]):.6g} s"
    words = f"has {count} isolated outlier{'s' * (count > 1)}, the first at {first}"
    return _Wrong(words, is_out, is_isolated=True)


def _samples(records: Sequence[_Record]) -> Iterator[Candidate]:
    """Samples that no sensor made, in all channels that have some: the others must agree with the model."""
    faulty = [one for one in records if one.words]
    if faulty:
        many = len(records) > 1
        words = "; ".join(f"{part} ({one.measured.file})" if many else part for one in faulty for part in one.words)
        names = dict.fromkeys(part.split()[0] for one in faulty for part in one.words)
        at_start = min(one.good[:, : samples_at_rest(one.measured.recording)].max(axis=1).min() for one in faulty)
        sizes = (0.0,) if at_start else _STARTS
        words = words.replace("{", "{{").replace("}", "}}")
        yield Candidate(
            f"{_SAMPLES}{' and '.join(names)}",
            words,
            lambda share: Change(start=share),
            sizes,
            is_usual=all(one.has_few for one in faulty),
        )


def _motions(search: _Search) -> Iterator[Candidate]:
    """A vane that is locked, where the model moves it and the recorded angle rests."""
    if search.settings.motion in ("free", "leg"):
        own = [(one, one.channels.index(ANGLE)) for one in search.records if ANGLE in one.channels]
        if own and all(float(np.std(one.values[place])) < _AT_REST for one, place in own):
            words = "the vane seems to be locked, for its recorded angle rests (--motion locked)"
            yield Candidate("motion", words, lambda _: Change(motion="locked"))
