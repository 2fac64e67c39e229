"""What the safety checks of walking remember of the readings, on whole numbers: ``control.walking.readings``.

One number serves for the highest angle of a swing and then for the angle of a strike in doubt: the one ends where the
other begins. The valve only knows three commands, so that one count and the command say how long it has fed or vented.
"""

from typing import NamedTuple

from ppafo.control.fixed.arithmetic import fraction_of
from ppafo.control.fixed.walking.phases import LANDING, MID_STANCE, SWING, counted
from ppafo.control.fixed.walking.readings import TOP, GaitReadings


class TraceNumbers(NamedTuple):
    """Shares of a change that slow readings and slow pressures take at once [1/2^15], and limits of the landing.

    Angles [counts]: what the highest one loses at each sample, turned up at a strike in doubt, turned down on the
    ground, up until flat.
    """

    slow_share: int
    fall_share: int
    fades: int
    turned_up: int
    turns_down: int
    is_flat: int


class EmptyingNumbers(NamedTuple):
    """When the pressure of a vented chamber 2 rises: samples, pressures and angles [counts]."""

    follow: int
    shown: int
    rises: int
    filled: int
    compresses: int
    squeezes: int


class TraceCounts(NamedTuple):
    """The last reading of a sensor, for how many samples it has been the same, and the slow reading [counts]."""

    last: int
    still: int
    slow: int


class LandingCounts(NamedTuple):
    """Lowest angle of this swing or since the strike; highest of the swing, later that of a strike in doubt; late ones.

    ``mark`` is 0 after a strike that is in no doubt.
    """

    lowest: int
    mark: int
    late: int


class EmptyingCounts(NamedTuple):
    """Lowest pressure of chamber 2 since it was joined to the atmosphere, angle then [counts], samples above it."""

    lowest: int
    angle: int
    rising: int


MOST_LATE = 2
"""More late strides in a row than this are not counted."""


def followed(slow: int, reading: int, share: int) -> int:
    """A slow reading after a sample [counts]."""
    return max(0, min(TOP, slow + fraction_of(reading - slow, share)))


def next_trace(trace: TraceCounts, reading: int, share: int, begins: bool) -> TraceCounts:
    """What is remembered of a sensor after a sample; the first reading counts at once."""
    return TraceCounts(
        last=reading,
        still=counted(trace.still) if reading == trace.last else 0,
        slow=reading if begins else followed(trace.slow, reading, share),
    )


def next_landing(
    numbers: TraceNumbers, last: LandingCounts, slow: int, angle: int, before: int, phase: int, steady: int
) -> LandingCounts:
    """The landing after a sample, between two phases; ``angle`` and the slow one in counts, in a steady walk (1)."""
    lower = (phase == SWING) != (before == SWING) or angle < last.lowest
    lowest = angle if lower else last.lowest
    if phase == SWING:
        return LandingCounts(lowest, angle if lower else max(last.mark - numbers.fades, angle), last.late)
    doubt = last.mark
    if before == SWING:
        turned = phase == LANDING and steady == 1 and max(last.mark, slow) - angle > numbers.turned_up
        doubt = angle if turned else 0
    late = last.late
    if phase == MID_STANCE and before <= LANDING:
        is_late = before == LANDING and last.mark - angle > numbers.is_flat
        late = min(late + 1, MOST_LATE) if is_late else 0
    lands = angle > doubt + numbers.turns_down or (phase == LANDING and angle > lowest + numbers.is_flat)
    return LandingCounts(lowest, 0 if lands else doubt, late)


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
