"""Metrics of the command: reversals, peak torque, and torque error of a walk.

A loop that is too fast for the dead time of its valve opens the valve fully one way and then the other. A reversal is a
command from beyond +0.5 to beyond -0.5 or back; in a walk both must be in the same task, without venting in between.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.metrics.gas import PEAKS
from ppafo.metrics.metric import MetricKind, ReadAt, metered, root_mean
from ppafo.model.helping import MID_STANCE
from ppafo.model.valves.kind import VENTS_ABOVE
from ppafo.signals import Recording
from ppafo.signals.meter import REQUESTED, WALK, MeterKind, ReferenceSummary, Sample

Masks = NDArray[np.bool_]

HALF_OPEN = 0.5
"""Command [-] above which a valve counts as open in one direction."""


class Reversals(NamedTuple):
    """State of the reversal meter: last direction (1, -1, or 0), current task, number of reversals."""

    way: float
    task: float
    turns: float


def direction_of(command: float) -> float:
    """Direction in which a command opens the valve: 1 or -1; 0 if the valve is at most half open, or vents."""
    return (1.0 if HALF_OPEN < command <= VENTS_ABOVE else 0.0) - (1.0 if command < -HALF_OPEN else 0.0)


def start_reversals(_course: ReferenceSummary, sample: Sample) -> Reversals:
    """Start the reversal meter at the first sample."""
    return Reversals(direction_of(sample.command), sample.stride.phase, 0.0)


def update_reversals(state: Reversals, _course: ReferenceSummary, sample: Sample) -> Reversals:
    """Update the reversal meter: count a change of direction within the task."""
    command = sample.command
    task = sample.stride.phase
    begins = task != state.task or command > VENTS_ABOVE
    before = 0.0 if begins else state.way
    now = direction_of(command)
    return Reversals(now if now != 0.0 else before, task, state.turns + (1.0 if before * now < 0.0 else 0.0))


REVERSALS = MeterKind("reversals", Reversals, start_reversals, update_reversals)


def command_reversals(recording: Recording) -> float:
    """Number of command reversals in a recording."""
    command = recording["command"]
    task = recording["controller_phase"] if "controller_phase" in recording else np.zeros(command.size)
    ways = np.where((command > HALF_OPEN) & (command <= VENTS_ABOVE), 1, 0) - np.where(command < -HALF_OPEN, 1, 0)
    # Each restart has a number of its own: reversals count between two ways of one number.
    begins = (np.diff(task, prepend=task[:1]) != 0.0) | (command > VENTS_ABOVE)
    number = np.cumsum(begins)
    open_at = np.flatnonzero(ways)
    turns = np.diff(ways[open_at]) != 0
    return float(np.count_nonzero(turns & (np.diff(number[open_at]) == 0)))


def peak_torque(recording: Recording) -> float:
    """Largest absolute torque of the actuator [N m]."""
    return float(np.max(np.abs(recording["torque"])))


class _RequestedTorqueSums(NamedTuple):
    """Sums over the samples with a requested torque in a walk, and the number of these samples.

    ``squares`` are squared torque errors, ``requested`` squared requested torques [N^2 m^2].
    """

    squares: float
    requested: float
    samples: float


def is_torque_requested(command: float, task: float) -> bool:
    """Return whether a walking controller requests a torque: not in mid-stance, and not while it vents."""
    return command <= VENTS_ABOVE and task != MID_STANCE


def start_requested_torque(_course: ReferenceSummary, _sample: Sample) -> _RequestedTorqueSums:
    """Start the sums of requested torque, at zero."""
    return _RequestedTorqueSums(0.0, 0.0, 0.0)


def update_requested_torque(
    state: _RequestedTorqueSums, _course: ReferenceSummary, sample: Sample
) -> _RequestedTorqueSums:
    """Update the sums of requested torque with a sample, if a torque is requested."""
    error = sample.reference - sample.torque
    counts = is_torque_requested(sample.command, sample.stride.phase)
    return _RequestedTorqueSums(
        state.squares + (error * error if counts else 0.0),
        state.requested + (sample.reference * sample.reference if counts else 0.0),
        state.samples + (1.0 if counts else 0.0),
    )


ASKED = MeterKind("asked", _RequestedTorqueSums, start_requested_torque, update_requested_torque)


def requested_samples(recording: Recording) -> Masks:
    """Mark samples with a requested torque (samples,): all of a task; in a walk by phase and command."""
    if "controller_phase" not in recording:
        return np.ones(len(recording), dtype=np.bool_)
    return np.asarray((recording["command"] <= VENTS_ABOVE) & (recording["controller_phase"] != MID_STANCE))


_REVERSED = "times that the command turns from more than half open one way to more than half open the other"
_REQUESTED = {
    "torque_error": ("squares", "requested torque less actuator torque", -1),
    "requested_torque": ("requested", "requested torque", None),
}
"""Sum of squares of each metric where the controller requests a torque, its summary, and which direction is better."""
METRICS = (
    *(
        MetricKind(
            name,
            "N m",
            f"RMS of {words} where the controller requests one",
            (),
            None,
            ReadAt((f"meters.asked.{squares}", "meters.asked.samples"), root_mean),
            (ASKED,),
            needs=(WALK, REQUESTED),
            better=better,
        )
        for name, (squares, words, better) in _REQUESTED.items()
    ),
    metered(peak_torque, "N m", "largest absolute torque of the actuator", ("torque",), (PEAKS, "torque"), better=0),
    metered(command_reversals, "-", _REVERSED, ("command",), (REVERSALS, "turns"), better=0),
)
