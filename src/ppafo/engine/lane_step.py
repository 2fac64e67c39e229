"""What the lanes do between two samples: valve, gas and vane, over a whole step or in parts of it.

A step is whole where nothing changes abruptly inside it and its error is known to be small: the gas of a held vane
behind a valve that follows at once. Otherwise each lane goes through it in parts of its own. A part ends where a coil
switches, a late command arrives, the vane meets a stop, a sample is due, or its error would become too large. Lanes
that are through wait, masked, and no lane sees another.
"""

from ppafo.engine import lane_effects
from ppafo.engine.lane_control import sense_end
from ppafo.engine.lane_gas import begin_gas, feed, open_valve, pass_gas
from ppafo.engine.lane_rows import HANDED, LaneRows, RarePhase, count_lanes, indent
from ppafo.engine.lane_walk import lead_walk, mark_stride, reach_end
from ppafo.engine.scheme import motion, parts, thermal_gas, walking
from ppafo.engine.scheme.ankle_torque import carried_foot
from ppafo.engine.scheme.pneumatics import held_chambers

IMPOSSIBLE_RATE = 1.0e6
IMPOSSIBLE_MASS = 1.0e3
MAXIMUM_PARTS = 100_000


def plant_loop(rows: LaneRows) -> list[str]:
    """Valve, gas and vane up to ``goal`` [-], a share of the step; 1 for programs that are not parted."""
    if rows.program.is_parted:
        return step_in_parts(rows)
    return over_phases(rows, [*opening(rows), "length = timing.step"], phases(rows))


def over_phases(rows: LaneRows, prelude: list[str], all_phases: list[list[str] | RarePhase]) -> list[str]:
    """Each phase in a loop of its own: loops this short let the processor work on several lanes at once.

    It looks some hundred instructions ahead, and one lane's division or root waits for the one before.
    """
    lines: list[str] = []
    for phase in all_phases:
        if isinstance(phase, RarePhase):
            loop = rows.over_lanes([*prelude, *phase.lines])
            lines += [*count_lanes("wanting", f"{phase.cell} > 0.0"), "if wanting > 0:", *indent(loop)]
        else:
            lines += rows.over_lanes([*prelude, *phase])
    return lines


def opening(rows: LaneRows) -> list[str]:
    """Lines that load what a step needs."""
    names = ["timing", "plant", "valve", "result", "state", "valve_state"]
    names += ["thermal", "masses"] if rows.program.is_thermal else []
    names += ["leg", "share", "gait_timing", "walk"] if rows.program.walks else []
    names += ["lines", "line_state"] if rows.program.has_lines else []
    names += ["held"] if rows.program.hands_chambers_on else []
    names += ["start"] if rows.program.starts_apart else []
    return [*[rows.load(name) for name in names], time_of_step(rows), "command = result.command"]


def time_of_step(rows: LaneRows) -> str:
    """Line that finds the time [s] at the begin of a step, from the start of the run."""
    step = "(step_index - start.step)" if rows.program.starts_apart else "step_index"
    return f"time = {step} * timing.step"


def find_begin(rows: LaneRows) -> list[str]:
    """Finds what a step is handed by the one before, where there was none; of a held vane it lasts for all steps."""
    if not rows.program.hands_chambers_on:
        return []
    held = f"held = {rows.add(held_chambers)}(plant, state.angle)"
    lines = [rows.load("plant"), rows.load("state"), held, *rows.keep("held")]
    if rows.program.walks:
        carried = f"carried = {rows.add(carried_foot)}(leg, share, walk.now, walk.foot)"
        lines += [*[rows.load(name) for name in ("leg", "share", "walk")], carried, *rows.keep("carried")]
    return rows.over_lanes(lines)


def step_in_parts(rows: LaneRows) -> list[str]:
    """As many parts as the lane with the most of them needs; places of late commands are the same for all lanes."""
    places = []
    if rows.program.late_commands:
        places.append("place_before = (step_index - command_delay - 1) % command_history.shape[0]")
        places.append("place_after = (step_index - command_delay) % command_history.shape[0]")
    if rows.program.late_signals:
        places.append("next_place = (step_index + 1) % signal_history.shape[1]")
    inside = [*part_opening(rows), f"length = {rows.length}"]
    return [
        *places,
        f"for part in range({MAXIMUM_PARTS}):",
        *indent(rows.over_lanes([*part_opening(rows), *measure(rows)])),
        *indent(put_aside(rows)),
        *indent(over_phases(rows, inside, phases(rows))),
        *indent(put_back(rows)),
        *indent(count_lanes("waiting", f"{rows.remaining} > 0.0")),
        "    if waiting == 0:",
        "        break",
        "else:",
        *indent(rows.over_lanes(give_up(rows))),
    ]


def put_aside(rows: LaneRows) -> list[str]:
    """Keeps the state in parts in which lanes may wait, never the first: a select for each row takes longer."""
    if not rows.program.parts_are_rare:
        return []
    kept = f"x[{rows.aside} + row, lane] = x[row, lane]"
    lines = [f"{cell} = {rows.cells[path]}" for path, cell in handed_aside(rows).items()]
    lines.append(f"x[{rows.aside + len(rows.state_at)}, lane] = {rows.remaining}")
    return ["if part > 0:", *indent([*over_rows(len(rows.state_at), kept), *rows.over_lanes(lines)])]


def put_back(rows: LaneRows) -> list[str]:
    """Gives lanes that waited their state again."""
    if not rows.program.parts_are_rare:
        return []
    moves = f"x[{rows.aside + len(rows.state_at)}, lane] > 0.0"
    back = f"x[row, lane] = x[row, lane] if {moves} else x[{rows.aside} + row, lane]"
    handed = handed_aside(rows).items()
    lines = [f"{rows.cells[path]} = {rows.cells[path]} if {moves} else {cell}" for path, cell in handed]
    return ["if part > 0:", *indent([*over_rows(len(rows.state_at), back), *(rows.over_lanes(lines) if lines else [])])]


def handed_aside(rows: LaneRows) -> dict[str, str]:
    """Where what a step is handed by the one before lies aside, by its path."""
    first = rows.aside + len(rows.state_at) + 1
    paths = [path for path in rows.step_at if path.startswith(HANDED)]
    return {path: f"x[{first + place}, lane]" for place, path in enumerate(paths)}


def over_rows(count: int, line: str) -> list[str]:
    """A line for all lanes of the first rows."""
    return [f"for row in range({count}):", "    for lane in range(width):", f"        {line}"]


def give_up(rows: LaneRows) -> list[str]:
    """Lines that end a run whose step is not done after ``MAXIMUM_PARTS``: it failed where it is, and hurries on."""
    failure, cause = rows.cells["result.failure_time"], rows.cells["result.too_many_parts"]
    return [
        rows.load("timing"),
        *([rows.load("start")] if rows.program.starts_apart else []),
        f"{time_of_step(rows)} + {rows.before}",
        f"gives_up = {rows.remaining} > 0.0 and {failure} > time",
        f"{cause} = 1.0 if gives_up else {cause}",
        f"{failure} = time if gives_up else {failure}",
    ]


def part_opening(rows: LaneRows) -> list[str]:
    """Lines that load what a part needs, and the command that the valve has in it."""
    lines = [*opening(rows), rows.load("pace"), f"before = {rows.before}", "time += before"]
    if rows.program.late_commands:
        lines += [
            f"until_command = timing.command_lag * timing.step - before - {parts.SAME_INSTANT!r}",
            "early = command_history[place_before, lane]",
            "command = early if until_command > 0.0 else command_history[place_after, lane]",
        ]
    if rows.program.late_signals:
        lines.append("look_at = (1.0 - timing.signal_lag) * timing.step")
    return lines


def measure(rows: LaneRows) -> list[str]:
    """Lines that find the length of a part; where the vane is free, until it meets a stop."""
    program, add = rows.program, rows.add
    lines = ["remaining = max(goal * timing.step - before, 0.0)", "until = remaining"]
    if program.late_commands:
        arrival = f"until_command + {parts.SAME_INSTANT!r}"
        lines.append(f"until = min(until, {arrival}) if until_command > 0.0 else until")
    if program.late_signals:
        soon = f"look_at - before > {parts.SAME_INSTANT!r}"
        lines.append(f"until = min(until, look_at - before) if {soon} else until")
    if program.valve.jumps:
        functions = f"{add(program.valve.next_event)}, {add(program.valve.settle)}"
        lines.append(f"until = {add(parts.until_jump)}(valve, valve_state, command, time, until, {functions})")
    if program.is_adaptive:
        hurries = "remaining == 0.0 or result.failure_time <= time"
        lines.append(f"until = remaining if {hurries} else {add(parts.part_length)}(pace, until)")
        if program.angle is None:
            lines.append(f"begun, until = {add(motion.begin_part)}(plant, state, until)")
            lines += rows.keep("begun")
    else:
        lines.append("until = remaining if result.failure_time <= time else until")
    return [*lines, f"{rows.length} = until", f"{rows.remaining} = remaining"]


def phases(rows: LaneRows) -> list[list[str] | RarePhase]:
    """Both stages of the gas over ``length`` [s] from ``time`` [s], what leads to them, and the state at the end."""
    program = rows.program
    is_free = program.angle is None
    kept = rows.keep("gas") if is_free else rows.keep("begun", "gas")
    first = [rows.load("flowing"), *lead(rows), begin_gas(rows), *kept]
    before = [*lead_walk(rows), open_valve(rows), first, pass_gas(rows)]
    if not is_free:
        return [*before, [*feed(rows), *finish(rows)]]
    error = [f"{rows.error} = gas_error"] if program.is_adaptive else []
    loaded = [rows.load("begun"), rows.load("change")]
    loaded += [f"gas_error = {rows.error}"] if program.is_adaptive else []
    reached = reach_end(rows, with_gas(rows)) if program.walks else []
    return [*before, [*feed(rows), *rows.keep("change"), *error], *reached, [*loaded, *finish(rows)]]


def lead(rows: LaneRows) -> list[str]:
    """Where the vane would be at the end of the step, ``next_angle``, and what else its motion needs then."""
    program, add = rows.program, rows.add
    if program.walks:
        return [
            rows.load("begun"),
            f"next_angle = {add(walking.next_angle)}(plant, leg, walk, begun)",
            f"ahead = {add(held_chambers)}(plant, next_angle)",
            *rows.keep("ahead"),
        ]
    if program.angle is None:
        return [rows.load("begun"), "next_angle = begun.next_angle"]
    if program.is_held:
        return ["next_angle = state.angle", "begun = ()"]
    return [
        rows.load("path"),
        f"next_angle, next_rate, _ = {add(program.angle.value)}(path, time + length)",
        f"begun = {add(motion.PrescribedStep)}(next_angle, next_rate)",
    ]


def finish(rows: LaneRows) -> list[str]:
    """The state at the end of a step or part, unless the part is refused; and the first time at which a run failed."""
    program, add = rows.program, rows.add
    lines = [*with_gas(rows), *end_motion(rows), *with_work(rows), *lane_effects.advance_states(rows)]
    if not program.is_parted:
        return [*lines, *store_all(rows, ""), *judge(rows), *sense_end(rows)]
    lines += [rows.load("next_valve"), *([rows.load("next_lines")] if program.has_lines else [])]
    if not program.is_adaptive:
        flag = "" if program.parts_are_rare else "taken"
        stored = [*store_all(rows, flag), *judge(rows, flag), *sense_end(rows)]
        return [f"taken = {rows.remaining} > 0.0", *lines, *stored, *add_up(rows)]
    return [
        *lines,
        f"error = max({', '.join(['error', 'gas_error', *lane_effects.state_errors(rows)])}) / timing.tolerance",
        f"error = error if {positive(rows)} else {parts.MAXIMUM_ERROR!r}",
        f"refused = {add(parts.is_refused)}(error, length) and not result.failure_time <= time",
        f"next_length = {add(parts.next_pace)}(pace, error, length, refused, timing.step).length",
        f"active = {rows.remaining} > 0.0",
        f"{rows.cells['pace.length']} = next_length if active else pace.length",
        "taken = active and not refused",
        *store_all(rows, "taken"),
        *judge(rows, "taken"),
        *sense_end(rows),
        *add_up(rows),
    ]


def with_gas(rows: LaneRows) -> list[str]:
    """Lines that add the gas of the step: ``fed``, and ``warmed`` for the true masses."""
    if rows.program.is_thermal:
        return [f"fed, warmed = {rows.add(thermal_gas.with_thermal_gas)}(state, masses, change)"]
    return [f"fed = {rows.add(motion.with_gas)}(state, change)"]


def with_work(rows: LaneRows) -> list[str]:
    """Lines that count the work of gas with an energy balance; a held vane takes none."""
    if not rows.program.is_thermal or rows.program.is_held:
        return []
    return [f"warmed = {rows.add(thermal_gas.with_work)}(plant, warmed, state, after)"]


def end_motion(rows: LaneRows) -> list[str]:
    """Lines that lead to the state ``after`` the step, and in parts to the ``error`` of the motion."""
    program, add = rows.program, rows.add
    if program.walks:
        follow = rows.cells["gait_sensors.follow_rate"]
        given = f"plant, leg, share, gait_timing, {follow}, fed, walk, begun, ended, held, carried, next_gait, length"
        lines = [
            *[rows.load(name) for name in ("ended", "ahead", "carried", "next_gait")],
            "held = ahead",
            *rows.keep("held"),
        ]
        lines += [f"after, walk_after = {add(walking.end_walk)}({given})", *mark_stride(rows)]
        if program.is_thermal:
            assumed = f"{add(walking.next_angle)}(plant, leg, walk, begun)"
            lines.append(f"after = {add(thermal_gas.after_motion)}(plant, thermal, after, {assumed}, after.angle)")
        return lines
    if program.angle is None:
        lines = [f"angle, rate, error = {add(motion.end_part)}(plant, fed, begun, length)"]
        if program.is_thermal:
            lines.append(f"fed = {add(thermal_gas.after_motion)}(plant, thermal, fed, begun.next_angle, angle)")
        return [*lines, f"after = {add(motion.with_motion)}(fed, angle, rate)"]
    if program.is_held:
        return ["after = fed", "error = 0.0"]
    return [f"after = {add(motion.with_motion)}(fed, begun.next_angle, begun.next_rate)", "error = 0.0"]


def store_all(rows: LaneRows, flag: str) -> list[str]:
    """Lines that write the new state, where ``flag`` names a condition only under it."""
    lines = rows.store("state", "after", flag)
    if rows.program.is_thermal:
        lines += rows.store("masses", "warmed", flag)
    if rows.program.walks:
        lines += rows.store("walk", "walk_after", flag)
    for state in rows.program.effect_states:
        lines += rows.store(state, f"{state}_after", flag)
    if rows.program.is_parted:
        lines += rows.store("valve_state", "next_valve", flag)
        lines += rows.store("line_state", "next_lines", flag) if rows.program.has_lines else []
    return lines


def positive(rows: LaneRows) -> str:
    """Condition that no mass is lost; false for what is no number."""
    names = ["after.mass_1", "after.mass_2"]
    names += ["warmed.mass_1", "warmed.mass_2"] if rows.program.is_thermal else []
    names += ["next_lines.mass_1", "next_lines.mass_2"] if rows.program.has_lines else []
    return " and ".join(f"{name} > 0.0" for name in names)


def add_up(rows: LaneRows) -> list[str]:
    """Lines that count the time of a part that is taken; the end of the last one is the goal to the last bit."""
    return [
        f"arrives = length >= {rows.remaining} and taken or {rows.remaining} == 0.0",
        f"{rows.before} = goal * timing.step if arrives else before + (length if taken else 0.0)",
        f"{rows.remaining} = 0.0 if arrives else {rows.remaining}",
    ]


def judge(rows: LaneRows, flag: str = "") -> list[str]:
    """The first time at which a run left what is possible."""
    counted = ["after.mass_1", "after.mass_2"]
    counted += ["warmed.mass_1", "warmed.mass_2"] if rows.program.is_thermal else []
    gas = ", ".join(counted)
    waits = f"not {flag} or " if flag else ""
    return [
        f"possible = {waits}(abs(after.angular_velocity) < {IMPOSSIBLE_RATE} and min({gas}) > 0.0 "
        f"and max({gas}) < {IMPOSSIBLE_MASS}{lane_effects.states_are_possible(rows)})",
        "failed = result.failure_time if possible else min(result.failure_time, time + length)",
        f"{rows.cells['result.failure_time']} = failed",
    ]
