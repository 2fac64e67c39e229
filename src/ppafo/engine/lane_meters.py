"""What the lanes do at a recorded sample where nothing is recorded: meters, and traces of some channels.

Samples are the ones that a recording would have. The course of the reference, of which meters are told, is looked at
once before the first sample, then followed.
"""

from ppafo.engine.lane_control import present_pressures, torque_line
from ppafo.engine.lane_rows import LaneRows, indent
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths
from ppafo.signals.meter import SAME_LEVEL, Sample, WalkSample, advance_course, is_away

TRACED: dict[str, str] = {
    **{name: f"sample.{name}" for name in Sample._fields if name != "number"},
    **{name: f"state.{name}" for name in ("mass_1", "mass_2", "supplied_mass", "vented_mass", "leaked_mass")},
}
"""Channels that can be traced, and where a sample has them."""
TRACED_IN_WALKS: dict[str, str] = {
    "strides": "walk.strides",
    "phase": "walk.now.phase",
    "contact": "walk.contact",
    "shank_angle": "walk.now.shank",
    "healthy_angle": "walk.now.ankle",
    "external_torque": "walk.external_torque",
    "heel_force": "walk.heel_force",
    "toe_force": "walk.toe_force",
    "push_off_work": "walk.push_off_work",
    "controller_phase": "controller_state.phase.phase",
    "safe_state": "controller_state.safety.level",
    "gait_fraction": "clock.fraction",
}
"""Further ones of a walk: how the path of a number of its state ends, which not every controller has."""
REQUEST = "controller_state.request.torque"
"""Where a controller of walking keeps the torque that it wants, if it wants one."""
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
        *indent([*course_lines(rows), *rows.over_lanes([*lines, *begin])]),
        "else:",
        *indent(rows.over_lanes([*lines, *update])),
    ]


def sample_lines(rows: LaneRows, moment: str) -> list[str]:
    """Lines that make the sample of a lane."""
    add, program = rows.add, rows.program
    has_reference = program.has_reference and not program.walks
    wanted = f"{add(program.reference.value)}(reference, {moment} * timing.step)[0]" if has_reference else "0.0"
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
    of_walk: dict[str, str] = {}
    if program.walks:
        wanted, of_walk = _of_state(rows, REQUEST), _walk_values(rows)
    groups = ("walk", "controller_state") if program.walks else ()
    return [
        *[rows.load(group) for group in ("timing", "plant", "state", "result", "reference", *thermal, *groups)],
        *present_pressures(rows),
        torque_line(rows, "state.angle"),
        f"wanted = {wanted}",
        f"sample = {add(WalkSample if of_walk else Sample)}"
        f"({', '.join(f'{name}={value}' for name, value in (values | of_walk).items())})",
    ]


def _walk_values(rows: LaneRows) -> dict[str, str]:
    """What a sample of a walk has beside the others."""
    totals = ("strides", "push_off_work", "slap_rates", "clearances", "toe_landings")
    return {
        "supplied_mass": "state.supplied_mass",
        **{name: f"walk.{name}" for name in totals},
        "phase": _of_state(rows, TRACED_IN_WALKS["controller_phase"]),
        "level": _of_state(rows, TRACED_IN_WALKS["safe_state"]),
        "time": "next_record * (timing.step * interval)",
    }


def _of_state(rows: LaneRows, path: str) -> str:
    """A number of the state, 0 where this program has none."""
    return path if path in rows.state_at else "0.0"


def walk_traces(program: Program) -> dict[str, str]:
    """Channels of ``TRACED_IN_WALKS`` that a program has, and the paths of their numbers."""
    if not program.walks:
        return {}
    paths = [path for name, row in program.state_rows().items() for path in leaf_paths(row, name)]
    found = {
        name: next((path for path in paths if path.endswith(ending)), "") for name, ending in TRACED_IN_WALKS.items()
    }
    return {name: path for name, path in found.items() if path}


def _trace_lines(rows: LaneRows, moment: str) -> list[str]:
    traced = rows.program.traced
    if not traced:
        return []
    # A trace with less room than samples keeps the last ones.
    place = "next_record // trace_every % trace.shape[0]"
    paths = TRACED | walk_traces(rows.program) | (TRUE_MASSES if rows.program.is_thermal else {})
    keep = [f"trace[{place}, {row}, lane] = {paths.get(name, name)}" for row, name in enumerate(traced)]
    return [
        "if next_record % trace_every == 0:",
        *indent(rows.over_lanes([*sample_lines(rows, moment), *keep])),
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
    tolerance = rows.over_lanes([f"{cell['tolerance']} = {SAME_LEVEL!r} * {cell['largest']}"])
    if rows.program.reference.is_monotone:
        return [*rows.over_lanes(ends), *tolerance]
    away = f"{rows.add(is_away)}({_value(rows, 'index')}, {cell['last']}, {cell['tolerance']})"
    found = f"index + 1.0 if {cell['hold_start']} == 0.0 and {away} else {cell['hold_start']}"
    return [
        *rows.over_lanes(ends),
        "for index in range(last_record):",
        *indent(rows.over_lanes([*given, f"{cell['largest']} = max({cell['largest']}, abs({_value(rows, 'index')}))"])),
        *tolerance,
        "for index in range(last_record - 1, -1, -1):",
        *indent(rows.over_lanes([*given, f"{cell['hold_start']} = {found}"])),
        "    earliest = 1.0",
        *indent(rows.over_lanes([f"earliest = min(earliest, {cell['hold_start']})"])),
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
