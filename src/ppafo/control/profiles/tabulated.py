"""A table of up to 32 knots, joined by straight lines and repeated: any recorded course in time."""

from typing import NamedTuple

from ppafo.control.kind import ProfileKind
from ppafo.model.declaration import Quantity

KNOTS = 32
"""Knots in the table; the first one is at time 0."""
NEVER = 1.0e6
"""Time [s] of a knot that is not used."""


class Tabulated(NamedTuple):
    """Level that is added to all values, length of a repetition [s], and the knots: times [s] and values.

    A knot at or after the end of a repetition is not used; from the last one a line leads to the first.
    """

    level: float
    period: float
    value_01: float
    time_02: float
    value_02: float
    time_03: float
    value_03: float
    time_04: float
    value_04: float
    time_05: float
    value_05: float
    time_06: float
    value_06: float
    time_07: float
    value_07: float
    time_08: float
    value_08: float
    time_09: float
    value_09: float
    time_10: float
    value_10: float
    time_11: float
    value_11: float
    time_12: float
    value_12: float
    time_13: float
    value_13: float
    time_14: float
    value_14: float
    time_15: float
    value_15: float
    time_16: float
    value_16: float
    time_17: float
    value_17: float
    time_18: float
    value_18: float
    time_19: float
    value_19: float
    time_20: float
    value_20: float
    time_21: float
    value_21: float
    time_22: float
    value_22: float
    time_23: float
    value_23: float
    time_24: float
    value_24: float
    time_25: float
    value_25: float
    time_26: float
    value_26: float
    time_27: float
    value_27: float
    time_28: float
    value_28: float
    time_29: float
    value_29: float
    time_30: float
    value_30: float
    time_31: float
    value_31: float
    time_32: float
    value_32: float


class Segment(NamedTuple):
    """A line between two knots: times [s] and values of its start and end."""

    start: float
    first: float
    end: float
    last: float


def advanced(segment: Segment, place: float, time: float, value: float) -> Segment:
    """The segment, or the next one, to the knot at ``time``, where the place [s] is not before its end."""
    passed = place >= segment.end
    return Segment(
        segment.end if passed else segment.start,
        segment.last if passed else segment.first,
        time if passed else segment.end,
        value if passed else segment.last,
    )


def segment_at(profile: Tabulated, place: float) -> Segment:
    """The segment in which a place [s] of a repetition lies; its end is later than the place."""
    segment = Segment(0.0, profile.value_01, profile.time_02, profile.value_02)
    segment = advanced(segment, place, profile.time_03, profile.value_03)
    segment = advanced(segment, place, profile.time_04, profile.value_04)
    segment = advanced(segment, place, profile.time_05, profile.value_05)
    segment = advanced(segment, place, profile.time_06, profile.value_06)
    segment = advanced(segment, place, profile.time_07, profile.value_07)
    segment = advanced(segment, place, profile.time_08, profile.value_08)
    segment = advanced(segment, place, profile.time_09, profile.value_09)
    segment = advanced(segment, place, profile.time_10, profile.value_10)
    segment = advanced(segment, place, profile.time_11, profile.value_11)
    segment = advanced(segment, place, profile.time_12, profile.value_12)
    segment = advanced(segment, place, profile.time_13, profile.value_13)
    segment = advanced(segment, place, profile.time_14, profile.value_14)
    segment = advanced(segment, place, profile.time_15, profile.value_15)
    segment = advanced(segment, place, profile.time_16, profile.value_16)
    segment = advanced(segment, place, profile.time_17, profile.value_17)
    segment = advanced(segment, place, profile.time_18, profile.value_18)
    segment = advanced(segment, place, profile.time_19, profile.value_19)
    segment = advanced(segment, place, profile.time_20, profile.value_20)
    segment = advanced(segment, place, profile.time_21, profile.value_21)
    segment = advanced(segment, place, profile.time_22, profile.value_22)
    segment = advanced(segment, place, profile.time_23, profile.value_23)
    segment = advanced(segment, place, profile.time_24, profile.value_24)
    segment = advanced(segment, place, profile.time_25, profile.value_25)
    segment = advanced(segment, place, profile.time_26, profile.value_26)
    segment = advanced(segment, place, profile.time_27, profile.value_27)
    segment = advanced(segment, place, profile.time_28, profile.value_28)
    segment = advanced(segment, place, profile.time_29, profile.value_29)
    segment = advanced(segment, place, profile.time_30, profile.value_30)
    segment = advanced(segment, place, profile.time_31, profile.value_31)
    segment = advanced(segment, place, profile.time_32, profile.value_32)
    segment = advanced(segment, place, profile.period, profile.value_01)
    is_last = segment.end >= profile.period
    return Segment(
        segment.start,
        segment.first,
        profile.period if is_last else segment.end,
        profile.value_01 if is_last else segment.last,
    )


def value(profile: Tabulated, time: float) -> tuple[float, float, float]:
    """Value, rate and second derivative (0 also at the corners) at a time [s] from 0 on."""
    place = time - profile.period * float(int(time / profile.period))
    segment = segment_at(profile, place)
    rate = (segment.last - segment.first) / (segment.end - segment.start)
    return profile.level + segment.first + rate * (place - segment.start), rate, 0.0


def used_knots(profile: Tabulated) -> list[tuple[float, float]]:
    """Times [s] and values, without the level, of the knots that are used."""
    knots = [(0.0, profile.value_01), *zip(profile[3::2], profile[4::2], strict=True)]
    return [knot for knot in knots if knot[0] < profile.period]


def bounds(profile: Tabulated) -> tuple[float, float]:
    """The lowest and the highest value of the knots that are used, with the level."""
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
        *(_quantity(name) for name in Tabulated._fields[2:]),
    ),
    parameters=Tabulated,
    value=value,
    bounds=bounds,
)
