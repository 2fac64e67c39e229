"""Runs a device on inputs that were recorded: the command, and any parameter that changed during the recording.

Between two changes the lanes run on their own, so that a recording with a constant supply costs only a few calls.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ppafo.control.kind import ProfileKind
from ppafo.engine.lanes import Batch, BatchResult, Floats, LaneBlock, load_program
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths

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
    """No bounds: the next piece may lead anywhere between the stops."""
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
    """Inputs of every step of a run: the command [-], and parameters by path such as ``plant.supply_pressure`` (SI)."""

    command: Floats
    parameters: Mapping[str, Floats]


def led_by_recording(program: Program) -> Program:
    """The program with the vane led along a recorded angle, by the parameters ``path.start``, ``.level``, ``.rate``."""
    return replace(program, angle=RECORDED_ANGLE)


def replay(batch: Batch, inputs: StepInputs) -> BatchResult:
    """Run up to 32 devices on the same recorded inputs; the program must leave the command to the caller."""
    program = batch.program
    block = LaneBlock(load_program(program), batch.clock, batch.parameters, batch.states)
    command_row = _numbered(program.state_rows())[COMMAND]
    numbered = _numbered(program.parameter_rows())
    rows = [numbered[path] for path in inputs.parameters]
    table = np.array([inputs.command, *inputs.parameters.values()])
    starts = _changes(table)
    for start, end in zip(starts, [*starts[1:], batch.clock.step_count], strict=True):
        block.states[command_row] = inputs.command[start]
        if rows:
            block.set_parameters(rows, table[1:, start])
        block.advance(end - start)
    return block.result()


def _changes(table: Floats) -> list[int]:
    """Steps at which any input differs from the step before, the first step among them."""
    changed = (np.diff(table, axis=1) != 0.0).any(axis=0)
    return [0, *(np.flatnonzero(changed) + 1).tolist()]


def _numbered(groups: dict[str, type]) -> dict[str, int]:
    paths = [path for name, row in groups.items() for path in leaf_paths(row, name)]
    return {path: number for number, path in enumerate(paths)}
