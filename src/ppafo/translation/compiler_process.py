"""A compiler of C as a process: what it says and how it ends."""

import subprocess
from collections.abc import Sequence

from ppafo.engine.compilers import CompilerError
from ppafo.errors import one_line, reason


def asked(line: Sequence[str], remedy: str = "", folder: str | None = None) -> "subprocess.CompletedProcess[str]":
    """What a compiler says and how it ends, run in ``folder``; CompilerError, with a remedy, if it cannot be run."""
    try:
        return subprocess.run(line, cwd=folder, capture_output=True, encoding="utf-8", errors="replace", check=False)
    except OSError as error:
        raise CompilerError(f"{line[0]} cannot be run: {reason(error)}{remedy and '; '}{remedy}") from error


def complaint(done: "subprocess.CompletedProcess[str]") -> str:
    """The line in which a compiler says what is wrong; how it ended where it says nothing."""
    lines = [*done.stderr.splitlines(), *done.stdout.splitlines(), f"it ended with {done.returncode}"]
    return one_line(next((text for text in lines if "error" in text), next(filter(str.strip, lines))))
