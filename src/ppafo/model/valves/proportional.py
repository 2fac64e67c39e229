"""Proportional spool valve: ideal, or with dead band, dead time, slew limit and second-order spool, in that order.

The requested opening moves towards the command, at most at the slew limit; the spool follows it with
x'' = w^2 (r - x) - 2 d w x'. A step of the spool, of any length, is exact; a step ends when the requested opening
reaches the command.
"""

import math
from typing import Annotated, NamedTuple

from ppafo.model.declaration import Number
from ppafo.model.elementary import DOUBLINGS, SMALLEST_FRACTION, TERMS
from ppafo.model.plant import (
    Openings,
    blended_port_flow,
    blended_ports,
    openings_of,
    single_port_flow,
    single_ports,
    spool_openings,
)
from ppafo.model.valves.kind import ValveKind, ValveModel, never

# From shut to open within 1 ps, below any step; two instants within 10 ps are one; and a quotient of zeros is finite.
NO_SLEW_LIMIT = 1.0e12
SAME_INSTANT = 1.0e-11
TINY = 1.0e-300
ARRIVAL = 30.0
"""Settling time to rounding accuracy of a spool, in units of its slower time constant [-]."""


class IdealProportional(NamedTuple):
    """Parameters of a valve without dynamics: dead band [-], and opening per command beyond the dead band [-]."""

    dead_band: float
    gain: float


class NoValveState(NamedTuple):
    """State of an ideal valve: its opening from -1 to 1, closed at the start."""

    opening: float = 0.0


class MovingProportional(NamedTuple):
    """Dead band [-], slew limit [1/s], undamped frequency [Hz] and damping ratio [-] of the spool."""

    dead_band: float
    slew_limit: float
    frequency: float
    damping_ratio: float


class SpoolStep(NamedTuple):
    """Transition factors of a free spool over a step: next x, next x' and mean x, per initial x and x'.

    x is the offset of the opening from the requested opening.
    """

    next_by_opening: float
    next_by_rate: float
    rate_by_opening: float
    rate_by_rate: float
    mean_by_opening: float
    mean_by_rate: float


class SpoolState(NamedTuple):
    """Requested opening after the slew limit, opening of the spool, both from -1 to 1, and its rate [1/s].

    The spool starts at rest in mid-position.
    """

    requested: float = 0.0
    opening: float = 0.0
    rate: float = 0.0


def opening_of_command(command: float, dead_band: float) -> float:
    """Opening [-], -1 to 1, for a command [-]: 0 inside the dead band, full opening at full command."""
    size = max(min(abs(command), 1.0) - dead_band, 0.0) / (1.0 - dead_band)
    return size if command >= 0.0 else -size


def spool_position(position: float, command: float, play_width: float) -> float:
    """Spool position [-1, 1] for a command [-], with a backlash of the total width ``play_width`` [-].

    The inner side of the backlash, ``y``, moves with the command at its limits: ``y = max(c - b/2, min(c + b/2, y))``.
    The spool position is ``y / (1 - b/2)``, so that the spool reaches full opening. The valve map of a bench shows it;
    runs have no backlash.
    """
    half = 0.5 * play_width
    inner = max(command - half, min(command + half, position * (1.0 - half)))
    return max(-1.0, min(1.0, inner / (1.0 - half)))


def advance_ideal(
    valve: IdealProportional, state: NoValveState, command: float, time: float, step: float
) -> tuple[float, NoValveState]:
    """Opening during the step [-], -1 to 1, of a valve without dynamics, and its state."""
    size = max(min(abs(command), 1.0) - valve.dead_band, 0.0) * valve.gain
    opening = size if command >= 0.0 else -size
    return opening, NoValveState(opening)


def towards_chamber_1(opening: float, next_opening: float, mean: float) -> float:
    """Mean of the positive part of an opening over a step [-]; exact for a linear opening or a constant sign."""
    higher = max(opening, next_opening)
    lower = min(opening, next_opening)
    crosses = higher > 0.0 and lower < 0.0
    # A straight line that crosses 0 is positive for the share higher / (higher - lower) of the step, higher / 2 on
    # average.
    straight = 0.5 * higher * higher / max(higher - lower, TINY)
    return straight if crosses else max(mean, 0.0)


def advance_moving(
    valve: MovingProportional, state: SpoolState, command: float, time: float, step: float
) -> tuple[Openings, SpoolState]:
    """Mean openings [-] in a step [s], and the spool at its end; the request changes its rate at the start only."""
    settled = settle_moving(valve, state, command, time)
    target = opening_of_command(command, valve.dead_band)
    # The request moves at the slew limit, with the sign by two selects, 0 at the target.
    distance = target - settled.requested
    slew = ((1.0 if distance > 0.0 else 0.0) - (1.0 if distance < 0.0 else 0.0)) * valve.slew_limit
    arrives = abs(distance) <= valve.slew_limit * step
    requested = target if arrives else settled.requested + slew * step
    requested_mean = 0.5 * (settled.requested + requested)
    has_spool = valve.frequency > 0.0
    angular = 2.0 * math.pi * valve.frequency
    by = spool_step(angular, valve.damping_ratio, step)
    # A spool that follows a ramp stays behind it by this much, and moves freely about that.
    behind = 2.0 * valve.damping_ratio * slew / angular if has_spool else 0.0
    away = settled.opening - settled.requested + behind
    rate_away = settled.rate - slew
    spool = requested - behind + by.next_by_opening * away + by.next_by_rate * rate_away
    spool_mean = requested_mean - behind + by.mean_by_opening * away + by.mean_by_rate * rate_away
    rate = slew + by.rate_by_opening * away + by.rate_by_rate * rate_away
    opening = spool if has_spool else requested
    # A spool that overshoots full opening opens no further.
    mean = max(-1.0, min(1.0, spool_mean if has_spool else requested_mean))
    towards_1 = towards_chamber_1(settled.opening, opening, mean)
    towards_2 = towards_chamber_1(-settled.opening, -opening, -mean)
    return spool_openings(towards_1, towards_2), SpoolState(requested, opening, rate)


def spool_acceleration(opening: float, rate: float, target: float, frequency: float, damping_ratio: float) -> float:
    """Second derivative of the opening [1/s^2] of a spool with undamped frequency [Hz] towards a target opening."""
    angular = 2.0 * math.pi * frequency
    return angular * angular * (target - opening) - 2.0 * damping_ratio * angular * rate


def shift_of_spool(state: SpoolState, next_state: SpoolState) -> float:
    """Change of the opening during a step divided by the larger of both openings [-]."""
    larger = max(abs(next_state.opening), abs(state.opening))
    return abs(next_state.opening - state.opening) / max(larger, TINY)


def instant_ideal(valve: IdealProportional, state: NoValveState, command: float) -> Openings:
    """Openings [-] at an instant of a valve without dynamics."""
    return openings_of(opening_of_command(command, valve.dead_band))


def rates_ideal(valve: IdealProportional, state: NoValveState, command: float) -> NoValveState:
    """Rates [1/s] of the state, which are 0."""
    return NoValveState(0.0)


def settle_ideal(valve: IdealProportional, state: NoValveState, command: float, time: float) -> NoValveState:
    """State with the opening [-] that the command requests."""
    return NoValveState(opening_of_command(command, valve.dead_band))


def instant_moving(valve: MovingProportional, state: SpoolState, command: float) -> Openings:
    """Openings [-] of the moving valve at an instant."""
    return openings_of(state.opening)


def rates_moving(valve: MovingProportional, state: SpoolState, command: float) -> SpoolState:
    """Rates of the requested and of the actual opening [1/s], and the second derivative of the opening [1/s^2]."""
    target = opening_of_command(command, valve.dead_band)
    # Between two events the request stands or moves at the limit; the solver meets the arrival as an event.
    slew = 0.0 if target == state.requested else (valve.slew_limit if target > state.requested else -valve.slew_limit)
    if valve.frequency == 0.0:
        return SpoolState(slew, slew, 0.0)
    acceleration = spool_acceleration(state.opening, state.rate, state.requested, valve.frequency, valve.damping_ratio)
    return SpoolState(slew, state.rate, acceleration)


def next_moving_event(valve: MovingProportional, state: SpoolState, command: float, time: float) -> float:
    """Time [s] at which the requested opening reaches the command."""
    target = opening_of_command(command, valve.dead_band)
    return math.inf if target == state.requested else time + abs(target - state.requested) / valve.slew_limit


def settle_moving(valve: MovingProportional, state: SpoolState, command: float, time: float) -> SpoolState:
    """State with the requested opening [-] at its target, if it has reached the target or there is no slew limit."""
    target = opening_of_command(command, valve.dead_band)
    if abs(target - state.requested) > SAME_INSTANT * valve.slew_limit:
        return state
    return SpoolState(target, target if valve.frequency == 0.0 else state.opening, state.rate)


def spool_step(angular: float, damping_ratio: float, step: float) -> SpoolStep:
    """Exact transition over a step [s] of a free spool with an undamped angular frequency [rad/s], to rounding.

    Series of the exponential and its mean at a small fraction of the step, doubled up to the whole step. A function of
    the matrix A of x and x'/w is ``p + q A``, so that all operations are on pairs of numbers, without a library
    function. For a spool that settled long before the end of the step the series would not converge; the step is cut
    there, and only the mean is continued.
    """
    # Slower time constant times w: 1/d of an underdamped spool, at most 2 d of an overdamped one.
    slower = max(1.0 / damping_ratio, 2.0 * damping_ratio)
    fraction = min(1.0, ARRIVAL * slower / max(angular * step, TINY))
    moving = fraction * step
    small = angular * moving * SMALLEST_FRACTION
    trace = -2.0 * damping_ratio * small
    determinant = small * small
    # A^n = p + q A, term by term: the next is A times this one.
    p = 1.0
    q = 0.0
    exp_p = 1.0
    exp_q = 0.0
    mean_p = 1.0
    mean_q = 0.0
    for order in range(1, TERMS):
        p, q = -determinant * q / order, (p + trace * q) / order
        exp_p = exp_p + p
        exp_q = exp_q + q
        mean_p = mean_p + p / (order + 1)
        mean_q = mean_q + q / (order + 1)
    for _ in range(DOUBLINGS):
        # The mean over twice the step is half of (1 + exp) times the mean over the step.
        both = exp_q * mean_q
        mean_p, mean_q = (
            0.5 * (mean_p + exp_p * mean_p - determinant * both),
            0.5 * (mean_q + exp_p * mean_q + exp_q * mean_p + trace * both),
        )
        squared = exp_q * exp_q
        exp_p, exp_q = exp_p * exp_p - determinant * squared, 2.0 * exp_p * exp_q + trace * squared
    # A is small times ((0, 1), (-1, -2 d)) for x and x'/w.
    per_rate = moving * SMALLEST_FRACTION
    faster = angular * small
    return SpoolStep(
        next_by_opening=exp_p,
        next_by_rate=exp_q * per_rate,
        rate_by_opening=-exp_q * faster,
        rate_by_rate=exp_p + exp_q * trace,
        mean_by_opening=mean_p * fraction,
        mean_by_rate=mean_q * per_rate * fraction,
    )


class ProportionalSettings(NamedTuple):
    """Settings of a proportional valve: dead band, dead time, spool dynamics and slew limit."""

    dead_band: Annotated[float, Number("", "smallest command that opens the valve", 0.0, 0.0, 0.99)]
    delay: Annotated[float, Number("s", "dead time between command and spool", 0.0, 0.0, 0.2)]
    spool_frequency: Annotated[
        float, Number("Hz", "undamped natural frequency of the spool, 0 for none", 0.0, 0.0, 2000.0)
    ]
    spool_damping_ratio: Annotated[float, Number("", "damping ratio of the spool", 0.7, 0.05, 5.0)]
    slew_limit: Annotated[float, Number("1/s", "largest rate of the opening, 0 for none", 0.0, 0.0, 1.0e5)]


def prepare_ideal(settings: ProportionalSettings) -> IdealProportional:
    """Parameters of the ideal valve from ``settings`` [SI]."""
    return IdealProportional(settings.dead_band, 1.0 / (1.0 - settings.dead_band))


def prepare_moving(settings: ProportionalSettings) -> MovingProportional:
    """Parameters of the moving valve from ``settings`` [SI]."""
    limit = settings.slew_limit
    return MovingProportional(
        dead_band=settings.dead_band,
        slew_limit=NO_SLEW_LIMIT if limit == 0.0 else limit,
        frequency=settings.spool_frequency,
        damping_ratio=settings.spool_damping_ratio,
    )


def dead_time(settings: ProportionalSettings) -> float:
    """Time from a command to the first motion of the spool [s]."""
    return settings.delay


def lag(settings: ProportionalSettings) -> float:
    """Time [s] until the opening has followed a command: dead time, spool, and travel at the slew limit."""
    # Mean delay of a second-order system: 2 d / w.
    frequency = settings.spool_frequency
    slew_limit = settings.slew_limit
    spool = 2.0 * settings.spool_damping_ratio / (2.0 * math.pi * frequency) if frequency > 0.0 else 0.0
    slew = 1.0 / slew_limit if slew_limit > 0.0 else 0.0
    return settings.delay + (spool + slew)


IDEAL = ValveModel(
    parameters=IdealProportional,
    state=NoValveState,
    prepare=prepare_ideal,
    advance=advance_ideal,
    connect=single_ports,
    port_flow=single_port_flow,
    jumps=False,
    shift=None,
    command_delay=dead_time,
    instant=instant_ideal,
    rates=rates_ideal,
    next_event=never,
    settle=settle_ideal,
)

MOVING = ValveModel(
    parameters=MovingProportional,
    state=SpoolState,
    prepare=prepare_moving,
    advance=advance_moving,
    connect=blended_ports,
    port_flow=blended_port_flow,
    jumps=True,
    shift=shift_of_spool,
    command_delay=dead_time,
    instant=instant_moving,
    rates=rates_moving,
    next_event=next_moving_event,
    settle=settle_moving,
)


def choose(settings: ProportionalSettings) -> ValveModel:
    """Ideal model without dynamics, else the moving model, from ``settings`` [SI]."""
    # A delay needs the moving model too: its command arrives inside a step.
    at_once = settings.spool_frequency == 0.0 and settings.slew_limit == 0.0 and settings.delay == 0.0
    return IDEAL if at_once else MOVING


KIND = ValveKind(
    name="proportional",
    summary="One spool valve: the opening follows the command from -1 to 1.",
    settings=ProportionalSettings,
    choose=choose,
    lag=lag,
)
