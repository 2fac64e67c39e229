"""A model compared with one recording, on the inputs of that recording: errors channel by channel."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ppafo.errors import DataError
from ppafo.parameters.device import Device
from ppafo.signals import Recording
from ppafo.signals.recording import Floats
from ppafo.simulation.recorded.inputs import SUPPLY, regular_interval
from ppafo.simulation.recorded.scenario import with_fixed_volume
from ppafo.validation.alignment import DEFAULT_LIMIT, Curve, Delay, estimate_delay
from ppafo.validation.compared import (
    ANGLE,
    COMPARED,
    PRESSURE_1,
    PRESSURE_2,
    PRESSURE_DIFFERENCE,
    Thresholds,
    parse_thresholds,
)
from ppafo.validation.measured import Measured, supply_gauge
from ppafo.validation.replay import Motion, Replayed, initial_in_fixed_volume, replay_recording, start_of

_LONGEST_WEIGHT = 3.0
"""Usual intervals for which one sample may speak at most, so that a gap does not count for what nobody measured."""
_OTHER_SUPPLY = 0.05
"""Fraction of the set's gauge pressure by which a recorded supply may differ before it is remarked on."""
_AT_LIMIT = "model and measurement are more than {:g} s apart in time; no delay was removed"
_CHANNEL_AT_LIMIT = "own delay of {} is at the limit of {:g} s: not the delay of a sensor, but a different time course"


@dataclass(frozen=True, slots=True)
class ReplaySettings:
    """How recordings are replayed and judged.

    ``motion`` ``free`` lets the vane move as the model demands, ``measured`` prescribes the recorded angle,
    ``held`` holds it where it starts. With a ``volume`` [m^3] there is no vane: chamber 1 is a fixed volume that the
    valve fills and vents. ``initial`` values [SI] by channel go before the first samples; ``longest_delay`` [s] limits
    the delay looked for.
    """

    motion: Motion = "free"
    initial: Mapping[str, float] = field(default_factory=dict)
    longest_delay: float = DEFAULT_LIMIT
    thresholds: Thresholds = field(default_factory=parse_thresholds)
    volume: float | None = None


@dataclass(frozen=True, slots=True)
class ChannelAgreement:
    """Errors (model less measured) in one channel, in its SI unit, after the common delay was taken out.

    ``rms``, ``bias`` and ``largest`` (with its sign, at ``largest_time`` [s]); ``rms_unaligned`` is the RMS error
    without any shift; ``delay`` [s] is what this channel alone would have; ``delay_is_at_limit`` says that the
    search for it ended at its limit, so that it is none of a sensor. ``limit`` is the largest fraction of
    ``full_range`` that passes.
    """

    channel: str
    unit: str
    full_range: float
    rms: float
    rms_unaligned: float
    bias: float
    largest: float
    largest_time: float
    delay: float
    delay_is_at_limit: bool
    limit: float

    @property
    def fraction(self) -> float:
        """RMS error over the full range [-]."""
        return self.rms / self.full_range

    @property
    def passes(self) -> bool:
        """True where the RMS error is within its limit."""
        return self.fraction <= self.limit


@dataclass(frozen=True, slots=True)
class RecordingAgreement:
    """A recording, the model on its inputs, and how far they are apart."""

    file: str
    sha256: str
    measured: Recording
    model: Recording
    motion: str
    inputs: tuple[str, ...]
    step: float
    delay: Delay
    channels: tuple[ChannelAgreement, ...]
    remarks: tuple[str, ...]

    @property
    def passes(self) -> bool:
        """True where every channel is within its limit."""
        return all(channel.passes for channel in self.channels)


@dataclass(frozen=True, slots=True)
class Comparison:
    """One channel to compare: its curves, the unit of an error, and the maximum fraction of the full range."""

    channel: str
    unit: str
    curve: Curve
    limit: float


def channel_agreement(item: Comparison, delay: float, longest_delay: float) -> ChannelAgreement:
    """The errors in one channel with the model shifted by ``delay`` [s]."""
    curve = item.curve
    weights = sample_weights(curve.times)
    error = errors(curve, delay)
    worst = int(np.argmax(np.abs(error)))
    own = estimate_delay([curve], longest_delay)
    return ChannelAgreement(
        channel=item.channel,
        unit=item.unit,
        full_range=curve.full_range,
        rms=_rms(error, weights),
        rms_unaligned=_rms(errors(curve, 0.0), weights),
        bias=float(weights @ error),
        largest=float(error[worst]),
        largest_time=float(curve.times[worst]),
        delay=own.value,
        delay_is_at_limit=own.is_at_limit,
        limit=item.limit,
    )


def common_delay(items: Sequence[Comparison], longest_delay: float) -> Delay:
    """The delay that all channels share; sums and multiples of two others do not count twice."""
    chosen = [item for item in items if item.channel in ("angle", "pressure_1", "pressure_2")] or list(items)[:1]
    return estimate_delay([item.curve for item in chosen], longest_delay)


def errors(curve: Curve, delay: float) -> Floats:
    """Model less measured at the times of the measurement, with the model ``delay`` [s] later."""
    return curve.shift(delay, curve.times) - curve.values


def sample_weights(time: Floats) -> Floats:
    """Fraction of the time [-] for which each sample speaks, by the trapezoidal rule; gaps are not counted."""
    intervals = np.diff(time)
    intervals = np.minimum(intervals, _LONGEST_WEIGHT * np.median(intervals))
    weights = 0.5 * (np.append(intervals, 0.0) + np.insert(intervals, 0, 0.0))
    return np.asarray(weights / weights.sum())


def _rms(error: Floats, weights: Floats) -> float:
    return float(np.sqrt(weights @ error**2))


def compare_recording(measured: Measured, device: Device, settings: ReplaySettings) -> RecordingAgreement:
    """Return how far the model of a device is from one recording, on the inputs of that recording."""
    if settings.volume is not None:
        device = with_fixed_volume(device, settings.volume)
        settings = replace(settings, motion="held", initial=initial_in_fixed_volume(device, settings.initial))
    _check_angle(measured, settings.motion)
    start = start_of(measured, device, settings.initial)
    replayed = replay_recording(measured, device, start, settings.motion, settings.longest_delay)
    items = _comparisons(measured, replayed, device, settings)
    delay = common_delay(items, settings.longest_delay)
    channels = tuple(channel_agreement(item, delay.correction, settings.longest_delay) for item in items)
    late = _late_remarks(delay, channels, settings.longest_delay)
    return RecordingAgreement(
        file=measured.file,
        sha256=measured.sha256,
        measured=measured.recording,
        model=replayed.recording,
        motion=settings.motion,
        inputs=replayed.inputs,
        step=replayed.step,
        delay=delay,
        channels=channels,
        remarks=(*measured.remarks, *_remarks(measured, device, settings), *late),
    )


def _late_remarks(delay: Delay, channels: Sequence[ChannelAgreement], longest: float) -> tuple[str, ...]:
    """Say where the search for a delay ended at its limit, for all channels together or for some alone."""
    if delay.is_at_limit:
        return (_AT_LIMIT.format(longest),)
    alone = [channel.channel for channel in channels if channel.delay_is_at_limit]
    return (_CHANNEL_AT_LIMIT.format(", ".join(alone), longest),) if alone else ()


def measured_values(recording: Recording, name: str) -> Floats | None:
    """The values of a channel to compare; the pressure difference follows from both pressures where they are there."""
    if name == PRESSURE_DIFFERENCE and PRESSURE_1 in recording and PRESSURE_2 in recording:
        return np.asarray(recording[PRESSURE_1] - recording[PRESSURE_2])
    if name not in recording:
        return None
    return recording[name]


def _check_angle(measured: Measured, motion: Motion) -> None:
    if motion == "measured" and not measured.has(ANGLE):
        raise DataError(f"{measured.file}: there is no channel '{ANGLE}' to prescribe (--motion measured)")


def _comparisons(measured: Measured, replayed: Replayed, device: Device, settings: ReplaySettings) -> list[Comparison]:
    """The channels that the recording has and that the model was not given."""
    gauge = supply_gauge(measured.recording, device)
    items = []
    for name, kind in COMPARED.items():
        values = measured_values(measured.recording, name)
        if values is None or name in replayed.inputs or name in _not_of_motion(settings):
            continue
        full_range = kind.full_range(device, gauge)
        model = replayed.recording
        curve = Curve(measured.recording.time, values, model.time, model[name], full_range)
        items.append(Comparison(name, kind.unit, curve, settings.thresholds.limit(name).fraction_of(full_range)))
    if not items:
        word = "pressure_1" if settings.volume is not None else "anything beside the prescribed angle"
        raise DataError(f"{measured.file}: has nothing to compare; it needs {word}")
    return items


def _not_of_motion(settings: ReplaySettings) -> tuple[str, ...]:
    """The channels that say nothing where the vane is held, or where there is none."""
    if settings.volume is not None:
        return tuple(name for name in COMPARED if name != PRESSURE_1)
    return (ANGLE,) if settings.motion == "held" else ()


def _remarks(measured: Measured, device: Device, settings: ReplaySettings) -> tuple[str, ...]:
    remarks = []
    own = device.supply.pressure - device.supply.atmospheric_pressure
    followed = supply_gauge(measured.recording, device)
    if measured.has(SUPPLY) and abs(followed - own) > _OTHER_SUPPLY * own:
        other = f"{followed / own:.3g} times the gauge pressure of the set" if own > 0.0 else "pressure, the set's none"
        remarks.append(f"the recorded supply has {other}; the recorded supply was used")
    if not measured.has(SUPPLY):
        remarks.append("the supply pressure was not recorded; that of the parameter set was used")
    if regular_interval(measured.recording.time) is None:
        remarks.append("samples are not regular in time; changes of the command were moved to the nearest step")
    if settings.volume is not None:
        remarks.append(f"chamber 1 was treated as a fixed volume of {settings.volume * 1e6:.4g} cm^3 without a vane")
    elif settings.motion == "held":
        remarks.append("the vane was held at its initial angle; the angle is not compared")
    if settings.motion == "measured":
        remarks.append("the recorded angle was prescribed, and is therefore not compared")
    return tuple(remarks)
