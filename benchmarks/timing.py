"""Times contenders in turn, so that a busy machine is busy for all of them alike.

Child processes are timed, or time themselves; none of them outlives the benchmark.
"""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median

PATIENCE = 900.0
"""Longest time [s] that a child may take."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """Exit code, standard output and the last line of standard error of a child."""

    code: int
    output: str
    complaint: str


def run_python(arguments: Sequence[str], environment: Mapping[str, str]) -> Outcome:
    """Run this Python with ``arguments`` to its end; an interrupt or an error here ends it too.

    It gets a session of its own so that Ctrl-C reaches only the benchmark, which then ends it.
    """
    try:
        done = subprocess.run(
            [sys.executable, *arguments],
            env={**os.environ, **environment},
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
            start_new_session=True,
        )
    except subprocess.TimeoutExpired:
        return Outcome(1, "", f"no answer after {PATIENCE:.0f} s")
    lines = done.stderr.strip().splitlines()
    return Outcome(done.returncode, done.stdout, lines[-1] if lines else f"exit code {done.returncode}")


@dataclass(frozen=True, slots=True)
class Timing:
    """Durations [s] of all repetitions of one contender."""

    seconds: tuple[float, ...]

    @property
    def best(self) -> float:
        """The shortest duration [s]: the one that other work on the machine disturbed least."""
        return min(self.seconds)

    @property
    def median(self) -> float:
        """The middle duration [s]."""
        return median(self.seconds)

    @property
    def worst(self) -> float:
        """The longest duration [s]."""
        return max(self.seconds)

    def joined(self, other: "Timing") -> "Timing":
        """Durations of both."""
        return Timing(self.seconds + other.seconds)


def _once(run: Callable[[], object]) -> float:
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def time_in_turn(contenders: Mapping[str, Callable[[], object]], repetitions: int) -> dict[str, Timing]:
    """Durations [s] by name; every round runs each contender once, and the rounds begin with another one in turn."""
    names = list(contenders)
    seconds: dict[str, list[float]] = {name: [] for name in names}
    for repetition in range(repetitions):
        first = repetition % max(1, len(names))
        for name in names[first:] + names[:first]:
            seconds[name].append(_once(contenders[name]))
    return {name: Timing(tuple(values)) for name, values in seconds.items()}
