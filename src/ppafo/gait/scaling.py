"""A gait at another walking speed: the stride gets longer or shorter in time, and every motion in it stays."""

import math
from dataclasses import replace

from ppafo.errors import DataError
from ppafo.gait.gait import Gait

LARGEST_CHANGE = 0.2
"""Fraction of the recorded speed; further away angles and moments change too much to be left as they are."""

SLOWEST_CONSTANT_WALK_RATIO = 1.03
"""Speed [m/s] below which step length over cadence is no longer constant: Murakami and Otaka (2017),
J Phys Ther Sci 29:819 (62 m/min)."""


def speed_range(gait: Gait) -> tuple[float, float]:
    """Return the lowest and highest speed [m/s] to which a gait may be scaled: 20 % about the recorded one.

    Downwards it ends at 1.03 m/s too, for a gait that was recorded faster. DataError for a gait without a speed.
    """
    recorded = _recorded_speed(gait)
    lowest = (1.0 - LARGEST_CHANGE) * recorded
    return max(lowest, min(recorded, SLOWEST_CONSTANT_WALK_RATIO)), (1.0 + LARGEST_CHANGE) * recorded


def at_speed(gait: Gait, speed: float) -> Gait:
    """Return the gait at a walking speed [m/s]: stride time goes with speed to the power of -1/2.

    That is a constant walk ratio, step length over cadence (Sekiya and Nagasaki 1998, Gait Posture 7:225). Amplitudes,
    moments per mass, force in body weights and stance fraction stay as recorded, so only a small change is allowed. So
    does the way of the knee about its mean speed; its acceleration goes with 1/T^2. DataError for a speed out of range.
    """
    recorded = _recorded_speed(gait)
    low, high = speed_range(gait)
    if not (math.isfinite(speed) and low * (1.0 - 1e-9) <= speed <= high * (1.0 + 1e-9)):
        raise DataError(
            f"gait '{gait.name}' was recorded at {recorded:g} m/s and can be scaled from {low:.3g} to {high:.3g} m/s, "
            f"not to {speed:g} m/s; import a gait that was recorded near that speed"
        )
    current = gait.walking_speed or recorded
    return replace(
        gait,
        walking_speed=speed,
        recorded_speed=recorded,
        stride_time=gait.stride_time * math.sqrt(current / speed),
        stride_time_deviation=gait.stride_time_deviation * math.sqrt(current / speed),
        knee_forward=gait.knee_forward and gait.knee_forward.scale(speed / current),
        knee_up=gait.knee_up and gait.knee_up.scale(speed / current),
    )


def _recorded_speed(gait: Gait) -> float:
    speed = gait.recorded_speed or gait.walking_speed
    if speed is None:
        raise DataError(f"gait '{gait.name}' has no walking speed, so it cannot be scaled; give one when importing it")
    return speed
