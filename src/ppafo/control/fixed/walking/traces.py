"""What the safety checks of walking remember of the readings, on whole numbers: ``control.walking.readings``.

One number serves for the highest angle of a swing and then for the angle of a strike in doubt: the one ends where the
other begins. The valve only knows three commands, so that one count and the command say how long it has fed or vented.
"""

from typing import NamedTuple

from ppafo.control.fixed.arithmetic import nearest_fraction_of
from ppafo.control.fixed.walking.phases import LANDING, MID_STANCE, PUSH_OFF, SWING, PhaseCounts, counted, part_of
from ppafo.control.fixed.walking.readings import TOP, GaitReadings


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


class EmptyingNumbers(NamedTuple):
    """When the pressure of a vented chamber 2 rises: samples, pressures and angles [counts]."""

    follow: int
    shown: int
    rises: int
    filled: int
    compresses: int
    squeezes: int


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


class EmptyingCounts(NamedTuple):
    """Lowest pressure of chamber 2 since it was joined to the atmosphere, angle then [counts], samples above it."""

    lowest: int
    angle: int
    rising: int


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


def next_emptying(numbers: EmptyingNumbers, last: EmptyingCounts, vented: int, given: GaitReadings) -> EmptyingCounts:
    """Chamber 2 after a sample, joined to the atmosphere for so many before."""
    pressure, angle = given.pressure_2, given.angle
    if vented <= numbers.follow or pressure < last.lowest:
        return EmptyingCounts(pressure, angle, 0)
    rises = (
        pressure > last.lowest + numbers.rises
        and pressure > numbers.filled
        and vented < numbers.shown
        and angle < last.angle + numbers.compresses
        and angle < numbers.squeezes
    )
    return EmptyingCounts(last.lowest, last.angle, counted(last.rising) if rises else 0)
