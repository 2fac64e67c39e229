"""A profile that never changes."""

from typing import NamedTuple

from ppafo.control.kind import ProfileKind
from ppafo.model.declaration import Quantity


class ConstantProfile(NamedTuple):
    """The level."""

    level: float


def value(profile: ConstantProfile, time: float) -> tuple[float, float, float]:
    """Level [N m or rad], rate 0 and second derivative 0."""
    return profile.level, 0.0, 0.0


def bounds(profile: ConstantProfile) -> tuple[float, float]:
    """The level [N m or rad], twice."""
    return profile.level, profile.level


KIND = ProfileKind(
    name="constant",
    summary="One level from beginning to end.",
    quantities=(Quantity("level", "", "the level"),),
    parameters=ConstantProfile,
    value=value,
    bounds=bounds,
    is_monotone=True,
)
