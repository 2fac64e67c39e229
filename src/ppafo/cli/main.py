"""Entry point of the command line: the commands, their parser, and errors as one line and an exit code.

The parser is like any of argparse, but a mistake is one error, and it names what was mistyped.
"""

import argparse
import gc
import importlib
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import takewhile
from typing import TYPE_CHECKING, NoReturn, final

from ppafo import interrupts
from ppafo.cli.output import flush_output, printing
from ppafo.errors import PpafoError, nearest_name, one_line
from ppafo.questions.catalogue import QUESTIONS
from ppafo.version import __version__

if TYPE_CHECKING:
    from _typeshed import SupportsWrite


SUBCOMMANDS: dict[str, dict[str, str]] = {
    "the paper": {},
    "your device": {
        "new": "write an input file to start from: a template, or a copy of a shipped one",
        "examples": "list the examples of the how-to pages, or write one into a folder, ready to run",
        "simulate": "run a scenario and write its recording, metrics and figure",
        "workbench": "write scenarios as one page that simulates them while sliders are dragged",
        "plot": "redraw the figures of a result folder",
        "sets": "list parameter sets, or show one with the source of every value",
        "audit": "check a parameter set for contradictions",
    },
    "from bench to model": {
        "record": "record a bench that speaks the protocol of 'ppafo hil'",
        "rig": "record synthetic bench data on the virtual test rig",
    },
    "decide": {},
    "walk": {
        "gait": "list, show and import gaits",
    },
    "tools": {
        "export": "write a scenario or a walk for other tools: a library in C, an FMU, a controller for 'ppafo hil'",
        "firmware": "write the controller of a scenario as firmware for a small processor",
        "chip": "run a scenario with its controller on the simulator of a small processor",
        "hil": "run a scenario's plant in real time against a controller at a serial port or over UDP",
        "cache": "show, compile or remove the compiled models of this computer",
        "schema": "print the JSON Schema of a file format",
    },
}
"""Headings of the help, by what somebody has come for, and under each the subcommands that are no questions.

A subcommand is a module of ``cli`` with ``add_arguments`` and ``run``. Questions say their heading themselves.
"""

COMMANDS = (*(name for group in SUBCOMMANDS.values() for name in group), *QUESTIONS)
"""The commands of this package; questions of other packages are commands too."""

FIRST_STEPS = """\
Model-based design of pneumatic powered orthoses. Start with one of these:

see it
  ppafo simulate torque-task-proportional   the paper's torque task; figures and a report go to out/
  ppafo walk solenoid                       a minute of walking with the device
  ppafo workbench --out page.html           all of it with sliders, in a browser
the paper
  ppafo reproduce                           its experiments against its printed numbers
your device
  ppafo new set mine                        a file to fill in; also for a scenario, a study, a walk
  ppafo design push-off                     from a torque profile to valve, pressure and bottle; also from a wearer
  ppafo identify FILE                       from bench recordings to parameters with intervals
learn
  ppafo examples                            the examples of the how-to pages, ready to run

All commands: ppafo --help"""
"""What ``ppafo`` alone prints."""

MOVED: dict[str, str] = {
    "bench": "'python -m benchmarks' or 'make bench'",
    "coverage": "'python scripts/interval_coverage.py'",
}
"""Commands that the package had once, and what does the same in a checkout of the repository."""

JOINED: dict[str, str] = {"size": "design"}
"""Commands that are part of another one, which takes the same words."""


_BAD_VALUE = re.compile(r"argument (?:--?\w+/)*(\S+): (?!invalid )(.+: .+)")
"""What argparse makes of an ArgumentTypeError."""

_NEGATIVE_NUMBER = re.compile(r"-\d+|-\d*\.\d+")


RENAMED = {
    "--first": "--first-draws",
    "--maximum": "--draws",
    "--most": "--draws",
    "--most-failed": "--maximum-failed",
    "--runs": "--draws",
    "--least-strides": "--minimum-strides",
}
"""Options of version 0.1 and what they are called now."""

STILL_READ = {"--gas-per-step": "--gas-per-stride", "--step-time": "--stride-time"}
"""Options of 0.2 and their present names, under which they are read for one more version; then they are ``RENAMED``."""

REMOVED = {"--config": "name what is run without it, as in 'ppafo walk solenoid'"}
"""Options of version 0.1 that are none any more, and what to write instead."""


class UsageError(PpafoError):
    """The words after ``ppafo`` are not an order that it knows."""


@final
class CommandParser(argparse.ArgumentParser):
    """A parser that raises ``UsageError`` where argparse would print its usage and end the process."""

    list_commands: Callable[[], str] | None = None
    """What follows the description in the help; made only there, as it loads every question."""

    def format_help(self) -> str:
        """Return the help, with the commands where there are some."""
        if self.list_commands is not None:
            self.description, self.list_commands = f"{self.description}\n\n{self.list_commands()}", None
        return super().format_help()

    def error(self, message: str) -> NoReturn:
        """Raise the message of argparse as an error of one line that names the help to look at."""
        bad_value = _BAD_VALUE.fullmatch(message)
        if bad_value is not None:
            raise UsageError(f"{bad_value[1]} {bad_value[2]}")
        raise UsageError(f"{message.removeprefix('argument ')}; see '{self.prog} --help'")

    def _print_message(self, message: str, file: "SupportsWrite[str] | None" = None) -> None:
        """Print a help text; some versions of Python leave it to the caller that it cannot be written."""
        with printing():
            super()._print_message(message, file)

    def exit(self, status: int = 0, message: str | None = None) -> NoReturn:
        """End the process after ``--help`` or ``--version``, once their text has really been written."""
        flush_output()
        super().exit(status, message)

    def options(self) -> set[str]:
        """Return every option of this parser and of the subcommands that it knows."""
        found = {name for action in self._actions for name in action.option_strings}
        for action in self._actions:
            if isinstance(action.choices, Mapping):
                found = found.union(*(parser.options() for parser in action.choices.values()))
        return found


def check_command(word: str | None) -> None:
    """Refuse a word in the place of the command that names none; argparse would list them without the nearest.

    KindError for a question of another package that is there and cannot be used.
    """
    if word is None or word in COMMANDS:
        return
    if word in MOVED:
        raise UsageError(f"'{word}' is no longer a command of the package: run {MOVED[word]} in a checkout of ppafo")
    if word in JOINED:
        raise UsageError(f"'{word}' is now part of '{JOINED[word]}': 'ppafo {JOINED[word]}' takes the same arguments")
    if word not in QUESTIONS:
        known = tuple(dict.fromkeys((*COMMANDS, *QUESTIONS)))
        hint = nearest_name(word, known)
        raise UsageError(f"there is no command '{word}'{hint}; available: {', '.join(known)}")


def present_options(words: list[str], parser: CommandParser) -> list[str]:
    """Return the words with options by their present names; one line for each that has another."""
    known, present = parser.options(), list(words)
    for place, word in enumerate(takewhile(lambda word: word != "--", words)):
        name, equals, value = word.partition("=")
        now = STILL_READ.get(name)
        if now in known:
            print(f"ppafo: {name} is now called {now}; the old name is read in this version only", file=sys.stderr)
            present[place] = f"{now}{equals}{value}"
    return present


def check_options(words: Sequence[str], parser: CommandParser) -> None:
    """Refuse an option that no part of the parser has, before argparse complains of what it finds missing besides."""
    known = sorted(parser.options())
    for word in takewhile(lambda word: word != "--", words):
        name = word.partition("=")[0]
        if name in RENAMED and name not in known and RENAMED[name] in known:
            raise UsageError(f"{name} is now called {RENAMED[name]}")
        if _looks_like_option(word) and not any(_stands_for(name, option) for option in known):
            if name in REMOVED:
                raise UsageError(f"there is no option '{name}' any more: {REMOVED[name]}")
            raise UsageError(
                f"there is no option '{name}'{_nearest_option(name, known)}; available: {', '.join(known)}"
            )


def _nearest_option(name: str, known: Sequence[str]) -> str:
    """Return the hint; the dashes, which all have in common, would make strangers look alike."""
    hint = nearest_name(name.strip("-"), [option.removeprefix("--") for option in known if option.startswith("--")])
    return hint.replace("'", "'--", 1)


def _looks_like_option(word: str) -> bool:
    """Tell whether argparse takes a word for an option: a dash alone, numbers and words with a space are values."""
    is_number = _NEGATIVE_NUMBER.fullmatch(word) is not None
    return word.startswith("-") and len(word) > 1 and " " not in word and not is_number


def _stands_for(name: str, option: str) -> bool:
    """Tell whether a name is an option, the beginning of a long one, or a short one with its value behind it."""
    if name.startswith("--"):
        return option.startswith(name)
    return name == option or (len(option) == 2 and name.startswith(option))


EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130
_LONGEST_MESSAGE = 1000
_DURATION = "run.duration"

OBJECTS_BETWEEN_COLLECTIONS = 1_000_000
"""The usual 700 make Python look for garbage hundreds of times while it imports, which is a tenth of a start."""


def build_parser(chosen: str | None) -> CommandParser:
    """Return the parser; only the chosen subcommand's module is imported, so that help is quick."""
    parser = CommandParser(
        prog="ppafo",
        usage="ppafo [-h] [--version] COMMAND ...",
        description="Model-based design of pneumatic powered orthoses.",
        epilog="'ppafo COMMAND --help' shows what a command takes.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.list_commands = _list_commands
    parser.add_argument("--version", action="version", version=f"ppafo {__version__}")
    subparsers = parser.add_subparsers(dest="command", metavar="COMMAND", prog="ppafo", help=argparse.SUPPRESS)
    plain = {name: summary for group in SUBCOMMANDS.values() for name, summary in group.items()}
    for name in dict.fromkeys((*COMMANDS, *QUESTIONS)):
        if name != chosen:
            subparsers.add_parser(name)
        elif name in plain:
            subparser = subparsers.add_parser(name, description=plain[name])
            module = importlib.import_module(f"ppafo.cli.{name}")
            module.add_arguments(subparser)
            subparser.set_defaults(run=module.run)
        else:
            from ppafo.cli import question as runner

            declared = QUESTIONS[name]
            subparser = subparsers.add_parser(name, description=declared.summary)
            runner.add_arguments(subparser, declared)
            subparser.set_defaults(run=partial(runner.run, question=declared))
    return parser


def _list_commands() -> str:
    """Return the commands with what each does, group by group, with the questions of other packages."""
    QUESTIONS.load_all()
    groups = {heading: dict(group) for heading, group in SUBCOMMANDS.items()}
    for name, declared in QUESTIONS.loaded().items():
        groups.setdefault(declared.group, {})[name] = declared.summary
    width = max(len(name) for group in groups.values() for name in group)
    return "\n\n".join(
        "\n".join([f"{heading}:", *(f"  {name:<{width}}  {summary}" for name, summary in group.items())])
        for heading, group in groups.items()
    )


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
        # Refuse, before anything runs, a name that is not UTF-8: no result could say which file it is of.
        for word in words:
            if not word.isascii() and any("\ud800" <= character <= "\udfff" for character in word):
                raise UsageError(f"'{one_line(word)}' is not text in UTF-8; give the file or folder another name")
        chosen = next((word for word in words if not word.startswith("-")), None)
        check_command(chosen)
        parser = build_parser(chosen)
        words = present_options(words, parser)
        check_options(words, parser)
        parsed = parser.parse_args(words)
        if parsed.command is None:
            print(FIRST_STEPS, file=sys.stderr)
            return EXIT_BAD_INPUT
        _check_duration_once(getattr(parsed, "overrides", ()), getattr(parsed, "minutes", None))
        return int(parsed.run(parsed))
    except PpafoError as error:
        interrupts.check()  # what an interrupt broke is no mistake of the user's
        lines = [f"{len(error.parts)} things are wrong:", *error.parts] if error.parts else [str(error)]
        print("ppafo: " + "\n  ".join(_readable(one_line(line)) for line in lines), file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt as interrupt:
        print(f"ppafo: {str(interrupt) or 'interrupted; nothing is half written'}", file=sys.stderr)
        return EXIT_INTERRUPTED


def _check_duration_once(overrides: Sequence[str], minutes: object) -> None:
    """Refuse a duration that is set beside an option for it."""
    if minutes is not None and any(override.partition("=")[0].strip() == _DURATION for override in overrides):
        raise UsageError(f"--set {_DURATION}: the same as --minutes; leave one out")


def _readable(message: str) -> str:
    """Return a message without its middle where it repeats far more of the input than anybody reads."""
    if len(message) <= _LONGEST_MESSAGE:
        return message
    return f"{message[: _LONGEST_MESSAGE // 2]} ... {message[-_LONGEST_MESSAGE // 2 :]}"
