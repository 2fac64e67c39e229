"""When a controller of walking stops trusting its sensors and vents both chambers for good.

Three signs: readings that no foot gives (out of range), readings that contradict each other or the gait (a stance or a
swing without end, a stride without heel strike), and a sensor that does not change while the others do (frozen).
"""

from typing import NamedTuple

from ppafo.control.walking.phases import LANDING, MID_STANCE, SWING, PhaseState
from ppafo.model.gait_sensors import GaitMeasurement


class SafetyRules(NamedTuple):
    """Largest force [N], lowest and highest angle [rad], longest time in one phase [stride times], frozen time [s]."""

    largest_force: float
    lowest_angle: float
    highest_angle: float
    longest_phase: float
    frozen_time: float


class SafetyState(NamedTuple):
    """1 once vented; last readings; how long each has not changed [s]; 1 where this stance began on the toes."""

    vented: float
    heel_force: float
    toe_force: float
    angle: float
    heel_still: float
    toe_still: float
    angle_still: float
    toe_strides: float


START = SafetyState(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

MOST_TOE_STRIDES = 2.0
"""Strides in a row that begin on the toes before the heel sensor counts as lost."""


def still(last: float, reading: float, since: float, period: float) -> float:
    """How long a reading has been the same to the last bit [s]."""
    return since + period if reading == last else 0.0


def watched(
    rules: SafetyRules, state: SafetyState, before: PhaseState, phase: PhaseState, seen: GaitMeasurement, period: float
) -> SafetyState:
    """State after a sample; ``before`` and ``phase`` are the phases before and after it."""
    heel_still = still(state.heel_force, seen.heel_force, state.heel_still, period)
    toe_still = still(state.toe_force, seen.toe_force, state.toe_still, period)
    angle_still = still(state.angle, seen.angle, state.angle_still, period)
    largest = max(seen.heel_force, seen.toe_force)
    outside = largest > rules.largest_force or seen.angle < rules.lowest_angle or seen.angle > rules.highest_angle
    # An unloaded sensor shows the same zero for long; a loaded one never shows the same force twice for long.
    frozen_force = (heel_still > rules.frozen_time and seen.heel_force > 0.0) or (
        toe_still > rules.frozen_time and seen.toe_force > 0.0
    )
    frozen_angle = angle_still > rules.frozen_time and phase.phase != SWING
    endless = phase.in_phase > rules.longest_phase * phase.stride_time
    enters = before.phase == SWING and phase.phase != SWING
    on_toes = phase.phase == MID_STANCE
    toe_strides = (state.toe_strides + 1.0 if on_toes else 0.0) if enters else state.toe_strides
    skips_toes = before.phase == LANDING and phase.phase == SWING
    disagree = toe_strides > MOST_TOE_STRIDES or (skips_toes and phase.strikes > 1.5)
    fails = outside or frozen_force or frozen_angle or endless or disagree
    return SafetyState(
        1.0 if fails else state.vented,
        seen.heel_force,
        seen.toe_force,
        seen.angle,
        heel_still,
        toe_still,
        angle_still,
        toe_strides,
    )
