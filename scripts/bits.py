"""Whether every run has its golden bits: by compilers of C, by Python, on other machines.

    python scripts/bits.py
    python scripts/bits.py --targets here
    python scripts/bits.py --names torque-task-solenoid --targets "gcc -O1 -fsanitize=address,undefined"
    python scripts/bits.py --renew
    python scripts/bits.py --translate 200

Prints the table of ``docs/evidence.md``, a row for each target: the golden hashes that it found, and what it
did not find; ``here`` is this computer as ``ppafo`` uses it. A target that cannot be run here says what is missing. The
rows of the runs come from plans on this machine: only the time stepping is compared elsewhere.
``--renew`` writes the golden hashes anew.

``--translate`` draws programs from the catalogues, takes each to C, and lets gcc compile it with warnings as errors.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from shutil import which

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from ppafo.engine.compilers import FLAGS
from ppafo.engine.entries import INLINE
from ppafo.engine.lanes import Batch, run_batch
from ppafo.engine.loading import BACKEND_VARIABLE, PYTHON
from ppafo.engine.loop_text import write_lanes
from ppafo.engine.source_text import SourceCollector
from ppafo.errors import SimulationError
from ppafo.golden_bits import GOLDEN, Hashes, digest, golden_hashes, names, plain_batch
from ppafo.translation.native import compiler
from scripts.built_programs import build, program_source, run_native, translated
from scripts.golden_bits import Runner, drawn_batch, failures, hashes_of, new_golden_hashes
from scripts.other_machines import MACHINES, on_other_machine
from tests.composed_programs import drawn_programs

__all__ = ["digest", "drawn_batch", "failures", "plain_batch"]

WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Werror")
HERE = "here"
"""This computer with the compiler that the package chooses."""
LEVELS = ("-O0", "-O1", "-O2", "-O3", "-O3 -march=native")
TARGETS = (
    *(f"{command} {level}" for command in ("gcc", "clang") for level in LEVELS),
    "zig -O3",
    *MACHINES,
)


def title_of(target: str) -> str:
    """Return a target in words."""
    if target == HERE:
        return "this computer"
    if target in MACHINES:
        return f"C by zig, {MACHINES[target].title}"
    return "Python itself" if target == PYTHON else f"C by {target}"


def missing_for(target: str) -> str:
    """Return what a target needs that is not here; empty where all is."""
    if target in (HERE, PYTHON):
        return ""
    if target in MACHINES:
        return MACHINES[target].missing()
    command = target.split(maxsplit=1)[0]
    if command != "zig":
        return "" if which(command) else command
    try:
        compiler("zig")
    except SimulationError:
        return "zig (pip install ppafo[native])"
    return ""


def runner_of(target: str, batch: Batch) -> Runner:
    """Return what runs batches of the program of one for a target."""
    if target in MACHINES:
        return on_other_machine(target, batch)
    return _from_c(batch, target) if " " in target else run_batch


def _from_c(batch: Batch, target: str) -> Runner:
    with tempfile.TemporaryDirectory() as folder:
        name, *flags = target.split()
        own = [flag for flag in FLAGS if not flag.startswith("-O") and not (name.endswith("++") and "std" in flag)]
        # zig is no compiler to be pleased, and that clang leaves a loop as it is says nothing of the text.
        warnings = {"zig": (), "clang": (*WARNINGS, "-Wno-pass-failed")}.get(name, WARNINGS)
        command = compiler("zig").command if name == "zig" else (name,)
        native = build(program_source(batch.program), Path(folder), command, [*own, *warnings, *flags])
    return lambda given: run_native(native, given)


def hashes_on(target: str, chosen: Sequence[str]) -> Hashes:
    """Return the hashes of a target, found in a process of its own."""
    env = {BACKEND_VARIABLE: PYTHON} if target == PYTHON else {}
    if "address" in target:
        sanitizer = subprocess.run(["gcc", "-print-file-name=libasan.so"], capture_output=True, text=True, check=True)
        env |= {"LD_PRELOAD": sanitizer.stdout.strip(), "ASAN_OPTIONS": "detect_leaks=0"}
    command = [sys.executable, __file__, "--names", *chosen, "--print-hashes", target]
    done = subprocess.run(command, env={**os.environ, **env}, stdout=subprocess.PIPE, text=True, check=True)
    printed: Hashes = json.loads(done.stdout.splitlines()[-1])
    return printed


def compare(targets: Sequence[str], chosen: Sequence[str]) -> int:
    """Print the table; 1 where any bits differ."""
    golden, differing = golden_hashes(), 0
    sys.stdout.write("| where | golden hashes found |\n|---|---|\n")
    for target in targets:
        missing = missing_for(target)
        if missing:
            sys.stdout.write(f"| {title_of(target)} | not run: {missing} |\n")
            continue
        found = hashes_on(target, chosen)
        others = [name for name in chosen if found[name] != golden[name]]
        differing += bool(others)
        verdict = f"{2 * (len(chosen) - len(others))} of {2 * len(chosen)}"
        said = f"{verdict}; differs: {', '.join(others)}" if others else verdict
        sys.stdout.write(f"| {title_of(target)} | {said} |\n")
        sys.stdout.flush()
    return int(differing > 0)


def translate_drawn(count: int) -> int:
    """Take drawn programs of the catalogues to C and compile them; 1 where a compiler complains."""
    seconds, complaints = [], 0
    for program in drawn_programs(count):
        collector = SourceCollector(INLINE)
        composed = write_lanes(program, collector)
        start = time.thread_time()
        source = translated(composed, collector)
        seconds.append(time.thread_time() - start)
        own = [flag for flag in FLAGS if not flag.startswith("-O")]
        command = ["gcc", *own, "-O1", *WARNINGS, "-xc", "-", "-c", "-o", os.devnull]
        done = subprocess.run(command, input=source, capture_output=True, text=True, check=False)
        complaints += done.returncode != 0
        sys.stdout.write(done.stderr)
    said = f"{count} programs, {complaints} with a complaint; translation takes {np.median(seconds):.2f} s each"
    sys.stdout.write(f"{said}, at most {max(seconds):.2f} s\n")
    return int(complaints > 0)


def main() -> int:
    """Print the table; 1 where any bits differ."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--names", metavar="NAME", nargs="+", help="scenarios and walks (default: all)")
    parser.add_argument(
        "--targets",
        nargs="+",
        default=list(TARGETS),
        help=f"{HERE}, {PYTHON}, 'COMPILER FLAGS', {', '.join(MACHINES)}",
    )
    parser.add_argument("--renew", action="store_true", help="write the golden hashes anew")
    parser.add_argument("--translate", metavar="COUNT", type=int, default=0, help="only translate drawn programs")
    parser.add_argument("--print-hashes", metavar="TARGET", help=argparse.SUPPRESS)
    parsed = parser.parse_args()
    if parsed.translate:
        return translate_drawn(parsed.translate)
    if parsed.renew:
        GOLDEN.write_text(f"{json.dumps(new_golden_hashes(), indent=2)}\n", encoding="utf-8")
        return 0
    chosen = parsed.names or list(names())
    if parsed.print_hashes is not None:
        target = parsed.print_hashes
        found = {name: hashes_of(name, lambda batch: runner_of(target, batch)) for name in chosen}
        sys.stdout.write(f"{json.dumps(found)}\n")
        return 0
    return compare(parsed.targets, chosen)


if __name__ == "__main__":
    sys.exit(main())
