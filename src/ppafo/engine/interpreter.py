"""The step run by Python itself: the same functions (``in_python.py``) over lanes, with the bits of compiled code."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.in_python import GOING_ON, Operations, functions_of
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, numbers, rebuilt
from ppafo.engine.step import loop
from ppafo.engine.step.lane import Lane

Floats = NDArray[np.float64]


class PythonProgram:
    """Pure-Python program with the interface of a compiled one."""

    def __init__(self, program: Program) -> None:
        self._program = program

    def advance(
        self,
        states: Floats,
        parameters: Floats,
        signal_history: Floats,
        command_history: Floats,
        record: Floats,
        trace: Floats,
        *clock: Any,
    ) -> None:
        """Take all runs some steps further."""
        arrays = (signal_history, command_history, record, trace)
        # What was written before Python raised is as it was: the steps are done again from where they began.
        before = [array.copy() for array in arrays[:2]]
        try:
            self._advanced(states, parameters, arrays, clock, None)
        except (ArithmeticError, ValueError):
            for array, kept in zip(arrays, before, strict=False):
                array[:] = kept
            self._advanced(states, parameters, arrays, clock, GOING_ON)

    def _advanced(
        self,
        states: Floats,
        parameters: Floats,
        arrays: tuple[Floats, ...],
        clock: tuple[Any, ...],
        operations: Operations | None,
    ) -> None:
        """Run the loop over steps on lanes made of the rows, and write their states back.

        With ``GOING_ON``, operations that Python refuses give what compiled code gets.
        """
        program = self._program
        lanes = PythonLanes(program, states, parameters, *arrays)
        linked = functions_of(program, lanes, operations)
        parts: Any = linked.parts(program)
        linked.of(loop.advance)(parts, lanes, *clock)
        for number, lane in enumerate(lanes.lanes):
            states[:, number] = lanes.row_of(lane)


class PythonLanes:
    """The runs of a block; while one is gone through, laws of effects find its rows in ``now``."""

    def __init__(
        self,
        program: Program,
        states: Floats,
        parameters: Floats,
        signal_history: Floats,
        command_history: Floats,
        record: Floats,
        trace: Floats,
    ) -> None:
        self.groups, self.records, self.trace = program.state_rows(), record, trace
        self.signal_history, self.command_history = signal_history, command_history
        # Lanes that only fill a vector repeat the last run.
        width = record.shape[2] if record.size else states.shape[1]
        self.lanes = [Lane() for _ in range(width)]
        self.now = self.lanes[0]
        for number, lane in enumerate(self.lanes):
            for groups, table in ((self.groups, states), (program.parameter_rows(), parameters)):
                start = 0
                for name, row in groups.items():
                    count = len(leaf_paths(row, name))
                    lane[name] = rebuilt(row, table[start : start + count, number].tolist()) if count else ()
                    start += count
            lane.trace, lane.command_history = trace[:, :, number], command_history[:, number]
            lane.signal_history = signal_history[:, :, number]

    def __iter__(self) -> Iterator[Lane]:
        """Each run."""
        for lane in self.lanes:
            self.now = lane
            yield lane

    def __getitem__(self, name: str) -> Any:
        """A group of the run that is gone through."""
        return self.now[name]

    def row_of(self, lane: Lane) -> list[float]:
        """The state of a lane as a row has it."""
        return [value for name in self.groups for value in numbers(lane[name])]

    def record(self, index: int) -> None:
        """Keep the state of all runs as a sample."""
        for number, lane in enumerate(self.lanes):
            self.records[index, :, number] = self.row_of(lane)

    def set_aside(self) -> None:
        """Keep what lanes that wait get again: their state, and what the step was handed."""
        for lane in self.lanes:
            names = (*self.groups, "remaining", "held", "carried")
            lane["kept"] = {name: lane[name] for name in names if hasattr(lane, name)}

    def put_back(self) -> None:
        """Give it to those that had nothing left of their step."""
        for lane in self.lanes:
            if not lane["kept"]["remaining"] > 0.0:
                vars(lane).update(lane["kept"] | {"remaining": lane.remaining})

    def traces(self, index: int, trace_every: int) -> bool:
        """Tell whether a sample is traced."""
        return index % trace_every == 0

    def slot(self, index: int, trace_every: int) -> int:
        """Index of a sample in the trace, a ring that keeps the last samples."""
        return index // trace_every % len(self.trace)
