"""What the lanes do at a sample: sense, control, and keep what sensors and valve get late."""

from ppafo.engine.lane_rows import LaneRows, indented, over_lanes
from ppafo.model.gait_sensors import GaitMeasurement, measure_gait
from ppafo.model.plant import chamber_pressures
from ppafo.model.sensors import Measurement, follow_signals, measure
from ppafo.model.vane import actuator_torque


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
    return ["if step_index % steps_per_sample == 0:", *indented([*places(rows), *over_lanes(lines)])]


def places(rows: LaneRows) -> list[str]:
    """Lines that find the number of the sample and where late signals lie, once for all lanes."""
    if rows.program.ideal_sensors:
        return []
    return [
        "sample_index = step_index // steps_per_sample",
        "late = (step_index - signal_delay) % signal_history.shape[1]",
        "later = (step_index - signal_delay - 1) % signal_history.shape[1]",
    ]


def sense(rows: LaneRows) -> list[str]:
    """Lines that make the measurement ``seen``."""
    if not rows.program.ideal_sensors:
        measuring = rows.add(measure)
        return [
            rows.load("sensors"),
            *[
                f"{name} = signal_history[{row}, late, lane] + timing.signal_lag * "
                f"(signal_history[{row}, later, lane] - signal_history[{row}, late, lane])"
                for row, name in enumerate(("angle", "pressure_1", "pressure_2"))
            ],
            f"seen = {measuring}(sensors, angle, pressure_1, pressure_2, plant.torque_constant, sample_index)",
        ]
    return [
        f"pressure_1, pressure_2 = {rows.add(chamber_pressures)}(plant, state.angle, state.mass_1, state.mass_2)",
        f"torque = {rows.add(actuator_torque)}(pressure_1, pressure_2, plant.torque_constant)",
        f"seen = {rows.add(Measurement)}(state.angle, pressure_1, pressure_2, torque)",
    ]


def sense_gait(rows: LaneRows) -> list[str]:
    """Lines that make the measurement ``seen`` of a walking leg."""
    pressures = (
        f"pressure_1, pressure_2 = {rows.add(chamber_pressures)}(plant, state.angle, state.mass_1, state.mass_2)"
    )
    if rows.program.ideal_sensors:
        return [
            rows.load("walk"),
            pressures,
            f"torque = {rows.add(actuator_torque)}(pressure_1, pressure_2, plant.torque_constant)",
            f"seen = {rows.add(GaitMeasurement)}"
            "(state.angle, pressure_1, pressure_2, torque, walk.heel_force, walk.toe_force)",
        ]
    return [
        *[rows.load(group) for group in ("walk", "sensors", "gait_sensors", "gait_seen")],
        pressures,
        f"seen, gait_seen = {rows.add(measure_gait)}(sensors, gait_sensors, gait_seen, state.angle, pressure_1, "
        "pressure_2, walk.heel_force, walk.toe_force, plant.torque_constant, step_index * timing.step, "
        "sample_index)",
        *rows.store("gait_seen"),
    ]


def remember_signals(rows: LaneRows) -> list[str]:
    """Keeps the signals of every step, where they are seen late."""
    if rows.program.ideal_sensors or rows.program.controller is None or rows.program.walks:
        return []
    shown = "sensor_state" if rows.program.slow_sensors else "state"
    true_pressures = [
        rows.load("plant"),
        f"pressure_1, pressure_2 = {rows.add(chamber_pressures)}(plant, state.angle, state.mass_1, state.mass_2)",
    ]
    slow_pressures = ["pressure_1, pressure_2 = sensor_state.pressure_1, sensor_state.pressure_2"]
    lines = [
        rows.load(shown),
        *(slow_pressures if rows.program.slow_sensors else true_pressures),
        f"signal_history[0, place, lane] = {shown}.angle",
        "signal_history[1, place, lane] = pressure_1",
        "signal_history[2, place, lane] = pressure_2",
    ]
    before_start = [
        "if step_index == 0:",
        "    for slot in range(1, signal_history.shape[1]):",
        "        signal_history[:, slot, :] = signal_history[:, 0, :]",
    ]
    return ["place = step_index % signal_history.shape[1]", *over_lanes(lines), *before_start]


def follow_loop(rows: LaneRows) -> list[str]:
    """What slow sensors show at the end of a step."""
    if not rows.program.slow_sensors:
        return []
    pressures = rows.add(chamber_pressures)
    following = rows.add(follow_signals)
    lines = [
        *[rows.load(group) for group in ("plant", "state", "sensor_lag", "sensor_state")],
        f"pressure_1, pressure_2 = {pressures}(plant, state.angle, state.mass_1, state.mass_2)",
        f"sensor_state = {following}(sensor_lag, sensor_state, state.angle, pressure_1, pressure_2)",
        *rows.store("sensor_state"),
    ]
    return over_lanes(lines)


def remember_commands(rows: LaneRows) -> list[str]:
    """Keeps the command of every step, where the valve gets it late."""
    if not rows.program.late_commands:
        return []
    lines = [
        f"command_history[command_place, lane] = {rows.cells['result.command']}",
    ]
    return ["command_place = step_index % command_history.shape[0]", *over_lanes(lines)]
