"""Gait phase estimation: interface of an estimator, and the default estimator with force thresholds."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.model.declaration import EmptyRow, Quantity
from ppafo.model.helping import LANDING
from ppafo.model.sensors import GaitMeasurement


class GaitTime(NamedTuple):
    """Time since the heel strike [s] for the requested torque, and 1 where the foot lands or is about to land."""

    since_strike: float
    lands: float


@dataclass(frozen=True, slots=True)
class TimingKind:
    """Method of estimating the gait phase.

    ``parameters`` is a NamedTuple class whose numbers are the quantities in order, ``initial`` the initial state.
    ``follow(rules, phase_rules, clock, before, phase, measurement, period)`` returns the state after a sample, with the
    phases before and after it; ``gait_time(rules, clock, phase)`` returns the present gait time.
    """

    name: str
    summary: str
    source: str
    quantities: tuple[Quantity, ...]
    parameters: type
    initial: Any
    follow: Callable[[Any, PhaseRules, Any, PhaseState, PhaseState, GaitMeasurement, float], Any]
    gait_time: Callable[[Any, Any, PhaseState], GaitTime]


def follow_thresholds(
    rules: EmptyRow,
    phase_rules: PhaseRules,
    clock: EmptyRow,
    before: PhaseState,
    phase: PhaseState,
    measurement: GaitMeasurement,
    period: float,
) -> EmptyRow:
    """Clock after a sample taken every ``period`` [s]: an empty state."""
    return clock


def threshold_time(rules: EmptyRow, clock: EmptyRow, phase: PhaseState) -> GaitTime:
    """Time since the detected heel strike [s]; the foot lands once the strike was detected."""
    return GaitTime(phase.since_strike, 1.0 if phase.phase == LANDING else 0.0)


class TimingParts(NamedTuple):
    """Functions of a gait phase estimator, as in ``TimingKind``."""

    follow: Callable[[Any, PhaseRules, Any, PhaseState, PhaseState, GaitMeasurement, float], Any]
    gait_time: Callable[[Any, Any, PhaseState], GaitTime]


class ClockParts(NamedTuple):
    """Functions and state class of a walking law that depend on its gait phase estimator."""

    timing: TimingParts
    state: Callable[..., Any]


AT_THRESHOLDS = TimingParts(follow_thresholds, threshold_time)

THRESHOLDS = TimingKind(
    name="thresholds",
    summary="The stride begins when the heel force has passed its threshold; nothing is known before it is detected.",
    source="the paper, figure 1A",
    quantities=(),
    parameters=EmptyRow,
    initial=EmptyRow(),
    follow=follow_thresholds,
    gait_time=threshold_time,
)
