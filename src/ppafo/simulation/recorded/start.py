"""The state in which a recording begins: the first samples, averaged where it begins at rest."""

from dataclasses import dataclass

import numpy as np

from ppafo.errors import DataError
from ppafo.parameters.device import Device
from ppafo.signals import Recording
from ppafo.signals.recording import Floats
from ppafo.simulation.recorded.inputs import COMMAND

REST_WINDOW = 0.05
"""Seconds before the first command over which the start is averaged; short, so that no leak shows in it."""

_BEYOND_STOPS = 0.05
"""Share of the full range by which a measured angle may be beyond a stop before it is refused; then it is the stop."""


@dataclass(frozen=True, slots=True)
class Start:
    """Angle [rad], angular velocity [rad/s] and pressures [Pa absolute] at the first sample."""

    angle: float
    angular_velocity: float
    pressure_1: float
    pressure_2: float


def samples_at_rest(recording: Recording) -> int:
    """Return the samples before the first command, at most those of 50 ms; 1 where the valve is open from the start."""
    command, time = recording[COMMAND], recording.time
    if command[0] != 0.0:
        return 1
    quiet = command.size if not command.any() else int(np.argmax(command != 0.0))
    return max(1, min(quiet, int((time < time[0] + REST_WINDOW).sum())))


def between_stops(angles: Floats, device: Device, file: str) -> Floats:
    """Return angles [rad] as they are or, slightly beyond a stop, as the stop; DataError for those far beyond."""
    lowest, highest = device.actuator.angle_min, device.actuator.angle_max
    margin = _BEYOND_STOPS * (highest - lowest)
    worst = angles[int(np.argmax(np.maximum(lowest - angles, angles - highest)))]
    if not lowest - margin <= worst <= highest + margin:
        shown, low, high = np.degrees([worst, lowest, highest])
        raise DataError(
            f"{file}: 'angle' is {shown:.4g} deg, beyond the stops of {device.name}, {low:g} to {high:g} deg"
        )
    return np.clip(angles, lowest, highest)
