"""What the comparison of a model with one recording says, channel by channel."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.signals import Recording
from ppafo.signals.recording import Floats
from ppafo.validation.alignment import Curve, Delay, estimated_delay

_LONGEST_WEIGHT = 3.0
"""Usual intervals for which one sample may speak at most, so that a gap does not count for what nobody measured."""


@dataclass(frozen=True, slots=True)
class ChannelAgreement:
    """Errors (model less measured) in one channel, in its SI unit, after the common delay was taken out.

    ``rms``, ``bias`` and ``largest`` (with its sign, at ``largest_time`` [s]); ``rms_unaligned`` is the RMS error
    without any shift; ``delay`` [s] is what this channel alone would have; ``delay_is_at_limit`` says that the
    search for it ended at its limit, so that it is none of a sensor. ``limit`` is the largest share of
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
    def share(self) -> float:
        """RMS error over the full range [-]."""
        return self.rms / self.full_range

    @property
    def passes(self) -> bool:
        """True where the RMS error is within its limit."""
        return self.share <= self.limit


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
    """One channel to compare: its curves, the unit of an error, and the largest share of the full range that passes."""

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
    own = estimated_delay([curve], longest_delay)
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
    return estimated_delay([item.curve for item in chosen], longest_delay)


def errors(curve: Curve, delay: float) -> Floats:
    """Model less measured at the times of the measurement, with the model ``delay`` [s] later."""
    return curve.shifted(delay, curve.times) - curve.values


def sample_weights(time: Floats) -> Floats:
    """Share of the time [-] for which each sample speaks, by the trapezoidal rule; gaps are not counted."""
    intervals = np.diff(time)
    intervals = np.minimum(intervals, _LONGEST_WEIGHT * np.median(intervals))
    weights = 0.5 * (np.append(intervals, 0.0) + np.insert(intervals, 0, 0.0))
    return np.asarray(weights / weights.sum())


def _rms(error: Floats, weights: Floats) -> float:
    return float(np.sqrt(weights @ error**2))
