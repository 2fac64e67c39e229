"""Gains of laws that hold an angle, which follow the device: SIMC rules for two integrators (Skogestad 2003).

What a torque T moves answers with the angle by I angle'' = T, two integrators more than ``torque_loop`` has. In a
cascade the inner loop makes the torque, with the rules of ``torque_loop`` as late by 2 theta in all, and the outer one
asks for

    T = k_a (reference - angle) + d_a (their rates) + what the joint needs by itself
    k_a = I w^2,    d_a = 2 I w

For 1/s^2 with a delay of D, and a time constant of D, the rules of S. Skogestad, Journal of Process Control 13 (2003)
291, give w = 1/(4 D), so w = 1/(8 theta). A joint with much inertia is slower than that: full opening changes the
torque by R [N m/s] only, so that a way of ``travel`` takes (I travel / R)^(1/3) [s], and w is at most its inverse.
A joint whose static friction holds more than k_a ``travel`` has a stiffness for that, up to w = 1.7/(8 theta).

A law that opens the valve by the error of the angle alone sees one integrator, at R/S for full opening, behind a mass
on a gas spring S: beyond its frequency and damping nothing settles, whatever the gains. ``slow_loop`` is that loop.
"""

import math
from typing import NamedTuple

from ppafo.control.torque_loop import TorqueLoop, torque_in_dead_time
from ppafo.model.elementary import power

ANGLE_STIFFNESS = "stiffness of the angle loop"
ANGLE_DAMPING = "damping of the angle loop"
RATE_FILTER = "rate filter of the angle loop"
INNER_GAIN = "inner gain of the angle loop"
GRAVITY = "gravity torque of the joint"
FRICTION = "friction of the joint in motion"
STATIC_FRICTION = "static friction of the joint"
INERTIA = "inertia of the joint"
LOAD_TIME = "time constant of the observed load"
TORQUE_LAG = "time constant of the torque loop"
TOLERANCE = "tolerance of the angle"
REST_DISTANCE = "turn of a joint that shows motion"
"""Names of the loop's numbers that the default of a setting may follow; the functions below compute them."""

OUTER_TIMES_INNER = 8.0
"""1/(w theta): four times the delay of the inner loop, which is two dead times."""

STIFFENED = 1.7
"""Largest w over 1/(8 theta) where static friction asks for a stiffness."""
LOAD_PERIODS = 4.0
"""Time constant of the observed load over 1/w: a quicker observer makes the loop swing."""
LEAST_TOLERANCE = math.radians(0.5)
"""rad: about the play of an orthosis on its wearer, whatever moves it."""
STEPS_OF_TOLERANCE = 2.0
"""Resolutions of the angle sensor that a tolerance is at least; and as many standard deviations of its noise, twice."""
NOISE_IN_FILTER = 6.0
"""Standard deviations of the angle's noise that the filter of its rate takes for a step."""
NOISE_AT_REST = 7.0
"""Standard deviations of the angle's noise that show motion: fewer come by chance several times a second."""
REST_RATE = 0.02
"""Rate [rad/s] below which a joint counts as resting."""

USUAL_SWING = 0.05
"""rad: the swing at which dry friction counts as a damping."""
LEAST_DAMPING_RATIO = 0.01
THIRD = 1.0 / 3.0


class Joint(NamedTuple):
    """Joint dynamics: inertia, friction and range of what turns, with the gas behind it.

    Inertia [kg m^2], gas spring [N m/rad], viscous damping [N m s/rad], friction in motion and static friction [N m],
    the way [rad] that it is to go at a time, largest torque of gravity [N m], and resolution and noise of the angle
    sensor [rad].
    """

    inertia: float
    stiffness: float
    damping: float
    friction: float
    static_friction: float
    travel: float
    gravity: float
    resolution: float
    noise: float


def bandwidth(loop: TorqueLoop, joint: Joint) -> float:
    """Bandwidth w [rad/s]: as the torque loop allows, or as quickly as the torque can change on the way."""
    by_dead_time = 1.0 / (OUTER_TIMES_INNER * loop.dead_time)
    return min(by_dead_time, power(max(loop.rate, 1.0e-9) / (joint.inertia * joint.travel), THIRD))


def angle_stiffness(loop: TorqueLoop, joint: Joint) -> float:
    """Gain k_a = I w^2 [N m/rad], or what breaks static friction within the way: torque requested per angle error."""
    frequency = bandwidth(loop, joint)
    stiffest = max(frequency, STIFFENED / (OUTER_TIMES_INNER * loop.dead_time))
    breaking = joint.static_friction / max(joint.travel, LEAST_TOLERANCE)
    return min(max(joint.inertia * frequency * frequency, breaking), joint.inertia * stiffest * stiffest)


def stiffened(loop: TorqueLoop, joint: Joint) -> float:
    """Bandwidth w = sqrt(k_a / I) [rad/s] with the stiffness that the joint has."""
    return math.sqrt(angle_stiffness(loop, joint) / joint.inertia)


def angle_damping(loop: TorqueLoop, joint: Joint) -> float:
    """Gain d_a = 2 I w [N m s/rad]: torque requested per rate of that error, for two equal roots."""
    return 2.0 * joint.inertia * stiffened(loop, joint)


def load_time(loop: TorqueLoop, joint: Joint) -> float:
    """Time constant [s] of the observed load, 4/w."""
    return LOAD_PERIODS / stiffened(loop, joint)


def torque_lag(loop: TorqueLoop, _joint: Joint) -> float:
    """Time constant [s] of the torque loop with the gain 1/(2 R theta): 2 theta."""
    return 2.0 * loop.dead_time


def tolerance(_loop: TorqueLoop, joint: Joint) -> float:
    """Angle error [rad] within which nothing is learnt: 0.5 deg, or what the sensor cannot tell."""
    unseen = STEPS_OF_TOLERANCE * max(joint.resolution, 2.0 * joint.noise)
    return max(LEAST_TOLERANCE, unseen)


def rest_distance(loop: TorqueLoop, joint: Joint) -> float:
    """Turn [rad] that shows motion: more than a step of the sensor or its noise, and than ``REST_RATE`` in 2 theta."""
    unseen = 1.5 * joint.resolution + NOISE_AT_REST * joint.noise
    return max(REST_RATE * torque_lag(loop, joint), unseen)


def rate_filter(loop: TorqueLoop, joint: Joint) -> float:
    """Time constant [s] of the filter on the measured rate: as late as the torque loop, at most 0.1/w.

    A step of a coarse sensor may open the valve by half, and its noise by a tenth in the mean: for that the filter is
    slower, up to 0.3/w.
    """
    per_angle = 2.0 * inner_gain(loop, joint) * angle_damping(loop, joint)
    frequency = stiffened(loop, joint)
    smoothing = per_angle * max(joint.resolution, NOISE_IN_FILTER * joint.noise)
    return max(min(loop.dead_time, 0.1 / frequency), min(smoothing, 0.3 / frequency))


def inner_gain(loop: TorqueLoop, _joint: Joint) -> float:
    """Command per torque error [1/(N m)], as in the torque loop: 1/(2 R theta)."""
    return 0.5 / torque_in_dead_time(loop)


def gravity(_loop: TorqueLoop, joint: Joint) -> float:
    """Largest torque of gravity on the joint [N m], which a default may follow."""
    return joint.gravity


def friction(_loop: TorqueLoop, joint: Joint) -> float:
    """Torque of the joint's friction in motion [N m], which a default may follow."""
    return joint.friction


def static_friction(_loop: TorqueLoop, joint: Joint) -> float:
    """Torque of the joint's static friction [N m], which a default may follow."""
    return joint.static_friction


def inertia(_loop: TorqueLoop, joint: Joint) -> float:
    """Inertia of the joint [kg m^2], which a default may follow."""
    return joint.inertia


def slow_loop(loop: TorqueLoop, joint: Joint) -> TorqueLoop:
    """The loop [rad/s, s] that a law sees which opens the valve by the error of the angle: R/S, and what comes late.

    With its k_p = 1/(2 R theta) the rules keep half of the gain at which the mass on its gas spring begins to swing,
    k_p R/S = d/I, for a damping d, viscous and of dry friction at a swing.
    """
    frequency = math.sqrt(joint.stiffness / joint.inertia)
    dry = 4.0 * joint.friction / (math.pi * frequency * USUAL_SWING)
    damping = max(joint.damping + dry, 2.0 * LEAST_DAMPING_RATIO * frequency * joint.inertia)
    late = max(loop.dead_time + damping / joint.stiffness, joint.inertia / damping)
    return TorqueLoop(rate=loop.rate / joint.stiffness, dead_time=late)
