"""How the vane moves."""

import numpy as np

from ppafo.metrics.metric import MetricKind
from ppafo.signals import Recording

TRAVEL_SHARE = 0.01
"""A move has begun when this share of its travel is done, and has arrived when this share is left."""

_STANDSTILL = 1.0e-6


def angle_range(recording: Recording) -> float:
    """Largest angle less smallest angle [rad]."""
    return float(np.ptp(recording["angle"]))


def largest_speed(recording: Recording) -> float:
    """Largest absolute angular velocity [rad/s]."""
    return float(np.max(np.abs(recording["angular_velocity"])))


def _time_of_share(recording: Recording, share: float) -> float | None:
    """Return the time [s] at which a share of the way from the first to the last angle is first done, by a line."""
    travelled = recording["angle"] - recording["angle"][0]
    if abs(travelled[-1]) < _STANDSTILL:
        return None
    done = travelled / travelled[-1]
    after = int(np.flatnonzero(done >= share)[0])
    return float(np.interp(share, done[after - 1 : after + 1], recording.time[after - 1 : after + 1]))


def departure_time(recording: Recording) -> float | None:
    """Time [s] at which 1 % of the way from the first to the last angle is done; None without a move."""
    return _time_of_share(recording, TRAVEL_SHARE)


def arrival_time(recording: Recording) -> float | None:
    """Time [s] at which 99 % of the way from the first to the last angle is done; None without a move."""
    return _time_of_share(recording, 1.0 - TRAVEL_SHARE)


METRICS = (
    MetricKind("angle_range", "rad", "largest angle less smallest angle", ("angle",), angle_range),
    MetricKind("largest_speed", "rad/s", "largest angular velocity, either way", ("angular_velocity",), largest_speed),
    MetricKind("departure_time", "s", "time at which 1 % of the move is done", ("angle",), departure_time),
    MetricKind("arrival_time", "s", "time at which 99 % of the move is done", ("angle",), arrival_time),
)
