"""What the lanes do at a recorded sample where nothing is recorded: meters, and traces of some channels.

Samples are the ones that a recording would have. The course of the reference, of which meters are told, is looked at
once before the first sample, then followed.
"""

from ppafo.engine.lane_rows import LaneRows, indent, over_lanes
from ppafo.model.plant import chamber_pressures
from ppafo.model.vane import actuator_torque
from ppafo.signals.meter import SAME_LEVEL, Sample, advance_course, is_away

TRACED: dict[str, str] = {
    **{name: f"sample.{name}" for name in Sample._fields if name != "number"},
    **{name: f"state.{name}" for name in ("mass_1", "mass_2", "supplied_mass", "vented_mass", "leaked_mass")},
}
"""Channels that can be traced, and where a sample has them."""
TRUE_MASSES = {name: f"masses.{name}" for name in ("mass_1", "mass_2")}
"""Where it has those that a recording has otherwise of gas with an energy balance."""


def measure_sample(rows: LaneRows, moment: str) -> list[str]:
    """Meters and traces of sample ``next_record`` at ``moment``, counted in steps."""
    return [*_meter_lines(rows, moment), *_trace_lines(rows, moment)]


def _meter_lines(rows: LaneRows, moment: str) -> list[str]:
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
    lines = [*sample_lines(rows, moment), *follow_lines(rows)]
    return [
        "if next_record == 0:",
        *indent([*course_lines(rows), *over_lanes([*lines, *begin])]),
        "else:",
        *indent(over_lanes([*lines, *update])),
    ]


def sample_lines(rows: LaneRows, moment: str) -> list[str]:
    """Lines that make the sample of a lane."""
    add, program = rows.add, rows.program
    pressures = add(chamber_pressures)
    wanted = f"{add(program.reference.value)}(reference, {moment} * timing.step)[0]"
    thermal = ("thermal", "masses") if program.is_thermal else ()
    warm = [f"thermal.temperature * (state.mass_{chamber} / masses.mass_{chamber})" for chamber in (1, 2)]
    values = {
        "number": "float(next_record)",
        "angle": "state.angle",
        "angular_velocity": "state.angular_velocity",
        "pressure_1": "pressure_1",
        "pressure_2": "pressure_2",
        "torque": "torque",
        "command": "result.command",
        "reference": "wanted",
        "temperature_1": warm[0] if thermal else "0.0",
        "temperature_2": warm[1] if thermal else "0.0",
    }
    return [
        *[rows.load(group) for group in ("timing", "plant", "state", "result", "reference", *thermal)],
        f"pressure_1, pressure_2 = {pressures}(plant, state.angle, state.mass_1, state.mass_2)",
        f"torque = {add(actuator_torque)}(pressure_1, pressure_2, plant.torque_constant)",
        f"wanted = {wanted if program.has_reference else '0.0'}",
        f"sample = {add(Sample)}({', '.join(f'{name}={value}' for name, value in values.items())})",
    ]


def _trace_lines(rows: LaneRows, moment: str) -> list[str]:
    traced = rows.program.traced
    if not traced:
        return []
    # A trace with less room than samples keeps the last ones.
    place = "next_record // trace_every % trace.shape[0]"
    paths = TRACED | (TRUE_MASSES if rows.program.is_thermal else {})
    keep = [f"trace[{place}, {row}, lane] = {paths[name]}" for row, name in enumerate(traced)]
    return [
        "if next_record % trace_every == 0:",
        *indent(over_lanes([*sample_lines(rows, moment), *keep])),
    ]


def course_lines(rows: LaneRows) -> list[str]:
    """Lines that write the course of the reference into its rows, before the first sample.

    A monotone reference is largest at one of its ends, and where its hold starts shows on the way. Any other one is
    looked at sample by sample, over all lanes at once; its hold is looked for from the end.
    """
    if not rows.program.follows_reference:
        return []
    cell = {name: rows.cells[f"course.{name}"] for name in ("last", "largest", "tolerance", "hold_start")}
    given = [rows.load("timing"), rows.load("reference")]
    ends = [
        *given,
        f"{cell['last']} = {_value(rows, 'last_record')}",
        f"{cell['largest']} = max(abs({_value(rows, '0')}), abs({cell['last']}))",
        f"{cell['hold_start']} = 0.0",
    ]
    tolerance = over_lanes([f"{cell['tolerance']} = {SAME_LEVEL!r} * {cell['largest']}"])
    if rows.program.reference.is_monotone:
        return [*over_lanes(ends), *tolerance]
    away = f"{rows.add(is_away)}({_value(rows, 'index')}, {cell['last']}, {cell['tolerance']})"
    found = f"index + 1.0 if {cell['hold_start']} == 0.0 and {away} else {cell['hold_start']}"
    return [
        *over_lanes(ends),
        "for index in range(last_record):",
        *indent(over_lanes([*given, f"{cell['largest']} = max({cell['largest']}, abs({_value(rows, 'index')}))"])),
        *tolerance,
        "for index in range(last_record - 1, -1, -1):",
        *indent(over_lanes([*given, f"{cell['hold_start']} = {found}"])),
        "    earliest = 1.0",
        *indent(over_lanes([f"earliest = min(earliest, {cell['hold_start']})"])),
        "    if earliest > 0.0:",
        "        break",
    ]


def follow_lines(rows: LaneRows) -> list[str]:
    """Lines that load the course, and follow it where its hold is not known ahead."""
    if not rows.program.follows_reference:
        return ["course = ()"]
    if not rows.program.reference.is_monotone:
        return [rows.load("course")]
    return [
        rows.load("course"),
        f"course = {rows.add(advance_course)}(course, sample)",
        f"{rows.cells['course.hold_start']} = course.hold_start",
    ]


def _value(rows: LaneRows, number: str) -> str:
    return f"{rows.add(rows.program.reference.value)}(reference, {number} * interval * timing.step)[0]"
