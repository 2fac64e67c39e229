"""Execution of many runs at once: blocks of up to 32 runs, distributed over threads, with reproducible results.

The result of a run does not depend on its block, its position in the block or the number of threads, because all runs
execute the same instructions and are independent.
"""

import copy
import logging
import math
import os
import threading
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

import ppafo.engine.step.loop  # noqa: F401 - its numbers are in the key of a text, whether one is written or not
from ppafo import interrupts
from ppafo.engine.cache import kept_bytes
from ppafo.engine.compilers import Effort
from ppafo.engine.entries import INLINE
from ppafo.engine.groups import Role, check_rows
from ppafo.engine.lane_rows import VECTOR, lanes_of
from ppafo.engine.loading import HOW_TO_INSTALL, compile_together, compiled, compilers_to_try
from ppafo.engine.package_key import package_key
from ppafo.engine.program import Program
from ppafo.engine.source_text import MadeFrom, SourceCollector
from ppafo.engine.step.lane import SAME_MOMENT
from ppafo.progress import report_nothing, time_text

if TYPE_CHECKING:
    from ppafo.engine.interpreter import PythonProgram

logger = logging.getLogger("ppafo")

Floats = NDArray[np.float64]

PYTHON_STEP = 2.0e-4
"""Time [s] that Python needs for one step of one run."""
LONGEST_UNSAID = 120.0
"""Expected duration [s] of a run by Python above which a warning is logged."""

STEPS_PER_CALL = 10_000
"""Steps per call of compiled code: some hundredths of a second, or seconds if each step takes hundreds of parts."""

_BETWEEN_COUNTS = 0.5
"""Time [s] between two counts of the runs that several threads have ended."""

QUICK_STEPS = 200_000
"""Total number of steps of all runs up to which quick compilation is faster overall: a second of either."""

SIGNAL_ROWS = 3
"""Number of readings that may be delayed: angle and both pressures."""
RunnableProgram: TypeAlias = "ModuleType | PythonProgram"
"""Program whose ``advance`` advances a block of runs by some steps: compiled, or run by Python itself."""


@dataclass(frozen=True, slots=True)
class Clock:
    """Step counts shared by all runs of a batch; delays in steps, ``record_every`` 0 records nothing.

    ``record_every`` is the number of steps between recorded samples, an integer unless the program has samples inside
    its steps. Programs with meters record nothing: ``measure_every`` is the number of steps between samples of the
    meters, and the traced channels are stored every ``trace_every`` samples, 0 for never.
    """

    step_count: int
    steps_per_sample: int
    record_every: float
    signal_delay: int
    command_delay: int
    measure_every: float = 0.0
    trace_every: int = 0

    @property
    def samples(self) -> int:
        """Number of recorded or metered samples, ends included."""
        interval = self.record_every or self.measure_every
        return samples_in(self.step_count, interval) if interval else 0


def samples_in(steps: int, interval: float) -> int:
    """Number of samples at intervals of ``interval`` steps [-] from step 0 to ``steps``, ends included."""
    return math.floor((steps + SAME_MOMENT) / interval) + 1


@dataclass(frozen=True, slots=True)
class Batch:
    """Runs of one program with one clock: parameters (rows, runs) and initial states (rows, runs)."""

    program: Program
    clock: Clock
    parameters: Floats
    states: Floats


@dataclass(frozen=True, slots=True)
class BatchResult:
    """Final states (rows, runs) and records (records, rows, runs), from time 0 to the end.

    The records of a program with meters are its traces, with a row for each traced channel.
    """

    states: Floats
    record: Floats


Count: TypeAlias = Callable[[int], object]
"""Callback from the calling thread with the number of runs that have ended since the last call."""


def effort_for(batch: Batch) -> Effort:
    """Return the optimisation level with the shortest total time for a batch whose program is not yet compiled."""
    is_short = batch.states.shape[1] * batch.clock.step_count <= QUICK_STEPS
    return Effort.QUICK if is_short else Effort.FULL


def load_program(program: Program, effort: Effort = Effort.FULL) -> RunnableProgram:
    """Return the compiled module of a program, from the cache if possible, or its pure-Python equivalent.

    The text is regenerated if a number or function used in it has changed. The text is also generated if Python runs
    the program, so that code which cannot be compiled is refused with the same message on every computer.
    """
    module = compiled(current_source("lanes", program, write_source), effort)
    if module is not None:
        return module
    from ppafo.engine.interpreter import PythonProgram  # most computers have a compiler

    return PythonProgram(program)


def load_programs(programs: Iterable[tuple[Program, Effort]]) -> None:
    """Load programs with their optimisation levels; missing programs are announced and compiled together."""
    different = dict.fromkeys(programs)
    compilers = compilers_to_try() if len(different) > 1 else ()
    if compilers:
        sources = [(current_source("lanes", program, write_source), effort) for program, effort in different]
        compile_together(sources, compilers[0])


def current_source(kind: str, parts: Any, write: Any) -> str:
    """Return the source of some parts from the function ``write``, which has a cache; regenerated if out of date.

    ``kind`` is the beginning of its file name in the cache folder.
    """
    made_from, source = _known_source(kind, parts, write)
    # It may rest on a number or function that a session has changed since.
    if made_from.is_current():
        return source
    _known_source.cache_clear()
    write.cache_clear()
    return _known_source(kind, parts, write)[1]


@lru_cache(maxsize=64)
def _known_source(kind: str, parts: Any, write: Any) -> tuple[MadeFrom, str]:
    """Return the inputs of some parts and their source text, from the cache or newly written."""
    key = package_key(parts)
    if key is None:
        known: tuple[MadeFrom, str] = write(parts)
        return known

    def written() -> bytes:
        source: str = write(parts)[1]
        return source.encode()

    return key.made_from, kept_bytes(kind, key.words, written).decode()


@lru_cache(maxsize=64)
def write_source(program: Program, lanes: int = 0) -> tuple[MadeFrom, str]:
    """Return inputs and source text of a program for ``lanes`` runs side by side; 0 for as many runs as fit."""
    from ppafo.engine.loop_text import write_lanes  # a kept program needs no writer

    collector = SourceCollector(INLINE)
    source = write_lanes(program, collector, lanes)
    return collector.made_from, source


def run_batch(batch: Batch, threads: int | None = None) -> BatchResult:
    """Run a batch on ``threads`` threads (all cores by default)."""
    results: dict[int, BatchResult] = {}

    def keep(runs: slice, result: BatchResult) -> None:
        results[runs.start] = result

    run_blocks(batch, keep, threads)
    return join_results([results[start] for start in sorted(results)])


def run_blocks(
    batch: Batch,
    take: Callable[[slice, BatchResult], None],
    threads: int | None = None,
    effort: Effort = Effort.FULL,
    count: Count = report_nothing,
) -> None:
    """Run a batch block by block on ``threads`` threads (all cores by default), and pass on each result immediately.

    ``take(runs, result)`` is called from several threads. ``effort`` is the optimisation level if the program is not
    yet compiled.
    """
    module = load_program(batch.program, effort)
    runs: int = batch.states.shape[1]
    lanes = lanes_of(batch.program)
    starts = range(0, runs, lanes)
    workers = 1 if len(starts) == 1 else min(len(starts), threads or os.cpu_count() or 1)
    if not isinstance(module, ModuleType):
        workers = 1  # threads of Python take turns
        seconds = runs * batch.clock.step_count * PYTHON_STEP
        if seconds > LONGEST_UNSAID:
            slow = "ppafo: Python runs these models in about %s; compiled models take seconds: %s"
            logger.warning(slow, time_text(seconds), HOW_TO_INSTALL)

    # One iterator for all threads: a range iterator hands each start to one of them.
    waiting = iter(starts)
    stop = threading.Event()
    ended: list[int] = []

    def work() -> None:
        steps = batch.clock.step_count
        for start in waiting:
            members = slice(start, min(start + lanes, runs))
            parameters = batch.parameters[:, members]
            states = batch.states[:, members]
            block = LaneBlock(module, batch.program, batch.clock, parameters, states)
            for first_step in range(0, steps, STEPS_PER_CALL):
                if stop.is_set():
                    return
                # An interrupt is seen between two calls only: compiled code cannot be stopped.
                interrupts.check()
                block.advance(min(STEPS_PER_CALL, steps - first_step))
            if stop.is_set():
                return
            take(members, block.result())
            ended.append(members.stop - members.start)
            if workers == 1:
                count(ended.pop())

    # One block needs no pool of threads, and an interrupt reaches it at once.
    if workers == 1:
        work()
        return
    from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait

    with ThreadPoolExecutor(workers) as pool:
        try:
            working = [pool.submit(work) for _ in range(workers)]
            is_busy = True
            while is_busy:
                is_busy = bool(wait(working, _BETWEEN_COUNTS, FIRST_EXCEPTION).not_done)
                # The error of one worker is raised at once, and ends the others.
                for worker in filter(Future.done, working):
                    worker.result()
                count(sum(ended.pop() for _ in range(len(ended))))
        finally:
            stop.set()


def join_results(results: Sequence[BatchResult]) -> BatchResult:
    """Return the concatenated results of consecutive blocks."""
    if len(results) == 1:
        return results[0]
    states = np.concatenate([result.states for result in results], axis=1)
    return BatchResult(states, np.concatenate([result.record for result in results], axis=2))


class LaneBlock:
    """Block of runs in progress; ``states`` (rows, runs) may be read and modified between calls of ``advance``."""

    def __init__(
        self, module: RunnableProgram, program: Program, clock: Clock, parameters: Floats, states: Floats
    ) -> None:
        check_rows(len(parameters), program.parameter_rows(), Role.PARAMETER)
        check_rows(len(states), program.state_rows(), Role.STATE)
        self._module = module
        self._clock = clock
        self._width = states.shape[1]
        self._next_step = 0
        self._parameters = _pad_columns(parameters)
        self.states = _pad_columns(states)
        records = clock.samples if clock.record_every else 0
        self._record = np.empty((records, states.shape[0], self._width))
        traces = (clock.samples - 1) // clock.trace_every + 1 if clock.trace_every else 0
        self._trace = np.empty((traces, len(program.traced), self.states.shape[1]))
        # Two slots more than the delay: the present step, and the one that is being written.
        self._signals = np.zeros((SIGNAL_ROWS, clock.signal_delay + 2, self.states.shape[1]))
        self._commands = np.zeros((clock.command_delay + 2, self.states.shape[1]))

    def __deepcopy__(self, memo: dict[int, Any]) -> "LaneBlock":
        """Return an independent copy of the block in its present state; the compiled program is shared."""
        other = copy.copy(self)
        for name, value in vars(self).items():
            if isinstance(value, np.ndarray):
                setattr(other, name, value.copy())
        memo[id(self)] = other
        return other

    def advance(self, step_count: int) -> None:
        """Advance all runs by ``step_count`` steps."""
        clock = self._clock
        interval = float(clock.record_every or clock.measure_every)
        # Samples before this step are taken; one that lies on it to rounding is still to come.
        taken = math.ceil((self._next_step - SAME_MOMENT) / interval) if interval else 0
        # In the order of ``lane_rows.LOOP``: compiled code takes no names.
        self._module.advance(
            self.states,
            self._parameters,
            self._signals,
            self._commands,
            self._record,
            self._trace,
            self._next_step,
            step_count,
            clock.step_count,
            clock.steps_per_sample,
            interval,
            clock.samples - 1,
            max(0, taken),
            clock.trace_every,
            clock.signal_delay,
            clock.command_delay,
        )
        self._next_step += step_count

    def set_parameters(self, rows: Sequence[int], values: Floats) -> None:
        """Change some parameters of all runs from the next step on; ``rows`` as in ``Program.parameter_rows``."""
        self._parameters[rows] = values[:, None]

    def set_earlier(self, commands: Floats) -> None:
        """Set the commands of the steps (steps, runs) before the first step; the first of them has always stood."""
        count = len(self._commands) - 1
        self._commands[1:] = np.pad(_pad_columns(commands), ((count, 0), (0, 0)), "edge")[-count:]

    def late_signals(self, step: int) -> Floats:
        """Angle [rad] and pressures [Pa] (3, runs) of delayed sensors at ``step``, the next step, except the first."""
        return self._signals[:, (step - self._clock.signal_delay) % self._signals.shape[1]]

    def result(self) -> BatchResult:
        """Return the present states and records."""
        record = self._trace[:, :, : self._width] if self._clock.trace_every else self._record
        return BatchResult(self.states[:, : self._width].copy(), record)


def begin_block(batch: Batch, effort: Effort = Effort.FULL) -> LaneBlock:
    """Return a block with all runs of a batch before the first step; ValueError for more runs than a block can take."""
    runs = batch.states.shape[1]
    lanes = lanes_of(batch.program)
    if runs > lanes:
        raise ValueError(f"a block has {lanes} lanes, one for each run, too few for {runs} runs")
    module = load_program(batch.program, effort)
    return LaneBlock(module, batch.program, batch.clock, batch.parameters, batch.states)


def _pad_columns(columns: Floats) -> Floats:
    """Return a contiguous copy with a multiple of the vector width as columns; the last column is repeated."""
    rows, width = columns.shape
    padded = np.empty((rows, width + -width % VECTOR))
    padded[:, :width] = columns
    # Lanes that nobody asked for repeat the last run: zeros could fail, and be slow, in the physics.
    padded[:, width:] = columns[:, -1:]
    return padded
