"""Writes the source of the lane loop of one program: loads, calls and stores, with the rows as literals."""

from collections.abc import Callable
from typing import Any

from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, row_expression
from ppafo.engine.scheme import motion, pneumatics
from ppafo.engine.source_text import SourceCollector
from ppafo.model.plant import chamber_pressures
from ppafo.model.sensors import Measurement, measure
from ppafo.model.vane import actuator_torque

LANES = 32
IMPOSSIBLE_RATE = 1.0e6
IMPOSSIBLE_MASS = 1.0e3

HEADER = '''"""Generated from the functions of ppafo; their hash is in the file name. Not to be edited."""

import math
from collections import namedtuple

import numpy as np
from numba import njit

FAST = {"reassoc", "contract", "arcp", "nsz", "afn"}
'''
INLINE = '@njit(forceinline=True, fastmath=FAST, error_model="numpy")'
SIGNATURE = (
    '"void(float64[:, ::1], float64[:, ::1], float64[:, :, ::1], float64[:, ::1], float64[:, :, ::1], '
    'int64, int64, int64, int64, int64, int64)"'
)
COMPILED = f'@njit({SIGNATURE}, cache=True, nogil=True, fastmath=FAST, error_model="numpy")'
ARGUMENTS = (
    "states, parameters, signal_history, command_history, record, "
    "first_step, step_count, steps_per_sample, record_every, signal_delay, command_delay"
)


def lane_source(program: Program) -> str:
    """Source text of the module whose ``advance`` runs one block of this program."""
    collector = SourceCollector(INLINE)
    writer = _Writer(program, collector)
    control = writer.control_loop()
    plant = writer.plant_loop()
    body = [
        COMPILED,
        f"def advance({ARGUMENTS}):",
        *_indent(
            [
                f"x = np.empty(({writer.state_count}, {LANES}))",
                f"p = np.empty(({writer.parameter_count}, {LANES}))",
                f"t = np.empty(({writer.step_row_count}, {LANES}))",
                f"lengths = np.empty((3, {LANES}))",
                "width = states.shape[1]",
                *_copy("x", "states", writer.state_count),
                *_copy("p", "parameters", writer.parameter_count),
                "for step_index in range(first_step, first_step + step_count):",
                *_indent([*writer.remember_signals(), *control, *RECORD, *writer.remember_commands(), *plant]),
                *_copy("states", "x", writer.state_count),
            ]
        ),
    ]
    return f"{HEADER}\n\n{collector.text()}\n\n\n" + "\n".join(body) + "\n"


RECORD = [
    "if record_every > 0 and step_index % record_every == 0:",
    "    for row in range(record.shape[1]):",
    "        for lane in range(record.shape[2]):",
    "            record[step_index // record_every, row, lane] = x[row, lane]",
]


SKIP_EMPTY = [
    "longest = 0.0",
    "for lane in range(width):",
    "    longest = max(longest, lengths[part, lane])",
    "if longest == 0.0:",
    "    break",
]


def _indent(lines: list[str], levels: int = 1) -> list[str]:
    return ["    " * levels + line for line in lines]


def _copy(target: str, source: str, rows: int) -> list[str]:
    return [
        f"for row in range({rows}):",
        "    for lane in range(width):",
        f"        {target}[row, lane] = {source}[row, lane]",
    ]


class _Writer:
    """Knows the rows of one program and writes the loops over the lanes."""

    def __init__(self, program: Program, collector: SourceCollector) -> None:
        self.program = program
        self.collector = collector
        self.parameter_at = _row_numbers(program.parameter_rows())
        self.state_at = _row_numbers(program.state_rows())
        self.parameter_count = len(self.parameter_at)
        self.state_count = len(self.state_at)
        self.cells = {path: f"p[{row}, lane]" for path, row in self.parameter_at.items()}
        self.cells |= {path: f"x[{row}, lane]" for path, row in self.state_at.items()}
        step_at = _row_numbers(program.step_rows())
        self.step_row_count = len(step_at)
        self.cells |= {path: f"t[{row}, lane]" for path, row in step_at.items()}

    def control_loop(self) -> list[str]:
        """Sense and control, at every sample; nothing where the caller sets the command."""
        controller = self.program.controller
        if controller is None:
            return []
        groups = ("timing", "plant", "state", "controller", "controller_state", "reference")
        lines = [
            *[self.load(group) for group in groups],
            *self.sense(),
            f"wanted = {self.collector.add(self.program.reference.value)}(reference, step_index * timing.step)[0]",
            f"command, controller_state = {self.collector.add(controller.update)}"
            "(controller, controller_state, wanted, seen, timing.period)",
            *self.store("controller_state"),
            f"x[{self.state_at['result.command']}, lane] = command",
        ]
        loop = ["for lane in range(width):", *_indent(lines)]
        return ["if step_index % steps_per_sample == 0:", *_indent(loop)]

    def sense(self) -> list[str]:
        """Lines that make the measurement ``seen``."""
        if not self.program.ideal_sensors:
            sense = self.collector.add(measure)
            return [
                self.load("sensors"),
                "depth = signal_history.shape[1]",
                "late = (step_index - signal_delay) % depth",
                "later = (step_index - signal_delay - 1) % depth",
                *[
                    f"{name} = signal_history[{row}, late, lane] + timing.signal_lag * "
                    f"(signal_history[{row}, later, lane] - signal_history[{row}, late, lane])"
                    for row, name in enumerate(("angle", "pressure_1", "pressure_2"))
                ],
                f"seen = {sense}(sensors, angle, pressure_1, pressure_2, plant.torque_constant, "
                "step_index // steps_per_sample)",
            ]
        return [
            f"pressure_1, pressure_2 = {self.collector.add(chamber_pressures)}"
            "(plant, state.angle, state.mass_1, state.mass_2)",
            f"torque = {self.collector.add(actuator_torque)}(pressure_1, pressure_2, plant.torque_constant)",
            f"seen = {self.collector.add(Measurement)}(state.angle, pressure_1, pressure_2, torque)",
        ]

    def remember_signals(self) -> list[str]:
        """Keeps the signals of every step, where they are seen late."""
        if self.program.ideal_sensors or self.program.controller is None:
            return []
        lines = [
            self.load("plant"),
            self.load("state"),
            f"pressure_1, pressure_2 = {self.collector.add(chamber_pressures)}"
            "(plant, state.angle, state.mass_1, state.mass_2)",
            "signal_history[0, step_index % signal_history.shape[1], lane] = state.angle",
            "signal_history[1, step_index % signal_history.shape[1], lane] = pressure_1",
            "signal_history[2, step_index % signal_history.shape[1], lane] = pressure_2",
        ]
        before_start = [
            "if step_index == 0:",
            "    for slot in range(1, signal_history.shape[1]):",
            "        signal_history[:, slot, :] = signal_history[:, 0, :]",
        ]
        return ["for lane in range(width):", *_indent(lines), *before_start]

    def remember_commands(self) -> list[str]:
        """Keeps the command of every step, where the valve gets it late."""
        if not self.program.late_commands:
            return []
        lines = [
            "command_history[step_index % command_history.shape[0], lane] = "
            f"x[{self.state_at['result.command']}, lane]",
        ]
        return ["for lane in range(width):", *_indent(lines)]

    def plant_loop(self) -> list[str]:
        """Valve, gas and vane, one step: whole, or in parts where something changes abruptly inside it."""
        if self.program.late_commands:
            return self.late_loop()
        if self.program.valve.cuts is not None:
            return self.cut_loop(self.program.valve.cuts)
        return self.part([*self.opening(), "length = timing.step"])

    def opening(self) -> list[str]:
        """Lines that load what a step needs."""
        names = ("timing", "plant", "valve", "result", "state", "valve_state")
        return [*[self.load(name) for name in names], "time = step_index * timing.step", "command = result.command"]

    def cut_loop(self, cuts: Callable[..., Any]) -> list[str]:
        """Three parts, between the switchings of the valve; parts that no lane needs are passed over."""
        cut = [
            f"first, second = {self.collector.add(cuts)}(valve, valve_state, command, time, timing.step)",
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
            "for lane in range(width):",
            *_indent([*self.opening(), *cut]),
            "for part in range(3):",
            *_indent(SKIP_EMPTY),
            *_indent(self.part([*self.opening(), *begin])),
        ]

    def late_loop(self) -> list[str]:
        """Two parts, before and after a late command arrives; the first is passed over where no lane has it."""
        lag = f"p[{self.parameter_at['timing.command_lag']}, lane] * p[{self.parameter_at['timing.step']}, lane]"
        before = [
            *self.opening(),
            self.load("early_valve"),
            "valve = early_valve",
            "length = lengths[part, lane]",
            "command = command_history[(step_index - command_delay - 1) % command_history.shape[0], lane]",
        ]
        after = [
            *self.opening(),
            "time += timing.command_lag * timing.step",
            "length = timing.step - timing.command_lag * timing.step",
            "command = command_history[(step_index - command_delay) % command_history.shape[0], lane]",
        ]
        return [
            "for lane in range(width):",
            f"    lengths[0, lane] = {lag}",
            "for part in range(1):",
            *_indent(SKIP_EMPTY),
            *_indent(self.part(before)),
            *self.part(after),
        ]

    def part(self, prelude: list[str]) -> list[str]:
        """Valve, gas and vane over ``length`` [s] from ``time`` [s], both set by ``prelude``.

        Each phase is a loop of its own: loops this short let the processor work on several lanes at once.
        """
        phases = [[*self.begin(), *self.keep(), *self.store("valve_state")], [*self.feed(), *self.store("state")]]
        if self.program.angle is None:
            phases.append([*self.load_step(), *self.end_free(), *self.store("state")])
        phases[-1] += self.judge()
        return [line for phase in phases for line in ("for lane in range(width):", *_indent([*prelude, *phase]))]

    def begin(self) -> list[str]:
        """The valve, and the first stage of the step."""
        valve, add = self.program.valve, self.collector.add
        lines = [
            f"shown, valve_state = {add(valve.advance)}(valve, valve_state, command, time, length)",
            f"port_1, port_2 = {add(valve.connect)}(plant, shown)",
        ]
        given = f"port_1, port_2, length, {add(valve.port_flow_slopes)}"
        if self.program.angle is None:
            return [*lines, f"begun = {add(motion.begin_free)}(plant, state, {given})"]
        if self.program.is_held:
            return [*lines, f"begun = {add(pneumatics.begin_still_gas)}(plant, state, {given})"]
        return [
            *lines,
            self.load("path"),
            f"next_angle, next_rate, _ = {add(self.program.angle.value)}(path, time + length)",
            f"begun = {add(motion.begin_led)}(plant, state, next_angle, next_rate, {given})",
        ]

    def feed(self) -> list[str]:
        """The second stage: the gas of the step, and where a led vane is at its end."""
        valve, add = self.program.valve, self.collector.add
        lines = [*self.load_step(), f"port_1, port_2 = {add(valve.connect)}(plant, shown)"]
        given = f"port_1, port_2, length, {add(valve.port_flow)}"
        if self.program.is_held:
            lines.append(f"gas = {add(pneumatics.end_still_gas)}(plant, begun, {given})")
        else:
            lines.append(f"gas = {add(pneumatics.end_moving_gas)}(plant, begun.gas, {given})")
        lines.append(f"state = {add(motion.with_gas)}(state, gas)")
        if self.program.angle is not None and not self.program.is_held:
            lines.append(f"state = {add(motion.with_motion)}(state, begun.next_angle, begun.next_rate)")
        return lines

    def end_free(self) -> list[str]:
        """Where a free vane is at the end."""
        return [f"state = {self.collector.add(motion.end_free)}(plant, state, begun, length)"]

    def judge(self) -> list[str]:
        """The first time at which a run left what is possible."""
        return [
            f"possible = (abs(state.angular_velocity) < {IMPOSSIBLE_RATE} and min(state.mass_1, state.mass_2) > 0.0 "
            f"and max(state.mass_1, state.mass_2) < {IMPOSSIBLE_MASS})",
            "failed = result.failure_time if possible else min(result.failure_time, time + length)",
            f"x[{self.state_at['result.failure_time']}, lane] = failed",
        ]

    def keep(self) -> list[str]:
        """Lines that keep what the first stage hands on."""
        groups = self.program.step_rows().items()
        return [f"{self.cells[path]} = {path}" for name, row in groups for path in leaf_paths(row, name)]

    def load_step(self) -> list[str]:
        """Lines that load what the first stage handed on."""
        return [self.load(name) for name in self.program.step_rows()]

    def load(self, group: str) -> str:
        """Line that makes the NamedTuple ``group`` from its rows."""
        groups = self.program.parameter_rows() | self.program.state_rows() | self.program.step_rows()
        row = groups[group]
        return f"{group} = {row_expression(row, group, self.cells, self.collector.add)}"

    def store(self, group: str) -> list[str]:
        """Lines that write the NamedTuple ``group`` back to its rows."""
        paths = leaf_paths(self.program.state_rows()[group], group)
        return [f"x[{self.state_at[path]}, lane] = {path}" for path in paths]


def _row_numbers(groups: dict[str, type]) -> dict[str, int]:
    paths = [path for name, row in groups.items() for path in leaf_paths(row, name)]
    return {path: number for number, path in enumerate(paths)}
