"""What a way to know the time in the stride declares of itself."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from ppafo.model.declaration import Quantity


class GaitTime(NamedTuple):
    """Time since the heel strike [s] by which torque is requested, and 1 where the foot lands or is about to."""

    since_strike: float
    lands: float


@dataclass(frozen=True, slots=True)
class TimingKind:
    """A way to know the time in the stride.

    ``parameters`` is a NamedTuple class whose numbers are the quantities in order, ``initial`` the start of the state.
    ``follow(rules, phase_rules, clock, before, phase, measurement, period)`` returns the state after a sample, with
    the phases before and after it; ``gait_time(rules, clock, phase)`` where in the stride the wearer is. The safety
    checks go by the detected phases, whichever way is chosen.
    """

    name: str
    summary: str
    source: str
    quantities: tuple[Quantity, ...]
    parameters: type
    initial: Any
    follow: Callable[..., Any]
    gait_time: Callable[..., GaitTime]
