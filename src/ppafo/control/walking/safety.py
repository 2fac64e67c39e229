"""When a controller of walking vents both chambers: until the wearer walks well again, or for good.

Only a fault gives readings that no foot and no chamber gives (out of range), readings that contradict the valve (a
chamber that was filled and shows no pressure, or was vented and shows one that does not fall), and a sensor that stays
the same while the others show a step (frozen): these stop. Standing, stairs and stumbles too give readings that
contradict the gait (a stance or a swing without end, a foot that stands flat on one sensor) or stay the same: these
pause, and help comes back after some good strides. A pressure at rest may stay the same for long, most of all in the
steps of a converter, so a frozen pressure is found by the valve: no single reading is right for a filled chamber and
for a vented one.

Signs are joined by ``&`` and ``|``: ``and`` and ``or`` are branches, which keep the lanes from running side by side.
"""

from typing import NamedTuple

from ppafo.control.walking import signs
from ppafo.control.walking.phases import LANDING, MID_STANCE, SWING, PhaseState
from ppafo.control.walking.signs import HELPS, NO_SIGN, PAUSED
from ppafo.model.command import VENT, VENTS_ABOVE
from ppafo.model.gait_sensors import GaitMeasurement


class SafetyRules(NamedTuple):
    """What readings can be, and how long a contradiction may last; ``declaration.SAFETY_QUANTITIES`` says it of each.

    Force [N], angles [rad], times in stride times (``longest_phase``, ``flat_from``, ``flat_to``, ``shortest_swing``)
    or [s], strides, and absolute pressures [Pa]. ``fill_time`` is that of a valve fully open; half open it takes twice
    as long.
    """

    lowest_force: float
    largest_force: float
    lowest_angle: float
    highest_angle: float
    longest_phase: float
    frozen_time: float
    most_toe_strides: float
    flat_from: float
    flat_to: float
    lowest_pressure: float
    highest_pressure: float
    filled_pressure: float
    fill_time: float
    vent_time: float
    shortest_swing: float
    resume_strides: float


class ValveTimes(NamedTuple):
    """How long the valve has been commanded to fill chambers 1 and 2, by its opening, and to vent both [s]."""

    filling_1: float
    filling_2: float
    venting: float


class LastReadings(NamedTuple):
    """Last readings of heel, toe [N] and angle [rad], and how long each has not changed [s]."""

    heel_force: float
    toe_force: float
    angle: float
    heel_unchanged: float
    toe_unchanged: float
    angle_unchanged: float


class SlowPressures(NamedTuple):
    """Chamber pressures filtered with ``FALL_TIME`` [Pa]: above a reading that falls."""

    pressure_1: float
    pressure_2: float


class Finding(NamedTuple):
    """The last sign that vented the chambers, and the readings then: forces [N], angle [rad], pressures [Pa]."""

    sign: float
    heel_force: float
    toe_force: float
    angle: float
    pressure_1: float
    pressure_2: float


class SafetyState(NamedTuple):
    """Level of ``signs``; good strides in a row; pauses and stops so far, and the last; what the signs remember.

    ``toe_strides`` are strides in a row that began on the toes, and ``steady`` is 1 where the last stride took about
    the stride time.
    """

    level: float
    good_strides: float
    ventings: float
    finding: Finding
    readings: LastReadings
    toe_strides: float
    steady: float
    valve_times: ValveTimes
    slow_pressures: SlowPressures


START = SafetyState(
    level=HELPS,
    good_strides=0.0,
    ventings=0.0,
    finding=Finding(sign=NO_SIGN, heel_force=0.0, toe_force=0.0, angle=0.0, pressure_1=0.0, pressure_2=0.0),
    readings=LastReadings(
        heel_force=0.0, toe_force=0.0, angle=0.0, heel_unchanged=0.0, toe_unchanged=0.0, angle_unchanged=0.0
    ),
    toe_strides=0.0,
    steady=0.0,
    valve_times=ValveTimes(0.0, 0.0, 0.0),
    slow_pressures=SlowPressures(0.0, 0.0),
)

STEADY = 0.1
"""A stride that is longer or shorter than the stride time by less than this fraction of it is a usual one."""

HALF = 0.5
"""A stride of less than this fraction of the stride time, or of more than its inverse, is not a good one."""

FALL_TIME = 0.03
"""Time constant [s] of the pressures that tell whether a reading falls."""

FALLS = 0.03
"""A reading falls that is below its slow pressure by more than this fraction: a venting chamber at 140 kPa by 0.1."""

MINIMUM_OPENING = 0.1
"""Commands below this may lie within the overlap of a valve: they do not count as opening it."""


def time_unchanged(last: float, reading: float, since: float, period: float) -> float:
    """How long a reading has been the same to the last bit [s]."""
    return since + period if reading == last else 0.0


def next_readings(last: LastReadings, measurement: GaitMeasurement, period: float) -> LastReadings:
    """The last readings after a sample, taken every ``period`` [s]."""
    return LastReadings(
        heel_force=measurement.heel_force,
        toe_force=measurement.toe_force,
        angle=measurement.angle,
        heel_unchanged=time_unchanged(last.heel_force, measurement.heel_force, last.heel_unchanged, period),
        toe_unchanged=time_unchanged(last.toe_force, measurement.toe_force, last.toe_unchanged, period),
        angle_unchanged=time_unchanged(last.angle, measurement.angle, last.angle_unchanged, period),
    )


def range_sign(rules: SafetyRules, measurement: GaitMeasurement) -> float:
    """The sign of a reading that no foot and no chamber gives."""
    force = max(measurement.heel_force, measurement.toe_force) > rules.largest_force
    force = force | (min(measurement.heel_force, measurement.toe_force) < rules.lowest_force)
    angle = (measurement.angle < rules.lowest_angle) | (measurement.angle > rules.highest_angle)
    low, high = min(measurement.pressure_1, measurement.pressure_2), max(measurement.pressure_1, measurement.pressure_2)
    pressure = (low < rules.lowest_pressure) | (high > rules.highest_pressure)
    found = signs.PRESSURE_RANGE if pressure else NO_SIGN
    found = signs.ANGLE_RANGE if angle else found
    return signs.FORCE_RANGE if force else found


def still_sign(rules: SafetyRules, readings: LastReadings, before: PhaseState, phase: PhaseState) -> float:
    """The sign of a reading that does not change; a fault only where another sensor shows a step meanwhile.

    An unloaded force sensor shows the same for long, and so does the angle of a foot that is held in the swing. Forces
    and angle of a wearer who stands may stay the same in the steps of a converter, but not while the foot is lifted.
    """
    heel = (readings.heel_unchanged > rules.frozen_time) & (phase.heel.loaded > 0.5)
    toe = (readings.toe_unchanged > rules.frozen_time) & (phase.toe.loaded > 0.5)
    angle = (readings.angle_unchanged > rules.frozen_time) & (phase.phase != SWING)
    whole = (before.phase == SWING) & (phase.phase != SWING) & (before.since_strike > HALF * phase.stride_time)
    found = signs.STILL_ANGLE if angle else NO_SIGN
    found = signs.STILL_TOE if toe else found
    found = signs.STILL_HEEL if heel else found
    found = signs.FROZEN_ANGLE if angle & whole & (readings.angle_unchanged > before.since_strike) else found
    found = signs.FROZEN_TOE if toe & (phase.heel.loaded != before.heel.loaded) else found
    return signs.FROZEN_HEEL if heel & (phase.toe.loaded != before.toe.loaded) else found


def gait_sign(rules: SafetyRules, before: PhaseState, phase: PhaseState, toe_strides: float, steady: float) -> float:
    """The sign of forces that do not follow each other as in a gait.

    ``toe_strides`` [strides] and ``steady`` (1 or 0) are those of the next state.
    """
    # A heel that comes and goes begins phases anew, but no stance ends without a swing.
    lasts = phase.in_phase if phase.phase == SWING else max(phase.in_phase, phase.since_strike)
    endless = lasts > rules.longest_phase * phase.stride_time
    skips_toes = (before.phase == LANDING) & (phase.phase == SWING) & (phase.strikes > 1.5)
    has_begun = phase.since_strike > rules.flat_from * phase.stride_time
    flat = has_begun & (phase.since_strike < rules.flat_to * phase.stride_time) & (steady > 0.5)
    enters = (before.phase == SWING) & (phase.phase != SWING)
    short = enters & (steady > 0.5) & (before.in_phase < rules.shortest_swing * phase.stride_time)
    found = signs.SHORT_SWING if short else NO_SIGN
    found = signs.NOT_FLAT if flat & (min(phase.heel.loaded, phase.toe.loaded) < 0.5) else found
    found = signs.TOE_STRIDES if toe_strides > rules.most_toe_strides else found
    found = signs.NO_TOES if skips_toes else found
    return signs.ENDLESS_PHASE if endless else found


def next_slow_pressures(last: SlowPressures, measurement: GaitMeasurement, period: float) -> SlowPressures:
    """Slow pressures [Pa] after a sample, taken every ``period`` [s]."""
    fraction = period / (period + FALL_TIME)
    return SlowPressures(
        last.pressure_1 + (measurement.pressure_1 - last.pressure_1) * fraction,
        last.pressure_2 + (measurement.pressure_2 - last.pressure_2) * fraction,
    )


def holds_pressure(rules: SafetyRules, pressure: float, slow: float) -> bool:
    """True where a vented chamber shows a pressure [Pa] that does not fall."""
    return (pressure > rules.filled_pressure) & (slow <= (1.0 + FALLS) * pressure)


def valve_sign(
    rules: SafetyRules,
    valve_times: ValveTimes,
    slow_pressures: SlowPressures,
    phase: PhaseState,
    measurement: GaitMeasurement,
) -> float:
    """The sign of a pressure that is not what the valve was told long enough.

    A foot in the air or on its toes presses gas out of a vented chamber: those are judged while it stands flat. A full
    chamber vents for longer than ``vent_time`` through a narrow valve while the ankle compresses it, but it does vent.
    """
    no_rise_1 = (valve_times.filling_1 > rules.fill_time) & (measurement.pressure_1 < rules.filled_pressure)
    no_rise_2 = (valve_times.filling_2 > rules.fill_time) & (measurement.pressure_2 < rules.filled_pressure)
    stands = (phase.phase == MID_STANCE) & (phase.heel.loaded > 0.5)
    left = holds_pressure(rules, measurement.pressure_1, slow_pressures.pressure_1) | holds_pressure(
        rules, measurement.pressure_2, slow_pressures.pressure_2
    )
    no_fall = stands & (valve_times.venting > rules.vent_time) & left
    found = signs.NO_FALL if no_fall else NO_SIGN
    return signs.NO_RISE if no_rise_1 | no_rise_2 else found


def first_sign(some: float, others: float) -> float:
    """The sign of two that comes first in ``signs``: one that stops before one that pauses, either before none."""
    lower = min(some, others)
    return lower if lower > NO_SIGN else max(some, others)


def next_good_strides(state: SafetyState, before: PhaseState, phase: PhaseState, sign: float) -> float:
    """Good strides in a row after a sample: from a heel strike to the next in about the stride time, without a sign.

    -1 after a sign, so that the rest of its stride does not count.
    """
    enters = (before.phase == SWING) & (phase.phase != SWING)
    usual = (before.since_strike > HALF * phase.stride_time) & (before.since_strike < phase.stride_time / HALF)
    good = usual & (phase.phase == LANDING)
    counted = (state.good_strides + 1.0 if good else 0.0) if enters else state.good_strides
    return -1.0 if sign > NO_SIGN else counted


def monitor(
    rules: SafetyRules,
    state: SafetyState,
    before: PhaseState,
    phase: PhaseState,
    measurement: GaitMeasurement,
    period: float,
) -> SafetyState:
    """The state after a sample of ``period`` [s]; ``before`` and ``phase`` are the phases before and after it."""
    readings = next_readings(state.readings, measurement, period)
    enters = (before.phase == SWING) & (phase.phase != SWING)
    on_toes = phase.phase == MID_STANCE
    toe_strides = (state.toe_strides + 1.0 if on_toes else 0.0) if enters else state.toe_strides
    usual = abs(before.since_strike - phase.stride_time) < STEADY * phase.stride_time
    steady = (1.0 if usual else 0.0) if enters else state.steady
    slow_pressures = next_slow_pressures(state.slow_pressures, measurement, period)
    sign = first_sign(range_sign(rules, measurement), still_sign(rules, readings, before, phase))
    sign = first_sign(sign, gait_sign(rules, before, phase, toe_strides, steady))
    sign = first_sign(sign, valve_sign(rules, state.valve_times, slow_pressures, phase, measurement))
    good_strides = next_good_strides(state, before, phase, sign)
    resumes = (state.level == PAUSED) & (good_strides >= rules.resume_strides)
    level = max(HELPS if resumes else state.level, signs.level_of(sign))
    vents = level > state.level
    return SafetyState(
        level=level,
        good_strides=good_strides,
        ventings=state.ventings + (1.0 if vents else 0.0),
        finding=later_finding(vents, sign, measurement, state.finding),
        readings=readings,
        toe_strides=toe_strides,
        steady=steady,
        valve_times=state.valve_times,
        slow_pressures=slow_pressures,
    )


def later_finding(vents: bool, sign: float, measurement: GaitMeasurement, last: Finding) -> Finding:
    """The finding of this sample where it vents the chambers, else the last one."""
    return Finding(
        sign=sign if vents else last.sign,
        heel_force=measurement.heel_force if vents else last.heel_force,
        toe_force=measurement.toe_force if vents else last.toe_force,
        angle=measurement.angle if vents else last.angle,
        pressure_1=measurement.pressure_1 if vents else last.pressure_1,
        pressure_2=measurement.pressure_2 if vents else last.pressure_2,
    )


def feed_time(since: float, opening: float, period: float) -> float:
    """How long a chamber has been fed [s], weighted by the opening towards it; 0 where the valve does not feed it."""
    return since + opening * period if opening > MINIMUM_OPENING else 0.0


def safe_command(state: SafetyState, command: float, period: float) -> tuple[float, SafetyState]:
    """The command to the valve [-], ``VENT`` in a pause or a stop, and the state that records it for ``period`` [s]."""
    sent = VENT if state.level > HELPS else command
    vents = sent > VENTS_ABOVE
    opening = 0.0 if vents else max(-1.0, min(1.0, sent))
    valve_times = ValveTimes(
        feed_time(state.valve_times.filling_1, opening, period),
        feed_time(state.valve_times.filling_2, -opening, period),
        state.valve_times.venting + period if vents else 0.0,
    )
    return sent, SafetyState(
        level=state.level,
        good_strides=state.good_strides,
        ventings=state.ventings,
        finding=state.finding,
        readings=state.readings,
        toe_strides=state.toe_strides,
        steady=state.steady,
        valve_times=valve_times,
        slow_pressures=state.slow_pressures,
    )
