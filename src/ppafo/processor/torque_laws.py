"""Torque laws on whole numbers: what an integer controller declares of itself, on/off control and PID.

On/off control is equation (14), with a dead zone and hysteresis in its second form. PID is equation (13), with
anti-windup and derivative filter as options: commands are in 64 parts of a step while they are summed, the integral in
256 parts of these, the error in counts and its slope in 1/65536 counts a sample. What the float form has no limit for
is limited far out: the integral at 32 full commands, the slope at 8191 counts a sample, what anti-windup pulls back by
at 32 full commands.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from ppafo.control.controllers.feedback import PID as FLOAT_PID
from ppafo.control.controllers.switching import ON_OFF as FLOAT_ON_OFF
from ppafo.control.controllers.switching import ON_OFF_DEAD_ZONE as FLOAT_DEAD_ZONE
from ppafo.control.kind import ControllerKind
from ppafo.engine.source_text import each
from ppafo.model.declaration import Quantity
from ppafo.model.sensors import Measurement
from ppafo.processor.fixed_point import (
    COMMAND_STEPS,
    FRACTION_BITS,
    LARGEST_FRACTION,
    LARGEST_READING,
    MOST_PLACES,
    OF_LIMITS,
    OF_STEPS,
    Limits,
    Readings,
    Steps,
    converter_with,
    error_of,
    fraction_of,
    gain_of,
    limited,
    read,
    shifted,
    still_sound,
)
from ppafo.processor.planning import Numbers, fixed_point_kind

TARGETS = ("msp430f2013", "cortex-m0", "cortex-m4")
"""Processors that an integer controller can be written for."""


@dataclass(frozen=True, slots=True)
class FixedLaw:
    """The integer form of a controller of the catalogue.

    ``kind`` runs it in the lanes: its update reads the converter, calls ``sample`` and gives the command back as a
    number from -1 to 1. ``sample(numbers, state, readings)`` is the law itself, on whole numbers only: the
    command in steps and the next state. ``numbers`` is the NamedTuple class of what it is given beside readings;
    ``number_quantities`` declare the numbers, in order. The state ``begins`` so, and ``state_ranges`` has lowest and
    highest of every number of it, by its own name; its ``sound`` is what a processor reports.
    """

    kind: ControllerKind
    sample: Callable[[Any, Any, Readings], tuple[int, Any]]
    numbers: type
    number_quantities: tuple[Quantity, ...]
    begins: Any
    state_ranges: Mapping[str, tuple[int, int]]


class OnOffNumbers(NamedTuple):
    """Limits of the readings."""

    limits: Limits


class OnOffCounts(NamedTuple):
    """1 while all readings have been sound."""

    sound: int


class OnOffRows(NamedTuple):
    """Steps of the converter, and what ``on_off_sample`` is given."""

    steps: Steps
    numbers: OnOffNumbers


class DeadZoneNumbers(NamedTuple):
    """Limits of the readings; errors at which the valve opens and closes again [counts]; opening [steps]."""

    limits: Limits
    dead_zone: int
    release: int
    opening: int


class DeadZoneCounts(NamedTuple):
    """Direction in which the valve is open, 1, 0 or -1; 1 while all readings have been sound."""

    direction: int
    sound: int


class DeadZoneRows(NamedTuple):
    """Steps of the converter, and what ``dead_zone_sample`` is given."""

    steps: Steps
    numbers: DeadZoneNumbers


def on_off_sample(numbers: OnOffNumbers, state: OnOffCounts, readings: Readings) -> tuple[int, OnOffCounts]:
    """Command in steps: 1000 where the error is 0 or more, else -1000; 0, for good, after a reading at an end."""
    sound = still_sound(state.sound, readings, numbers.limits)
    command = COMMAND_STEPS if error_of(readings, numbers.limits) >= 0 else -COMMAND_STEPS
    return (command if sound == 1 else 0), OnOffCounts(sound)


def dead_zone_sample(numbers: DeadZoneNumbers, state: DeadZoneCounts, readings: Readings) -> tuple[int, DeadZoneCounts]:
    """Command in steps: the opening, towards the reference, beyond the dead zone; 0, for good, after a bad reading."""
    sound = still_sound(state.sound, readings, numbers.limits)
    error = error_of(readings, numbers.limits)
    # Hysteresis: the valve closes at the release, nearer to the reference than where it opens.
    limit_up = numbers.release if state.direction > 0 else numbers.dead_zone
    limit_down = numbers.release if state.direction < 0 else numbers.dead_zone
    direction = 1 if error > limit_up else (-1 if error < -limit_down else 0)
    opening = numbers.opening if direction > 0 else (-numbers.opening if direction < 0 else 0)
    return (opening if sound == 1 else 0), DeadZoneCounts(direction=direction, sound=sound)


def on_off_update(
    parameters: OnOffRows, state: OnOffCounts, reference: float, measurement: Measurement, period: float
) -> tuple[float, OnOffCounts]:
    """Command from -1 to 1 that ``on_off_sample`` gives for what the converter shows."""
    readings = read(converter_with(parameters.steps, parameters.numbers.limits), reference, measurement)
    command, after = on_off_sample(each(int, parameters.numbers), each(int, state), readings)
    return float(command) / COMMAND_STEPS, each(float, after)


def dead_zone_update(
    parameters: DeadZoneRows, state: DeadZoneCounts, reference: float, measurement: Measurement, period: float
) -> tuple[float, DeadZoneCounts]:
    """Command from -1 to 1 that ``dead_zone_sample`` gives for what the converter shows."""
    readings = read(converter_with(parameters.steps, parameters.numbers.limits), reference, measurement)
    command, after = dead_zone_sample(each(int, parameters.numbers), each(int, state), readings)
    return float(command) / COMMAND_STEPS, each(float, after)


def prepare_dead_zone(settings: Mapping[str, float], period: float, torque_step: float) -> tuple[float, ...]:
    """Numbers of ``DeadZoneNumbers`` after the limits, for settings in SI units and a torque per count [N m]."""
    # A release beyond the dead zone would close the valve before it opens.
    zone, release = settings["dead_zone"], min(settings["release"], settings["dead_zone"])
    counts = [float(min(LARGEST_READING, int(torque / torque_step + 0.5))) for torque in (zone, release)]
    return (*counts, float(int(settings["opening"] * COMMAND_STEPS + 0.5)))


def largest_dead_zone(settings: Mapping[str, float], period: float, torque_step: float) -> float:
    """The dead zone over what its number can hold [-]."""
    return settings["dead_zone"] / torque_step / LARGEST_READING


_READING, _STEPS = float(LARGEST_READING), float(COMMAND_STEPS)
_DEAD_ZONE_NUMBERS = (
    *OF_LIMITS,
    Quantity("dead_zone", "", "error at which the valve opens, in counts", None, 0.0, _READING),
    Quantity("release", "", "error at which it closes again, in counts", None, 0.0, _READING),
    Quantity("opening", "", "command while it is open, in steps", None, 0.0, _STEPS),
)
ON_OFF_FIXED_POINT = fixed_point_kind(
    FLOAT_ON_OFF,
    OnOffRows,
    each(float, OnOffCounts(1)),
    on_off_update,
    Numbers("on_off_fixed_point", (*OF_STEPS, *OF_LIMITS)),
)
ON_OFF = FixedLaw(
    kind=ON_OFF_FIXED_POINT,
    sample=on_off_sample,
    numbers=OnOffNumbers,
    number_quantities=OF_LIMITS,
    begins=OnOffCounts(1),
    state_ranges={"sound": (0, 1)},
)
DEAD_ZONE_FIXED_POINT = fixed_point_kind(
    FLOAT_DEAD_ZONE,
    DeadZoneRows,
    each(float, DeadZoneCounts(0, 1)),
    dead_zone_update,
    Numbers("on_off_dead_zone_fixed_point", (*OF_STEPS, *_DEAD_ZONE_NUMBERS), prepare_dead_zone, largest_dead_zone),
)
DEAD_ZONE = FixedLaw(
    kind=DEAD_ZONE_FIXED_POINT,
    sample=dead_zone_sample,
    numbers=DeadZoneNumbers,
    number_quantities=_DEAD_ZONE_NUMBERS,
    begins=DeadZoneCounts(0, 1),
    state_ranges={"direction": (-1, 1), "sound": (0, 1)},
)


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
# 8191 * 65536 is below 2^30, the largest value that `fraction_of` takes.
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
    """Steps of the converter, and what ``pid_sample`` is given."""

    steps: Steps
    numbers: PidNumbers


def pid_sample(numbers: PidNumbers, state: PidCounts, readings: Readings) -> tuple[int, PidCounts]:
    """Command in steps from -1000 to 1000 at a sample; 0, for good, once a reading was at an end of its range."""
    sound = still_sound(state.sound, readings, numbers.limits)
    error = error_of(readings, numbers.limits)
    # Without a last error there is no change: no derivative kick at the first sample.
    change = limited(error - state.error, LARGEST_CHANGE) if state.started == 1 else 0
    slope = limited(
        state.slope + fraction_of(change * SLOPE_UNIT - state.slope, numbers.filter_share),
        LARGEST_SLOPE,
    )
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
    after = PidCounts(integral=integral, error=error, slope=slope, started=1, sound=sound)
    # A half first: the shift rounds down.
    return ((command + HALF_STEP) >> PART_BITS if sound == 1 else 0), after


def pid_update(
    parameters: PidRows, state: PidCounts, reference: float, measurement: Measurement, period: float
) -> tuple[float, PidCounts]:
    """Command from -1 to 1 that ``pid_sample`` gives for what the converter shows, once every ``period`` [s]."""
    readings = read(converter_with(parameters.steps, parameters.numbers.limits), reference, measurement)
    command, after = pid_sample(each(int, parameters.numbers), each(int, state), readings)
    return float(command) / COMMAND_STEPS, each(float, after)


def pid_factors(settings: Mapping[str, float], period: float, torque_step: float) -> tuple[float, ...]:
    """What the law multiplies by: error, error in the integral, slope, change of the slope, excess in the integral."""
    # Gains of a torque [N m] and of seconds become gains of counts and samples.
    count = torque_step * FULL
    return (
        settings["proportional_gain"] * count,
        settings["integral_gain"] * period * count * FINE,
        settings["derivative_gain"] / period * count * (WIDE / SLOPE_UNIT),
        period / (period + settings["derivative_filter"]),
        settings["anti_windup"] * period,
    )


def prepare_pid(settings: Mapping[str, float], period: float, torque_step: float) -> tuple[float, ...]:
    """Numbers of ``PidNumbers`` after the limits: settings in SI units, a period [s], a torque per count [N m]."""
    *gains, filter_share, anti_windup = pid_factors(settings, period, torque_step)
    scaled = [number for gain in gains for number in gain_of(gain)]
    shares = [float(min(LARGEST_FRACTION, int(share * SHARE + 0.5))) for share in (filter_share, anti_windup)]
    return (*scaled, *shares)


def largest_pid(settings: Mapping[str, float], period: float, torque_step: float) -> float:
    """The largest factor over what its number can hold [-]."""
    *gains, _, anti_windup = pid_factors(settings, period, torque_step)
    return max(*gains, anti_windup * LARGEST_FRACTION) / LARGEST_FRACTION


_FRACTION, _PLACES = float(LARGEST_FRACTION), float(MOST_PLACES)
_PID_NUMBERS = (
    *OF_LIMITS,
    Quantity("proportional", "", "k_p: part of a step for a count of the error", None, 0.0, _FRACTION),
    Quantity("proportional_places", "", "and the places it is shifted right by", None, 0.0, _PLACES),
    Quantity("integral", "", "k_i: fine parts for a count of the error at each sample", None, 0.0, _FRACTION),
    Quantity("integral_places", "", "and the places it is shifted right by", None, 0.0, _PLACES),
    Quantity("derivative", "", "k_d: part of a step for a change of the error", None, 0.0, _FRACTION),
    Quantity("derivative_places", "", "and the places it is shifted right by", None, 0.0, _PLACES),
    Quantity("filter_share", "", "share of a change that the slope takes at once, in 1/2^15", None, 0.0, _FRACTION),
    Quantity("anti_windup", "", "share of the excess that is pulled back, in 1/2^15", None, 0.0, _FRACTION),
)
_PID_BEGINS = PidCounts(integral=0, error=0, slope=0, started=0, sound=1)
_ERROR = LARGEST_READING + LARGEST_READING
PID_FIXED_POINT = fixed_point_kind(
    FLOAT_PID,
    PidRows,
    each(float, _PID_BEGINS),
    pid_update,
    Numbers("pid_fixed_point", (*OF_STEPS, *_PID_NUMBERS), prepare_pid, largest_pid),
)
PID = FixedLaw(
    kind=PID_FIXED_POINT,
    sample=pid_sample,
    numbers=PidNumbers,
    number_quantities=_PID_NUMBERS,
    begins=_PID_BEGINS,
    state_ranges={
        "integral": (-LARGEST_INTEGRAL, LARGEST_INTEGRAL),
        "error": (-_ERROR, _ERROR),
        "slope": (-LARGEST_SLOPE, LARGEST_SLOPE),
        "started": (0, 1),
        "sound": (0, 1),
    },
)


FIXED_LAWS: dict[str, FixedLaw] = {law.kind.name: law for law in (PID, ON_OFF, DEAD_ZONE)}
