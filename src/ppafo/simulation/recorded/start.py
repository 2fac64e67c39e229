"""The state in which a recording begins: the first samples, averaged where it begins at rest."""

from dataclasses import dataclass

import numpy as np

from ppafo.signals import Recording
from ppafo.simulation.recorded.inputs import COMMAND

REST_WINDOW = 0.05
"""Seconds before the first command over which the start is averaged; short, so that no leak shows in it."""


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
