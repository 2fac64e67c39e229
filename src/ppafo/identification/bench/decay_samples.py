"""The part of a recording in which a vane decays freely, and what of it cannot be used."""

from typing import NamedTuple

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.inputs import check_moves, window
from ppafo.identification.source import Source
from ppafo.signals import Recording
from ppafo.signals.faults import is_at_limit, longest_gap, plateaus
from ppafo.signals.recording import Floats

PROCEDURE = "free_decay"
ANGLE = "angle"
VELOCITY = "angular_velocity"
"""Fitted besides the angle where it was recorded."""

FEWEST_SAMPLES = 20
FEWEST_SMOOTHED = 5
_SMOOTHED_SHARE = 0.04
_VELOCITY_MAY_DIFFER = 0.1
_SMALLEST_NOISE = 1.0e-6
_LEAST_OVER_NOISE = 20.0


class Decay(NamedTuple):
    """One decay: times from its start [s], angle [rad] measured, its direction (1 or -1), and its velocity [rad/s].

    Without a measured angular velocity it is None. ``velocity_weight`` [s] makes its errors worth those of the angle.
    """

    time: Floats
    angle: Floats
    sign: float
    velocity: Floats | None
    velocity_weight: float


def decay_of(source: Source, start: float | None, end: float | None) -> Decay:
    """Return the decay in a recording between two times [s]; without a start it begins where the speed is largest."""
    check_moves(source, PROCEDURE, "angle")
    part = window(source.recording, start, end)
    if len(part) < FEWEST_SAMPLES:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE} needs at least {FEWEST_SAMPLES} samples between start and end, "
            f"there are {len(part)}"
        )
    skipped = int(np.searchsorted(source.recording.time, part.time[0]))
    _check_course(source, part, skipped)
    velocity, _ = smoothed_rates(part.time, part["angle"])
    first = 0 if start is not None else int(np.argmax(np.abs(velocity)))
    sign = 1.0 if velocity[first] > 0.0 else -1.0
    # A push ends a little after the highest speed of the smoothed signal; that much is left out.
    first += 0 if start is not None else smoothing_width(part.time.size) // 2
    back = np.flatnonzero(sign * velocity[first:] < -0.02 * np.abs(velocity).max())
    last = first + int(back[0]) if back.size else part.time.size
    if last - first < FEWEST_SAMPLES:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: only {last - first} samples lie between the highest speed and the end or the "
            f"first reversal, {FEWEST_SAMPLES} are needed; record longer, or give start and end"
        )
    time, angle = part.time[first:last], part["angle"][first:last]
    _check_not_at_limit(source, angle, skipped + first)
    if VELOCITY not in part:
        return Decay(time - time[0], angle, sign, None, 0.0)
    measured = part[VELOCITY][first:last]
    _check_velocity(source, time, angle, measured)
    return Decay(time - time[0], angle, sign, measured, noise_of(angle) / noise_of(measured))


def _check_course(source: Source, part: Recording, skipped: int) -> None:
    """Refuse a recording that is noise, and one with a gap; ``skipped`` samples lie before it."""
    swept, noise = float(np.ptp(part[ANGLE])), noise_of(part[ANGLE])
    if swept < _LEAST_OVER_NOISE * noise:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: nothing moves: the angle changes by {swept:.3g} rad with a noise of "
            f"{noise:.3g} rad; push the vane"
        )
    gap = longest_gap(part.time)
    if gap is not None:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: there is a gap of {gap.duration:.4g} s after {part.time[gap.index]:.6g} s "
            f"(sample {skipped + gap.index + 1}); give start or end, so that it lies outside"
        )


def _check_not_at_limit(source: Source, angle: Floats, skipped: int) -> None:
    """Refuse a decay that ends in the limit of a sensor or at a stop; ``skipped`` samples lie before it."""
    for plateau in plateaus(angle):
        if is_at_limit(angle, plateau):
            raise IdentificationError(
                f"{source.name}: {PROCEDURE}: channel 'angle' stays at exactly {plateau.value:g} rad for "
                f"{plateau.count} samples, from sample {skipped + plateau.first + 1}, and was still moving before: the "
                f"sensor is saturated or the vane is at a stop; give end"
            )


def _check_velocity(source: Source, time: Floats, angle: Floats, measured: Floats) -> None:
    """Refuse an angular velocity that is not how fast the angle changes: another unit, another sign."""
    moved = np.concatenate(([0.0], np.cumsum(0.5 * (measured[1:] + measured[:-1]) * np.diff(time))))
    away = angle - angle.mean()
    gain = float(away @ moved / (away @ away))
    if abs(gain - 1.0) > _VELOCITY_MAY_DIFFER:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: channel '{VELOCITY}' is {gain:.3g} times as fast as 'angle' changes; "
            f"check unit and sign of both"
        )


def noise_of(values: Floats) -> float:
    """Return the scatter from sample to sample, from second differences; never nothing, so that it can be a weight."""
    return max(float(np.sqrt(np.mean(np.diff(values, 2) ** 2) / 6.0)), _SMALLEST_NOISE * float(np.ptp(values)))


def smoothed_rates(time: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Return angular velocity [rad/s] and acceleration [rad/s^2] from local parabolas, at the times of the samples."""
    from scipy.signal import savgol_filter

    even = np.linspace(time[0], time[-1], time.size)
    step, width = float(even[1] - even[0]), smoothing_width(time.size)
    values = np.interp(even, time, angle)
    rates = [savgol_filter(values, width, 2, deriv=order, delta=step) for order in (1, 2)]
    velocity, acceleration = (np.interp(time, even, rate) for rate in rates)
    return velocity, acceleration


def smoothing_width(count: int) -> int:
    """Return an odd number of samples to smooth over."""
    return max(FEWEST_SMOOTHED, int(_SMOOTHED_SHARE * count)) | 1
