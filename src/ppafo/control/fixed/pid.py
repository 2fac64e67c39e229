"""PID control on whole numbers, equation (13), with anti-windup and derivative filter as options.

Commands are in 64 parts of a step while they are summed, the integral in 256 parts of these, the error in counts and
its slope in 1/65536 counts a sample. What the float form has no limit for is limited far out: the integral at 32 full
commands, the slope at 8191 counts a sample, what anti-windup pulls back by at 32 full commands.
"""

from collections.abc import Mapping
from typing import NamedTuple

from ppafo.control.controllers.pid import KIND as FLOAT_KIND
from ppafo.control.fixed.arithmetic import (
    FRACTION_BITS,
    LARGEST_FRACTION,
    MOST_PLACES,
    fraction_of,
    gain_of,
    limited,
    shifted,
)
from ppafo.control.fixed.converter import (
    COMMAND_STEPS,
    LARGEST_READING,
    OF_CONVERTER,
    Converter,
    Limits,
    Readings,
    error_of,
    limits_of,
    read,
    still_sound,
)
from ppafo.control.fixed.kind import FixedLaw
from ppafo.control.kind import ControllerKind
from ppafo.model.declaration import Quantity
from ppafo.model.sensors import Measurement

PART_BITS = 6
HALF_STEP = 2 ** (PART_BITS - 1)
FULL = COMMAND_STEPS * 2**PART_BITS
"""A command of 1 while it is summed."""
FINE_BITS = 8
FINE = 2**FINE_BITS
"""Parts of a part that the integral is kept in."""
WIDE = 2**FRACTION_BITS
"""What the error is multiplied by, so that ``fraction_of`` keeps all bits of its product with a gain."""
SLOPE_UNIT = 65536
LARGEST_CHANGE = 8191
LARGEST_SLOPE = LARGEST_CHANGE * SLOPE_UNIT
LARGEST_EXCESS = 32 * FULL
LARGEST_INTEGRAL = 32 * FULL * FINE
SHARE = float(2**FRACTION_BITS)


class PidNumbers(NamedTuple):
    """Limits of the readings, gains as fractions of 15 bits and places, shares of filter and anti-windup in 1/2^15."""

    limits: Limits
    proportional: int
    proportional_places: int
    integral: int
    integral_places: int
    derivative: int
    derivative_places: int
    filter_share: int
    anti_windup: int


class PidCounts(NamedTuple):
    """Integral [1/256 parts], last error [counts], slope [1/65536 counts], 1 once begun, 1 while readings are sound."""

    integral: int
    error: int
    slope: int
    started: int
    sound: int


class PidRows(NamedTuple):
    """The converter, and ``PidNumbers`` without the limits, as the lanes keep them: whole numbers in floats."""

    converter: Converter
    proportional: float
    proportional_places: float
    integral: float
    integral_places: float
    derivative: float
    derivative_places: float
    filter_share: float
    anti_windup: float


class PidStateRows(NamedTuple):
    """``PidCounts`` as the lanes keep them: whole numbers in floats."""

    integral: float
    error: float
    slope: float
    started: float
    sound: float


def sample(numbers: PidNumbers, state: PidCounts, readings: Readings) -> tuple[int, PidCounts]:
    """Command in steps from -1000 to 1000 at a sample; 0, for good, once a reading was at an end of its range."""
    sound = still_sound(state.sound, readings, numbers.limits)
    error = error_of(readings, numbers.limits)
    change = limited(error - state.error, LARGEST_CHANGE) if state.started == 1 else 0
    slope = limited(
        state.slope + fraction_of(change * SLOPE_UNIT - state.slope, numbers.filter_share),
        LARGEST_SLOPE,
    )
    wide_error = error * WIDE
    integral = state.integral + shifted(fraction_of(wide_error, numbers.integral), numbers.integral_places)
    proportional = shifted(fraction_of(wide_error, numbers.proportional), numbers.proportional_places)
    derivative = shifted(fraction_of(slope, numbers.derivative), numbers.derivative_places)
    unlimited = proportional + (integral >> FINE_BITS) + derivative
    command = limited(unlimited, FULL)
    excess = limited(command - unlimited, LARGEST_EXCESS)
    integral = limited(integral + fraction_of(excess * FINE, numbers.anti_windup), LARGEST_INTEGRAL)
    after = PidCounts(integral=integral, error=error, slope=slope, started=1, sound=sound)
    return ((command + HALF_STEP) >> PART_BITS if sound == 1 else 0), after


def update(
    parameters: PidRows, state: PidStateRows, reference: float, measurement: Measurement, period: float
) -> tuple[float, PidStateRows]:
    """Command from -1 to 1 that ``sample`` gives for what the converter shows, once every ``period`` [s]."""
    converter = parameters.converter
    numbers = PidNumbers(
        limits=limits_of(converter),
        proportional=int(parameters.proportional),
        proportional_places=int(parameters.proportional_places),
        integral=int(parameters.integral),
        integral_places=int(parameters.integral_places),
        derivative=int(parameters.derivative),
        derivative_places=int(parameters.derivative_places),
        filter_share=int(parameters.filter_share),
        anti_windup=int(parameters.anti_windup),
    )
    before = PidCounts(
        integral=int(state.integral),
        error=int(state.error),
        slope=int(state.slope),
        started=int(state.started),
        sound=int(state.sound),
    )
    command, after = sample(numbers, before, read(converter, reference, measurement))
    rows = PidStateRows(
        integral=float(after.integral),
        error=float(after.error),
        slope=float(after.slope),
        started=float(after.started),
        sound=float(after.sound),
    )
    return float(command) / COMMAND_STEPS, rows


def factors(settings: Mapping[str, float], period: float, torque_step: float) -> tuple[float, ...]:
    """What the law multiplies by: error, error in the integral, slope, change of the slope, excess in the integral."""
    count = torque_step * FULL
    return (
        settings["proportional_gain"] * count,
        settings["integral_gain"] * period * count * FINE,
        settings["derivative_gain"] / period * count * (WIDE / SLOPE_UNIT),
        period / (period + settings["derivative_filter"]),
        settings["anti_windup"] * period,
    )


def prepare(settings: Mapping[str, float], period: float, torque_step: float) -> tuple[float, ...]:
    """Numbers of ``PidRows`` after the converter: settings in SI units, a period [s], a torque per count [N m]."""
    *gains, filter_share, anti_windup = factors(settings, period, torque_step)
    scaled = [number for gain in gains for number in gain_of(gain)]
    shares = [float(min(LARGEST_FRACTION, int(share * SHARE + 0.5))) for share in (filter_share, anti_windup)]
    return (*scaled, *shares)


def largest(settings: Mapping[str, float], period: float, torque_step: float) -> float:
    """The largest factor over what its number can hold [-]."""
    *gains, _, anti_windup = factors(settings, period, torque_step)
    return max(*gains, anti_windup * LARGEST_FRACTION) / LARGEST_FRACTION


_FRACTION, _PLACES = float(LARGEST_FRACTION), float(MOST_PLACES)
KIND = ControllerKind(
    name=FLOAT_KIND.name,
    summary=FLOAT_KIND.summary,
    source=FLOAT_KIND.source,
    quantities=(
        *OF_CONVERTER,
        Quantity("proportional", "", "k_p: part of a step for a count of the error", None, 0.0, _FRACTION),
        Quantity("proportional_places", "", "and the places it is shifted right by", None, 0.0, _PLACES),
        Quantity("integral", "", "k_i: fine parts for a count of the error at each sample", None, 0.0, _FRACTION),
        Quantity("integral_places", "", "and the places it is shifted right by", None, 0.0, _PLACES),
        Quantity("derivative", "", "k_d: part of a step for a change of the error", None, 0.0, _FRACTION),
        Quantity("derivative_places", "", "and the places it is shifted right by", None, 0.0, _PLACES),
        Quantity("filter_share", "", "share of a change that the slope takes at once, in 1/2^15", None, 0.0, _FRACTION),
        Quantity("anti_windup", "", "share of the excess that is pulled back, in 1/2^15", None, 0.0, _FRACTION),
    ),
    parameters=PidRows,
    initial=PidStateRows(integral=0.0, error=0.0, slope=0.0, started=0.0, sound=1.0),
    update=update,
)
_ERROR = LARGEST_READING + LARGEST_READING
LAW = FixedLaw(
    kind=KIND,
    sample=sample,
    numbers=PidNumbers,
    state_ranges={
        "integral": (-LARGEST_INTEGRAL, LARGEST_INTEGRAL),
        "error": (-_ERROR, _ERROR),
        "slope": (-LARGEST_SLOPE, LARGEST_SLOPE),
        "started": (0, 1),
        "sound": (0, 1),
    },
    prepare=prepare,
    largest=largest,
)
