"""A command of this repository that is none of the package: its errors are one line and an exit code, as there."""

import argparse
import sys
from collections.abc import Callable, Sequence

from ppafo.cli.command_line import CommandParser, check_options
from ppafo.cli.main import EXIT_BAD_INPUT
from ppafo.cli.output import EXIT_INTERRUPTED
from ppafo.errors import PpafoError
from ppafo.wording import one_line


def run_command(
    prog: str,
    summary: str,
    add_arguments: Callable[[argparse.ArgumentParser], None],
    run: Callable[[argparse.Namespace], int],
    words: Sequence[str] | None = None,
) -> int:
    """Return the exit code, as ``ppafo`` has them, of a command with these words; those of the process where None."""
    given = sys.argv[1:] if words is None else list(words)
    parser = CommandParser(prog=prog, description=summary)
    add_arguments(parser)
    try:
        check_options(given, parser)
        return run(parser.parse_args(given))
    except PpafoError as error:
        print(f"{prog}: {one_line(error)}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt:
        print(f"{prog}: interrupted; no file is incomplete", file=sys.stderr)
        return EXIT_INTERRUPTED
