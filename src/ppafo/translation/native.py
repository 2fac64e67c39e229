"""A program built from its C by a compiler of this machine; it does what the compiled module of the lanes does."""

import ctypes
import subprocess
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ppafo.engine.lane_rows import lanes_of
from ppafo.engine.lanes import Batch, BatchResult, LaneBlock, join_results
from ppafo.errors import ProgramError
from ppafo.translation.c99 import FLAGS


class _Array(ctypes.Structure):
    _fields_ = (("values", ctypes.POINTER(ctypes.c_double)), ("extent", ctypes.c_int64 * 3))


def build(source: str, folder: Path, compiler: str = "gcc", flags: Sequence[str] = FLAGS) -> ModuleType:
    """Compile C into a library in ``folder`` and load it; ProgramError where the compiler refuses it."""
    written, library = folder / "program.c", folder / "program.so"
    written.write_text(source, encoding="utf-8")
    command = [compiler, *flags, "-shared", "-fPIC", str(written), "-o", str(library), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise ProgramError(f"{compiler} refuses the program: {(done.stderr.strip().splitlines() or [''])[0]}")
    entry = ctypes.CDLL(str(library)).advance
    module = ModuleType(library.stem)
    vars(module)["advance"] = lambda *given: entry(*map(_handed, given))
    return module


def run_native(program: ModuleType, batch: Batch) -> BatchResult:
    """Results of a batch, block after block, on this thread."""
    runs, lanes = batch.states.shape[1], lanes_of(batch.program)
    results = []
    for first in range(0, runs, lanes):
        own = slice(first, min(first + lanes, runs))
        traced = len(batch.program.traced)
        block = LaneBlock(program, batch.clock, batch.parameters[:, own], batch.states[:, own], traced)
        block.advance(batch.clock.step_count)
        results.append(block.result())
    return join_results(results)


def _handed(value: Any) -> Any:
    """An argument as C takes it."""
    if isinstance(value, np.ndarray):
        extent = (ctypes.c_int64 * 3)(*value.shape, *(0,) * (3 - value.ndim))
        return _Array(value.ctypes.data_as(ctypes.POINTER(ctypes.c_double)), extent)
    return ctypes.c_double(value) if isinstance(value, float) else ctypes.c_int64(value)
