"""``python -m benchmarks.environments``: steps of many environments and of one in a second of one core, and resets.

A step has the gas, the valve, delay, noise and steps of the sensors, observation and reward. The actions are drawn
once: an agent's own time is not in it.
"""

import argparse
import sys
import time
from collections.abc import Sequence
from typing import Any

import gymnasium

import ppafo.gym
from benchmarks.command import run_command
from benchmarks.report import describe_machine
from ppafo.cli.output import EXIT_GOOD, print_result
from ppafo.errors import SimulationError

COUNT = 4096
STEPS = 200


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("--count", metavar="N", type=int, default=COUNT, help=f"environments (default: {COUNT})")
    parser.add_argument("--repetitions", metavar="N", type=int, default=5, help="the best counts (default: 5)")
    parser.add_argument("--json", action="store_true", help="print one JSON document instead of text")


def main(words: Sequence[str] | None = None) -> int:
    """Return the exit code of the command with these words."""
    return run_command("environments", "Time the environments of Gymnasium.", add_arguments, run, words)


def run(arguments: argparse.Namespace) -> int:
    """Time all tasks and print a table."""
    if min(arguments.count, arguments.repetitions) < 1:
        raise SimulationError("--count and --repetitions are to be 1 or more")
    found = {
        name: (*measure(name, arguments.count, arguments.repetitions), measure_one(name, arguments.repetitions))
        for name in ppafo.gym.TASKS
    }
    head = f"{arguments.count} environments, and one, on one core of {describe_machine().processor}"
    lines = [
        f"{name:<20} {rate:12,.0f} steps/s, reset {reset:.2f} s; one: {alone:10,.0f} steps/s"
        for name, (rate, reset, alone) in found.items()
    ]
    document = {
        name: {"steps_per_second": rate, "reset": reset, "steps_per_second_of_one": alone}
        for name, (rate, reset, alone) in found.items()
    }
    print_result("\n".join([head, *lines]), document, arguments.json)
    return EXIT_GOOD


def measure(name: str, count: int, repetitions: int) -> tuple[float, float]:
    """Return steps in a second of the processor, the best of some repetitions, and the time of a reset [s]."""
    env: Any = gymnasium.make_vec(name, num_envs=count)
    env.action_space.seed(1)
    began = time.process_time()
    env.reset(seed=1)
    reset, actions, times = time.process_time() - began, env.action_space.sample(), []
    for _ in range(repetitions):
        began = time.process_time()
        for _ in range(STEPS):
            env.step(actions)
        times.append(time.process_time() - began)
    return count * STEPS / min(times), reset


def measure_one(name: str, repetitions: int) -> float:
    """Return steps in a second of the processor of one environment, as ``gymnasium.make`` gives it."""
    env: Any = gymnasium.make(name)
    env.action_space.seed(1)
    action, times = env.action_space.sample(), []
    for _ in range(repetitions):
        env.reset(seed=1)
        began = time.process_time()
        for _ in range(STEPS):
            env.step(action)
        times.append(time.process_time() - began)
    return STEPS / min(times)


if __name__ == "__main__":
    sys.exit(main())
