"""Entry point of the command line: finds the subcommand, turns errors into one line and an exit code."""

import argparse
import gc
import importlib
import sys
from collections.abc import Sequence
from functools import partial

from ppafo.cli.arguments import CommandParser, UsageError, check_command, check_options
from ppafo.cli.catalog import COMMANDS, GROUPS, MOVED
from ppafo.errors import PpafoError, one_line
from ppafo.questions.catalogue import QUESTIONS, question
from ppafo.version import __version__

EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130
_LONGEST_MESSAGE = 1000

OBJECTS_BETWEEN_COLLECTIONS = 1_000_000
"""The usual 700 make Python look for garbage hundreds of times while it imports, which is a tenth of a start."""


def build_parser(chosen: str | None) -> CommandParser:
    """Return the parser; only the chosen subcommand's module is imported, so that help is quick."""
    parser = CommandParser(
        prog="ppafo",
        usage="ppafo [-h] [--version] COMMAND ...",
        description=f"Model-based design of pneumatic powered orthoses.\n\n{_list_commands()}",
        epilog="'ppafo COMMAND --help' shows what a command takes.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"ppafo {__version__}")
    subparsers = parser.add_subparsers(dest="command", metavar="COMMAND", prog="ppafo", help=argparse.SUPPRESS)
    for name, summary in COMMANDS.items():
        subparser = subparsers.add_parser(name, description=summary)
        if name == chosen and name in QUESTIONS:
            from ppafo.cli import question as runner

            declared = question(name)
            runner.add_arguments(subparser, declared)
            subparser.set_defaults(run=partial(runner.run, question=declared))
        elif name == chosen:
            module = importlib.import_module(f"ppafo.cli.{name}")
            module.add_arguments(subparser)
            subparser.set_defaults(run=module.run)
    return parser


def _list_commands() -> str:
    """Return the commands with what each does, group by group."""
    width = max(map(len, COMMANDS))
    groups = [
        "\n".join([f"{title}:", *(f"  {name:<{width}}  {COMMANDS[name]}" for name in names)])
        for title, names in GROUPS.items()
    ]
    return "\n\n".join(groups)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code: 0 good, 1 a check failed, 2 bad input, 130 interrupted."""
    if arguments is not None:
        return _run(list(arguments))
    gc.set_threshold(OBJECTS_BETWEEN_COLLECTIONS)
    try:
        return _run(sys.argv[1:])
    finally:
        gc.disable()  # the process ends here, and Python would look through everything once more


def _run(words: list[str]) -> int:
    try:
        parsed = _parse(words)
        return int(parsed.run(parsed))
    except PpafoError as error:
        print(f"ppafo: {_readable(one_line(error))}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt as interrupt:
        print(f"ppafo: {str(interrupt) or 'interrupted; nothing is half written'}", file=sys.stderr)
        return EXIT_INTERRUPTED


def _readable(message: str) -> str:
    """Return a message without its middle where it repeats far more of the input than anybody reads."""
    if len(message) <= _LONGEST_MESSAGE:
        return message
    return f"{message[: _LONGEST_MESSAGE // 2]} ... {message[-_LONGEST_MESSAGE // 2 :]}"


def _parse(words: list[str]) -> argparse.Namespace:
    _check_text(words)
    chosen = next((word for word in words if not word.startswith("-")), None)
    check_command(chosen, tuple(COMMANDS), MOVED)
    parser = build_parser(chosen)
    check_options(words, parser)
    parsed = parser.parse_args(words)
    if parsed.command is None:
        raise UsageError(
            "no command was given; 'ppafo --help' lists them; try 'ppafo simulate torque-task-proportional' first"
        )
    return parsed


def _check_text(words: list[str]) -> None:
    """Refuse, before anything runs, a name that is not UTF-8: no result could say which file it is of."""
    for word in words:
        if not word.isascii() and any("\ud800" <= character <= "\udfff" for character in word):
            raise UsageError(f"'{one_line(word)}' is not text in UTF-8; give the file or folder another name")
