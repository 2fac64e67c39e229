"""Detection of the gait phase from two force sensors: landing, mid-stance, push-off or swing.

Each sensor is loaded above one threshold and unloaded below another (hysteresis), and a change counts only after it has
lasted for a time (debounce). The stride time between two heel strikes is a moving average. The push-off starts at a
fraction of the stride time, once the heel is off the ground, and ends at the next heel contact: a standing wearer is
not pushed.
"""

from typing import Annotated, NamedTuple

from ppafo.model.declaration import Number, quantities_of
from ppafo.model.helping import LANDING, MID_STANCE, PUSH_OFF, SWING

LONGEST_PHASE = 1.2
"""Longest duration of a phase in which the device acts [strides]."""


class PhaseRules(NamedTuple):
    """Thresholds [N], debounce [s], first stride time [s], weight of a new stride [-], start of push-off [turns]."""

    load_threshold: Annotated[float, Number("N", "force above which a sensor counts as loaded", 60.0, 1.0, 5.0e3)]
    unload_threshold: Annotated[float, Number("N", "force below which a sensor counts as unloaded", 30.0, 0.0, 5.0e3)]
    debounce: Annotated[float, Number("s", "time for which a change of load must last to count", 0.01, 0.0, 0.2)]
    first_stride_time: Annotated[
        float, Number("s", "assumed stride time until the first stride is measured", 1.1, 0.3, 5.0)
    ]
    stride_weight: Annotated[float, Number("1", "weight of a new stride in the moving average", 0.3, 0.0, 1.0)]
    push_off_start: Annotated[
        float, Number("1", "earliest start of push-off, as a fraction of the stride time", 0.4, 0.0, 1.0)
    ]


class DebouncedSensor(NamedTuple):
    """Debounced force sensor: loaded (1) or not (0), and time for which the reading has contradicted this state [s]."""

    loaded: float = 0.0
    contradicted: float = 0.0


class PhaseState(NamedTuple):
    """Phase, both sensors, time in the phase and since the last heel strike [s], stride time [s], number of strikes."""

    phase: float = SWING
    heel: DebouncedSensor = DebouncedSensor()
    toe: DebouncedSensor = DebouncedSensor()
    in_phase: float = 0.0
    since_strike: float = 0.0
    stride_time: float = 0.0
    strikes: float = 0.0


START = PhaseState()


def lifts(phase: float) -> bool:
    """Return whether the foot is lifted in a phase: swing (0) or landing (1). Tasks 1 and 3 of the paper."""
    return phase < 1.5


def lacks_event(phase: PhaseState) -> bool:
    """Return whether an event is missing: no heel strike yet, or a phase that has lasted for more than 1.2 strides."""
    return phase.strikes < 0.5 or phase.in_phase > LONGEST_PHASE * phase.stride_time


def next_sensor(rules: PhaseRules, sensor: DebouncedSensor, force: float, period: float) -> DebouncedSensor:
    """Debounced sensor after a sample of its force [N], taken every ``period`` [s]."""
    # Between both thresholds the state is kept.
    indicated = 0.0 if force < rules.unload_threshold else sensor.loaded
    indicated = 1.0 if force > rules.load_threshold else indicated
    # A change counts once it has lasted for the debounce time.
    contradicted = sensor.contradicted + period if indicated != sensor.loaded else 0.0
    changes = contradicted >= rules.debounce and indicated != sensor.loaded
    return DebouncedSensor(indicated if changes else sensor.loaded, 0.0 if changes else contradicted)


def next_phase(rules: PhaseRules, state: PhaseState, heel: float, toe: float, passed: float) -> float:
    """Next phase [-] from the present phase and both sensors (0 or 1), ``passed`` [s] after the strike."""
    on_heel = heel > 0.5
    on_toe = toe > 0.5
    late = passed >= rules.push_off_start * state.stride_time
    phase = state.phase
    after_swing = LANDING if on_heel else (MID_STANCE if on_toe else SWING)
    after_landing = MID_STANCE if on_toe else (LANDING if on_heel else SWING)
    leaves_ground = not on_heel and not on_toe
    rises = on_toe and not on_heel
    after_mid_stance = SWING if leaves_ground else (PUSH_OFF if late and rises else MID_STANCE)
    after_push_off = SWING if leaves_ground else (PUSH_OFF if rises else MID_STANCE)
    following = after_swing if phase == SWING else after_landing
    following = after_mid_stance if phase == MID_STANCE else following
    return after_push_off if phase == PUSH_OFF else following


def next_phase_state(
    rules: PhaseRules, state: PhaseState, heel_force: float, toe_force: float, period: float
) -> PhaseState:
    """Phase state after a sample of both forces [N], taken every ``period`` [s]."""
    heel = next_sensor(rules, state.heel, heel_force, period)
    toe = next_sensor(rules, state.toe, toe_force, period)
    since_strike = state.since_strike + period
    stride_time = state.stride_time if state.stride_time > 0.0 else rules.first_stride_time
    phase = next_phase(rules, state._replace(stride_time=stride_time), heel.loaded, toe.loaded, since_strike)
    # A foot that lands on its toes, or with a lost heel sensor, begins a stride too.
    strikes = state.phase == SWING and phase != SWING
    # Times outside of half and twice the mean are stops or missed strikes.
    is_plausible = state.strikes > 0.5 and since_strike > 0.5 * stride_time and since_strike < 2.0 * stride_time
    mean = stride_time + rules.stride_weight * (since_strike - stride_time) if is_plausible else stride_time
    return PhaseState(
        phase=phase,
        heel=heel,
        toe=toe,
        in_phase=0.0 if phase != state.phase else state.in_phase + period,
        since_strike=0.0 if strikes else since_strike,
        stride_time=mean if strikes else stride_time,
        strikes=state.strikes + (1.0 if strikes else 0.0),
    )


PHASE_QUANTITIES = quantities_of(PhaseRules)
