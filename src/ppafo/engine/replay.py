"""Simulation of devices with recorded inputs: the command and any parameters that vary, step by step.

Between two changes of the inputs a run proceeds without interruption, so that constant inputs cost only a few calls.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ppafo.control.kind import ProfileKind
from ppafo.engine.in_python import functions_of
from ppafo.engine.lane_rows import lanes_of
from ppafo.engine.lanes import Batch, BatchResult, Floats, begin_block, join_results
from ppafo.engine.rows import group_of, leaves, of_each, row_numbers
from ppafo.model.ports import at_valve

COMMAND = "result.command"
"""Path of the present command among the states of a program."""
# Time since which a first command has stood, and shortest part of a motion of a valve [s].
_LONG_AGO = -1.0e3
_LEAST_PART = 1.0e-9


class AngleSegment(NamedTuple):
    """Linear segment of a recorded angle: start time [s], angle at the start [rad], and angular velocity [rad/s]."""

    start: float
    level: float
    rate: float


def segment_value(segment: AngleSegment, time: float) -> tuple[float, float, float]:
    """Angle [rad], angular velocity [rad/s] and angular acceleration [rad/s^2] on a linear segment at a time [s]."""
    return segment.level + segment.rate * (time - segment.start), segment.rate, 0.0


RECORDED_ANGLE = ProfileKind(
    name="recorded",
    summary="A recorded angle, straight from sample to sample; its parameters change at every sample.",
    quantities=(),
    parameters=AngleSegment,
    value=segment_value,
)
"""Profile outside the catalogue: a scenario file cannot name it, because its values come from a recording.

If it prescribes the angle of a program, its parameters are ``path.start``, ``.level`` and ``.rate``.
"""


@dataclass(frozen=True, slots=True)
class StepInputs:
    """Inputs of every step of a run, identical for all devices of a batch."""

    command: Floats | None
    """Command of each step (steps,) [-]; None leaves the command to the controller of the program."""
    parameters: Mapping[str, Floats]
    """Values of each step (steps,) [SI] by the path of a parameter such as ``plant.supply_pressure``."""
    earlier: Floats | None = None
    """Commands of the steps before the first (steps,) [-], the first of which has always stood; None without any.

    A first one that is not a number stands for the command that holds the pressures at the start, 0 of most valves.
    """


def replay(batch: Batch, inputs: StepInputs) -> BatchResult:
    """Run the devices of a batch with the same recorded inputs.

    If a command is given, the program must have no controller. Raises KeyError for the path of an unknown parameter.
    """
    runs = batch.states.shape[1]
    lanes = lanes_of(batch.program)
    blocks = [slice(first, min(first + lanes, runs)) for first in range(0, runs, lanes)]
    command_row = row_numbers(batch.program.state_rows())[COMMAND]
    parameter_rows = row_numbers(batch.program.parameter_rows())
    rows = [parameter_rows[path] for path in inputs.parameters]
    commands = [] if inputs.command is None else [inputs.command]
    table = np.array([*inputs.parameters.values(), *commands])
    # Steps at which any input differs from the step before, the first step among them.
    starts = [0, *(np.flatnonzero((np.diff(table, axis=1) != 0.0).any(axis=0)) + 1).tolist()]
    ends = [*starts[1:], batch.clock.step_count]
    results = []
    before = None
    if inputs.earlier is not None:
        states, before = _started(batch, inputs.earlier)
        batch = replace(batch, states=states)
    for runs_of_block in blocks:
        parameters = batch.parameters[:, runs_of_block]
        states = batch.states[:, runs_of_block]
        block = begin_block(replace(batch, parameters=parameters, states=states))
        if before is not None:
            block.set_earlier(before[:, runs_of_block])
        for start, end in zip(starts, ends, strict=True):
            if inputs.command is not None:
                block.states[command_row] = inputs.command[start]
            if rows:
                block.set_parameters(rows, table[: len(rows), start])
            block.advance(end - start)
        results.append(block.result())
    return join_results(results)


def _started(batch: Batch, earlier: Floats) -> tuple[Floats, Floats]:
    """Return initial states (rows, runs) with valves and effects as after earlier commands (steps,), and these.

    The commands (steps, runs) have for a first one that is not known that which holds the pressures at the start.
    """
    program = batch.program
    delay = batch.clock.command_delay
    valve = program.valve
    states = batch.states.copy()
    # The last ones have not arrived yet.
    arrived = earlier[: max(1, earlier.size - delay)]
    changes = np.flatnonzero(np.diff(arrived)) + 1
    rows_at_start = dict[str, Any]()
    # Laws of effects act on commands and in the valve, as in a step.
    linked = functions_of(program, rows_at_start)
    at_port, settle, next_event, advance = map(linked.of, (at_valve, valve.settle, valve.next_event, valve.advance))

    def at_start(rows: Mapping[str, Any]) -> tuple[Any, ...]:
        rows_at_start.update(rows)
        timing = rows["timing"]
        state = rows["state"]
        parameters = rows["valve"]
        pressures = program.actuator.pressures(rows["plant"], state.angle, state.mass_1, state.mass_2)
        first = float(arrived[0])
        if math.isnan(first):
            first = 0.0 if valve.command_for is None else valve.command_for(parameters, 0.0, *pressures)
        begins = (changes - earlier.size + delay + timing.command_lag) * timing.step
        valve_state = valve.state()
        time = _LONG_AGO
        for command, end in zip([first, *arrived[changes].tolist()], [*begins.tolist(), 0.0], strict=True):
            for name, kind in program.stated.items():
                if kind.settle is not None:
                    before = rows_at_start[f"{name}_state"]
                    rows_at_start[f"{name}_state"] = kind.settle(rows[name], before, command)
            asked = at_port(command)
            if time == _LONG_AGO and valve.holding is not None:
                valve_state = valve.holding(parameters, asked, *pressures)
                time = end
            while time < end:
                settled = settle(parameters, valve_state, asked, time)
                event = next_event(parameters, settled, asked, time)
                until = min(end, max(event, time + _LEAST_PART))
                _, valve_state = advance(parameters, valve_state, asked, time, until - time)
                time = until
        return first, valve_state, *(rows_at_start[name] for name in program.effect_states)

    tables = (program.parameter_rows(), batch.parameters), (program.state_rows(), states)
    first, *begun = of_each(at_start, {name: group_of(name, *table) for table in tables for name in table[0]})
    kinds = {"valve_state": valve.state, **program.effect_states}
    numbers = row_numbers(program.state_rows())
    for path, values in zip(row_numbers(kinds), leaves(begun), strict=True):
        states[numbers[path]] = values
    return states, np.where(np.isnan(earlier[:, None]), first, earlier[:, None])
