"""Walking leg with the device in an integration step: prescribed shank, foot free or on the ground."""

from ppafo.engine.groups import Groups, given, handed, kept
from ppafo.engine.program import Program
from ppafo.engine.scheme.motion import (
    Departure,
    clamp_angle,
    depart_at,
    friction_now,
    next_velocity,
    time_to_stop,
    with_motion,
)
from ppafo.engine.scheme.pneumatics import SHORTEST, HeldChambers, held_chambers
from ppafo.engine.scheme.walking import (
    NO_CLEARANCE,
    CarriedFoot,
    DeviceShare,
    WalkEnd,
    WalkState,
    WalkStep,
    carried_foot,
    foot_direction,
    torque_with_carried,
)
from ppafo.engine.step import gas
from ppafo.engine.step.lane import Lane, Now
from ppafo.engine.step.phases import length_of, time_of
from ppafo.model import contact as ground
from ppafo.model.gait import (
    GaitMeasured,
    GaitNow,
    GaitPlace,
    GaitSeries,
    GaitTiming,
    gait_of,
    measured_at,
    place_at,
)
from ppafo.model.leg import LegParameters, foot_inertia_about_ankle
from ppafo.model.plant import direction_of, net_torque, torque_less_loads, viscous_torque
from ppafo.model.ports import friction_in_motion, rebound
from ppafo.model.sensors import GaitSeen, GaitSensors


def groups(_parts: Program) -> Groups:
    """Groups for a walking leg: leg and gait, state of the walk, and values passed between phases."""
    return {
        "leg": given(LegParameters),
        "share": given(DeviceShare),
        "gait": given(GaitSeries),
        "gait_timing": given(GaitTiming),
        "gait_sensors": given(GaitSensors),
        "walk": kept(WalkState),
        "gait_seen": kept(GaitSeen),
        "place": handed(GaitPlace),
        "measured": handed(GaitMeasured),
        "next_gait": handed(GaitNow),
        "carried": handed(CarriedFoot),
        "walk_begun": handed(WalkStep),
        "ahead": handed(HeldChambers),
        "ended": handed(WalkEnd),
    }


# Before the gas.


def carry(parts: Program, lane: Lane) -> None:
    """Set the torques of the foot before the first step."""
    lane.carried = carried_foot(lane.leg, lane.share, lane.walk.now, lane.walk.foot)


def find_place(parts: Program, lane: Lane, now: Now) -> None:
    """Set the gait phase at the end of the step."""
    lane.place = place_at(lane.gait_timing, time_of(parts, lane, now) + length_of(parts, lane))


def find_measured(parts: Program, lane: Lane) -> None:
    """Set the measured gait at the phase where the step ends."""
    lane.measured = measured_at(lane.gait, lane.gait_timing, lane.leg, lane.place)


def find_gait(parts: Program, lane: Lane) -> None:
    """Set the gait at the end of the step, for the leg of this wearer."""
    lane.next_gait = gait_of(lane.leg, lane.measured)


def begin(parts: Program, lane: Lane) -> None:
    """Set the predicted step of the foot, free and on the ground. Equations (1), (2), (10)."""
    state = lane.state
    step = length_of(parts, lane)
    ground_angle = lane.gait_timing.ground_angle
    velocity = state.angular_velocity
    way = direction_of(velocity)
    pressure_1, pressure_2 = parts.functions.held_pressures(lane.plant, lane.held, state)
    actuator = parts.actuator.torque(lane.plant, state.angle, pressure_1, pressure_2)
    added = torque_with_carried(lane.leg, lane.walk.contact, lane.walk.now, ground_angle, state.angle, lane.carried)
    torque = torque_less_loads(actuator, state.angle) + added
    friction = friction_now(lane.plant, velocity, pressure_1, pressure_2)
    net = net_torque(torque, way, friction.in_motion, lane.plant.viscous_damping, state.angle, velocity)
    acceleration = net / lane.plant.inertia if way != 0.0 else 0.0
    # The difference fades implicitly, so that a step longer than the fading time does not overshoot.
    offset = lane.walk.offset / (1.0 + step / ground.FADING_TIME)
    prescribed = ground.prescribed_ankle(lane.walk.contact, lane.next_gait, ground_angle, lane.leg.keeps_gait)
    lane.walk_begun = WalkStep(
        free_angle=state.angle + step * (velocity + 0.5 * step * acceleration),
        acceleration=acceleration,
        torque=torque,
        led=ground.Ankle(
            clamp_angle(lane.plant, prescribed.angle + offset),
            prescribed.rate - offset / ground.FADING_TIME,
            prescribed.acceleration + offset / (ground.FADING_TIME * ground.FADING_TIME),
        ),
        offset=offset,
    )


def is_free(parts: Program, lane: Lane) -> bool:
    """Return whether the foot moves by its own dynamics in the step."""
    return ground.is_free(lane.walk.contact, lane.leg.keeps_gait)


def assumed_angle(parts: Program, lane: Lane) -> float:
    """Return the joint angle [rad] at which the chamber volumes end in a step of a walk."""
    free_angle = clamp_angle(lane.plant, lane.walk_begun.free_angle)
    return free_angle if is_free(parts, lane) else lane.walk_begun.led.angle


def hold_ahead(parts: Program, lane: Lane) -> None:
    """Set the chambers at the angle where the volumes end."""
    lane.ahead = held_chambers(lane.plant, assumed_angle(parts, lane), parts=parts.functions)


# Behind it.


def reach(parts: Program, lane: Lane) -> None:
    """Set the state at the end of a step in which the foot neither reverses nor starts to move."""
    gas.add(parts, lane)
    begun = lane.walk_begun
    step = length_of(parts, lane)
    velocity = lane.fed.angular_velocity
    free = is_free(parts, lane)
    predicted = clamp_angle(lane.plant, begun.free_angle)
    # One direction of the foot for the whole end: where an event stops it short, the difference is of second order.
    foot = foot_direction(lane.next_gait.shank, assumed_angle(parts, lane))
    # The same for both ends of an event: the foot's direction changes little within a step.
    lane.carried = carried_foot(lane.leg, lane.share, lane.next_gait, foot)
    added = torque_with_carried(
        lane.leg, lane.walk.contact, lane.next_gait, lane.gait_timing.ground_angle, predicted, lane.carried
    )
    way = direction_of(velocity)
    next_1, next_2 = parts.functions.held_pressures(lane.plant, lane.ahead, lane.fed)
    torque = torque_less_loads(parts.actuator.torque(lane.plant, predicted, next_1, next_2), predicted) + added
    next_rate = velocity + begun.acceleration * step
    friction = friction_now(lane.plant, next_rate, next_1, next_2)
    net = net_torque(torque, way, friction.in_motion, lane.plant.viscous_damping, predicted, next_rate)
    full_velocity = next_velocity(lane.plant, velocity, begun.acceleration, net, next_rate, step)
    # '&' and no branch: the step of a walk runs on all lanes.
    slides_through = (way != 0.0) & (full_velocity * way > 0.0) & (begun.free_angle == predicted)
    departs = 0.0 if slides_through else 1.0
    lane.ended = WalkEnd(
        leg_torque=added,
        foot=foot,
        torque=torque,
        angle=predicted if free else begun.led.angle,
        rate=full_velocity if free else begun.led.rate,
        departs=departs if free else 0.0,
    )


def depart(parts: Program, lane: Lane) -> None:
    """Set the end of a step with a stop, reversal or start of motion, which is rare; otherwise it is unchanged."""
    gas.add(parts, lane)
    begun = lane.walk_begun
    ended = lane.ended
    state = lane.fed
    ahead = lane.ahead
    step = length_of(parts, lane)
    velocity = state.angular_velocity
    pressure_1, pressure_2 = parts.functions.held_pressures(lane.plant, ahead, state)
    way = direction_of(velocity)
    # The velocity runs linearly between begin and end: its zero is the reversal.
    fall = velocity - ended.rate
    reverses = way != 0.0 and ended.rate * way <= 0.0
    reversal = velocity / (fall if reverses else 1.0)
    stop = lane.plant.angle_max if velocity > 0.0 else lane.plant.angle_min
    hits = way != 0.0 and begun.free_angle != clamp_angle(lane.plant, begun.free_angle)
    impact = min(time_to_stop(abs(stop - state.angle), abs(velocity), begun.acceleration * way) / step, 1.0)
    # Whichever event is first; a foot at rest departs at the start of the step.
    hits_first = hits and not (reverses and reversal < impact)
    turning_angle = clamp_angle(lane.plant, state.angle + 0.5 * reversal * step * velocity)
    fraction = impact if hits_first else (reversal if reverses else 0.0)
    thrown_back = rebound(velocity - impact * fall)
    departure = Departure(
        fraction=fraction,
        angle=stop if hits_first else (turning_angle if reverses else state.angle),
        angular_velocity=thrown_back if hits_first else 0.0,
    )
    torque = begun.torque + fraction * (ended.torque - begun.torque)
    friction = friction_now(lane.plant, 0.0, pressure_1, pressure_2)
    angle, rate = depart_at(lane.plant, departure, torque, ended.torque, friction, step)
    there = held_chambers(lane.plant, angle, parts=parts.functions)
    departs = ended.departs > 0.5
    lane.ahead = HeldChambers(
        per_mass_1=there.per_mass_1 if departs else ahead.per_mass_1,
        per_mass_2=there.per_mass_2 if departs else ahead.per_mass_2,
        angle=there.angle if departs else ahead.angle,
    )
    lane.ended = lane.ended._replace(angle=angle if departs else ended.angle, rate=rate if departs else ended.rate)


def external_torque(parts: Program, lane: Lane, acceleration: float) -> float:
    """T_ex [N m]: for a free foot by equation (11), on the ground the actuator torque that equation (1) leaves."""
    after = lane.after
    plate = -lane.carried.plate
    speed = lane.after.angular_velocity
    # In the air the foot takes what its own motion needs; on the ground the shank leads, and the device gives what is
    # left.
    passive_damping = viscous_torque(lane.leg.ankle_damping, speed)
    leg_alone = lane.ended.leg_torque - plate
    needed = foot_inertia_about_ankle(lane.leg) * acceleration + passive_damping - leg_alone
    pressure_1, pressure_2 = parts.functions.held_pressures(lane.plant, lane.held, after)
    actuator = parts.actuator.torque(lane.plant, after.angle, pressure_1, pressure_2)
    driving = torque_less_loads(actuator + plate, after.angle)
    friction = friction_in_motion(lane.plant.dynamic_torque, speed, pressure_1, pressure_2)
    net = net_torque(driving, direction_of(speed), friction, lane.share.viscous_damping, after.angle, speed)
    left = net - lane.share.inertia * lane.walk_begun.led.acceleration
    return needed if is_free(parts, lane) else left


def end(parts: Program, lane: Lane, length: float) -> None:
    """Set the states of plant and leg at the end of the step: sensor forces, and totals over the strides."""
    lane.held = lane.ahead
    lane.after = with_motion(lane.fed, lane.ended.angle, lane.ended.rate)
    timing = lane.gait_timing
    walk = lane.walk
    now = lane.next_gait
    after = lane.after
    given_torque = external_torque(
        parts, lane, (after.angular_velocity - lane.fed.angular_velocity) / max(length, SHORTEST)
    )
    landed = ground.landing(walk.contact, timing, now, after.angle, lane.walk_begun.offset, lane.leg.keeps_gait)
    # Height of the toes relative to the healthy gait [m].
    height = lane.leg.toe_lever * (lane.ended.foot.sine - now.sine_healthy_foot)
    strikes = landed.strikes > 0.5
    # A foot that points down at the strike meets the ground with its toes.
    touches_first = ground.foot_angle(now.shank, after.angle) < timing.ground_angle
    toes_first = (1.0 if touches_first else 0.0) if strikes else walk.toes_first
    heel, toe = ground.ground_forces(landed.contact, timing, now, toes_first)
    # A first order, implicit: forces follow within one step where the sensor is quick.
    rate = lane.gait_sensors.follow_rate
    followed = rate * length / (1.0 + rate * length)
    watched = now.phase >= timing.clearance_from and now.phase <= timing.clearance_to
    lowest = min(walk.clearance, height if watched else walk.clearance)
    # Trapezoidal rule over the angle that the ankle turned in this step.
    turned = after.angle - lane.fed.angle
    work = 0.5 * (given_torque + walk.external_torque) * turned if walk.contact == ground.TOE else 0.0
    lane.walk_after = WalkState(
        contact=landed.contact,
        offset=landed.offset,
        now=now,
        foot=lane.ended.foot,
        external_torque=given_torque,
        heel_force=walk.heel_force + (heel - walk.heel_force) * followed,
        toe_force=walk.toe_force + (toe - walk.toe_force) * followed,
        toes_first=toes_first,
        clearance=NO_CLEARANCE if strikes else lowest,
        strides=walk.strides + landed.strikes,
        toe_landings=walk.toe_landings + (1.0 if strikes and touches_first else 0.0),
        clearances=walk.clearances + (lowest if strikes and lowest < NO_CLEARANCE else 0.0),
        positive_push_off_work=walk.positive_push_off_work + max(work, 0.0),
        net_push_off_work=walk.net_push_off_work + work,
    )
