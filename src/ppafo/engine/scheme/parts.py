"""Parts of a step for a valve that jumps inside it: each part ends at the next jump or with the step."""

from collections.abc import Callable
from typing import Any

SAME_INSTANT = 1.0e-9


def part_length(
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
