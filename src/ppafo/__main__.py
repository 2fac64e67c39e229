"""Start of the command line, ``ppafo`` or ``python -m ppafo``, without a traceback on Ctrl-C."""

import os
import sys

from ppafo import interrupts


def start() -> int:
    """Run the command line and return its exit code, 130 after a termination signal."""
    # The next file that is opened would take the number of a closed stream, and what is printed would go into it.
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: PTH123, SIM115
    try:
        interrupts.listen()
        from ppafo.cli.main import main

        code = main()
        interrupts.listen_no_more()
        return 130 if interrupts.is_interrupted() else code
    except (KeyboardInterrupt, Exception) as error:
        # Python wraps an interrupt that falls into the making of a class in another error.
        if not (isinstance(error, KeyboardInterrupt) or interrupts.is_interrupted()):
            raise
        sys.stderr.write("ppafo: interrupted; no file is incomplete\n")
        return 130


if __name__ == "__main__":
    # ``python -m`` puts the working folder first, and with it whatever somebody called like a package that is absent.
    if not sys.flags.safe_path and sys.path[:1] == [os.getcwd()]:  # noqa: PTH109
        del sys.path[0]
    sys.exit(start())
