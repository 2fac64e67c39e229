"""The time since the detected heel strike, as late as it was detected."""

from typing import NamedTuple

from ppafo.control.walking import phases
from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.control.walking.timing.kind import GaitTime, TimingKind
from ppafo.model.gait_sensors import GaitMeasurement


class ThresholdRules(NamedTuple):
    """Nothing to set: the rules of the phases say it all."""


class ThresholdClock(NamedTuple):
    """Nothing to remember beside the phases."""


def follow(
    rules: ThresholdRules,
    phase_rules: PhaseRules,
    clock: ThresholdClock,
    before: PhaseState,
    phase: PhaseState,
    measurement: GaitMeasurement,
    period: float,
) -> ThresholdClock:
    """The clock after a sample, taken every ``period`` [s]: nothing."""
    return clock


def gait_time(rules: ThresholdRules, clock: ThresholdClock, phase: PhaseState) -> GaitTime:
    """The time since the detected heel strike [s]; the foot lands once that was detected."""
    return GaitTime(phase.since_strike, 1.0 if phase.phase == phases.LANDING else 0.0)


KIND = TimingKind(
    name="thresholds",
    summary="The stride begins when the heel force has passed its threshold; nothing is known before it is detected.",
    source="the paper, figure 1A",
    quantities=(),
    parameters=ThresholdRules,
    initial=ThresholdClock(),
    follow=follow,
    gait_time=gait_time,
)
