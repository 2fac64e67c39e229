"""Progress messages of compilation: that it is slow, its expected duration, and its end."""

import contextlib
import logging
import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextvars import ContextVar, copy_context
from itertools import islice
from pathlib import Path

from ppafo.documents.regular_file import read_regular_file
from ppafo.progress import time_text

logger = logging.getLogger("ppafo")

QUIET = 2.0
"""Seconds of compiling that nobody has to hear of."""
SECONDS_FILE = "seconds.txt"
"""The file of a kept program that says how long it took to compile [s]."""
_LONGEST = 3600.0
"""Seconds above which no program was ever compiled: the file is damaged."""
# Programs whose times are read for an estimate: each costs two files, some milliseconds.
_MAXIMUM_ASKED = 40
_models: ContextVar[int] = ContextVar("models that are compiled together", default=0)


def compile_side_by_side(tasks: Sequence[Callable[[], object]], expected: float, where: str) -> None:
    """Compile several models on all cores, with one message about all; ``expected`` [s] is the time on one core."""
    from concurrent.futures import ThreadPoolExecutor

    workers = min(len(tasks), os.cpu_count() or 1)
    with announce(expected / workers, where, len(tasks)), ThreadPoolExecutor(workers) as pool:
        # A context variable, not a global: two threads may compile different sets at once.
        known = _models.set(len(tasks))
        try:
            started = [pool.submit(copy_context().run, task) for task in tasks]
        finally:
            _models.reset(known)
        for task in started:
            task.result()


@contextlib.contextmanager
def announce(expected: float, where: str, models: int = 1) -> Iterator[None]:
    """Say, once it takes longer than ``QUIET``, what is compiled and about how long [s] that takes, and how it ended.

    Nothing is said of what is quick, and of one of several models that are announced together.
    """
    # One of several: their message counts them together.
    if _models.get():
        yield
        return
    what = "a model" if models == 1 else f"{models} models"
    text = f"ppafo: compiling {what} for this computer, about {time_text(max(expected, QUIET))} ..."
    # A message only where it takes long: most programs are kept, and the rest compile in the quiet time.
    timer = threading.Timer(QUIET, logger.warning, (text,))
    # A program that ends while it compiles does not wait for the message.
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


def processor_seconds() -> float:
    """Processor time of this thread and of the compilers that this process has run so far [s]."""
    # Windows does not count the time of other processes: there the clock on the wall has to do.
    if os.name != "posix":
        return time.perf_counter()
    times = os.times()
    return time.thread_time() + times.children_user + times.children_system


def estimate_seconds(source: str, kept: Iterable[Path], usual: float) -> float:
    """Return about how long [s] a source takes to compile, from how long the kept programs of this computer took.

    Programs with the most lines in common say it, each by its seconds per byte: with another actuator or valve a text
    of the same length may take several times as long.
    """
    import statistics

    lines = set(source.splitlines())
    rates: dict[int, list[float]] = {}
    for folder in islice(kept, _MAXIMUM_ASKED):
        # A file that another process has removed, emptied or damaged says nothing.
        with contextlib.suppress(OSError, ValueError, StopIteration):
            seconds = float(read_regular_file(folder / SECONDS_FILE))
            text = read_regular_file(next(folder.glob("*.py"))).decode()
            if 0.0 < seconds < _LONGEST and text:
                rates.setdefault(len(lines.intersection(text.splitlines())), []).append(seconds / len(text))
    return len(source) * (statistics.median(rates[max(rates)]) if rates else usual)
