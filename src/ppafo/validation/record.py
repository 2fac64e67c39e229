"""Recordings prepared for the search for causes, and their residuals under a change of the model.

All changes are compared on the same recorded samples. A common delay, and the error of initial values read from noisy
samples, are fitted anew for every change.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.parameters.device import Device
from ppafo.signals.faults import correlated_noise_of, isolated_samples
from ppafo.signals.recording import Floats, Recording
from ppafo.simulation.recorded.rest import samples_at_rest
from ppafo.validation.agreement import (
    ENGINE_ERROR,
    ChannelAgreement,
    RecordingAgreement,
    noise_in,
    replay_of,
)
from ppafo.validation.measured import MeasuredRecording
from ppafo.validation.replay import Replay, Replayed, replay_together
from ppafo.validation.settings import ANGLE, PRESSURE_1, PRESSURE_2, Motion, ReplaySettings
from ppafo.wording import argument_text

Flags = NDArray[np.bool_]

ONLY_NOISE = 2.0
"""Largest ratio of mean squared residual to noise variance [-] that counts as noise; above 1 for correlated noise."""
STEPS = 2
"""Number of Gauss-Newton steps from the best trial magnitude."""
_BY_CHANCE = 1.0e-3
"""Probability [-] below which a run of equal extreme samples counts as clipping."""
_FEW_OUTLIERS = 0.01
"""Largest usual fraction of isolated outliers in a channel [-]."""

SENSORS = (ANGLE, PRESSURE_1, PRESSURE_2)
"""Channels with a sensor on the device; torque and pressure difference are computed from them."""
SWAPPED = {PRESSURE_1: PRESSURE_2, PRESSURE_2: PRESSURE_1}
"""Channel recorded under each name when the two chamber pressures are swapped."""


@dataclass(frozen=True, slots=True)
class SensorModel:
    """Sensor model: gain [-] about the value ``about``, zero offset (both in the channel's unit), delay [s]."""

    gain: float = 1.0
    zero: float = 0.0
    about: float = 0.0
    delay: float = 0.0

    def of(self, true: Floats) -> Floats:
        """Return the readings of true values [unit of the channel]."""
        return self.about + self.gain * (true - self.about) + self.zero

    def true(self, readings: Floats) -> Floats:
        """Return the true values of readings [unit of the channel]."""
        return self.about + (readings - self.zero - self.about) / self.gain


@dataclass(frozen=True, slots=True)
class ModelChange:
    """Difference between the recorded device and its parameter set; by default no difference.

    ``sensors``: sensor models by channel. ``numbers``: changed parameters by path [SI]. ``effects``: settings of
    effects by the name of the effect. ``is_swapped``: pressures 1 and 2 are exchanged. ``delay``: delay [s] of all
    sensors with respect to the command. ``clock``: true rate of the recording's clock [-]. ``motion``: motion of the
    vane, if another. ``start``: if not None, faulty samples are ignored, and a channel whose first samples are faulty
    starts at this fraction [-] of its range.
    """

    sensors: Mapping[str, SensorModel] = field(default_factory=dict)
    numbers: Mapping[str, float] = field(default_factory=dict)
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    is_swapped: bool = False
    delay: float = 0.0
    clock: float = 1.0
    motion: Motion | None = None
    start: float | None = None

    @property
    def has_delay(self) -> bool:
        """True if all sensors lag behind the command, by a sensor delay or the delay of the valve."""
        return self.delay != 0.0 or any(path.endswith("delay") for path in self.numbers)


def joined(first: ModelChange, second: ModelChange) -> ModelChange:
    """Return the combination of two changes; ``first`` has precedence for parameters and settings in both."""
    sensors = dict(first.sensors)
    for name, other in second.sensors.items():
        sensor = sensors.get(name, SensorModel())
        sensors[name] = SensorModel(
            gain=sensor.gain * other.gain,
            zero=sensor.zero + other.zero,
            # A zero and a delay turn about nothing, so that the gain's point stays.
            about=other.about if other.gain != 1.0 else sensor.about,
            delay=sensor.delay + other.delay,
        )
    numbers, effects = {**second.numbers, **first.numbers}, {**second.effects, **first.effects}
    delay, clock = first.delay + second.delay, first.clock * second.clock
    return replace(first, sensors=sensors, numbers=numbers, effects=effects, delay=delay, clock=clock)


class Record(NamedTuple):
    """Recording prepared for the search: its compared channels and their values divided by noise (channels, samples).

    ``noise`` [SI] and ``engine``, the integration error divided by the noise [-], are by channel. ``good`` is 1 for
    valid samples and 0 for faulty ones, which ``words`` describes; ``has_few`` is true if the faulty samples are
    isolated and no more than usual. ``delay`` [s] was estimated with the unchanged model. ``starts`` are the changes of
    the readings for one standard error of each initial value.
    """

    measured: MeasuredRecording
    channels: tuple[str, ...]
    values: Floats
    noise: Floats
    engine: Floats
    good: Floats
    words: tuple[str, ...]
    has_few: bool
    delay: float
    starts: tuple[Floats, ...] = ()


class ScaledResiduals(NamedTuple):
    """Residuals under a change, divided by noise [-]: mean square by channel and recording, and all errors."""

    squares: Floats
    errors: Floats

    @property
    def is_noise(self) -> bool:
        """True if the residuals of every channel are noise."""
        return float(self.squares.max()) < ONLY_NOISE


UNTRIED = ScaledResiduals(np.zeros(0), np.zeros(0))
"""Residuals of a change that was not tried yet."""


def record_of(
    measured: MeasuredRecording, agreement: RecordingAgreement, device: Device, settings: ReplaySettings
) -> Record:
    """Prepare a recording: faulty samples marked, sensitivity of the readings to each initial value."""
    compared = [channel for channel in agreement.channels if channel.channel in SENSORS] or agreement.channels[:1]
    noise, full_ranges = (
        np.array([getattr(channel, name) for channel in compared]) for name in ("noise", "full_range")
    )
    good, wrong = np.ones((len(compared), len(measured.recording))), list[tuple[str, _Wrong]]()
    for row, channel in enumerate(compared):
        values, residuals = channel.values, channel.residuals
        # Samples in a channel that the model explains are right, however they look; so are those of one that stands
        # still with the model, but for its zero.
        stands_still = np.ptp(values) == 0.0 and np.ptp(residuals) < channel.usual_zero
        is_right = stands_still or channel.in_noise**2 < ONLY_NOISE
        if not is_right and (fault := _wrong_samples(channel)) is not None:
            wrong.append((channel.channel, fault))
            good[row] -= fault.samples
            is_good = np.logical_not(fault.samples)
            noise[row] = max(noise_in(values[is_good], channel.full_range), correlated_noise_of(residuals[is_good]))
    record = Record(
        measured=measured,
        channels=tuple(channel.channel for channel in compared),
        values=np.stack([channel.values for channel in compared]) / noise[:, None],
        noise=noise,
        engine=ENGINE_ERROR * full_ranges / noise,
        good=good,
        words=tuple(f"{name} {fault.words}" for name, fault in wrong),
        has_few=all(fault.is_isolated and float(fault.samples.mean()) < _FEW_OUTLIERS for _, fault in wrong),
        delay=agreement.delay.correction,
    )
    request, moved = replay_of(record.measured, device, settings), list[Replay]()
    for name, error in zip(record.channels, noise / math.sqrt(samples_at_rest(measured.recording)), strict=True):
        if name in SENSORS and name not in settings.initial:
            # A vane at its upper stop can only move down.
            is_at_stop = name == ANGLE and request.start.angle > device.actuator.angle_max - error
            start = getattr(request.start, name) + float(-error if is_at_stop else error)
            moved.append(replace(request, start=replace(request.start, **{name: start})))
    if (error := request.start.velocity_error) > 0.0:
        start = request.start.angular_velocity + error
        moved.append(replace(request, start=replace(request.start, angular_velocity=start)))
    unmoved, *others = replay_together([request, *moved])
    return record._replace(
        starts=tuple(
            readings_of(record, other, ModelChange(), 0.0) - readings_of(record, unmoved, ModelChange(), 0.0)
            for other in others
            if isinstance(unmoved, Replayed) and isinstance(other, Replayed)
        )
    )


class _Wrong(NamedTuple):
    """Faulty samples of a channel: description, flag by sample, and flag for isolated outliers."""

    words: str
    samples: Flags
    is_isolated: bool = False


def _wrong_samples(channel: ChannelAgreement) -> _Wrong | None:
    """Return the faulty samples of a channel: constant signal, clipping, or outliers of samples or residuals."""
    values = channel.values
    if np.ptp(values) == 0.0:
        locked = argument_text("motion", "locked")
        other_cause = f"the vane was locked ({locked}), or " if channel.channel == ANGLE else ""
        words = f"never changes: {other_cause}the sensor is dead or not connected"
        return _Wrong(words, np.ones(len(values), dtype=bool))
    if (clipped := _clipped_samples(values)) is not None:
        return clipped
    is_out, is_out_on_flank = (isolated_samples(one, channel.noise) for one in (values, channel.residuals))
    # On a flank an outlier shows only beside a model that follows it; at the ends a delay makes one of a step.
    is_out[1:-1] |= is_out_on_flank[1:-1]
    count = int(is_out.sum())
    if not count:
        return None
    first = f"{float(channel.times[int(np.argmax(is_out))]):.6g} s"
    words = f"has {count} isolated outlier{'s' * (count > 1)}, the first at {first}"
    return _Wrong(words, is_out, is_isolated=True)


def _clipped_samples(values: Floats) -> _Wrong | None:
    """Return the samples at the least or largest value if repeated more often than by chance, else None.

    A coarse converter repeats inner values too. Agreement of the other channels tells a stop of the vane from clipping.
    """
    run_ends = np.append(np.flatnonzero(np.diff(values)), len(values) - 1)
    lengths, levels = np.diff(run_ends, prepend=-1), values[run_ends]
    lowest, highest, count = levels.min(), levels.max(), len(values)
    inner = lengths[(levels > lowest) & (levels < highest)]
    # Chance that a sample repeats the one before it.
    repeated = max(1.0 - len(inner) / max(int(inner.sum()), 1), 1.0 / count)
    limits = [
        (limit, word)
        for limit, word in ((lowest, "least"), (highest, "largest"))
        if count * repeated ** (int(lengths[levels == limit].max()) - 1) < _BY_CHANCE
    ]
    if not limits:
        return None
    counts = " and ".join(
        f"{int((values == limit).sum())} samples are exactly its {word} value" for limit, word in limits
    )
    return _Wrong(f"is clipped: {counts}", np.isin(values, [limit for limit, _ in limits]))


def starts_without_wrong(record: Record, device: Device, share: float) -> dict[str, float]:
    """Return initial values [SI] of the channels with faulty first samples.

    The value is the mean of the valid first samples, or else a fraction ``share`` [-] of the range of the channel.
    """
    actuator, supply, count = device.actuator, device.supply, samples_at_rest(record.measured.recording)
    starts = {}
    for name, values, good in zip(record.channels, record.values * record.noise[:, None], record.good, strict=True):
        valid = values[:count][good[:count] > 0.0]
        if name in SENSORS and len(valid) < count:
            low, high = supply.atmospheric_pressure, max(supply.pressure, supply.dorsiflexion_pressure)
            if name == ANGLE:
                low, high = actuator.angle_min, actuator.angle_max
            starts[name] = float(valid.mean()) if len(valid) else low + share * (high - low)
    return starts


def at_rate(recording: Recording, rate: float) -> Recording:
    """Return a recording in true time, given the ``rate`` of its clock relative to true time [-]."""
    first = recording.time[0]
    return replace(recording, time=first + (recording.time - first) / rate)


def readings_of(record: Record, replayed: Replayed, change: ModelChange, offset: float) -> Floats:
    """Return modelled readings divided by noise (channels, samples) under a change, delayed by ``offset`` [s]."""
    time, model = record.measured.recording.time, replayed.recording
    true_time = time[0] + (time - time[0]) / change.clock
    rows = []
    for name in record.channels:
        sensor = change.sensors.get(name, SensorModel())
        source = model[SWAPPED.get(name, name) if change.is_swapped else name]
        delay = offset + change.delay + sensor.delay
        rows.append(sensor.of(np.interp(true_time - delay, model.time, source)))
    return np.asarray(np.stack(rows) / record.noise[:, None])


def residuals_of(record: Record, replayed: Replayed, change: ModelChange, longest_delay: float) -> ScaledResiduals:
    """Return the residuals after fitting the common delay, at most ``longest_delay`` [s], and the initial values.

    The fit of the delay starts both from 0 and from the delay of the unchanged model, which a wrong model may distort.
    """
    good = np.ones_like(record.good) if change.start is None else record.good
    # No quantity stands twice in one fit: beside a delay of its own a change gets no free one, which would take a part.
    longest_delay = 0.0 if change.has_delay else longest_delay
    delays = {0.0, record.delay} if longest_delay > 0.0 else {0.0}
    options = [_errors_from(record, replayed, change, good, delay, longest_delay) for delay in delays]
    errors = min(options, key=lambda option: float(option @ option))
    squares = np.square(errors.reshape(good.shape)).sum(axis=1) / np.maximum(good.sum(axis=1), 1.0)
    return ScaledResiduals(squares, errors)


def _errors_from(
    record: Record, replayed: Replayed, change: ModelChange, good: Floats, first_delay: float, longest_delay: float
) -> Floats:
    """Return errors divided by noise [-] (channels * samples,) after Gauss-Newton steps from an initial delay [s].

    Each step fits the delay and the initial values; these have a prior with a standard deviation of one standard error.
    """
    interval = float(np.median(np.diff(record.measured.recording.time)))
    delay = first_delay
    errors = np.zeros(good.size)
    for _ in range(STEPS + 1):
        readings = readings_of(record, replayed, change, delay)
        by_delay = [np.gradient(readings, axis=1)] if longest_delay > 0.0 else []
        errors = ((record.values - readings) * good).ravel()
        columns = [(column * good).ravel() for column in (*by_delay, *record.starts)]
        sizes = _ridge_fit(columns, errors)
        if by_delay:
            last, free = delay, delay - interval * float(sizes[0])
            delay = min(max(free, 0.0), longest_delay)
            if delay != free:
                # At an end of its range the delay is known, and the initial values alone are fitted.
                errors, columns = errors - (last - delay) / interval * columns[0], columns[1:]
                sizes = _ridge_fit(columns, errors)
        errors = errors - sum(size * column for size, column in zip(sizes, columns, strict=True))
        if not by_delay:
            break
    return errors


def _ridge_fit(columns: Sequence[Floats], errors: Floats) -> Floats:
    """Return the coefficients of ``columns`` that fit ``errors``, each with a prior of 0 +- 1."""
    matrix = np.reshape(columns, (len(columns), errors.size))
    return np.asarray(np.linalg.solve(matrix @ matrix.T + np.eye(len(columns)), matrix @ errors))
