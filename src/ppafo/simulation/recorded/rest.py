"""Initial state of a replay: angle and pressures before the first command, and the velocity with which it begins."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ppafo.constants import PASCALS_PER_PSI
from ppafo.errors import DataError
from ppafo.model.catalog import VALVES
from ppafo.parameters.device import Device
from ppafo.parameters.plant import first_settings
from ppafo.signals import Recording
from ppafo.signals.faults import noise_of, resolution_of
from ppafo.signals.recording import Floats
from ppafo.simulation.recorded.channels import ANGLE, COMMAND, between_stops

_FITS = 1.0e-6
"""Rounding tolerance of the time of a start [s]."""
_WINDOWS = 8, 12, 16, 24, 32, 48, 64
"""Numbers of first samples from which the velocity of a start in motion is found."""
# Scatter up to which a cubic follows the samples [noises], factor of the error of its velocity, for the cubic is none
# of the model, and least velocity of a motion: in such errors [-], and beyond them [rad/s].
_FOLLOWED = 1.3
_SURE = 2.0
_SEEN = 4.0
_LEAST_VELOCITY = 0.05
REST_WINDOW = 0.05
"""Time before the first command over which the start is averaged [s]; so short that a leak has no effect."""
_FEWEST_ON_LINE = 8
"""Fewest samples for a significant slope; with fewer samples the first or the last one is used."""
_SEEN_SLOPE = 4.0
"""Smallest ratio of a significant slope to its standard error: white noise exceeds it once in 16,000 times."""
_ROUNDING = 1.0e-9
"""Slope, as a fraction of the largest value, below which it is rounding of the least squares."""
_DEVIATION_OF_MEDIAN = 1.4826
"""Standard deviation of normal noise divided by its median absolute value: 1 / (0.75 quantile of a standard normal)."""
_LEAST_RANK = 1.0e-6
"""Smallest singular value divided by the largest for which powers of time count as independent."""

LONGEST_ONSET = 0.25
"""Time after which a valve has followed a command, longer than any dead time [s]."""
# Least noise as a fraction of the range of a channel, and change that shows a motion without doubt, in noises [-].
_LEAST_OF_RANGE = 1.0e-4
_CLEAR = 20.0
_AT_END = 0.3 * PASCALS_PER_PSI
"""Usual zero of a pressure sensor, within which a chamber is at the atmosphere or at its supply [Pa]."""
# Fraction of a motion done in half of its time [-], from which it has not begun in this time: steady, it is 0.5; and
# least time at rest that a valve without a motion holds [times until the flow follows].
_HALF = 0.4
_STANDING = 2.0


@dataclass(frozen=True, slots=True)
class ReplayStart:
    """Angle [rad], angular velocity [rad/s] and pressures [Pa absolute] at the first sample.

    ``velocity_error`` is the standard error of a velocity that was derived from the angles [rad/s].
    """

    angle: float
    angular_velocity: float
    pressure_1: float
    pressure_2: float
    velocity_error: float = 0.0


def motion_at(recording: Recording, start: float) -> tuple[float, float, float] | None:
    """Return angle [rad], angular velocity and its standard error [rad/s] at a time [s]; None at rest or without angle.

    They are those of a cubic through the samples from there on, as many as it follows to their noise.
    """
    if ANGLE not in recording:
        return None
    inside = recording.time >= start - _FITS
    time = recording.time[inside] - start
    angles = recording[ANGLE][inside]
    noise = read_error(recording, ANGLE)
    found = None
    for count in (count for count in _WINDOWS if count <= time.size):
        coefficients, covariance = np.polyfit(time[:count], angles[:count], 3, cov="unscaled")
        scatter = float(np.std(angles[:count] - np.polyval(coefficients, time[:count])))
        if found is not None and scatter > _FOLLOWED * noise:
            break
        angle = float(coefficients[3])
        velocity = float(coefficients[2])
        found = angle, velocity, _SURE * max(noise, scatter) * math.sqrt(float(covariance[2, 2]))
    return found if found is not None and abs(found[1]) > _LEAST_VELOCITY + _SEEN * found[2] else None


def command_ahead(recording: Recording, device: Device) -> float:
    """Return the command [-] that has stood before a recording: its first one, or not a number where it begins later.

    A pressure that a command moves from its first sample on begins flat, for as long as the valve takes to follow, or
    from the pressure of the atmosphere or of its supply; one that has moved before has its slope at once. Where nothing
    moves until the command changes, for longer than the valve takes, the valve holds it.
    """
    time = recording.time - recording.time[0]
    command = recording[COMMAND]
    supply = device.supply
    kind = VALVES[device.valve.kind]
    settings = first_settings(device.valve)
    onset = (kind.lag or kind.choose(settings).command_delay)(settings)
    first = time.size
    moves = False
    for name, fed in (("pressure_1", supply.pressure), ("pressure_2", supply.dorsiflexion_pressure)):
        values = recording[name] if name in recording else np.zeros(1)
        least = max(read_error(recording, name), _LEAST_OF_RANGE * float(np.ptp(values)))
        away = np.flatnonzero(np.abs(values - values[0]) > _CLEAR * least)
        # The chamber that moves first tells.
        if away.size and away[0] < first:
            first = int(away[0])
            last = max(2, first)
            # Half of a steady motion is done after half of the time, and less of one that has begun since.
            curve = np.polyfit(time[: last + 1] / time[last], values[: last + 1], 2)
            half, whole = np.polyval(curve, [0.5, 1.0]) - curve[2]
            end = supply.atmospheric_pressure if whole > 0.0 else fed
            moves = time[last] < LONGEST_ONSET and half / whole > _HALF and abs(values[0] - end) > _AT_END
    change = int(np.argmax(np.append(command[:-1] != command[0], True)))
    is_held = change <= first and time[change] > max(_STANDING * onset, REST_WINDOW)
    has_stood = moves or is_held or motion_at(recording, float(recording.time[0])) is not None
    return float(command[0]) if has_stood else math.nan


def read_error(recording: Recording, name: str) -> float:
    """Return the standard deviation [SI] of one sample of a channel, from noise and resolution; 0 if not recorded."""
    if name not in recording:
        return 0.0
    return math.hypot(noise_of(recording[name]), resolution_of(recording[name]) / math.sqrt(12.0))


def samples_at_rest(recording: Recording) -> int:
    """Return the number of samples before the first command, at most 50 ms; 1 if the valve is open at the start."""
    command = recording[COMMAND]
    time = recording.time
    if command[0] != 0.0:
        return 1
    quiet = command.size if not command.any() else int(np.argmax(command != 0.0))
    return max(1, min(quiet, int((time < time[0] + REST_WINDOW).sum())))


def start_of(recording: Recording, device: Device, known: Mapping[str, float], file: str) -> ReplayStart:
    """Return the initial state of a replay: ``known`` values [SI] take precedence over the averaged samples at rest.

    The first angles tell a velocity that is not recorded. Raises DataError, with ``file``, for a missing channel.
    """
    is_told = ANGLE in known or "angular_velocity" in recording
    motion = None if is_told else motion_at(recording, float(recording.time[0]))
    if motion is not None:
        known = {ANGLE: motion[0], "angular_velocity": motion[1], **known}
    count = samples_at_rest(recording)
    values = dict(known)
    if device.actuator.has_one_chamber and "pressure_2" not in recording:
        # No recorded channel depends on the dead volume behind the other port.
        values.setdefault("pressure_2", device.supply.atmospheric_pressure)
    for name in (ANGLE, "pressure_1", "pressure_2", "angular_velocity"):
        if name not in values and name in recording:
            values[name] = value_at_rest(recording.time[:count], recording[name][:count])
        elif name != "angular_velocity" and name not in values:
            raise DataError(f"{file}: there is no channel '{name}' for the initial state")
    angle = float(between_stops(np.array([values[ANGLE]]), device, file)[0])
    velocity = values.get("angular_velocity", 0.0)
    error = 0.0 if motion is None else motion[2]
    return ReplayStart(angle, velocity, values["pressure_1"], values["pressure_2"], error)


def value_at_rest(time: Floats, values: Floats, at_end: bool = False) -> float:
    """Return the value [SI] at the start, or at the end, of samples at rest: their mean if they show no drift.

    In a leaking chamber the pressure drifts even while valve and vane rest. With a significant slope, the value is
    taken from the fitted line; with significant curvature, the same rule is applied to the half nearer to that end.
    """
    while values.size >= _FEWEST_ON_LINE:
        fraction = (time - (time[-1] if at_end else time[0])) / (time[-1] - time[0])
        line = np.vander(fraction, 2)
        parabola = np.vander(fraction, 3)
        if not _is_seen(line, values):
            return float(np.mean(values))
        if not _is_seen(parabola, values):
            return float(np.linalg.lstsq(line, values)[0][-1])
        nearer_half = slice(values.size // 2, None) if at_end else slice(None, values.size // 2)
        time = time[nearer_half]
        values = values[nearer_half]
    return float(values[-1 if at_end else 0])


def _is_seen(columns: Floats, values: Floats) -> bool:
    """Tell whether the least-squares coefficient of the first column is significant relative to the sample noise.

    The noise is estimated by the median of second differences, which neither a slope nor a step changes.
    """
    # Samples that lie together in time, but for one, tell no bend from a slope.
    if np.linalg.matrix_rank(columns, rtol=_LEAST_RANK) < columns.shape[1]:
        return False
    coefficients = np.linalg.lstsq(columns, values)[0]
    # A second difference of white noise has the square root of 6 times its standard deviation: 1 + 4 + 1.
    noise = _DEVIATION_OF_MEDIAN * float(np.median(np.abs(np.diff(values, n=2)))) / math.sqrt(6.0)
    error = noise * math.sqrt(float(np.linalg.inv(columns.T @ columns)[0, 0]))
    return bool(abs(coefficients[0]) > _SEEN_SLOPE * error + _ROUNDING * float(np.abs(values).max()))
