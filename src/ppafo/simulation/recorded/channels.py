"""Channels of a recording that a run takes as inputs, and recordings that are refused because these are not known."""

import numpy as np

from ppafo.errors import DataError
from ppafo.signals import Recording
from ppafo.signals.faults import longest_gap

COMMAND, SUPPLY, EXTERNAL_TORQUE = "command", "supply_pressure", "external_torque"
"""Valve command [-], supply pressure [Pa absolute], torque on the vane from outside [N m]."""
DORSIFLEXION_SUPPLY = "dorsiflexion_pressure"
"""Supply pressure of chamber 2 [Pa absolute], where each chamber has a regulator of its own."""
ANGLE = "angle"
"""An angle that is an input: the vane follows it, in straight lines from sample to sample."""
PRESSURES = ("pressure_1", "pressure_2", SUPPLY, DORSIFLEXION_SUPPLY)
"""Channels of absolute pressures."""

LONGEST_GAP = 0.05
"""Seconds without a sample in which so much can happen that the inputs are not known any more, if it is a gap."""
_COMMAND_TOLERANCE = 1.0e-6
"""Command [-] beyond full opening that is taken as rounding in a file."""
_SMALLEST_ABSOLUTE = 0.3
"""Fraction of the atmosphere; an absolute pressure below it is almost surely a gauge pressure under the wrong name."""


def check_gaps(recording: Recording, file: str) -> None:
    """Raise DataError, which begins with ``file``, for a recording with a gap in which its inputs are not known."""
    gap = longest_gap(recording.time)
    if gap is not None and gap.duration > LONGEST_GAP:
        raise DataError(
            f"{file}: there is a gap of {gap.duration:.4g} s after {recording.time[gap.index]:.6g} s (sample "
            f"{gap.index + 1}), in which the inputs are not known; cut the recording there"
        )


def check_command(recording: Recording, file: str) -> None:
    """Raise DataError, which begins with ``file``, for a command outside -1 to 1."""
    command = recording[COMMAND]
    worst = int(np.argmax(np.abs(command)))
    if abs(command[worst]) > 1.0 + _COMMAND_TOLERANCE:
        raise DataError(
            f"{file}: '{COMMAND}' is {command[worst]:.6g} at {recording.time[worst]:.6g} s (sample {worst + 1}); it "
            "must be from -1 to 1, the fraction of full opening"
        )


def check_absolute(recording: Recording, atmosphere: float, file: str) -> None:
    """Raise DataError, which begins with ``file``, for pressures that cannot be absolute; ``atmosphere`` [Pa absolute].

    They lie so far below the atmosphere that they must be gauge pressures.
    """
    for name in (name for name in PRESSURES if name in recording):
        lowest = int(np.argmin(recording[name]))
        if recording[name][lowest] < _SMALLEST_ABSOLUTE * atmosphere:
            raise DataError(
                f"{file}: '{name}' is {recording[name][lowest]:.6g} Pa absolute at {recording.time[lowest]:.6g} s "
                f"(sample {lowest + 1}), far below the atmosphere; is it a gauge pressure ('{name} [psi_g]')?"
            )
