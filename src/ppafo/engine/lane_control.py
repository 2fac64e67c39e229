"""What the lanes do at a sample: sense, control, and keep what sensors and valve get late."""

from ppafo.engine.lane_rows import LaneRows, indent
from ppafo.engine.scheme.parts import SAME_INSTANT
from ppafo.engine.scheme.pneumatics import held_pressures
from ppafo.engine.scheme.shaped_gas import seen_with_torque, torque_at
from ppafo.model.gait_sensors import GaitMeasurement, late_measurement, measure_gait, samples_late
from ppafo.model.places import shown_signals
from ppafo.model.plant import chamber_pressures
from ppafo.model.sensors import Measurement, measure
from ppafo.model.vane import actuator_torque

SIGNALS = ("angle", "pressure_1", "pressure_2")
READINGS = {
    "heel": "heel_force",
    "toe": "toe_force",
    "angle": "angle",
    "pressure_1": "pressure_1",
    "pressure_2": "pressure_2",
}
"""Sensors of a walk, as their faults are named, and what they read."""


def control_loop(rows: LaneRows) -> list[str]:
    """Sense and control, at every sample; nothing where the caller sets the command."""
    controller = rows.program.controller
    if controller is None:
        return []
    groups = ("timing", "plant", "state", "controller", "controller_state", "reference")
    lines = [
        *[rows.load(group) for group in groups],
        *(sense_gait(rows) if rows.program.walks else sense(rows)),
        f"wanted = {rows.add(rows.program.reference.value)}(reference, step_index * timing.step)[0]",
        f"command, controller_state = {rows.add(controller.update)}"
        "(controller, controller_state, wanted, seen, timing.period)",
        *rows.store("controller_state"),
        f"{rows.cells['result.command']} = command",
    ]
    return ["if step_index % steps_per_sample == 0:", *indent([*places(rows), *rows.over_lanes(lines)])]


def places(rows: LaneRows) -> list[str]:
    """Lines that find the number of the sample and where late signals lie, once for all lanes."""
    program = rows.program
    late = ["late = (step_index - signal_delay) % signal_history.shape[1]"] if program.late_signals else []
    return [*late, *([] if program.ideal_sensors else ["sample_index = step_index // steps_per_sample"])]


def sense(rows: LaneRows) -> list[str]:
    """Lines that make the measurement ``seen``."""
    add = rows.add
    if rows.program.late_signals:
        signals = [f"{name} = signal_history[{row}, late, lane]" for row, name in enumerate(SIGNALS)]
    else:
        signals = current_readings(rows)
    if not rows.program.ideal_sensors:
        seen = f"{add(measure)}(sensors, angle, pressure_1, pressure_2, plant.torque_constant, sample_index)"
        shaped = [f"seen = {add(seen_with_torque)}(plant, seen)"] if rows.program.has_shape else []
        return [rows.load("sensors"), *signals, f"seen = {seen}", *shaped]
    return [
        *signals,
        torque_line(rows, "angle"),
        f"seen = {add(Measurement)}(angle, pressure_1, pressure_2, torque)",
    ]


def torque_line(rows: LaneRows, angle: str) -> str:
    """Line that makes the torque of both pressures, at an angle where the actuator is no vane."""
    if rows.program.has_shape:
        return f"torque = {rows.add(torque_at)}(plant, {angle}, pressure_1, pressure_2)"
    return f"torque = {rows.add(actuator_torque)}(pressure_1, pressure_2, plant.torque_constant)"


def current_readings(rows: LaneRows) -> list[str]:
    """Lines that make what the sensors show at the present."""
    return ["angle = state.angle", *present_pressures(rows), *as_shown(rows)]


def as_shown(rows: LaneRows) -> list[str]:
    """Line that makes signals as the sensors show them, where an effect acts there."""
    if not any(shown_signals in effect.laws for effect in rows.program.effects):
        return []
    signals = ", ".join(SIGNALS)
    return [f"{signals} = {rows.add(shown_signals)}({signals})"]


def present_pressures(rows: LaneRows) -> list[str]:
    """Lines that make both pressures of ``state``."""
    if rows.program.hands_chambers_on:
        return [rows.load("held"), f"pressure_1, pressure_2 = {rows.add(held_pressures)}(held, state)"]
    return [f"pressure_1, pressure_2 = {pressures_of(rows, 'state')}"]


def pressures_of(rows: LaneRows, state: str) -> str:
    """Expression for both pressures of any state."""
    return f"{rows.add(chamber_pressures)}(plant, {state}.angle, {state}.mass_1, {state}.mass_2)"


def sense_gait(rows: LaneRows) -> list[str]:
    """Lines that make the measurement ``seen`` of a walking leg."""
    pressures = present_pressures(rows)
    if rows.program.ideal_sensors:
        return [
            rows.load("walk"),
            *pressures,
            f"torque = {rows.add(actuator_torque)}(pressure_1, pressure_2, plant.torque_constant)",
            f"seen = {rows.add(GaitMeasurement)}"
            "(state.angle, pressure_1, pressure_2, torque, walk.heel_force, walk.toe_force)",
        ]
    return [
        *[rows.load(group) for group in ("walk", "sensors", "gait_sensors", "gait_seen")],
        *pressures,
        f"seen, gait_seen = {rows.add(measure_gait)}(sensors, gait_sensors, gait_seen, state.angle, pressure_1, "
        "pressure_2, walk.heel_force, walk.toe_force, plant.torque_constant, step_index * timing.step, "
        "sample_index)",
        *rows.store("gait_seen"),
        *(late_readings(rows) if rows.program.late_readings else []),
    ]


def late_readings(rows: LaneRows) -> list[str]:
    """Lines that keep the readings of a walk, and hand the controller those of a sensor as late as its fault says."""
    lines = ["slots = signal_history.shape[1]"]
    for row, (sensor, reading) in enumerate(READINGS.items()):
        age = f"{rows.add(samples_late)}(gait_sensors.{sensor}_fault, step_index * timing.step, sample_index)"
        lines.append(f"signal_history[{row}, sample_index % slots, lane] = seen.{reading}")
        lines.append(f"late_{reading} = signal_history[{row}, (sample_index - {age}) % slots, lane]")
    given = ", ".join(f"late_{reading}" for reading in READINGS.values())
    return [*lines, f"seen = {rows.add(late_measurement)}({given}, plant.torque_constant)"]


def signals_before_start(rows: LaneRows) -> list[str]:
    """Fills the late signals with those at the start, which sensors show until the first have come."""
    if not rows.program.late_signals:
        return []
    lines = [rows.load("plant"), rows.load("state"), *current_readings(rows)]
    lines += [f"signal_history[{row}, slot, lane] = {name}" for row, name in enumerate(SIGNALS)]
    return [
        "if step_index == 0:",
        "    for slot in range(signal_history.shape[1]):",
        *indent(rows.over_lanes(lines), 2),
    ]


def sense_end(rows: LaneRows) -> list[str]:
    """What late sensors look at in a step or part, at its end, with the states that effects have then.

    A signal that is late by a fraction of a step is looked at by that much before its end, at ``look_at`` [s].
    """
    if not rows.program.late_signals or rows.program.walks:
        return []
    states = [f"{name} = {name}_after" for name in rows.program.effect_states]
    now = [f"pressure_1, pressure_2 = {pressures_of(rows, 'after')}", "angle = after.angle"]
    return [*states, *now, *as_shown(rows), *look()]


def look() -> list[str]:
    """Lines that keep what late sensors look at."""
    return [
        f"looks = taken and abs(before + length - look_at) <= {SAME_INSTANT!r}",
        *[
            f"signal_history[{row}, next_place, lane] = {name} if looks else signal_history[{row}, next_place, lane]"
            for row, name in enumerate(SIGNALS)
        ],
    ]


def remember_commands(rows: LaneRows) -> list[str]:
    """Keeps the command of every step, where the valve gets it late."""
    if not rows.program.late_commands:
        return []
    lines = [
        f"command_history[command_place, lane] = {rows.cells['result.command']}",
    ]
    return ["command_place = step_index % command_history.shape[0]", *rows.over_lanes(lines)]
