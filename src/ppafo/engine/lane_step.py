"""What the lanes do in a step: valve, gas and vane, whole or in parts where something changes abruptly inside it."""

from collections.abc import Callable
from typing import Any

from ppafo.engine.lane_rows import LaneRows, indented, over_lanes
from ppafo.engine.scheme import motion, pneumatics

IMPOSSIBLE_RATE = 1.0e6
IMPOSSIBLE_MASS = 1.0e3

SKIP_EMPTY = [
    "longest = 0.0",
    "for lane in range(width):",
    "    longest = max(longest, lengths[part, lane])",
    "if longest == 0.0:",
    "    break",
]


def plant_loop(rows: LaneRows) -> list[str]:
    """Valve, gas and vane, one step: whole, or in parts where something changes abruptly inside it."""
    if rows.program.late_commands:
        return late_loop(rows)
    if rows.program.valve.cuts is not None:
        return cut_loop(rows, rows.program.valve.cuts)
    return part(rows, [*opening(rows), "length = timing.step"])


def opening(rows: LaneRows) -> list[str]:
    """Lines that load what a step needs."""
    names = ("timing", "plant", "valve", "result", "state", "valve_state")
    return [*[rows.load(name) for name in names], "time = step_index * timing.step", "command = result.command"]


def cut_loop(rows: LaneRows, cuts: Callable[..., Any]) -> list[str]:
    """Three parts, between the switchings of the valve; parts that no lane needs are passed over."""
    cut = [
        f"first, second = {rows.add(cuts)}(valve, valve_state, command, time, timing.step)",
        "whole = first <= 0.0",
        "lengths[0, lane] = timing.step if whole else first",
        "lengths[1, lane] = 0.0 if whole else (second - first if second > first else timing.step - first)",
        "lengths[2, lane] = timing.step - second if second > first else 0.0",
    ]
    begin = [
        "length = lengths[part, lane]",
        "time += (lengths[0, lane] if part > 0 else 0.0) + (lengths[1, lane] if part > 1 else 0.0)",
    ]
    return [
        *over_lanes([*opening(rows), *cut]),
        "for part in range(3):",
        *indented(SKIP_EMPTY),
        *indented(part(rows, [*opening(rows), *begin])),
    ]


def late_loop(rows: LaneRows) -> list[str]:
    """Two parts, before and after a late command arrives; the first is passed over where no lane has it."""
    lag = f"p[{rows.parameter_at['timing.command_lag']}, lane] * p[{rows.parameter_at['timing.step']}, lane]"
    before = [
        *opening(rows),
        rows.load("early_valve"),
        "valve = early_valve",
        "length = lengths[part, lane]",
        "command = command_history[(step_index - command_delay - 1) % command_history.shape[0], lane]",
    ]
    after = [
        *opening(rows),
        "time += timing.command_lag * timing.step",
        "length = timing.step - timing.command_lag * timing.step",
        "command = command_history[(step_index - command_delay) % command_history.shape[0], lane]",
    ]
    return [
        "for lane in range(width):",
        f"    lengths[0, lane] = {lag}",
        "for part in range(1):",
        *indented(SKIP_EMPTY),
        *indented(part(rows, before)),
        *part(rows, after),
    ]


def part(rows: LaneRows, prelude: list[str]) -> list[str]:
    """Valve, gas and vane over ``length`` [s] from ``time`` [s], both set by ``prelude``.

    Each phase is a loop of its own: loops this short let the processor work on several lanes at once.
    """
    phases = [[*begin(rows), *rows.keep(), *rows.store("valve_state")], [*feed(rows), *rows.store("state")]]
    if rows.program.angle is None:
        phases.append([*rows.load_step(), *end_free(rows), *rows.store("state")])
    phases[-1] += judge(rows)
    return [line for phase in phases for line in over_lanes([*prelude, *phase])]


def begin(rows: LaneRows) -> list[str]:
    """The valve, and the first stage of the step."""
    valve, add = rows.program.valve, rows.add
    lines = [
        f"shown, valve_state = {add(valve.advance)}(valve, valve_state, command, time, length)",
        f"port_1, port_2 = {add(valve.connect)}(plant, shown)",
    ]
    given = f"port_1, port_2, length, {add(valve.port_flow_slopes)}"
    if rows.program.angle is None:
        return [*lines, f"begun = {add(motion.begin_free)}(plant, state, {given})"]
    if rows.program.is_held:
        return [*lines, f"begun = {add(pneumatics.begin_still_gas)}(plant, state, {given})"]
    return [
        *lines,
        rows.load("path"),
        f"next_angle, next_rate, _ = {add(rows.program.angle.value)}(path, time + length)",
        f"begun = {add(motion.begin_led)}(plant, state, next_angle, next_rate, {given})",
    ]


def feed(rows: LaneRows) -> list[str]:
    """The second stage: the gas of the step, and where a led vane is at its end."""
    valve, add = rows.program.valve, rows.add
    lines = [*rows.load_step(), f"port_1, port_2 = {add(valve.connect)}(plant, shown)"]
    given = f"port_1, port_2, length, {add(valve.port_flow)}"
    if rows.program.is_held:
        lines.append(f"gas = {add(pneumatics.end_still_gas)}(plant, begun, {given})")
    else:
        lines.append(f"gas = {add(pneumatics.end_moving_gas)}(plant, begun.gas, {given})")
    lines.append(f"state = {add(motion.with_gas)}(state, gas)")
    if rows.program.angle is not None and not rows.program.is_held:
        lines.append(f"state = {add(motion.with_motion)}(state, begun.next_angle, begun.next_rate)")
    return lines


def end_free(rows: LaneRows) -> list[str]:
    """Where a free vane is at the end."""
    return [f"state = {rows.add(motion.end_free)}(plant, state, begun, length)"]


def judge(rows: LaneRows) -> list[str]:
    """The first time at which a run left what is possible."""
    return [
        f"possible = (abs(state.angular_velocity) < {IMPOSSIBLE_RATE} and min(state.mass_1, state.mass_2) > 0.0 "
        f"and max(state.mass_1, state.mass_2) < {IMPOSSIBLE_MASS})",
        "failed = result.failure_time if possible else min(result.failure_time, time + length)",
        f"x[{rows.state_at['result.failure_time']}, lane] = failed",
    ]
