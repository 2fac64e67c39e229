"""Each fault flag by which a controller of walking vents the chambers, by itself: whether it pauses or stops."""

import math
from itertools import pairwise

import pytest

from ppafo.control.walking import fault_checks, fault_flags, phases, safety
from ppafo.control.walking.fault_checks import SAFETY_QUANTITIES, SafetyRules
from ppafo.control.walking.phases import DebouncedSensor, PhaseState
from ppafo.control.walking.safety import SafetyState, Stance, ValveTimes, VentingFault
from ppafo.engine.rows import leaf_paths, rebuilt
from ppafo.model.helping import HELPS, LANDING, LIFTS, MID_STANCE, PAUSED, PUSH_OFF, STOPPED, SWING
from ppafo.model.regulator import SupplyLines
from ppafo.model.sensors import GaitMeasurement
from ppafo.model.valves.kind import VENT

RULES = rebuilt(SafetyRules, [float(item.default or 0.0) for item in SAFETY_QUANTITIES])
PERIOD = 1.0e-3
GOOD = GaitMeasurement(1.5, 1.1e5, 1.05e5, 0.0, 300.0, 200.0)

STEPS = safety.START._replace(stance=safety.START.stance._replace(flat_angle=1.0, turned=1.0, rolled=1.0))
"""A foot that has turned and rolled over its toes since it stood, as one that steps."""


def phase(name: float, since: float, heel: float = 1.0, toe: float = 1.0, in_phase: float = 0.1) -> PhaseState:
    return PhaseState(name, DebouncedSensor(heel, 0.0), DebouncedSensor(toe, 0.0), in_phase, since, 1.0, 5.0)


def found(
    seen: GaitMeasurement = GOOD,
    now: PhaseState | None = None,
    before: PhaseState | None = None,
    state: SafetyState = safety.START,
    rules: SafetyRules = RULES,
) -> float:
    """The fault flag that vents at a sample, 0 where none does."""
    after = now or phase(MID_STANCE, 0.1)
    watch = safety.monitor(rules, state, before or after, after, seen, PERIOD)
    assert (watch.level > HELPS) == (watch.finding.fault_flag > fault_flags.NO_FLAG)
    assert watch.level == fault_flags.level_of(watch.finding.fault_flag)
    return watch.finding.fault_flag


def vents(
    seen: GaitMeasurement = GOOD,
    now: PhaseState | None = None,
    before: PhaseState | None = None,
    state: SafetyState = safety.START,
    rules: SafetyRules = RULES,
) -> bool:
    return found(seen, now, before, state, rules) > fault_flags.NO_FLAG


def test_the_rules_are_declared_in_their_order() -> None:
    lines = {f"nominal_line_{name}": name for name in SupplyLines._fields}
    named = [lines.get(item.name, item.name) for item in SAFETY_QUANTITIES]
    assert [path.rpartition(".")[2] for path in leaf_paths(SafetyRules, "")] == named
    assert RULES.most_toe_strides == 1.0


@pytest.mark.parametrize(
    ("change", "flag"),
    [
        ({"heel_force": 3001.0}, fault_flags.FORCE_RANGE),
        ({"heel_force": -41.0}, fault_flags.FORCE_RANGE),
        ({"toe_force": -41.0}, fault_flags.FORCE_RANGE),
        ({"toe_force": 3001.0}, fault_flags.FORCE_RANGE),
        ({"angle": 0.29}, fault_flags.ANGLE_RANGE),
        ({"angle": 2.41}, fault_flags.ANGLE_RANGE),
        ({"pressure_1": 2.9e4}, fault_flags.PRESSURE_RANGE),
        ({"pressure_2": 2.9e4}, fault_flags.PRESSURE_RANGE),
        ({"pressure_1": 2.1e6}, fault_flags.PRESSURE_RANGE),
        ({"pressure_2": 2.1e6}, fault_flags.PRESSURE_RANGE),
    ],
)
def test_a_reading_out_of_range_stops_at_once(change: dict[str, float], flag: float) -> None:
    assert not vents()
    assert found(GOOD._replace(**change)) == flag
    assert fault_flags.level_of(flag) == STOPPED


def test_a_full_chamber_2_that_the_foot_squeezes_is_no_fault() -> None:
    squeezed = GOOD._replace(pressure_2=2.1e6, angle=2.1)
    assert found(squeezed) == fault_flags.NO_FLAG
    assert found(squeezed._replace(pressure_1=2.1e6)) == fault_flags.PRESSURE_RANGE


def test_every_flag_says_what_it_goes_by_and_those_of_faults_come_first() -> None:
    numbers = list(fault_flags.FAULT_FLAGS)
    assert numbers == [float(number) for number in range(1, len(numbers) + 1)]
    assert len({flag.name for flag in fault_flags.FAULT_FLAGS.values()}) == len(numbers)
    levels = [fault_flags.level_of(number) for number in numbers]
    assert levels == sorted(levels, reverse=True) == [flag.level for flag in fault_flags.FAULT_FLAGS.values()]
    assert set(levels) == {LIFTS, PAUSED, STOPPED}
    settings = {item.name for item in SAFETY_QUANTITIES}
    assert all(set(flag.settings) <= settings for flag in fault_flags.FAULT_FLAGS.values())
    assert all(set(flag.readings) < set(GaitMeasurement._fields) for flag in fault_flags.FAULT_FLAGS.values())


def test_of_two_signs_the_one_that_stops_counts() -> None:
    endless = phase(SWING, 2.0, 0.0, 0.0, in_phase=1.21)
    assert found(now=endless) == fault_flags.ENDLESS_PHASE
    assert found(GOOD._replace(angle=9.0), endless) == fault_flags.ANGLE_RANGE
    paused = safety.monitor(RULES, safety.START, endless, endless, GOOD, PERIOD)
    assert paused.finding == VentingFault(fault_flags.ENDLESS_PHASE, 300.0, 200.0, 1.5, 1.1e5, 1.05e5)
    stopped = safety.monitor(RULES, paused, endless, endless, GOOD._replace(angle=9.0), PERIOD)
    assert (stopped.level, stopped.ventings) == (STOPPED, 2.0)
    assert stopped.finding == VentingFault(fault_flags.ANGLE_RANGE, 300.0, 200.0, 9.0, 1.1e5, 1.05e5)


ON_TOES = phase(PUSH_OFF, 0.5, heel=0.0)


def still_for(seconds: float, now: PhaseState, still: str, slope: float, seen: GaitMeasurement = GOOD) -> float:
    """The last fault flag where one reading stays the same and the others change by a slope, in N/s and mrad/s."""
    state = safety.START
    slopes = {"heel_force": -slope, "toe_force": slope, "angle": 1.0e-3 * slope}
    for sample in range(round(seconds / PERIOD)):
        moved = {name: getattr(seen, name) + by * sample * PERIOD for name, by in slopes.items() if name != still}
        state = safety.monitor(RULES, state, now, now, seen._replace(**moved), PERIOD)
    return state.finding.fault_flag


@pytest.mark.parametrize(
    ("still", "flag"),
    [("heel_force", fault_flags.STILL_HEEL), ("toe_force", fault_flags.STILL_TOE), ("angle", fault_flags.STILL_ANGLE)],
)
def test_one_quiet_sensor_while_others_move_raises_a_flag_and_a_foot_that_stands_is_none(
    still: str, flag: float
) -> None:
    flat = phase(MID_STANCE, 0.5)
    longest = 0.35 if still == "angle" else 0.24
    # The slow readings need some samples to show that the others move.
    heavy = GOOD._replace(heel_force=500.0)
    assert still_for(longest + 0.07, flat, still, 900.0, heavy) == flag
    assert still_for(longest, flat, still, 900.0, heavy) == fault_flags.NO_FLAG
    for quiet in (0.0, 1.0, 100.0):
        assert still_for(0.7, flat, still, quiet) == fault_flags.NO_FLAG, "who stands sways little"
    assert still_for(0.4, ON_TOES, still, 0.0) in (fault_flags.STILL_TOE, fault_flags.STILL_ANGLE), (
        "on the toes nobody stands still"
    )


def test_standing_with_readings_that_never_change_goes_on_for_long_without_a_sign() -> None:
    before, flat = phase(SWING, 1.0, 0.0, 0.0, in_phase=0.4), phase(MID_STANCE, 0.0)
    state = safety.monitor(RULES, safety.START, before, flat, GOOD, PERIOD)
    for sample in range(20_000):
        now = phase(MID_STANCE, sample * PERIOD, in_phase=sample * PERIOD)
        state = safety.monitor(RULES, state, now, now, GOOD, PERIOD)
    assert (state.level, state.ventings) == (HELPS, 0.0)


def test_an_unloaded_force_that_stays_the_same_is_no_sign() -> None:
    # A dead sensor may show some newtons for ever; that the foot never loads it is another flag.
    unloaded = GOOD._replace(heel_force=5.0, toe_force=5.0)
    assert still_for(1.0, phase(SWING, 0.5, 0.0, 0.0), "heel_force", 0.0, unloaded) == fault_flags.NO_FLAG


@pytest.mark.parametrize(("name", "is_sign"), [(SWING, False), (LANDING, False), (MID_STANCE, True), (PUSH_OFF, True)])
def test_an_angle_that_stays_the_same_is_a_sign_but_while_the_foot_is_held(name: float, is_sign: bool) -> None:
    now = phase(name, 0.5, heel=0.0, toe=0.0)
    shown = safety.START.readings._replace(angle=GOOD.angle, angle_unchanged=0.36)
    assert vents(now=now, state=safety.START._replace(readings=shown)) is is_sign


@pytest.mark.parametrize(("since", "is_sign"), [(0.0, False), (0.3, False), (0.4, True)])
def test_the_time_at_one_angle_in_a_slow_swing_does_not_count_in_stance(since: float, is_sign: bool) -> None:
    # At 0.4 m/s the device holds the foot at one step of a coarse sensor for most of a swing of 0.9 s.
    shown = safety.START.readings._replace(angle=GOOD.angle, angle_unchanged=0.65)
    assert vents(now=phase(MID_STANCE, since), state=safety.START._replace(readings=shown)) is is_sign


def test_the_time_at_one_angle_while_sitting_does_not_count_when_the_wearer_stands_up() -> None:
    sitting, light = phase(SWING, 0.0, heel=0.0, toe=0.0), GOOD._replace(heel_force=35.0, toe_force=35.0)
    state = safety.START
    for sample in range(4000):
        now = sitting._replace(since_strike=sample * PERIOD)
        state = safety.monitor(RULES, state, now, now, light, PERIOD)
    assert state.readings.angle_unchanged > 3.9
    before, stands = now, phase(MID_STANCE, 0.0)
    state = safety.monitor(RULES, state, before, stands, GOOD, PERIOD)
    assert state.finding.fault_flag == fault_flags.NO_FLAG, "it is no stride"
    for sample in range(1000):
        before, stands = stands, phase(MID_STANCE, sample * PERIOD)
        state = safety.monitor(RULES, state, before, stands, GOOD, PERIOD)
    assert state.finding.fault_flag == fault_flags.NO_FLAG, "who stands does not step"
    assert state.readings.angle_unchanged < 0.2, "forces that have just come on count as a move"


@pytest.mark.parametrize(("name", "sensor"), [("heel_force", "heel"), ("toe_force", "toe")])
def test_a_large_force_that_is_gone_within_a_sample_stops_and_one_that_falls_quickly_does_not(
    name: str, sensor: str
) -> None:
    def after(force: float, period: float = PERIOD) -> float:
        last = fault_checks.LastReadings()._replace(**{name: 500.0})
        seen = GOOD._replace(**{name: force})
        return fault_checks.gone_flag(RULES, last, seen, period)

    assert after(0.0) == fault_flags.FORCE_GONE
    assert fault_flags.level_of(fault_flags.FORCE_GONE) == STOPPED
    assert after(100.0) == fault_flags.NOT_RAISED, "no step of a foot that falls flat"
    assert after(0.0, period=0.01) == fault_flags.NOT_RAISED, (
        "a slow controller sees a foot leave the ground in one sample"
    )


@pytest.mark.parametrize(
    ("still", "now", "before", "flag"),
    [
        ("heel", phase(MID_STANCE, 0.5, 1.0, 0.0), phase(MID_STANCE, 0.5), fault_flags.FROZEN_HEEL),
        ("heel", phase(LANDING, 0.1, 1.0, 0.0), phase(LANDING, 0.1, 1.0, 0.0), fault_flags.STILL_HEEL),
        ("toe", phase(MID_STANCE, 0.5, 0.0, 1.0), phase(MID_STANCE, 0.5), fault_flags.FROZEN_TOE),
        ("toe", ON_TOES, ON_TOES, fault_flags.STILL_TOE),
        ("angle", phase(LANDING, 0.0, 1.0, 0.0), phase(SWING, 0.9, 0.0, 0.0), fault_flags.FROZEN_ANGLE),
        ("angle", phase(LANDING, 0.0, 1.0, 0.0), phase(SWING, 0.4, 0.0, 0.0), fault_flags.NO_FLAG),
        ("angle", ON_TOES, ON_TOES, fault_flags.STILL_ANGLE),
    ],
)
def test_a_reading_that_stays_the_same_pauses_and_stops_once_another_sensor_shows_a_step(
    still: str, now: PhaseState, before: PhaseState, flag: float
) -> None:
    shown = {"heel": "heel_force", "toe": "toe_force", "angle": "angle"}[still]
    readings = safety.START.readings._replace(**{shown: getattr(GOOD, shown), f"{still}_unchanged": 0.95})
    assert found(now=now, before=before, state=safety.START._replace(readings=readings)) == flag


@pytest.mark.parametrize(
    ("heel", "toe", "flag"),
    [
        (0.0, 1.0, fault_flags.NO_HEEL),
        (1.0, 0.0, fault_flags.NOT_FLAT),
        (0.0, 0.0, fault_flags.NOT_FLAT),
        (1.0, 1.0, fault_flags.NO_FLAG),
    ],
)
def test_a_foot_that_must_stand_flat_loads_both_sensors(heel: float, toe: float, flag: float) -> None:
    steady = safety.START._replace(steady=1.0)
    flat, early, late = (phase(MID_STANCE, since, heel, toe) for since in (0.2, 0.15, 0.26))
    assert found(now=flat, state=steady) == flag
    assert not vents(now=early, state=steady)
    assert not vents(now=late, state=steady)
    assert not vents(now=flat), "no usual stride came before"


@pytest.mark.parametrize(
    ("angle", "is_sign"), [(63.0, True), (71.0, False), (90.0, False), (109.0, False), (117.0, True)]
)
def test_a_flat_foot_in_mid_stance_bounds_the_ankle(angle: float, is_sign: bool) -> None:
    steady, seen = safety.START._replace(steady=1.0), GOOD._replace(angle=math.radians(angle))
    assert (found(seen, phase(MID_STANCE, 0.2), state=steady) == fault_flags.FLAT_ANGLE) is is_sign
    assert not vents(seen, phase(MID_STANCE, 0.3), state=steady), "the shank leans further later"
    assert not vents(seen, phase(MID_STANCE, 0.2)), "no usual stride came before"


@pytest.mark.parametrize(("last", "steady"), [(0.95, 1.0), (1.05, 1.0), (0.88, 0.0), (1.12, 0.0)])
def test_only_a_stride_that_took_about_the_stride_time_is_a_usual_one(last: float, steady: float) -> None:
    before, now = phase(SWING, last, 0.0, 0.0), phase(LANDING, 0.0, 1.0, 0.0)
    assert safety.monitor(RULES, safety.START, before, now, GOOD, PERIOD).steady == steady


def test_strides_without_the_heel_are_counted_in_a_row_and_those_that_only_begin_on_the_toes_are_not() -> None:
    swing, on_toes = phase(SWING, 1.3, 0.0, 0.0), phase(MID_STANCE, 0.0, 0.0, 1.0)
    missed = safety.START._replace(stance=Stance(0.0, 1.0, 0.0, 0.0))
    once = safety.monitor(RULES, missed, swing, on_toes, GOOD, PERIOD)
    assert (once.toe_strides, once.level) == (1.0, HELPS)
    assert found(now=on_toes, before=swing, state=once) == fault_flags.TOE_STRIDES
    assert fault_flags.level_of(fault_flags.TOE_STRIDES) == LIFTS
    came = once._replace(stance=Stance(1.0, 1.0, 0.0, 0.0))
    assert not vents(now=on_toes, before=swing, state=came), "the heel came down after the toes"
    assert safety.monitor(RULES, came, swing, on_toes, GOOD, PERIOD).toe_strides == 0.0
    assert not vents(now=on_toes, before=swing, state=once, rules=RULES._replace(most_toe_strides=2.0))


def test_a_phase_without_end_and_a_stride_without_toes_pause() -> None:
    assert found(now=phase(SWING, 2.0, 0.0, 0.0, in_phase=1.21)) == fault_flags.ENDLESS_PHASE
    assert not vents(now=phase(SWING, 2.0, 0.0, 0.0, in_phase=1.19))
    one_legged = safety.START._replace(stance=Stance(0.0, 1.0, 0.0, 1.2))
    assert found(now=phase(PUSH_OFF, 1.3, 0.0), state=one_legged) == fault_flags.ENDLESS_PHASE
    assert not vents(now=phase(MID_STANCE, 9.0, in_phase=9.0), state=one_legged), "who stands on heel and toes"
    assert found(now=phase(SWING, 0.4, 0.0, 0.0), before=phase(LANDING, 0.4)) == fault_flags.NO_TOES
    assert not vents(now=phase(MID_STANCE, 0.1), before=phase(LANDING, 0.1))


@pytest.mark.parametrize(("heel", "toe"), [(0.0, 1.0), (1.0, 0.0)])
def test_a_stance_without_end_in_which_a_force_comes_back_is_a_sign_and_leaving_it_is_none(
    heel: float, toe: float
) -> None:
    name = MID_STANCE if heel else PUSH_OFF
    assert found(now=phase(MID_STANCE, 1.25), before=phase(name, 1.25, heel, toe)) == fault_flags.RESTLESS
    assert not vents(now=phase(MID_STANCE, 1.1), before=phase(name, 1.1, heel, toe)), "a stride is as long"
    assert not vents(now=phase(name, 5.0, heel, toe), before=phase(MID_STANCE, 5.0)), "the first step after standing"


def test_who_sat_is_helped_again_after_standing_up_and_not_with_one_force() -> None:
    sits = phase(SWING, 2.0, 0.0, 0.0, in_phase=1.21)
    paused = safety.monitor(RULES, safety.START, sits, sits, GOOD, PERIOD)
    assert paused.level == PAUSED
    for heel, toe, level in ((1.0, 1.0, HELPS), (0.0, 1.0, PAUSED), (1.0, 0.0, PAUSED)):
        state, stands = paused, phase(MID_STANCE, 0.1, heel, toe)
        for sample in range(510):
            seen = GOOD._replace(heel_force=300.0 + sample, toe_force=200.0 + sample, angle=1.5 + 1.0e-4 * sample)
            state = safety.monitor(RULES, state, stands, stands, seen, PERIOD)
        assert state.level == level


def test_after_a_pause_the_foot_is_lifted_first_and_pushed_later() -> None:
    state = STEPS._replace(level=PAUSED, finding=safety.START.finding._replace(fault_flag=fault_flags.NO_TOES))
    swing, lands = phase(SWING, 1.05, 0.0, 0.0, in_phase=0.4), phase(LANDING, 0.0, 1.0, 0.0)
    allowed = []
    for _ in range(3):
        stood = state._replace(stance=STEPS.stance._replace(heel_seen=1.0, toe_seen=1.0))
        allowed.append([safety.permits(stood, name) for name in (SWING, LANDING, PUSH_OFF)])
        state = safety.monitor(RULES, stood, swing, lands, GOOD, PERIOD)
    assert allowed == [[False, False, False], [True, True, False], [True, True, True]]


def test_no_push_without_a_heel_that_was_loaded_in_this_stance() -> None:
    rises = STEPS._replace(stance=Stance(1.0, 1.0, 0.0, 0.1, flat_angle=1.0, turned=1.0, rolled=1.0))
    assert safety.safe_command(rises, PUSH_OFF, 1.0, PERIOD)[0] == 1.0
    missed = rises._replace(stance=rises.stance._replace(heel_seen=0.0))
    assert safety.safe_command(missed, PUSH_OFF, 1.0, PERIOD)[0] == VENT
    assert safety.safe_command(missed, SWING, -1.0, PERIOD)[0] == -1.0, "the foot is still held up"


def after_a_stance(forces: list[tuple[float, float]], since: float = 0.6) -> SafetyState:
    """The state at a toe-off so long [s] after the strike; the forces [N] under heel and toes change along lines.

    The foot stands flat but for the last of the forces.
    """
    flat, last = phase(MID_STANCE, 0.3), phase(PUSH_OFF, 0.5, heel=float(forces[-1][0] > 60.0))
    state, before = safety.START, phase(SWING, 1.0, 0.0, 0.0, in_phase=0.4)
    for number, (begins, ends) in enumerate(pairwise([(60.0, 60.0), *forces, (25.0, 25.0)])):
        for share in (0.25, 0.5, 0.75, 1.0):
            heel, toe = (first + share * (then - first) for first, then in zip(begins, ends, strict=True))
            now = flat if number < len(forces) - 1 else last
            state = safety.monitor(RULES, state, before, now, GOOD._replace(heel_force=heel, toe_force=toe), PERIOD)
            before = now
    off = phase(SWING, since, 0.0, 0.0, in_phase=0.0)
    return safety.monitor(RULES, state, before, off, GOOD._replace(heel_force=25.0, toe_force=25.0, angle=1.8), PERIOD)


A_STEP = [(400.0, 0.0), (350.0, 350.0), (10.0, 600.0)]


@pytest.mark.parametrize(
    ("forces", "flag"),
    [
        (A_STEP, fault_flags.NO_FLAG),
        ([(400.0, 400.0), (350.0, 350.0), (25.0, 25.0)], fault_flags.NO_TOE_OFF),
        ([(400.0, 320.0), (350.0, 350.0), (10.0, 130.0)], fault_flags.NO_TOE_OFF),
        ([(0.0, 400.0), (350.0, 350.0), (600.0, 10.0)], fault_flags.NO_TOE_OFF),
        ([(90.0, 90.0), (80.0, 80.0), (25.0, 25.0)], fault_flags.NO_FLAG),
    ],
    ids=["a step", "toes show the heel", "toes show 0.8 of the heel", "swapped", "who sits"],
)
def test_a_step_that_does_not_end_on_the_toes_pauses_before_the_foot_is_lifted(
    forces: list[tuple[float, float]], flag: float
) -> None:
    state = after_a_stance(forces)
    assert state.finding.fault_flag == flag
    assert safety.permits(state, SWING) is (forces is A_STEP)


def test_who_sits_down_and_turns_the_foot_is_helped_again_after_standing_up() -> None:
    stands = [(350.0, 350.0), (350.0, 350.0), (300.0, 300.0)]
    state = after_a_stance(stands, since=1.1)
    assert state.finding.fault_flag == fault_flags.NO_FLAG
    assert not safety.permits(state, SWING)
    sits = phase(SWING, 2.5, 0.0, 0.0, in_phase=1.3)
    state = safety.monitor(RULES, state, sits, sits, GOOD._replace(heel_force=25.0, toe_force=25.0), PERIOD)
    assert (state.level, state.finding.fault_flag) == (PAUSED, fault_flags.ENDLESS_PHASE)
    for sample in range(510):
        stood, seen = phase(MID_STANCE, sample * PERIOD), GOOD._replace(angle=1.5 + 1.0e-4 * sample)
        state = safety.monitor(RULES, state, stood, stood, seen, PERIOD)
    assert state.level == HELPS


def test_a_push_needs_toes_that_carry_in_place_of_the_heel() -> None:
    stance = Stance(1.0, 1.0, 0.0, 0.1, flat_angle=1.0, turned=1.0, largest=700.0, rolled=1.0)
    assert safety.permits(STEPS._replace(stance=stance), PUSH_OFF)
    assert not safety.permits(STEPS._replace(stance=stance._replace(rolled=0.0)), PUSH_OFF)


def test_a_swing_that_is_too_short_for_a_steady_stride_pauses() -> None:
    lands = phase(LANDING, 0.0, 1.0, 0.0)
    before = phase(SWING, 1.0, 0.0, 0.0, in_phase=0.24)
    assert found(now=lands, before=before) == fault_flags.SHORT_SWING
    assert not vents(now=lands, before=before._replace(in_phase=0.26))
    assert not vents(now=lands, before=before._replace(since_strike=0.85)), "a scuff ends a swing early"


def after_commands(command: float, seconds: float) -> SafetyState:
    state = STEPS
    for _ in range(round(seconds / PERIOD)):
        _, state = safety.safe_command(state, SWING, command, PERIOD)
    return state


@pytest.mark.parametrize(("command", "name"), [(1.0, "pressure_1"), (-1.0, "pressure_2")])
def test_a_chamber_that_was_filled_shows_pressure(command: float, name: str) -> None:
    nominal = RULES.nominal._replace(nominal_dorsiflexion_pressure=4.0e5)
    rules = RULES._replace(nominal=nominal)
    filled = GOOD._replace(pressure_1=3.0e5, pressure_2=3.0e5)
    empty = filled._replace(**{name: 1.0e5})
    assert found(empty, state=after_commands(command, 0.052), rules=rules) == fault_flags.NO_RISE
    assert not vents(filled, state=after_commands(command, 0.052), rules=rules)
    assert not vents(empty, state=after_commands(command, 0.048), rules=rules)
    assert not vents(empty, state=after_commands(0.5 * command, 0.098), rules=rules), "half open it takes twice as long"
    assert vents(empty, state=after_commands(0.5 * command, 0.104), rules=rules)
    assert not vents(empty, state=after_commands(0.05 * command, 20.0), rules=rules), "within the overlap of a valve"
    assert not vents(empty, state=after_commands(-command, 1.0))
    if name == "pressure_2":
        plugged = RULES._replace(nominal=RULES.nominal._replace(nominal_dorsiflexion_pressure=1.0e5))
        assert not vents(empty, state=after_commands(command, 0.052), rules=plugged), "one chamber has no second port"


@pytest.mark.parametrize("name", ["pressure_1", "pressure_2"])
def test_a_vented_chamber_shows_no_pressure_while_the_foot_stands_flat(name: str) -> None:
    stuck = GOOD._replace(**{name: 1.5e5})
    flat = phase(MID_STANCE, 0.1)
    assert found(stuck, flat, state=after_commands(VENT, 0.252)) == fault_flags.NO_FALL
    assert not vents(stuck, flat, state=after_commands(VENT, 0.248))
    assert not vents(GOOD, flat, state=after_commands(VENT, 0.252))
    for moving in (phase(SWING, 0.8, 0.0, 0.0), phase(LANDING, 0.1, 1.0, 0.0), phase(MID_STANCE, 0.4, 0.0, 1.0)):
        assert not vents(stuck, moving, state=after_commands(VENT, 0.252)), "the foot moves and presses gas out"


@pytest.mark.parametrize(
    ("name", "vented", "fall_time", "is_sign"),
    [
        *[("pressure_1", 0.252 * safety.LATE, time, time > 1.0) for time in (0.05, 0.11, 3.0, 1.0e9)],
        *[("pressure_2", 0.252, time, time > 1.0) for time in (0.05, 0.11, 3.0, 1.0e9)],
        *[("pressure_2", 0.252 * safety.LATE, time, True) for time in (0.11, 3.0, 1.0e9)],
    ],
)
def test_a_chamber_that_the_ankle_compresses_may_still_vent_and_one_that_grows_only_a_little_longer(
    name: str, vented: float, fall_time: float, is_sign: bool
) -> None:
    # What is slow has seen the chamber fall before: a filter that starts at nothing would see every reading rise.
    begun = 1.01e5 + 4.0e4 * math.exp(150 * PERIOD / fall_time)
    state = after_commands(VENT, vented)._replace(slow_pressure_1=1.01e5, slow_pressure_2=1.01e5)
    state = state._replace(**{f"slow_{name}": begun})
    for sample in range(151):
        left = 4.0e4 * math.exp((150 - sample) * PERIOD / fall_time)
        state = stood(state._replace(level=HELPS), sample, **{name: 1.01e5 + left})
        if 100 <= sample <= 150:
            assert (state.level == STOPPED) is is_sign


def stood(state: SafetyState, sample: int, **pressures: float) -> SafetyState:
    """State after a sample of a foot that stands flat and whose forces and angle change."""
    seen = GOOD._replace(angle=1.5 + 1.0e-9 * sample, heel_force=300.0 + sample, toe_force=200.0 + sample, **pressures)
    flat = phase(MID_STANCE, 0.1)
    return safety.monitor(RULES, state, flat, flat, seen, PERIOD)


def test_a_pressure_that_freezes_while_the_chamber_vents_is_found_soon() -> None:
    state = after_commands(VENT, 0.252)._replace(slow_pressure_1=2.2e5)
    for sample in range(100):
        state = stood(state, sample, pressure_1=2.0e5 - 500.0 * sample)
    assert state.level == HELPS
    # The filter that takes the slow fall behind a kinked hose for one needs a fifth of a second to see its end.
    for sample in range(100, 340):
        state = stood(state, sample, pressure_1=1.5e5)
    assert state.level == STOPPED


@pytest.mark.parametrize("reading", [1.02e5, 1.2e5, 1.3e5, 2.0e5, 4.0e5])
def test_no_single_reading_is_right_for_a_filled_and_a_vented_chamber(reading: float) -> None:
    frozen = GOOD._replace(pressure_1=reading)
    pushes, stands = phase(PUSH_OFF, 0.5, 0.0), phase(MID_STANCE, 0.4)
    seen = [
        vents(frozen, pushes, state=after_commands(1.0, 0.06)),
        vents(frozen, stands, state=after_commands(VENT, 0.3)),
    ]
    assert seen.count(True) == 1


@pytest.mark.parametrize("turned", [0.04, 0.06])
def test_who_sits_is_not_lifted_and_who_steps_is(turned: float) -> None:
    state = safety.START
    sits, stands, rolls, air = (
        GOOD._replace(heel_force=20.0, toe_force=20.0),
        phase(MID_STANCE, 0.5),
        phase(PUSH_OFF, 0.5, heel=0.0),
        phase(SWING, 0.6, 0.0, 0.0),
    )
    toes = GOOD._replace(heel_force=10.0, toe_force=250.0)
    for seen, before, now in ((GOOD, stands, stands), (toes, stands, rolls), (sits, rolls, air), (sits, air, air)):
        state = safety.monitor(RULES, state, before, now, seen, PERIOD)
        assert not safety.permits(state, now.phase) or now in (stands, rolls)
    state = safety.monitor(RULES, state, air, air, sits._replace(angle=GOOD.angle + turned), PERIOD)
    assert safety.permits(state, SWING) is (turned > safety.RESTS)
    state = safety.monitor(RULES, state, air, air, sits, PERIOD)
    assert safety.permits(state, SWING) is (turned > safety.RESTS), "a foot that is lifted may turn back"


def test_once_stopped_it_stays_so() -> None:
    state = safety.monitor(RULES, safety.START, phases.START, phases.START, GOOD._replace(angle=9.0), PERIOD)
    for command in (1.0, -0.3, 0.0):
        state = safety.monitor(RULES, state, phases.START, phases.START, GOOD, PERIOD)
        given, state = safety.safe_command(state, SWING, command, PERIOD)
        assert given == VENT
    assert state.valve_times == ValveTimes(0.0, 0.0, pytest.approx(3.0 * PERIOD))


def test_a_change_of_direction_begins_to_fill_anew() -> None:
    state = after_commands(1.0, 0.04)
    _, state = safety.safe_command(state, SWING, -1.0, PERIOD)
    assert state.valve_times == ValveTimes(0.0, pytest.approx(PERIOD), 0.0)


def pushes_that_end_at(*angles: float) -> SafetyState:
    """The safety state after push-offs at whose end the ankle has these angles [deg]."""
    state, air = safety.START, phase(SWING, 0.7, 0.0, 0.0)
    for angle in angles:
        seen = GOOD._replace(angle=math.radians(angle), heel_force=0.0, toe_force=0.0)
        state = safety.monitor(RULES, state, ON_TOES, air, seen, PERIOD)
    return state


def test_toes_that_are_seen_to_leave_when_the_foot_has_long_turned_down_lift_only_from_the_second_time_on() -> None:
    assert pushes_that_end_at(112.0, 119.0, 113.0, 125.0).level == HELPS
    late = pushes_that_end_at(119.0, 130.0)
    assert (late.level, late.finding.fault_flag) == (LIFTS, fault_flags.LATE_FORCES)
    assert pushes_that_end_at(119.0, 130.0, 116.0).landing.late_toes == 2.0, "a dropped foot is not in time"
    assert pushes_that_end_at(119.0, 130.0, 114.0).landing.late_toes == 0.0


def test_a_shift_of_weight_after_seconds_of_rest_is_no_still_sensor() -> None:
    flat, state, shifted = phase(MID_STANCE, 0.1), safety.START, GOOD._replace(toe_force=260.0)
    for seen, samples in ((GOOD, 5000), (shifted, 200), (GOOD._replace(toe_force=330.0), 100)):
        for _ in range(samples):
            state = safety.monitor(RULES, state, flat, flat, seen, PERIOD)
    assert state.level == HELPS
    assert 0.0 < state.readings.heel_unchanged < RULES.frozen_time, "only the time of the shifts counts"


@pytest.mark.parametrize("sensor", ["pressure_1", "pressure_2"])
def test_a_chamber_may_be_thin_for_a_moment_only(sensor: str) -> None:
    flat, state, levels = phase(MID_STANCE, 0.1), safety.START, []
    for _ in range(130):
        state = safety.monitor(RULES, state, flat, flat, GOOD._replace(**{sensor: 5.5e4}), PERIOD)
        levels.append(state.level)
    assert max(levels[:119]) == HELPS
    assert (levels[-1], state.finding.fault_flag) == (STOPPED, fault_flags.PRESSURE_RANGE)
