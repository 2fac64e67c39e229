"""Devices on recorded inputs: the command and any parameter that changed meanwhile, step by step.

A run goes on its own between two changes, so that a recording with a constant supply costs only a few calls.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.control.kind import ProfileKind
from ppafo.engine.lane_rows import lanes_of
from ppafo.engine.lanes import Batch, BatchResult, begin_block, join_results
from ppafo.engine.rows import row_numbers

Floats = NDArray[np.float64]

COMMAND = "result.command"
"""Path of the command in force among the states of a program."""


class AngleSegment(NamedTuple):
    """A straight piece of a recorded angle: a time [s], the angle [rad] then, and the angular velocity [rad/s]."""

    start: float
    level: float
    rate: float


def segment_value(segment: AngleSegment, time: float) -> tuple[float, float, float]:
    """Angle [rad], angular velocity [rad/s] and angular acceleration [rad/s^2] at a time [s] on a straight piece."""
    return segment.level + segment.rate * (time - segment.start), segment.rate, 0.0


def segment_bounds(_segment: AngleSegment) -> tuple[float, float]:
    """Bounds [rad] of a segment: none, because the next one may lead anywhere between the stops."""
    return -math.inf, math.inf


RECORDED_ANGLE = ProfileKind(
    name="recorded",
    summary="A recorded angle, straight from sample to sample; its parameters change at every sample.",
    quantities=(),
    parameters=AngleSegment,
    value=segment_value,
    bounds=segment_bounds,
)
"""Not in the catalogue: a scenario file cannot name it, because its values come from a recording.

Where it is the angle of a program, its parameters are ``path.start``, ``.level`` and ``.rate``.
"""


@dataclass(frozen=True, slots=True)
class StepInputs:
    """Inputs of every step of a run, which all devices of a batch get alike."""

    command: Floats | None
    """The command of each step (steps,) [-]; None leaves it to the controller of the program."""
    parameters: Mapping[str, Floats]
    """Values of each step (steps,) [SI] by the path of a parameter such as ``plant.supply_pressure``."""


def replay(batch: Batch, inputs: StepInputs) -> BatchResult:
    """Run the devices of a batch on the same recorded inputs.

    With a command, the program must leave it to the caller. KeyError for the path of a parameter that it has not.
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
    for runs_of_block in blocks:
        parameters, states = batch.parameters[:, runs_of_block], batch.states[:, runs_of_block]
        block = begin_block(replace(batch, parameters=parameters, states=states))
        for start, end in zip(starts, ends, strict=True):
            if inputs.command is not None:
                block.states[command_row] = inputs.command[start]
            if rows:
                block.set_parameters(rows, table[: len(rows), start])
            block.advance(end - start)
        results.append(block.result())
    return join_results(results)
