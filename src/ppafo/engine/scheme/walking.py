"""Walking leg with the device: its state, the stages of its step, and the torques on its ankle.

The torques on the ankle in addition to actuator, friction and damping come from wearer, ground, foot and foot plate.
"""

from typing import NamedTuple

from ppafo.model import contact as ground
from ppafo.model.contact import Ankle
from ppafo.model.elementary import TURNS_OF_RADIAN, sine_and_cosine_of_turns
from ppafo.model.gait import GaitNow
from ppafo.model.leg import FootLoad, LegParameters, foot_load, passive_torque, torque_of_shank

# Higher than any foot [m]: the lowest clearance before the swing is looked at.
NO_CLEARANCE = 1.0e3


class DeviceShare(NamedTuple):
    """Contribution of foot plate and vane to the leg: inertia [kg m^2], damping [N m s/rad], mass moment [kg m].

    The mass moment is mass times distance from the ankle. Foot plate and vane turn with the foot, so that the motion of
    the shank moves them too; equation (1) holds for a shank at rest. The plant of a walking leg has the sums of leg and
    device, and no gravity torque.
    """

    inertia: float
    viscous_damping: float
    mass_moment: float


class Direction(NamedTuple):
    """Sine and cosine [-] of the angle of the foot above the horizontal."""

    sine: float
    cosine: float


class CarriedFoot(NamedTuple):
    """Torques [N m] about the ankle due to shank motion, knee motion and weight.

    Attributes:
        foot: torque on the foot [N m]
        plate: torque on foot plate and vane [N m]
    """

    foot: float
    plate: float


def foot_direction(shank: float, angle: float) -> Direction:
    """Direction of the foot for a shank angle [rad] and an ankle angle [rad]."""
    sine, cosine = sine_and_cosine_of_turns(ground.foot_angle(shank, angle) * TURNS_OF_RADIAN)
    return Direction(sine, cosine)


def torque_with_carried(
    leg: LegParameters, contact: float, now: GaitNow, ground_angle: float, angle: float, carried: CarriedFoot
) -> float:
    """Torque on the ankle [N m] without actuator, friction, damping and inertia, positive in plantarflexion.

    Ankle row of equation (11) with prescribed shank: wearer, passive tissue, foot plate, and the ground under the heel.
    The muscle torque is the torque of a healthy ankle along the measured angles minus tissue and ground; on the heel,
    the measured moment minus tissue. A wearer with full muscle torque and without a device therefore walks the measured
    gait. ``ground_angle`` [rad] is the foot angle of a flat foot, ``carried`` are the torques of foot and foot plate.
    """
    heel = ground.heel_torque(contact, now, leg, ground_angle, angle)
    active = now.moment if contact == ground.HEEL else now.healthy_torque
    muscles = active - passive_torque(leg, now.ankle)
    wearer = leg.residual_share * muscles + passive_torque(leg, angle)
    # Grouped so that a wearer without a device walks the measured gait to the last bit.
    return wearer + heel + -carried.plate - carried.foot


def carried_foot(leg: LegParameters, share: DeviceShare, now: GaitNow, foot: Direction) -> CarriedFoot:
    """Torques [N m] of foot and foot plate about the ankle for a direction of the foot."""
    load = foot_load(leg)
    plate = load._replace(mass_moment=share.mass_moment, inertia=share.inertia)
    return CarriedFoot(torque_of_body_on_foot(load, now, foot), torque_of_body_on_foot(plate, now, foot))


def torque_of_body_on_foot(load: FootLoad, now: GaitNow, foot: Direction) -> float:
    """Torque [N m] about the ankle due to shank, knee and weight on a body fixed to the foot: ``torque_of_shank``."""
    return torque_of_shank(
        load,
        now.sine_shank,
        now.cosine_shank,
        foot.sine,
        foot.cosine,
        now.shank_rate,
        now.shank_acceleration,
        now.knee_forward,
        now.knee_up,
    )


class WalkState(NamedTuple):
    """State of a walk: ground contact, gait, foot direction, assistance, and totals since the start.

    Attributes:
        contact: ground contact, as in ``model.contact``
        offset: difference between the ankle angle and the angle prescribed by the ground [rad]
        now: present gait
        foot: present direction of the foot
        external_torque: T_ex [N m]
        heel_force, toe_force: forces shown by the sensors [N]
        toes_first: 1 in a stride that started with a toe landing, else 0
        clearance: lowest toe clearance of the present swing relative to the healthy gait [m]
        strides: number of foot strikes
        toe_landings: number of foot strikes with the toes first
        clearances: sum of the clearances of all strides [m]
        positive_push_off_work, net_push_off_work: work of T_ex while the foot rolls over the toes [J]
    """

    contact: float
    offset: float
    now: GaitNow
    foot: Direction
    external_torque: float
    heel_force: float
    toe_force: float
    toes_first: float
    clearance: float
    strides: float
    toe_landings: float
    clearances: float
    positive_push_off_work: float
    net_push_off_work: float


class WalkStep(NamedTuple):
    """First stage of a walking step: free foot motion, ankle motion prescribed by the ground, decaying offset [rad].

    The free motion has its angle without stops [rad], acceleration [rad/s^2] and driving torque at the start [N m].
    """

    free_angle: float
    acceleration: float
    torque: float
    led: Ankle
    offset: float


class WalkEnd(NamedTuple):
    """Second stage of a walking step: torques of the leg with foot plate, and of all that drives the joint [N m].

    ``foot`` is the direction of the foot, ``angle`` [rad] and ``rate`` [rad/s] are those of the joint. ``departs`` is 1
    if a free foot meets a stop, reverses or rests in the step, else 0.
    """

    leg_torque: float
    foot: Direction
    torque: float
    angle: float
    rate: float
    departs: float
