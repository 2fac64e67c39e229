"""Foot on a prescribed shank without ground contact: additional torque on an unconstrained vane.

Foot, foot plate and vane turn as one body, whose inertia is part of the plant; this module has the torques of shank,
knee and weight on this body. The free foot of a walk has the same physics among others (``scheme/walking.py``).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ppafo.control.kind import ProfileKind
from ppafo.engine.in_python import over_samples
from ppafo.engine.program import Program
from ppafo.model.gait import ShankSeries, shank_in_gait
from ppafo.model.leg import FootLoad, ShankNow, torque_on_foot

GAIT_SHANK = ProfileKind(
    name="gait",
    summary="The shank of a gait, whose ground is left out.",
    quantities=(),
    parameters=ShankSeries,
    value=shank_in_gait,
)
"""Shank with a moving knee, whose value is a ``ShankNow``; with any other profile of the shank, the knee is at rest."""


@dataclass(frozen=True, slots=True)
class LedLeg:
    """Foot on a prescribed shank: load that turns about the ankle, and profile of the shank."""

    load: FootLoad
    shank: Any


def shank_at(kind: ProfileKind, shank: Any, time: float) -> ShankNow:
    """Shank angle [rad], rate [rad/s], acceleration [rad/s^2] and knee acceleration [m/s^2] at a time [s]."""
    if kind is GAIT_SHANK:
        return shank_in_gait(shank, time)
    angle, rate, acceleration = kind.value(shank, time)
    return ShankNow(angle, rate, acceleration, knee_forward=0.0, knee_up=0.0)


def shank_over_samples(kind: ProfileKind, shank: Any, times: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> Any:
    """Shank motion at times [s]: a ``ShankNow`` of columns (samples,), or of single numbers if constant."""
    if kind is GAIT_SHANK:
        return over_samples(shank_in_gait, shank, times)
    angle, rate, acceleration = over_samples(kind.value, shank, times)
    return ShankNow(angle, rate, acceleration, knee_forward=0.0, knee_up=0.0)


def torque_of_leg(program: Program, leg: LedLeg, time: float, angle: float) -> float:
    """Torque of a leg on the vane [N m] at a time [s] and an angle [rad], positive in plantarflexion."""
    assert program.shank is not None, "a leg has a shank"
    return torque_on_foot(leg.load, shank_at(program.shank, leg.shank, time), angle)
