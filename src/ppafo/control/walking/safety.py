"""When a controller of walking stops trusting its sensors and vents both chambers for good.

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


class Ordered(NamedTuple):
    """How long the valve has now been told to fill chambers 1 and 2, by its opening, and to vent both [s]."""

    filling_1: float
    filling_2: float
    venting: float


class Shown(NamedTuple):
    """Last readings of heel, toe [N] and angle [rad], and how long each has not changed [s]."""

    heel_force: float
    toe_force: float
    angle: float
    heel_still: float
    toe_still: float
    angle_still: float


class Followed(NamedTuple):
    """Chamber pressures as readings followed with ``FALL_TIME`` [Pa]: above a reading that falls."""

    pressure_1: float
    pressure_2: float


class SafetyState(NamedTuple):
    """1 once vented; last readings; strides in a row that began on the toes; what the valve was told; slow pressures.

    ``steady`` is 1 where the last stride took about the stride time.
    """

    vented: float
    shown: Shown
    toe_strides: float
    steady: float
    ordered: Ordered
    followed: Followed


START = SafetyState(
    vented=0.0,
    shown=Shown(heel_force=0.0, toe_force=0.0, angle=0.0, heel_still=0.0, toe_still=0.0, angle_still=0.0),
    toe_strides=0.0,
    steady=0.0,
    ordered=Ordered(0.0, 0.0, 0.0),
    followed=Followed(0.0, 0.0),
)

STEADY = 0.1
"""A stride that is longer or shorter than the stride time by less than this share of it is a usual one."""

FALL_TIME = 0.03
"""Time constant [s] of the pressures that tell whether a reading falls."""

FALLS = 0.03
"""A reading falls that is below its slow pressure by more than this share: a venting chamber at 140 kPa by 0.1."""

LEAST_OPENING = 0.1
"""Commands below this may lie within the overlap of a valve: they do not count as opening it."""


def still(last: float, reading: float, since: float, period: float) -> float:
    """How long a reading has been the same to the last bit [s]."""
    return since + period if reading == last else 0.0


def next_shown(last: Shown, seen: GaitMeasurement, period: float) -> Shown:
    """Readings after a sample."""
    return Shown(
        heel_force=seen.heel_force,
        toe_force=seen.toe_force,
        angle=seen.angle,
        heel_still=still(last.heel_force, seen.heel_force, last.heel_still, period),
        toe_still=still(last.toe_force, seen.toe_force, last.toe_still, period),
        angle_still=still(last.angle, seen.angle, last.angle_still, period),
    )


def out_of_range(rules: SafetyRules, seen: GaitMeasurement) -> bool:
    """True where a reading is none that foot or chamber can give."""
    force = max(seen.heel_force, seen.toe_force) > rules.largest_force
    angle = (seen.angle < rules.lowest_angle) | (seen.angle > rules.highest_angle)
    low, high = min(seen.pressure_1, seen.pressure_2), max(seen.pressure_1, seen.pressure_2)
    return force | angle | (low < rules.lowest_pressure) | (high > rules.highest_pressure)


def frozen(rules: SafetyRules, shown: Shown, phase: PhaseState) -> bool:
    """True where a reading stays the same while it must change.

    An unloaded force sensor shows the same for long, and so does the angle of a foot that is held in the swing.
    """
    heel = (shown.heel_still > rules.frozen_time) & (phase.heel.loaded > 0.5)
    toe = (shown.toe_still > rules.frozen_time) & (phase.toe.loaded > 0.5)
    return heel | toe | ((shown.angle_still > rules.frozen_time) & (phase.phase != SWING))


def contradicts_gait(
    rules: SafetyRules, before: PhaseState, phase: PhaseState, toe_strides: float, steady: float
) -> bool:
    """True where forces do not follow each other as in a gait."""
    endless = phase.in_phase > rules.longest_phase * phase.stride_time
    skips_toes = (before.phase == LANDING) & (phase.phase == SWING) & (phase.strikes > 1.5)
    begun = phase.since_strike > rules.flat_from * phase.stride_time
    flat = begun & (phase.since_strike < rules.flat_to * phase.stride_time) & (steady > 0.5)
    lost = flat & (min(phase.heel.loaded, phase.toe.loaded) < 0.5)
    return endless | skips_toes | lost | (toe_strides > rules.most_toe_strides)


def next_followed(last: Followed, seen: GaitMeasurement, period: float) -> Followed:
    """Slow pressures after a sample."""
    share = period / (period + FALL_TIME)
    return Followed(
        last.pressure_1 + (seen.pressure_1 - last.pressure_1) * share,
        last.pressure_2 + (seen.pressure_2 - last.pressure_2) * share,
    )


def remains(rules: SafetyRules, pressure: float, slow: float) -> bool:
    """True where a vented chamber shows a pressure [Pa] that does not fall."""
    return (pressure > rules.filled_pressure) & (slow <= (1.0 + FALLS) * pressure)


def contradicts_valve(
    rules: SafetyRules, ordered: Ordered, followed: Followed, phase: PhaseState, seen: GaitMeasurement
) -> bool:
    """True where a pressure is not what the valve was told long enough.

    A foot in the air or on its toes presses gas out of a vented chamber: those are judged while it stands flat. A full
    chamber vents for longer than ``vent_time`` through a narrow valve while the ankle compresses it, but it does vent.
    """
    no_rise_1 = (ordered.filling_1 > rules.fill_time) & (seen.pressure_1 < rules.filled_pressure)
    no_rise_2 = (ordered.filling_2 > rules.fill_time) & (seen.pressure_2 < rules.filled_pressure)
    stands = (phase.phase == MID_STANCE) & (phase.heel.loaded > 0.5)
    left = remains(rules, seen.pressure_1, followed.pressure_1) | remains(rules, seen.pressure_2, followed.pressure_2)
    return no_rise_1 | no_rise_2 | (stands & (ordered.venting > rules.vent_time) & left)


def watched(
    rules: SafetyRules, state: SafetyState, before: PhaseState, phase: PhaseState, seen: GaitMeasurement, period: float
) -> SafetyState:
    """State after a sample; ``before`` and ``phase`` are the phases before and after it."""
    shown = next_shown(state.shown, seen, period)
    enters = (before.phase == SWING) & (phase.phase != SWING)
    on_toes = phase.phase == MID_STANCE
    toe_strides = (state.toe_strides + 1.0 if on_toes else 0.0) if enters else state.toe_strides
    usual = abs(before.since_strike - phase.stride_time) < STEADY * phase.stride_time
    steady = (1.0 if usual else 0.0) if enters else state.steady
    wrong = out_of_range(rules, seen) | frozen(rules, shown, phase)
    wrong = wrong | contradicts_gait(rules, before, phase, toe_strides, steady)
    followed = next_followed(state.followed, seen, period)
    fails = wrong | contradicts_valve(rules, state.ordered, followed, phase, seen)
    return SafetyState(
        vented=1.0 if fails else state.vented,
        shown=shown,
        toe_strides=toe_strides,
        steady=steady,
        ordered=state.ordered,
        followed=followed,
    )


def fed(since: float, opening: float, period: float) -> float:
    """How long a chamber has now been fed [s], by the opening towards it; 0 where the valve is shut or empties it."""
    return since + opening * period if opening > LEAST_OPENING else 0.0


def carried_out(state: SafetyState, command: float, period: float) -> tuple[float, SafetyState]:
    """The command that goes to the valve, ``VENT`` once vented, and the state that remembers it."""
    given = VENT if state.vented > 0.5 else command
    vents = given > VENTS_ABOVE
    opening = 0.0 if vents else max(-1.0, min(1.0, given))
    ordered = Ordered(
        fed(state.ordered.filling_1, opening, period),
        fed(state.ordered.filling_2, -opening, period),
        state.ordered.venting + period if vents else 0.0,
    )
    return given, SafetyState(
        vented=state.vented,
        shown=state.shown,
        toe_strides=state.toe_strides,
        steady=state.steady,
        ordered=ordered,
        followed=state.followed,
    )
