"""Start of the command line, ``ppafo`` or ``python -m ppafo``; an interrupt while modules load is no traceback."""

import sys


def start() -> int:
    """Run the command line and return its exit code."""
    try:
        from ppafo.cli.main import main

        return main()
    except KeyboardInterrupt:
        sys.stderr.write("ppafo: interrupted; nothing is half written\n")
        return 130


if __name__ == "__main__":
    sys.exit(start())
