"""Parts of a step: each ends where something changes abruptly, and is as long as its error allows."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

SAME_INSTANT = 1.0e-9
SHORTEST_PART = 1.0e-6
"""A part [s] this short is taken as it is."""
SAFETY = 0.81
MINIMUM_ERROR = 0.2025
MAXIMUM_ERROR = 20.25
"""Errors over what is allowed at which the length of a part changes by the largest factors, 2 and 0.2."""


class Pace(NamedTuple):
    """Length [s] that the error of the last part allows the next one."""

    length: float


def until_jump(
    valve: Any,
    state: Any,
    command: float,
    time: float,
    remaining: float,
    next_event: Callable[..., float],
    settle: Callable[..., Any],
) -> float:
    """Length [s] of the part of a step that begins at ``time`` [s] with ``remaining`` [s] left of the step.

    The jumps that are due at ``time`` happen first; a jump within 1 ns of the end belongs to the next step.
    """
    settled = settle(valve, state, command, time)
    jump = next_event(valve, settled, command, time) - time
    return jump if jump < remaining - SAME_INSTANT else remaining


def part_length(pace: Pace, remaining: float) -> float:
    """Length [s] of a part: what the error allows, in equal parts where two of them reach the end."""
    halves = 0.5 * remaining if remaining < 2.0 * pace.length else pace.length
    return remaining if remaining <= pace.length else halves


def is_refused(error: float, length: float) -> bool:
    """True for a part whose error [-] over what is allowed is above 1, or no number, and that can be shorter."""
    return not error <= 1.0 and length > SHORTEST_PART


def next_pace(pace: Pace, error: float, length: float, refused: bool, longest: float) -> Pace:
    """Length of the next part after one of ``length`` [s] with an error [-]; one that an event cut says little."""
    factor = math.sqrt(SAFETY / max(MINIMUM_ERROR, min(MAXIMUM_ERROR, error)))
    wanted = length * factor
    kept = max(pace.length, wanted) if factor >= 1.0 and not refused else wanted
    return Pace(max(min(kept, longest), SHORTEST_PART))
