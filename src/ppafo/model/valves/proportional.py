"""Proportional spool valve: ideal, or with dead band, dead time, second-order spool and slew limit.

The spool obeys x'' = w^2 (u - x) - 2 d w x', with |x'| held at the slew limit. Between samples the command u is
constant, so one step of the linear spool is exact: a constant matrix, worked out once for each step size.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

from ppafo.model.declaration import Quantity
from ppafo.model.plant import Openings, blended_ports, single_ports
from ppafo.model.ports import (
    blended_port_flow,
    blended_port_flow_slopes,
    single_port_flow,
    single_port_flow_slopes,
)
from ppafo.model.valves.kind import ValveKind, ValveModel

NO_SLEW_LIMIT = 1.0e12
SAME_INSTANT = 1.0e-11


class IdealProportional(NamedTuple):
    """Parameters of a valve that follows its command at once: the dead band [-]."""

    dead_band: float


class NoValveState(NamedTuple):
    """An ideal valve remembers only what it shows: its opening from -1 to 1."""

    opening: float


class MovingProportional(NamedTuple):
    """Dead band [-], slew limit [1/s], undamped frequency [Hz] and damping ratio [-] of the spool, and its exact step.

    The step gives next x, next x' and mean x from x and x', both as offsets from the target.
    """

    dead_band: float
    slew_limit: float
    frequency: float
    damping_ratio: float
    next_by_opening: float
    next_by_rate: float
    rate_by_opening: float
    rate_by_rate: float
    mean_by_opening: float
    mean_by_rate: float


class SpoolState(NamedTuple):
    """Opening of the spool from -1 to 1 and its rate [1/s]."""

    opening: float
    rate: float


def opening_of_command(command: float, dead_band: float) -> float:
    """Opening [-], -1 to 1, that a command asks for: nothing inside the dead band, all at full command."""
    size = max(min(abs(command), 1.0) - dead_band, 0.0) / (1.0 - dead_band)
    return size if command >= 0.0 else -size


def advance_ideal(
    valve: IdealProportional, state: NoValveState, command: float, time: float, step: float
) -> tuple[float, NoValveState]:
    """Opening during the step [-], -1 to 1, of a valve without dynamics."""
    opening = opening_of_command(command, valve.dead_band)
    return opening, NoValveState(opening)


def advance_moving(
    valve: MovingProportional, state: SpoolState, command: float, time: float, step: float
) -> tuple[Openings, SpoolState]:
    """Mean openings during the step and the spool at its end; exact for a linear spool that keeps its side."""
    target = opening_of_command(command, valve.dead_band)
    away = state.opening - target
    linear = target + valve.next_by_opening * away + valve.next_by_rate * state.rate
    rate = valve.rate_by_opening * away + valve.rate_by_rate * state.rate
    reach = valve.slew_limit * step
    move = linear - state.opening
    limited = max(-reach, min(reach, move))
    unlimited = limited == move
    opening = state.opening + limited
    trapezoid = 0.5 * (state.opening + opening)
    exact = target + valve.mean_by_opening * away + valve.mean_by_rate * state.rate
    mean = max(-1.0, min(1.0, exact if unlimited else trapezoid))
    same_side = state.opening * opening >= 0.0
    towards_1 = max(mean, 0.0) if same_side else 0.5 * (max(state.opening, 0.0) + max(opening, 0.0))
    towards_2 = max(-mean, 0.0) if same_side else 0.5 * (max(-state.opening, 0.0) + max(-opening, 0.0))
    next_rate = max(-valve.slew_limit, min(valve.slew_limit, rate))
    return Openings(towards_1, towards_2, towards_2, towards_1), SpoolState(opening, next_rate)


def spool_acceleration(opening: float, rate: float, target: float, frequency: float, damping_ratio: float) -> float:
    """Second derivative of the opening [1/s^2] of a spool with undamped frequency [Hz] towards a target opening."""
    angular = 2.0 * math.pi * frequency
    return angular * angular * (target - opening) - 2.0 * damping_ratio * angular * rate


def openings_of(opening: float) -> Openings:
    """Shares of the full area for an opening from -1 to 1 (clipped there); above 0 feeds chamber 1. Equation (8)."""
    clipped = max(-1.0, min(1.0, opening))
    towards_1 = max(clipped, 0.0)
    towards_2 = max(-clipped, 0.0)
    return Openings(towards_1, towards_2, towards_2, towards_1)


def instant_ideal(valve: IdealProportional, state: NoValveState, command: float) -> Openings:
    """Openings at an instant of a valve that follows its command at once."""
    return openings_of(opening_of_command(command, valve.dead_band))


def rates_ideal(valve: IdealProportional, state: NoValveState, command: float) -> NoValveState:
    """Nothing moves by itself."""
    return NoValveState(0.0)


def never_ideal(valve: IdealProportional, state: NoValveState, command: float, time: float) -> float:
    """Nothing changes between two commands."""
    return math.inf


def settle_ideal(valve: IdealProportional, state: NoValveState, command: float, time: float) -> NoValveState:
    """The opening that the command asks for."""
    return NoValveState(opening_of_command(command, valve.dead_band))


def instant_moving(valve: MovingProportional, state: SpoolState, command: float) -> Openings:
    """Openings at an instant."""
    return openings_of(state.opening)


def rates_moving(valve: MovingProportional, state: SpoolState, command: float) -> SpoolState:
    """Rate of the opening [1/s], held at the slew limit, and its derivative [1/s^2]."""
    target = opening_of_command(command, valve.dead_band)
    if valve.frequency == 0.0:
        way = 1.0 if target > state.opening else -1.0
        return SpoolState(0.0 if target == state.opening else way * valve.slew_limit, 0.0)
    rate = max(-valve.slew_limit, min(valve.slew_limit, state.rate))
    acceleration = spool_acceleration(state.opening, rate, target, valve.frequency, valve.damping_ratio)
    held = (state.rate >= valve.slew_limit and acceleration > 0.0) or (
        state.rate <= -valve.slew_limit and acceleration < 0.0
    )
    return SpoolState(rate, 0.0 if held else acceleration)


def next_moving_event(valve: MovingProportional, state: SpoolState, command: float, time: float) -> float:
    """Time [s] at which a spool that only slews arrives at its target."""
    target = opening_of_command(command, valve.dead_band)
    if valve.frequency > 0.0 or target == state.opening:
        return math.inf
    return time + abs(target - state.opening) / valve.slew_limit


def settle_moving(valve: MovingProportional, state: SpoolState, command: float, time: float) -> SpoolState:
    """A spool without inertia that is at its target, or has no slew limit, stands there."""
    target = opening_of_command(command, valve.dead_band)
    arrives = abs(target - state.opening) <= SAME_INSTANT * valve.slew_limit
    return SpoolState(target, 0.0) if valve.frequency == 0.0 and arrives else state


def prepare_ideal(settings: Mapping[str, float], step: float) -> IdealProportional:
    """Parameters of the ideal valve."""
    return IdealProportional(settings["dead_band"])


def prepare_moving(settings: Mapping[str, float], step: float) -> MovingProportional:
    """Parameters of the moving valve for steps of ``step`` [s]: the exact transition of the spool."""
    limit = settings["slew_limit"] or NO_SLEW_LIMIT
    if settings["spool_frequency"] == 0.0:
        return MovingProportional(settings["dead_band"], limit, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    frequency, damping_ratio = settings["spool_frequency"], settings["spool_damping_ratio"]
    transition = _spool_transition(2.0 * math.pi * frequency, damping_ratio, step)
    return MovingProportional(settings["dead_band"], limit, frequency, damping_ratio, *transition)


def _spool_transition(angular: float, damping_ratio: float, step: float) -> tuple[float, ...]:
    """Exact next offset, next rate and mean offset of a free second-order spool, by offset and by rate."""
    decay = damping_ratio * angular
    squared = angular * angular - decay * decay
    root = math.sqrt(abs(squared))
    if root * step < 1.0e-6:
        cosine, sine = 1.0, step
    elif squared > 0.0:
        cosine, sine = math.cos(root * step), math.sin(root * step) / root
    else:
        cosine, sine = math.cosh(root * step), math.sinh(root * step) / root
    fade = math.exp(-decay * step)
    next_by_opening = fade * (cosine + decay * sine)
    next_by_rate = fade * sine
    rate_by_opening = -angular * angular * next_by_rate
    rate_by_rate = fade * (cosine - decay * sine)
    # The mean offset follows from integrating x'' + 2 d w x' + w^2 x = 0 once.
    mean_by_opening = (2.0 * decay * (1.0 - next_by_opening) - rate_by_opening) / (angular**2 * step)
    mean_by_rate = (1.0 - rate_by_rate - 2.0 * decay * next_by_rate) / (angular**2 * step)
    return next_by_opening, next_by_rate, rate_by_opening, rate_by_rate, mean_by_opening, mean_by_rate


def closed_at_rest() -> SpoolState:
    """A spool at rest in the middle."""
    return SpoolState(0.0, 0.0)


def closed() -> NoValveState:
    """An ideal valve that is closed."""
    return NoValveState(0.0)


def dead_time(settings: Mapping[str, float]) -> float:
    """Dead time of the command [s]."""
    return settings["delay"]


IDEAL = ValveModel(
    parameters=IdealProportional,
    state=NoValveState,
    prepare=prepare_ideal,
    initial=closed,
    advance=advance_ideal,
    connect=single_ports,
    port_flow=single_port_flow,
    port_flow_slopes=single_port_flow_slopes,
    command_delay=dead_time,
    instant=instant_ideal,
    rates=rates_ideal,
    next_event=never_ideal,
    settle=settle_ideal,
)

MOVING = ValveModel(
    parameters=MovingProportional,
    state=SpoolState,
    prepare=prepare_moving,
    initial=closed_at_rest,
    advance=advance_moving,
    connect=blended_ports,
    port_flow=blended_port_flow,
    port_flow_slopes=blended_port_flow_slopes,
    command_delay=dead_time,
    instant=instant_moving,
    rates=rates_moving,
    next_event=next_moving_event,
    settle=settle_moving,
)


def choose(settings: Mapping[str, float]) -> ValveModel:
    """The ideal model where nothing moves, else the moving one."""
    at_once = settings["spool_frequency"] == 0.0 and settings["slew_limit"] == 0.0 and settings["delay"] == 0.0
    return IDEAL if at_once else MOVING


KIND = ValveKind(
    name="proportional",
    summary="One spool valve: the opening follows the command from -1 to 1.",
    quantities=(
        Quantity("dead_band", "", "smallest command that opens the valve", 0.0, 0.0, 0.99),
        Quantity("delay", "s", "dead time between command and spool", 0.0, 0.0, 0.2),
        Quantity("spool_frequency", "Hz", "undamped natural frequency of the spool, 0 for none", 0.0, 0.0, 2000.0),
        Quantity("spool_damping_ratio", "", "damping ratio of the spool", 0.7, 0.05, 5.0),
        Quantity("slew_limit", "1/s", "largest rate of the opening, 0 for none", 0.0, 0.0, 1.0e5),
    ),
    choose=choose,
)
