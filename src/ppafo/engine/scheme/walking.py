"""Integration step of a walking leg with the device: foot free or on the ground, and the transition between both.

The torques on the ankle in addition to actuator, friction and damping come from wearer, ground, foot and foot plate.
"""

from typing import NamedTuple

from ppafo.engine.scheme.motion import FreeEnd, FreeStep, begin_free, clamp_angle, depart_free, end_free, with_motion
from ppafo.engine.scheme.pneumatics import HeldChambers, held_chambers
from ppafo.model import contact as ground
from ppafo.model.elementary import TURNS_OF_RADIAN, sine_and_cosine_of_turns
from ppafo.model.gait import GaitNow, GaitTiming
from ppafo.model.leg import (
    FootLoad,
    LegParameters,
    foot_inertia_about_ankle,
    foot_load,
    passive_torque,
    torque_of_shank,
)
from ppafo.model.plant import (
    ActuatorFunctions,
    PlantParameters,
    PlantState,
    direction_of,
    net_torque,
    torque_less_loads,
    viscous_torque,
)
from ppafo.model.ports import friction_in_motion


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
    """First stage of a walking step: free foot motion, ankle motion prescribed by the ground, decaying offset [rad]."""

    free: FreeStep
    led: ground.Ankle
    offset: float


class WalkEnd(NamedTuple):
    """Second stage of a walking step: leg torque with foot plate [N m], foot direction, and vane motion.

    ``motion.departs`` is 1 only if the foot is free.
    """

    torque: float
    foot: Direction
    motion: FreeEnd


# Higher than any foot [m]: the lowest clearance before the swing is looked at.
NO_CLEARANCE = 1.0e3


def begin_walk(
    plant: PlantParameters,
    leg: LegParameters,
    timing: GaitTiming,
    state: PlantState,
    held: HeldChambers,
    walk: WalkState,
    carried: CarriedFoot,
    next_gait: GaitNow,
    step: float,
    *,
    parts: ActuatorFunctions,
) -> WalkStep:
    """Predicted step [s] of the foot, free and on the ground; ``carried`` are the torques of the foot at the start."""
    torque = torque_with_carried(leg, walk.contact, walk.now, timing.ground_angle, state.angle, carried)
    free = begin_free(plant, state, held, torque, step, parts=parts)
    # The difference fades implicitly, so that a step longer than the fading time does not overshoot.
    offset = walk.offset / (1.0 + step / ground.FADING_TIME)
    prescribed = ground.prescribed_ankle(walk.contact, next_gait, timing.ground_angle, leg.keeps_gait)
    led = ground.Ankle(
        clamp_angle(plant, prescribed.angle + offset),
        prescribed.rate - offset / ground.FADING_TIME,
        prescribed.acceleration + offset / (ground.FADING_TIME * ground.FADING_TIME),
    )
    return WalkStep(free, led, offset)


def next_angle(plant: PlantParameters, leg: LegParameters, walk: WalkState, begun: WalkStep) -> float:
    """Ankle angle [rad] at which the chamber volumes end in a step."""
    is_free = ground.is_free(walk.contact, leg.keeps_gait)
    return clamp_angle(plant, begun.free.free_angle) if is_free else begun.led.angle


def external_torque(
    plant: PlantParameters,
    leg: LegParameters,
    share: DeviceShare,
    state: PlantState,
    held: HeldChambers,
    torque: float,
    plate: float,
    led: ground.Ankle,
    acceleration: float,
    angle_is_free: bool,
    *,
    parts: ActuatorFunctions,
) -> float:
    """T_ex [N m]: for a free foot by equation (11), on the ground the actuator torque that equation (1) leaves.

    ``torque`` [N m] is the torque of the leg including the foot plate, ``plate`` [N m] the part of the foot plate.
    """
    speed = state.angular_velocity
    passive_damping = viscous_torque(leg.ankle_damping, speed)
    # In the air the foot takes what its own motion needs; on the ground the shank leads, and the device gives what is
    # left.
    needed = foot_inertia_about_ankle(leg) * acceleration + passive_damping - (torque - plate)
    pressure_1, pressure_2 = parts.held_pressures(plant, held, state)
    driving = torque_less_loads(parts.torque(plant, state.angle, pressure_1, pressure_2) + plate, state.angle)
    friction = friction_in_motion(plant.dynamic_torque, speed, pressure_1, pressure_2)
    net = net_torque(driving, direction_of(speed), friction, share.viscous_damping, state.angle, speed)
    return needed if angle_is_free else net - share.inertia * led.acceleration


def reach_end(
    plant: PlantParameters,
    leg: LegParameters,
    share: DeviceShare,
    timing: GaitTiming,
    state: PlantState,
    walk: WalkState,
    begun: WalkStep,
    now: GaitNow,
    ahead: HeldChambers,
    step: float,
    *,
    parts: ActuatorFunctions,
) -> tuple[WalkEnd, CarriedFoot]:
    """End of a step [s] without an event; arguments as in ``end_walk``.

    ``ahead`` are the chambers at the angle assumed for the gas.
    """
    free = ground.is_free(walk.contact, leg.keeps_gait)
    predicted = clamp_angle(plant, begun.free.free_angle)
    # One direction of the foot for the whole end: where an event stops it short, the difference is of second order.
    foot = foot_direction(now.shank, predicted if free else begun.led.angle)
    # The same for both ends of an event: the foot's direction changes little within a step.
    carried = carried_foot(leg, share, now, foot)
    torque = torque_with_carried(leg, walk.contact, now, timing.ground_angle, predicted, carried)
    slid = end_free(plant, state, ahead, begun.free, torque, step, parts=parts)
    moved = FreeEnd(
        torque=slid.torque,
        angle=slid.angle if free else begun.led.angle,
        angular_velocity=slid.angular_velocity if free else begun.led.rate,
        departs=slid.departs if free else 0.0,
    )
    return WalkEnd(torque, foot, moved), carried


def depart_in_walk(
    plant: PlantParameters,
    state: PlantState,
    begun: WalkStep,
    ended: WalkEnd,
    ahead: HeldChambers,
    step: float,
    *,
    parts: ActuatorFunctions,
) -> tuple[WalkEnd, HeldChambers]:
    """End and chambers of a step [s] with a stop, reversal or start of motion; otherwise both are unchanged."""
    angle, rate = depart_free(plant, state, ahead, begun.free, ended.motion, step, parts=parts)
    departs, slid = ended.motion.departs > 0.5, ended.motion
    there = held_chambers(plant, angle, parts=parts)
    held = HeldChambers(
        per_mass_1=there.per_mass_1 if departs else ahead.per_mass_1,
        per_mass_2=there.per_mass_2 if departs else ahead.per_mass_2,
        angle=there.angle if departs else ahead.angle,
    )
    moved = FreeEnd(
        torque=slid.torque,
        angle=angle if departs else slid.angle,
        angular_velocity=rate if departs else slid.angular_velocity,
        departs=slid.departs,
    )
    return WalkEnd(ended.torque, ended.foot, moved), held


def end_walk(
    plant: PlantParameters,
    leg: LegParameters,
    share: DeviceShare,
    timing: GaitTiming,
    follow_rate: float,
    state: PlantState,
    walk: WalkState,
    begun: WalkStep,
    ended: WalkEnd,
    held: HeldChambers,
    carried: CarriedFoot,
    now: GaitNow,
    step: float,
    *,
    parts: ActuatorFunctions,
) -> tuple[PlantState, WalkState]:
    """State at the end of the step [s], from ``state`` with the new gas and the angle at the start.

    ``now``, ``held`` and ``carried`` are the gait, the chambers and the torques of the foot at the end.
    """
    free = ground.is_free(walk.contact, leg.keeps_gait)
    after = with_motion(state, ended.motion.angle, ended.motion.angular_velocity)
    acceleration = (after.angular_velocity - state.angular_velocity) / max(step, 1.0e-30)
    given = external_torque(
        plant, leg, share, after, held, ended.torque, -carried.plate, begun.led, acceleration, free, parts=parts
    )
    landed = ground.landing(walk.contact, timing, now, after.angle, begun.offset, leg.keeps_gait)
    height = leg.toe_lever * (ended.foot.sine - now.sine_healthy_foot)
    turned = after.angle - state.angle
    return after, advance_walk(timing, walk, after, now, ended.foot, landed, given, height, follow_rate, turned, step)


def advance_walk(
    timing: GaitTiming,
    walk: WalkState,
    state: PlantState,
    now: GaitNow,
    foot: Direction,
    landed: ground.Landing,
    given: float,
    height: float,
    follow_rate: float,
    turned: float,
    step: float,
) -> WalkState:
    """State of the walk after a step: sensor forces, and totals over the strides.

    ``height`` is the toe height relative to the healthy gait [m], ``turned`` the ankle rotation in this step [rad].
    """
    strikes = landed.strikes > 0.5
    # A foot that points down at the strike meets the ground with its toes.
    touches_first = ground.foot_angle(now.shank, state.angle) < timing.ground_angle
    toes_first = (1.0 if touches_first else 0.0) if strikes else walk.toes_first
    heel, toe = ground.ground_forces(landed.contact, timing, now, toes_first)
    # A first order, implicit: forces follow within one step where the sensor is quick.
    share = follow_rate * step / (1.0 + follow_rate * step)
    watched = now.phase >= timing.clearance_from and now.phase <= timing.clearance_to
    lowest = min(walk.clearance, height if watched else walk.clearance)
    on_toes = walk.contact == ground.TOE
    clearance = NO_CLEARANCE if strikes else lowest
    toe_landing = 1.0 if strikes and touches_first else 0.0
    counted_clearance = lowest if strikes and lowest < NO_CLEARANCE else 0.0
    # Trapezoidal rule over the angle that the ankle turned in this step.
    work = 0.5 * (given + walk.external_torque) * turned if on_toes else 0.0
    positive_work = max(work, 0.0)
    return WalkState(
        contact=landed.contact,
        offset=landed.offset,
        now=now,
        foot=foot,
        external_torque=given,
        heel_force=walk.heel_force + (heel - walk.heel_force) * share,
        toe_force=walk.toe_force + (toe - walk.toe_force) * share,
        toes_first=toes_first,
        clearance=clearance,
        strides=walk.strides + landed.strikes,
        toe_landings=walk.toe_landings + toe_landing,
        clearances=walk.clearances + counted_clearance,
        positive_push_off_work=walk.positive_push_off_work + positive_work,
        net_push_off_work=walk.net_push_off_work + work,
    )
