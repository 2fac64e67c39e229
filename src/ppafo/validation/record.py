"""A recording as its causes are sought: what its sensors made of it, and what a change of the model leaves of it.

The recorded samples stay as they are, so that changes are compared by what they leave of the same samples. A common
delay, and a start that was read from noisy samples, are taken out with every change.
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.arguments.door import argument_text
from ppafo.parameters.device import Device
from ppafo.signals.faults import correlated_noise_of, isolated_samples
from ppafo.signals.recording import Floats, Recording
from ppafo.simulation.recorded.rest import samples_at_rest
from ppafo.validation.agreement import (
    ENGINE_ERROR,
    ChannelAgreement,
    RecordingAgreement,
    ReplaySettings,
    measured_values,
    noise_in,
    replay_of,
)
from ppafo.validation.change import SENSORS, SWAPPED, ModelChange, SensorModel
from ppafo.validation.compared import ANGLE
from ppafo.validation.measured import MeasuredRecording
from ppafo.validation.replay import Replay, Replayed, replay_together

Flags = NDArray[np.bool_]

ONLY_NOISE = 2.0
"""Mean square left over the noise's up to which nothing but noise is left: noise that is not white has more."""
STEPS = 2
"""Gauss-Newton steps, from sizes that are near the best."""
_BY_CHANCE = 1.0e-3
"""Chance below which a run of equal samples is a limit."""
_FEW_OUTLIERS = 0.01
"""Share of the samples of a channel up to which isolated outliers are what any logger has."""


class Record(NamedTuple):
    """A recording that is compared: channels and values (channels, samples) over their noise.

    ``engine`` is the error of the engine over the noise, ``good`` is 1 for a sample that a sensor made and 0 for
    others, which ``words`` describe; ``has_few`` where these are isolated and so few that any bench has them.
    ``delay`` [s] was found with the model of the set; ``starts`` are how readings change with the standard error of
    each start that was read.
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


class Left(NamedTuple):
    """Residuals under a change, over the noise: mean square in each channel of each recording, and all errors."""

    squares: Floats
    errors: Floats

    @property
    def is_noise(self) -> bool:
        """True where nothing but noise is left in any channel."""
        return float(self.squares.max()) < ONLY_NOISE


def record_of(
    measured: MeasuredRecording, agreement: RecordingAgreement, device: Device, settings: ReplaySettings
) -> Record:
    """Return a recording with its samples that no sensor made, and how readings change with each start."""
    of_sensors = [channel for channel in agreement.channels if channel.channel in SENSORS]
    compared = of_sensors or agreement.channels[:1]
    values, noises, faults = zip(*(_samples_of(channel, agreement) for channel in compared), strict=True)
    noise, full_ranges = np.array(noises), np.array([channel.full_range for channel in compared])
    wrong = [(channel.channel, fault) for channel, fault in zip(compared, faults, strict=True) if fault is not None]
    good = [
        np.ones(len(own)) if fault is None else 1.0 - fault.samples for own, fault in zip(values, faults, strict=True)
    ]
    record = Record(
        measured=measured,
        channels=tuple(channel.channel for channel in compared),
        values=np.stack(values) / noise[:, None],
        noise=noise,
        engine=ENGINE_ERROR * full_ranges / noise,
        good=np.stack(good),
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
    unmoved, *others = replay_together([request, *moved])
    return record._replace(
        starts=tuple(
            readings_of(record, other, ModelChange(), 0.0) - readings_of(record, unmoved, ModelChange(), 0.0)
            for other in others
            if isinstance(unmoved, Replayed) and isinstance(other, Replayed)
        )
    )


def _samples_of(channel: ChannelAgreement, agreement: RecordingAgreement) -> "tuple[Floats, float, _Wrong | None]":
    """Return values and noise [SI] of a channel, and the fault of its samples; others give the noise."""
    recording, model = agreement.measured, agreement.model
    values = measured_values(recording, channel.channel)
    assert values is not None
    residuals = values - np.interp(recording.time - agreement.delay.correction, model.time, model[channel.channel])
    # Samples in a channel that the model explains are right, however they look; so are those of one that stands still
    # with the model, but for its zero.
    stands_still = np.ptp(values) == 0.0 and np.ptp(residuals) < channel.usual_zero
    is_right = stands_still or channel.in_noise**2 < ONLY_NOISE
    wrong = None if is_right else _wrong_samples(values, residuals, channel, recording.time)
    if wrong is None:
        return values, channel.noise, None
    is_good = np.logical_not(wrong.samples)
    noise = max(noise_in(values[is_good], channel.full_range), correlated_noise_of(residuals[is_good]))
    return values, noise, wrong


class _Wrong(NamedTuple):
    """Wrong samples of a channel: description, samples, and whether each is isolated."""

    words: str
    samples: Flags
    is_isolated: bool = False


def _wrong_samples(values: Floats, residuals: Floats, channel: ChannelAgreement, time: Floats) -> _Wrong | None:
    """Return samples of a channel that no sensor made: constant, clipped, or isolated among samples or residuals."""
    if np.ptp(values) == 0.0:
        locked = argument_text("motion", "locked")
        held = f"the vane was locked ({locked}), or " if channel.channel == ANGLE else ""
        words = f"never changes: {held}its sensor is dead or not connected"
        return _Wrong(words, np.ones(len(values), dtype=bool))
    clipped = _clipped_samples(values)
    if clipped is not None:
        return clipped
    is_out, on_flank = isolated_samples(values, channel.noise), isolated_samples(residuals, channel.noise)
    # On a flank an outlier shows only beside a model that follows it; at the ends a delay makes one of a step.
    is_out[1:-1] |= on_flank[1:-1]
    count = int(is_out.sum())
    if not count:
        return None
    first = f"{float(time[int(np.argmax(is_out))]):.6g} s"
    words = f"has {count} isolated outlier{'s' * (count > 1)}, the first at {first}"
    return _Wrong(words, is_out, is_isolated=True)


def _clipped_samples(values: Floats) -> _Wrong | None:
    """Return the samples at the least or the largest value, where one of these is repeated beyond chance.

    A coarse converter repeats other values too. That all else agrees tells a stop of the vane from a sensor's.
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
    said = " and ".join(
        f"{int((values == limit).sum())} samples are exactly its {word} value" for limit, word in limits
    )
    return _Wrong(f"is clipped: {said}", np.isin(values, [limit for limit, _ in limits]))


def starts_without_wrong(record: Record, device: Device, share: float) -> dict[str, float]:
    """Return the start [SI] of channels with wrong samples there: of the good ones, else a ``share`` of the range."""
    actuator, supply, count = device.actuator, device.supply, samples_at_rest(record.measured.recording)
    starts = {}
    for name, values, good in zip(record.channels, record.values * record.noise[:, None], record.good, strict=True):
        of_sensor = values[:count][good[:count] > 0.0]
        if name in SENSORS and len(of_sensor) < count:
            low, high = supply.atmospheric_pressure, max(supply.pressure, supply.dorsiflexion_pressure)
            if name == ANGLE:
                low, high = actuator.angle_min, actuator.angle_max
            starts[name] = float(of_sensor.mean()) if len(of_sensor) else low + share * (high - low)
    return starts


def at_rate(recording: Recording, rate: float) -> Recording:
    """Return a recording whose clock ran so many times as fast as its times say, in true time."""
    first = recording.time[0]
    return replace(recording, time=first + (recording.time - first) / rate)


def readings_of(record: Record, replayed: Replayed, change: ModelChange, offset: float) -> Floats:
    """Return what sensors with a change make of the model (channels, samples), over the noise, ``offset`` [s] later."""
    time, model = record.measured.recording.time, replayed.recording
    true_time = time[0] + (time - time[0]) / change.clock
    rows = []
    for name in record.channels:
        sensor = change.sensors.get(name, SensorModel())
        source = model[SWAPPED.get(name, name) if change.is_swapped else name]
        delay = offset + change.delay + sensor.delay
        rows.append(sensor.of(np.interp(true_time - delay, model.time, source)))
    return np.asarray(np.stack(rows) / record.noise[:, None])


def left_of(record: Record, replayed: Replayed, change: ModelChange, longest_delay: float) -> Left:
    """Return what is left of a recording without a common delay, at most ``longest_delay`` [s], and error of the start.

    The delay that was found may be what a wrong model makes: it is sought from there and from none.
    """
    good = np.ones_like(record.good) if change.start is None else record.good
    # No quantity stands twice in one fit: beside a delay of its own a change gets no free one, which would take a part.
    longest_delay = 0.0 if change.has_delay else longest_delay
    firsts = {0.0, record.delay} if longest_delay > 0.0 else {0.0}
    options = [_errors_from(record, replayed, change, good, first, longest_delay) for first in firsts]
    errors = min(options, key=lambda option: float(option @ option))
    squares = np.square(errors.reshape(good.shape)).sum(axis=1) / np.maximum(good.sum(axis=1), 1.0)
    return Left(squares, errors)


def _errors_from(
    record: Record, replayed: Replayed, change: ModelChange, good: Floats, first_delay: float, longest_delay: float
) -> Floats:
    """Return the errors over the noise (channels * samples,) that are left after Gauss-Newton steps from a delay [s].

    Each step takes out what a delay and other starts explain; a start is known with a standard error of 1.
    """
    interval = float(np.median(np.diff(record.measured.recording.time)))
    delay = first_delay
    errors = np.zeros(good.size)
    for _ in range(STEPS + 1):
        readings = readings_of(record, replayed, change, delay)
        late = [np.gradient(readings, axis=1)] * (longest_delay > 0.0)
        errors = ((record.values - readings) * good).ravel()
        if late or record.starts:
            columns = (np.stack([*late, *record.starts]) * good).reshape(-1, good.size)
            sizes = np.linalg.solve(columns @ columns.T + np.eye(len(columns)), columns @ errors)
            errors = errors - sizes @ columns
        if not late:
            break
        delay = min(max(delay - interval * float(sizes[0]), -longest_delay), longest_delay)
    return errors
