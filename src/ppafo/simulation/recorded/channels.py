"""Channels of a recording that a run takes as inputs, checks that these are known, and the clock of their samples."""

import numpy as np

from ppafo.errors import DataError
from ppafo.parameters.device import Device
from ppafo.signals import Recording
from ppafo.signals.faults import longest_gap
from ppafo.signals.recording import Floats

# Valve command [-], supply pressure [Pa absolute], external torque on the vane [N m].
COMMAND = "command"
SUPPLY = "supply_pressure"
EXTERNAL_TORQUE = "external_torque"
DORSIFLEXION_SUPPLY = "dorsiflexion_pressure"
"""Supply pressure of chamber 2 [Pa absolute], if each chamber has its own regulator."""
ANGLE = "angle"
"""Angle as an input: the vane follows it, linearly interpolated between samples."""
PRESSURES = ("pressure_1", "pressure_2", SUPPLY, DORSIFLEXION_SUPPLY)
"""Channels of absolute pressures."""

LONGEST_GAP = 0.05
"""Longest gap without samples [s] for which the inputs count as known."""
LONGEST_STEP = 1.0e-3
"""Averaging time of a recorded pressure or torque, and longest step of a replay [s]."""
SHORTEST_SAMPLE = 1.0e-4
"""Smallest interval of the grid to which irregular samples are assigned [s]."""
_IRREGULARITY = 0.02
"""Largest deviation of a time from a regular grid, as a fraction of the interval; clocks write rounded times."""
_COMMAND_TOLERANCE = 1.0e-6
"""Command [-] beyond full opening that counts as rounding in a file."""
_BEYOND_STOPS = 0.05
"""Largest excess of a measured angle over a stop, as a fraction of the range; it is then limited to the stop."""
_SMALLEST_ABSOLUTE = 0.3
"""Fraction of atmospheric pressure [-] below which a pressure is almost surely a mislabelled gauge pressure."""


def check_gaps(recording: Recording, file: str) -> None:
    """Raise DataError, prefixed with ``file``, for a recording with a gap too long for its inputs to be known."""
    index, duration = longest_gap(recording.time) or (0, 0.0)
    if duration > LONGEST_GAP:
        after = f"after {recording.time[index]:.6g} s (sample {index + 1})"
        raise DataError(f"{file}: there is a gap of {duration:.4g} s {after}: cut the recording there")


def check_command(recording: Recording, file: str) -> None:
    """Raise DataError, prefixed with ``file``, for a command outside -1 to 1."""
    command = recording[COMMAND]
    worst = int(np.argmax(np.abs(command)))
    if abs(command[worst]) > 1.0 + _COMMAND_TOLERANCE:
        raise DataError(f"{file}: '{COMMAND}' is {command[worst]:.6g} in sample {worst + 1}; it must be from -1 to 1")


def check_absolute(recording: Recording, atmosphere: float, file: str) -> None:
    """Raise DataError, prefixed with ``file``, for pressures that must be gauge pressures.

    They are far below ``atmosphere`` [Pa absolute].
    """
    for name in (name for name in PRESSURES if name in recording):
        lowest = int(np.argmin(recording[name]))
        if recording[name][lowest] < _SMALLEST_ABSOLUTE * atmosphere:
            raise DataError(
                f"{file}: '{name}' is {recording[name][lowest]:.6g} Pa absolute at {recording.time[lowest]:.6g} s "
                f"(sample {lowest + 1}), far below atmospheric pressure; is it a gauge pressure ('{name} [psi_g]')?"
            )


def regular_interval(time: Floats) -> float | None:
    """Return the sample interval [s] of regular samples, else None; ``time`` [s] has at least two samples."""
    interval = float(time[-1] - time[0]) / (time.size - 1)
    offsets = time - time[0] - interval * np.arange(time.size)
    return interval if float(np.abs(offsets).max()) < _IRREGULARITY * interval else None


def sample_period(time: Floats) -> float:
    """Return the sample interval [s], or the interval of the grid to which irregular samples are assigned."""
    shortest = min(max(float(np.diff(time).min()), SHORTEST_SAMPLE), LONGEST_STEP)
    return regular_interval(time) or shortest


def between_stops(angles: Floats, device: Device, file: str) -> Floats:
    """Return angles [rad], limited to the stops; DataError, prefixed with ``file``, for angles far beyond a stop."""
    lowest = device.actuator.angle_min
    highest = device.actuator.angle_max
    margin = _BEYOND_STOPS * (highest - lowest)
    worst = angles[int(np.argmax(np.maximum(lowest - angles, angles - highest)))]
    if not lowest - margin <= worst <= highest + margin:
        shown, low, high = np.degrees([worst, lowest, highest])
        is_negative = lowest - margin <= float(-angles.max()) and float(-angles.min()) <= highest + margin
        hint = (
            "; with the opposite sign all angles would lie between the stops"
            if is_negative
            else "; if the angle has another zero, give sign and offset in a column map"
        )
        raise DataError(
            f"{file}: 'angle' is {shown:.4g} deg, beyond the stops of {device.name}, {low:g} to {high:g} deg{hint}"
        )
    return np.clip(angles, lowest, highest)
