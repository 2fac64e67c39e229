"""Pair of solenoid valves: each connects its chamber to the source when energised and to the atmosphere when not.

A positive command energises valve A (chamber 1), a negative one valve B (chamber 2), 0 neither: both chambers vent and
the foot moves freely. A coil accepts a change at most once per switching interval; the flow changes after the opening
or closing delay, and the change is lost if the coil gets another command before that.
"""

from dataclasses import replace
from typing import Annotated, Any, NamedTuple

from ppafo.model.declaration import EmptyRow, Number
from ppafo.model.plant import (
    Openings,
    PlantParameters,
    SinglePort,
    blended_ports,
    direction_of,
    open_path,
    single_port_flow,
)
from ppafo.model.ports import opening_time
from ppafo.model.valves.kind import VENTS_ABOVE, ValveKind, ValveModel, never

# Long ago, never, and two instants that are one [s]: times of a run are sums of floats, good to far below 1 ns.
NEVER = -1.0e9
FOREVER = 1.0e9
SAME_INSTANT = 1.0e-9


OpeningDelay = Annotated[float, Number("s", "time from energising to flow from the source", 0.0, 0.0, 0.2)]
ClosingDelay = Annotated[float, Number("s", "time from de-energising to venting", 0.0, 0.0, 0.2)]
SwitchingInterval = Annotated[float, Number("s", "shortest time between two switchings of one valve", 0.0, 0.0, 1.0)]


class PairPositions(NamedTuple):
    """Positions of both valves: 1 connected to the source, 0 to the atmosphere. Both start off."""

    position_a: float = 0.0
    position_b: float = 0.0


class TimedSolenoid(NamedTuple):
    """Opening and closing delay and shortest time between two switchings of one coil [s]."""

    opening_delay: OpeningDelay
    closing_delay: ClosingDelay
    switching_interval: SwitchingInterval


class Coil(NamedTuple):
    """Coil of an on/off valve: present and commanded position (0 or 1), times of command and response [s].

    The initial coil was switched off long ago: it accepts the first command at once, whatever the interval.
    """

    position: float = 0.0
    target: float = 0.0
    accepted_time: float = NEVER
    change_time: float = NEVER


class PairState(NamedTuple):
    """State of a pair of valves: one coil for each chamber."""

    coil_a: Coil = Coil()
    coil_b: Coil = Coil()


def energised_valve(command: float) -> float:
    """Valve that a command energises, equation (14)'s two voltages [-]: 1 valve A, -1 valve B, 0 neither, to vent."""
    return 0.0 if command > VENTS_ABOVE else direction_of(command)


def coil_commands(command: float) -> PairPositions:
    """Positions [-] that a command requests of both valves."""
    valve = energised_valve(command)
    return PairPositions(1.0 if valve > 0.5 else 0.0, 1.0 if valve < -0.5 else 0.0)


def advance_ideal(
    valve: EmptyRow, state: PairPositions, command: float, time: float, step: float
) -> tuple[PairPositions, PairPositions]:
    """Positions [-] during the step [s] of a pair without delays, and the state."""
    positions = coil_commands(command)
    return positions, positions


def connect_positions(plant: PlantParameters, shown: PairPositions) -> tuple[SinglePort, SinglePort]:
    """Open paths of ``blended_ports`` for constant positions; one full area each."""
    port_1, port_2 = blended_ports(plant, Openings(1.0, 1.0, 1.0, 1.0))
    return open_path(port_1, shown.position_a > 0.5), open_path(port_2, shown.position_b > 0.5)


def accept_time(coil: Coil, switching_interval: float, time: float) -> float:
    """Time [s] at which a coil accepts a new command given at ``time``."""
    return max(time, coil.accepted_time + switching_interval)


def command_coil(valve: TimedSolenoid, coil: Coil, wanted: float, time: float, opening_delay: float) -> Coil:
    """Coil at ``time`` [s] with a pending command: the flow changes if due, then the command is accepted if possible.

    A pending change is lost when the coil gets another command.
    """
    # The due change first: an order at the same instant would otherwise cancel a flow that has already moved.
    position = coil.target if coil.change_time <= time + SAME_INSTANT else coil.position
    accepts = wanted != coil.target and accept_time(coil, valve.switching_interval, time) <= time + SAME_INSTANT
    delay = opening_delay if wanted > 0.5 else valve.closing_delay
    # Without a delay the flow follows in the same call, since no later event is scheduled for it.
    at_once = accepts and delay <= SAME_INSTANT
    return Coil(
        position=wanted if at_once else position,
        target=wanted if accepts else coil.target,
        accepted_time=time if accepts else coil.accepted_time,
        change_time=time + delay if accepts else coil.change_time,
    )


def next_coil_event(valve: TimedSolenoid, coil: Coil, wanted: float, time: float) -> float:
    """Time [s] at which a coil next accepts a pending command or its flow changes; huge for never."""
    order = accept_time(coil, valve.switching_interval, time) if wanted != coil.target else FOREVER
    change = coil.change_time if coil.position != coil.target else FOREVER
    return min(order, change)


def settle_timed(valve: TimedSolenoid, state: PairState, command: float, time: float) -> PairState:
    """Both coils after the changes and commands that are due at ``time`` [s]."""
    wanted = coil_commands(command)
    return PairState(
        command_coil(valve, state.coil_a, wanted.position_a, time, opening_time(valve.opening_delay, 1.0)),
        command_coil(valve, state.coil_b, wanted.position_b, time, opening_time(valve.opening_delay, 0.0)),
    )


def next_timed_event(valve: TimedSolenoid, state: PairState, command: float, time: float) -> float:
    """Time [s] at which a coil next accepts a pending command or its flow changes; huge for never."""
    wanted = coil_commands(command)
    event_a = next_coil_event(valve, state.coil_a, wanted.position_a, time)
    return min(event_a, next_coil_event(valve, state.coil_b, wanted.position_b, time))


def advance_timed(
    valve: TimedSolenoid, state: PairState, command: float, time: float, step: float
) -> tuple[PairPositions, PairState]:
    """Positions [-] during one part [s] of a step, after all changes that are due at its start, and both coils."""
    settled = settle_timed(valve, state, command, time)
    return PairPositions(settled.coil_a.position, settled.coil_b.position), settled


def pair_openings(position_a: float, position_b: float) -> Openings:
    """Openings [-] of a pair at two positions."""
    return Openings(source_1=position_a, vent_1=1.0 - position_a, source_2=position_b, vent_2=1.0 - position_b)


def instant_ideal(valve: EmptyRow, state: PairPositions, command: float) -> Openings:
    """Openings [-] at an instant of a pair without delays."""
    wanted = coil_commands(command)
    return pair_openings(wanted.position_a, wanted.position_b)


def rates_ideal(valve: EmptyRow, state: PairPositions, command: float) -> PairPositions:
    """Rates [1/s] of the positions, which are 0."""
    return PairPositions(0.0, 0.0)


def settle_ideal(valve: EmptyRow, state: PairPositions, command: float, time: float) -> PairPositions:
    """Positions [-] that the command requests."""
    return coil_commands(command)


def instant_timed(valve: TimedSolenoid, state: PairState, command: float) -> Openings:
    """Openings [-] of the pair with delays at an instant."""
    return pair_openings(state.coil_a.position, state.coil_b.position)


def rates_timed(valve: TimedSolenoid, state: PairState, command: float) -> PairState:
    """Rates [1/s] of the state, which are 0 between two events."""
    still = Coil(position=0.0, target=0.0, accepted_time=0.0, change_time=0.0)
    return PairState(still, still)


def prepare_ideal(settings: TimedSolenoid) -> EmptyRow:
    """Parameters of the ideal pair from ``settings`` [SI]."""
    return EmptyRow()


def prepare_timed(settings: TimedSolenoid) -> TimedSolenoid:
    """Parameters [s] of the pair with delays."""
    return TimedSolenoid(settings.opening_delay, settings.closing_delay, settings.switching_interval)


def no_dead_time(settings: Any) -> float:
    """Dead time of the command [s]: 0, because the delays belong to the coils."""
    return 0.0


def lag(settings: TimedSolenoid) -> float:
    """Time [s] until a valve has closed: its closing delay plus the wait for the next possible switching."""
    return settings.closing_delay + settings.switching_interval


IDEAL = ValveModel(
    parameters=EmptyRow,
    state=PairPositions,
    prepare=prepare_ideal,
    advance=advance_ideal,
    connect=connect_positions,
    port_flow=single_port_flow,
    jumps=False,
    shift=None,
    command_delay=no_dead_time,
    instant=instant_ideal,
    rates=rates_ideal,
    next_event=never,
    settle=settle_ideal,
)

TIMED = replace(
    IDEAL,
    parameters=TimedSolenoid,
    state=PairState,
    prepare=prepare_timed,
    advance=advance_timed,
    jumps=True,
    instant=instant_timed,
    rates=rates_timed,
    next_event=next_timed_event,
    settle=settle_timed,
)


def choose(settings: TimedSolenoid) -> ValveModel:
    """Ideal model if all times [s] are 0, else the model with delays."""
    return TIMED if any(value > 0.0 for value in settings) else IDEAL


KIND = ValveKind(
    name="solenoid",
    summary="Two on/off valves, one for each chamber; both off vents both chambers.",
    settings=TimedSolenoid,
    choose=choose,
    lag=lag,
    vents_at_rest=True,
)
