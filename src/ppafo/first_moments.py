"""Handling of Ctrl-C during the first imports of the command line: a one-line message instead of a traceback.

Only modules that Python has already loaded are imported here, so that the handler is active early.
"""

import _signal  # type: ignore[import-not-found]
import os
import sys

_LINE = b"ppafo: interrupted; no file is incomplete\n"
_EXIT_CODE = 130
_COMMANDS = ("ppafo", "ppafo.exe", "ppafo-script.py")


def end(_number: int, _frame: object) -> None:
    """End the process immediately on an interrupt during start-up."""
    os.write(2, _LINE)
    os._exit(_EXIT_CODE)


def is_command_line() -> bool:
    """Return whether this process is the command line, ``ppafo`` or ``python -m ppafo``, and not an import."""
    started = sys.orig_argv
    by_module = any(started[place : place + 2] == ["-m", "ppafo"] for place in range(1, len(started) - 1))
    return by_module or os.path.basename(sys.argv[0] if sys.argv else "") in _COMMANDS  # noqa: PTH119


if is_command_line() and _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:
    _signal.signal(_signal.SIGINT, end)
