"""Event-based on/off control of walking on whole numbers: the law ``event_on_off``, its phases and its safety.

What the converter shows is in counts of 14 bits, whatever its own number of bits is; times are counted up to
``LONGEST`` samples. The stride time is kept in halves of a sample, and so are its fractions: a fraction of up to two
strides then has 15 bits, and no number of gait or sensors needs more than 16.

Phases, signs and levels are those of ``control.walking``; the first sign there is the first that is looked for. One
number holds the highest angle of a swing and then the angle of a strike in doubt: the one ends where the other begins.
The valve has only three commands, so that the last command and one count say for how long it has vented. What the
chambers should hold is ``chamber_observer``; it alone needs more than 16 bits.
"""

from typing import NamedTuple

from ppafo.control.fixed import chamber_observer
from ppafo.control.fixed.chamber_observer import NO_CAUSE, ObserverCounts, ObserverNumbers
from ppafo.control.fixed.whole_numbers import (
    COMMAND_STEPS,
    FRACTION_BITS,
    count_of,
    fraction_of,
    nearest_fraction_of,
)
from ppafo.control.walking import phases, signs
from ppafo.model.declaration import Quantity
from ppafo.model.sensors import GaitMeasurement

SCALE_BITS = 14


TOP: int = 2**SCALE_BITS - 1
"""Largest reading: that of a converter of 14 bits. One of fewer leaves the lowest bits 0."""


FEWEST_BITS = 8


MOST_BITS = 14


SETTINGS = (
    Quantity("converter_bits", "", "bits of the converter, whole", 10.0, float(FEWEST_BITS), float(MOST_BITS)),
    Quantity("converter_range", "Pa_a", "pressure at which it shows its largest number", 1.0e6, 1.0e4, 1.0e8),
    Quantity("force_zero", "N", "force at which the converter shows 0", -200.0, -1.0e5, 0.0),
    Quantity("force_range", "N", "force at which it shows its largest number", 3.4e3, 100.0, 1.0e6),
    Quantity("angle_range", "rad", "angle at which it shows its largest number; 0 rad is 0", 2.8, 0.1, 10.0),
)
"""What a walk says of the converter of an integer controller; 10 bits are those of an MSP430G2553."""


class GaitConverter(NamedTuple):
    """Of one count at the converter's own bits: force [N], angle [rad], pressure [Pa]; force at 0 [N]; largest, scale.

    ``scale`` is how many counts of 14 bits one of its own is.
    """

    force_step: float
    angle_step: float
    pressure_step: float
    force_zero: float
    top: float
    scale: float


class GaitReadings(NamedTuple):
    """Forces under heel and toes, ankle angle, pressures of both chambers, in counts of 14 bits."""

    heel: int
    toe: int
    angle: int
    pressure_1: int
    pressure_2: int


OF_CONVERTER = (
    Quantity("force_step", "N", "force of one count", None, 0.0),
    Quantity("angle_step", "rad", "angle of one count", None, 0.0),
    Quantity("pressure_step", "Pa_d", "pressure of one count", None, 0.0),
    Quantity("force_zero", "N", "force at a count of 0", None),
    Quantity("top", "", "largest count of the converter", None, 0.0, float(TOP)),
    Quantity("scale", "", "counts of 14 bits to one of its own", None, 1.0, 64.0),
)
"""The numbers of ``GaitConverter``, in order."""


def gait_converter(
    bits: float, pressure_range: float, force_zero: float, force_range: float, angle_range: float
) -> GaitConverter:
    """The converter with some bits; the others are what it shows as its largest number [Pa], [N], [rad]."""
    top = float(2 ** int(bits) - 1)
    return GaitConverter(
        force_step=(force_range - force_zero) / top,
        angle_step=angle_range / top,
        pressure_step=pressure_range / top,
        force_zero=force_zero,
        top=top,
        scale=float(2 ** (SCALE_BITS - int(bits))),
    )


def read_gait(converter: GaitConverter, measurement: GaitMeasurement) -> GaitReadings:
    """What a converter shows of a measurement, in counts of 14 bits."""
    zero, scale = converter.force_zero, int(converter.scale)
    return GaitReadings(
        heel=count_of(measurement.heel_force - zero, converter.force_step, converter.top) * scale,
        toe=count_of(measurement.toe_force - zero, converter.force_step, converter.top) * scale,
        angle=count_of(measurement.angle, converter.angle_step, converter.top) * scale,
        pressure_1=count_of(measurement.pressure_1, converter.pressure_step, converter.top) * scale,
        pressure_2=count_of(measurement.pressure_2, converter.pressure_step, converter.top) * scale,
    )


LONGEST: int = 2**14 - 1
"""Samples at which counting ends, 16 s at 1 kHz."""
LONGEST_STRIDE: int = 2**13 - 1
HALVES: int = LONGEST_STRIDE + LONGEST_STRIDE
"""Longest stride time in halves of a sample."""
STRIDE_SHARE: float = 2.0 ** (FRACTION_BITS - 1)
"""What a fraction of the stride time is multiplied by to be a number of 15 bits."""
SEVERAL = 2
"""More strikes than this are not counted."""

SWING: int = int(phases.SWING)
LANDING: int = int(phases.LANDING)
MID_STANCE: int = int(phases.MID_STANCE)
PUSH_OFF: int = int(phases.PUSH_OFF)

HELPS: int = int(signs.HELPS)
LIFTS: int = int(signs.LIFTS)
PAUSED: int = int(signs.PAUSED)
STOPPED: int = int(signs.STOPPED)
NO_SIGN: int = int(signs.NO_SIGN)
FORCE_RANGE: int = int(signs.FORCE_RANGE)
ANGLE_RANGE: int = int(signs.ANGLE_RANGE)
PRESSURE_RANGE: int = int(signs.PRESSURE_RANGE)
PRESSURE_SENSOR: int = int(signs.PRESSURE_SENSOR)
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


class PhaseNumbers(NamedTuple):
    """Thresholds [counts], debounce [samples], first stride time [halves], weight [1/2^15], push-off [1/2^14]."""

    load: int
    unload: int
    debounce: int
    first_stride: int
    stride_weight: int
    push_off_start: int


class SwitchCounts(NamedTuple):
    """A debounced force sensor: loaded (1) or not, and for how many samples it has contradicted that."""

    loaded: int
    against: int


class PhaseCounts(NamedTuple):
    """Phase, switches, samples since the strike, stride time [halves of a sample], strikes up to 2.

    ``spell`` counts samples since the foot went into the air, or on heel or toes alone, or on both.
    """

    phase: int
    heel: SwitchCounts
    toe: SwitchCounts
    spell: int
    since_strike: int
    stride: int
    strikes: int


def counted(count: int) -> int:
    """One more, up to ``LONGEST``."""
    return min(count + 1, LONGEST)


def part_of(stride: int, share: int) -> int:
    """Samples that a fraction of a stride takes, for a stride in halves of a sample and the fraction in 1/2^14."""
    return fraction_of(stride, share)


def next_switch(numbers: PhaseNumbers, switch: SwitchCounts, force: int) -> SwitchCounts:
    """The switch after a sample of its force [counts]."""
    indicated = 1 if force > numbers.load else (0 if force < numbers.unload else switch.loaded)
    if indicated == switch.loaded:
        return SwitchCounts(switch.loaded, 0)
    against = counted(switch.against)
    if against < numbers.debounce:
        return SwitchCounts(switch.loaded, against)
    return SwitchCounts(indicated, 0)


def next_phase(phase: int, heel: int, toe: int, late: bool) -> int:
    """Next phase from the present one and both switches (0 or 1); ``late`` from the start of push-off on."""
    if phase == SWING:
        return LANDING if heel == 1 else (MID_STANCE if toe == 1 else SWING)
    if phase == LANDING:
        return MID_STANCE if toe == 1 else (LANDING if heel == 1 else SWING)
    if heel == 1:
        return MID_STANCE
    if toe == 0:
        return SWING
    return PUSH_OFF if phase == PUSH_OFF or late else MID_STANCE


def next_stride(numbers: PhaseNumbers, known: int, since: int) -> int:
    """The moving average [halves] after a stride of ``since`` samples; one of half or twice its length has no part."""
    taken = min(since, LONGEST_STRIDE)
    halves = taken + taken
    if halves <= known >> 1 or taken >= known:
        return known
    return max(min(known + nearest_fraction_of(halves - known, numbers.stride_weight), HALVES), 0)


def next_phase_state(numbers: PhaseNumbers, state: PhaseCounts, heel_force: int, toe_force: int) -> PhaseCounts:
    """State after a sample of both forces [counts]."""
    heel = next_switch(numbers, state.heel, heel_force)
    toe = next_switch(numbers, state.toe, toe_force)
    since = counted(state.since_strike)
    known = state.stride if state.stride > 0 else numbers.first_stride
    late = since > part_of(known, numbers.push_off_start)
    phase = next_phase(state.phase, heel.loaded, toe.loaded, late)
    strikes = state.phase == SWING and phase != SWING
    stays = (state.phase == SWING) == (phase == SWING) and (heel.loaded + toe.loaded == SEVERAL) == (
        state.heel.loaded + state.toe.loaded == SEVERAL
    )
    return PhaseCounts(
        phase=phase,
        heel=heel,
        toe=toe,
        spell=counted(state.spell) if stays else 0,
        since_strike=0 if strikes else since,
        stride=next_stride(numbers, known, since) if strikes and state.strikes > 0 else known,
        strikes=min(state.strikes + 1, SEVERAL) if strikes else state.strikes,
    )


class TraceNumbers(NamedTuple):
    """Shares of a change that slow readings and slow pressures take at once [1/2^15], what moves, and the landing.

    ``lands`` is the part of a stride [1/2^14] in which who is on the heel steps; a force that is further than ``moves``
    from its slow reading moves, and an angle than ``turns`` [counts]. Angles [counts]: what the highest one loses at
    each sample, turned up at a strike in doubt, turned down on the ground, up until flat; toes that leave above
    ``toes_late`` do so late, and below ``toes_in_time`` in time.
    """

    slow_share: int
    fall_share: int
    lands: int
    moves: int
    turns: int
    fades: int
    turned_up: int
    turns_down: int
    is_flat: int
    toes_late: int
    toes_in_time: int


class TraceCounts(NamedTuple):
    """The last reading of a sensor, samples in which it was the same while something else moved, the slow one.

    Those of the angle count from the strike before.
    """

    last: int
    still: int
    slow: int


class SensorCounts(NamedTuple):
    """What is remembered of heel, toe and angle."""

    heel: TraceCounts
    toe: TraceCounts
    angle: TraceCounts


class LandingCounts(NamedTuple):
    """Lowest angle of this swing or since the strike; highest of the swing, later that of a strike in doubt; late ones.

    ``mark`` is 0 after a strike that is in no doubt; ``late_toes`` are push-offs in a row that ended late.
    """

    lowest: int
    mark: int
    late: int
    late_toes: int


MOST_LATE = 2
"""More late strides or push-offs in a row than this are not counted."""


def followed(slow: int, reading: int, share: int) -> int:
    """A slow reading after a sample [counts]."""
    return max(0, min(TOP, slow + nearest_fraction_of(reading - slow, share)))


def has_moved(reading: int, slow: int, limit: int) -> bool:
    """True where a reading is further from the slow one than a limit [counts]."""
    return reading - slow > limit or slow - reading > limit


def next_trace(last: int, still: int, reading: int, slow: int, moves: bool) -> TraceCounts:
    """What is remembered of a sensor after a sample in which something else ``moves`` or not."""
    kept = counted(still) if moves else still
    return TraceCounts(last=reading, still=kept if reading == last else 0, slow=slow)


def next_sensors(
    numbers: TraceNumbers, last: SensorCounts, given: GaitReadings, before: PhaseCounts, phase: PhaseCounts
) -> SensorCounts:
    """What is remembered of forces and angle after a sample, between two phases; the first readings count at once."""
    begins = last.angle.last == 0
    same_angle = min(last.angle.still, before.since_strike)
    heel = given.heel if begins else followed(last.heel.slow, given.heel, numbers.slow_share)
    toe = given.toe if begins else followed(last.toe.slow, given.toe, numbers.slow_share)
    angle = given.angle if begins else followed(last.angle.slow, given.angle, numbers.slow_share)
    # A landing begins with the strike, so that one count stands for the time in both.
    lands = phase.phase == LANDING and phase.since_strike <= part_of(phase.stride, numbers.lands)
    steps = phase.heel.loaded == 0 or lands
    heel_moves = has_moved(given.heel, heel, numbers.moves)
    toe_moves = has_moved(given.toe, toe, numbers.moves)
    turns = has_moved(given.angle, angle, numbers.turns)
    return SensorCounts(
        heel=next_trace(last.heel.last, last.heel.still, given.heel, heel, toe_moves or turns or steps),
        toe=next_trace(last.toe.last, last.toe.still, given.toe, toe, heel_moves or turns or steps),
        angle=next_trace(last.angle.last, same_angle, given.angle, angle, heel_moves or toe_moves or steps),
    )


def next_late_toes(numbers: TraceNumbers, last: int, angle: int, before: int, phase: int) -> int:
    """Push-offs in a row that ended late, after a sample with an angle [counts], between two phases."""
    if before != PUSH_OFF or phase != SWING:
        return last
    if angle > numbers.toes_late:
        return min(last + 1, MOST_LATE)
    return 0 if angle < numbers.toes_in_time else last


def next_landing(
    numbers: TraceNumbers, last: LandingCounts, slow: int, angle: int, before: int, phase: int, steady: int
) -> LandingCounts:
    """The landing after a sample, between two phases; ``angle`` and the slow one in counts, in a steady walk (1)."""
    lower = (phase == SWING) != (before == SWING) or angle < last.lowest
    lowest = angle if lower else last.lowest
    late_toes = next_late_toes(numbers, last.late_toes, angle, before, phase)
    if phase == SWING:
        highest = angle if lower else max(last.mark - numbers.fades, angle)
        return LandingCounts(lowest=lowest, mark=highest, late=last.late, late_toes=late_toes)
    doubt = last.mark
    if before == SWING:
        turned = phase == LANDING and steady == 1 and max(last.mark, slow) - angle > numbers.turned_up
        doubt = angle if turned else 0
    late = last.late
    if phase == MID_STANCE and before <= LANDING:
        is_late = before == LANDING and last.mark - angle > numbers.is_flat
        late = min(late + 1, MOST_LATE) if is_late else 0
    lands = angle > doubt + numbers.turns_down or (phase == LANDING and angle > lowest + numbers.is_flat)
    return LandingCounts(lowest=lowest, mark=0 if lands else doubt, late=late, late_toes=late_toes)


BOTH = 2
"""Sensors that are loaded where the foot stands on heel and toes."""
LATE_STRIDES: int = int(signs.LATE_STRIDES)
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


class VentedNumbers(NamedTuple):
    """After how many samples both chambers are vented; pressure above which one is filled [counts].

    From an angle ``squeezes`` [counts] on the ankle compresses chamber 2 to any pressure.
    """

    vent: int
    filled: int
    squeezes: int


class SafetyNumbers(NamedTuple):
    """``SafetyRules`` in counts, samples, strides and fractions of the stride time, with the constants of the signs.

    An ankle within ``rests`` [counts] of where it was on the ground rests.
    """

    ranges: RangeNumbers
    stride: StrideNumbers
    still: StillNumbers
    vented: VentedNumbers
    stands_up: int
    rests: int
    trace: TraceNumbers
    observer: ObserverNumbers


class PressureCounts(NamedTuple):
    """Slow pressures of both chambers [counts]: above a reading that falls."""

    first: int
    second: int


class SafetyCounts(NamedTuple):
    """Level and last sign, good strides in a row (-1 after a sign), and what the signs remember.

    ``heel_seen`` and ``toe_seen`` are 1 once loaded since the strike, ``toe_strides`` those on the toes alone, and
    ``steady`` is 1 after a stride of the usual time. ``side`` is the last command, 1, -1 or 0 where it vented, and
    ``held`` for how many samples it has been that. ``thin`` is for how many the lower pressure has been too low.
    ``flat_angle`` is the angle [counts] while the heel carried last, 0 once the ankle has left it.
    """

    level: int
    sign: int
    good_strides: int
    heel_seen: int
    toe_seen: int
    flat_angle: int
    toe_strides: int
    steady: int
    side: int
    held: int
    seen: SensorCounts
    landing: LandingCounts
    observer: ObserverCounts
    slow: PressureCounts
    thin: int


def is_still(numbers: StillNumbers, still: int, stride: int, share: int) -> bool:
    """True where a reading was the same for too many samples: for a stride [halves], and a share of it [1/2^14]."""
    return still > numbers.frozen and still > part_of(stride, share)


def is_gone(numbers: StillNumbers, last: int, force: int) -> bool:
    """True where a force [counts] was large one sample ago and is nearly none now."""
    return last > numbers.largest_drop and force < numbers.gone


def holds_pressure(numbers: SafetyNumbers, pressure: int, expected: int, slow: int) -> bool:
    """True where a vented chamber shows a pressure [counts] that does not fall, and that its gas does not have."""
    above = pressure - max(expected - numbers.observer.room, 0)
    return above > numbers.vented.filled and slow <= pressure + (pressure >> FALLS_BITS)


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
    """The sign of pressures that contradict what the chambers should hold.

    Where the foot stands flat, a pressure that stays in a vented chamber is one of its sensor.
    """
    cause = chamber_observer.found_cause(numbers.observer, now.observer, now.side, given.pressure_1, given.pressure_2)
    if cause != NO_CAUSE:
        return cause
    stands = now.side == 0 and phase.phase == MID_STANCE and phase.heel.loaded == 1
    if stands and now.held > numbers.vented.vent:
        first, second = now.observer.plantar.expected, now.observer.dorsal.expected
        if holds_pressure(numbers, given.pressure_1, first, now.slow.first) or holds_pressure(
            numbers, given.pressure_2, second, now.slow.second
        ):
            return PRESSURE_SENSOR
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
    sign = range_sign(numbers.ranges, numbers.vented.squeezes, given, now.thin)
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


def remembered(
    numbers: SafetyNumbers, state: SafetyCounts, before: PhaseCounts, phase: PhaseCounts, given: GaitReadings
) -> SafetyCounts:
    """The state with what the signs remember of a sample; the level is as it was, good strides without the sign."""
    enters = before.phase == SWING and phase.phase != SWING
    double = before.since_strike + before.since_strike
    steady, good_strides, toe_strides = state.steady, state.good_strides, state.toe_strides
    if enters:
        apart = fraction_of(phase.stride, numbers.stride.steady)
        ahead = double - phase.stride
        steady = 1 if ahead <= apart and -ahead <= apart else 0
        usual = double > phase.stride >> 1 and before.since_strike < phase.stride
        good = usual and state.heel_seen == 1 and state.toe_seen == 1
        good_strides = min(good_strides + 1, MOST_STRIDES) if good else 0
        on_toes = state.heel_seen == 0 and before.strikes > 0
        toe_strides = min(toe_strides + 1, MOST_STRIDES) if on_toes else 0
    seen = next_sensors(numbers.trace, state.seen, given, before, phase)
    is_thin = min(given.pressure_1, given.pressure_2) < numbers.ranges.thin
    flat = state.seen.angle.last == 0 or (phase.phase == MID_STANCE and phase.heel.loaded == 1)
    # Once it is 0, any angle that can be is further from it.
    turns = has_moved(given.angle, state.flat_angle, numbers.rests)
    return state._replace(
        good_strides=good_strides,
        heel_seen=phase.heel.loaded if enters else max(state.heel_seen, phase.heel.loaded),
        toe_seen=phase.toe.loaded if enters else max(state.toe_seen, phase.toe.loaded),
        flat_angle=given.angle if flat else (0 if turns else state.flat_angle),
        toe_strides=toe_strides,
        steady=steady,
        seen=seen,
        landing=next_landing(
            numbers.trace, state.landing, seen.angle.slow, given.angle, before.phase, phase.phase, steady
        ),
        observer=chamber_observer.next_observer(
            numbers.observer, state.observer, state.side, given.angle, given.pressure_1, given.pressure_2
        ),
        slow=PressureCounts(
            followed(state.slow.first, given.pressure_1, numbers.trace.fall_share),
            followed(state.slow.second, given.pressure_2, numbers.trace.fall_share),
        ),
        thin=counted(state.thin) if is_thin else 0,
    )


def next_level(numbers: SafetyNumbers, state: SafetyCounts, good_strides: int, standing: int, sign: int) -> int:
    """The level after a sample, from good strides in a row, the samples that heel and toes have stood, and its sign."""
    level = state.level
    if level == PAUSED:
        level = LIFTS if good_strides >= 1 else level
        level = HELPS if state.sign == ENDLESS_PHASE and standing > numbers.stands_up else level
    if level < STOPPED and good_strides >= numbers.stride.resume_strides:
        level = HELPS
    return max(level, level_of(sign))


def permits(level: int, heel_seen: int, flat_angle: int, phase: int) -> bool:
    """True where the device may act in a phase.

    A push needs a heel that was loaded in this stance and has risen; a foot that is lifted has left the ground by
    turning, for that of somebody who sits is unloaded where it stands.
    """
    if phase <= LANDING and flat_angle > 0:
        return False
    return level < PAUSED and (phase != PUSH_OFF or (level < LIFTS and heel_seen == 1))


class WalkNumbers(NamedTuple):
    """Angles above and below which the foot is lifted and let go [counts], end of push-off [1/2^14], phases, safety."""

    lifts_above: int
    lets_go_below: int
    push_off_end: int
    phase: PhaseNumbers
    safety: SafetyNumbers


class WalkCounts(NamedTuple):
    """Phase, safety, and whether the foot is to be lifted (1)."""

    phase: PhaseCounts
    safety: SafetyCounts
    lifting: int


def wanted_side(numbers: WalkNumbers, phase: PhaseCounts, lifting: int) -> int:
    """Side of the valve that the law wants: 1 plantarflexion, -1 dorsiflexion, 0 for free motion."""
    if phase.phase <= LANDING:
        return -1 if lifting == 1 or phase.phase == LANDING else 0
    in_time = phase.since_strike <= part_of(phase.stride, numbers.push_off_end)
    return 1 if phase.phase == PUSH_OFF and in_time else 0


def next_lifting(numbers: WalkNumbers, lifting: int, angle: int) -> int:
    """1 where a lifted foot is still to be lifted, at an angle [counts]."""
    if angle < numbers.lets_go_below:
        return 0
    return 1 if angle > numbers.lifts_above else lifting


def sample(numbers: WalkNumbers, state: WalkCounts, readings: GaitReadings) -> tuple[int, WalkCounts]:
    """Command in steps: 1000 plantarflexion, -1000 dorsiflexion, 0 to vent both chambers; and the next state."""
    last = state.safety
    phase = next_phase_state(numbers.phase, state.phase, readings.heel, readings.toe)
    now = remembered(numbers.safety, last, state.phase, phase, readings)
    still = numbers.safety.still
    gone = is_gone(still, last.seen.heel.last, readings.heel) or is_gone(still, last.seen.toe.last, readings.toe)
    sign = found_sign(numbers.safety, gone, now, state.phase, phase, readings)
    good_strides = now.good_strides if sign == NO_SIGN else -1
    standing = phase.spell if phase.heel.loaded + phase.toe.loaded == BOTH else 0
    level = next_level(numbers.safety, last, good_strides, standing, sign)
    lifting = next_lifting(numbers, state.lifting, readings.angle) if phase.phase <= LANDING else 0
    side = wanted_side(numbers, phase, lifting) if permits(level, now.heel_seen, now.flat_angle, phase.phase) else 0
    safety = now._replace(
        level=level,
        sign=sign if level > last.level else last.sign,
        good_strides=good_strides,
        side=side,
        held=counted(last.held) if side == last.side else 1,
    )
    command = COMMAND_STEPS if side > 0 else (-COMMAND_STEPS if side < 0 else 0)
    return command, WalkCounts(phase, safety, lifting)
