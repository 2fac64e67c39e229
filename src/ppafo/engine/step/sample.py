"""Sample of the controller: read sensors, compute the command, and store delayed readings."""

from ppafo.engine.program import Program
from ppafo.engine.step.lane import Lane, Now
from ppafo.engine.step.phases import present_pressures
from ppafo.model.ports import sent_command, shown_signals
from ppafo.model.sensors import GaitMeasurement, Measurement, measure, measure_gait


def control(parts: Program, lane: Lane, now: Now) -> None:
    """Read the sensors and compute the command."""
    assert parts.controller is not None, "a controller decides"
    sense(parts, lane, now)
    wanted = reference_at(parts, lane, now.step * lane.timing.step)
    command, after = parts.controller.update(
        lane.controller, lane.controller_state, wanted, lane.seen, lane.timing.period
    )
    lane.controller_state = after
    if parts.valve.command_for is not None and parts.has_reference:
        seen_1 = lane.seen.pressure_1
        seen_2 = lane.seen.pressure_2
        command = parts.valve.command_for(lane.valve, command, seen_1, seen_2)
    if parts.inverts_valve:
        command = sent_command(command)
    lane.result = lane.result._replace(command=command)


def reference_at(parts: Program, lane: Lane, time: float) -> float:
    """Return the reference at a time [s]."""
    value, _, _ = parts.reference.value(lane.reference, time)
    return float(value)


def sense(parts: Program, lane: Lane, now: Now) -> None:
    """Set the sensor readings."""
    if parts.leg is not None and not parts.ideal_sensors:
        measure_walk(parts, lane, now)
    elif parts.leg is not None:
        lane.seen = gait(parts, lane)
    else:
        lane.seen = vane(parts, lane, now)


# Of a vane. Rows of the history of signals: angle [rad], pressure 1 and 2 [Pa]; they stand as numbers, since the place
# where a history is set is read before names stand for what they mean (``engine/reduction.py``).


def vane(parts: Program, lane: Lane, now: Now) -> Measurement:
    """Return the sensor readings of an actuator."""
    if parts.late_signals:
        angle = lane.signal_history[0, now.late_signal]
        pressure_1 = lane.signal_history[1, now.late_signal]
        pressure_2 = lane.signal_history[2, now.late_signal]
    else:
        angle, pressure_1, pressure_2 = present_signals(parts, lane)
    if parts.ideal_sensors:
        torque = parts.actuator.torque(lane.plant, angle, pressure_1, pressure_2)
        return Measurement(angle=angle, pressure_1=pressure_1, pressure_2=pressure_2, torque=torque)
    return measure(lane.sensors, angle, pressure_1, pressure_2, lane.plant, now.sample, parts=parts.functions)


def present_signals(parts: Program, lane: Lane) -> tuple[float, float, float]:
    """Return angle [rad] and absolute pressures [Pa] as shown by sensors without delay."""
    pressure_1, pressure_2 = present_pressures(parts, lane)
    if "shown_signals" in parts.ports_with_laws:
        return shown_signals(lane.state.angle, pressure_1, pressure_2)
    return lane.state.angle, pressure_1, pressure_2


def fill_signals(parts: Program, lane: Lane, slot: int) -> None:
    """Fill the ring buffer of delayed signals with the initial values."""
    angle, pressure_1, pressure_2 = present_signals(parts, lane)
    lane.signal_history[0, slot] = angle
    lane.signal_history[1, slot] = pressure_1
    lane.signal_history[2, slot] = pressure_2


def remember_command(parts: Program, lane: Lane, slot: int) -> None:
    """Store the command of a step, for a valve with a dead time."""
    lane.command_history[slot] = lane.result.command


# Of a walk.


def gait(parts: Program, lane: Lane) -> GaitMeasurement:
    """Return the readings of ideal sensors in a walk."""
    pressure_1, pressure_2 = present_pressures(parts, lane)
    return GaitMeasurement(
        angle=lane.state.angle,
        pressure_1=pressure_1,
        pressure_2=pressure_2,
        torque=parts.actuator.torque(lane.plant, lane.state.angle, pressure_1, pressure_2),
        heel_force=lane.walk.heel_force,
        toe_force=lane.walk.toe_force,
    )


def measure_walk(parts: Program, lane: Lane, now: Now) -> None:
    """Set the sensor readings of a walk, and the sensor state."""
    pressure_1, pressure_2 = present_pressures(parts, lane)
    lane.seen, lane.gait_seen = measure_gait(
        lane.sensors,
        lane.gait_sensors,
        lane.gait_seen,
        lane.state.angle,
        pressure_1,
        pressure_2,
        lane.walk.heel_force,
        lane.walk.toe_force,
        lane.plant,
        now.sample,
        parts=parts.functions,
    )
