"""Readings that come late: the ankle tells it of the forces, the valve of the pressure. Nothing here is simulated."""

import math

import numpy as np
import pytest

from ppafo.control.walking import fault_flags, phases, safety
from ppafo.control.walking.fault_checks import SAFETY_QUANTITIES, SafetyRules
from ppafo.control.walking.phases import PHASE_QUANTITIES, DebouncedSensor, PhaseRules, PhaseState
from ppafo.control.walking.safety import SafetyState
from ppafo.engine.rows import rebuilt
from ppafo.model.helping import HELPS, LIFTS, PUSH_OFF, STOPPED, SWING
from ppafo.model.sensors import GaitMeasurement
from ppafo.model.valves.kind import VENT

RULES = rebuilt(SafetyRules, [float(item.default or 0.0) for item in SAFETY_QUANTITIES])
PHASES = PhaseRules(*[float(item.default or 0.0) for item in PHASE_QUANTITIES])
PERIOD = 1.0e-3
BEGINS = 3
"""Strides of 1 s before the forces come late."""

SHARES = (0.0, 0.06, 0.40, 0.46, 0.63, 0.80, 1.0)
ANKLE = (1.50, 1.75, 1.35, 1.33, 1.92, 1.50, 1.50)
"""Ankle angle [rad] at times after a strike [s]: it falls flat, rolls over the foot, pushes and is lifted."""


def forces(time: float, toes: float = 0.06) -> tuple[float, float]:
    """Forces [N] under heel and toes: the heel from the strike until 0.4 s, the toes from a time [s] to 0.63 s."""
    share = time % 1.0
    heel = min(4.0e3 * share, 500.0 * (1.0 - share / 0.4))
    toe = min(4.0e3 * (share - toes), 6.0e3 * (0.63 - share), 400.0 + 300.0 * share)
    return max(heel, 0.0), max(toe, 0.0)


def watched(
    late: list[float], ankle: tuple[float, ...] = ANKLE, shares: tuple[float, ...] = SHARES, toes: float = 0.06
) -> list[SafetyState]:
    """The safety state at each sample of strides of 1 s; the forces of each stride come late by a time [s]."""
    state, phase, found = safety.START, phases.START, []
    for sample in range(1000 * len(late)):
        time = sample * PERIOD
        heel, toe = forces(max(time - late[sample // 1000], 0.0), toes)
        seen = GaitMeasurement(float(np.interp(time % 1.0, shares, ankle)), 1.02e5, 1.02e5, 0.0, heel, toe)
        after = phases.timed_phase_state(PHASES, phase, heel, toe, phase.since_strike + PERIOD, PERIOD)
        state = safety.monitor(RULES, state, phase, after, seen, PERIOD)
        phase = after
        found.append(state)
    return found


@pytest.mark.parametrize("late", [0.0, 0.03])
def test_forces_in_time_are_no_sign(late: float) -> None:
    states = watched([0.0] * BEGINS + [late] * 4)
    assert {state.level for state in states} == {HELPS}


@pytest.mark.parametrize("late", [0.1, 0.15, 0.2])
def test_who_is_flat_before_the_heel_is_seen_is_lifted_and_not_pushed_after_two_strides(late: float) -> None:
    states = watched([0.0] * BEGINS + [late] * 5)
    levels = np.array([state.level for state in states])
    assert not levels[: 1000 * BEGINS].any()
    assert 0 < np.argmax(levels > HELPS) < 1000 * (BEGINS + 2.4)
    assert states[-1].finding.fault_flag == fault_flags.LATE_FORCES
    assert states[-1].level == LIFTS
    assert safety.permits(states[-1], SWING)
    assert not safety.permits(states[-1], PUSH_OFF)


def test_help_comes_back_once_the_forces_are_in_time() -> None:
    assert watched([0.0] * BEGINS + [0.1] * 3)[-1].level == LIFTS
    assert watched([0.0] * BEGINS + [0.1] * 3 + [0.0] * 4)[-1].level == HELPS


def test_one_late_strike_is_that_of_who_stops() -> None:
    assert watched([0.0] * BEGINS + [0.1] + [0.0] * 3)[-1].ventings == 0.0


def test_a_foot_that_is_still_lifted_when_it_strikes_is_no_sign() -> None:
    turning_up = (1.50, 1.75, 1.35, 1.33, 1.92, 1.75, 1.50)
    assert watched([0.0] * 7, turning_up)[-1].ventings == 0.0


def test_a_foot_that_falls_flat_after_it_was_lifted_through_its_strike_is_no_sign() -> None:
    shares = (0.0, 0.045, 0.085, 0.40, 0.46, 0.63, 0.96, 1.0)
    ankle = (1.77, 1.63, 1.69, 1.35, 1.33, 1.92, 1.85, 1.77)
    assert watched([0.0] * 7, ankle, shares, toes=0.085)[-1].ventings == 0.0


def test_a_foot_that_turns_up_slowly_before_it_lands_nearly_flat_is_no_sign() -> None:
    """One of a thousand wearers: 2 deg up in the air, and 2 more on a heel whose force rises slowly."""
    shares = (0.0, 0.025, 0.085, 0.40, 0.46, 0.63, 0.75, 0.945, 1.0)
    ankle = (1.767, 1.726, 1.613, 1.35, 1.33, 1.92, 1.478, 1.799, 1.767)
    assert watched([0.0] * 7, ankle, shares)[-1].ventings == 0.0


FED, FILLS, EMPTIES = 0.06, 4.0e6, 0.05
IN_THE_AIR = PhaseState(SWING, DebouncedSensor(0.0, 0.0), DebouncedSensor(0.0, 0.0), 0.1, 0.7, 1.0, 5.0)


def pressure(time: float) -> float:
    """Pressure of chamber 2 [Pa], fed at 4 kPa a millisecond from 0 to ``FED`` [s], and joined to the atmosphere."""
    full = 1.0e5 + FILLS * min(max(time, 0.0), FED)
    return 1.0e5 + (full - 1.0e5) * math.exp(-max(time - FED, 0.0) / EMPTIES)


def emptied(late: float, command: float = VENT, turns: float = 0.0, noise: float = 0.0) -> SafetyState:
    """The state after chamber 2 was fed and emptied; its pressure is seen late [s], the ankle turns [rad/s]."""
    stepping = safety.START.stance._replace(flat_angle=1.0, rolled=1.0)
    state, draws = safety.START._replace(stance=stepping), np.random.default_rng(1)
    for sample in range(250):
        time = sample * PERIOD
        shown = pressure(time - late) + noise * float(draws.standard_normal())
        seen = GaitMeasurement(1.5 + turns * max(time - FED, 0.0), 1.02e5, shown, 0.0, 0.0, 0.0)
        state = safety.monitor(RULES, state, IN_THE_AIR, IN_THE_AIR, seen, PERIOD)
        _, state = safety.safe_command(state, SWING, -1.0 if time < FED else command, PERIOD)
    return state


@pytest.mark.parametrize(("late", "command"), [(0.02, VENT), (0.02, 1.0), (0.03, VENT), (0.03, 0.5)])
def test_a_vented_chamber_whose_pressure_rises_stops(late: float, command: float) -> None:
    state = emptied(late, command)
    assert (state.level, state.finding.fault_flag) == (STOPPED, fault_flags.NO_FALL)


@pytest.mark.parametrize("late", [0.0, 0.005])
@pytest.mark.parametrize("noise", [0.0, 2.0e3])
def test_a_pressure_in_time_falls_with_noise_too(late: float, noise: float) -> None:
    assert emptied(late, noise=noise).level == HELPS


def test_a_foot_that_moves_long_after_pumps_gas_into_a_vented_chamber() -> None:
    state, low, high = emptied(0.0), 0.95e5, 1.4e5
    for shown in (low, *(high,) * 9):
        seen = GaitMeasurement(1.5, 1.02e5, shown, 0.0, 0.0, 0.0)
        state = safety.monitor(RULES, state, IN_THE_AIR, IN_THE_AIR, seen, PERIOD)
    assert state.level == HELPS


def test_an_ankle_that_compresses_the_chamber_may_raise_its_pressure() -> None:
    assert emptied(0.02, turns=4.0).level == HELPS
