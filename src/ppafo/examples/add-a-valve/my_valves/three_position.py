"""Three-position valve: fully open one way, closed in the middle, fully open the other way."""

import math
from collections.abc import Mapping
from typing import NamedTuple

from ppafo.model.declaration import Quantity
from ppafo.model.plant import Openings, single_port_flow, single_port_flow_slopes, single_ports
from ppafo.model.valves.kind import VENTS_ABOVE, ValveKind, ValveModel


class ThreePosition(NamedTuple):
    """The size of the command [-] from which the valve opens."""

    threshold: float


class Position(NamedTuple):
    """Where the valve stands: -1, 0 or 1."""

    opening: float


def position_of(valve: ThreePosition, command: float) -> float:
    """Opening [-], -1, 0 or 1, that a command asks for; above 0 feeds chamber 1.

    A walk commands 2 (``VENT``) to vent both chambers, for which this valve has no position: it closes.
    """
    opens = (command >= valve.threshold) & (command <= VENTS_ABOVE)
    return 1.0 if opens else (-1.0 if command <= -valve.threshold else 0.0)


def advance(valve: ThreePosition, state: Position, command: float, time: float, step: float) -> tuple[float, Position]:
    """Opening during the step [-], and the valve at its end."""
    opening = position_of(valve, command)
    return opening, Position(opening)


def instant(valve: ThreePosition, state: Position, command: float) -> Openings:
    """Openings at an instant."""
    opening = position_of(valve, command)
    towards_1, towards_2 = max(opening, 0.0), max(-opening, 0.0)
    return Openings(source_1=towards_1, vent_1=towards_2, source_2=towards_2, vent_2=towards_1)


def rates(valve: ThreePosition, state: Position, command: float) -> Position:
    """Nothing moves by itself."""
    return Position(0.0)


def next_event(valve: ThreePosition, state: Position, command: float, time: float) -> float:
    """Nothing changes between two commands."""
    return math.inf


def settle(valve: ThreePosition, state: Position, command: float, time: float) -> Position:
    """The position that the command asks for."""
    return Position(position_of(valve, command))


def prepare(settings: Mapping[str, float]) -> ThreePosition:
    """Parameters of the valve."""
    return ThreePosition(settings["threshold"])


def closed() -> Position:
    """The valve before the first command."""
    return Position(0.0)


def no_dead_time(settings: Mapping[str, float]) -> float:
    """Dead time of the command [s]."""
    return 0.0


MODEL = ValveModel(
    parameters=ThreePosition,
    state=Position,
    prepare=prepare,
    initial=closed,
    advance=advance,
    connect=single_ports,
    port_flow=single_port_flow,
    port_flow_slopes=single_port_flow_slopes,
    jumps=False,
    shift=None,
    command_delay=no_dead_time,
    instant=instant,
    rates=rates,
    next_event=next_event,
    settle=settle,
)


def choose(settings: Mapping[str, float]) -> ValveModel:
    """The one model there is."""
    return MODEL


KIND = ValveKind(
    name="three_position",
    summary="One on/off valve with three positions, closed in the middle.",
    quantities=(Quantity("threshold", "", "size of the command that opens the valve", 0.5, 0.01, 1.0),),
    choose=choose,
)
