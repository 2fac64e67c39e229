"""What is said while models are compiled: which of how many, and about how long it takes."""

import contextlib
import logging
import statistics
import threading
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

from ppafo.progress import time_text

logger = logging.getLogger("ppafo")

QUIET = 2.0
"""Seconds of compiling that nobody has to hear of."""
SECONDS_FILE = "seconds.txt"
"""The file of a kept program that says how long it took to compile [s]."""
_MAXIMUM_ASKED = 20

_place = (1, 1)
"""Which model is compiled, and of how many; whoever compiles holds the lock of the cache."""


@contextlib.contextmanager
def number_models(number: int, total: int) -> Iterator[None]:
    """Say of what is compiled inside a ``with`` block that it is one of so many models."""
    global _place  # noqa: PLW0603  # like the lock beside which it is used, there is one for the process
    before, _place = _place, (number, total)
    try:
        yield
    finally:
        _place = before


@contextlib.contextmanager
def announce(expected: float, where: str) -> Iterator[None]:
    """Say, once it takes longer than ``QUIET``, what is compiled and about how long [s] that takes, and how it ended.

    Nothing is said of what is quick.
    """
    number, total = _place
    model = f"model {number} of {total}" if total > 1 else "a model"
    text = f"ppafo: compiling {model} for this computer, about {time_text(max(expected, QUIET))} ..."
    timer = threading.Timer(QUIET, logger.warning, (text,))
    timer.daemon = True
    start = time.perf_counter()
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()
    seconds = time.perf_counter() - start
    if seconds >= QUIET:
        logger.warning("ppafo: compiled in %.1f s and %s", seconds, where)


def estimate_seconds(source: str, kept: Iterable[Path], usual: float) -> float:
    """Return about how long [s] a source takes to compile, from how long the kept programs of this computer took."""
    rates = []
    for folder in kept:
        with contextlib.suppress(OSError, ValueError, StopIteration):
            seconds = float((folder / SECONDS_FILE).read_text(encoding="ascii"))
            rates.append(seconds / next(folder.glob("*.py")).stat().st_size)
        if len(rates) == _MAXIMUM_ASKED:
            break
    return len(source) * (statistics.median(rates) if rates else usual)
