"""Whether the same runs have the same bits, compiled by Numba for several processors.

    python scripts/bits.py
    python scripts/bits.py torque-task-solenoid --processors generic host --runs 200

Every shipped scenario and walk is run as it is, and with ``--runs`` draws of all its numbers, some of which fail. The
table has a hash of the final states and the records of each; what a NaN is made of is free and left out. The rows of
the runs come from one plan on this machine: only the time stepping is compared. A machine that lacks the instructions
of a processor cannot run what is compiled for it.
"""

import argparse
import hashlib
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from ppafo.engine.lanes import Batch, BatchResult, run_batch
from ppafo.engine.run import batch_of
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.walking.loading import load_walk
from ppafo.walking.planning import plan_walk
from ppafo.walking.walk import plan_of
from scripts.record_results import SCENARIOS, WALKS

COURSES = {"first-steps": "proportional"}
"""Courses, and the walk that takes each."""
NAMES = (*SCENARIOS, *WALKS, *COURSES)
HOST = "host"
PROCESSORS = ("generic", "haswell", "skylake-avx512", HOST)
WALKED = 4.0
SEED = 15
SPREAD = (0.7, 1.4)
"""Smallest and largest factor on a number of a draw."""


def plain_batch(name: str) -> Batch:
    """One run of a scenario, or some seconds of a walk."""
    if name in SCENARIOS:
        return batch_of(plan_run(load_scenario(name)))
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


def hashes(names: list[str], runs: int) -> dict[str, list[str | int]]:
    """Hash of each run alone, hash of its draws, how many of those failed."""
    found: dict[str, list[str | int]] = {}
    for name in names:
        batch = plain_batch(name)
        drawn = run_batch(drawn_batch(batch, runs))
        found[name] = [digest(run_batch(batch)), digest(drawn), failures(drawn)]
    return found


def hashes_on(processor: str, names: list[str], runs: int) -> dict[str, list[str | int]]:
    """As ``hashes``, compiled for a processor in a process of its own."""
    # Without a list of features Numba would add those of this machine.
    chosen = {} if processor == HOST else {"NUMBA_CPU_NAME": processor, "NUMBA_CPU_FEATURES": ""}
    command = [sys.executable, __file__, *names, "--runs", str(runs), "--print-hashes"]
    done = subprocess.run(command, env={**os.environ, **chosen}, stdout=subprocess.PIPE, text=True, check=True)
    printed: dict[str, list[str | int]] = json.loads(done.stdout)
    return printed


def main() -> int:
    """Print the table; 1 where any bits differ."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", metavar="NAME", nargs="*", help="scenarios, walks and courses (default: all)")
    parser.add_argument("--processors", nargs="*", default=list(PROCESSORS), help="names that LLVM knows, or 'host'")
    parser.add_argument("--runs", type=int, default=64, help="draws of each (default: %(default)s)")
    parser.add_argument("--print-hashes", action="store_true", help=argparse.SUPPRESS)
    parsed = parser.parse_args()
    names = parsed.names or list(NAMES)
    if parsed.print_hashes:
        sys.stdout.write(json.dumps(hashes(names, parsed.runs)))
        return 0
    found = {processor: hashes_on(processor, names, parsed.runs) for processor in parsed.processors}
    differing = 0
    for name in names:
        alone, drawn, failed = found[parsed.processors[0]][name]
        others = [processor for processor in parsed.processors if found[processor][name] != [alone, drawn, failed]]
        differing += bool(others)
        verdict = f"differs on {', '.join(others)}" if others else "the same"
        sys.stdout.write(f"{name:30} {alone} {drawn} ({failed} of {parsed.runs} failed): {verdict}\n")
    sys.stdout.write(f"{differing} of {len(names)} differ among {', '.join(parsed.processors)}\n")
    return int(differing > 0)


if __name__ == "__main__":
    sys.exit(main())
