"""Child processes that are timed or that time: none of them outlives the benchmark."""

import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

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
