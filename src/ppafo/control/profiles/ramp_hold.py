"""Ramp and hold: the paper's torque task."""

from typing import NamedTuple

from ppafo.control.kind import ProfileKind
from ppafo.model.declaration import Quantity


class RampHold(NamedTuple):
    """Level before the ramp and after it, start of the ramp and its length [s]."""

    start_level: float
    level: float
    ramp_start: float
    ramp_time: float


def value(profile: RampHold, time: float) -> tuple[float, float, float]:
    """Value, rate and second derivative (0 also at the corners) at a time [s]."""
    gain = profile.level - profile.start_level
    progress = (time - profile.ramp_start) / profile.ramp_time
    inside = progress >= 0.0 and progress < 1.0
    fraction = max(0.0, min(1.0, progress))
    return profile.start_level + gain * fraction, (gain / profile.ramp_time if inside else 0.0), 0.0


def bounds(profile: RampHold) -> tuple[float, float]:
    """The lower and the higher level [N m or rad]."""
    return min(profile.start_level, profile.level), max(profile.start_level, profile.level)


KIND = ProfileKind(
    name="ramp_hold",
    summary="A level, a straight ramp to another level, and a hold.",
    quantities=(
        Quantity("start_level", "", "level before the ramp", 0.0),
        Quantity("level", "", "level of the hold"),
        Quantity("ramp_start", "s", "time at which the ramp starts", 0.0, 0.0, 1.0e6),
        Quantity("ramp_time", "s", "length of the ramp", 1.0, 1.0e-6, 1.0e6),
    ),
    parameters=RampHold,
    value=value,
    bounds=bounds,
    is_monotone=True,
)
