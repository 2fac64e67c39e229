"""The parser of the command line: like any of argparse, but a mistake is one error, and it names what was mistyped."""

import argparse
import re
from collections.abc import Mapping, Sequence
from itertools import takewhile
from typing import TYPE_CHECKING, NoReturn, final

from ppafo.cli.output import flush_output, printing
from ppafo.errors import PpafoError, nearest_name

if TYPE_CHECKING:
    from _typeshed import SupportsWrite

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

REMOVED = {"--config": "name what is run without it, as in 'ppafo walk solenoid'"}
"""Options of version 0.1 that are none any more, and what to write instead."""


class UsageError(PpafoError):
    """The words after ``ppafo`` are not an order that it knows."""


@final
class CommandParser(argparse.ArgumentParser):
    """A parser that raises ``UsageError`` where argparse would print its usage and end the process."""

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


def check_command(word: str | None, known: Sequence[str], moved: Mapping[str, str]) -> None:
    """Refuse a word in the place of the command that names none; argparse would list them without the nearest.

    ``moved`` has, for each command of earlier versions, what does the same in a checkout of the repository.
    """
    if word is not None and word in moved:
        raise UsageError(f"'{word}' is no longer a command of the package: run {moved[word]} in a checkout of ppafo")
    if word is not None and word not in known:
        hint = nearest_name(word, known)
        raise UsageError(f"there is no command '{word}'{hint}; available: {', '.join(known)}")


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
