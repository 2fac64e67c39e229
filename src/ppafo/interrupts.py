"""Termination signals: Ctrl-C, termination request and closed terminal, handled alike.

Each signal raises KeyboardInterrupt in the main thread and is recorded. The record is needed because the exception is
lost in finalisers, in compiled code that does not propagate it, and in libraries that catch it. Work in blocks checks
the record between two blocks.
"""

import signal
import sys
from types import FrameType, TracebackType
from typing import Any

from ppafo.first_moments import end

SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")
_received: list[int] = []
"""Numbers of the signals received; a list, because append cannot be interrupted."""


def listen() -> None:
    """Install handlers that raise KeyboardInterrupt; signals ignored by the parent process stay ignored."""
    for name in SIGNALS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler, end):
            signal.signal(number, _interrupt)
    sys.unraisablehook = _without_dropped_interrupts
    sys.excepthook = _without_interrupts


def listen_no_more() -> None:
    """Ignore further termination signals at the end of the process."""
    for name in SIGNALS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is _interrupt:
            signal.signal(number, signal.SIG_IGN)


def is_interrupted() -> bool:
    """Return whether a signal arrived, even if its KeyboardInterrupt was lost."""
    return bool(_received)


def check() -> None:
    """Raise KeyboardInterrupt if a signal arrived; for any thread, between blocks of work."""
    if _received:
        raise KeyboardInterrupt


def _interrupt(number: int, _frame: FrameType | None) -> None:
    _received.append(number)
    raise KeyboardInterrupt


def _without_dropped_interrupts(dropped: Any) -> None:
    """Suppress the report of a lost KeyboardInterrupt, which is recorded; report other exceptions."""
    if not issubclass(dropped.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(dropped)


def _without_interrupts(kind: type[BaseException], error: BaseException, traceback: TracebackType | None) -> None:
    """Suppress the report of a KeyboardInterrupt lost in Cython code, as in SciPy's Sobol sequence."""
    if not issubclass(kind, KeyboardInterrupt):
        sys.__excepthook__(kind, error, traceback)
