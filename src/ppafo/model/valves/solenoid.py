"""Pair of solenoid valves: each joins its chamber to the source when energised and to the atmosphere when not.

A command above 0 energises valve A (chamber 1), below 0 valve B (chamber 2), 0 neither: both chambers vent and the
foot moves freely. A coil accepts a change at most once in every switching interval; the change reaches the flow after
the opening or closing delay, and is lost if the coil is told otherwise before that.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

from ppafo.model.declaration import Quantity
from ppafo.model.plant import Openings, PlantParameters, blended_ports
from ppafo.model.ports import (
    SinglePort,
    blended_port_flow,
    blended_port_flow_slopes,
    single_port_flow,
    single_port_flow_slopes,
)
from ppafo.model.valves.kind import ValveKind, ValveModel

NEVER = -1.0e9
SAME_INSTANT = 1.0e-9


class IdealSolenoid(NamedTuple):
    """An ideal pair has one parameter for form's sake: a threshold on the command [-]."""

    threshold: float


class PairPositions(NamedTuple):
    """1 where a valve joins its chamber to the source, 0 where to the atmosphere."""

    position_a: float
    position_b: float


class TimedSolenoid(NamedTuple):
    """Opening and closing delay and shortest time between two switchings of one coil [s]."""

    opening_delay: float
    closing_delay: float
    switching_interval: float


class Coil(NamedTuple):
    """Where the flow is (0 or 1), where the coil was told to go, when it was told and when the flow follows [s]."""

    position: float
    target: float
    accepted_time: float
    change_time: float


class PairState(NamedTuple):
    """Both coils."""

    coil_a: Coil
    coil_b: Coil


def energised(command: float) -> tuple[float, float]:
    """What a command asks of valves A and B: 1 energised, 0 not. Equation (14)'s two voltages."""
    return (1.0 if command > 0.0 else 0.0), (1.0 if command < 0.0 else 0.0)


def advance_ideal(
    valve: IdealSolenoid, state: PairPositions, command: float, time: float, step: float
) -> tuple[PairPositions, PairPositions]:
    """Positions during the step of a pair that follows its command at once."""
    position_a, position_b = energised(command)
    positions = PairPositions(position_a, position_b)
    return positions, positions


def connect_positions(plant: PlantParameters, shown: PairPositions) -> tuple[SinglePort, SinglePort]:
    """Ports of both chambers for a pair that stands still; one full area each. Equation (8)."""
    node_1 = plant.supply_pressure if shown.position_a > 0.5 else plant.atmospheric_pressure
    node_2 = plant.dorsiflexion_pressure if shown.position_b > 0.5 else plant.atmospheric_pressure
    port_1 = SinglePort(plant.valve_conductance, node_1, shown.position_a)
    port_2 = SinglePort(plant.valve_conductance, node_2, shown.position_b)
    return port_1, port_2


def open_time(coil: Coil, begin: float, end: float) -> tuple[float, float]:
    """Time [s] between ``begin`` and ``end`` that a coil left alone spends open, and its position at the end."""
    changes = coil.position != coil.target and coil.change_time < end - SAME_INSTANT
    change = max(begin, min(end, coil.change_time)) if changes else end
    after = coil.target if changes else coil.position
    return coil.position * (change - begin) + after * (end - change), after


def accept_time(coil: Coil, switching_interval: float, time: float) -> float:
    """Time [s] at which a coil takes a new order that stands at ``time``."""
    return max(time, coil.accepted_time + switching_interval)


def advance_coil(valve: TimedSolenoid, coil: Coil, wanted: float, time: float, step: float) -> tuple[float, Coil]:
    """Share of the step [-] that one valve is open to the source, exact, and the coil at the end of the step."""
    end = time + step
    at = accept_time(coil, valve.switching_interval, time)
    accepts = wanted != coil.target and at < end - SAME_INSTANT
    until = at if accepts else end
    before, position = open_time(coil, time, until)
    delay = valve.opening_delay if wanted > 0.5 else valve.closing_delay
    target = wanted if accepts else coil.target
    accepted = at if accepts else coil.accepted_time
    change = at + delay if accepts else coil.change_time
    told = Coil(position, target, accepted, change)
    after, position = open_time(told, until, end)
    return (before + after) / step, Coil(position, target, accepted, change)


def advance_timed(
    valve: TimedSolenoid, state: PairState, command: float, time: float, step: float
) -> tuple[Openings, PairState]:
    """Mean openings during the step and both coils at its end."""
    wanted_a, wanted_b = energised(command)
    share_a, coil_a = advance_coil(valve, state.coil_a, wanted_a, time, step)
    share_b, coil_b = advance_coil(valve, state.coil_b, wanted_b, time, step)
    return Openings(share_a, 1.0 - share_a, share_b, 1.0 - share_b), PairState(coil_a, coil_b)


def instant_ideal(valve: IdealSolenoid, state: PairPositions, command: float) -> Openings:
    """Openings at an instant of a pair that follows its command at once."""
    position_a, position_b = energised(command)
    return Openings(position_a, 1.0 - position_a, position_b, 1.0 - position_b)


def rates_ideal(valve: IdealSolenoid, state: PairPositions, command: float) -> PairPositions:
    """Nothing moves by itself."""
    return PairPositions(0.0, 0.0)


def never_ideal(valve: IdealSolenoid, state: PairPositions, command: float, time: float) -> float:
    """Nothing changes between two commands."""
    return math.inf


def settle_ideal(valve: IdealSolenoid, state: PairPositions, command: float, time: float) -> PairPositions:
    """The positions that the command asks for."""
    return PairPositions(*energised(command))


def instant_timed(valve: TimedSolenoid, state: PairState, command: float) -> Openings:
    """Openings at an instant."""
    position_a, position_b = state.coil_a.position, state.coil_b.position
    return Openings(position_a, 1.0 - position_a, position_b, 1.0 - position_b)


def rates_timed(valve: TimedSolenoid, state: PairState, command: float) -> PairState:
    """Nothing moves between two events."""
    still = Coil(0.0, 0.0, 0.0, 0.0)
    return PairState(still, still)


def next_timed_event(valve: TimedSolenoid, state: PairState, command: float, time: float) -> float:
    """Time [s] at which a coil next takes a waiting order or its flow changes."""
    wanted_a, wanted_b = energised(command)
    return min(
        next_coil_event(valve, state.coil_a, wanted_a, time), next_coil_event(valve, state.coil_b, wanted_b, time)
    )


def next_coil_event(valve: TimedSolenoid, coil: Coil, wanted: float, time: float) -> float:
    """As ``next_timed_event``, for one coil."""
    order = accept_time(coil, valve.switching_interval, time) if wanted != coil.target else math.inf
    change = coil.change_time if coil.position != coil.target else math.inf
    return min(order, change)


def settle_timed(valve: TimedSolenoid, state: PairState, command: float, time: float) -> PairState:
    """Both coils after the changes and orders that are due at ``time`` [s]."""
    wanted_a, wanted_b = energised(command)
    return PairState(settle_coil(valve, state.coil_a, wanted_a, time), settle_coil(valve, state.coil_b, wanted_b, time))


def settle_coil(valve: TimedSolenoid, coil: Coil, wanted: float, time: float) -> Coil:
    """As ``settle_timed``, for one coil: the flow changes first, then an order is taken and may act at once."""
    now = time + SAME_INSTANT
    position = coil.target if coil.change_time <= now else coil.position
    if wanted == coil.target or accept_time(coil, valve.switching_interval, time) > now:
        return Coil(position, coil.target, coil.accepted_time, coil.change_time)
    delay = valve.opening_delay if wanted > 0.5 else valve.closing_delay
    position = wanted if delay <= SAME_INSTANT else position
    return Coil(position, wanted, time, time + delay)


def prepare_ideal(settings: Mapping[str, float], step: float) -> IdealSolenoid:
    """Parameters of the ideal pair."""
    return IdealSolenoid(0.0)


def prepare_timed(settings: Mapping[str, float], step: float) -> TimedSolenoid:
    """Parameters of the pair with delays."""
    return TimedSolenoid(settings["opening_delay"], settings["closing_delay"], settings["switching_interval"])


def both_off() -> PairPositions:
    """An ideal pair with both valves off."""
    return PairPositions(0.0, 0.0)


def both_off_long_ago() -> PairState:
    """Two coils that were switched off long ago."""
    coil = Coil(0.0, 0.0, NEVER, NEVER)
    return PairState(coil, coil)


def no_dead_time(settings: Mapping[str, float]) -> float:
    """Dead time of the command [s]: none, the delays belong to the coils."""
    return 0.0


IDEAL = ValveModel(
    parameters=IdealSolenoid,
    state=PairPositions,
    prepare=prepare_ideal,
    initial=both_off,
    advance=advance_ideal,
    connect=connect_positions,
    port_flow=single_port_flow,
    port_flow_slopes=single_port_flow_slopes,
    command_delay=no_dead_time,
    instant=instant_ideal,
    rates=rates_ideal,
    next_event=never_ideal,
    settle=settle_ideal,
)

TIMED = ValveModel(
    parameters=TimedSolenoid,
    state=PairState,
    prepare=prepare_timed,
    initial=both_off_long_ago,
    advance=advance_timed,
    connect=blended_ports,
    port_flow=blended_port_flow,
    port_flow_slopes=blended_port_flow_slopes,
    command_delay=no_dead_time,
    instant=instant_timed,
    rates=rates_timed,
    next_event=next_timed_event,
    settle=settle_timed,
)


def choose(settings: Mapping[str, float]) -> ValveModel:
    """The ideal model where no time matters, else the timed one."""
    return TIMED if any(value > 0.0 for value in settings.values()) else IDEAL


KIND = ValveKind(
    name="solenoid",
    summary="Two on/off valves, one for each chamber; both off vents both chambers.",
    quantities=(
        Quantity("opening_delay", "s", "time from energising to flow from the source", 0.0, 0.0, 0.2),
        Quantity("closing_delay", "s", "time from de-energising to venting", 0.0, 0.0, 0.2),
        Quantity("switching_interval", "s", "shortest time between two switchings of one valve", 0.0, 0.0, 1.0),
    ),
    choose=choose,
)
