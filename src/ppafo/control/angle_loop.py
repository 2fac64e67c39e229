"""Gains of laws that hold an angle, which follow the device: SIMC rules for two integrators (Skogestad 2003).

What a torque T moves answers with the angle by I angle'' = T, two integrators more than ``torque_loop`` has. In a
cascade the inner loop makes the torque, with the rules of ``torque_loop`` as late by 2 theta in all, and the outer one
asks for

    T = k_a (reference - angle) + d_a (their rates) + what the joint needs by itself
    k_a = I w^2,    d_a = 2 I w

For 1/s^2 with a delay of D, and a time constant of D, the rules of S. Skogestad, Journal of Process Control 13 (2003)
291, give w = 1/(4 D), so w = 1/(8 theta). A joint with much inertia is slower than that: full opening changes the
torque by R [N m/s] only, so that a way of ``travel`` takes (I travel / R)^(1/3) [s], and w is at most its inverse.

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
INERTIA = "inertia of the joint"
"""What a default may follow: the numbers that the functions below give."""

OUTER_TIMES_INNER = 8.0
"""1/(w theta): four times the delay of the inner loop, which is two dead times."""

USUAL_SWING = 0.05
"""rad: the swing at which dry friction counts as a damping."""
LEAST_DAMPING_RATIO = 0.01
THIRD = 1.0 / 3.0


class Joint(NamedTuple):
    """What turns, with the gas behind it.

    Inertia [kg m^2], gas spring [N m/rad], viscous damping [N m s/rad], friction in motion [N m], the way [rad] that
    it is to go at a time, largest torque of gravity [N m].
    """

    inertia: float
    stiffness: float
    damping: float
    friction: float
    travel: float
    gravity: float


def bandwidth(loop: TorqueLoop, joint: Joint) -> float:
    """Bandwidth w [rad/s]: as the torque loop allows, or as quickly as the torque can change on the way."""
    by_dead_time = 1.0 / (OUTER_TIMES_INNER * loop.dead_time)
    return min(by_dead_time, power(max(loop.rate, 1.0e-9) / (joint.inertia * joint.travel), THIRD))


def angle_stiffness(loop: TorqueLoop, joint: Joint) -> float:
    """Gain k_a = I w^2 [N m/rad]: torque requested per error of the angle."""
    frequency = bandwidth(loop, joint)
    return joint.inertia * frequency * frequency


def angle_damping(loop: TorqueLoop, joint: Joint) -> float:
    """Gain d_a = 2 I w [N m s/rad]: torque requested per rate of that error, for two equal roots."""
    return 2.0 * joint.inertia * bandwidth(loop, joint)


def rate_filter(loop: TorqueLoop, joint: Joint) -> float:
    """Time constant [s] of the filter on the rate of the error: as late as the torque loop, at most 0.1/w."""
    return min(loop.dead_time, 0.1 / bandwidth(loop, joint))


def inner_gain(loop: TorqueLoop, _joint: Joint) -> float:
    """Command per torque error [1/(N m)]: that of the torque loop, 1/(2 R theta)."""
    return 0.5 / torque_in_dead_time(loop)


def gravity(_loop: TorqueLoop, joint: Joint) -> float:
    """Largest torque of gravity on the joint [N m], which a default may follow."""
    return joint.gravity


def friction(_loop: TorqueLoop, joint: Joint) -> float:
    """Torque of the joint's friction in motion [N m], which a default may follow."""
    return joint.friction


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
