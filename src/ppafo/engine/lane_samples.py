"""What the lanes do at a sample: sense, control, keep what reaches sensors and valve late; and meters, and traces.

Meters and traces stand where nothing is recorded. Their samples are the ones that a recording would have. Meters
get the whole reference too, which is looked at once before the first sample and followed from there.
"""

from typing import Any

from ppafo.engine.lane_rows import Rows, RunRows, indent
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, leaves
from ppafo.engine.scheme.actuators import seen_with_torque, torque_at
from ppafo.engine.scheme.motion import SAME_INSTANT
from ppafo.engine.scheme.pneumatics import held_pressures
from ppafo.kinds import kind_at
from ppafo.model.helping import STOPPED
from ppafo.model.plant import actuator_torque, chamber_pressures
from ppafo.model.ports import shown_signals
from ppafo.model.sensors import GaitMeasurement, Measurement, late_measurement, measure, measure_gait, samples_late
from ppafo.model.valves.kind import VENT
from ppafo.signals.meter import SAME_LEVEL, FootSample, Sample, StrideSample, advance_course, is_away

LEVEL = "safety.level"
"""Where a controller of walking keeps its level of help."""

SIGNALS = ("angle", "pressure_1", "pressure_2")
READINGS = {
    "heel": "heel_force",
    "toe": "toe_force",
    "angle": "angle",
    "pressure_1": "pressure_1",
    "pressure_2": "pressure_2",
}
"""Sensors of a walk, as their faults are named, and what they read."""


def control_loop(rows: Rows) -> list[str]:
    """Sense and control, at every sample; nothing where the caller sets the command."""
    program, controller = rows.program, rows.program.controller
    if controller is None:
        return []
    groups = ("timing", "plant", "state", "controller", "controller_state", "reference")
    lines = [
        *[rows.load(group) for group in groups],
        *(sense_gait(rows) if program.walks else sense(rows)),
        f"wanted = {rows.add(program.reference.value)}(reference, step_index * timing.step)[0]",
        f"command, controller_state = {rows.add(controller.update)}"
        "(controller, controller_state, wanted, seen, timing.period)",
        *rows.store("controller_state"),
        f"{rows.cells['result.command']} = command",
    ]
    if program.fails:
        lines = [*lines[: len(groups)], *sampled_with_faults(rows, controller.initial, lines[len(groups) :])]
    # Once for all lanes. Histories are rings: the place is the step less the delay, modulo their length.
    places = ["late = (step_index - signal_delay) % signal_history.shape[1]"] if program.late_signals else []
    places += [] if program.ideal_sensors else ["sample_index = step_index // steps_per_sample"]
    return ["if step_index % steps_per_sample == 0:", *indent([*places, *rows.over_lanes(lines)])]


def sampled_with_faults(rows: Rows, initial: Any, lines: list[str]) -> list[str]:
    """The lines of a sample where the controller may miss it or have no power, and where a valve may take it late.

    Without power the controller is in its ``initial`` state.
    """
    # Most plants have no faults.
    from ppafo.model.plant_faults import is_due, is_in_brown_out, is_silenced, next_unpowered, runs_at

    add = rows.add
    paths = leaf_paths(rows.groups["controller_state"], "controller_state")
    stored = dict(zip(paths, leaves(initial), strict=True))
    # The state is stored by the lines below, under the condition that the controller has run.
    kept = [line for line in lines if not any(line.startswith(f"{rows.cells[path]} = ") for path in stored)]
    called = [line.replace("command, controller_state =", "ordered, after_state =") for line in kept[:-1]]
    level = "after_state.safety.level" if f"controller_state.{LEVEL}" in stored else "0.0"
    return [
        *[rows.load(group) for group in ("result", "plant_faults", "shut_off", "unpowered", "sensors")],
        "now = step_index * timing.step",
        f"brown_out = {add(is_in_brown_out)}(plant_faults, now)",
        f"runs = {add(runs_at)}(plant_faults, now, timing.period, int(sensors.seed), step_index // steps_per_sample)",
        *called,
        f"takes = {add(is_due)}(plant_faults.slow_time, plant_faults.slow_delay, now, timing.period)",
        f"stopped = {level} >= {STOPPED!r}",
        f"unpowered = {add(next_unpowered)}(shut_off, unpowered, runs, stopped, brown_out, timing.period)",
        *rows.store("unpowered"),
        f"vents = brown_out | {add(is_silenced)}(shut_off, unpowered)",
        f"{rows.cells['result.command']} = {VENT!r} if vents else (ordered if runs & takes else result.command)",
        *[
            f"{rows.cells[path]} = {float(first)!r} if brown_out else "
            f"({path.replace('controller_state', 'after_state', 1)} if runs else {path})"
            for path, first in stored.items()
        ],
    ]


def sense(rows: Rows) -> list[str]:
    """Lines that make the measurement ``seen``."""
    add = rows.add
    if rows.program.late_signals:
        signals = [f"{name} = signal_history[{row}, late, lane]" for row, name in enumerate(SIGNALS)]
    else:
        signals = current_readings(rows)
    if not rows.program.ideal_sensors:
        seen = f"{add(measure)}(sensors, angle, pressure_1, pressure_2, plant.torque_constant, sample_index)"
        # The sensors' torque follows from pressures by a constant, which another actuator does not have.
        shaped = [f"seen = {add(seen_with_torque)}(plant, seen)"] if rows.program.has_shape else []
        return [rows.load("sensors"), *signals, f"seen = {seen}", *shaped]
    return [
        *signals,
        torque_line(rows, "angle"),
        f"seen = {add(Measurement)}(angle, pressure_1, pressure_2, torque)",
    ]


def torque_line(rows: Rows, angle: str) -> str:
    """Line that makes the torque of both pressures, at an angle where the actuator is no vane."""
    if rows.program.has_shape:
        return f"torque = {rows.add(torque_at)}(plant, {angle}, pressure_1, pressure_2)"
    return f"torque = {rows.add(actuator_torque)}(pressure_1, pressure_2, plant.torque_constant)"


def current_readings(rows: Rows) -> list[str]:
    """Lines that make the sensors' present readings."""
    return ["angle = state.angle", *present_pressures(rows), *as_shown(rows)]


def as_shown(rows: Rows) -> list[str]:
    """Line that makes signals as the sensors show them, where an effect acts there."""
    if not any(shown_signals in effect.laws for effect in rows.program.effects):
        return []
    signals = ", ".join(SIGNALS)
    return [f"{signals} = {rows.add(shown_signals)}({signals})"]


def present_pressures(rows: Rows) -> list[str]:
    """Lines that make both pressures of ``state``."""
    if rows.program.hands_chambers_on:
        return [rows.load("held"), f"pressure_1, pressure_2 = {rows.add(held_pressures)}(held, state)"]
    return [f"pressure_1, pressure_2 = {pressures_of(rows, 'state')}"]


def pressures_of(rows: Rows, state: str) -> str:
    """Expression for both pressures of any state."""
    return f"{rows.add(chamber_pressures)}(plant, {state}.angle, {state}.mass_1, {state}.mass_2)"


def sense_gait(rows: Rows) -> list[str]:
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


def late_readings(rows: Rows) -> list[str]:
    """Lines that keep the readings of a walk, and hand the controller each sensor's as late as its fault says."""
    lines = ["slots = signal_history.shape[1]"]
    for row, (sensor, reading) in enumerate(READINGS.items()):
        age = f"{rows.add(samples_late)}(gait_sensors.{sensor}_fault, step_index * timing.step, sample_index)"
        # Written before it is read, so that a sensor without a delay shows its present reading.
        lines.append(f"signal_history[{row}, sample_index % slots, lane] = seen.{reading}")
        lines.append(f"late_{reading} = signal_history[{row}, (sample_index - {age}) % slots, lane]")
    given = ", ".join(f"late_{reading}" for reading in READINGS.values())
    return [*lines, f"seen = {rows.add(late_measurement)}({given}, plant.torque_constant)"]


def signals_before_start(rows: Rows) -> list[str]:
    """Lines that fill the late signals with their values at the start, which sensors show until the first have come."""
    if not rows.program.late_signals:
        return []
    lines = [rows.load("plant"), rows.load("state"), *current_readings(rows)]
    lines += [f"signal_history[{row}, slot, lane] = {name}" for row, name in enumerate(SIGNALS)]
    return [
        "if step_index == 0:",
        "    for slot in range(signal_history.shape[1]):",
        *indent(rows.over_lanes(lines), 2),
    ]


def sense_end(rows: Rows) -> list[str]:
    """What late sensors look at in a step or part, at its end, with the states that effects have then.

    A signal that is late by a fraction of a step is looked at by that much before its end, at ``look_at`` [s].
    """
    if not rows.program.late_signals or rows.program.walks:
        return []
    states = [f"{name} = {name}_after" for name in rows.program.effect_states]
    now = [f"pressure_1, pressure_2 = {pressures_of(rows, 'after')}", "angle = after.angle"]
    looks = f"looks = taken and abs(before + length - look_at) <= {SAME_INSTANT!r}"
    cells = [f"signal_history[{row}, next_place, lane]" for row in range(len(SIGNALS))]
    kept = [f"{cell} = {name} if looks else {cell}" for cell, name in zip(cells, SIGNALS, strict=True)]
    return [*states, *now, *as_shown(rows), looks, *kept]


def remember_commands(rows: Rows) -> list[str]:
    """Lines that keep the command of every step, where the valve gets it late."""
    if not rows.program.late_commands:
        return []
    kept = f"command_history[command_place, lane] = {rows.cells['result.command']}"
    return ["command_place = step_index % command_history.shape[0]", *rows.over_lanes([kept])]


TRACED: dict[str, str] = {
    **{name: f"sample.{name}" for name in Sample._fields if name not in ("number", "foot", "stride")},
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
    "positive_push_off_work": "walk.positive_push_off_work",
    "net_push_off_work": "walk.net_push_off_work",
    "controller_phase": "controller_state.phase.phase",
    "safe_state": "controller_state.safety.level",
    "gait_fraction": "clock.fraction",
}
"""Further ones of a walk: how the path of a number of its state ends, which not every controller has."""
REQUEST = "controller_state.request.torque"
"""Where a controller of walking keeps the torque that it wants, if it wants one."""
TRUE_MASSES = {name: f"masses.{name}" for name in ("mass_1", "mass_2")}
"""Paths of the true masses, which a recording shows for gas with an energy balance or that is not ideal."""


def measure_sample(rows: Rows, moment: str) -> list[str]:
    """Meters and traces of sample ``next_record`` at ``moment``, counted in steps."""
    program = rows.program
    lines: list[str] = []
    if program.meters:
        begin, update = _meter_updates(rows)
        # One run makes its sample once for meters and traces, lanes in each of their loops.
        sample = [] if isinstance(rows, RunRows) else sample_lines(rows, moment)
        first, follow = course_lines(rows)
        lines += [
            "if next_record == 0:",
            *indent([*first, *rows.over_lanes([*sample, *follow, *begin])]),
            "else:",
            *indent(rows.over_lanes([*sample, *follow, *update])),
        ]
    # Where a sample has channels that are no number of the state itself.
    paths = TRACED | walk_traces(program) | (TRUE_MASSES if program.has_true_masses else {})
    traced = [paths.get(name, name) for name in program.traced]
    if isinstance(rows, RunRows):
        return [
            *rows.over_lanes(sample_lines(rows, moment)),
            *lines,
            "samples.before = samples.last",
            *rows.over_lanes([f"samples.last = {rows.outputs}(0.0, {', '.join(traced)})"]),
        ]
    if traced:
        # A trace with less room than samples keeps the last ones.
        cell = "trace[next_record // trace_every % trace.shape[0], {row}, lane]"
        kept = [f"{cell.format(row=row)} = {path}" for row, path in enumerate(traced)]
        lines += ["if next_record % trace_every == 0:", *indent(rows.over_lanes([*sample_lines(rows, moment), *kept]))]
    return lines


def _meter_updates(rows: Rows) -> tuple[list[str], list[str]]:
    """Lines that begin the meters with the first sample, and those that take a further one."""
    program, add = rows.program, rows.add
    groups = program.meter_groups
    # A locked vane never moves: its meters of motion keep what the first sample gave them.
    moving = {group: kind for group, kind in groups.items() if not (program.is_locked and kind.of_motion)}
    begin = [f"{group} = {add(kind.start)}(course, sample)" for group, kind in groups.items()]
    begin += [line for group in groups for line in rows.store(group)]
    update = [rows.load(group) for group in moving]
    for group, kind in moving.items():
        update += [f"{group} = {add(kind.update)}({group}, course, sample)", *rows.store(group)]
    return begin, update


SAMPLE_TIME = "next_record * (timing.step * interval)"
"""Expression of the time of a sample [s]."""


def sample_lines(rows: Rows, moment: str) -> list[str]:
    """Lines that make the sample of a lane."""
    add, program = rows.add, rows.program
    has_reference = program.has_reference and not program.walks
    wanted = f"{add(program.reference.value)}(reference, {moment} * timing.step)[0]" if has_reference else "0.0"
    values = {
        "number": "float(next_record)",
        "angle": "state.angle",
        "angular_velocity": "state.angular_velocity",
        "pressure_1": "pressure_1",
        "pressure_2": "pressure_2",
        "torque": "torque",
        "command": "result.command",
        "reference": "wanted",
        "temperature_1": "0.0",
        "temperature_2": "0.0",
    }
    if program.is_thermal:
        for chamber in (1, 2):
            warm = f"thermal.temperature * (state.mass_{chamber} / masses.mass_{chamber})"
            values[f"temperature_{chamber}"] = warm
    groups: tuple[str, ...] = ()
    foot, stride = dict.fromkeys(FootSample._fields, "0.0"), dict.fromkeys(StrideSample._fields, "0.0")
    on_gait: list[str] = []
    if program.walks:
        groups = ("walk", "controller_state")
        # Zero where the controller of this program has no such number.
        wanted, phase, level = (
            path if path in rows.state_at else "0.0"
            for path in (REQUEST, TRACED_IN_WALKS["controller_phase"], TRACED_IN_WALKS["safe_state"])
        )
        totals = ("strides", "positive_push_off_work", "net_push_off_work", "clearances", "toe_landings")
        stride = {
            "supplied_mass": "state.supplied_mass",
            **{name: f"walk.{name}" for name in totals},
            "phase": phase,
            "level": level,
            "time": SAMPLE_TIME,
        }
    if program.is_on_gait:
        groups = ("shank",)
        # By its place, for few vanes carry a leg.
        foot_in_gait = kind_at("ppafo.model.gait:foot_in_gait")
        on_gait = [f"foot = {add(foot_in_gait)}(shank, {moment} * timing.step, state.angle)"]
        foot = {name: f"foot.{name}" for name in FootSample._fields}
    values |= {"foot": _row(add(FootSample), foot), "stride": _row(add(StrideSample), stride)}
    of_gas = (*program.gas.parameters, *program.gas.states)
    return [
        *[rows.load(group) for group in ("timing", "plant", "state", "result", "reference", *of_gas, *groups)],
        *present_pressures(rows),
        torque_line(rows, "state.angle"),
        f"wanted = {wanted}",
        *on_gait,
        f"sample = {_row(add(Sample), values)}",
    ]


def _row(name: str, values: dict[str, str]) -> str:
    """Expression that makes a NamedTuple."""
    return f"{name}({', '.join(f'{field}={value}' for field, value in values.items())})"


def walk_traces(program: Program) -> dict[str, str]:
    """Channels of ``TRACED_IN_WALKS`` that a program has, and the paths of their numbers."""
    if not program.walks:
        return {}
    paths = [path for name, row in program.state_rows().items() for path in leaf_paths(row, name)]
    found = {
        name: next((path for path in paths if path.endswith(ending)), "") for name, ending in TRACED_IN_WALKS.items()
    }
    return {name: path for name, path in found.items() if path}


def course_lines(rows: Rows) -> tuple[list[str], list[str]]:
    """Lines that look at the whole reference before the first sample, and those that load ``course`` at each sample.

    The course is the last value of the reference, its largest, and where it holds. A monotone reference is largest at
    one of its ends, and where its hold starts shows on the way. Any other one is looked at sample by sample, over all
    lanes at once; its hold is looked for from the end.
    """
    if not rows.program.follows_reference:
        return [], ["course = ()"]
    is_monotone = rows.program.reference.is_monotone
    cell = {name: rows.cells[f"course.{name}"] for name in ("last", "largest", "tolerance", "hold_start")}
    follow = [rows.load("course")]
    if is_monotone:
        follow.append(f"course = {rows.add(advance_course)}(course, sample)")
        follow.append(f"{cell['hold_start']} = course.hold_start")
    given = [rows.load("timing"), rows.load("reference")]
    value = f"{rows.add(rows.program.reference.value)}(reference, {{}} * interval * timing.step)[0]"
    ends = [
        *given,
        f"{cell['last']} = {value.format('last_record')}",
        f"{cell['largest']} = max(abs({value.format('0')}), abs({cell['last']}))",
        f"{cell['hold_start']} = 0.0",
    ]
    tolerance = rows.over_lanes([f"{cell['tolerance']} = {SAME_LEVEL!r} * {cell['largest']}"])
    if is_monotone:
        return [*rows.over_lanes(ends), *tolerance], follow
    at_index = value.format("index")
    largest = f"{cell['largest']} = max({cell['largest']}, abs({at_index}))"
    away = f"{rows.add(is_away)}({at_index}, {cell['last']}, {cell['tolerance']})"
    found = f"index + 1.0 if {cell['hold_start']} == 0.0 and {away} else {cell['hold_start']}"
    first = [
        *rows.over_lanes(ends),
        "for index in range(last_record):",
        *indent(rows.over_lanes([*given, largest])),
        *tolerance,
        "for index in range(last_record - 1, -1, -1):",
        *indent(rows.over_lanes([*given, f"{cell['hold_start']} = {found}"])),
        # The search ends as soon as every lane has found its hold.
        "    earliest = 1.0",
        *indent(rows.over_lanes([f"earliest = min(earliest, {cell['hold_start']})"])),
        "    if earliest > 0.0:",
        "        break",
    ]
    return first, follow
