"""Shank and foot as a planar two-link pendulum. Equations (11) and (12).

Coordinates: the shank angle phi from the vertical, positive with the ankle in front of the knee, and the ankle angle
theta, 90 deg neutral, increasing in plantarflexion. The foot is then at ``alpha = phi - theta + 90 deg`` to the
horizontal, positive with the toes up. The knee may accelerate; x points forward, y up. Distances are from the proximal
joint: the shank's centre of mass from the knee, the foot's from the ankle, on the line to the toes.
"""

from typing import NamedTuple

from ppafo.model.elementary import TURNS_OF_RADIAN, sine_and_cosine_of_turns


class LegParameters(NamedTuple):
    """Segments of one leg and the wearer's ankle, SI units.

    ``ankle_stiffness`` [N m/rad] pulls the ankle to ``ankle_rest_angle`` [rad]; ``ankle_damping`` [N m s/rad].
    ``residual_share`` [-] is the fraction of the measured ankle moment that the wearer still has: 0 is the paper's full
    deficit. With ``keeps_gait`` 1 the wearer is nondisabled: muscles keep the measured ankle motion whatever the device
    does. For a foot that rolls on its heel the lever arm [m] of the ground force behind the ankle is
    ``flat_heel_lever`` near flat and approaches ``heel_lever`` as the foot tilts up, half of the way at
    ``heel_roll_angle`` [rad]. ``toe_lever`` [m] is the distance from the ankle forward to the toes.
    """

    shank_length: float
    shank_mass_centre: float
    shank_mass: float
    shank_inertia: float
    foot_mass_centre: float
    foot_mass: float
    foot_inertia: float
    body_mass: float
    ankle_stiffness: float
    ankle_rest_angle: float
    ankle_damping: float
    residual_share: float
    keeps_gait: float
    heel_lever: float
    flat_heel_lever: float
    heel_roll_angle: float
    toe_lever: float
    gravity: float


class ShankNow(NamedTuple):
    """Prescribed shank: angle [rad], rate [rad/s], acceleration [rad/s^2]; knee acceleration forward and up [m/s^2]."""

    angle: float
    rate: float
    acceleration: float
    knee_forward: float
    knee_up: float


class FootLoad(NamedTuple):
    """Foot and foot plate on a prescribed shank: mass moment [kg m] and inertia [kg m^2] about the ankle.

    ``shank_length`` [m] and ``gravity`` [m/s^2] are properties of the leg.
    """

    mass_moment: float
    inertia: float
    shank_length: float
    gravity: float


def foot_inertia_about_ankle(leg: LegParameters) -> float:
    """Inertia of the foot about the ankle [kg m^2]: what the second row of equation (11) multiplies with theta''."""
    return leg.foot_inertia + leg.foot_mass * leg.foot_mass_centre * leg.foot_mass_centre


def torque_on_knee(
    leg: LegParameters,
    sine_phi: float,
    cosine_phi: float,
    sine_alpha: float,
    cosine_alpha: float,
    shank_rate: float,
    shank_acceleration: float,
    ankle_rate: float,
    ankle_acceleration: float,
    knee_forward: float,
    knee_up: float,
) -> float:
    """Knee torque T_1 [N m] that moves shank and foot, positive where it turns the shank forward.

    The first row of equation (11), in the coordinates of (12); the second is ``torque_of_shank``. phi is the shank
    angle, alpha the foot's angle to the horizontal; rates [rad/s], accelerations [rad/s^2], [m/s^2].
    """
    # theta is phi less alpha, plus 90 deg.
    sine_theta = cosine_phi * cosine_alpha + sine_phi * sine_alpha
    cosine_theta = cosine_phi * sine_alpha - sine_phi * cosine_alpha
    mass_moment = leg.foot_mass * leg.foot_mass_centre
    product = mass_moment * leg.shank_length
    foot = foot_inertia_about_ankle(leg)
    shank = leg.shank_inertia + leg.shank_mass * leg.shank_mass_centre * leg.shank_mass_centre
    # The foot's mass turns with the shank at the end of its length (parallel axes).
    shank += leg.foot_mass * leg.shank_length * leg.shank_length
    coupling = product * cosine_theta - foot
    inertial = (shank - product * cosine_theta - coupling) * shank_acceleration + coupling * ankle_acceleration
    turning = product * sine_theta * ankle_rate * (2.0 * shank_rate - ankle_rate)
    # A knee that accelerates upwards acts as more gravity.
    up = leg.gravity + knee_up
    above_ankle = leg.shank_mass * leg.shank_mass_centre + leg.foot_mass * leg.shank_length
    weight = above_ankle * (sine_phi * up + cosine_phi * knee_forward)
    return inertial + turning + weight + mass_moment * (cosine_alpha * up - sine_alpha * knee_forward)


def foot_load(leg: LegParameters) -> FootLoad:
    """Foot of a leg, without a device, as a load about the ankle."""
    return FootLoad(
        mass_moment=leg.foot_mass * leg.foot_mass_centre,
        inertia=foot_inertia_about_ankle(leg),
        shank_length=leg.shank_length,
        gravity=leg.gravity,
    )


def torque_of_shank(
    load: FootLoad,
    sine_phi: float,
    cosine_phi: float,
    sine_alpha: float,
    cosine_alpha: float,
    shank_rate: float,
    shank_acceleration: float,
    knee_forward: float,
    knee_up: float,
) -> float:
    """Torque [N m] about the ankle from shank motion, knee motion and weight, without the ankle's own acceleration.

    The second row of equation (11), in the coordinates of (12), without the term in theta''; angles as in
    ``torque_on_knee``, rates [rad/s], accelerations [rad/s^2], [m/s^2].
    """
    # theta is phi less alpha, plus 90 deg.
    sine_theta = cosine_phi * cosine_alpha + sine_phi * sine_alpha
    cosine_theta = cosine_phi * sine_alpha - sine_phi * cosine_alpha
    product = load.mass_moment * load.shank_length
    weight = cosine_alpha * (load.gravity + knee_up) - sine_alpha * knee_forward
    turning = (product * cosine_theta - load.inertia) * shank_acceleration
    return turning - product * sine_theta * shank_rate * shank_rate - load.mass_moment * weight


def torque_on_foot(load: FootLoad, now: ShankNow, angle: float) -> float:
    """Torque [N m] of shank motion, knee motion and weight on the foot and its plate, positive in plantarflexion.

    T_shank of docs/equations.md: ``torque_of_shank`` at an angle [rad] of the ankle, with the sign of a driving torque.
    Equation (11).
    """
    # alpha = phi - theta + a quarter turn: the foot is level at an ankle angle of 90 deg below an upright shank.
    sine_phi, cosine_phi = sine_and_cosine_of_turns(now.angle * TURNS_OF_RADIAN)
    sine_alpha, cosine_alpha = sine_and_cosine_of_turns((now.angle - angle) * TURNS_OF_RADIAN + 0.25)
    return -torque_of_shank(
        load, sine_phi, cosine_phi, sine_alpha, cosine_alpha, now.rate, now.acceleration, now.knee_forward, now.knee_up
    )


def torque_on_resting_foot(load: FootLoad, shank: float, angle: float) -> float:
    """Torque [N m] of the weight on a foot whose shank rests at an angle [rad]; bit for bit as ``torque_on_foot``."""
    _, cosine_alpha = sine_and_cosine_of_turns((shank - angle) * TURNS_OF_RADIAN + 0.25)
    # Grouped as torque_of_shank groups it, or the last bits would differ.
    return load.mass_moment * (cosine_alpha * load.gravity)


def passive_torque(leg: LegParameters, angle: float) -> float:
    """Passive tissue torque on the ankle [N m], positive in plantarflexion, without its damping."""
    return leg.ankle_stiffness * (leg.ankle_rest_angle - angle)
