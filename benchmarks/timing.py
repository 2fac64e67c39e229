"""Times contenders in turn, so that a busy machine is busy for all of them alike.

Child processes are timed, or time themselves; none of them outlives the benchmark.
"""

import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median

PATIENCE = 900.0
"""Longest time [s] that a child may take."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """Exit code, standard output and last line of standard error of a child, and when its output began [s]."""

    code: int
    output: str
    complaint: str
    first: float = 0.0


def run_python(arguments: Sequence[str], environment: Mapping[str, str]) -> Outcome:
    """Run this Python with ``arguments`` to its end; an interrupt or an error here ends it too.

    It gets a session of its own so that Ctrl-C reaches only the benchmark, which then ends it.
    """
    start = time.perf_counter()
    with (
        tempfile.TemporaryFile("w+", encoding="utf-8") as complaints,
        subprocess.Popen(
            [sys.executable, *arguments],
            env={**os.environ, **environment},
            stdout=subprocess.PIPE,
            stderr=complaints,
            text=True,
            start_new_session=True,
        ) as process,
    ):
        assert process.stdout is not None
        patience = threading.Timer(PATIENCE, process.kill)
        patience.start()
        try:
            begun = process.stdout.read(1)
            first = time.perf_counter() - start
            output = begun + process.stdout.read()
            code = process.wait()
        finally:
            is_late = not patience.is_alive()
            patience.cancel()
            process.kill()
        complaints.seek(0)
        lines = complaints.read().strip().splitlines()
    if is_late:
        return Outcome(1, "", f"no answer after {PATIENCE:.0f} s")
    return Outcome(code, output, lines[-1] if lines else f"exit code {code}", first)


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
