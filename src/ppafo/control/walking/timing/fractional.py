"""Fractional timing: percent of gait, with the known delays of detection taken off.

The time since the heel strike over the mean of recent stride times tells the fraction of the stride, anchored anew at
each detected event.
"""

from typing import NamedTuple

from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.control.walking.timing.clock import (
    ANCHOR_WEIGHT,
    DELAY_QUANTITIES,
    START,
    Delays,
    GaitClock,
    next_clock,
    place_in_stride,
)
from ppafo.control.walking.timing.kind import GaitTime, TimingKind
from ppafo.model.gait_sensors import GaitMeasurement


class FractionalRules(NamedTuple):
    """The known delays, and how far an event after the strike moves the clock [-]."""

    delays: Delays
    anchor_weight: float


def follow(
    rules: FractionalRules,
    phase_rules: PhaseRules,
    clock: GaitClock,
    before: PhaseState,
    phase: PhaseState,
    measurement: GaitMeasurement,
    period: float,
) -> GaitClock:
    """The clock after a sample, taken every ``period`` [s]; a detected strike sets it anew."""
    return next_clock(rules.delays, phase_rules, clock, before, phase, rules.anchor_weight, 1.0, period)


def gait_time(rules: FractionalRules, clock: GaitClock, phase: PhaseState) -> GaitTime:
    """The time since the heel strike [s], ahead by the delay of the valve."""
    return place_in_stride(clock, rules.delays.valve_delay, phase)


KIND = TimingKind(
    name="fractional",
    summary="Percent of gait: time since the heel strike over recent stride times, known delays taken off.",
    source="fractional timing, usual in the field; anchored anew at each detected event",
    quantities=(
        *DELAY_QUANTITIES,
        ANCHOR_WEIGHT,
    ),
    parameters=FractionalRules,
    initial=START,
    follow=follow,
    gait_time=gait_time,
)
