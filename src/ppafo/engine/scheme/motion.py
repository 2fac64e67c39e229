"""Integration step of the vane, unconstrained between its stops or with a prescribed angle, coupled to the gas.

Order of a free step: the angle is predicted with the present acceleration; the gas is integrated with volumes that lead
to the predicted angle; the angular velocity follows from the trapezoidal rule with the new pressures. Events inside the
step (breakaway, reversal, impact on a stop) are located by interpolation. The rest of the step is integrated from the
event with a linearly changing torque.

A step may be divided into parts. Each part ends at an abrupt change, and its length follows from error control.
"""

import math
from typing import NamedTuple

from ppafo.model.plant import (
    PlantParameters,
    PlantState,
    direction_of,
    holds_still,
    net_torque,
    viscous_torque,
)
from ppafo.model.ports import friction_at_rest, friction_in_motion, rebound

SAME_INSTANT = 1.0e-9
SHORTEST_PART = 1.0e-6
"""Length [s] below which a part is accepted whatever its error."""
LOST = 1.0e5
"""Ratio of the error of a part to the default tolerance beyond which a run has failed: a fifth of the angle range."""
# sqrt(0.81 / E) is 0.9 / sqrt(E), the error being of second order; squares here spare roots in the clip.
SAFETY = 0.81
MINIMUM_ERROR = 0.2025
MAXIMUM_ERROR = 20.25
"""Largest error ratio used in step control; ``MINIMUM_ERROR`` and this value give the length factors 2 and 0.2."""
ALLOWED_OF_ANGLE = 2.0e-6
"""Allowed error of one part divided by the angle range [-]; the error of a run then stays below 2e-4 of the range."""
ALLOWED_BY_GAS = 3.0e-6
"""Allowed error of one part divided by the angle that would close the smaller chamber [-]."""
MISSED_FRACTION = 0.2
"""Fraction [-] of the difference between the assumed angle and the angle after an event that counts as error."""
SIXTH = 1.0 / 6.0
LOWEST_REBOUND = 1.0e-7
"""Height of a rebound divided by the angle range [-] below which the vane stays at the stop."""


class StepControl(NamedTuple):
    """Length [s] allowed for the next part by the error of the last part."""

    length: float


def until_jump(jump: float, remaining: float) -> float:
    """Length [s] of the next part when the valve jumps after ``jump`` [s] and ``remaining`` [s] of the step are left.

    Jumps due at the start of the part have already happened; a jump within 1 ns of the end belongs to the next step.
    """
    return jump if jump < remaining - SAME_INSTANT else remaining


def part_length(pace: StepControl, remaining: float) -> float:
    """Length [s] of the next part: the allowed length, or half the remainder if two parts suffice."""
    # Two equal parts rather than a long one and a stub.
    halves = 0.5 * remaining if remaining < 2.0 * pace.length else pace.length
    return remaining if remaining <= pace.length else halves


def is_refused(error: float, length: float) -> bool:
    """Return whether a part has an error ratio above 1 or NaN [-] and can still be shortened."""
    # The negated comparison refuses NaN, too.
    return not error <= 1.0 and length > SHORTEST_PART


def next_pace(pace: StepControl, error: float, length: float, refused: bool, longest: float) -> StepControl:
    """Allowed length [s] of the next part, after a part of ``length`` [s] with the given error ratio [-].

    A part that was cut short by an event does not reduce the allowed length.
    """
    factor = math.sqrt(SAFETY / max(MINIMUM_ERROR, min(MAXIMUM_ERROR, error)))
    wanted = length * factor
    # A part that an event cut short had little error for that reason: the next may be as long as before.
    kept = max(pace.length, wanted) if factor >= 1.0 and not refused else wanted
    return StepControl(max(min(kept, longest), SHORTEST_PART))


class FrictionTorques(NamedTuple):
    """Magnitudes of the friction torque [N m]: largest static friction, and kinetic friction."""

    at_rest: float
    in_motion: float


class Departure(NamedTuple):
    """Start of the second part of a step: fraction of the step [-], angle [rad] and angular velocity [rad/s]."""

    fraction: float
    angle: float
    angular_velocity: float


class FreePart(NamedTuple):
    """First stage of a part of a step; the part ends at a stop at the latest.

    Attributes:
        way: direction of sliding, 1 or -1; 0 at rest [-]
        acceleration: angular acceleration [rad/s^2]
        torque: driving torque at the start [N m]
        next_angle: angle at the end without reversal [rad]
        meets_stop: 1 if the part ends at a stop, else 0 [-]
    """

    way: float
    acceleration: float
    torque: float
    next_angle: float
    meets_stop: float


class PartSlide(NamedTuple):
    """End of a part without an event: driving torque [N m], friction torques [N m], angular velocity [rad/s].

    ``departs`` is 1 if the vane reverses or starts to move in the part, else 0.
    """

    torque: float
    friction: FrictionTorques
    angular_velocity: float
    departs: float


class PartEnd(NamedTuple):
    """Angle [rad] and angular velocity [rad/s] at the end of a part; angle error divided by the allowed error [-]."""

    angle: float
    rate: float
    error: float


class PrescribedStep(NamedTuple):
    """Angle [rad] and angular velocity [rad/s] at the end of a prescribed step."""

    next_angle: float
    next_rate: float


def clamp_angle(plant: PlantParameters, angle: float) -> float:
    """Return ``angle`` [rad] limited to the range between the stops."""
    return max(plant.angle_min, min(plant.angle_max, angle))


def next_velocity(
    plant: PlantParameters,
    angular_velocity: float,
    acceleration: float,
    torque: float,
    expected: float,
    duration: float,
) -> float:
    """Angular velocity [rad/s] after ``duration`` [s], trapezoidal rule; ``torque`` [N m] is the net one at the end.

    The torque is the one at an ``expected`` angular velocity [rad/s]; the viscous torque is that of the result.
    """
    half = 0.5 * duration
    # Damping is implicit: a strongly damped vane settles instead of ringing.
    slope = viscous_torque(plant.viscous_damping, 1.0)
    momentum = plant.inertia * (angular_velocity + half * acceleration)
    return (momentum + half * (torque + slope * expected)) / (plant.inertia + half * slope)


def time_to_stop(distance: float, angular_velocity: float, acceleration: float) -> float:
    """Time [s] to reach a stop ``distance`` [rad] ahead at constant acceleration, all positive along the motion."""
    # 2 d / (v + sqrt(v^2 + 2 a d)) subtracts no near numbers, unlike the textbook root, and holds for a = 0.
    reach = max(angular_velocity * angular_velocity + 2.0 * acceleration * distance, 0.0)
    return 2.0 * distance / max(angular_velocity + math.sqrt(reach), 1.0e-30)


def friction_now(
    plant: PlantParameters, angular_velocity: float, pressure_1: float, pressure_2: float
) -> FrictionTorques:
    """Friction torques [N m] at an angular velocity [rad/s] and two absolute pressures [Pa]. Equation (10)."""
    return FrictionTorques(
        at_rest=friction_at_rest(plant.static_torque, pressure_1, pressure_2),
        in_motion=friction_in_motion(plant.dynamic_torque, angular_velocity, pressure_1, pressure_2),
    )


def depart_at(
    plant: PlantParameters,
    departure: Departure,
    torque: float,
    next_torque: float,
    friction: FrictionTorques,
    step: float,
) -> tuple[float, float]:
    """Angle [rad] and angular velocity [rad/s] at the end of a step whose last part starts at ``departure``.

    ``torque`` and ``next_torque`` [N m] drive the vane at the departure and at the end; the torque is linear in
    between.
    """
    at_lower = departure.angle <= plant.angle_min
    at_upper = departure.angle >= plant.angle_max
    moving = departure.angular_velocity != 0.0
    leaves_at_once = not holds_still(torque, friction.at_rest, at_lower, at_upper)
    leaves_later = not holds_still(next_torque, friction.at_rest, at_lower, at_upper)
    way = direction_of(torque if leaves_at_once else next_torque)
    change = next_torque - torque
    # The torque runs linearly, so the instant of breakaway is where its line meets static friction.
    waits = (way * friction.at_rest - torque) / (change if change != 0.0 else 1.0)
    waits = 0.0 if moving or leaves_at_once else max(0.0, min(1.0, waits))
    start_torque = torque + waits * change
    way = direction_of(departure.angular_velocity) if moving else way
    duration = step * (1.0 - departure.fraction) * (1.0 - waits)
    velocity = departure.angular_velocity
    sliding = friction.in_motion
    damping = plant.viscous_damping
    first = net_torque(start_torque, way, sliding, damping, departure.angle, velocity) / plant.inertia
    expected = velocity + duration * first
    net = net_torque(next_torque, way, sliding, damping, departure.angle, expected)
    next_rate = next_velocity(plant, velocity, first, net, expected, duration)
    # Exact for an acceleration that runs linearly from the first to the one that ends in this velocity.
    travel = duration * SIXTH * (4.0 * velocity + 2.0 * next_rate + duration * first)
    goes = moving or leaves_at_once or leaves_later
    # A vane that turned once more inside the rest of a step stops there: the next step decides what it does.
    turned = next_rate * way <= 0.0
    angle = departure.angle + (travel if goes and travel * way > 0.0 else 0.0)
    rate = next_rate if goes and not turned else 0.0
    # A vane that meets a stop in the rest of a step stays there; its rebound would be a second event.
    hits = angle < plant.angle_min or angle > plant.angle_max
    return clamp_angle(plant, angle), (0.0 if hits else rate)


def rebound_velocity(plant: PlantParameters, angular_velocity: float, torque: float) -> float:
    """Angular velocity [rad/s] after an impact; 0 if the torque [N m] presses the vane firmly on the stop."""
    after = rebound(angular_velocity)
    # Height of the next bounce: kinetic energy against the work of the torque that presses the vane on the stop.
    pressing = max(torque * direction_of(angular_velocity), 0.0)
    lowest = LOWEST_REBOUND * (plant.angle_max - plant.angle_min)
    return after if 0.5 * plant.inertia * after * after > pressing * lowest else 0.0


def with_motion(state: PlantState, angle: float, angular_velocity: float) -> PlantState:
    """State with a new angle [rad] and angular velocity [rad/s]."""
    return state._replace(angle=angle, angular_velocity=angular_velocity)
