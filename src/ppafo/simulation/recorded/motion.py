"""Motion with which a recording begins: value and rate of a channel at its first samples, if it does not rest."""

import math

import numpy as np

from ppafo.signals import Recording
from ppafo.signals.faults import noise_of, resolution_of
from ppafo.simulation.recorded.channels import ANGLE

_FITS = 1.0e-6
"""Rounding tolerance of the time of a start [s]."""
_WINDOWS = 8, 12, 16, 24, 32, 48, 64
"""Numbers of first samples from which the velocity of a start in motion is found."""
_FOLLOWED, _SURE, _SEEN, _LEAST_VELOCITY = 1.3, 2.0, 4.0, 0.05
"""Scatter up to which a cubic follows the samples [noises], factor of the error of its velocity, for the cubic is none
of the model, and least velocity of a motion: in such errors [-], and beyond them [rad/s]."""


def motion_at(recording: Recording, start: float) -> tuple[float, float, float] | None:
    """Return angle [rad], angular velocity and its standard error [rad/s] at a time [s]; None at rest or without angle.

    They are those of a cubic through the samples from there on, as many as it follows to their noise.
    """
    if ANGLE not in recording:
        return None
    inside = recording.time >= start - _FITS
    time, angles, noise = recording.time[inside] - start, recording[ANGLE][inside], read_error(recording, ANGLE)
    found = None
    for count in (count for count in _WINDOWS if count <= time.size):
        coefficients, covariance = np.polyfit(time[:count], angles[:count], 3, cov="unscaled")
        scatter = float(np.std(angles[:count] - np.polyval(coefficients, time[:count])))
        if found is not None and scatter > _FOLLOWED * noise:
            break
        angle, velocity = float(coefficients[3]), float(coefficients[2])
        found = angle, velocity, _SURE * max(noise, scatter) * math.sqrt(float(covariance[2, 2]))
    return found if found is not None and abs(found[1]) > _LEAST_VELOCITY + _SEEN * found[2] else None


def read_error(recording: Recording, name: str) -> float:
    """Return the standard deviation [SI] of one sample of a channel, from noise and resolution; 0 if not recorded."""
    if name not in recording:
        return 0.0
    return math.hypot(noise_of(recording[name]), resolution_of(recording[name]) / math.sqrt(12.0))
