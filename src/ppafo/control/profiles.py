"""Profiles of reference and prescribed angle: a level, ramp and hold (the paper's torque task), a sine, a table."""

from typing import Annotated, NamedTuple

from ppafo.control.kind import ProfileKind
from ppafo.model.declaration import Quantity
from ppafo.model.elementary import TURN, sine_and_cosine_of_turns


class ConstantProfile(NamedTuple):
    """The level."""

    level: float


def constant_value(profile: ConstantProfile, time: float) -> tuple[float, float, float]:
    """Level [N m or rad], rate 0 and second derivative 0."""
    return profile.level, 0.0, 0.0


def constant_bounds(profile: ConstantProfile) -> tuple[float, float]:
    """The level [N m or rad], twice."""
    return profile.level, profile.level


CONSTANT = ProfileKind(
    name="constant",
    summary="One level from beginning to end.",
    quantities=(Quantity("level", "", "the level"),),
    parameters=ConstantProfile,
    value=constant_value,
    bounds=constant_bounds,
    is_monotone=True,
)


class RampHold(NamedTuple):
    """Level before the ramp and after it, start of the ramp and its length [s]."""

    start_level: float
    level: float
    ramp_start: float
    ramp_time: float


def ramp_hold_value(profile: RampHold, time: float) -> tuple[float, float, float]:
    """Value, rate and second derivative (0 also at the corners) at a time [s]."""
    gain = profile.level - profile.start_level
    progress = (time - profile.ramp_start) / profile.ramp_time
    inside = progress >= 0.0 and progress < 1.0
    fraction = max(0.0, min(1.0, progress))
    return profile.start_level + gain * fraction, (gain / profile.ramp_time if inside else 0.0), 0.0


def ramp_hold_bounds(profile: RampHold) -> tuple[float, float]:
    """The lower and the higher level [N m or rad]."""
    return min(profile.start_level, profile.level), max(profile.start_level, profile.level)


RAMP_HOLD = ProfileKind(
    name="ramp_hold",
    summary="A level, a straight ramp to another level, and a hold.",
    quantities=(
        Quantity("start_level", "", "level before the ramp", 0.0),
        Quantity("level", "", "level of the hold"),
        Quantity("ramp_start", "s", "time at which the ramp starts", 0.0, 0.0, 1.0e6),
        Quantity("ramp_time", "s", "length of the ramp", 1.0, 1.0e-6, 1.0e6),
    ),
    parameters=RampHold,
    value=ramp_hold_value,
    bounds=ramp_hold_bounds,
    is_monotone=True,
)


class Sine(NamedTuple):
    """Mean level, amplitude, frequency [Hz] and phase [turns]."""

    level: float
    amplitude: float
    frequency: float
    phase: float


def sine_value(profile: Sine, time: float) -> tuple[float, float, float]:
    """Value, rate and second derivative at a time [s]."""
    angular = TURN * profile.frequency
    sine, cosine = sine_and_cosine_of_turns(profile.frequency * time + profile.phase)
    swing = profile.amplitude * sine
    return profile.level + swing, angular * profile.amplitude * cosine, -angular * angular * swing


def sine_bounds(profile: Sine) -> tuple[float, float]:
    """Lowest and highest sine_value [N m or rad]."""
    swing = abs(profile.amplitude)
    return profile.level - swing, profile.level + swing


SINE = ProfileKind(
    name="sine",
    summary="A sine about a mean level.",
    quantities=(
        Quantity("level", "", "mean level", 0.0),
        Quantity("amplitude", "", "amplitude"),
        Quantity("frequency", "Hz", "frequency", 1.0, 0.0, 100.0),
        Quantity("phase", "1", "phase in turns; 0.25 starts at the crest", 0.0, -1.0, 1.0),
    ),
    parameters=Sine,
    value=sine_value,
    bounds=sine_bounds,
)


KNOTS = 32
"""Knots in the table; the first one is at time 0."""
NEVER = 1.0e6
"""Time [s] of a knot that is not used."""


class Knot(NamedTuple):
    """Time [s] and value of a knot after the first one."""

    time: float
    value: float


class Tabulated(NamedTuple):
    """Level that is added to all values, length of a repetition [s], value of the first knot, and the other knots.

    A knot at or after the end of a repetition is not used; from the last one a line leads to the first.
    """

    level: float
    period: float
    value_01: float
    knots: Annotated[tuple[Knot, ...], KNOTS - 1]


class Segment(NamedTuple):
    """A line between two knots: times [s] and values of its start and end."""

    start: float
    first: float
    end: float
    last: float


def next_segment(segment: Segment, place: float, time: float, value: float) -> Segment:
    """The segment, or the next one, to the knot at ``time`` [s], where ``place`` [s] has passed its end."""
    passed = place >= segment.end
    return Segment(
        start=segment.end if passed else segment.start,
        first=segment.last if passed else segment.first,
        end=time if passed else segment.end,
        last=value if passed else segment.last,
    )


def segment_at(profile: Tabulated, place: float) -> Segment:
    """The segment in which a place [s] of a repetition lies; its end is later than the place."""
    segment = Segment(start=0.0, first=profile.value_01, end=profile.knots[0].time, last=profile.knots[0].value)
    for knot in profile.knots[1:]:
        segment = next_segment(segment, place, knot.time, knot.value)
    segment = next_segment(segment, place, profile.period, profile.value_01)
    is_last = segment.end >= profile.period
    return Segment(
        start=segment.start,
        first=segment.first,
        end=profile.period if is_last else segment.end,
        last=profile.value_01 if is_last else segment.last,
    )


def table_value(profile: Tabulated, time: float) -> tuple[float, float, float]:
    """Value, rate and second derivative (0 also at the corners) at a time [s] from 0 on."""
    place = time - profile.period * float(int(time / profile.period))
    segment = segment_at(profile, place)
    rate = (segment.last - segment.first) / (segment.end - segment.start)
    return profile.level + segment.first + rate * (place - segment.start), rate, 0.0


def used_knots(profile: Tabulated) -> list[tuple[float, float]]:
    """Times [s] and values, without the level, of the knots that are used."""
    knots = [(0.0, profile.value_01), *((knot.time, knot.value) for knot in profile.knots)]
    return [knot for knot in knots if knot[0] < profile.period]


def table_bounds(profile: Tabulated) -> tuple[float, float]:
    """The lowest and the highest value [N m or rad] of the knots that are used, with the level."""
    values = [value for _, value in used_knots(profile)]
    return profile.level + min(values), profile.level + max(values)


def _quantity(name: str) -> Quantity:
    number = int(name.rpartition("_")[2])
    if name.startswith("time"):
        return Quantity(name, "s", f"time of knot {number}, later than that of the one before", NEVER, 0.0, NEVER)
    return Quantity(name, "", f"value of knot {number}", 0.0)


TABLE = ProfileKind(
    name="tabulated",
    summary="Up to 32 knots, the first at time 0, joined by straight lines and repeated.",
    quantities=(
        Quantity("level", "", "level that is added to all values", 0.0),
        Quantity("period", "s", "length of a repetition", None, 1.0e-6, 1.0e6),
        _quantity("value_01"),
        *(_quantity(f"{name}_{number:02}") for number in range(2, KNOTS + 1) for name in ("time", "value")),
    ),
    parameters=Tabulated,
    value=table_value,
    bounds=table_bounds,
)
