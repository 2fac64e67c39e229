"""Execution of steps by Python: the functions of ``in_python.py`` over many runs, bit-identical to compiled code."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from ppafo.engine.in_python import WITHOUT_EXCEPTIONS, Operations, functions_of
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, numbers, rebuilt
from ppafo.engine.step import loop
from ppafo.engine.step.lane import Lane
from ppafo.signals.recording import Floats


class PythonProgram:
    """Pure-Python program with the interface of a compiled one."""

    def __init__(self, program: Program) -> None:
        self._program = program

    def advance(self, states: Floats, parameters: Floats, *arrays_and_clock: Any) -> None:
        """Advance all runs by some steps; arrays of histories and samples precede the numbers of the clock."""
        program = self._program
        histories = arrays_and_clock[:4]
        clock = arrays_and_clock[4:]
        tables = (program.state_rows(), states), (program.parameter_rows(), parameters)

        def run(operations: Operations | None) -> None:
            lanes = PythonLanes(tables, *histories)
            linked = functions_of(program, lanes, operations)
            parts: Any = linked.parts(program)
            linked.of(loop.advance)(parts, lanes, *clock)
            for groups, table in tables:
                for number, lane in enumerate(lanes.lanes):
                    table[:, number] = _numbers_of(lane, groups)

        # Python may raise after some values were written: they are restored, and all is done again from the start.
        before = [array.copy() for array in histories[:2]]
        try:
            run(None)
        except (ArithmeticError, ValueError):
            for array, kept in zip(histories, before, strict=False):
                array[:] = kept
            # Operations that Python refuses give what compiled code gets.
            run(WITHOUT_EXCEPTIONS)


def _numbers_of(lane: Lane, groups: Iterable[str]) -> list[float]:
    return [value for name in groups for value in numbers(lane[name])]


class PythonLanes:
    """Runs of a block; during iteration, laws of effects find the rows of the present run in ``now``.

    Each of the ``tables`` has groups by name, and the array (numbers, runs) of their numbers.
    """

    def __init__(
        self,
        tables: Sequence[tuple[Mapping[str, Any], Floats]],
        signal_history: Floats,
        command_history: Floats,
        record: Floats,
        trace: Floats,
    ) -> None:
        self.groups, states = tables[0]
        self.records = record
        self.trace = trace
        self.signal_history = signal_history
        self.command_history = command_history
        # Lanes that only fill a vector repeat the last run.
        width = record.shape[2] if record.size else states.shape[1]
        self.lanes = [Lane() for _ in range(width)]
        self.now = self.lanes[0]
        for number, lane in enumerate(self.lanes):
            for groups, table in tables:
                start = 0
                for name, row in groups.items():
                    count = len(leaf_paths(row, name))
                    lane[name] = rebuilt(row, table[start : start + count, number].tolist()) if count else ()
                    start += count
            if trace.size:
                lane.trace = trace[:, :, number]
            if command_history.size:
                lane.command_history = command_history[:, number]
            lane.signal_history = signal_history[:, :, number]

    def __iter__(self) -> Iterator[Lane]:
        """Iterate over the runs."""
        for lane in self.lanes:
            self.now = lane
            yield lane

    def __getitem__(self, name: str) -> Any:
        """Return a group of the present run."""
        return self.now[name]

    def record(self, index: int) -> None:
        """Store the state of all runs as a recorded sample."""
        for number, lane in enumerate(self.lanes):
            self.records[index, :, number] = _numbers_of(lane, self.groups)

    def set_aside(self) -> None:
        """Save the data of waiting runs: their state, and the values passed from the previous step."""
        for lane in self.lanes:
            names = (*self.groups, "remaining", "held", "carried")
            lane["kept"] = {name: lane[name] for name in names if hasattr(lane, name)}

    def put_back(self) -> None:
        """Restore the saved data of runs whose step was already complete."""
        for lane in self.lanes:
            if not lane["kept"]["remaining"] > 0.0:
                vars(lane).update(lane["kept"] | {"remaining": lane.remaining})

    def traces(self, index: int, trace_every: int) -> bool:
        """Return whether a sample is traced."""
        return index % trace_every == 0

    def slot(self, index: int, trace_every: int) -> int:
        """Return the index of a sample in the trace, a ring buffer of the last samples."""
        return index // trace_every % len(self.trace)
