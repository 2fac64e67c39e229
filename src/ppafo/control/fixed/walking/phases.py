"""The phases of ``control.walking.phases`` on whole numbers: forces in counts, times in samples.

Times are counted up to ``LONGEST`` samples. The stride time is kept in halves of a sample, and so are its fractions
worked out: a fraction of up to two strides has 15 bits then, and nothing takes more than 16.
"""

from typing import NamedTuple

from ppafo.control.fixed.arithmetic import FRACTION_BITS, fraction_of, nearest_fraction_of
from ppafo.control.walking import phases

LONGEST: int = 2**14 - 1
"""Samples at which counting ends, 16 s at 1 kHz."""
LONGEST_STRIDE: int = 2**13 - 1
HALVES: int = LONGEST_STRIDE + LONGEST_STRIDE
"""Longest stride time in halves of a sample."""
STRIDE_SHARE: float = 2.0 ** (FRACTION_BITS - 1)
"""What a fraction of the stride time is multiplied by to be a number of 15 bits."""
SEVERAL = 2
"""More strikes than this are not counted."""

SWING: int = int(phases.SWING)
LANDING: int = int(phases.LANDING)
MID_STANCE: int = int(phases.MID_STANCE)
PUSH_OFF: int = int(phases.PUSH_OFF)


class PhaseNumbers(NamedTuple):
    """Thresholds [counts], debounce [samples], first stride time [halves], weight [1/2^15], push-off [1/2^14]."""

    load: int
    unload: int
    debounce: int
    first_stride: int
    stride_weight: int
    push_off_start: int


class SwitchCounts(NamedTuple):
    """A debounced force sensor: loaded (1) or not, and for how many samples it has contradicted that."""

    loaded: int
    against: int


class PhaseCounts(NamedTuple):
    """Phase, switches, samples since the strike, stride time [halves of a sample], strikes up to 2.

    ``spell`` counts samples since the foot went into the air, or on heel or toes alone, or on both.
    """

    phase: int
    heel: SwitchCounts
    toe: SwitchCounts
    spell: int
    since_strike: int
    stride: int
    strikes: int


def counted(count: int) -> int:
    """One more, up to ``LONGEST``."""
    return min(count + 1, LONGEST)


def part_of(stride: int, share: int) -> int:
    """Samples that a fraction of a stride takes, for a stride in halves of a sample and the fraction in 1/2^14."""
    return fraction_of(stride, share)


def next_switch(numbers: PhaseNumbers, switch: SwitchCounts, force: int) -> SwitchCounts:
    """The switch after a sample of its force [counts]."""
    indicated = 1 if force > numbers.load else (0 if force < numbers.unload else switch.loaded)
    if indicated == switch.loaded:
        return SwitchCounts(switch.loaded, 0)
    against = counted(switch.against)
    if against < numbers.debounce:
        return SwitchCounts(switch.loaded, against)
    return SwitchCounts(indicated, 0)


def next_phase(phase: int, heel: int, toe: int, late: bool) -> int:
    """Next phase from the present one and both switches (0 or 1); ``late`` from the start of push-off on."""
    if phase == SWING:
        return LANDING if heel == 1 else (MID_STANCE if toe == 1 else SWING)
    if phase == LANDING:
        return MID_STANCE if toe == 1 else (LANDING if heel == 1 else SWING)
    if heel == 1:
        return MID_STANCE
    if toe == 0:
        return SWING
    return PUSH_OFF if phase == PUSH_OFF or late else MID_STANCE


def next_stride(numbers: PhaseNumbers, known: int, since: int) -> int:
    """The moving average [halves] after a stride of ``since`` samples; one of half or twice its length has no part."""
    taken = min(since, LONGEST_STRIDE)
    halves = taken + taken
    if halves <= known >> 1 or taken >= known:
        return known
    return max(min(known + nearest_fraction_of(halves - known, numbers.stride_weight), HALVES), 0)


def next_phase_state(numbers: PhaseNumbers, state: PhaseCounts, heel_force: int, toe_force: int) -> PhaseCounts:
    """State after a sample of both forces [counts]."""
    heel = next_switch(numbers, state.heel, heel_force)
    toe = next_switch(numbers, state.toe, toe_force)
    since = counted(state.since_strike)
    known = state.stride if state.stride > 0 else numbers.first_stride
    late = since > part_of(known, numbers.push_off_start)
    phase = next_phase(state.phase, heel.loaded, toe.loaded, late)
    strikes = state.phase == SWING and phase != SWING
    stays = (state.phase == SWING) == (phase == SWING) and (heel.loaded + toe.loaded == SEVERAL) == (
        state.heel.loaded + state.toe.loaded == SEVERAL
    )
    return PhaseCounts(
        phase=phase,
        heel=heel,
        toe=toe,
        spell=counted(state.spell) if stays else 0,
        since_strike=0 if strikes else since,
        stride=next_stride(numbers, known, since) if strikes and state.strikes > 0 else known,
        strikes=min(state.strikes + 1, SEVERAL) if strikes else state.strikes,
    )
