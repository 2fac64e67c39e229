"""Torques on the ankle of a walking leg beside actuator, friction and damping: wearer, ground, foot and foot plate."""

from typing import NamedTuple

from ppafo.model import contact as ground
from ppafo.model.gait import GaitNow
from ppafo.model.leg import LegParameters, foot_inertia_about_ankle, passive_torque, torque_of_shank_on
from ppafo.model.turns import TURNS_OF_RADIAN, sine_and_cosine


class DeviceShare(NamedTuple):
    """What the foot plate and the vane add to the leg: inertia [kg m^2], damping [N m s/rad], mass moment [kg m].

    The last is mass times distance from the ankle. They turn with the foot, so the shank's motion moves them too:
    equation (1) holds for a shank at rest. The plant of a walking leg carries the sums of leg and device, and no
    gravity of its own.
    """

    inertia: float
    viscous_damping: float
    mass_moment: float


class Direction(NamedTuple):
    """Sine and cosine of the angle of the foot over the horizontal."""

    sine: float
    cosine: float


class CarriedFoot(NamedTuple):
    """Torques [N m] that shank, knee and weight ask of the ankle: for the foot, for foot plate and vane."""

    foot: float
    plate: float


def foot_direction(shank: float, angle: float) -> Direction:
    """Direction of the foot at a shank angle and an ankle angle [rad]."""
    sine, cosine = sine_and_cosine(ground.foot_angle(shank, angle) * TURNS_OF_RADIAN)
    return Direction(sine, cosine)


def leg_torque(
    leg: LegParameters,
    share: DeviceShare,
    contact: float,
    now: GaitNow,
    ground_angle: float,
    angle: float,
    foot: Direction,
) -> float:
    """Torque on the ankle [N m] beside actuator, friction, damping and inertia, positive in plantarflexion.

    The ankle's row of equation (11) with the prescribed shank, the wearer, tissue, the foot plate, and the ground
    under the heel. Muscles are what a healthy ankle adds to tissue and ground along the measured angles, on the heel
    the measured moment less tissue, so that a wearer who has all of them and no device walks the measured gait.
    ``ground_angle`` [rad] is that of a flat foot.
    """
    return torque_with_carried(leg, contact, now, ground_angle, angle, carried_foot(leg, share, now, foot))


def torque_with_carried(
    leg: LegParameters, contact: float, now: GaitNow, ground_angle: float, angle: float, carried: CarriedFoot
) -> float:
    """As ``leg_torque`` [N m], where it is known what foot and foot plate ask."""
    heel = ground.heel_torque(contact, now, leg, ground_angle, angle)
    active = now.moment if contact == ground.HEEL else now.healthy_torque
    muscles = active - passive_torque(leg, now.ankle)
    wearer = leg.residual_share * muscles + passive_torque(leg, angle)
    return wearer + heel + -carried.plate - carried.foot


def carried_foot(leg: LegParameters, share: DeviceShare, now: GaitNow, foot: Direction) -> CarriedFoot:
    """What foot and foot plate ask of the ankle in a direction of the foot."""
    mass_moment = leg.foot_mass * leg.foot_mass_centre
    return CarriedFoot(
        torque_of_body_on_foot(leg, mass_moment, foot_inertia_about_ankle(leg), now, foot),
        torque_of_body_on_foot(leg, share.mass_moment, share.inertia, now, foot),
    )


def torque_of_body_on_foot(
    leg: LegParameters, mass_moment: float, inertia: float, now: GaitNow, foot: Direction
) -> float:
    """Torque [N m] that shank, knee and weight ask of the ankle for a body on the foot: see ``torque_of_shank_on``."""
    return torque_of_shank_on(
        mass_moment,
        inertia,
        leg.shank_length,
        leg.gravity,
        now.sine_shank,
        now.cosine_shank,
        foot.sine,
        foot.cosine,
        now.shank_rate,
        now.shank_acceleration,
        now.knee_forward,
        now.knee_up,
    )
