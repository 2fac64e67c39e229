"""Motion of a vane that decays freely, in closed form, and the part of a recording in which it does.

Equation (1) without pressure and gravity is I w' = -beta w - T_c sign(w). With b = beta/I and d = T_c/I,
w(t) = (w_0 + d/b) exp(-b t) - d/b until w reaches zero.
"""

import math
from typing import NamedTuple

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.inputs import check_moves, check_no_gap, window
from ppafo.identification.source import Source
from ppafo.signals import Recording
from ppafo.signals.faults import is_at_limit, plateaus
from ppafo.signals.recording import Floats

_SLOW = 1.0e-9


def angle_of_decay(
    times: Floats, start_angle: float, start_velocity: float, damping_rate: float, deceleration: float
) -> Floats:
    """Return the angle [rad] after times [s] for beta/I [1/s] and T_c/I [rad/s^2]; start velocity above 0; eq. (1)."""
    stop = stop_time(start_velocity, damping_rate, deceleration)
    moving = np.minimum(times, stop)
    run, creep = _decay_integrals(moving, damping_rate)
    return np.asarray(start_angle + start_velocity * run - deceleration * creep)


def velocity_of_decay(times: Floats, start_velocity: float, damping_rate: float, deceleration: float) -> Floats:
    """Return the angular velocity [rad/s] after times [s], 0 from the stop on; arguments as for the angle; eq. (1)."""
    moving = np.minimum(times, stop_time(start_velocity, damping_rate, deceleration))
    run, _ = _decay_integrals(moving, damping_rate)
    return np.asarray(start_velocity * (1.0 - damping_rate * run) - deceleration * run)


def stop_time(start_velocity: float, damping_rate: float, deceleration: float) -> float:
    """Return when the decay ends [s], infinite without Coulomb friction: ln(1 + w_0 b / d) / b."""
    if deceleration <= 0.0:
        return math.inf
    if damping_rate < _SLOW:
        return start_velocity / deceleration
    return math.log1p(start_velocity * damping_rate / deceleration) / damping_rate


def _decay_integrals(times: Floats, rate: float) -> tuple[Floats, Floats]:
    """Return the integral of exp(-b t), and the integral of that; series where b t is small."""
    product = rate * times
    small = product < 1.0e-4
    safe_rate = max(rate, _SLOW)
    run = np.where(small, times * (1.0 - product / 2.0 + product**2 / 6.0), -np.expm1(-product) / safe_rate)
    creep = np.where(small, times**2 * (0.5 - product / 6.0 + product**2 / 24.0), (times - run) / safe_rate)
    return run, creep


PROCEDURE = "free-decay"
ANGLE = "angle"
VELOCITY = "angular_velocity"
"""Fitted besides the angle where it was recorded."""

MINIMUM_SAMPLES = 20
FEWEST_SMOOTHED = 5
_SMOOTHED_FRACTION = 0.04
_VELOCITY_MAY_DIFFER = 0.1
_SMALLEST_NOISE = 1.0e-6
_MINIMUM_OVER_NOISE = 20.0


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
    """Return the decay in a recording between two times [s]; without a start it begins where the speed is largest.

    IdentificationError where too few samples are left.
    """
    check_moves(source, PROCEDURE, "angle")
    part = window(source.recording, start, end)
    if len(part) < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE} needs at least {MINIMUM_SAMPLES} samples between start and end, "
            f"there are {len(part)}"
        )
    _check_course(source, part)
    skipped = check_no_gap(source, PROCEDURE, part)
    velocity, _ = smoothed_rates(part.time, part["angle"])
    first = 0 if start is not None else int(np.argmax(np.abs(velocity)))
    sign = 1.0 if velocity[first] > 0.0 else -1.0
    # A push ends a little after the highest speed of the smoothed signal; that much is left out.
    first += 0 if start is not None else smoothing_width(part.time.size) // 2
    back = np.flatnonzero(sign * velocity[first:] < -0.02 * np.abs(velocity).max())
    last = first + int(back[0]) if back.size else part.time.size
    if last - first < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: only {last - first} samples lie between the highest speed and the end or the "
            f"first reversal, {MINIMUM_SAMPLES} are needed; record longer, or give start and end"
        )
    time, angle = part.time[first:last], part["angle"][first:last]
    _check_not_at_limit(source, angle, skipped + first)
    if VELOCITY not in part:
        return Decay(time=time - time[0], angle=angle, sign=sign, velocity=None, velocity_weight=0.0)
    measured = part[VELOCITY][first:last]
    _check_velocity(source, time, angle, measured)
    return Decay(
        time=time - time[0],
        angle=angle,
        sign=sign,
        velocity=measured,
        velocity_weight=noise_of(angle) / noise_of(measured),
    )


def _check_course(source: Source, part: Recording) -> None:
    """Refuse a recording in which nothing moves by more than its noise."""
    swept, noise = float(np.ptp(part[ANGLE])), noise_of(part[ANGLE])
    if swept < _MINIMUM_OVER_NOISE * noise:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: nothing moves: the angle changes by {swept:.3g} rad with a noise of "
            f"{noise:.3g} rad; push the vane"
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
    """Return the scatter, in the unit of the values, from second differences; never 0, so that it can be a weight."""
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
    return max(FEWEST_SMOOTHED, int(_SMOOTHED_FRACTION * count)) | 1
