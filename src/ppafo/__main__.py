"""Start of the command line, ``ppafo`` or ``python -m ppafo``; an interrupt while modules load is no traceback."""

import sys

from ppafo import interrupts


def start() -> int:
    """Run the command line and return its exit code, 130 after a signal to end."""
    try:
        interrupts.listen()
        from ppafo.cli.main import main

        code = main()
        interrupts.listen_no_more()
        return 130 if interrupts.is_interrupted() else code
    except (KeyboardInterrupt, RuntimeError, ImportError) as error:
        if not _is_interrupt(error):
            raise
        sys.stderr.write("ppafo: interrupted; nothing is half written\n")
        return 130


def _is_interrupt(error: BaseException | None) -> bool:
    """Tell whether an error comes of an interrupt: one that falls into the making of a class is wrapped by Python."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


if __name__ == "__main__":
    sys.exit(start())
