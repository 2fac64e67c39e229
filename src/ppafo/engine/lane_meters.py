"""What the lanes do at a recorded sample where nothing is recorded: meters, and traces of some channels.

Samples are the ones that a recording would have: step 0, every ``measure_every`` steps, and the end of the run.
"""

from ppafo.engine.lane_course import course_lines, follow_lines
from ppafo.engine.lane_rows import LaneRows, indented, over_lanes
from ppafo.model.plant import chamber_pressures_in_one_division
from ppafo.model.vane import actuator_torque
from ppafo.signals.meter import Sample

TRACED: dict[str, str] = {
    **{name: f"sample.{name}" for name in Sample._fields if name != "number"},
    **{name: f"state.{name}" for name in ("mass_1", "mass_2", "supplied_mass", "vented_mass", "leaked_mass")},
}
"""Channels that can be traced, and where a sample has them."""


def measure_loop(rows: LaneRows) -> list[str]:
    """Meters and traces at every sample."""
    return [*_meter_lines(rows), *_trace_lines(rows)]


def _meter_lines(rows: LaneRows) -> list[str]:
    program, add = rows.program, rows.add
    if not program.meters:
        return []
    groups = program.meter_groups
    moving = {group: kind for group, kind in groups.items() if not (program.is_held and kind.of_motion)}
    begin = [f"{group} = {add(kind.start)}(course, sample)" for group, kind in groups.items()]
    begin += [line for group in groups for line in rows.store(group)]
    update = [rows.load(group) for group in moving]
    update += [f"{group} = {add(kind.update)}({group}, course, sample)" for group, kind in moving.items()]
    update += [line for group in moving for line in rows.store(group)]
    follow = follow_lines(rows)
    return [
        "if step_index % measure_every == 0:",
        "    if step_index == 0:",
        *indented(course_lines(rows), 2),
        *indented(over_lanes([*sample_lines(rows), *follow, *begin]), 2),
        "    else:",
        *indented(over_lanes([*sample_lines(rows), *follow, *update]), 2),
    ]


def sample_lines(rows: LaneRows) -> list[str]:
    """Lines that make the sample of a lane."""
    add, program = rows.add, rows.program
    pressures = add(chamber_pressures_in_one_division)
    wanted = f"{add(program.reference.value)}(reference, step_index * timing.step)[0]"
    return [
        *[rows.load(group) for group in ("timing", "plant", "state", "result", "reference")],
        f"pressure_1, pressure_2 = {pressures}(plant, state.angle, state.mass_1, state.mass_2)",
        f"torque = {add(actuator_torque)}(pressure_1, pressure_2, plant.torque_constant)",
        f"wanted = {wanted if program.has_reference else '0.0'}",
        f"sample = {add(Sample)}(step_index / measure_every, state.angle, state.angular_velocity, pressure_1, "
        "pressure_2, torque, result.command, wanted)",
    ]


def _trace_lines(rows: LaneRows) -> list[str]:
    traced = rows.program.traced
    if not traced:
        return []
    keep = [f"trace[step_index // trace_every, {row}, lane] = {TRACED[name]}" for row, name in enumerate(traced)]
    return [
        "if step_index % trace_every == 0:",
        *indented(over_lanes([*sample_lines(rows), *keep])),
    ]
