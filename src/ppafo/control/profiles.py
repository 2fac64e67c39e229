"""Profiles of a reference or a prescribed angle: constant, ramp and hold (torque task of the paper), sine, table."""

import math
from typing import Annotated, NamedTuple

from ppafo.control.kind import ProfileKind
from ppafo.model.declaration import Number, Quantity, quantities_of
from ppafo.model.elementary import TURN, sine_and_cosine_of_turns

NEVER = 1.0e6
"""Time [s] of a knot that is not used, and period of a sine that does not move."""
KNOTS = 32
"""Number of knots in the table; the first knot is at time 0."""


class ConstantProfile(NamedTuple):
    """Constant reference, in the unit of the prescribed quantity."""

    level: Annotated[float, Number("", "the level")]


def constant_value(profile: ConstantProfile, time: float) -> tuple[float, float, float]:
    """Level [N m or rad], rate 0 and second derivative 0."""
    return profile.level, 0.0, 0.0


def constant_bounds(profile: ConstantProfile) -> tuple[float, float]:
    """Lowest and highest value [N m or rad], both equal to the level."""
    return profile.level, profile.level


CONSTANT = ProfileKind(
    name="constant",
    summary="One level from beginning to end.",
    quantities=quantities_of(ConstantProfile),
    parameters=ConstantProfile,
    value=constant_value,
    bounds=constant_bounds,
    is_monotone=True,
    is_smooth=True,
)


class RampHold(NamedTuple):
    """Level before and after the ramp [N m or rad], start of the ramp [s] and duration of the ramp [s]."""

    start_level: Annotated[float, Number("", "level before the ramp", 0.0)]
    level: Annotated[float, Number("", "level of the hold")]
    ramp_start: Annotated[float, Number("s", "time at which the ramp starts", 0.0, 0.0, 1.0e6)]
    ramp_time: Annotated[float, Number("s", "length of the ramp", 1.0, 1.0e-6, 1.0e6)]


def ramp_hold_value(profile: RampHold, time: float) -> tuple[float, float, float]:
    """Value, rate and second derivative (0 also at the corners) at a time [s]."""
    gain = profile.level - profile.start_level
    progress = (time - profile.ramp_start) / profile.ramp_time
    # Half-open, so that the rate is the ramp's at its start and 0 once its end is reached.
    inside = progress >= 0.0 and progress < 1.0
    fraction = max(0.0, min(1.0, progress))
    return profile.start_level + gain * fraction, (gain / profile.ramp_time if inside else 0.0), 0.0


def ramp_hold_bounds(profile: RampHold) -> tuple[float, float]:
    """The lower and the higher level [N m or rad]."""
    return min(profile.start_level, profile.level), max(profile.start_level, profile.level)


RAMP_HOLD = ProfileKind(
    name="ramp_hold",
    summary="A level, a straight ramp to another level, and a hold.",
    quantities=quantities_of(RampHold),
    parameters=RampHold,
    value=ramp_hold_value,
    bounds=ramp_hold_bounds,
    is_monotone=True,
)


class Sine(NamedTuple):
    """Mean level, amplitude, frequency [Hz] and phase [turns]."""

    level: Annotated[float, Number("", "mean level", 0.0)]
    amplitude: Annotated[float, Number("", "amplitude")]
    frequency: Annotated[float, Number("Hz", "frequency", 1.0, 0.0, 100.0)]
    phase: Annotated[float, Number("1", "phase in turns; 0.25 starts at the crest", 0.0, -1.0, 1.0)]


def sine_value(profile: Sine, time: float) -> tuple[float, float, float]:
    """Value, rate and second derivative at a time [s]."""
    angular = TURN * profile.frequency
    sine, cosine = sine_and_cosine_of_turns(profile.frequency * time + profile.phase)
    swing = profile.amplitude * sine
    return profile.level + swing, angular * profile.amplitude * cosine, -angular * angular * swing


def sine_bounds(profile: Sine) -> tuple[float, float]:
    """Lowest and highest value [N m or rad] of a sine."""
    swing = abs(profile.amplitude)
    return profile.level - swing, profile.level + swing


def sine_period(profile: Sine) -> float:
    """Return the period of a sine [s]."""
    return 1.0 / max(profile.frequency, 1.0 / NEVER)


SINE = ProfileKind(
    name="sine",
    summary="A sine about a mean level.",
    quantities=quantities_of(Sine),
    parameters=Sine,
    value=sine_value,
    bounds=sine_bounds,
    differences=("amplitude",),
    is_smooth=True,
    period=sine_period,
)


class Knot(NamedTuple):
    """Time [s] and value of a knot; the first knot of a table is not of this class."""

    time: float
    value: float


class TabulatedProfile(NamedTuple):
    """Offset added to all values, period of the repetition [s], value of the first knot at 0 s, and the other knots.

    Knots at or after the end of the period are not used; the profile is linear from the last used knot to the first
    one.
    """

    level: float
    period: float
    value_01: float
    knots: Annotated[tuple[Knot, ...], KNOTS - 1]


class _ProfileSegment(NamedTuple):
    """Line segment between two knots: start and end times [s], and values at start and end."""

    start: float
    first: float
    end: float
    last: float


def next_segment(segment: _ProfileSegment, place: float, time: float, value: float) -> _ProfileSegment:
    """Return the segment, or the next one up to the knot at ``time`` [s] if ``place`` [s] is past the segment's end."""
    passed = place >= segment.end
    return _ProfileSegment(
        start=segment.end if passed else segment.start,
        first=segment.last if passed else segment.first,
        end=time if passed else segment.end,
        last=value if passed else segment.last,
    )


def table_value(profile: TabulatedProfile, time: float) -> tuple[float, float, float]:
    """Value, rate and second derivative (0 also at the corners) at a time [s] of 0 or later."""
    place = time - profile.period * float(int(time / profile.period))
    # Every knot is looked at: a search would branch, and 32 selects cost little in vector code.
    segment = _ProfileSegment(start=0.0, first=profile.value_01, end=profile.knots[0].time, last=profile.knots[0].value)
    for knot in profile.knots[1:]:
        segment = next_segment(segment, place, knot.time, knot.value)
    segment = next_segment(segment, place, profile.period, profile.value_01)
    # An unused knot lies at or beyond the end of a repetition: the line then ends at the first knot of the next.
    is_last = segment.end >= profile.period
    end = profile.period if is_last else segment.end
    last = profile.value_01 if is_last else segment.last
    rate = (last - segment.first) / (end - segment.start)
    return profile.level + segment.first + rate * (place - segment.start), rate, 0.0


def disordered_knot(profile: TabulatedProfile) -> float:
    """Return the number of the first used knot, from 2, that is not later than the one before; 0 if there is none."""
    found = 0.0
    number = 1.0
    before = 0.0
    for knot in profile.knots:
        number = number + 1.0
        is_first = found == 0.0 and knot.time < profile.period and knot.time <= before
        found = number if is_first else found
        before = knot.time
    return found


def table_period(profile: TabulatedProfile) -> float:
    """Return the time [s] after which a table repeats."""
    return profile.period


def table_bounds(profile: TabulatedProfile) -> tuple[float, float]:
    """Lowest and highest value [N m or rad] of the used knots, with the offset ``level``."""
    lowest = profile.value_01
    highest = profile.value_01
    for knot in profile.knots:
        is_used = knot.time < profile.period
        lowest = min(lowest, knot.value) if is_used else lowest
        highest = max(highest, knot.value) if is_used else highest
    return profile.level + lowest, profile.level + highest


class _KnotWindow(NamedTuple):
    """Four consecutive knots, times [s] and values; the time of interest lies between ``start`` and ``end``."""

    earlier: Knot
    start: Knot
    end: Knot
    later: Knot


def next_window(window: _KnotWindow, place: float, knot: Knot) -> _KnotWindow:
    """Return the window, shifted by one knot to include ``knot`` if ``place`` [s] is past the window's end."""
    passed = place >= window.end.time
    earlier = window.start
    start = window.end
    end = window.later
    later = knot
    return _KnotWindow(
        earlier=Knot(
            earlier.time if passed else window.earlier.time, earlier.value if passed else window.earlier.value
        ),
        start=Knot(start.time if passed else window.start.time, start.value if passed else window.start.value),
        end=Knot(end.time if passed else window.end.time, end.value if passed else window.end.value),
        later=Knot(later.time if passed else window.later.time, later.value if passed else window.later.value),
    )


def repeated_knot(profile: TabulatedProfile, before: Knot, knot: Knot) -> Knot:
    """Return the knot, or the first or second knot of the next period if the knot lies after the end of the period."""
    is_used = knot.time < profile.period
    is_first = before.time < profile.period
    second_is_used = profile.knots[0].time < profile.period
    # Without a second knot the first one comes again a repetition later.
    second_time = profile.period + (profile.knots[0].time if second_is_used else profile.period)
    second_value = profile.knots[0].value if second_is_used else profile.value_01
    return Knot(
        knot.time if is_used else (profile.period if is_first else second_time),
        knot.value if is_used else (profile.value_01 if is_first else second_value),
    )


def window_at(profile: TabulatedProfile, place: float) -> _KnotWindow:
    """Return the knots around a time [s] within one period; the time lies before the end of the window."""
    first = Knot(0.0, profile.value_01)
    second = repeated_knot(profile, first, profile.knots[0])
    third = repeated_knot(profile, second, profile.knots[1])
    # The last knot that is used, a repetition earlier.
    time = 0.0
    value = profile.value_01
    for knot in profile.knots:
        is_used = knot.time < profile.period
        time = knot.time if is_used else time
        value = knot.value if is_used else value
    window = _KnotWindow(earlier=Knot(time - profile.period, value), start=first, end=second, later=third)
    before = third
    for knot in profile.knots[2:]:
        found = repeated_knot(profile, before, knot)
        window = next_window(window, place, found)
        before = found
    closing = repeated_knot(profile, before, Knot(profile.period, profile.value_01))
    window = next_window(window, place, closing)
    return next_window(window, place, repeated_knot(profile, closing, Knot(profile.period, profile.value_01)))


def smooth_value(profile: TabulatedProfile, time: float) -> tuple[float, float, float]:
    """Value, rate and second derivative of a cubic spline through the knots, at a time [s] of 0 or later.

    The slope at a knot is the slope of the parabola through the knot and its two neighbours, so that the rate is
    continuous.
    """
    place = time - profile.period * float(int(time / profile.period))
    at = window_at(profile, place)
    length = at.end.time - at.start.time
    chord = (at.end.value - at.start.value) / length
    # Slope of the parabola through three knots: both chords, each weighted with the other's length.
    before = (at.start.value - at.earlier.value) / (at.start.time - at.earlier.time)
    after = (at.later.value - at.end.value) / (at.later.time - at.end.time)
    slope_start = (before * length + chord * (at.start.time - at.earlier.time)) / (at.end.time - at.earlier.time)
    slope_end = (chord * (at.later.time - at.end.time) + after * length) / (at.later.time - at.start.time)
    bend = (3.0 * chord - 2.0 * slope_start - slope_end) / length
    twist = (slope_start + slope_end - 2.0 * chord) / (length * length)
    here = place - at.start.time
    value = at.start.value + here * (slope_start + here * (bend + here * twist))
    rate = slope_start + here * (2.0 * bend + 3.0 * here * twist)
    return profile.level + value, rate, 2.0 * bend + 6.0 * here * twist


def until_knot(profile: TabulatedProfile, time: float) -> float:
    """Time [s] from ``time`` (0 or later) to the next knot, where the second derivative of the cubic spline jumps."""
    place = time - profile.period * float(int(time / profile.period))
    return window_at(profile, place).end.time - place


def smooth_bounds(profile: TabulatedProfile) -> tuple[float, float]:
    """Lowest and highest value [N m or rad] of the cubic spline, which may overshoot its knots."""
    lowest, highest = table_bounds(profile)
    knots = [(0.0, profile.value_01), *((knot.time, knot.value) for knot in profile.knots)]
    knots = [knot for knot in knots if knot[0] < profile.period]
    for (start, _), (end, last) in zip(knots, [*knots[1:], (profile.period, profile.value_01)], strict=True):
        length = end - start
        value, rate, bend = smooth_value(profile, start)
        # The cubic is fixed by its start, with rate and bend, and by its end.
        twist = (profile.level + last - value - length * (rate + 0.5 * length * bend)) / length**3
        # Extremes lie at knots or where the rate of a cubic is 0: the real roots of rate + bend x + 3 twist x^2.
        square = 3.0 * twist
        inside = bend * bend - 4.0 * square * rate
        if inside < 0.0:
            continue
        # Without the difference of two numbers that may be nearly equal.
        half = -0.5 * (bend + math.copysign(math.sqrt(inside), bend))
        for numerator, denominator in ((half, square), (rate, half)):
            place = numerator / denominator if denominator != 0.0 else 0.0
            if 0.0 < place < length:
                turned = value + place * (rate + place * (0.5 * bend + place * twist))
                lowest = min(lowest, turned)
                highest = max(highest, turned)
    return lowest, highest


def _quantity(name: str) -> Quantity:
    number = int(name.rpartition("_")[2])
    if name.startswith("time"):
        return Quantity(name, "s", f"time of knot {number}, later than the one before", NEVER, 0.0, NEVER)
    return Quantity(name, "", f"value of knot {number}", 0.0)


_VALUES = tuple(f"value_{number:02}" for number in range(1, KNOTS + 1))
"""Settings for the values of the knots, relative to the level."""

TABLE = ProfileKind(
    name="tabulated",
    summary="Up to 32 knots, the first at time 0, joined by straight lines and repeated.",
    quantities=(
        Quantity("level", "", "level that is added to all values", 0.0),
        Quantity("period", "s", "length of a repetition", None, 1.0e-6, 1.0e6),
        _quantity("value_01"),
        *(_quantity(f"{name}_{number:02}") for number in range(2, KNOTS + 1) for name in ("time", "value")),
    ),
    parameters=TabulatedProfile,
    value=table_value,
    bounds=table_bounds,
    differences=_VALUES,
    period=table_period,
)

SMOOTH = ProfileKind(
    name="smooth",
    summary="Up to 32 knots, the first at time 0, joined by cubic curves without corners and repeated.",
    quantities=TABLE.quantities,
    parameters=TabulatedProfile,
    value=smooth_value,
    bounds=smooth_bounds,
    differences=_VALUES,
    is_smooth=True,
    until_jump=until_knot,
    period=table_period,
)
