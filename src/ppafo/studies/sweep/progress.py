"""How far a study is: a line with share, rate and time left, written over itself where somebody watches."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TextIO, final

_BETWEEN_LINES = 10.0
"""Seconds between two lines where the output is not a terminal."""


@dataclass(frozen=True, slots=True)
class Progress:
    """Runs in all, runs that are done, those of them that were there at the start, failed runs, seconds since then."""

    runs: int
    done: int
    earlier: int
    failed: int
    elapsed: float

    def line(self) -> str:
        """Return the state in words."""
        words = [f"{self.done:,} of {self.runs:,} runs ({100.0 * self.done / self.runs:.0f} %)"]
        if self.done > self.earlier and self.elapsed > 0.0:
            rate = (self.done - self.earlier) / self.elapsed
            words += [f"{rate:,.0f} runs/s", f"{told_time((self.runs - self.done) / rate)} left"]
        if self.failed:
            words.append(f"{self.failed:,} failed")
        return ", ".join(words)


@final
class ProgressLine:
    """Shows progress on a stream: in one line of a terminal, or now and then in a line of its own."""

    def __init__(self, stream: TextIO, clock: Callable[[], float] = time.monotonic) -> None:
        self._stream, self._clock = stream, clock
        self._said = -_BETWEEN_LINES
        self._open = False

    def __call__(self, progress: Progress) -> None:
        """Show the state."""
        if self._stream.isatty():
            self._stream.write(f"\r\x1b[Kppafo: {progress.line()}")
            self._open = True
        elif self._clock() - self._said >= _BETWEEN_LINES or progress.done == progress.runs:
            self._stream.write(f"ppafo: {progress.line()}\n")
            self._said = self._clock()
        self._stream.flush()

    def close(self) -> None:
        """End the line of a terminal, so that what comes next begins on one of its own."""
        if self._open:
            self._stream.write("\n")
            self._open = False


def told_time(seconds: float) -> str:
    """Return a time in the two units that matter: 42 s, 3 min 10 s, 5 h 20 min."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600:,} h {whole % 3600 // 60} min"
