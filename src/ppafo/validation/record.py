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

from ppafo.signals.faults import correlated_noise_of, isolated_samples
from ppafo.signals.recording import Floats, Recording
from ppafo.simulation.recorded.rest import samples_at_rest
from ppafo.validation.agreement import ENGINE_ERROR, ChannelAgreement, RecordingAgreement, noise_in
from ppafo.validation.replay import Replayed, replay_together
from ppafo.validation.settings import ANGLE, PRESSURE_1, PRESSURE_2, Motion
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
    isolated and no more than usual. ``starts`` are the changes of the readings for one standard error of each initial
    value.
    """

    agreement: RecordingAgreement
    channels: tuple[str, ...]
    values: Floats
    noise: Floats
    engine: Floats
    good: Floats
    words: tuple[str, ...]
    has_few: bool
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


def record_of(agreement: RecordingAgreement) -> Record:
    """Prepare a recording: faulty samples marked, sensitivity of the readings to each initial value."""
    compared = [channel for channel in agreement.channels if channel.channel in SENSORS] or agreement.channels[:1]
    noise = np.array([channel.noise for channel in compared])
    good, words, has_few = np.ones((len(compared), len(agreement.measured))), list[str](), True
    for row, channel in enumerate(compared):
        values, residuals = channel.values, channel.residuals
        # Samples in a channel that the model explains are right, however they look; so are those of one that stands
        # still with the model, but for its zero.
        stands_still = np.ptp(values) == 0.0 and np.ptp(residuals) < channel.usual_zero
        if stands_still or channel.in_noise**2 < ONLY_NOISE:
            continue
        said, is_wrong, is_isolated = _wrong_samples(channel, agreement.measured.time)
        if said:
            words.append(f"{channel.channel} {said}")
            has_few = has_few and is_isolated and float(is_wrong.mean()) < _FEW_OUTLIERS
            good[row] -= is_wrong
            noise[row] = max(noise_in(values[~is_wrong], channel.full_range), correlated_noise_of(residuals[~is_wrong]))
    record = Record(
        agreement=agreement,
        channels=tuple(channel.channel for channel in compared),
        values=np.stack([channel.values for channel in compared]) / noise[:, None],
        noise=noise,
        engine=ENGINE_ERROR * np.array([channel.full_range for channel in compared]) / noise,
        good=good,
        words=tuple(words),
        has_few=has_few,
    )
    request, starts = agreement.request, list[dict[str, float]]()
    for name, error in zip(record.channels, noise / math.sqrt(samples_at_rest(agreement.measured)), strict=True):
        if name in SENSORS and name not in request.settings.initial:
            # A vane at its upper stop can only move down.
            is_at_stop = name == ANGLE and request.start.angle > request.device.actuator.angle_max - error
            starts.append({name: getattr(request.start, name) + float(-error if is_at_stop else error)})
    if (error := request.start.velocity_error) > 0.0:
        starts.append({"angular_velocity": request.start.angular_velocity + error})
    moved = [replace(request, start=replace(request.start, **start)) for start in starts]
    unmoved, none = agreement.replayed, ModelChange()
    return record._replace(
        starts=tuple(
            readings_of(record, other, none, 0.0) - readings_of(record, unmoved, none, 0.0)
            for other in replay_together(moved)
            if isinstance(other, Replayed)
        )
    )


def _wrong_samples(channel: ChannelAgreement, times: Floats) -> tuple[str, Flags, bool]:
    """Return words on faulty samples, empty without any, their flags, and True for isolated outliers.

    Samples are clipped at the least or largest value if it is repeated more often than by chance. A coarse converter
    repeats inner values too. Agreement of the other channels tells a stop of the vane from clipping.
    """
    values, count = channel.values, len(channel.values)
    if np.ptp(values) == 0.0:
        locked = argument_text("motion", "locked")
        other_cause = f"the vane was locked ({locked}), or " if channel.channel == ANGLE else ""
        return f"never changes: {other_cause}the sensor is dead or not connected", np.ones(count, dtype=bool), False
    run_ends = np.append(np.flatnonzero(np.diff(values)), count - 1)
    lengths, levels = np.diff(run_ends, prepend=-1), values[run_ends]
    ends = {"least": values.min(), "largest": values.max()}
    inner = lengths[(levels > ends["least"]) & (levels < ends["largest"])]
    # Chance that a sample repeats the one before it.
    repeated = max(1.0 - len(inner) / max(int(inner.sum()), 1), 1.0 / count)
    clipped = {
        word: values == end
        for word, end in ends.items()
        if count * repeated ** (int(lengths[levels == end].max()) - 1) < _BY_CHANCE
    }
    if clipped:
        counts = " and ".join(
            f"{int(flags.sum())} samples are exactly its {word} value" for word, flags in clipped.items()
        )
        return f"is clipped: {counts}", np.any([*clipped.values()], axis=0), False
    is_out, is_out_on_flank = (isolated_samples(one, channel.noise) for one in (values, channel.residuals))
    # On a flank an outlier shows only beside a model that follows it; at the ends a delay makes one of a step.
    is_out[1:-1] |= is_out_on_flank[1:-1]
    outliers = int(is_out.sum())
    first = f"{float(times[int(np.argmax(is_out))]):.6g} s"
    said = f"has {outliers} isolated outlier{'s' * (outliers > 1)}, the first at {first}"
    return said if outliers else "", is_out, True


def at_rate(recording: Recording, rate: float) -> Recording:
    """Return a recording in true time, given the ``rate`` of its clock relative to true time [-]."""
    first = recording.time[0]
    return replace(recording, time=first + (recording.time - first) / rate)


def readings_of(record: Record, replayed: Replayed, change: ModelChange, offset: float) -> Floats:
    """Return modelled readings divided by noise (channels, samples) under a change, delayed by ``offset`` [s]."""
    time, model = record.agreement.measured.time, replayed.recording
    true_time = time[0] + (time - time[0]) / change.clock
    rows = []
    for name in record.channels:
        sensor = change.sensors.get(name, SensorModel())
        source = model[SWAPPED.get(name, name) if change.is_swapped else name]
        delay = offset + change.delay + sensor.delay
        rows.append(sensor.of(np.interp(true_time - delay, model.time, source)))
    return np.asarray(np.stack(rows) / record.noise[:, None])


def residuals_of(record: Record, replayed: Replayed, change: ModelChange) -> ScaledResiduals:
    """Return the residuals after fitting the common delay, within its limit, and the initial values.

    The fit of the delay starts both from 0 and from the delay of the unchanged model, which a wrong model may distort.
    """
    good = np.ones_like(record.good) if change.start is None else record.good
    # No quantity stands twice in one fit: beside a delay of its own a change gets no free one, which would take a part.
    longest_delay = 0.0 if change.has_delay else record.agreement.request.settings.longest_delay
    delays = {0.0, record.agreement.delay} if longest_delay > 0.0 else {0.0}
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
    interval = float(np.median(np.diff(record.agreement.measured.time)))
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
