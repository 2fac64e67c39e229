"""Free-decay interval of a recording: from the end of the push to standstill, the first reversal, or the end."""

from typing import NamedTuple

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.checks import check_moves, check_no_gap
from ppafo.identification.source import RecordingSource, window
from ppafo.signals.faults import is_at_limit, noise_of, plateaus
from ppafo.signals.recording import Floats

PROCEDURE = "free-decay"
ANGLE = "angle"
VELOCITY = "angular_velocity"
"""Channel fitted together with the angle, if recorded."""
MINIMUM_SAMPLES = 20
"""Least number of samples of a decay."""
FEWEST_SMOOTHED = 5
"""Least number of samples to which a local parabola is fitted."""
_SMOOTHED_FRACTION = 0.04
"""Fraction of the samples of a decay to which a local parabola is fitted [-]."""
_REVERSAL = 0.02
"""Backward velocity relative to the largest velocity [-] that counts as a reversal; noise at rest stays below."""
_VELOCITY_MAY_DIFFER = 0.1
"""Largest relative difference of velocity and rate of the angle [-]; a wrong unit or sign differs by more."""
_MINIMUM_OVER_NOISE = 20.0
"""Least range of the angle divided by its noise [-] for motion to be detected."""
_NEAR = 0.05
"""Distance from the end of a swing, relative to the swing [-], within which the vane is near this end."""
_NOISE_NEAR = 6.0
"""Least such distance divided by the noise of the angle [-]."""
_AT_ONCE = 2.0
"""Duration near the end of a swing, relative to the last half of the swing [-], below which the vane did not rest."""

_SWING_SECTION = (
    'trajectory = {parameters = [{path = "friction.viscous_damping"}, '
    '{path = "friction.dynamic_torque", start = "0.01 N m"}, {path = "friction.static_torque", start = "0.01 N m"}], '
    f'experiments = [{{label = "swing", channels = ["{ANGLE}"], initial_state = "recording", '
    'scenario = "step-response", overrides = ["motion.kind=free", "effects.joint_load.stiffness=... N m/rad", '
    '"effects.joint_load.rest_angle=... deg", "controller.command=0", "initial.pressure_1=atmosphere", '
    '"initial.pressure_2=atmosphere", "actuator.dead_volume_1=10 L", "actuator.dead_volume_2=10 L"], recording = '
)
"""Fit of a swing on a spring, with chambers open to the atmosphere; with little friction the first run swings too."""


class FreeDecay(NamedTuple):
    """Free decay: times from the start [s], angle [rad], direction (1 or -1), velocity [rad/s] if recorded."""

    time: Floats
    angle: Floats
    sign: float
    velocity: Floats | None


def decay_of(source: RecordingSource, start: float | None, end: float | None) -> FreeDecay:
    """Return the decay between two times [s] of a recording; by default it starts at the largest speed.

    Raises IdentificationError, with file, sample and remedy, if there are too few samples, if nothing moves, or if the
    sensor is saturated or contradicts the velocity.
    """
    check_moves(source, PROCEDURE, ANGLE)
    part = window(source.recording, start, end)
    if len(part) < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE} needs at least {MINIMUM_SAMPLES} samples between start and end, "
            f"not {len(part)}"
        )
    swept, noise = float(np.ptp(part[ANGLE])), noise_of(part[ANGLE])
    if swept < _MINIMUM_OVER_NOISE * noise:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: no motion: the angle changes by only {swept:.3g} rad at a noise of "
            f"{noise:.3g} rad; push the vane harder"
        )
    skipped = check_no_gap(source, PROCEDURE, part)
    # A start that the user gave is after the push.
    has_start = start is not None
    speeds, _ = smoothed_rates(part.time, part[ANGLE])
    fastest = 0 if has_start else int(np.argmax(np.abs(speeds)))
    _check_comes_to_rest(source, part.time[fastest:], part[ANGLE][fastest:], noise)
    sign = 1.0 if speeds[fastest] > 0.0 else -1.0
    # A push ends a little after the highest speed of the smoothed signal; that much is left out.
    first = fastest if has_start else fastest + smoothing_width(part.time.size) // 2
    back = np.flatnonzero(sign * speeds[first:] < -_REVERSAL * np.abs(speeds).max())
    last = first + int(back[0]) if back.size else part.time.size
    if last - first < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: only {last - first} samples lie between the highest speed and the first "
            f"reversal (or the end), but {MINIMUM_SAMPLES} are needed; record longer, or give a start and an end of "
            "the decay"
        )
    rows = slice(first, last)
    angle = part[ANGLE][rows]
    for plateau in plateaus(angle):
        if is_at_limit(angle, plateau):
            raise IdentificationError(
                f"{source.name}: {PROCEDURE}: channel 'angle' stays at exactly {plateau.value:g} rad for "
                f"{plateau.count} samples, from sample {skipped + first + plateau.first + 1}, although the vane still "
                "moved before: the sensor is saturated or the vane is at a stop; give an end before this sample"
            )
    time, velocity = part.time[rows], None
    if VELOCITY in part:
        velocity = part[VELOCITY][rows]
        # The angle is compared with the area under the velocity.
        moved = np.concatenate(([0.0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time))))
        deviation = angle - angle.mean()
        gain = float(deviation @ moved / (deviation @ deviation))
        if abs(gain - 1.0) > _VELOCITY_MAY_DIFFER:
            raise IdentificationError(
                f"{source.name}: {PROCEDURE}: channel '{VELOCITY}' is {gain:.3g} times the derivative of 'angle'; "
                f"check unit and sign of both channels"
            )
    return FreeDecay(time=time - time[0], angle=angle, sign=sign, velocity=velocity)


def _check_comes_to_rest(source: RecordingSource, time: Floats, angle: Floats, noise: float) -> None:
    """Raise IdentificationError if the largest swing ends in a return swing without rest, as on a spring.

    Friction alone stops the vane. ``noise`` is the standard deviation of the angle [rad].
    """
    end = max(int(np.argmin(angle)), int(np.argmax(angle)))
    distance = np.abs(angle - angle[end])
    near = max(_NEAR * float(distance.max()), _NOISE_NEAR * noise)
    back = end + np.flatnonzero(distance[end:] > near)
    if back.size:
        halfway, reached = (time[np.flatnonzero(distance[:end] > far)[-1]] for far in (0.5 * distance.max(), near))
        if time[back[0]] - reached < _AT_ONCE * (reached - halfway):
            raise IdentificationError(
                f"{source.name}: {PROCEDURE}: the vane turns back at {time[end]:.3g} s without coming to rest, so "
                "another torque acts, such as a spring or gravity; instead of the procedure write above the tables of "
                f'the problem file {_SWING_SECTION}"{source.name}"}}]}} (fill in the load; columns as in '
                "the procedure); if a stop or a hand turned the vane, give an end before"
            )


def smoothed_rates(time: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Return angular velocity [rad/s] and acceleration [rad/s^2] at the samples, from local parabolas."""
    from scipy.signal import savgol_filter

    # The filter wants an even clock.
    even = np.linspace(time[0], time[-1], time.size)
    step, width = float(even[1] - even[0]), smoothing_width(time.size)
    values = np.interp(even, time, angle)
    rates = [savgol_filter(values, width, 2, deriv=order, delta=step) for order in (1, 2)]
    velocity, acceleration = (np.interp(time, even, rate) for rate in rates)
    return velocity, acceleration


def smoothing_width(count: int) -> int:
    """Return the length of the smoothing window, an odd number of samples, for a decay of ``count`` samples."""
    return max(FEWEST_SMOOTHED, int(_SMOOTHED_FRACTION * count)) | 1
