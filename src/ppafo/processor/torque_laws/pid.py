"""PID in integer arithmetic: equation (13), with optional anti-windup and derivative filter.

During summation a command is in units of 1/64 step, the integral in 1/256 of this unit, the error in counts and its
slope in 1/65536 counts per sample. Values that are unlimited in the float form have wide limits: the integral 32 full
commands, the slope 8191 counts per sample, the anti-windup correction 32 full commands.
"""

from collections.abc import Mapping
from functools import partial
from typing import Annotated, NamedTuple

from ppafo.control.controllers.pid import PID as FLOAT_PID
from ppafo.engine.composer import each
from ppafo.model.declaration import Number
from ppafo.model.sensors import Measurement
from ppafo.processor.fixed_point import (
    COMMAND_STEPS,
    FRACTION_BITS,
    LARGEST_FRACTION,
    LARGEST_READING,
    MOST_PLACES,
    ConverterCounts,
    ConverterLimits,
    CountResolution,
    Flag,
    beyond_band,
    error_of,
    fraction_of,
    gain_of,
    limited,
    read,
    shifted,
    still_sound,
)
from ppafo.processor.torque_laws.law import fixed_law

PART_BITS = 6
HALF_STEP = 2 ** (PART_BITS - 1)
"""Half a command step, in summation units of 1/64 step."""
FULL = COMMAND_STEPS * 2**PART_BITS
"""Full command in summation units of 1/64 step."""
FINE_BITS = 8
FINE = 2**FINE_BITS
"""Number of integral units per summation unit of 1/64 step."""
WIDE = 2**FRACTION_BITS
"""Scale factor of the error for ``fraction_of``, which keeps all bits of the product with a gain."""
SLOPE_UNIT = 65536
"""Number of slope units per count."""
LARGEST_CHANGE = 8191
"""Largest change of the error per sample [counts], so that its slope is below 2^30."""
LARGEST_SLOPE = LARGEST_CHANGE * SLOPE_UNIT
LARGEST_EXCESS = 32 * FULL
"""Largest anti-windup correction, in summation units of 1/64 step; below 2^30 in integral units."""
LARGEST_INTEGRAL = 32 * FULL * FINE
"""Largest integral in integral units, below 2^30."""
SHARE = float(2**FRACTION_BITS)
"""Integer that represents a fraction of 1."""
_LARGEST_ERROR = 2 * LARGEST_READING
"""Largest error [counts]: reference and pressure difference each span one range."""


_FRACTION = partial(Number, "", minimum=0.0, maximum=float(LARGEST_FRACTION))
_PLACES = Number("", "and the places it is shifted right by", None, 0.0, float(MOST_PLACES))


class _PidNumbers(NamedTuple):
    """Numbers of the PID law: reading limits, gains as fractions and shifts, other fractions in 1/2^15."""

    limits: ConverterLimits
    proportional: Annotated[int, _FRACTION("k_p: part of a step for a count of the error")]
    proportional_places: Annotated[int, _PLACES]
    integral: Annotated[int, _FRACTION("k_i: fine parts for a count of the error at each sample")]
    integral_places: Annotated[int, _PLACES]
    derivative: Annotated[int, _FRACTION("k_d: part of a step for a change of the error")]
    derivative_places: Annotated[int, _PLACES]
    filter_share: Annotated[int, _FRACTION("share of a change that the slope takes at once, in 1/2^15")]
    anti_windup: Annotated[int, _FRACTION("share of the excess that is pulled back, in 1/2^15")]
    dead_band: Annotated[int, _FRACTION("dead band of the valve, in 1/2^15")]


class _PidCounts(NamedTuple):
    """State of the PID law: integral, error [counts], slope [1/65536 counts], start flag, validity flag."""

    integral: Annotated[int, Number("", "integral", None, -LARGEST_INTEGRAL, LARGEST_INTEGRAL)]
    error: Annotated[int, Number("", "error", None, -_LARGEST_ERROR, _LARGEST_ERROR)]
    slope: Annotated[int, Number("", "slope", None, -LARGEST_SLOPE, LARGEST_SLOPE)]
    started: Flag
    sound: Flag


class _PidRows(NamedTuple):
    """Parameter row of the PID law: converter resolution, and numbers of ``pid_sample``."""

    steps: CountResolution
    numbers: _PidNumbers


def pid_sample(numbers: _PidNumbers, state: _PidCounts, readings: ConverterCounts) -> tuple[int, _PidCounts]:
    """Return the command [steps], -1000 to 1000, for a sample; 0 for good after a reading at an end of its range."""
    sound = still_sound(state.sound, readings, numbers.limits)
    error = error_of(readings, numbers.limits)
    # Without a last error there is no change: no derivative kick at the first sample.
    change = limited(error - state.error, LARGEST_CHANGE) if state.started == 1 else 0
    slope = limited(state.slope + fraction_of(change * SLOPE_UNIT - state.slope, numbers.filter_share), LARGEST_SLOPE)
    # Gains have 15 bits behind the point: an error of one count would be rounded away without as many of its own.
    wide_error = error * WIDE
    # The integral has 256 parts of a part: what a small error adds in one period is less than a part.
    integral = state.integral + shifted(fraction_of(wide_error, numbers.integral), numbers.integral_places)
    proportional = shifted(fraction_of(wide_error, numbers.proportional), numbers.proportional_places)
    derivative = shifted(fraction_of(slope, numbers.derivative), numbers.derivative_places)
    # Shifts and not divisions: both round down, in C of any compiler as in Python.
    unlimited = proportional + (integral >> FINE_BITS) + derivative
    command = limited(unlimited, FULL)
    # Back-calculation, after the command: the integral of the next sample has it, as in equation (13) with floats.
    excess = limited(command - unlimited, LARGEST_EXCESS)
    integral = limited(integral + fraction_of(excess * FINE, numbers.anti_windup), LARGEST_INTEGRAL)
    after = _PidCounts(integral=integral, error=error, slope=slope, started=1, sound=sound)
    sent = beyond_band(command, numbers.dead_band, FULL)
    # A half first: the shift rounds down.
    return ((sent + HALF_STEP) >> PART_BITS if sound == 1 else 0), after


def pid_update(
    parameters: _PidRows, state: _PidCounts, reference: float, measurement: Measurement, period: float
) -> tuple[float, _PidCounts]:
    """Return the command from -1 to 1 of ``pid_sample`` for converter readings, every ``period`` [s]."""
    readings = read(parameters.steps, parameters.numbers.limits, reference, measurement)
    command, after = pid_sample(each(int, parameters.numbers), each(int, state), readings)
    return float(command) / COMMAND_STEPS, each(float, after)


def pid_factors(
    settings: Mapping[str, float], period: float, torque_step: float
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return gains and fractions of the PID law, from settings [SI], period [s] and torque per count [N m].

    The gains are represented by a fraction and a shift: of the error, in 1/64 step per count; of its integral, in
    integral units; of the slope, in 1/64 step per 1/65536 count per sample, times 2^15. The fractions [-] are: of a
    change that enters the slope at once, of the excess that is subtracted from the integral at a sample, and the dead
    band.
    """
    # Gains of a torque [N m] and of seconds become gains of counts and samples.
    count = torque_step * FULL
    gains = (
        settings["proportional_gain"] * count,
        settings["integral_gain"] * period * count * FINE,
        settings["derivative_gain"] / period * count * (WIDE / SLOPE_UNIT),
    )
    # As in floating point: without an integral gain there is no integral to wind up.
    anti_windup = settings["anti_windup"] * period if settings["integral_gain"] > 0.0 else 0.0
    return gains, (period / (period + settings["derivative_filter"]), anti_windup, settings["dead_band"])


def prepare_pid(settings: Mapping[str, float], period: float, torque_step: float) -> tuple[float, ...]:
    """Return the numbers of ``_PidNumbers`` after the limits, from settings [SI], period [s], torque per count."""
    gains, shares = pid_factors(settings, period, torque_step)
    scaled = (number for gain in gains for number in gain_of(gain))
    return (*scaled, *(float(min(LARGEST_FRACTION, int(share * SHARE + 0.5))) for share in shares))


def largest_pid(settings: Mapping[str, float], period: float, torque_step: float) -> float:
    """Return the largest gain relative to its largest representable value [-]; above 1 it is refused."""
    gains, (_, anti_windup, _) = pid_factors(settings, period, torque_step)
    return max(*gains, anti_windup * LARGEST_FRACTION) / LARGEST_FRACTION


PID = fixed_law(
    FLOAT_PID,
    "pid_fixed_point",
    _PidRows,
    _PidCounts(integral=0, error=0, slope=0, started=0, sound=1),
    pid_sample,
    pid_update,
    prepare_pid,
    largest_pid,
)
PID_FIXED_POINT = PID.kind
