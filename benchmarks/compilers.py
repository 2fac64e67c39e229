"""``python -m benchmarks.compilers``: how long each compiler takes for a model, and how quickly its model runs.

Runs are timed in CPU seconds of one thread, and compilers take turns, so that other work on the machine disturbs none
more than another. A ratio above 1 is quicker than Numba. Their bits are compared too.
"""

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

from benchmarks.command import run_command
from benchmarks.report import describe_machine
from ppafo.cli.output import EXIT_CHECK_FAILED, EXIT_GOOD, add_json_argument, print_result, tell
from ppafo.engine.cache import CACHE_VARIABLE
from ppafo.engine.compilers import OFFERED
from ppafo.engine.lanes import Batch, load_program, run_batch
from ppafo.engine.loading import BACKEND_VARIABLE, NUMBA
from ppafo.errors import SimulationError
from scripts.golden_bits import digest, names, plain_batch

MODELS = ("torque-task-proportional", "step-response", "thermal-gas-behind-lines", "solenoid")
"""A held vane, a free one, one with an energy balance behind lines, and a walk."""


@dataclass(slots=True)
class Timed:
    """One model by one compiler: seconds of its compilation, CPU seconds of each repetition, hash of its results."""

    compiled: float
    runs: list[float] = field(default_factory=list)
    bits: str = ""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("models", metavar="NAME", nargs="*", help=f"scenarios and walks (default: {', '.join(MODELS)})")
    parser.add_argument("--runs", metavar="N", type=int, default=256, help="runs of a repetition (default: 256)")
    parser.add_argument("--repetitions", metavar="N", type=int, default=5, help="the best counts (default: 5)")
    add_json_argument(parser)


def main(words: Sequence[str] | None = None) -> int:
    """Return the exit code of the command with these words."""
    summary = "Time compilation and runs by each compiler of this computer, and compare their bits."
    return run_command("compilers", summary, add_arguments, run, words)


def run(parsed: argparse.Namespace) -> int:
    """Time, print; 1 where the bits differ."""
    if min(parsed.runs, parsed.repetitions) < 1:
        raise SimulationError("--runs and --repetitions must be 1 or more")
    models = tuple(parsed.models) or MODELS
    unknown = [name for name in models if name not in names()]
    if unknown:
        raise SimulationError(f"there is no '{unknown[0]}'; there are {', '.join(names())}")
    here = [name for name in OFFERED if _is_here(name)]
    found: dict[str, dict[str, Timed]] = {}
    with tempfile.TemporaryDirectory() as folder, _setting(CACHE_VARIABLE, folder):
        for name in models:
            batch = _repeated(plain_batch(name), parsed.runs)
            found[name] = {compiler: _compiled(batch, compiler, name) for compiler in here}
            for _ in range(parsed.repetitions):
                for compiler in here:
                    _run_once(batch, compiler, found[name][compiler])
    is_same = all(len({timed.bits for timed in by.values()}) == 1 for by in found.values())
    machine = describe_machine()
    lines = [
        f"{machine.processor}; CPU time of one thread, best of {parsed.repetitions} repetitions of {parsed.runs} runs"
    ]
    for name, by in found.items():
        quickest = {compiler: min(timed.runs) for compiler, timed in by.items()}
        lines += [
            f"{name:28} {compiler:6} compiled in {timed.compiled:6.1f} s, runs {quickest[compiler]:7.3f} CPU s"
            + (f", {quickest[NUMBA] / quickest[compiler]:5.2f} of Numba's speed" if NUMBA in quickest else "")
            for compiler, timed in by.items()
        ]
    lines.append("the same bits" if is_same else "other bits")
    document = {
        "processor": machine.processor,
        "runs": parsed.runs,
        "models": {
            name: {
                compiler: {"compiled": timed.compiled, "runs": timed.runs, "bits": timed.bits}
                for compiler, timed in by.items()
            }
            for name, by in found.items()
        },
    }
    print_result("\n".join(lines), document, parsed.json)
    return EXIT_GOOD if is_same else EXIT_CHECK_FAILED


def _is_here(name: str) -> bool:
    try:
        OFFERED[name]()
    except SimulationError:
        return False
    return True


@contextmanager
def _setting(variable: str, value: str) -> Iterator[None]:
    before = os.environ.get(variable)
    os.environ[variable] = value
    try:
        yield
    finally:
        del os.environ[variable]
        if before is not None:
            os.environ[variable] = before


def _repeated(batch: Batch, runs: int) -> Batch:
    """The same run many times, without a record: what is timed is the model."""
    unrecorded = replace(batch.clock, record_every=0)
    return Batch(batch.program, unrecorded, batch.parameters.repeat(runs, axis=1), batch.states.repeat(runs, axis=1))


def _compiled(batch: Batch, compiler: str, name: str) -> Timed:
    tell(f"{name}: compiling by {compiler}")
    with _setting(BACKEND_VARIABLE, compiler):
        start = time.perf_counter()
        load_program(batch.program)
        return Timed(time.perf_counter() - start)


def _run_once(batch: Batch, compiler: str, timed: Timed) -> None:
    with _setting(BACKEND_VARIABLE, compiler):
        start = time.process_time()
        result = run_batch(batch, threads=1)
        timed.runs.append(time.process_time() - start)
        timed.bits = digest(result)


if __name__ == "__main__":
    sys.exit(main())
