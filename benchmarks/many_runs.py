"""``python -m benchmarks.many_runs``: many runs by Numba and by Warp, one after the other, and their bits.

The runs are those of the other benchmarks: torque tasks that differ in area, volumes, supply, gains and level. What is
timed is all between the rows of numbers at the start and those at the end, with the way to a graphics card and back.
"""

import argparse
import os
import sys
import time
from collections.abc import Sequence

from benchmarks.command import run_command
from benchmarks.report import describe_machine
from benchmarks.task import ensemble
from ppafo.cli.output import EXIT_CHECK_FAILED, EXIT_GOOD, add_json_argument, print_result, tell
from ppafo.engine.compilers import BACKEND_VARIABLE, chosen_compiler
from ppafo.engine.lanes import Batch, run_batch
from ppafo.errors import SimulationError
from ppafo.questions.bits.runs import digest

BACKENDS = ("numba", "warp")
WARM_UP = 64
"""Runs before the clock starts, for what is compiled or loaded."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("--runs", metavar="N", type=int, default=1_000_000, help="how many (default: 1,000,000)")
    parser.add_argument(
        "--duration", metavar="S", type=float, default=3.0, help="simulated seconds of each (default: 3)"
    )
    parser.add_argument("--repetitions", metavar="N", type=int, default=3, help="the best counts (default: 3)")
    parser.add_argument("--threads", metavar="N", type=int, help="for Numba (default: all cores); Warp has one")
    add_json_argument(parser)


def main(words: Sequence[str] | None = None) -> int:
    """Return the exit code of the command with these words."""
    summary = "Time many runs by Numba and by Warp, and compare their bits."
    return run_command("many_runs", summary, add_arguments, run, words)


def run(parsed: argparse.Namespace) -> int:
    """Time, print; 1 where the bits differ."""
    counts = (parsed.runs, parsed.repetitions, 1 if parsed.threads is None else parsed.threads)
    if min(counts) < 1 or not 0.0 < parsed.duration < 1.0e4:
        raise SimulationError("counts are to be 1 or more, --duration above 0 and below 10,000 s")
    tell(f"drawing {parsed.runs:,} runs of {parsed.duration:g} s")
    batch = ensemble(parsed.runs, parsed.duration)
    machine = describe_machine()
    seconds: dict[str, list[float]] = {name: [] for name in BACKENDS}
    hashes, where = {}, {"numba": f"Numba on {parsed.threads or machine.cores} of {machine.cores} cores"}
    few = Batch(batch.program, batch.clock, batch.parameters[:, :WARM_UP], batch.states[:, :WARM_UP])
    for _ in range(parsed.repetitions):
        for name in BACKENDS:
            os.environ[BACKEND_VARIABLE] = name
            compiler = chosen_compiler()
            where |= {name: compiler.described()} if compiler else {}
            tell(where[name])
            run_batch(few)
            start = time.perf_counter()
            result = run_batch(batch, parsed.threads)
            seconds[name].append(time.perf_counter() - start)
            hashes[name] = digest(result)
    is_same = len(set(hashes.values())) == 1
    best = {name: min(found) for name, found in seconds.items()}
    lines = [
        f"{where[name]}: {best[name]:.2f} s, {parsed.runs / best[name]:,.0f} runs a second, "
        f"{parsed.runs * parsed.duration / best[name]:,.0f} times real time"
        for name in BACKENDS
    ]
    said = f"{'the same bits' if is_same else 'other bits'}: {', '.join(hashes[name] for name in BACKENDS)}"
    document = {
        "runs": parsed.runs,
        "duration": parsed.duration,
        "processor": machine.processor,
        "where": where,
        "seconds": seconds,
        "hashes": hashes,
    }
    print_result("\n".join([f"{machine.processor}, {machine.cores} cores", *lines, said]), document, parsed.json)
    return EXIT_GOOD if is_same else EXIT_CHECK_FAILED


if __name__ == "__main__":
    sys.exit(main())
