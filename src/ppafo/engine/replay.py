"""Simulation of devices with recorded inputs: the command and any parameters that vary, step by step.

Between two changes of the inputs a run proceeds without interruption, so that constant inputs cost only a few calls.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ppafo.control.kind import ProfileKind
from ppafo.engine.lane_rows import lanes_of
from ppafo.engine.lanes import Batch, BatchResult, Floats, begin_block, join_results
from ppafo.engine.rows import group_of, leaf_paths, leaves, of_each, row_numbers
from ppafo.engine.step.lane import LaneTiming

COMMAND = "result.command"
"""Path of the present command among the states of a program."""
_LONG_AGO, _LEAST_PART = -1.0e3, 1.0e-9
"""Time since which a first command has stood, and shortest part of a motion of a valve [s]."""


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
    """Commands of the steps before the first (steps,) [-], the first of which has always stood; None without any."""


def replay(batch: Batch, inputs: StepInputs) -> BatchResult:
    """Run the devices of a batch with the same recorded inputs.

    If a command is given, the program must have no controller. Raises KeyError for the path of an unknown parameter.
    """
    runs, lanes = batch.states.shape[1], lanes_of(batch.program)
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
    if inputs.earlier is not None:
        batch = replace(batch, states=_with_valves_after(batch, inputs.earlier))
    for runs_of_block in blocks:
        parameters, states = batch.parameters[:, runs_of_block], batch.states[:, runs_of_block]
        block = begin_block(replace(batch, parameters=parameters, states=states))
        if inputs.earlier is not None:
            block.set_earlier(inputs.earlier)
        for start, end in zip(starts, ends, strict=True):
            if inputs.command is not None:
                block.states[command_row] = inputs.command[start]
            if rows:
                block.set_parameters(rows, table[: len(rows), start])
            block.advance(end - start)
        results.append(block.result())
    return join_results(results)


def _with_valves_after(batch: Batch, earlier: Floats) -> Floats:
    """Return the initial states (rows, runs) of a batch with valves as they are after earlier commands (steps,)."""
    program, delay = batch.program, batch.clock.command_delay
    # The last ones have not arrived yet.
    arrived = earlier[: max(1, earlier.size - delay)]
    changes = np.flatnonzero(np.diff(arrived)) + 1
    commands = arrived[[0, *changes]].tolist()

    def valve_at_start(valve: Any, timing: LaneTiming) -> Any:
        begins = (changes - earlier.size + delay + timing.command_lag) * timing.step
        state, time = program.valve.state(), _LONG_AGO
        for command, end in zip(commands, [*begins.tolist(), 0.0], strict=True):
            while time < end:
                settled = program.valve.settle(valve, state, command, time)
                event = program.valve.next_event(valve, settled, command, time)
                until = min(end, max(event, time + _LEAST_PART))
                _, state = program.valve.advance(valve, state, command, time, until - time)
                time = until
        return state

    groups, states = program.parameter_rows(), batch.states.copy()
    given = (group_of(name, groups, batch.parameters) for name in ("valve", "timing"))
    rows, numbers = row_numbers(program.state_rows()), leaves(of_each(valve_at_start, *given))
    for path, values in zip(leaf_paths(program.valve.state, "valve_state"), numbers, strict=True):
        states[rows[path]] = values
    return states
