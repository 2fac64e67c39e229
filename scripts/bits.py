"""Whether the same runs have the same bits, compiled by Numba for several processors, and from C by several compilers.

    python scripts/bits.py
    python scripts/bits.py torque-task-solenoid --processors generic host --runs 200
    python scripts/bits.py --processors host --compilers "gcc -O1 -fsanitize=address,undefined"
    python scripts/bits.py --translate 200

Every shipped scenario and walk is run as it is, and with ``--runs`` draws of all its numbers, some of which fail. The
table has a hash of the final states and the records of each; what a NaN is made of is free and left out. The rows of
the runs come from one plan on this machine: only the time stepping is compared. A machine that lacks the instructions
of a processor cannot run what is compiled for it.

``--translate`` draws programs from the catalogues, takes each to C, and lets gcc compile it with warnings as errors.
"""

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from shutil import which

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from ppafo.engine.lane_source import INLINE, write_lanes
from ppafo.engine.lanes import Batch, BatchResult, run_batch
from ppafo.engine.run import batch_of
from ppafo.engine.source_text import SourceCollector
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.translation.c99 import FLAGS, program_source, translated
from ppafo.translation.native import build, run_native
from ppafo.walking.loading import load_walk
from ppafo.walking.planning import plan_walk
from ppafo.walking.walk import plan_of
from scripts.record_results import SCENARIOS, WALKS
from tests.composed_programs import drawn_programs

VARIED = {
    "noisy-sensors": (
        "torque-task-proportional",
        ("sensors.delay=2.3 ms", "sensors.pressure_noise=0.1 psi_d", "sensors.pressure_resolution=0.05 psi_d"),
    ),
    "thermal-gas-behind-lines": (
        "step-response",
        (
            "gas_model.kind=thermal",
            "gas_model.heat_transfer_coefficient=50 W/(m^2 K)",
            "gas_model.wall_area_per_volume=100 1/m",
            "supply_line.plantarflexion.droop=3e6 Pa s/kg",
        ),
    ),
}
"""Scenarios with settings of their own, for what no shipped one has."""
COURSES = {"first-steps": "proportional"}
"""Courses, and the walk that takes each."""
NAMES = (*SCENARIOS, *VARIED, *WALKS, *COURSES)
HOST = "host"
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Werror")
PROCESSORS = ("generic", "haswell", "skylake-avx512", HOST)
COMPILERS = ("gcc -O0", "gcc -O3", "gcc -O3 -march=native", "clang -O3", "clang -O3 -march=native")
"""Compilers of C; those that are not on this machine are left out. More flags than these are those of the emitter."""
WALKED = 4.0
SEED = 15
SPREAD = (0.7, 1.4)
"""Smallest and largest factor on a number of a draw."""


def plain_batch(name: str) -> Batch:
    """One run of a scenario, or some seconds of a walk."""
    if name in SCENARIOS:
        return batch_of(plan_run(load_scenario(name)))
    if name in VARIED:
        return batch_of(plan_run(load_scenario(*VARIED[name])))
    walk = load_walk(COURSES[name], course=name) if name in COURSES else load_walk(name)
    return batch_of(plan_walk(plan_of(walk, WALKED)))


def drawn_batch(batch: Batch, runs: int, seed: int = SEED) -> Batch:
    """``runs`` runs like the one of a batch, each with all its numbers times factors of its own; none is recorded."""
    draw = np.random.default_rng(seed)
    parameters = np.repeat(batch.parameters, runs, axis=1)
    states = np.repeat(batch.states, runs, axis=1)
    # Steps and delays stay: others would be another clock.
    parameters[5:] *= draw.uniform(*SPREAD, parameters[5:].shape)
    states[4:] *= draw.uniform(*SPREAD, states[4:].shape)
    # In one run of ten a number is what no plan would give: it may fail, and must fail alike.
    for run in range(0, runs, 10):
        parameters[draw.integers(5, len(parameters)), run] *= draw.choice([-1.0, 0.0, 1.0e6, np.nan])
    return Batch(batch.program, replace(batch.clock, record_every=0), parameters, states)


def digest(result: BatchResult) -> str:
    """Hash of all numbers of a result, with one NaN for all."""
    found = hashlib.sha256()
    for values in (result.states, result.record):
        found.update(np.where(np.isnan(values), np.nan, values).astype("<f8").tobytes())
    return found.hexdigest()[:16]


def failures(result: BatchResult) -> int:
    """Runs that left what is possible."""
    return int((result.states[1] < 1.0e300).sum())


def hashes(names: list[str], runs: int, compiler: str) -> dict[str, list[str | int]]:
    """Hash of each run alone, hash of its draws, how many of those failed; by the lanes, or from C."""
    found: dict[str, list[str | int]] = {}
    for name in names:
        batch = plain_batch(name)
        run = _from_c(batch, compiler) if compiler else run_batch
        drawn = run(drawn_batch(batch, runs))
        found[name] = [digest(run(batch)), digest(drawn), failures(drawn)]
    return found


def _from_c(batch: Batch, compiler: str) -> Callable[[Batch], BatchResult]:
    """What runs batches of the program of one from its C."""
    with tempfile.TemporaryDirectory() as folder:
        command, *flags = compiler.split()
        own = [flag for flag in FLAGS if not flag.startswith("-O") and not (command.endswith("++") and "std" in flag)]
        native = build(program_source(batch.program), Path(folder), command, [*own, *WARNINGS, *flags])
    return lambda given: run_native(native, given)


def hashes_on(target: str, names: list[str], runs: int) -> dict[str, list[str | int]]:
    """As ``hashes``, for a processor or by a compiler of C, in a process of its own."""
    compiler = target if " " in target else ""
    # Without a list of features Numba would add those of this machine.
    chosen = {} if compiler or target == HOST else {"NUMBA_CPU_NAME": target, "NUMBA_CPU_FEATURES": ""}
    if "address" in compiler:
        sanitizer = subprocess.run(["gcc", "-print-file-name=libasan.so"], capture_output=True, text=True, check=True)
        chosen = {"LD_PRELOAD": sanitizer.stdout.strip(), "ASAN_OPTIONS": "detect_leaks=0"}
    command = [sys.executable, __file__, *names, "--runs", str(runs), "--print-hashes", compiler]
    done = subprocess.run(command, env={**os.environ, **chosen}, stdout=subprocess.PIPE, text=True, check=True)
    printed: dict[str, list[str | int]] = json.loads(done.stdout)
    return printed


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
    parser.add_argument("names", metavar="NAME", nargs="*", help="scenarios, walks and courses (default: all)")
    parser.add_argument("--processors", nargs="*", default=list(PROCESSORS), help="names that LLVM knows, or 'host'")
    parser.add_argument("--runs", type=int, default=64, help="draws of each (default: %(default)s)")
    parser.add_argument(
        "--compilers",
        nargs="*",
        default=[item for item in COMPILERS if which(item.split()[0])],
        help="command and flags",
    )
    parser.add_argument("--translate", metavar="COUNT", type=int, default=0, help="only translate drawn programs")
    parser.add_argument("--print-hashes", metavar="COMPILER", help=argparse.SUPPRESS)
    parsed = parser.parse_args()
    names = parsed.names or list(NAMES)
    if parsed.print_hashes is not None:
        sys.stdout.write(json.dumps(hashes(names, parsed.runs, parsed.print_hashes)))
        return 0
    if parsed.translate:
        return translate_drawn(parsed.translate)
    targets = [*parsed.processors, *parsed.compilers]
    found = {target: hashes_on(target, names, parsed.runs) for target in targets}
    differing = 0
    for name in names:
        alone, drawn, failed = found[targets[0]][name]
        others = [target for target in targets if found[target][name] != [alone, drawn, failed]]
        differing += bool(others)
        verdict = f"differs: {', '.join(others)}" if others else "the same"
        sys.stdout.write(f"{name:30} {alone} {drawn} ({failed} of {parsed.runs} failed): {verdict}\n")
    sys.stdout.write(f"{differing} of {len(names)} differ among {', '.join(targets)}\n")
    return int(differing > 0)


if __name__ == "__main__":
    sys.exit(main())
