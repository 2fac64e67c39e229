"""Signs of faults and of no gait on whole numbers, with the levels and numbers of ``control.walking.signs``.

The sign that comes first there is the first that is looked for.
"""

from typing import NamedTuple

from ppafo.control.fixed.walking.phases import (
    LANDING,
    MID_STANCE,
    SWING,
    PhaseCounts,
    part_of,
)
from ppafo.control.fixed.walking.readings import GaitReadings
from ppafo.control.fixed.walking.traces import (
    EmptyingCounts,
    EmptyingNumbers,
    LandingCounts,
    SensorCounts,
    TraceNumbers,
)
from ppafo.control.walking import readings, signs

HELPS: int = int(signs.HELPS)
LIFTS: int = int(signs.LIFTS)
PAUSED: int = int(signs.PAUSED)
STOPPED: int = int(signs.STOPPED)
NO_SIGN: int = int(signs.NO_SIGN)
FORCE_RANGE: int = int(signs.FORCE_RANGE)
ANGLE_RANGE: int = int(signs.ANGLE_RANGE)
PRESSURE_RANGE: int = int(signs.PRESSURE_RANGE)
NO_RISE: int = int(signs.NO_RISE)
NO_FALL: int = int(signs.NO_FALL)
FROZEN_HEEL: int = int(signs.FROZEN_HEEL)
FROZEN_TOE: int = int(signs.FROZEN_TOE)
FROZEN_ANGLE: int = int(signs.FROZEN_ANGLE)
FORCE_GONE: int = int(signs.FORCE_GONE)
STILL_HEEL: int = int(signs.STILL_HEEL)
STILL_TOE: int = int(signs.STILL_TOE)
STILL_ANGLE: int = int(signs.STILL_ANGLE)
ENDLESS_PHASE: int = int(signs.ENDLESS_PHASE)
RESTLESS: int = int(signs.RESTLESS)
NO_TOES: int = int(signs.NO_TOES)
NOT_FLAT: int = int(signs.NOT_FLAT)
FLAT_ANGLE: int = int(signs.FLAT_ANGLE)
SHORT_SWING: int = int(signs.SHORT_SWING)
NO_HEEL: int = int(signs.NO_HEEL)
TOE_STRIDES: int = int(signs.TOE_STRIDES)
LATE_FORCES: int = int(signs.LATE_FORCES)

BOTH = 2
"""Sensors that are loaded where the foot stands on heel and toes."""
LATE_STRIDES: int = int(readings.LATE_STRIDES)
MOST_STRIDES = 1000
"""Strides that are counted, of those on the toes and of good ones."""
FALLS_BITS = 5
"""A reading falls that is below the slow one by more than 1/32 of itself, the 3 % of floats."""

QUARTER_BITS = 2
ALL_BUT_ONE = 3
"""Three quarters of a stride, ``readings.MOST``, are all but one of four."""


class RangeNumbers(NamedTuple):
    """Lowest and largest readings that can be, in counts; a pressure below ``thin`` can for ``thin_time`` [samples]."""

    lowest_force: int
    largest_force: int
    lowest_angle: int
    highest_angle: int
    lowest_pressure: int
    highest_pressure: int
    thin: int
    thin_time: int


class StrideNumbers(NamedTuple):
    """Fractions of the stride time [1/2^14], strides, and angles [counts] of a foot that stands flat."""

    longest_phase: int
    flat_from: int
    flat_to: int
    shortest_swing: int
    steady: int
    most_toe_strides: int
    resume_strides: int
    lowest_flat_angle: int
    highest_flat_angle: int


class StillNumbers(NamedTuple):
    """Samples and parts of a stride [1/2^14] after which a force and an angle are still, and a force that is gone.

    In counts: no force above ``largest_drop`` is below ``gone`` a sample later.
    """

    frozen: int
    dwells: int
    turns_back: int
    largest_drop: int
    gone: int


class ValveNumbers(NamedTuple):
    """Samples after which a chamber is filled, vented, vented for sure, and in which a rise is noise."""

    fill: int
    vent: int
    late_vent: int
    lasts: int


class SafetyNumbers(NamedTuple):
    """``SafetyRules`` in counts, samples, strides and fractions of the stride time, with the constants of the signs."""

    ranges: RangeNumbers
    stride: StrideNumbers
    still: StillNumbers
    valve: ValveNumbers
    stands_up: int
    trace: TraceNumbers
    emptying: EmptyingNumbers


class PressureCounts(NamedTuple):
    """Slow pressures of both chambers [counts]: above a reading that falls."""

    first: int
    second: int


class SafetyCounts(NamedTuple):
    """Level and last sign, good strides in a row (-1 after a sign), and what the signs remember.

    ``heel_seen`` and ``toe_seen`` are 1 once loaded since the strike, ``toe_strides`` those on the toes alone, and
    ``steady`` is 1 after a stride of the usual time. ``side`` is the last command, 1, -1 or 0 where it vented, and
    ``held`` for how many samples it has been that. ``thin`` is for how many the lower pressure has been too low.
    """

    level: int
    sign: int
    good_strides: int
    heel_seen: int
    toe_seen: int
    toe_strides: int
    steady: int
    side: int
    held: int
    seen: SensorCounts
    landing: LandingCounts
    emptying: EmptyingCounts
    slow: PressureCounts
    thin: int


def is_still(numbers: StillNumbers, still: int, stride: int, share: int) -> bool:
    """True where a reading was the same for too many samples: for a stride [halves], and a share of it [1/2^14]."""
    return still > numbers.frozen and still > part_of(stride, share)


def is_gone(numbers: StillNumbers, last: int, force: int) -> bool:
    """True where a force [counts] was large one sample ago and is nearly none now."""
    return last > numbers.largest_drop and force < numbers.gone


def holds_pressure(filled: int, pressure: int, slow: int) -> bool:
    """True where a vented chamber shows a pressure [counts] that does not fall."""
    return pressure > filled and slow <= pressure + (pressure >> FALLS_BITS)


def range_sign(numbers: RangeNumbers, squeezes: int, given: GaitReadings, thin: int) -> int:
    """The sign of a reading that no foot and no chamber gives; one is thin for some samples."""
    if max(given.heel, given.toe) > numbers.largest_force or min(given.heel, given.toe) < numbers.lowest_force:
        return FORCE_RANGE
    if given.angle < numbers.lowest_angle or given.angle > numbers.highest_angle:
        return ANGLE_RANGE
    if (
        min(given.pressure_1, given.pressure_2) < numbers.lowest_pressure
        or thin > numbers.thin_time
        or given.pressure_1 > numbers.highest_pressure
        or (given.pressure_2 > numbers.highest_pressure and given.angle <= squeezes)
    ):
        return PRESSURE_RANGE
    return NO_SIGN


def valve_sign(numbers: SafetyNumbers, now: SafetyCounts, phase: PhaseCounts, given: GaitReadings) -> int:
    """The sign of a pressure that is not what the valve was told long enough."""
    filled = numbers.emptying.filled
    if now.held > numbers.valve.fill and (
        (now.side > 0 and given.pressure_1 < filled) or (now.side < 0 and given.pressure_2 < filled)
    ):
        return NO_RISE
    if now.emptying.rising > numbers.valve.lasts:
        return NO_FALL
    if now.side == 0 and phase.phase == MID_STANCE and phase.heel.loaded == 1:
        if now.held > numbers.valve.late_vent and given.pressure_2 > filled:
            return NO_FALL
        if now.held > numbers.valve.vent and (
            holds_pressure(filled, given.pressure_1, now.slow.first)
            or holds_pressure(filled, given.pressure_2, now.slow.second)
        ):
            return NO_FALL
    return NO_SIGN


def frozen_sign(numbers: StillNumbers, seen: SensorCounts, before: PhaseCounts, phase: PhaseCounts) -> int:
    """The sign of a reading that does not change while another sensor goes on or off, or for most of a stride."""
    toe_changes, heel_changes = phase.toe.loaded != before.toe.loaded, phase.heel.loaded != before.heel.loaded
    if toe_changes and phase.heel.loaded == 1 and is_still(numbers, seen.heel.still, phase.stride, numbers.dwells):
        return FROZEN_HEEL
    if heel_changes and phase.toe.loaded == 1 and is_still(numbers, seen.toe.still, phase.stride, numbers.dwells):
        return FROZEN_TOE
    since = before.since_strike
    whole = (
        before.phase == SWING and phase.phase != SWING and since + since > phase.stride >> 1 and since < phase.stride
    )
    # Less than a quarter of the stride, rounded up, is left where it was the same.
    if whole and since - seen.angle.still < (since + ALL_BUT_ONE) >> QUARTER_BITS:
        return FROZEN_ANGLE
    return NO_SIGN


def still_sign(numbers: StillNumbers, seen: SensorCounts, phase: PhaseCounts) -> int:
    """The sign of a reading that does not change while another sensor moves, or where nobody stands still."""
    if phase.heel.loaded == 1 and is_still(numbers, seen.heel.still, phase.stride, numbers.dwells):
        return STILL_HEEL
    if phase.toe.loaded == 1 and is_still(numbers, seen.toe.still, phase.stride, numbers.dwells):
        return STILL_TOE
    in_stance = min(seen.angle.still, phase.since_strike)
    if phase.phase > LANDING and is_still(numbers, in_stance, phase.stride, numbers.turns_back):
        return STILL_ANGLE
    return NO_SIGN


def gait_sign(numbers: StrideNumbers, before: PhaseCounts, phase: PhaseCounts) -> int:
    """The sign of forces that do not follow each other as in a gait, at any pace."""
    longest = part_of(phase.stride, numbers.longest_phase)
    if phase.spell > longest and phase.heel.loaded + phase.toe.loaded < BOTH:
        return ENDLESS_PHASE
    returns = phase.heel.loaded > before.heel.loaded or phase.toe.loaded > before.toe.loaded
    if returns and min(before.phase, phase.phase) > SWING and before.since_strike > longest:
        return RESTLESS
    if before.phase == LANDING and phase.phase == SWING and phase.strikes > 1:
        return NO_TOES
    return NO_SIGN


def steady_sign(numbers: StrideNumbers, before: PhaseCounts, phase: PhaseCounts, angle: int) -> int:
    """The sign of forces or an angle [counts] that do not fit a stride after one that took the usual time."""
    flat = phase.since_strike > part_of(phase.stride, numbers.flat_from) and phase.since_strike <= part_of(
        phase.stride, numbers.flat_to
    )
    if flat and phase.toe.loaded == 0:
        return NOT_FLAT
    if flat and phase.heel.loaded == 1 and (angle < numbers.lowest_flat_angle or angle > numbers.highest_flat_angle):
        return FLAT_ANGLE
    if before.phase == SWING and phase.phase != SWING and before.spell <= part_of(phase.stride, numbers.shortest_swing):
        return SHORT_SWING
    return NO_HEEL if flat and phase.heel.loaded == 0 else NO_SIGN


def found_sign(
    numbers: SafetyNumbers,
    gone: bool,
    now: SafetyCounts,
    before: PhaseCounts,
    phase: PhaseCounts,
    given: GaitReadings,
) -> int:
    """The sign of a sample that comes first; ``now`` remembers the sample, a force is ``gone`` since the last."""
    sign = range_sign(numbers.ranges, numbers.emptying.squeezes, given, now.thin)
    sign = valve_sign(numbers, now, phase, given) if sign == NO_SIGN else sign
    if sign != NO_SIGN:
        return sign
    sign = frozen_sign(numbers.still, now.seen, before, phase)
    if sign == NO_SIGN and gone:
        return FORCE_GONE
    sign = still_sign(numbers.still, now.seen, phase) if sign == NO_SIGN else sign
    sign = gait_sign(numbers.stride, before, phase) if sign == NO_SIGN else sign
    sign = steady_sign(numbers.stride, before, phase, given.angle) if sign == NO_SIGN and now.steady == 1 else sign
    if sign != NO_SIGN:
        return sign
    if now.toe_strides > numbers.stride.most_toe_strides:
        return TOE_STRIDES
    return LATE_FORCES if max(now.landing.late, now.landing.late_toes) > LATE_STRIDES else NO_SIGN


def level_of(sign: int) -> int:
    """The level that a sign asks for."""
    if sign == NO_SIGN:
        return HELPS
    return STOPPED if sign <= FORCE_GONE else (PAUSED if sign < NO_HEEL else LIFTS)
