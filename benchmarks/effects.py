"""``python -m benchmarks.effects``: what each effect costs, as the time of a run with it over that without.

Runs with and without take turns, on one thread, in CPU seconds, so that a noisy machine does as much to one as to the
other; the best of each counts. An effect of another package is timed by an override that switches it on.
"""

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import replace

from benchmarks.command import run_command
from benchmarks.report import describe_machine
from benchmarks.telling import tell
from ppafo.cli.output import EXIT_CHECK_FAILED, EXIT_GOOD, print_result
from ppafo.engine.lanes import Batch, run_batch
from ppafo.engine.run import batch_of
from ppafo.errors import SimulationError
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run

ON = (
    "effects.line_resistance.area=10 mm^2",
    "effects.laminar_leak.coefficient=1e-16 kg/(s Pa^2)",
    "effects.seal_friction.dynamic_per_pressure=1e-7 N m/Pa",
    "effects.stribeck.velocity=0.1 rad/s",
    "effects.joint_load.drag=0.01 N m s^2/rad^2",
    "effects.opening.command_01=0.1",
    "sensors.pressure_bandwidth=80 Hz",
)
"""Overrides that switch the effects of the package on, each."""
SCENARIOS = ("torque-task-solenoid", "step-response")
"""A held vane whose steps are whole but for switchings, and a free one whose error decides."""
GATE = 2.0
"""Largest ratio that passes: a closed law costs a tenth, an exponential up to two thirds, iterations tens."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument(
        "overrides", metavar="PATH=VALUE", nargs="*", help="what switches effects on (default: all own)"
    )
    parser.add_argument("--runs", metavar="N", type=int, default=256, help="runs of a repetition (default: 256)")
    parser.add_argument("--repetitions", metavar="N", type=int, default=7, help="the best counts (default: 7)")
    parser.add_argument("--check", action="store_true", help=f"exit 1 where an effect costs more than {GATE:g} times")
    parser.add_argument("--json", action="store_true", help="print one JSON document instead of text")


def main(words: Sequence[str] | None = None) -> int:
    """Return the exit code of the command with these words."""
    return run_command("effects", "Time runs with each effect against those without.", add_arguments, run, words)


def run(parsed: argparse.Namespace) -> int:
    """Time, print; 1 where an effect is too slow and ``--check`` asks."""
    if min(parsed.runs, parsed.repetitions) < 1:
        raise SimulationError("--runs and --repetitions must be 1 or more")
    found = {
        name: ratios_of(name, tuple(parsed.overrides) or ON, parsed.runs, parsed.repetitions) for name in SCENARIOS
    }
    lines = [f"{describe_machine().processor}; one thread, CPU seconds, best of {parsed.repetitions}"]
    lines += [f"{name:22} {text:52} {ratio:5.2f}" for name, by in found.items() for text, ratio in by.items()]
    worst = max(ratio for by in found.values() for ratio in by.values())
    lines.append(f"at most {worst:.2f} times as long; {GATE:g} is allowed")
    print_result("\n".join(lines), {"ratios": found, "gate": GATE}, parsed.json)
    return EXIT_CHECK_FAILED if parsed.check and worst > GATE else EXIT_GOOD


def ratios_of(name: str, overrides: Sequence[str], runs: int, repetitions: int) -> dict[str, float]:
    """Return time with each override over that without [-], of a scenario without a record."""
    tell(f"{name}: compiling")
    plain, *others = (_batch(name, texts, runs) for texts in ((), *((text,) for text in overrides)))
    batches = [plain, *others]
    best = [float("inf")] * len(batches)
    for batch in batches:
        run_batch(batch, threads=1)
    for _ in range(repetitions):
        for place, batch in enumerate(batches):
            start = time.process_time()
            run_batch(batch, threads=1)
            best[place] = min(best[place], time.process_time() - start)
    return {text: time_with / best[0] for text, time_with in zip(overrides, best[1:], strict=True)}


def _batch(name: str, overrides: Sequence[str], runs: int) -> Batch:
    """The same run many times, without a record: what is timed is the model."""
    batch = batch_of(plan_run(load_scenario(name, overrides)))
    clock = replace(batch.clock, record_every=0)
    return Batch(batch.program, clock, batch.parameters.repeat(runs, axis=1), batch.states.repeat(runs, axis=1))


if __name__ == "__main__":
    sys.exit(main())
