"""A table of up to 32 knots, joined by straight lines and repeated: any recorded course in time."""

from typing import Annotated, NamedTuple

from ppafo.control.kind import ProfileKind
from ppafo.model.declaration import Quantity

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


def value(profile: Tabulated, time: float) -> tuple[float, float, float]:
    """Value, rate and second derivative (0 also at the corners) at a time [s] from 0 on."""
    place = time - profile.period * float(int(time / profile.period))
    segment = segment_at(profile, place)
    rate = (segment.last - segment.first) / (segment.end - segment.start)
    return profile.level + segment.first + rate * (place - segment.start), rate, 0.0


def used_knots(profile: Tabulated) -> list[tuple[float, float]]:
    """Times [s] and values, without the level, of the knots that are used."""
    knots = [(0.0, profile.value_01), *((knot.time, knot.value) for knot in profile.knots)]
    return [knot for knot in knots if knot[0] < profile.period]


def bounds(profile: Tabulated) -> tuple[float, float]:
    """The lowest and the highest value [N m or rad] of the knots that are used, with the level."""
    values = [value for _, value in used_knots(profile)]
    return profile.level + min(values), profile.level + max(values)


def _quantity(name: str) -> Quantity:
    number = int(name.rpartition("_")[2])
    if name.startswith("time"):
        return Quantity(name, "s", f"time of knot {number}, later than that of the one before", NEVER, 0.0, NEVER)
    return Quantity(name, "", f"value of knot {number}", 0.0)


KIND = ProfileKind(
    name="tabulated",
    summary="Up to 32 knots, the first at time 0, joined by straight lines and repeated.",
    quantities=(
        Quantity("level", "", "level that is added to all values", 0.0),
        Quantity("period", "s", "length of a repetition", None, 1.0e-6, 1.0e6),
        _quantity("value_01"),
        *(_quantity(f"{name}_{number:02}") for number in range(2, KNOTS + 1) for name in ("time", "value")),
    ),
    parameters=Tabulated,
    value=value,
    bounds=bounds,
)
