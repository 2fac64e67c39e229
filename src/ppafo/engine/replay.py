"""Runs a device on inputs that were recorded: the command, and any parameter that changed during the recording.

Between two changes the lanes run on their own, so that a recording with a constant supply costs only a few calls.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ppafo.control.kind import ProfileKind
from ppafo.engine.lane_rows import lanes_of
from ppafo.engine.lanes import Batch, BatchResult, Floats, begin_block, join_results
from ppafo.engine.program import Program
from ppafo.engine.rows import row_numbers

COMMAND = "result.command"


class Segment(NamedTuple):
    """A straight piece of a recorded angle: a time [s], the angle [rad] then, and the angular velocity [rad/s]."""

    start: float
    level: float
    rate: float


def segment_value(segment: Segment, time: float) -> tuple[float, float, float]:
    """Angle [rad], angular velocity [rad/s] and angular acceleration [rad/s^2] at a time [s] on a straight piece."""
    return segment.level + segment.rate * (time - segment.start), segment.rate, 0.0


def segment_bounds(_segment: Segment) -> tuple[float, float]:
    """Bounds [rad] of a segment: none, because the next one may lead anywhere between the stops."""
    return -math.inf, math.inf


RECORDED_ANGLE = ProfileKind(
    name="recorded",
    summary="A recorded angle, straight from sample to sample; its parameters change at every sample.",
    quantities=(),
    parameters=Segment,
    value=segment_value,
    bounds=segment_bounds,
)
"""Not in the catalogue: a scenario file cannot name it, because its values come from a recording."""


@dataclass(frozen=True, slots=True)
class StepInputs:
    """Inputs of every step of a run: the command [-], and parameters by path such as ``plant.supply_pressure`` (SI).

    ``command`` None leaves the command to the controller of the program.
    """

    command: Floats | None
    parameters: Mapping[str, Floats]


def prescribe_recorded_angle(program: Program) -> Program:
    """The program with a recorded angle prescribed, by the parameters ``path.start``, ``.level``, ``.rate``."""
    return replace(program, angle=RECORDED_ANGLE)


def replay(batch: Batch, inputs: StepInputs) -> BatchResult:
    """Run devices on the same recorded inputs; with a command, the program must leave it to the caller."""
    runs = batch.states.shape[1]
    lanes = lanes_of(batch.program)
    blocks = [slice(first, min(first + lanes, runs)) for first in range(0, runs, lanes)]
    return join_results([_replay_block(batch, inputs, block) for block in blocks])


def _replay_block(batch: Batch, inputs: StepInputs, runs: slice) -> BatchResult:
    program, parameters, command = batch.program, inputs.parameters, inputs.command
    block = begin_block(replace(batch, parameters=batch.parameters[:, runs], states=batch.states[:, runs]))
    command_row = row_numbers(program.state_rows())[COMMAND]
    numbered = row_numbers(program.parameter_rows())
    rows = [numbered[path] for path in parameters]
    table = np.array([*parameters.values(), *(() if command is None else (command,))])
    starts = _changes(table)
    for start, end in zip(starts, [*starts[1:], batch.clock.step_count], strict=True):
        if command is not None:
            block.states[command_row] = command[start]
        if rows:
            block.set_parameters(rows, table[: len(rows), start])
        block.advance(end - start)
    return block.result()


def _changes(table: Floats) -> list[int]:
    """Steps at which any input differs from the step before, the first step among them."""
    changed = (np.diff(table, axis=1) != 0.0).any(axis=0)
    return [0, *(np.flatnonzero(changed) + 1).tolist()]
