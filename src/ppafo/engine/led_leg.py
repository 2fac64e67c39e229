"""A foot on a prescribed shank, without ground: the torque that it adds to an unconstrained vane.

Foot, foot plate and vane turn as one body, whose inertia the plant has; what shank, knee and weight do to it stands
here. A walk's free foot has the same physics with more around it (``scheme/walking.py``).
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ppafo.control.kind import ProfileKind
from ppafo.engine.in_python import over_samples
from ppafo.engine.program import Program
from ppafo.model.gait import ShankSeries, shank_in_gait
from ppafo.model.leg import FootLoad, ShankNow, torque_on_foot


def gait_bounds(_gait: ShankSeries) -> tuple[float, float]:
    """No bounds: a shank goes where its gait was recorded, and nothing asks for more."""
    return -math.inf, math.inf


GAIT_SHANK = ProfileKind(
    name="gait",
    summary="The shank of a gait, whose ground is left out.",
    quantities=(),
    parameters=ShankSeries,
    value=shank_in_gait,
    bounds=gait_bounds,
)
"""A shank whose knee moves too: its value is a ``ShankNow``. Any other profile leads a shank whose knee rests."""


@dataclass(frozen=True, slots=True)
class LedLeg:
    """Foot on a prescribed shank: the body that turns about the ankle, and the profile of the shank."""

    load: FootLoad
    shank: Any


def shank_at(kind: ProfileKind, shank: Any, time: float) -> ShankNow:
    """Angle [rad], rate, acceleration and knee of the shank at a time [s], by the profile or gait that leads it."""
    if kind is GAIT_SHANK:
        return shank_in_gait(shank, time)
    angle, rate, acceleration = kind.value(shank, time)
    return ShankNow(angle, rate, acceleration, knee_forward=0.0, knee_up=0.0)


def shank_over_samples(kind: ProfileKind, shank: Any, times: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> Any:
    """The shank at times [s]: a ``ShankNow`` of columns (samples,), or of one number where it is always the same."""
    if kind is GAIT_SHANK:
        return over_samples(shank_in_gait, shank, times)
    angle, rate, acceleration = over_samples(kind.value, shank, times)
    return ShankNow(angle, rate, acceleration, knee_forward=0.0, knee_up=0.0)


def torque_of_leg(program: Program, leg: LedLeg, time: float, angle: float) -> float:
    """Torque of a leg on the vane [N m] at a time [s] and an angle [rad], positive in plantarflexion."""
    assert program.shank is not None, "a leg has a shank"
    return torque_on_foot(leg.load, shank_at(program.shank, leg.shank, time), angle)
