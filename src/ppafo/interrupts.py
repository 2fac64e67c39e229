"""Early end of the work: Ctrl-C, a request to end, or a terminal that closes, handled alike.

Each raises KeyboardInterrupt where the main thread is, and is remembered: a finaliser drops the exception, so does
compiled code that hands none on, and a library may catch it. Work that goes in blocks reads the memory between two of
them.
"""

import signal
import sys
from types import FrameType, TracebackType
from typing import Any

from ppafo.first_moments import end

SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")
_received: list[int] = []
"""Numbers of the signals that came; a list, since appending to it cannot be interrupted."""


def listen() -> None:
    """Let the signals end this process by KeyboardInterrupt; one that whoever started it lets be ignored stays so."""
    for name in SIGNALS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler, end):
            signal.signal(number, _interrupt)
    sys.unraisablehook = _without_dropped_interrupts
    sys.excepthook = _without_interrupts


def listen_no_more() -> None:
    """Let the signals do nothing any more: what was to be done is done, and the process ends at once."""
    for name in SIGNALS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is _interrupt:
            signal.signal(number, signal.SIG_IGN)


def is_interrupted() -> bool:
    """Tell whether a signal came, whatever became of its KeyboardInterrupt."""
    return bool(_received)


def check() -> None:
    """Raise KeyboardInterrupt where a signal came; for every thread, between two blocks of work."""
    if _received:
        raise KeyboardInterrupt


def _interrupt(number: int, _frame: FrameType | None) -> None:
    _received.append(number)
    raise KeyboardInterrupt


def _without_dropped_interrupts(dropped: Any) -> None:
    """Say nothing of an interrupt that was dropped: it is remembered."""
    if not issubclass(dropped.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(dropped)


def _without_interrupts(kind: type[BaseException], error: BaseException, traceback: TracebackType | None) -> None:
    """Say nothing of an interrupt that Cython prints itself before it drops it, as in SciPy's Sobol sequence."""
    if not issubclass(kind, KeyboardInterrupt):
        sys.__excepthook__(kind, error, traceback)
