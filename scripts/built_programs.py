"""Programs built from C by a compiler and flags of one's own, and run on one thread: for tests of bits."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import ModuleType

from ppafo.engine.compilers import FLAGS
from ppafo.engine.entries import INLINE, entry_text
from ppafo.engine.lane_rows import LOOP, lanes_of
from ppafo.engine.lanes import Batch, BatchResult, LaneBlock, join_results
from ppafo.engine.loop_text import write_lanes
from ppafo.engine.program import Program
from ppafo.engine.source_text import SourceCollector
from ppafo.translation.c99 import c_source, documents_of
from ppafo.translation.compiling import compile_library
from ppafo.translation.native import LIBRARY_FILE
from ppafo.translation.native_entries import Parameters, fill_module, parameters_of
from ppafo.translation.native_source import with_packed_entries
from ppafo.translation.walk import walk_module

_LANE_LOOP = parameters_of(entry_text("advance", LOOP, ()))


def program_source(program: Program) -> str:
    """C of a program, whose function ``advance`` advances a block of runs. ProgramError for code without C."""
    collector = SourceCollector(INLINE)
    return translated(write_lanes(program, collector), collector)


def translated(composed: str, collector: SourceCollector) -> str:
    """C of a composed module whose definitions are in ``collector``."""
    return c_source(walk_module(composed), documents_of(collector), "Generated from the functions of ppafo.")


def build(
    source: str,
    folder: Path,
    command: Sequence[str] = ("gcc",),
    flags: Sequence[str] = FLAGS,
    parameters: Mapping[str, Parameters] = _LANE_LOOP,
) -> ModuleType:
    """Compile C into a library in ``folder`` and load its entries, by default the ``advance`` of a lane loop.

    CompilerError where the compiler refuses it.
    """
    library = folder / LIBRARY_FILE
    compile_library(with_packed_entries(source, parameters), library, command, flags)
    module = ModuleType(library.stem)
    fill_module(module, library, parameters)
    return module


def run_native(program: ModuleType, batch: Batch) -> BatchResult:
    """Results of a batch, block after block, on this thread."""
    runs, lanes = batch.states.shape[1], lanes_of(batch.program)
    results = []
    for first in range(0, runs, lanes):
        own = slice(first, min(first + lanes, runs))
        block = LaneBlock(program, batch.program, batch.clock, batch.parameters[:, own], batch.states[:, own])
        block.advance(batch.clock.step_count)
        results.append(block.result())
    return join_results(results)
