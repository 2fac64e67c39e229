"""Progress of long tasks: report, and display in a terminal line."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TextIO, final

from ppafo import interrupts

_BETWEEN_LINES = 5.0
"""Time between progress lines if the output is not a terminal [s]."""


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of a task: activity, items done and in total, and elapsed time [s].

    ``total`` is 0 if unknown. Of the ``done`` items, ``earlier`` were done before the start and ``failed`` failed.
    ``elapsed`` is the time since the start [s]. ``is_bound`` is True if ``total`` is an upper bound.
    """

    activity: str = ""
    done: int = 0
    total: int = 0
    failed: int = 0
    earlier: int = 0
    elapsed: float = 0.0
    noun: str = "runs"
    is_bound: bool = False

    def line(self) -> str:
        """Return the progress as text."""
        begun = self.activity if self.total else f"{self.activity} ..."
        words = [begun] if self.activity else []
        if self.total:
            total = f"{'at most ' if self.is_bound else ''}{self.total:,} {self.noun}"
            words.append(f"{self.done:,} of {total} ({100.0 * self.done / self.total:.0f} %)")
        if self.total and self.done > self.earlier and self.elapsed > 0.0:
            rate = (self.done - self.earlier) / self.elapsed
            words += [f"{rate:,.0f} {self.noun}/s"] if rate >= 10.0 else []
            words.append(f"{time_text((self.total - self.done) / rate)} left")
        if self.failed:
            words.append(f"{self.failed:,} failed")
        return ", ".join(words)


Report = Callable[[Progress], None]
"""Callback for the progress of a long task; may raise KeyboardInterrupt."""


def report_nothing(_progress: object) -> None:
    """Ignore a progress report or a count."""


@final
class ProgressLine:
    """Progress display on a stream: an updated line in a terminal, else a new line every few seconds."""

    def __init__(self, stream: TextIO, clock: Callable[[], float] = time.monotonic) -> None:
        self._stream = stream
        self._clock = clock
        self._written = -_BETWEEN_LINES
        self._last = ("", False)
        self._open = False

    def __call__(self, progress: Progress) -> None:
        """Display the progress. Raises KeyboardInterrupt after a termination signal."""
        interrupts.check()
        if self._stream.isatty():
            self._stream.write(f"\r\x1b[Kppafo: {progress.line()}")
            self._open = True
            self._stream.flush()
            return
        # In a file a line now and then is enough: when something new begins or ends, else every so often.
        now = progress.activity, 0 < progress.total == progress.done
        if now != self._last or self._clock() - self._written >= _BETWEEN_LINES:
            self._stream.write(f"ppafo: {progress.line()}\n")
            self._written = self._clock()
            self._last = now
        self._stream.flush()

    def close(self) -> None:
        """End the progress line, so that later output starts on a new line."""
        if self._open:
            self._stream.write("\n")
            self._open = False


def time_text(seconds: float) -> str:
    """Format a time [s] in its two largest units: 42 s, 3 min 10 s, 5 h 20 min."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600:,} h {whole % 3600 // 60} min"
