"""Safety of a walking controller: reduced assistance (lifting only), pause until the wearer walks well, or final stop.

Only a fault causes readings outside of the physical range, sudden losses of a signal, readings that contradict the
valve (a filled chamber without pressure, or a vented chamber whose pressure does not fall), or a frozen sensor while
the others show a step: these faults stop the device. Sitting, stumbles and rocking also cause readings that contradict
the gait: such readings pause the device. A wearer who stands or sits is not assisted, but needs no pause. If the heel
is not detected, the foot may be on a stair or a sensor dead: the foot is lifted in the swing, which the toes indicate,
and not pushed. A pressure at rest may be constant for long, in particular with a coarse converter, so a frozen pressure
sensor is found by the valve: no constant reading fits both a filled and a vented chamber.

Assistance resumes in steps: after one good stride the foot is lifted, after ``resume_strides`` it is pushed too.

Conditions are combined by ``&`` and ``|``: ``and`` and ``or`` are branches, which prevent vector code over runs.
"""

from typing import NamedTuple

from ppafo.control.walking import fault_checks, fault_flags, observer
from ppafo.control.walking.fault_flags import NOT_RAISED, raised
from ppafo.control.walking.observer import Observer
from ppafo.control.walking.phases import PhaseState
from ppafo.model.helping import HELPS, LANDING, LIFTS, MID_STANCE, PAUSED, PUSH_OFF, STOPPED, SWING
from ppafo.model.sensors import GaitMeasurement
from ppafo.model.valves.kind import VENT, VENTS_ABOVE


class ValveTimes(NamedTuple):
    """Times [s] of the valve command to fill chambers 1 and 2, weighted by opening, and to vent both."""

    filling_1: float = 0.0
    filling_2: float = 0.0
    venting: float = 0.0


class Stance(NamedTuple):
    """Loading of heel and toes in the present stance.

    ``heel_seen`` and ``toe_seen`` are 1 if the sensor was loaded since the strike. ``together`` and ``apart`` are the
    times [s] with both loaded and with only one loaded; each ends where the other starts, ``apart`` also in the swing.
    ``flat_angle`` [rad] is the ankle angle when the heel was last loaded, 0 before the first sample; ``turned`` is 1
    once the ankle has left this angle. ``largest`` [N] is the larger peak force since the strike. ``rolled`` is 1 once
    the load has moved from the heel to the toes, which proves that the sensors are distinct, until the foot is flat
    again.
    """

    heel_seen: float = 0.0
    toe_seen: float = 0.0
    together: float = 0.0
    apart: float = 0.0
    flat_angle: float = 0.0
    turned: float = 0.0
    largest: float = 0.0
    rolled: float = 0.0


class VentingFault(NamedTuple):
    """Last fault flag that vented the chambers, and the readings then: forces [N], angle [rad], pressures [Pa]."""

    fault_flag: float = fault_flags.NO_FLAG
    heel_force: float = 0.0
    toe_force: float = 0.0
    angle: float = 0.0
    pressure_1: float = 0.0
    pressure_2: float = 0.0


class SafetyState(NamedTuple):
    """Safety state: assistance level, strides, last fault, and states of the checks.

    ``level`` is the assistance level of ``fault_flags``, ``good_strides`` the number of consecutive good strides,
    ``ventings`` the number of reductions of assistance, and ``finding`` the last one. ``toe_strides`` are consecutive
    strides on the toes alone. ``steady`` is 1 if the last stride took about the stride time. ``slow_pressure_1`` and
    ``slow_pressure_2`` [Pa] are filtered pressures, which exceed a falling reading. ``thin`` [s] is the time for which
    a pressure has been below the pressure of a chamber at rest.
    """

    level: float = HELPS
    good_strides: float = 0.0
    ventings: float = 0.0
    finding: VentingFault = VentingFault()
    readings: fault_checks.LastReadings = fault_checks.LastReadings()
    landing: fault_checks.LandingCheck = fault_checks.LandingCheck()
    stance: Stance = Stance()
    toe_strides: float = 0.0
    steady: float = 0.0
    valve_times: ValveTimes = ValveTimes()
    observer: Observer = Observer()
    emptying: fault_checks.Emptying = fault_checks.Emptying()
    slow_pressure_1: float = 0.0
    slow_pressure_2: float = 0.0
    thin: float = 0.0


START = SafetyState()

LIFT_STRIDES = 1.0
"""Good strides in a row after which a paused device holds the foot up again."""

STANDS_UP = 0.5
"""Time [s] with heel and toes loaded after which a sitting wearer has stood up, and assistance resumes."""

STEADY = 0.1
"""Largest relative deviation of a usual stride from the stride time."""

LATE = 1.3
"""Multiple of ``vent_time`` after which chamber 2 has no pressure: from 90 psig, venting takes ``vent_time``."""

RESTS = 0.05
"""Angle [rad] within which an ankle rests: sitting unloads heel and toes too, but does not turn the ankle, and a foot
that steps has turned by more before its toes leave the ground."""

ROLLS = 0.33
"""Fraction of the largest force by which the toe load exceeds the heel load before the toes leave the ground: 0.98 and
more on recorded gaits, where the heel is off the ground by then. Two channels that read one sensor give 0, swapped
channels less than 0, and toes that read 0.8 of the heel 0.3."""

CARRIES = 100.0
"""Force [N] in a stance below which rolling is not checked: the foot of a sitting wearer carries less."""

SITS_DOWN = 1.0
"""Time after a strike, in stride times, after which a foot may leave the ground without rolling over its toes: the
wearer then sits down. The foot of a walking wearer leaves the ground earlier, and sitting down takes longer."""

MINIMUM_OPENING = 0.1
"""Commands smaller than this may lie within the overlap of a valve and do not count as an opening."""


def next_stance(
    last: Stance, before: PhaseState, phase: PhaseState, measurement: GaitMeasurement, period: float
) -> Stance:
    """Stance after a sample of ``period`` [s]; a strike starts a new one."""
    angle, heel_force, toe_force = measurement.angle, measurement.heel_force, measurement.toe_force
    is_swing = phase.phase == SWING
    strikes = (before.phase == SWING) & (not is_swing)
    # Forces in the swing do not count: a strike is detected some samples late, and its first forces belong to the
    # next stance. The largest force of the last stance is kept, as a scale for leaving the ground.
    force = last.largest if is_swing else max(heel_force, toe_force)
    largest = force if strikes else max(last.largest, force)
    rolls = (not is_swing) & (toe_force - heel_force > ROLLS * largest)
    heel, toe = phase.heel.loaded, phase.toe.loaded
    both_loaded = min(heel, toe) > 0.5
    is_apart = (not is_swing) & (min(heel, toe) < 0.5)
    # The ankle turns from its angle while the heel is loaded.
    is_flat = ((phase.phase == MID_STANCE) & (heel > 0.5)) | (last.flat_angle <= 0.0)
    flat_angle = angle if is_flat else last.flat_angle
    turns = abs(angle - flat_angle) > RESTS
    return Stance(
        heel_seen=heel if strikes else max(last.heel_seen, heel),
        toe_seen=toe if strikes else max(last.toe_seen, toe),
        together=last.together + period if both_loaded else 0.0,
        apart=last.apart + period if is_apart else 0.0,
        flat_angle=flat_angle,
        turned=1.0 if turns | ((last.turned > 0.5) & (not is_flat)) else 0.0,
        largest=largest,
        rolled=1.0 if rolls | ((last.rolled > 0.5) & (not is_flat)) else 0.0,
    )


def gait_flag(rules: fault_checks.SafetyRules, before: PhaseState, phase: PhaseState, stance: Stance) -> float:
    """Fault flag of forces whose order contradicts a gait, at any pace."""
    longest = rules.longest_phase * phase.stride_time
    endless = max(phase.in_phase if phase.phase == SWING else 0.0, stance.apart) > longest
    stays = (before.phase != SWING) & (phase.phase != SWING) & (before.since_strike > longest)
    returns = (phase.heel.loaded > before.heel.loaded) | (phase.toe.loaded > before.toe.loaded)
    # Not at the first strike: a walk may begin with a lifted foot.
    skips_toes = (before.phase == LANDING) & (phase.phase == SWING) & (phase.strikes > 1.5)
    # A wearer who sits down unloads heel and toes alike and may turn the ankle, but late in the stance. The first
    # stance is not checked: it may begin anywhere.
    leaves = (phase.phase == SWING) & (stance.turned > 0.5) & (stance.largest > CARRIES)
    leaves = leaves & (phase.since_strike < SITS_DOWN * phase.stride_time) & (phase.strikes > 1.5)
    return min(
        raised(fault_flags.ENDLESS_PHASE, endless),
        raised(fault_flags.RESTLESS, stays & returns),
        raised(fault_flags.NO_TOES, skips_toes),
        raised(fault_flags.NO_TOE_OFF, leaves & (stance.rolled < 0.5)),
    )


def steady_flag(rules: fault_checks.SafetyRules, before: PhaseState, phase: PhaseState, angle: float) -> float:
    """Fault flag of forces or an angle [rad] that contradict a stride after one of the usual duration."""
    flat = phase.since_strike > rules.flat_from * phase.stride_time
    flat = flat & (phase.since_strike < rules.flat_to * phase.stride_time)
    strikes = (before.phase == SWING) & (phase.phase != SWING)
    short = strikes & (before.in_phase < rules.shortest_swing * phase.stride_time)
    bent = (angle < rules.lowest_flat_angle) | (angle > rules.highest_flat_angle)
    return min(
        raised(fault_flags.NOT_FLAT, flat & (phase.toe.loaded < 0.5)),
        raised(fault_flags.FLAT_ANGLE, flat & bent & (min(phase.heel.loaded, phase.toe.loaded) > 0.5)),
        raised(fault_flags.SHORT_SWING, short),
        raised(fault_flags.NO_HEEL, flat & (phase.heel.loaded < 0.5)),
    )


def valve_flag(
    rules: fault_checks.SafetyRules, state: SafetyState, phase: PhaseState, measurement: GaitMeasurement
) -> float:
    """Fault flag of a pressure that contradicts the command of the valve, by limits that do not depend on the device.

    With an observer of the chambers only one of these checks is needed: a vented chamber whose pressure exceeds the
    expected one.

    A foot in the air or on its toes displaces gas from a vented chamber, so vented pressures are checked while the foot
    is flat. There the ankle compresses chamber 1, which may vent for longer than ``vent_time`` through a narrow valve,
    but does vent. Chamber 2 expands then: a pressure still measured in it is delayed, as is one that rises after
    venting.
    """
    valve_times = state.valve_times
    # No pressure although the chamber was filled for longer than any device needs.
    no_rise_1 = (valve_times.filling_1 > rules.fill_time) & (measurement.pressure_1 < rules.filled_pressure)
    # A second port without a supply, as of an actuator with one chamber, fills nothing.
    fills_2 = (valve_times.filling_2 > rules.fill_time) & (
        rules.nominal.nominal_dorsiflexion_pressure > rules.filled_pressure
    )
    no_rise_2 = fills_2 & (measurement.pressure_2 < rules.filled_pressure)
    stands = (phase.phase == MID_STANCE) & (phase.heel.loaded > 0.5)
    expected_1, expected_2 = state.observer.chamber_1.pressure, state.observer.chamber_2.pressure
    constant = fault_checks.holds_pressure(rules, measurement.pressure_1, expected_1, state.slow_pressure_1)
    constant = constant | fault_checks.holds_pressure(rules, measurement.pressure_2, expected_2, state.slow_pressure_2)
    stays = stands & (valve_times.venting > rules.vent_time) & constant
    delayed = (valve_times.venting > LATE * rules.vent_time) & (measurement.pressure_2 > rules.filled_pressure)
    no_fall = stays | (stands & delayed) | (state.emptying.rising > fault_checks.LASTS)
    flag = min(raised(fault_flags.NO_RISE, no_rise_1 | no_rise_2), raised(fault_flags.NO_FALL, no_fall))
    return raised(fault_flags.PRESSURE_SENSOR, stays) if rules.nominal.nominal_flow > 0.0 else flag


def next_good_strides(state: SafetyState, before: PhaseState, phase: PhaseState, flag: float) -> float:
    """Consecutive good strides after a sample: of about the stride time, on heel and toes, without a flag.

    -1 after a flag, so that the rest of the stride does not count.
    """
    strikes = (before.phase == SWING) & (phase.phase != SWING)
    is_usual = (before.since_strike > fault_checks.HALF * phase.stride_time) & (
        before.since_strike < phase.stride_time / fault_checks.HALF
    )
    is_good = is_usual & (min(state.stance.heel_seen, state.stance.toe_seen) > 0.5)
    # A stride is assessed at the strike that ends it.
    counted = (state.good_strides + 1.0 if is_good else 0.0) if strikes else state.good_strides
    return -1.0 if flag > fault_flags.NO_FLAG else counted


def next_memory(
    rules: fault_checks.SafetyRules,
    state: SafetyState,
    before: PhaseState,
    phase: PhaseState,
    measurement: GaitMeasurement,
    period: float,
) -> SafetyState:
    """Safety state with the states of the checks after a sample of ``period`` [s]; the level is unchanged."""
    readings = fault_checks.next_readings(state.readings, measurement, before, phase, period)
    strikes = (before.phase == SWING) & (phase.phase != SWING)
    on_toes = (state.stance.heel_seen < 0.5) & (before.strikes > 0.5)
    is_usual = abs(before.since_strike - phase.stride_time) < STEADY * phase.stride_time
    steady = (1.0 if is_usual else 0.0) if strikes else state.steady
    # Chamber 2 is joined to the atmosphere while chamber 1 is fed, and while both vent.
    vented = state.valve_times.filling_1 + state.valve_times.venting
    thin = min(measurement.pressure_1, measurement.pressure_2) < fault_checks.THIN
    return state._replace(
        readings=readings,
        landing=fault_checks.next_landing(rules, state.landing, readings, before, phase, steady, period),
        stance=next_stance(state.stance, before, phase, measurement, period),
        toe_strides=(state.toe_strides + 1.0 if on_toes else 0.0) if strikes else state.toe_strides,
        steady=steady,
        observer=observer.next_observer(
            rules.nominal,
            state.observer,
            state.readings.angle,
            state.readings.pressure_1,
            state.readings.pressure_2,
            measurement.angle,
            measurement.pressure_1,
            measurement.pressure_2,
            period,
        ),
        emptying=fault_checks.next_emptying(rules, state.emptying, vented, measurement, period),
        slow_pressure_1=fault_checks.next_slow_pressure(state.slow_pressure_1, measurement.pressure_1, period),
        slow_pressure_2=fault_checks.next_slow_pressure(state.slow_pressure_2, measurement.pressure_2, period),
        thin=state.thin + period if thin else 0.0,
    )


def found_flag(
    rules: fault_checks.SafetyRules,
    last: fault_checks.LastReadings,
    now: SafetyState,
    before: PhaseState,
    phase: PhaseState,
    measurement: GaitMeasurement,
    period: float,
) -> float:
    """Most urgent fault flag of a sample; ``last`` are the readings before the sample, ``now`` is the updated state."""
    nominal, pressure_1, pressure_2 = rules.nominal, measurement.pressure_1, measurement.pressure_2
    steady = steady_flag(rules, before, phase, measurement.angle)
    late = max(now.landing.late, now.landing.late_toes) > fault_checks.LATE_STRIDES
    # The numbers of the flags are in order of urgency: the smallest is the most urgent, whichever check raised it.
    flag = min(
        observer.found_cause(nominal, now.observer, measurement.angle, pressure_1, pressure_2, period),
        valve_flag(rules, now, phase, measurement),
        fault_checks.range_flag(rules, measurement, now.thin),
        fault_checks.gone_flag(rules, last, measurement, period),
        fault_checks.still_flag(rules, now.readings, before, phase),
        gait_flag(rules, before, phase, now.stance),
        steady if now.steady > 0.5 else NOT_RAISED,
        raised(fault_flags.TOE_STRIDES, now.toe_strides > rules.most_toe_strides),
        raised(fault_flags.LATE_FORCES, late),
    )
    return flag if flag < NOT_RAISED else fault_flags.NO_FLAG


def monitor(
    rules: fault_checks.SafetyRules,
    state: SafetyState,
    before: PhaseState,
    phase: PhaseState,
    measurement: GaitMeasurement,
    period: float,
) -> SafetyState:
    """Safety state after a sample of ``period`` [s]; ``before`` and ``phase`` are the phases before and after."""
    now = next_memory(rules, state, before, phase, measurement, period)
    flag = found_flag(rules, state.readings, now, before, phase, measurement, period)
    good_strides = next_good_strides(state, before, phase, flag)
    # An endless swing is sitting: standing up shows that both force sensors are sound.
    is_sitting = (state.level == PAUSED) & (state.finding.fault_flag == fault_flags.ENDLESS_PHASE)
    # Assistance resumes in steps, except after a stop: the foot is lifted before it is pushed.
    resumes = (state.level < STOPPED) & (good_strides >= rules.resume_strides)
    lifted = LIFTS if (state.level == PAUSED) & (good_strides >= LIFT_STRIDES) else state.level
    allowed = HELPS if resumes | (is_sitting & (now.stance.together > STANDS_UP)) else lifted
    # A flag of this sample has priority over good strides.
    level = max(allowed, fault_flags.level_of(flag))
    # Only a higher level vents; a lower level is more assistance.
    vents = level > state.level
    return now._replace(
        level=level,
        good_strides=good_strides,
        ventings=state.ventings + (1.0 if vents else 0.0),
        finding=VentingFault(
            fault_flag=flag if vents else state.finding.fault_flag,
            heel_force=measurement.heel_force if vents else state.finding.heel_force,
            toe_force=measurement.toe_force if vents else state.finding.toe_force,
            angle=measurement.angle if vents else state.finding.angle,
            pressure_1=measurement.pressure_1 if vents else state.finding.pressure_1,
            pressure_2=measurement.pressure_2 if vents else state.finding.pressure_2,
        ),
    )


def feed_time(since: float, opening: float, period: float) -> float:
    """Time for which a chamber has been supplied [s], weighted by the opening; 0 if the valve does not supply it."""
    return since + opening * period if opening > MINIMUM_OPENING else 0.0


def permits(state: SafetyState, phase: float) -> bool:
    """Tell whether the device may act in a gait phase.

    A push requires that the heel was loaded in this stance and the load has moved to the toes. Lifting requires that
    the ankle has turned and the foot left the ground with the toes last; the foot of a sitting wearer is unloaded in
    place.
    """
    rolled = state.stance.rolled > 0.5
    pushes = (state.level < LIFTS) & (state.stance.heel_seen > 0.5) & rolled
    steps = (phase > LANDING) | ((state.stance.turned > 0.5) & (rolled | (phase == LANDING)))
    return (state.level < PAUSED) & steps & (pushes | (phase != PUSH_OFF))


def safe_command(state: SafetyState, phase: float, command: float, period: float) -> tuple[float, SafetyState]:
    """Valve command [-], ``VENT`` where no action is permitted, and the safety state that records it for a time [s]."""
    sent = command if permits(state, phase) else VENT
    vents = sent > VENTS_ABOVE
    # The time for which a chamber is fed is weighted by the opening: half open takes twice as long.
    opening = 0.0 if vents else max(-1.0, min(1.0, sent))
    valve_times = ValveTimes(
        feed_time(state.valve_times.filling_1, opening, period),
        feed_time(state.valve_times.filling_2, -opening, period),
        state.valve_times.venting + period if vents else 0.0,
    )
    return sent, state._replace(valve_times=valve_times, observer=state.observer._replace(command=sent))
