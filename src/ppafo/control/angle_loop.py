"""Gains of angle controllers, derived from the device: SIMC rules for a double integrator (Skogestad 2003).

The angle of a joint responds to the torque T by I angle'' = T, two integrators more than in ``torque_loop``. In a
cascade the inner loop controls the torque with the gain k_p, and the outer loop requests

    T = k_a (reference - angle) + d_a (their rates) + observed load + feed-forward torque of the joint
    k_p = 3/4 / (R theta),    k_a = I w^2 + S/2,    d_a = I w,    load time = 1/w,    w = 1/(4.5 theta)

For 1/s^2 with a delay of D, and a time constant of D, the rules of S. Skogestad, Journal of Process Control 13 (2003)
291, give w = 1/(4 D): D is the dead time theta and an eighth of it for the filter of the rate. The load is observed as
the torque that did not accelerate the joint, which feeds back I w of the rate besides d_a: 2 I w in all, critical
damping. The inner loop has a phase margin of 47 deg.

Gas between closed valves is a spring S [N m/rad]: T' = R u - S angle'. The inner loop has no integral, so that a
moving joint has S/(k_p R) per rate less torque than it requests. This is a damping, which slows down a joint that is
light against its gas, to k_a k_p R/S [1/s], and which k_a makes up for by a part of S. With all of S and no d_a the
mass would oscillate on the gas; half of it is allowed. A valve that regulates pressures leaves no spring.

Without friction the linear loop has a largest sensitivity of 3.4 to 4.0 for theta sqrt(S/I) up to 0.3, and up to 6
for 0.7 to 1.3 times R; up to 0.2 it is stable for 0.7 to 1.5 times the inertia. Beyond 0.7
friction alone keeps a joint still: it swings on its gas within the dead time.

A joint with large inertia is slower: full opening changes the torque by R [N m/s] only, so that a movement over
``travel`` takes (I travel / R)^(1/3) [s], and w is at most the inverse of this time. If the static friction then
exceeds k_a ``travel``, w is raised accordingly, up to 1/(4.5 theta). A valve that regulates pressures and whose flow
limits the rate delays large changes by ``TorqueLoop.ahead``, which is added to theta.

A law that opens the valve by the angle error alone acts on one integrator, with the rate R/S at full opening, followed
by a mass on a gas spring S. Its bandwidth is limited by the natural frequency and damping of this mass, whatever the
gains. ``slow_loop`` is the corresponding loop.
"""

import math
from typing import NamedTuple

from ppafo.control.torque_loop import LEAST_RATE, TorqueLoop, torque_in_dead_time
from ppafo.model.elementary import power

DEAD_TIMES = 4.5
"""1/(w theta), of a double integrator with a dead time and a filtered rate."""
INNER_GAIN = 0.75
"""Gain of the inner torque loop times R theta; twice as much makes it oscillate."""
SHARE_OF_SPRING = 0.5
"""Part of the gas spring in the stiffness k_a; with the whole of it the mass would oscillate on the gas."""
LIGHT = 0.7
"""Largest theta sqrt(S/I) [-] at which these gains are stable without friction, for 0.7 to 1.3 times R."""
LEAST_TOLERANCE = math.radians(0.5)
"""Tolerance [rad] of a joint with a wide range: about the play of an orthosis on its wearer, for every drive."""
ALLOWED_AT_REST = 0.0025
"""Error at rest over the range of a joint that its verdict allows at least [-]: 5 % of a way of 5 %."""
STEPS_OF_TOLERANCE = 2.0
"""Smallest tolerance in resolutions of the angle sensor, or in doubled standard deviations of the sensor noise."""
NOISE_IN_FILTER = 6.0
"""Standard deviations of the angle noise that the rate filter counts as one resolution step."""
NOISE_AT_REST = 7.0
"""Standard deviations of the angle noise that count as motion; fewer occur by chance several times a second."""
REST_RATE = 0.02
"""Rate [rad/s] below which a joint counts as resting."""

USUAL_SWING = 0.05
"""Amplitude of oscillation [rad] for which the equivalent damping of dry friction is computed."""
LEAST_DAMPING_RATIO = 0.01
THIRD = 1.0 / 3.0


class Joint(NamedTuple):
    """Joint dynamics for the gains of an angle controller: moving parts on the gas spring of the chambers.

    ``inertia`` [kg m^2], gas ``stiffness`` [N m/rad], ``shut_in`` [N m/rad] between closed valves at work, viscous
    ``damping`` [N m s/rad], kinetic ``friction`` [N m], ``static_friction`` [N m], ``span`` between the stops [rad],
    typical ``travel`` per move [rad], largest ``gravity`` torque [N m], ``resolution`` [rad] and ``noise`` [rad] of the
    angle sensor.
    """

    inertia: float
    stiffness: float
    shut_in: float
    damping: float
    friction: float
    static_friction: float
    span: float
    travel: float
    gravity: float
    resolution: float
    noise: float


def lightness(loop: TorqueLoop, joint: Joint) -> float:
    """Dead time times the frequency of the joint on its gas, theta sqrt(S/I) [-]."""
    return loop.dead_time * math.sqrt(joint.shut_in / joint.inertia)


def bandwidth(loop: TorqueLoop, joint: Joint) -> float:
    """Bandwidth w [rad/s]: by the torque rate over the travel or by the static friction, at most 1/(4.5 theta)."""
    by_rate = power(max(min(loop.rate, loop.largest_rate), LEAST_RATE) / (joint.inertia * joint.travel), THIRD)
    breaking = joint.static_friction / max(joint.travel, LEAST_TOLERANCE) - SHARE_OF_SPRING * joint.shut_in
    by_friction = math.sqrt(max(breaking, 0.0) / joint.inertia)
    return min(max(by_rate, by_friction), 1.0 / (DEAD_TIMES * (loop.dead_time + loop.ahead)))


def angle_stiffness(loop: TorqueLoop, joint: Joint) -> float:
    """Gain k_a = I w^2 + S/2 [N m/rad], requested torque per angle error."""
    frequency = bandwidth(loop, joint)
    return joint.inertia * frequency * frequency + SHARE_OF_SPRING * joint.shut_in


def angle_damping(loop: TorqueLoop, joint: Joint) -> float:
    """Gain d_a = I w [N m s/rad], requested torque per rate of the angle error; the load observer damps, too."""
    return joint.inertia * bandwidth(loop, joint)


def load_time(loop: TorqueLoop, joint: Joint) -> float:
    """Time constant 1/w [s] of the load observer; a faster one makes the loop oscillate."""
    return 1.0 / bandwidth(loop, joint)


def torque_lag(loop: TorqueLoop) -> float:
    """Time constant theta / 0.75 [s] of the torque loop with the gain 0.75/(R theta)."""
    return loop.dead_time / INNER_GAIN


def tolerance(joint: Joint) -> float:
    """Angle error [rad] within which the load is not adapted.

    A joint rests anywhere within twice this, which is the least error that its verdict allows. It is at most 0.5 deg,
    and at least what the sensor resolves.
    """
    unseen = STEPS_OF_TOLERANCE * max(joint.resolution, 2.0 * joint.noise)
    return max(min(LEAST_TOLERANCE, 0.5 * ALLOWED_AT_REST * joint.span), unseen)


def rest_distance(loop: TorqueLoop, joint: Joint) -> float:
    """Rotation [rad] that counts as motion: more than sensor resolution and noise, and ``REST_RATE`` times the lag."""
    unseen = 1.5 * joint.resolution + NOISE_AT_REST * joint.noise
    return max(REST_RATE * torque_lag(loop), unseen)


def rate_filter(loop: TorqueLoop, joint: Joint) -> float:
    """Time constant [s] of the filter on the measured rate: the lag of the torque loop, at most 0.1/w.

    One resolution step of a coarse sensor may open the valve by half, and the sensor noise by a tenth on average; the
    time constant is raised up to 0.3/w to respect both limits.
    """
    per_angle = 2.0 * inner_gain(loop) * angle_damping(loop, joint)
    frequency = bandwidth(loop, joint)
    smoothing = per_angle * max(joint.resolution, NOISE_IN_FILTER * joint.noise)
    return max(min(loop.dead_time, 0.1 / frequency), min(smoothing, 0.3 / frequency))


def inner_gain(loop: TorqueLoop) -> float:
    """Gain 0.75/(R theta) [1/(N m)] of the inner torque loop: valve command per torque error."""
    return INNER_GAIN / torque_in_dead_time(loop)


def gravity(joint: Joint) -> float:
    """Largest gravity torque on the joint [N m], as a default for settings."""
    return joint.gravity


def inertia(joint: Joint) -> float:
    """Inertia of the joint [kg m^2], as a default for settings."""
    return joint.inertia


def slow_loop(loop: TorqueLoop, joint: Joint) -> TorqueLoop:
    """Integrator rate R/S [rad/s] and effective dead time [s] for a law that opens the valve by the angle error.

    With the gain k_p = 1/(2 R theta) the rules keep half of the gain at which the mass on its gas spring becomes
    unstable, k_p R/S = d/I. The damping d is viscous damping plus the equivalent damping of dry friction for an
    oscillation.
    """
    frequency = math.sqrt(joint.stiffness / joint.inertia)
    dry = 4.0 * joint.friction / (math.pi * frequency * USUAL_SWING)
    damping = max(joint.damping + dry, 2.0 * LEAST_DAMPING_RATIO * frequency * joint.inertia)
    late = max(loop.dead_time + damping / joint.stiffness, joint.inertia / damping)
    rate = loop.rate / joint.stiffness
    return TorqueLoop(rate, late, rate, 0.0)
