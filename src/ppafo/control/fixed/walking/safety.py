"""Pause, stop and return of help on whole numbers, and what the signs remember: ``control.walking.safety``."""

from ppafo.control.fixed.arithmetic import fraction_of
from ppafo.control.fixed.walking.phases import PUSH_OFF, SWING, PhaseCounts, counted
from ppafo.control.fixed.walking.readings import GaitReadings
from ppafo.control.fixed.walking.signs import (
    ENDLESS_PHASE,
    HELPS,
    LIFTS,
    MOST_STRIDES,
    PAUSED,
    STOPPED,
    PressureCounts,
    SafetyCounts,
    SafetyNumbers,
    level_of,
)
from ppafo.control.fixed.walking.traces import followed, next_emptying, next_landing, next_sensors


def remembered(
    numbers: SafetyNumbers, state: SafetyCounts, before: PhaseCounts, phase: PhaseCounts, given: GaitReadings
) -> SafetyCounts:
    """The state with what the signs remember of a sample; the level is as it was, good strides without the sign."""
    enters = before.phase == SWING and phase.phase != SWING
    double = before.since_strike + before.since_strike
    steady, good_strides, toe_strides = state.steady, state.good_strides, state.toe_strides
    if enters:
        apart = fraction_of(phase.stride, numbers.stride.steady)
        ahead = double - phase.stride
        steady = 1 if ahead <= apart and -ahead <= apart else 0
        usual = double > phase.stride >> 1 and before.since_strike < phase.stride
        good = usual and state.heel_seen == 1 and state.toe_seen == 1
        good_strides = min(good_strides + 1, MOST_STRIDES) if good else 0
        on_toes = state.heel_seen == 0 and before.strikes > 0
        toe_strides = min(toe_strides + 1, MOST_STRIDES) if on_toes else 0
    seen = next_sensors(numbers.trace, state.seen, given, before, phase)
    is_thin = min(given.pressure_1, given.pressure_2) < numbers.ranges.thin
    return SafetyCounts(
        level=state.level,
        sign=state.sign,
        good_strides=good_strides,
        heel_seen=phase.heel.loaded if enters else max(state.heel_seen, phase.heel.loaded),
        toe_seen=phase.toe.loaded if enters else max(state.toe_seen, phase.toe.loaded),
        toe_strides=toe_strides,
        steady=steady,
        side=state.side,
        held=state.held,
        seen=seen,
        landing=next_landing(
            numbers.trace, state.landing, seen.angle.slow, given.angle, before.phase, phase.phase, steady
        ),
        emptying=next_emptying(numbers.emptying, state.emptying, state.held if state.side >= 0 else 0, given),
        slow=PressureCounts(
            followed(state.slow.first, given.pressure_1, numbers.trace.fall_share),
            followed(state.slow.second, given.pressure_2, numbers.trace.fall_share),
        ),
        thin=counted(state.thin) if is_thin else 0,
    )


def next_level(numbers: SafetyNumbers, state: SafetyCounts, good_strides: int, standing: int, sign: int) -> int:
    """The level after a sample, from good strides in a row, the samples that heel and toes have stood, and its sign."""
    level = state.level
    if level == PAUSED:
        level = LIFTS if good_strides >= 1 else level
        level = HELPS if state.sign == ENDLESS_PHASE and standing > numbers.stands_up else level
    if level < STOPPED and good_strides >= numbers.stride.resume_strides:
        level = HELPS
    return max(level, level_of(sign))


def permits(level: int, heel_seen: int, phase: int) -> bool:
    """True where the device may act in a phase: a push needs a heel that was loaded in this stance and has risen."""
    return level < PAUSED and (phase != PUSH_OFF or (level < LIFTS and heel_seen == 1))
