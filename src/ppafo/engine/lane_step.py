"""What the lanes do between two samples: the way of one step, from the valve to the state that is stored.

A step is whole where nothing changes abruptly inside it and its error is known to be small: the gas of a locked vane
behind a valve that follows at once. Otherwise each lane goes through it in parts of its own. A part ends where a coil
switches, a late command arrives, the vane meets a stop, a sample is due, or its error would become too large. Lanes
that are through wait, masked, and no lane sees another.

``phases`` is the step itself, read downwards: where a walking leg or a vane would be, the valve and the flows with
which the step begins, the first stage of the gas, the flows to which that leads, the second stage, the motion at the
end, and the state, unless its error refuses it.
"""

import re
from typing import get_type_hints

from ppafo.engine.components import Phases, RarePhase
from ppafo.engine.lane_rows import HANDED, LaneRows, Rows, RunRows, count_lanes, indent
from ppafo.engine.lane_samples import present_pressures, pressures_of, sense_end
from ppafo.engine.rows import leaf_paths
from ppafo.engine.scheme import motion, pneumatics
from ppafo.engine.source_text import composed_lines
from ppafo.model.effects.kind import Moment, State
from ppafo.model.plant import SinglePort
from ppafo.model.ports import at_valve, leakage_path

# Beyond 1e6 rad/s or 1 t of gas a run is lost; 100,000 parts of one step are minutes without progress.
IMPOSSIBLE_RATE = 1.0e6
IMPOSSIBLE_MASS = 1.0e3
MAXIMUM_PARTS = 100_000
LARGEST = 1.0e300
"""A state beyond this, or one that is no number, is a failure."""


def find_begin(rows: Rows) -> list[str]:
    """Finds what a step is handed by the one before, where there was none; for a locked vane it lasts for all steps."""
    if not rows.program.hands_chambers_on:
        return []
    held = f"held = {rows.add(pneumatics.held_chambers)}(plant, state.angle)"
    lines = [rows.load("plant"), rows.load("state"), held, *rows.keep("held")]
    return rows.over_lanes([*lines, *([] if rows.program.leg is None else rows.program.leg.find(rows))])


def plant_loop(rows: Rows) -> list[str]:
    """Valve, gas and vane up to ``goal`` [-], a share of the step; 1 for programs that are not parted.

    A step in parts has as many as the lane with the most of them needs.
    """
    program = rows.program
    if not program.is_parted:
        return rows.over_phases([*opening(rows), "length = timing.step"], phases(rows))
    # Places of late commands are the same for all lanes.
    places = []
    if program.late_commands:
        # The dead time in whole steps and a rest: the command of one step or the next acts, by the time within the
        # step.
        places.append("place_before = (step_index - command_delay - 1) % command_history.shape[0]")
        places.append("place_after = (step_index - command_delay) % command_history.shape[0]")
    if program.late_signals:
        places.append("next_place = (step_index + 1) % signal_history.shape[1]")
    part = rows.over_phases([*opening(rows), f"length = {rows.length}"], phases(rows))
    measured = rows.over_lanes([*opening(rows), *measure(rows)])
    # Lanes that waited get their state again before it is asked whether any has something left of its step.
    left = f"{rows.remaining} > 0.0"
    aside, back = ([], []) if isinstance(rows, RunRows) else waiting_lanes(rows)
    is_done = [f"if not {left}:"] if isinstance(rows, RunRows) else [*count_lanes("waiting", left), "if waiting == 0:"]
    return [
        *places,
        f"for part in range({MAXIMUM_PARTS}):",
        *indent([*measured, *aside, *part, *back, *is_done]),
        # The else of the loop is what a run without end in sight gets.
        "        break",
        "else:",
        *indent(rows.over_lanes(give_up(rows))),
    ]


def opening(rows: Rows) -> list[str]:
    """Lines that load what a step or part needs, and the command that the valve has in it."""
    program = rows.program
    names = ["timing", "plant", "valve", "result", "state", "valve_state"]
    for component in (program.gas, program.leg, program.feed):
        names += () if component is None else component.loads
    names += ["load", "shank"] if program.shank is not None else []
    names += ["held"] if program.hands_chambers_on else []
    names += ["start"] if program.starts_apart else []
    leaks = []
    if program.fails:
        from ppafo.model.plant_faults import failed_plant

        leaks = [f"plant = {rows.add(failed_plant)}(plant, plant_faults, time)"]
    lines = [*[rows.load(name) for name in names], time_of_step(rows), *leaks, "command = result.command"]
    if program.is_parted:
        lines += [rows.load("pace"), f"before = {rows.before}", "time += before"]
    if program.late_commands:
        lines += [
            f"until_command = timing.command_lag * timing.step - before - {motion.SAME_INSTANT!r}",
            "early = command_history[place_before, lane]",
            "command = early if until_command > 0.0 else command_history[place_after, lane]",
        ]
    if program.late_signals:
        lines.append("look_at = (1.0 - timing.signal_lag) * timing.step")
    if any(at_valve in effect.laws for effect in program.effects):
        lines.append(f"command = {rows.add(at_valve)}(command)")
    return lines


def time_of_step(rows: Rows) -> str:
    """Line that finds the time [s] at the begin of a step, from the start of the run."""
    step = "(step_index - start.step)" if rows.program.starts_apart else "step_index"
    return f"time = {step} * timing.step"


def phases(rows: Rows) -> Phases:
    """Both stages of the gas over ``length`` [s] from ``time`` [s], what leads to them, and the state at the end."""
    program = rows.program
    is_free = program.angle is None
    # The motion of a free vane needs what its first stage found; a prescribed one finds it again.
    kept = rows.keep("gas") if is_free else rows.keep("begun", "gas")
    begin = program.gas.begin if program.feed is None else program.feed.begin
    first = [rows.load("flowing"), *lead(rows), begin(rows), *kept]
    before = [*([] if program.leg is None else program.leg.lead(rows)), open_valve(rows), first, pass_gas(rows)]
    if not is_free:
        return [*before, [*feed(rows), *finish(rows)]]
    # The error of the gas waits in a row of its own until the motion has its error too.
    error = [f"{rows.error} = gas_error"] if program.is_adaptive else []
    loaded = [rows.load("begun"), rows.load("change")]
    loaded += [f"gas_error = {rows.error}"] if program.is_adaptive else []
    reached = move_alone(rows) if program.leg is None else program.leg.reach(rows, program.gas.add(rows))
    return [*before, [*feed(rows), *rows.keep("change"), *error], *reached, [*loaded, *finish(rows)]]


def open_valve(rows: Rows) -> list[str]:
    """The valve, and the flows with which the step begins."""
    valve, feed, add = rows.program.valve, rows.program.feed, rows.add
    # A part may be refused: its valve becomes the state only once it is taken.
    after = "next_valve" if rows.program.is_parted else "valve_state"
    return [
        f"shown, {after} = {add(valve.advance)}(valve, valve_state, command, time, length)",
        *connect(rows, *([] if feed is None else feed.states)),
        *present_pressures(rows),
        *leak_now(rows),
        f"flowing = {add(pneumatics.sloped_flows)}"
        f"(plant, pressure_1, pressure_2, port_1, port_2, {add(valve.port_flow_slopes)})",
        *rows.keep("flowing", "shown"),
        *(rows.keep("next_valve") if rows.program.is_parted else rows.store("valve_state")),
    ]


def connect(rows: Rows, *fed_from: str) -> list[str]:
    """The ports of both chambers; where lines feed them, at the pressures of a state of these."""
    feed = rows.program.feed
    source = "plant" if feed is None else feed.source(rows, *fed_from)
    lines = [f"port_1, port_2 = {rows.add(rows.program.valve.connect)}({source}, shown)"]
    if not rows.program.fails:
        return lines
    from ppafo.model.plant_faults import failed_blended_ports, failed_single_ports

    is_single = get_type_hints(rows.program.valve.connect)["return"] == tuple[SinglePort, SinglePort]
    failed = rows.add(failed_single_ports if is_single else failed_blended_ports)
    return [*lines, f"port_1, port_2 = {failed}(plant, plant_faults, shut_off, unpowered, port_1, port_2, time)"]


def leak_now(rows: Rows) -> list[str]:
    """The plant with the leak that it has at the pressures of a stage, where that is not always the same.

    A valve that joins the chambers makes the leak between them as wide as it stands open.
    """
    program, add, lines = rows.program, rows.add, []
    if any(leakage_path in effect.laws for effect in program.effects):
        lines.append(f"plant = {add(pneumatics.plant_with_leak_at)}(plant, pressure_1, pressure_2)")
    if program.valve.joint is not None:
        opening = f"{add(program.valve.joint.opening)}(shown)"
        lines.append(f"plant = {add(pneumatics.plant_with_joined_chambers)}(plant, {opening})")
    return lines


def lead(rows: Rows) -> list[str]:
    """Where the vane would be at the end of the step, ``next_angle``, and what else its motion needs then."""
    program, add = rows.program, rows.add
    if program.leg is not None:
        return program.leg.assume(rows)
    if program.angle is None:
        return [rows.load("begun"), "next_angle = begun.next_angle"]
    if program.is_locked:
        return ["next_angle = state.angle", "begun = ()"]
    return [
        rows.load("path"),
        f"next_angle, next_rate, _ = {add(program.angle.value)}(path, time + length)",
        f"begun = {add(motion.PrescribedStep)}(next_angle, next_rate)",
    ]


def pass_gas(rows: Rows) -> list[str]:
    """The flows of the second stage, at the pressures to which the first one leads."""
    program, add = rows.program, rows.add
    ends = program.gas.ends(rows, program.chambers)
    connected, leak = connect(rows, *([] if program.feed is None else [program.feed.after_first])), leak_now(rows)
    return [
        rows.load("gas"),
        rows.load("shown"),
        *states_ahead(rows, [*connected, *leak]),
        *connected,
        f"pressure_1, pressure_2 = {ends}",
        *leak,
        f"passing = {add(pneumatics.stage_flows)}"
        f"(plant, pressure_1, pressure_2, port_1, port_2, {add(program.valve.port_flow)})",
        *rows.keep("passing"),
    ]


def states_ahead(rows: Rows, lines: list[str]) -> list[str]:
    """Lines that predict, for the end of the first stage, the states that the laws in some lines take.

    Without them the flows of the second stage would have the states of the begin, and the order would fall to one.
    """
    words = {word for line in composed_lines(lines, rows.needs) for word in re.findall(r"\w+", line)}
    asked = [(name, kind) for name, kind in rows.program.stated.items() if f"{name}_state" in words]
    if not asked:
        return []
    predicted = []
    for name, kind in asked:
        row = kind.row
        fields = (f"{path} + length * {moved}" for path, moved in _with_slopes(name, kind))
        predicted += [
            f"{name}_state_slopes = {rows.add(kind.slopes)}({name}, {name}_state, now)",
            f"{name}_state = {rows.add(row)}({', '.join(fields)})",
        ]
    return [*begun_moment(rows), *predicted]


def feed(rows: Rows) -> list[str]:
    """The second stage: the gas of the step, what feeds the chambers, and in parts that may be refused its error."""
    program, add = rows.program, rows.add
    second = program.gas.second(rows, program.chambers)
    error = second.error
    lines = [rows.load(name) for name in ("begun", "gas", "shown", "passing")]
    lines += [f"second = {second.stage}", f"change = {second.change}"]
    if program.feed is not None:
        # What feeds the chambers comes to the end of the step, kept apart where it may be refused.
        ((state, after),) = program.feed.stored.items()
        fed = after if program.is_parted else state
        lines.append(f"{fed} = {program.feed.end(rows)}")
        lines += rows.store(fed)
    if not program.is_adaptive:
        return lines
    if program.feed is not None:
        # The larger of both errors, not their sum: each has its own limit.
        error = f"max({error}, {program.feed.error(rows)})"
    moves = program.valve.shift
    if moves is not None:
        lines += [rows.load("next_valve"), f"shift = {add(moves)}(valve_state, next_valve)"]
    return [*lines, f"gas_error = {error}" + (f" + {second.shifted}" if moves else "")]


def finish(rows: Rows) -> list[str]:
    """The state at the end of a step or part, unless the part is refused; and the first time at which a run failed."""
    program, add = rows.program, rows.add
    fed = program.feed.stored.values() if program.feed is not None else ()
    # Gas before motion: the vane ends under the pressures of the new gas.
    lines = [program.gas.add(rows), *end_motion(rows), *program.gas.work(rows), *advance_states(rows)]
    if not program.is_parted:
        return [*lines, *store_all(rows, ""), *judge(rows), *sense_end(rows)]
    lines += [rows.load("next_valve"), *[rows.load(name) for name in fed]]
    flag, followed = "taken", ""
    if program.is_adaptive:
        positive = " and ".join(f"{mass} > 0.0" for mass in masses_after(rows, *fed))
        followed = f" and not missed > {motion.LOST!r}"
        lines += [
            f"missed = max({', '.join(['error', 'gas_error', *state_errors(rows)])})",
            "error = missed / timing.tolerance",
            # A part with a mass below 0 or NaN counts as the worst error, and is done again, shorter.
            f"error = error if {positive} else {motion.MAXIMUM_ERROR!r}",
            # A run that has failed is carried to its end without more parts, so that its lane holds nobody up.
            f"refused = {add(motion.is_refused)}(error, length) and not result.failure_time <= time",
            f"next_length = {add(motion.next_pace)}(pace, error, length, refused, timing.step).length",
            f"active = {rows.remaining} > 0.0",
            f"{rows.cells['pace.length']} = next_length if active else pace.length",
            "taken = active and not refused",
        ]
    else:
        lines.insert(0, f"taken = {rows.remaining} > 0.0")
        flag = "" if program.parts_are_rare else flag
    return [
        *lines,
        *store_all(rows, flag),
        *judge(rows, flag, followed),
        *sense_end(rows),
        # Sums of part lengths miss the goal by rounding: the last part sets it.
        f"arrives = length >= {rows.remaining} and taken or {rows.remaining} == 0.0",
        f"{rows.before} = goal * timing.step if arrives else before + (length if taken else 0.0)",
        f"{rows.remaining} = 0.0 if arrives else {rows.remaining}",
    ]


def torque_of_leg(rows: Rows, time: str, angle: str) -> list[str]:
    """Lines that make ``added`` [N m], the torque of a leg on the vane at expressions of time [s] and angle [rad]."""
    if rows.program.shank is None:
        return ["added = 0.0"]
    from ppafo.engine.led_leg import torque_lines  # few vanes carry a leg

    return torque_lines(rows.program, rows.add, time, angle)


def move_alone(rows: Rows) -> Phases:
    """Phases that lead to the motion of a vane without ground; few turn, or begin to move."""
    program, add = rows.program, rows.add
    begin = [rows.load("begun"), rows.load("change"), program.gas.add(rows)]
    torque = torque_of_leg(rows, "time + length", "begun.next_angle")
    slide = f"slid, moved = {add(motion.slide_part)}(plant, fed, begun, added, length)"
    depart = f"moved = {add(motion.depart_part)}(plant, fed, begun, slid, moved, length)"
    return [
        [*begin, *torque, slide, *rows.keep("slid", "moved")],
        RarePhase(
            [*begin, rows.load("slid"), rows.load("moved"), depart, *rows.keep("moved")], rows.cells["slid.departs"]
        ),
    ]


def end_motion(rows: Rows) -> list[str]:
    """Lines that lead to the state ``after`` the step, and in parts to the ``error`` of the motion."""
    program, add = rows.program, rows.add
    if program.leg is not None:
        return program.leg.end(rows)
    if program.angle is None:
        lines = [rows.load("moved"), *program.gas.move(rows, "fed", "begun.next_angle", "moved.angle")]
        return [*lines, f"after = {add(motion.with_motion)}(fed, moved.angle, moved.rate)", "error = moved.error"]
    if program.is_locked:
        return ["after = fed", "error = 0.0"]
    return [f"after = {add(motion.with_motion)}(fed, begun.next_angle, begun.next_rate)", "error = 0.0"]


def advance_states(rows: Rows) -> list[str]:
    """Lines that bring the states of effects to the end of a step or part: ``NAME_state_after``."""
    stated = rows.program.stated
    if not stated:
        return []
    # Means over the step: a part without length must not divide by 0.
    mean = f"/ max(length, {pneumatics.SHORTEST!r})"
    lines = [
        f"supplied = (after.supplied_mass - state.supplied_mass) {mean}",
        f"vented = (after.vented_mass - state.vented_mass) {mean}",
        *moment(rows, "before_step", "state"),
        *moment(rows, "after_step", "after"),
        *(begun_moment(rows) if rows.program.is_adaptive and any(kind.tolerances for kind in stated.values()) else []),
    ]
    for name, kind in stated.items():
        lines.append(
            f"{name}_state_after = {rows.add(kind.advance)}({name}, {name}_state, before_step, after_step, length)"
        )
        if kind.tolerances and rows.program.is_adaptive:
            lines.append(f"{name}_state_slopes = {rows.add(kind.slopes)}({name}, {name}_state, now)")
    return lines


def state_errors(rows: Rows) -> list[str]:
    """Expressions of the errors of the states of effects in a part over what is allowed [-]."""
    found = []
    for name, kind in rows.program.stated.items():
        for (path, moved), allowed in zip(
            _with_slopes(name, kind) if kind.tolerances else (), kind.tolerances, strict=True
        ):
            # The error of a state is what its exact step and a straight extrapolation differ by.
            after = path.replace(f"{name}_state", f"{name}_state_after", 1)
            found.append(f"abs({after} - ({path} + length * {moved})) / {allowed!r}")
    return found


def masses_after(rows: Rows, *others: str) -> list[str]:
    """Masses at the end of a step that must be above 0: of the gas, and of some other structs."""
    groups = ("after", *rows.program.gas.stored.values(), *others)
    return [f"{group}.mass_{number}" for group in groups for number in (1, 2)]


def store_all(rows: Rows, flag: str) -> list[str]:
    """Lines that write the new state, where ``flag`` names a condition only under it."""
    lines = rows.store("state", "after", flag)
    for component in (rows.program.gas, rows.program.leg):
        for group, name in ({} if component is None else component.stored).items():
            lines += rows.store(group, name, flag)
    for state in rows.program.effect_states:
        lines += rows.store(state, f"{state}_after", flag)
    if rows.program.is_parted:
        lines += rows.store("valve_state", "next_valve", flag)
        for group, name in ({} if rows.program.feed is None else rows.program.feed.stored).items():
            lines += rows.store(group, name, flag)
    return lines


def judge(rows: Rows, flag: str = "", followed: str = "") -> list[str]:
    """Lines that keep the first time at which a run became unphysical, or its parts could not follow (``followed``)."""
    gas = ", ".join(masses_after(rows))
    waits = f"not {flag} or " if flag else ""
    states = (path for name, row in rows.program.effect_states.items() for path in leaf_paths(row, f"{name}_after"))
    bounded = "".join(f" and abs({path}) < {LARGEST!r}" for path in states)
    return [
        f"possible = {waits}(abs(after.angular_velocity) < {IMPOSSIBLE_RATE} and min({gas}) > 0.0 "
        f"and max({gas}) < {IMPOSSIBLE_MASS}{bounded}{followed})",
        "failed = result.failure_time if possible else min(result.failure_time, time + length)",
        f"{rows.cells['result.failure_time']} = failed",
    ]


def begun_moment(rows: Rows) -> list[str]:
    """Lines that make the moment ``now`` at the begin of a step, with the flows of its first stage."""
    first = rows.program.gas.first(rows, rows.program.chambers)
    return [
        rows.load("gas"),
        f"supplied = {first}.supplied",
        f"vented = {first}.supplied - {first}.mass_1 - {first}.mass_2",
        *moment(rows, "now", "state"),
    ]


def moment(rows: Rows, name: str, state: str) -> list[str]:
    """Lines that make a moment of the plant in some state, with the flows ``supplied`` and ``vented``."""
    given = f"{state}.angle, {state}.angular_velocity, pressure_1, pressure_2, supplied, vented, command"
    return [
        f"pressure_1, pressure_2 = {pressures_of(rows, state)}",
        f"{name} = {rows.add(Moment)}({given})",
    ]


def _with_slopes(name: str, kind: State) -> list[tuple[str, str]]:
    """Each number of a state, and its rate."""
    paths = leaf_paths(kind.row, f"{name}_state")
    return [(path, path.replace(f"{name}_state", f"{name}_state_slopes", 1)) for path in paths]


def measure(rows: Rows) -> list[str]:
    """Lines that find the length of a part; where the vane is unconstrained, until it meets a stop."""
    program, add = rows.program, rows.add
    lines = ["remaining = max(goal * timing.step - before, 0.0)", "until = remaining"]
    if program.late_commands:
        arrival = f"until_command + {motion.SAME_INSTANT!r}"
        lines.append(f"until = min(until, {arrival}) if until_command > 0.0 else until")
    if program.late_signals:
        soon = f"look_at - before > {motion.SAME_INSTANT!r}"
        lines.append(f"until = min(until, look_at - before) if {soon} else until")
    if program.valve.jumps:
        lines += [
            f"settled = {add(program.valve.settle)}(valve, valve_state, command, time)",
            f"jump = {add(program.valve.next_event)}(valve, settled, command, time)",
            f"until = {add(motion.until_jump)}(jump - time, until)",
        ]
    if program.is_adaptive:
        # A failed run takes its steps whole, so that it ends without holding up its block.
        hurries = "remaining == 0.0 or result.failure_time <= time"
        lines.append(f"until = remaining if {hurries} else {add(motion.part_length)}(pace, until)")
        if program.angle is None:
            lines += torque_of_leg(rows, "time", "state.angle")
            lines.append(f"begun, until = {add(motion.begin_part)}(plant, state, added, until)")
            lines += rows.keep("begun")
    else:
        lines.append("until = remaining if result.failure_time <= time else until")
    return [*lines, f"{rows.length} = until", f"{rows.remaining} = remaining"]


def waiting_lanes(rows: LaneRows) -> tuple[list[str], list[str]]:
    """Lines that keep the state in parts in which lanes may wait, and those that give it to them again.

    Never in the first part: a select for each row takes longer.
    """
    if not rows.program.parts_are_rare:
        return [], []
    count, cells = len(rows.state_at), rows.cells
    remaining = f"x[{rows.aside + count}, lane]"
    # Beside the state, what a step is handed by the one before, by its path.
    paths = [path for path in rows.step_at if path.startswith(HANDED)]
    handed = {path: f"x[{rows.aside + count + 1 + place}, lane]" for place, path in enumerate(paths)}
    kept = [f"{cell} = {cells[path]}" for path, cell in handed.items()]
    kept.append(f"{remaining} = {rows.remaining}")
    moves = f"{remaining} > 0.0"
    again = [f"{cells[path]} = {cells[path]} if {moves} else {cell}" for path, cell in handed.items()]
    aside = over_rows(count, f"x[{rows.aside} + row, lane] = x[row, lane]")
    back = over_rows(count, f"x[row, lane] = x[row, lane] if {moves} else x[{rows.aside} + row, lane]")
    first, last = rows.over_lanes(kept), rows.over_lanes(again) if again else []
    return ["if part > 0:", *indent([*aside, *first])], ["if part > 0:", *indent([*back, *last])]


def give_up(rows: Rows) -> list[str]:
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


def over_rows(count: int, line: str) -> list[str]:
    """A line for all lanes of the first rows."""
    return [f"for row in range({count}):", "    for lane in range(width):", f"        {line}"]
