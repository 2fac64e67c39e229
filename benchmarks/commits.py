"""``python -m benchmarks.commits COMMIT...``: speed of ensembles in this checkout over their speed at other commits.

A process for each commit runs the package as it was then, and all take turns, so that a busy machine is busy for all of
them alike. CPU seconds of one thread; the best of each counts, and the median stands beside it.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from statistics import median

from benchmarks.command import run_command
from ppafo.cli.output import EXIT_GOOD, print_result
from ppafo.errors import SimulationError

ROOT = Path(__file__).parents[1]
WORKER = """
import sys
import time
from benchmarks.free_vanes import free_vanes
from benchmarks.task import ensemble
from ppafo.engine.lanes import run_batch

vanes = free_vanes({runs})
kinds = [vanes["alike"], vanes["spread"], [ensemble({runs}, 3.0)]]
for line in sys.stdin:
    for batches in kinds:
        start = time.process_time()
        for batch in batches:
            run_batch(batch)
        print(time.process_time() - start, flush=True)
"""
KINDS = ("figure 7, all alike", "figure 7, devices spread by 20 %", "torque task, 3 s")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("commits", metavar="COMMIT", nargs="+", help="what this checkout is compared with")
    parser.add_argument("--runs", metavar="N", type=int, default=4096, help="runs of a repetition (default: 4096)")
    parser.add_argument("--repetitions", metavar="N", type=int, default=25, help="repetitions (default: 25)")
    parser.add_argument("--json", action="store_true", help="print one JSON document instead of text")


def run(parsed: argparse.Namespace) -> int:
    """Time all commits in turn and print the ratios."""
    with ExitStack() as stack:
        places = [ROOT]
        for commit in parsed.commits:
            places.append(Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="ppafo-commit-"))))
            archive = subprocess.run(["git", "archive", commit], check=False, cwd=ROOT, capture_output=True)
            if archive.returncode != 0:
                raise SimulationError(f"{commit}: git knows no such commit")
            subprocess.run(["tar", "x", "-C", str(places[-1])], input=archive.stdout, check=True)
        workers = [stack.enter_context(_worker(place, parsed.runs)) for place in places]
        for worker in workers:
            stack.callback(worker.kill)
            _seconds(worker, parsed.commits)
        seconds = [[_seconds(worker, parsed.commits) for worker in workers] for _ in range(parsed.repetitions)]
    document: dict[str, dict[str, dict[str, float]]] = {}
    lines = [f"speed of this checkout over that of another, {parsed.repetitions} repetitions: best, median"]
    for number, commit in enumerate(parsed.commits, 1):
        document[commit] = {}
        for index, kind in enumerate(KINDS):
            here, there = ([turn[place][index] for turn in seconds] for place in (0, number))
            ratios = {"best": min(there) / min(here), "median": median(there) / median(here)}
            document[commit][kind] = ratios
            lines.append(f"{commit}  {kind:34}{ratios['best']:6.3f}{ratios['median']:7.3f}")
    print_result("\n".join(lines), document, parsed.json)
    return EXIT_GOOD


def _worker(place: Path, runs: int) -> "subprocess.Popen[str]":
    """Start the process of a checkout, which times all kinds for each line that it is sent."""
    return subprocess.Popen(
        [sys.executable, "-c", WORKER.format(runs=runs)],
        cwd=place,
        env={**os.environ, "PYTHONPATH": f"{place / 'src'}{os.pathsep}{place}"},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


def _seconds(worker: "subprocess.Popen[str]", commits: Sequence[str]) -> list[float]:
    """Return the CPU seconds of all kinds in one more repetition of a worker."""
    assert worker.stdin is not None
    assert worker.stdout is not None
    try:
        worker.stdin.write("\n")
        worker.stdin.flush()
        return [float(worker.stdout.readline()) for _ in KINDS]
    except (BrokenPipeError, ValueError) as error:
        raise SimulationError(f"{', '.join(commits)}: one has no such ensembles; its complaint stands above") from error


if __name__ == "__main__":
    sys.exit(run_command("commits", "Compare the speed of ensembles with other commits.", add_arguments, run))
