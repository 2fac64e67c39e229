"""Phases of a step of one device in the order of execution, from the valve to the stored state.

A step is done whole if nothing changes abruptly inside it and its error is known to be small, as for the gas of a
locked vane with a valve without dynamics. Otherwise each run divides the step into its own parts. A part ends where a
coil switches, a late command arrives, the vane meets a stop, a sample is due, or the error would become too large. Runs
that have completed the step wait for the others, and all runs are independent.
"""

from ppafo.engine.program import Program
from ppafo.engine.scheme import motion, pneumatics
from ppafo.engine.step import gas, stated
from ppafo.engine.step.lane import Lane, Now
from ppafo.model.plant import direction_of, driving_torque, holds_still, net_torque
from ppafo.model.ports import at_valve, shown_signals

# Beyond 1e6 rad/s or 1 t of gas a run is lost.
IMPOSSIBLE_RATE = 1.0e6
IMPOSSIBLE_MASS = 1.0e3


# When it is, and what the valve is told.


def time_of(parts: Program, lane: Lane, now: Now) -> float:
    """Time [s] since the start of the run, at the start of a step or part."""
    time = now.step * lane.timing.step
    return time + lane.before if parts.is_parted else time


def length_of(parts: Program, lane: Lane) -> float:
    """Length [s] of the step or of the present part."""
    return lane.length if parts.is_parted else lane.timing.step


def until_command(parts: Program, lane: Lane) -> float:
    """Time [s] until a late command arrives inside this step."""
    return lane.timing.command_lag * lane.timing.step - lane.before - motion.SAME_INSTANT


def command_of(parts: Program, lane: Lane, now: Now) -> float:
    """Command at the valve [-] in a step or part."""
    if parts.late_commands:
        # The dead time in whole steps and a rest: the command of one step or the next acts, by the time within it.
        early = lane.command_history[now.early_command]
        late = lane.command_history[now.late_command]
        command = early if until_command(parts, lane) > 0.0 else late
    else:
        command = lane.result.command
    return at_valve(command) if "at_valve" in parts.ports_with_laws else command


# Before the gas.


def hold_chambers(parts: Program, lane: Lane) -> None:
    """Set the ratios of pressure to mass of both chambers before the first step; constant for a locked vane."""
    lane.held = pneumatics.held_chambers(lane.plant, lane.state.angle, parts=parts.functions)


def begin_step(parts: Program, lane: Lane) -> None:
    """Set the completed part of the step to zero."""
    lane.before = 0.0


def measure_part(parts: Program, lane: Lane, now: Now) -> None:
    """Set the length of the next part; the part of an unconstrained vane ends at a stop at the latest."""
    remaining = max(now.goal * lane.timing.step - lane.before, 0.0)
    until = remaining
    time = time_of(parts, lane, now)
    if parts.late_commands:
        wait = until_command(parts, lane)
        until = min(until, wait + motion.SAME_INSTANT) if wait > 0.0 else until
    if parts.late_signals:
        look = (1.0 - lane.timing.signal_lag) * lane.timing.step - lane.before
        until = min(until, look) if look > motion.SAME_INSTANT else until
    if parts.valve.jumps:
        command = command_of(parts, lane, now)
        settled = parts.valve.settle(lane.valve, lane.valve_state, command, time)
        jump = parts.valve.next_event(lane.valve, settled, command, time)
        until = motion.until_jump(jump - time, until)
    if parts.foot is not None and parts.shank_jumps:
        until = motion.until_jump(parts.foot.until_jump(parts, lane, time), until)
    # A failed run takes its steps whole, so that it ends without holding up its block.
    hurries = lane.result.failure_time <= time
    if parts.is_adaptive:
        until = remaining if remaining == 0.0 or hurries else motion.part_length(lane.pace, until)
    else:
        until = remaining if hurries else until
    if parts.is_adaptive and parts.angle is None:
        begin_motion(parts, lane, time, until)
    else:
        lane.length = until
    lane.remaining = remaining


# The gas.


def open_valve(parts: Program, lane: Lane, now: Now) -> None:
    """Set the valve state and the flows at the start of the step."""
    command = command_of(parts, lane, now)
    time = time_of(parts, lane, now)
    length = length_of(parts, lane)
    if parts.is_parted:
        # A part may be refused: its valve becomes the state only once it is taken.
        lane.shown, lane.next_valve = parts.valve.advance(lane.valve, lane.valve_state, command, time, length)
    else:
        lane.shown, lane.valve_state = parts.valve.advance(lane.valve, lane.valve_state, command, time, length)
    source = lane.plant if parts.feed is None else parts.feed.source(parts, lane)
    port_1, port_2 = parts.valve.connect(source, lane.shown)
    pressure_1, pressure_2 = present_pressures(parts, lane)
    flow = parts.valve.port_flow
    lane.flowing = pneumatics.gas_flows(lane.plant, pressure_1, pressure_2, port_1, port_2, flow)


def present_pressures(parts: Program, lane: Lane) -> tuple[float, float]:
    """Return both absolute pressures [Pa] of the present state."""
    if parts.hands_chambers_on:
        return parts.functions.held_pressures(lane.plant, lane.held, lane.state)
    return parts.actuator.pressures(lane.plant, lane.state.angle, lane.state.mass_1, lane.state.mass_2)


def begin_gas(parts: Program, lane: Lane, now: Now) -> None:
    """Set the first stage of the gas, with volumes that end at the predicted angle of the vane."""
    length = length_of(parts, lane)
    if parts.angle is not None and not parts.is_locked:
        angle, rate, _ = parts.angle.value(lane.path, time_of(parts, lane, now) + length)
        lane.prescribed = motion.PrescribedStep(angle, rate)
    if parts.leg is not None:
        parts.leg.hold_ahead(parts, lane)
    next_angle = angle_ahead(parts, lane)
    if parts.feed is None:
        gas.begin(parts, lane, next_angle, length)
    else:
        parts.feed.begin(parts, lane, next_angle, length)


def angle_ahead(parts: Program, lane: Lane) -> float:
    """Return the joint angle [rad] at which the chamber volumes end in the step."""
    if parts.leg is not None:
        angle: float = parts.leg.assumed_angle(parts, lane)
        return angle
    if parts.angle is None:
        return lane.begun.next_angle
    return lane.state.angle if parts.is_locked else lane.prescribed.next_angle


def pass_gas(parts: Program, lane: Lane, now: Now) -> None:
    """Set the flows of the second stage, at the pressures after the first stage."""
    if parts.stated_at_ports:
        stated.predict(parts, lane, command_of(parts, lane, now), length_of(parts, lane))
    source = lane.plant if parts.feed is None else parts.feed.source_ahead(parts, lane)
    if parts.valve.connect_ahead is None:
        port_1, port_2 = parts.valve.connect(source, lane.shown)
    else:
        port_1, port_2 = parts.valve.connect_ahead(source, lane.shown)
    flow = parts.valve.port_flow
    stage = lane.gas_stage
    lane.passing = pneumatics.gas_flows(lane.plant, stage.end_1, stage.end_2, port_1, port_2, flow).flows
    if parts.stated_at_ports:
        stated.restore(parts, lane)


def feed_gas(parts: Program, lane: Lane) -> None:
    """Set the second stage: gas of the step, supply lines and, for adaptive steps, the error."""
    length = length_of(parts, lane)
    gas.change(parts, lane, length)
    if parts.feed is not None:
        parts.feed.end(parts, lane, length)
    if parts.is_adaptive:
        ahead = angle_ahead(parts, lane)
        error = gas.error(parts, lane, ahead, length)
        if parts.feed is not None:
            # The larger of both errors, not their sum: each has its own limit.
            error = max(error, parts.feed.error(parts, lane))
        if parts.valve.shift is not None:
            shift = parts.valve.shift(lane.valve_state, lane.next_valve)
            error = error + gas.shift_error(parts, lane, shift, ahead, length)
        lane.gas_error = error


# The motion of a vane without ground.


def torque_of_leg(parts: Program, lane: Lane, time: float, angle: float) -> float:
    """Return the torque of a leg on the vane [N m] at a time [s] and an angle [rad]."""
    if parts.foot is None:
        return 0.0
    torque: float = parts.foot.torque(parts, lane, time, angle)
    return torque


def begin_motion(parts: Program, lane: Lane, time: float, longest: float) -> None:
    """Set the predicted part of an unconstrained vane, and its length [s]: ``longest`` [s], or up to a stop.

    The gas then works against the motion that actually happens. A vane at rest slides if the torque exceeds static
    friction.
    """
    plant = lane.plant
    angle = lane.state.angle
    velocity = lane.state.angular_velocity
    beginning = time + motion.SAME_INSTANT if parts.shank_jumps else time
    added = torque_of_leg(parts, lane, beginning, angle)
    pressure_1, pressure_2 = parts.actuator.pressures(plant, angle, lane.state.mass_1, lane.state.mass_2)
    torque = driving_torque(plant, parts.actuator.torque(plant, angle, pressure_1, pressure_2), angle) + added
    friction = motion.friction_now(plant, velocity, pressure_1, pressure_2)
    stays = holds_still(torque, friction.at_rest, angle <= plant.angle_min, angle >= plant.angle_max)
    leaving = 0.0 if stays else direction_of(torque)
    way = direction_of(velocity) if velocity != 0.0 else leaving
    net = net_torque(torque, way, friction.in_motion, plant.viscous_damping, angle, velocity)
    acceleration = net / plant.inertia if way != 0.0 else 0.0
    distance = plant.angle_max - angle if way > 0.0 else angle - plant.angle_min
    gets_there = velocity * velocity + 2.0 * acceleration * way * distance >= 0.0
    impact = motion.time_to_stop(distance, abs(velocity), acceleration * way)
    meets_stop = way != 0.0 and gets_there and impact <= longest
    length = impact if meets_stop else longest
    stop = plant.angle_max if way > 0.0 else plant.angle_min
    # The path at the present acceleration: what it misses is in the error of the part.
    free_angle = motion.clamp_angle(plant, angle + length * (velocity + 0.5 * length * acceleration))
    lane.begun = motion.FreePart(
        way=way,
        acceleration=acceleration,
        torque=torque,
        next_angle=stop if meets_stop else free_angle,
        meets_stop=1.0 if meets_stop else 0.0,
    )
    lane.length = length


def slide(parts: Program, lane: Lane, now: Now) -> None:
    """Set the end of the part for a vane that slides on or stays at rest."""
    length = length_of(parts, lane)
    gas.add(parts, lane)
    end = time_of(parts, lane, now) + length
    # Just before a jump that ends the part, as the next one begins just behind it.
    ending = end - motion.SAME_INSTANT if parts.shank_jumps else end
    plant = lane.plant
    begun = lane.begun
    ahead = begun.next_angle
    velocity = lane.fed.angular_velocity
    added = torque_of_leg(parts, lane, ending, ahead)
    next_1, next_2 = parts.actuator.pressures(plant, ahead, lane.fed.mass_1, lane.fed.mass_2)
    next_torque = driving_torque(plant, parts.actuator.torque(plant, ahead, next_1, next_2), ahead) + added
    next_rate = velocity + begun.acceleration * length
    friction = motion.friction_now(plant, next_rate, next_1, next_2)
    net = net_torque(next_torque, begun.way, friction.in_motion, plant.viscous_damping, ahead, next_rate)
    full_velocity = motion.next_velocity(plant, velocity, begun.acceleration, net, next_rate, length)
    slides = begun.way != 0.0 and full_velocity * begun.way > 0.0
    thrown_back = motion.rebound_velocity(plant, full_velocity, next_torque)
    slid_velocity = thrown_back if begun.meets_stop > 0.5 else full_velocity

    # The sums with 0 are also in ``depart_at``, so that a vane at rest has its bits.
    place = motion.clamp_angle(plant, lane.fed.angle + 0.0)
    at_lower = place <= plant.angle_min
    at_upper = place >= plant.angle_max
    stays = holds_still(begun.torque + 0.0 * (next_torque - begun.torque), friction.at_rest, at_lower, at_upper)
    stays_later = holds_still(next_torque, friction.at_rest, at_lower, at_upper)
    rests_on = begun.way == 0.0 and stays and stays_later
    lane.slid = motion.PartSlide(
        torque=next_torque,
        friction=friction,
        angular_velocity=full_velocity,
        departs=0.0 if slides or rests_on else 1.0,
    )
    angle = ahead if slides else place
    lane.moved = motion.PartEnd(angle, slid_velocity if slides else 0.0, motion_error(parts, lane, angle, length))


def depart(parts: Program, lane: Lane) -> None:
    """Set the end of the part for a vane that reverses or starts to move, which is rare; otherwise it is unchanged."""
    gas.add(parts, lane)
    length = length_of(parts, lane)
    begun = lane.begun
    slid = lane.slid
    velocity = lane.fed.angular_velocity
    fall = velocity - slid.angular_velocity
    fraction = velocity / (fall if fall != 0.0 else 1.0) if begun.way != 0.0 else 0.0
    turning_angle = motion.clamp_angle(lane.plant, lane.fed.angle + 0.5 * fraction * length * velocity)
    left_torque = begun.torque + fraction * (slid.torque - begun.torque)
    departure = motion.Departure(fraction, turning_angle, 0.0)
    angle, rate = motion.depart_at(lane.plant, departure, left_torque, slid.torque, slid.friction, length)
    error = motion_error(parts, lane, angle, length)
    departs = slid.departs > 0.5
    lane.moved = motion.PartEnd(
        angle=angle if departs else lane.moved.angle,
        rate=rate if departs else lane.moved.rate,
        error=error if departs else lane.moved.error,
    )


def motion_error(parts: Program, lane: Lane, angle: float, length: float) -> float:
    """Ratio of the error of the angle at the end of a part [rad] to the allowed error [-]."""
    plant = lane.plant
    begun = lane.begun
    slid = lane.slid
    sliding = slid.friction.in_motion
    damping = plant.viscous_damping
    last = net_torque(slid.torque, begun.way, sliding, damping, begun.next_angle, slid.angular_velocity) / plant.inertia
    # A change of acceleration over the part bends the path by a sixth of it times the length squared.
    bent = abs(last - begun.acceleration) * length * length * motion.SIXTH if begun.way != 0.0 else 0.0
    # The gas worked against a motion that did not happen: that is an error although the vane is where it is.
    missed = motion.MISSED_FRACTION * abs(angle - begun.next_angle)
    # Where a chamber is small, a little of the angle is much of the pressure.
    volume_1, volume_2 = parts.functions.rest_volumes(plant, begun.next_angle)
    swept = plant.displacement_per_radian * (plant.angle_max - plant.angle_min)
    allowed_volume = min(motion.ALLOWED_OF_ANGLE * swept, motion.ALLOWED_BY_GAS * min(volume_1, volume_2))
    return float((bent + missed) * plant.displacement_per_radian / allowed_volume)


# The end.


def finish(parts: Program, lane: Lane, now: Now) -> None:
    """Set the state at the end of a step or part, unless the part is refused, and the first time of a failure."""
    time = time_of(parts, lane, now)
    length = length_of(parts, lane)
    if parts.angle is not None:
        feed_gas(parts, lane)
    # Gas before motion: the vane ends under the pressures of the new gas.
    gas.add(parts, lane)
    end_motion(parts, lane)
    gas.work(parts, lane)
    if parts.stated:
        stated.advance(parts, lane, command_of(parts, lane, now), length)
    taken = True
    follows = True
    if parts.is_adaptive:
        missed = 0.0 if parts.rests_whole and rests(parts, lane) else error_of(parts, lane, now)
        # A part with a mass below 0 or NaN counts as the worst error, and is done again, shorter.
        error = missed / lane.timing.tolerance if has_gas(parts, lane) else motion.MAXIMUM_ERROR
        # A run that has failed is carried to its end without more parts, so that its lane holds nobody up.
        refused = motion.is_refused(error, length) and not lane.result.failure_time <= time
        longest = motion.next_pace(lane.pace, error, length, refused, lane.timing.step)
        active = lane.remaining > 0.0
        lane.pace = longest if active else lane.pace
        taken = active and not refused
        follows = not missed > motion.LOST
    elif parts.is_parted:
        taken = lane.remaining > 0.0
    # Where parts are rare, lanes that wait get all of their state again.
    waits = False if parts.parts_are_rare or not parts.is_parted else not taken
    keep_state(parts, lane, waits)
    possible = waits or (is_possible(parts, lane) and follows)
    failed = lane.result.failure_time if possible else min(lane.result.failure_time, time + length)
    lane.result = lane.result._replace(failure_time=failed)
    if parts.late_signals:
        sense_end(parts, lane, now, length, taken)
    if parts.is_parted:
        # Sums of part lengths miss the goal by rounding: the last part sets it.
        arrives = (length >= lane.remaining and taken) or lane.remaining == 0.0
        lane.before = now.goal * lane.timing.step if arrives else lane.before + (length if taken else 0.0)
        lane.remaining = 0.0 if arrives else lane.remaining


def end_motion(parts: Program, lane: Lane) -> None:
    """Set the state at the end of the step, with the gas at the angle reached."""
    if parts.leg is not None:
        # The chambers that the next step finds are those where this one ends.
        parts.leg.end(parts, lane, length_of(parts, lane))
        assumed = parts.leg.assumed_angle(parts, lane)
        lane.after = gas.move(parts, lane, lane.after, assumed, lane.after.angle)
    elif parts.angle is None:
        moved = gas.move(parts, lane, lane.fed, lane.begun.next_angle, lane.moved.angle)
        lane.after = motion.with_motion(moved, lane.moved.angle, lane.moved.rate)
    elif parts.is_locked:
        lane.after = lane.fed
    else:
        lane.after = motion.with_motion(lane.fed, lane.prescribed.next_angle, lane.prescribed.next_rate)


def error_of(parts: Program, lane: Lane, now: Now) -> float:
    """Return the largest error of a part divided by the allowed error [-]: of motion, gas, and effect states."""
    moved = lane.moved.error if parts.angle is None else 0.0
    if parts.shank_jumps:
        # From knot to knot the acceleration runs one way, and the errors of parts add up.
        moved = 2.0 * moved
    missed = max(moved, lane.gas_error)
    if parts.stated_with_errors:
        missed = max(missed, stated.error(parts, lane, command_of(parts, lane, now), length_of(parts, lane)))
    return missed


def rests(parts: Program, lane: Lane) -> bool:
    """Return whether a prescribed joint is at rest in a step and its chambers fill slowly enough for a whole step."""
    room = lane.plant.atmospheric_pressure
    still = parts.actuator.chambers(lane.plant, lane.state.angle, room, room)
    # A stricter tolerance counts as a longer step, as where a run is planned.
    length = lane.timing.step / min(1.0, lane.timing.tolerance)
    stiffness = lane.thermal.heat_capacity_ratio if parts.is_thermal else 1.0
    is_slow = pneumatics.is_slow(lane.plant, length, still.volume_1, still.volume_2, stiffness)
    return is_slow and lane.prescribed.next_angle == lane.state.angle and lane.state.angular_velocity == 0.0


def has_gas(parts: Program, lane: Lane) -> bool:
    """Return whether all masses at the end of the step are positive."""
    found = lane.after.mass_1 > 0.0 and lane.after.mass_2 > 0.0
    if parts.is_thermal:
        found = found and lane.warmed.mass_1 > 0.0 and lane.warmed.mass_2 > 0.0
    if parts.feed is not None:
        found = found and lane.next_lines.mass_1 > 0.0 and lane.next_lines.mass_2 > 0.0
    return found


def is_possible(parts: Program, lane: Lane) -> bool:
    """Return whether the state at the end of the step is physically possible."""
    least = min(lane.after.mass_1, lane.after.mass_2)
    most = max(lane.after.mass_1, lane.after.mass_2)
    if parts.is_thermal:
        least = min(lane.after.mass_1, lane.after.mass_2, lane.warmed.mass_1, lane.warmed.mass_2)
        most = max(lane.after.mass_1, lane.after.mass_2, lane.warmed.mass_1, lane.warmed.mass_2)
    possible = abs(lane.after.angular_velocity) < IMPOSSIBLE_RATE and least > 0.0 and most < IMPOSSIBLE_MASS
    return possible and stated.are_bounded(parts, lane) if parts.stated else possible


def keep_state(parts: Program, lane: Lane, waits: bool) -> None:
    """Store the state after the step as the present state, unless the run waits."""
    lane.state = lane.state if waits else lane.after
    if parts.is_thermal:
        lane.masses = lane.masses if waits else lane.warmed
    if parts.leg is not None:
        lane.walk = lane.walk if waits else lane.walk_after
    for name in parts.stated:
        lane[f"{name}_state"] = lane[f"{name}_state"] if waits else lane[f"{name}_state_after"]
    if parts.is_parted:
        lane.valve_state = lane.valve_state if waits else lane.next_valve
    if parts.is_parted and parts.feed is not None:
        lane.line_state = lane.line_state if waits else lane.next_lines


def sense_end(parts: Program, lane: Lane, now: Now, length: float, taken: bool) -> None:
    """Store delayed sensor readings at the end of a step or part, with the effect states.

    A signal delayed by a fraction of a step is sampled earlier than the end of the step by that fraction.
    """
    angle = lane.after.angle
    pressure_1, pressure_2 = parts.actuator.pressures(lane.plant, angle, lane.after.mass_1, lane.after.mass_2)
    if "shown_signals" in parts.ports_with_laws:
        angle, pressure_1, pressure_2 = shown_signals(angle, pressure_1, pressure_2)
    look_at = (1.0 - lane.timing.signal_lag) * lane.timing.step
    looks = taken and abs(lane.before + length - look_at) <= motion.SAME_INSTANT
    lane.signal_history[0, now.next_signal] = angle if looks else lane.signal_history[0, now.next_signal]
    lane.signal_history[1, now.next_signal] = pressure_1 if looks else lane.signal_history[1, now.next_signal]
    lane.signal_history[2, now.next_signal] = pressure_2 if looks else lane.signal_history[2, now.next_signal]


def give_up(parts: Program, lane: Lane, now: Now) -> None:
    """Mark a run as failed if its step is not complete after the largest number of parts."""
    time = time_of(parts, lane, now)
    gives_up = lane.remaining > 0.0 and lane.result.failure_time > time
    lane.result = lane.result._replace(
        failure_time=time if gives_up else lane.result.failure_time,
        too_many_parts=1.0 if gives_up else lane.result.too_many_parts,
    )
