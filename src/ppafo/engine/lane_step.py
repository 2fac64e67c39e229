"""What the lanes do in a step: valve, gas and vane, whole or in parts where something changes abruptly inside it."""

from ppafo.engine.lane_rows import LaneRows, indented, over_lanes
from ppafo.engine.scheme import motion, parts, pneumatics, supply_lines, thermal_gas, walking
from ppafo.model.gait import gait_at

IMPOSSIBLE_RATE = 1.0e6
IMPOSSIBLE_MASS = 1.0e3

MOST_PARTS = 16
"""More parts than a step may sensibly have: two coils, each with an order and a change, several times over."""


def skip_empty(rows: LaneRows) -> list[str]:
    """Lines that end the parts of a step where no lane has anything left."""
    return [
        "longest = 0.0",
        "for lane in range(width):",
        f"    longest = max(longest, {rows.length})",
        "if longest == 0.0:",
        "    break",
    ]


def plant_loop(rows: LaneRows) -> list[str]:
    """Valve, gas and vane, one step: whole, or in parts where something changes abruptly inside it."""
    if rows.program.late_commands:
        return late_loop(rows)
    if rows.program.valve.jumps:
        return jump_loop(rows)
    return part(rows, [*opening(rows), "length = timing.step"])


def opening(rows: LaneRows) -> list[str]:
    """Lines that load what a step needs."""
    names = ["timing", "plant", "valve", "result", "state", "valve_state"]
    names += ["thermal", "masses"] if rows.program.is_thermal else []
    names += ["leg", "share", "gait_timing", "walk"] if rows.program.walks else []
    names += ["lines", "line_state"] if rows.program.has_lines else []
    return [*[rows.load(name) for name in names], "time = step_index * timing.step", "command = result.command"]


def jump_loop(rows: LaneRows) -> list[str]:
    """As many parts as the valve's jumps ask for; a part that no lane needs ends the step.

    Two rows keep the length of a part and the time before it, from the beginning of the step.
    """
    valve = rows.program.valve
    functions = f"{rows.add(valve.next_event)}, {rows.add(valve.settle)}"
    measure = [
        *opening(rows),
        f"before = {rows.before}",
        "remaining = timing.step - before",
        f"until = {rows.add(parts.part_length)}(valve, valve_state, command, time + before, remaining, {functions})",
        f"{rows.length} = remaining if part == {MOST_PARTS - 1} else until",
    ]
    begin = [f"length = {rows.length}", f"time += {rows.before}"]
    # The end of the last part is the end of the step to the last bit, so that no sliver is left over.
    add_up = [
        f"step = {rows.cells['timing.step']}",
        f"whole = {rows.length} >= step - {rows.before}",
        f"{rows.before} = step if whole else {rows.before} + {rows.length}",
    ]
    return [
        *over_lanes([f"{rows.before} = 0.0"]),
        f"for part in range({MOST_PARTS}):",
        *indented(over_lanes(measure)),
        *indented(skip_empty(rows)),
        *indented(part(rows, [*opening(rows), *begin])),
        *indented(over_lanes(add_up)),
    ]


def late_loop(rows: LaneRows) -> list[str]:
    """Two parts, before and after a late command arrives; the first is passed over where no lane has it."""
    lag = f"{rows.cells['timing.command_lag']} * {rows.cells['timing.step']}"
    before = [
        *opening(rows),
        rows.load("early_valve"),
        "valve = early_valve",
        f"length = {rows.length}",
        "command = command_history[place_before, lane]",
    ]
    after = [
        *opening(rows),
        "time += timing.command_lag * timing.step",
        "length = timing.step - timing.command_lag * timing.step",
        "command = command_history[place_after, lane]",
    ]
    return [
        "place_before = (step_index - command_delay - 1) % command_history.shape[0]",
        "place_after = (step_index - command_delay) % command_history.shape[0]",
        "for lane in range(width):",
        f"    {rows.length} = {lag}",
        "for part in range(1):",
        *indented(skip_empty(rows)),
        *indented(part(rows, before)),
        *part(rows, after),
    ]


def part(rows: LaneRows, prelude: list[str]) -> list[str]:
    """Valve, gas and vane over ``length`` [s] from ``time`` [s], both set by ``prelude``.

    Each phase is a loop of its own: loops this short let the processor work on several lanes at once.
    """
    kept = rows.keep("gas", "shown") if rows.program.walks else rows.keep(*rows.program.step_rows())
    phases = [*lead_walk(rows), [*begin(rows), *kept, *rows.store("valve_state")], [*feed(rows), *rows.store("state")]]
    if rows.program.angle is None:
        phases.append([*rows.load_step(), *end_free(rows), *rows.store("state")])
    phases[-1] += judge(rows)
    return [line for phase in phases for line in over_lanes([*prelude, *phase])]


def begin(rows: LaneRows) -> list[str]:
    """The valve, and the first stage of the step."""
    valve, add = rows.program.valve, rows.add
    return [
        f"shown, valve_state = {add(valve.advance)}(valve, valve_state, command, time, length)",
        connect(rows, "line_state"),
        *lead(rows),
        begin_gas(rows),
    ]


def connect(rows: LaneRows, line_state: str) -> str:
    """The ports of both chambers; where there are lines, at the pressures that they have in ``line_state``."""
    source = "plant"
    if rows.program.has_lines:
        source = f"{rows.add(supply_lines.fed_plant)}(plant, lines, {line_state})"
    return f"port_1, port_2 = {rows.add(rows.program.valve.connect)}({source}, shown)"


def lead_walk(rows: LaneRows) -> list[list[str]]:
    """Two phases before the gas of a walking leg: the gait at the end of the step, and where the foot would be."""
    if not rows.program.walks:
        return []
    gait = f"{rows.add(gait_at)}(gait, gait_timing, leg, time + length)"
    foot = f"{rows.add(walking.begin_walk)}(plant, leg, share, gait_timing, state, walk, next_gait, length)"
    return [
        [rows.load("gait"), f"next_gait = {gait}", *rows.keep("next_gait")],
        [rows.load("next_gait"), f"begun = {foot}", *rows.keep("begun")],
    ]


def lead(rows: LaneRows) -> list[str]:
    """Where the vane would be at the end of the step, ``next_angle``, and what else its motion needs then."""
    program, add = rows.program, rows.add
    if program.walks:
        return [rows.load("begun"), f"next_angle = {add(walking.next_angle)}(plant, walk, begun)"]
    if program.angle is None:
        return [
            f"begun = {add(motion.begin_free)}(plant, state, 0.0, length)",
            f"next_angle = {add(motion.bounded)}(plant, begun.free_angle)",
        ]
    if program.is_held:
        return ["next_angle = state.angle"]
    return [
        rows.load("path"),
        f"next_angle, next_rate, _ = {add(program.angle.value)}(path, time + length)",
        f"begun = {add(motion.LedStep)}(next_angle, next_rate)",
    ]


def begin_gas(rows: LaneRows) -> str:
    """The first stage of the gas."""
    program, add = rows.program, rows.add
    given = f"port_1, port_2, length, {add(program.valve.port_flow_slopes)}"
    if program.is_thermal:
        return f"gas = {add(thermal_gas.begin_thermal_gas)}(plant, thermal, state, masses, next_angle, {given})"
    if program.is_held:
        return f"gas = {add(pneumatics.begin_still_gas)}(plant, state, {given})"
    if program.has_lines:
        return f"gas = {add(supply_lines.begin_fed_gas)}(plant, lines, line_state, state, next_angle, {given})"
    return f"gas = {add(pneumatics.begin_moving_gas)}(plant, state, next_angle, {given})"


def feed(rows: LaneRows) -> list[str]:
    """The second stage: the gas of the step, and where a led vane is at its end."""
    add = rows.add
    lines = [*rows.load_step(), connect(rows, "gas.lines.after"), *end_gas(rows)]
    if rows.program.angle is not None and not rows.program.is_held:
        lines.append(f"state = {add(motion.with_motion)}(state, begun.next_angle, begun.next_rate)")
    return lines


def end_gas(rows: LaneRows) -> list[str]:
    """The second stage of the gas, and the state with it."""
    program, add = rows.program, rows.add
    given = f"port_1, port_2, length, {add(program.valve.port_flow)}"
    if program.is_thermal:
        return [
            f"change = {add(thermal_gas.end_thermal_gas)}(plant, thermal, gas, {given})",
            f"state, masses = {add(thermal_gas.with_thermal_gas)}(state, masses, change)",
            *rows.store("masses"),
        ]
    if program.has_lines:
        given_2 = f"port_2, length, {add(program.valve.port_flow)}"
        return [
            f"change = {add(pneumatics.end_moving_gas)}(plant, gas.chambers, {given})",
            f"line_state = {add(supply_lines.end_lines)}(plant, lines, line_state, gas, change, {given_2})",
            f"state = {add(motion.with_gas)}(state, change)",
            *rows.store("line_state"),
        ]
    end = pneumatics.end_still_gas if program.is_held else pneumatics.end_moving_gas
    return [f"change = {add(end)}(plant, gas, {given})", f"state = {add(motion.with_gas)}(state, change)"]


def end_free(rows: LaneRows) -> list[str]:
    """Where a free vane is at the end."""
    if not rows.program.walks:
        return [f"state = {rows.add(motion.end_free)}(plant, state, begun, 0.0, length)"]
    follow = rows.cells["gait_sensors.follow_rate"]
    given = f"plant, leg, share, gait_timing, {follow}, state, walk, begun, next_gait, length"
    return [f"state, walk = {rows.add(walking.end_walk)}({given})", *rows.store("walk")]


def judge(rows: LaneRows) -> list[str]:
    """The first time at which a run left what is possible."""
    counted = ["state.mass_1", "state.mass_2"]
    counted += ["masses.mass_1", "masses.mass_2"] if rows.program.is_thermal else []
    gas = ", ".join(counted)
    return [
        f"possible = (abs(state.angular_velocity) < {IMPOSSIBLE_RATE} and min({gas}) > 0.0 "
        f"and max({gas}) < {IMPOSSIBLE_MASS})",
        "failed = result.failure_time if possible else min(result.failure_time, time + length)",
        f"{rows.cells['result.failure_time']} = failed",
    ]
