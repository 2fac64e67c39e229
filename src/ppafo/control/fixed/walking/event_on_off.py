"""Event-based on/off control of walking on whole numbers: the law ``event_on_off`` with phases, pause and stop."""

from typing import NamedTuple

from ppafo.control.fixed.converter import COMMAND_STEPS
from ppafo.control.fixed.walking.phases import (
    LANDING,
    PUSH_OFF,
    PhaseCounts,
    PhaseNumbers,
    counted,
    next_phase_state,
    part_of,
)
from ppafo.control.fixed.walking.readings import GaitReadings
from ppafo.control.fixed.walking.safety import next_level, permits, remembered
from ppafo.control.fixed.walking.signs import BOTH, NO_SIGN, SafetyCounts, SafetyNumbers, found_sign, is_gone


class WalkNumbers(NamedTuple):
    """Angles above and below which the foot is lifted and let go [counts], end of push-off [1/2^14], phases, safety."""

    lifts_above: int
    lets_go_below: int
    push_off_end: int
    phase: PhaseNumbers
    safety: SafetyNumbers


class WalkCounts(NamedTuple):
    """Phase, safety, and whether the foot is to be lifted (1)."""

    phase: PhaseCounts
    safety: SafetyCounts
    lifting: int


def wanted_side(numbers: WalkNumbers, phase: PhaseCounts, lifting: int) -> int:
    """Side of the valve that the law wants: 1 plantarflexion, -1 dorsiflexion, 0 for free motion."""
    if phase.phase <= LANDING:
        return -1 if lifting == 1 or phase.phase == LANDING else 0
    in_time = phase.since_strike <= part_of(phase.stride, numbers.push_off_end)
    return 1 if phase.phase == PUSH_OFF and in_time else 0


def next_lifting(numbers: WalkNumbers, lifting: int, angle: int) -> int:
    """1 where a lifted foot is still to be lifted, at an angle [counts]."""
    if angle < numbers.lets_go_below:
        return 0
    return 1 if angle > numbers.lifts_above else lifting


def sample(numbers: WalkNumbers, state: WalkCounts, readings: GaitReadings) -> tuple[int, WalkCounts]:
    """Command in steps: 1000 plantarflexion, -1000 dorsiflexion, 0 to vent both chambers; and the next state."""
    last = state.safety
    phase = next_phase_state(numbers.phase, state.phase, readings.heel, readings.toe)
    now = remembered(numbers.safety, last, state.phase, phase, readings)
    still = numbers.safety.still
    gone = is_gone(still, last.seen.heel.last, readings.heel) or is_gone(still, last.seen.toe.last, readings.toe)
    sign = found_sign(numbers.safety, gone, now, state.phase, phase, readings)
    good_strides = now.good_strides if sign == NO_SIGN else -1
    standing = phase.spell if phase.heel.loaded + phase.toe.loaded == BOTH else 0
    level = next_level(numbers.safety, last, good_strides, standing, sign)
    lifting = next_lifting(numbers, state.lifting, readings.angle) if phase.phase <= LANDING else 0
    side = wanted_side(numbers, phase, lifting) if permits(level, now.heel_seen, phase.phase) else 0
    safety = SafetyCounts(
        level=level,
        sign=sign if level > last.level else last.sign,
        good_strides=good_strides,
        heel_seen=now.heel_seen,
        toe_seen=now.toe_seen,
        toe_strides=now.toe_strides,
        steady=now.steady,
        side=side,
        held=counted(last.held) if side == last.side else 1,
        seen=now.seen,
        landing=now.landing,
        emptying=now.emptying,
        slow=now.slow,
        thin=now.thin,
    )
    command = COMMAND_STEPS if side > 0 else (-COMMAND_STEPS if side < 0 else 0)
    return command, WalkCounts(phase, safety, lifting)
