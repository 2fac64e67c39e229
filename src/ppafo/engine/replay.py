"""Simulation of devices with recorded inputs: the command and any parameters that vary, step by step.

Between two changes of the inputs a run proceeds without interruption, so that constant inputs cost only a few calls.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ppafo.control.kind import ProfileKind
from ppafo.engine.lane_rows import lanes_of
from ppafo.engine.lanes import Batch, BatchResult, Floats, begin_block, join_results
from ppafo.engine.rows import group_of, leaf_paths, leaves, of_each, row_numbers

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
    """Return initial states (rows, runs) with valves as after earlier commands (steps,), and these (steps, runs).

    For a first one that is not known stands the command that holds the pressures at the start.
    """
    program = batch.program
    delay = batch.clock.command_delay
    states = batch.states.copy()
    valve = program.valve
    kinds = program.parameter_rows()
    # The last ones have not arrived yet.
    arrived = earlier[: max(1, earlier.size - delay)]
    changes = np.flatnonzero(np.diff(arrived)) + 1

    def at_start(own: Any, timing: Any, plant: Any, state: Any) -> tuple[float, Any]:
        pressures = program.actuator.pressures(plant, state.angle, state.mass_1, state.mass_2)
        first = float(arrived[0])
        if math.isnan(first):
            first = 0.0 if valve.command_for is None else valve.command_for(own, 0.0, *pressures)
        begins = (changes - earlier.size + delay + timing.command_lag) * timing.step
        shown = valve.state()
        time = _LONG_AGO
        for command, end in zip([first, *arrived[changes].tolist()], [*begins.tolist(), 0.0], strict=True):
            if time == _LONG_AGO and valve.holding is not None:
                shown = valve.holding(own, command, *pressures)
                time = end
            while time < end:
                settled = valve.settle(own, shown, command, time)
                until = min(end, max(valve.next_event(own, settled, command, time), time + _LEAST_PART))
                _, shown = valve.advance(own, shown, command, time, until - time)
                time = until
        return first, shown

    state_kinds = program.state_rows()
    given = (group_of(name, kinds, batch.parameters) for name in ("valve", "timing", "plant"))
    first, shown = of_each(at_start, *given, group_of("state", state_kinds, states))
    numbers = row_numbers(state_kinds)
    for path, values in zip(leaf_paths(valve.state, "valve_state"), leaves(shown), strict=True):
        states[numbers[path]] = values
    return states, np.where(np.isnan(earlier[:, None]), first, earlier[:, None])
