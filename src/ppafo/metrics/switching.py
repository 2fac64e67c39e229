"""How restless a task is: switchings of the valve and oscillations of the torque."""

import numpy as np

from ppafo.metrics.metric import MetricKind
from ppafo.metrics.phases import hold, ramp
from ppafo.signals import Recording
from ppafo.signals.recording import Floats

OSCILLATION_THRESHOLD = 0.05
"""Smallest swing that counts as an oscillation, as a share of the largest absolute reference."""

_NEEDED = ("torque", "reference")


def switchings(recording: Recording) -> float:
    """Number of times the command changes its sign; a command of 0 in between does not count."""
    signs = np.sign(recording["command"])
    signs = signs[signs != 0.0]
    return float(np.count_nonzero(np.diff(signs)))


def reversals(values: Floats, swing: float) -> int:
    """Return how often a signal turns back by more than ``swing`` from its last extreme.

    Smaller wiggles, noise among them, count for nothing, however many they are. A signal that only rises or only
    falls has none.
    """
    count, direction = 0, 0
    lowest = highest = float(values[0])
    for value in values.tolist():
        if direction >= 0 and value < highest - swing:
            count += direction
            direction, lowest = -1, value
        elif direction <= 0 and value > lowest + swing:
            count -= direction
            direction, highest = 1, value
        lowest, highest = min(lowest, value), max(highest, value)
    return count


def _oscillations(recording: Recording, part: Recording | None) -> float | None:
    largest = float(np.max(np.abs(recording["reference"])))
    if part is None or largest == 0.0:
        return None
    return float(reversals(part["torque"], OSCILLATION_THRESHOLD * largest))


def oscillations_ramp(recording: Recording) -> float | None:
    """Number of torque reversals on the ramp that swing over 5 % of the largest reference."""
    return _oscillations(recording, ramp(recording))


def oscillations_hold(recording: Recording) -> float | None:
    """Number of torque reversals on the hold that swing over 5 % of the largest reference."""
    return _oscillations(recording, hold(recording))


_REVERSALS = "torque reversals of more than 5 % of the largest reference"

METRICS = (
    MetricKind("switchings", "-", "changes of sign of the command", ("command",), switchings),
    MetricKind("oscillations_ramp", "-", f"{_REVERSALS}, on the ramp", _NEEDED, oscillations_ramp),
    MetricKind("oscillations_hold", "-", f"{_REVERSALS}, on the hold", _NEEDED, oscillations_hold),
)
