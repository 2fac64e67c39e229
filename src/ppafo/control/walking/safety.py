"""When a controller of walking stops trusting its sensors and vents both chambers permanently.

Four signs: readings that no foot and no chamber gives (out of range), readings that contradict each other or the gait
(a stance or a swing without end, a foot that stands flat on one sensor), readings that contradict the valve (a chamber
that was filled and shows no pressure, or was vented and shows one that does not fall), and a sensor that does not
change while the others do (frozen). A pressure at rest may stay the same for long, most of all in the steps of a
converter, so a frozen pressure is found by the third sign: no single reading is right for a filled chamber and for a
vented one.

Signs are joined by ``&`` and ``|``: ``and`` and ``or`` are branches, which keep the lanes from running side by side.
"""

from typing import NamedTuple

from ppafo.control.walking.phases import LANDING, MID_STANCE, SWING, PhaseState
from ppafo.model.command import VENT, VENTS_ABOVE
from ppafo.model.gait_sensors import GaitMeasurement


class SafetyRules(NamedTuple):
    """What readings can be, and how long a contradiction may last; ``declaration.SAFETY_QUANTITIES`` says it of each.

    Force [N], angles [rad], times in stride times (``longest_phase``, ``flat_from``, ``flat_to``) or [s], strides, and
    absolute pressures [Pa]. ``fill_time`` is that of a valve fully open; half open it takes twice as long.
    """

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


class SafetyState(NamedTuple):
    """1 once vented; last readings; strides in a row that began on the toes; valve commands; slow pressures.

    ``steady`` is 1 where the last stride took about the stride time.
    """

    vented: float
    readings: LastReadings
    toe_strides: float
    steady: float
    valve_times: ValveTimes
    slow_pressures: SlowPressures


START = SafetyState(
    vented=0.0,
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


def is_out_of_range(rules: SafetyRules, measurement: GaitMeasurement) -> bool:
    """True where a reading is one that no foot and no chamber gives."""
    force = max(measurement.heel_force, measurement.toe_force) > rules.largest_force
    angle = (measurement.angle < rules.lowest_angle) | (measurement.angle > rules.highest_angle)
    low, high = min(measurement.pressure_1, measurement.pressure_2), max(measurement.pressure_1, measurement.pressure_2)
    return force | angle | (low < rules.lowest_pressure) | (high > rules.highest_pressure)


def is_frozen(rules: SafetyRules, readings: LastReadings, phase: PhaseState) -> bool:
    """True where a reading does not change although it must.

    An unloaded force sensor shows the same for long, and so does the angle of a foot that is held in the swing.
    """
    heel = (readings.heel_unchanged > rules.frozen_time) & (phase.heel.loaded > 0.5)
    toe = (readings.toe_unchanged > rules.frozen_time) & (phase.toe.loaded > 0.5)
    return heel | toe | ((readings.angle_unchanged > rules.frozen_time) & (phase.phase != SWING))


def contradicts_gait(
    rules: SafetyRules, before: PhaseState, phase: PhaseState, toe_strides: float, steady: float
) -> bool:
    """True where the forces do not follow each other as in a gait.

    ``toe_strides`` [strides] and ``steady`` (1 or 0) are those of the next state.
    """
    endless = phase.in_phase > rules.longest_phase * phase.stride_time
    skips_toes = (before.phase == LANDING) & (phase.phase == SWING) & (phase.strikes > 1.5)
    has_begun = phase.since_strike > rules.flat_from * phase.stride_time
    flat = has_begun & (phase.since_strike < rules.flat_to * phase.stride_time) & (steady > 0.5)
    lost = flat & (min(phase.heel.loaded, phase.toe.loaded) < 0.5)
    return endless | skips_toes | lost | (toe_strides > rules.most_toe_strides)


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


def contradicts_valve(
    rules: SafetyRules,
    valve_times: ValveTimes,
    slow_pressures: SlowPressures,
    phase: PhaseState,
    measurement: GaitMeasurement,
) -> bool:
    """True where a pressure is not what the valve was told long enough.

    A foot in the air or on its toes presses gas out of a vented chamber: those are judged while it stands flat. A full
    chamber vents for longer than ``vent_time`` through a narrow valve while the ankle compresses it, but it does vent.
    """
    no_rise_1 = (valve_times.filling_1 > rules.fill_time) & (measurement.pressure_1 < rules.filled_pressure)
    no_rise_2 = (valve_times.filling_2 > rules.fill_time) & (measurement.pressure_2 < rules.filled_pressure)
    stands = (phase.phase == MID_STANCE) & (phase.heel.loaded > 0.5)
    left = holds_pressure(rules, measurement.pressure_1, slow_pressures.pressure_1) | holds_pressure(
        rules, measurement.pressure_2, slow_pressures.pressure_2
    )
    return no_rise_1 | no_rise_2 | (stands & (valve_times.venting > rules.vent_time) & left)


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
    wrong = is_out_of_range(rules, measurement) | is_frozen(rules, readings, phase)
    wrong = wrong | contradicts_gait(rules, before, phase, toe_strides, steady)
    slow_pressures = next_slow_pressures(state.slow_pressures, measurement, period)
    fails = wrong | contradicts_valve(rules, state.valve_times, slow_pressures, phase, measurement)
    return SafetyState(
        vented=1.0 if fails else state.vented,
        readings=readings,
        toe_strides=toe_strides,
        steady=steady,
        valve_times=state.valve_times,
        slow_pressures=slow_pressures,
    )


def feed_time(since: float, opening: float, period: float) -> float:
    """How long a chamber has been fed [s], weighted by the opening towards it; 0 where the valve does not feed it."""
    return since + opening * period if opening > MINIMUM_OPENING else 0.0


def safe_command(state: SafetyState, command: float, period: float) -> tuple[float, SafetyState]:
    """The command to the valve [-], ``VENT`` once vented, and the state that records it for ``period`` [s]."""
    sent = VENT if state.vented > 0.5 else command
    vents = sent > VENTS_ABOVE
    opening = 0.0 if vents else max(-1.0, min(1.0, sent))
    valve_times = ValveTimes(
        feed_time(state.valve_times.filling_1, opening, period),
        feed_time(state.valve_times.filling_2, -opening, period),
        state.valve_times.venting + period if vents else 0.0,
    )
    return sent, SafetyState(
        vented=state.vented,
        readings=state.readings,
        toe_strides=state.toe_strides,
        steady=state.steady,
        valve_times=valve_times,
        slow_pressures=state.slow_pressures,
    )
