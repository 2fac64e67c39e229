"""Simulator process with text input and output, and stack depth from its memory."""

import os
import select
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import final
from weakref import finalize

from ppafo.errors import SimulationError
from ppafo.wording import one_line, reason

UNTOUCHED = 0xA5
"""Fill byte of stack memory, which shows how deep the stack was overwritten."""
_PATIENCE = 60.0
"""Longest time without output from a simulator [s]; QEMU needs about 10 s to start on a busy machine."""


@final
class Console:
    """Local process with text input and output; ``close`` ends it."""

    def __init__(self, command: Sequence[str], folder: Path) -> None:
        self._name = command[0]
        self._unread = b""
        try:
            self._process = subprocess.Popen(
                command, cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, bufsize=0
            )
        except OSError as error:
            raise SimulationError(f"{self._name} cannot be run: {reason(error)}") from error
        # Nothing else ends it where what holds this object fails before it can close it.
        self.close = finalize(self, _end, self._process)

    def say(self, text: bytes) -> None:
        """Write text to the process. Raises SimulationError if it has ended."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(text)
        except OSError as error:
            raise SimulationError(f"{self._name} has ended: {reason(error)}; {self._last()}") from error

    def until(self, mark: bytes) -> bytes:
        """Return the output of the process up to a mark. Raises SimulationError without output."""
        assert self._process.stdout is not None
        while mark not in self._unread:
            ready, _, _ = select.select([self._process.stdout], [], [], _PATIENCE)
            output = os.read(self._process.stdout.fileno(), 65536) if ready else b""
            if not output:
                raise SimulationError(f"{self._name} does not answer; {self._last()}")
            # What comes behind the mark is kept for the next question.
            self._unread += output
        before_mark, _, self._unread = self._unread.partition(mark)
        return before_mark

    def _last(self) -> str:
        last = self._unread.decode(errors="replace").strip().splitlines()[-1:]
        return f"its last output: {one_line(' '.join(last))}"


def _end(process: "subprocess.Popen[bytes]") -> None:
    process.kill()
    process.communicate()


def depth_of_stack(memory: bytes) -> int:
    """Return the deepest use of a stack [bytes] that grows down in memory filled with ``UNTOUCHED``."""
    return len(memory) - next((depth for depth, byte in enumerate(memory) if byte != UNTOUCHED), len(memory))
