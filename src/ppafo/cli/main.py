"""Entry point of the command line: finds the subcommand, turns errors into one line and an exit code."""

import argparse
import importlib
import sys
from collections.abc import Sequence

import ppafo
from ppafo.cli.catalog import COMMANDS
from ppafo.errors import PpafoError

EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130


def build_parser(chosen: str | None) -> argparse.ArgumentParser:
    """Return the parser; only the chosen subcommand's module is imported, so that help is quick."""
    parser = argparse.ArgumentParser(prog="ppafo", description="Model-based design of pneumatic powered orthoses.")
    parser.add_argument("--version", action="version", version=f"ppafo {ppafo.__version__}")
    subparsers = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, summary in COMMANDS.items():
        subparser = subparsers.add_parser(name, help=summary, description=summary)
        if name == chosen:
            module = importlib.import_module(f"ppafo.cli.{name}")
            module.add_arguments(subparser)
            subparser.set_defaults(run=module.run)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code: 0 good, 1 a check failed, 2 bad input, 130 interrupted."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    chosen = next((word for word in words if not word.startswith("-")), None)
    parsed = build_parser(chosen).parse_args(words)
    try:
        return int(parsed.run(parsed))
    except PpafoError as error:
        print(f"ppafo: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt:
        print("ppafo: interrupted; nothing was written", file=sys.stderr)
        return EXIT_INTERRUPTED
