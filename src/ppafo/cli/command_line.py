"""Command parsers from function signatures: parameters become arguments, the docstring becomes the help.

The parser is an argparse parser that reports each mistake as a single error naming the mistyped word.
"""

from __future__ import annotations

import argparse
import inspect
import re
import types
import typing
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import takewhile
from pathlib import Path
from types import CodeType
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, NoReturn, cast, final

from ppafo.arguments.reading import Word, number, whole_number
from ppafo.arguments.values import annotated_parameters
from ppafo.cli import output
from ppafo.documents.toml_text import TomlKind
from ppafo.errors import ArgumentError, PpafoError
from ppafo.kinds import kind_at
from ppafo.plugins import name_modules_in, name_plugins
from ppafo.wording import nearest_name, read_by

if TYPE_CHECKING:
    from importlib.abc import InspectLoader

PROGRESS = "progress"
"""Parameter of a command function for the progress display, not set on the command line."""
PLUGINS = "plugins"
"""Parameter of Python calls for user modules; the command line has the option ``--plugin``."""
OUT = "out"
"""Parameter of command functions that write their output themselves; all others have ``--out DIR``."""


_Verb = Callable[..., Any]
"""Command function: its signature defines the arguments, its return value the output."""
_NAMING = ("overrides", "tasks", "metric", "metrics", "also", "such_that", "form")
"""Parameters whose texts may name an object ``module:OBJECT`` of a user module."""


@dataclass(frozen=True, slots=True)
class Command:
    """Command of the command line: function as ``module:function``, and properties beyond its signature.

    ``listing`` is what ``--list`` prints: a function (``module:function``) that returns the entries, or the
    ``TomlKind`` of bundled files (``module:NAME``). ``listed`` is the noun for the entries of a function.
    ``default_folder`` maps the parameters by name to the result folder used without ``--out``; without it nothing is
    written by default.
    """

    verb: str
    listing: str = ""
    listed: str = ""
    default_folder: str = ""
    loaded_verb: _Verb | None = None
    """Function of a command from another package, in place of a location."""

    def function(self) -> _Verb:
        """Import and return the function of the command."""
        verb: _Verb = self.loaded_verb or kind_at(self.verb)
        return verb

    @property
    def summary(self) -> str:
        """Summary of the command: first line of the function's docstring."""
        module, _, name = self.verb.partition(":")
        if self.loaded_verb is None and (spec := find_spec(module)) is not None and spec.loader is not None:
            # Of the module as it is compiled: to run its imports would slow down the list of commands.
            code = cast("InspectLoader", spec.loader).get_code(module)
            parts = () if code is None else code.co_consts
            said = next(part.co_consts[0] for part in parts if isinstance(part, CodeType) and part.co_name == name)
        else:
            said = inspect.getdoc(self.function()) or ""
        first_line = str(said).split("\n", 1)[0]
        return first_line[:1].lower() + first_line[1:].rstrip(".")


@dataclass(frozen=True, slots=True)
class CommandGroup:
    """Commands with a common first word, such as ``sets audit`` and ``sets show``."""

    summary: str
    actions: Mapping[str, Command]


_PLAIN: Mapping[type, Word] = {
    str: Word("TEXT"),
    int: Word("N", whole_number),
    float: Word("NUMBER", number),
    Path: Word("FILE", Path),
}
"""Option types without an explicit ``Word``."""

_PARAMETER = re.compile(r"(\w+): (.*)")
"""Pattern of the first line on a parameter in the docstring of a command function."""


class _Argument(NamedTuple):
    """Argument of a command: parameter, and by its annotation the conversion of a text to its value.

    ``option`` is the name of the option; empty for a positional argument. Flags are always options.
    """

    parameter: inspect.Parameter
    word: Word
    option: str
    is_flag: bool
    is_repeated: bool
    choices: tuple[str, ...] | None

    @property
    def is_required(self) -> bool:
        """True if the parameter has no default."""
        return self.parameter.default is inspect.Parameter.empty


def arguments_of(verb: _Verb) -> Iterator[_Argument]:
    """Yield each argument that is set on the command line."""
    for name, parameter in annotated_parameters(verb).items():
        if name in (PROGRESS, PLUGINS):
            continue
        word = None
        annotation = parameter.annotation
        is_repeated = False
        while (origin := typing.get_origin(annotation)) not in (None, typing.Literal):
            inner = typing.get_args(annotation)
            if origin is Annotated:
                # Python flattens nested annotations with the outermost last: that one has the last word.
                word = word or next((item for item in reversed(inner) if isinstance(item, Word)), None)
            is_repeated |= isinstance(origin, type) and issubclass(origin, Iterable)
            annotation = next(item for item in inner if item is not types.NoneType)
        choices = typing.get_args(annotation) or None
        word = word or (Word("|".join(choices)) if choices else _PLAIN.get(annotation, Word("TEXT")))
        is_option = (is_flag := annotation is bool) or parameter.kind is inspect.Parameter.KEYWORD_ONLY
        option = word.option or (f"--{name.strip('_').replace('_', '-')}" if is_option else "")
        yield _Argument(parameter, word, option, is_flag, is_repeated or word.is_repeated, choices)


def add_parameters(parser: argparse.ArgumentParser, command: Command, is_listing: bool = False) -> None:
    """Add the parameters of a command to the parser, with ``--list`` if available, ``--json`` and ``--out``.

    With ``is_listing``, for a command line with ``--list``, none of the parameters is required.
    """
    verb = command.function()
    arguments = list(arguments_of(verb))
    names = [argument.parameter.name for argument in arguments]
    helps = _helps_in(inspect.getdoc(verb) or "", names)
    # argparse gives an optional word nothing where options stand between it and a repeated one.
    is_alone = sum(not argument.option for argument in arguments) == 1
    for name, argument in zip(names, arguments, strict=True):
        help_text = helps.get(name, argument.word.help)
        _add_argument(parser, argument, help_text, bool(command.listing) and is_alone, is_listing)
    if command.listing:
        parser.add_argument("--list", action="store_true", help="list what comes with the package")
    parser.add_argument("--json", action="store_true", help="print one JSON document instead of text")
    parser.add_argument(
        "--plugin",
        metavar="MODULE",
        action="append",
        default=[],
        help="your own Python module that files refer to, such as laws.py",
    )
    if OUT not in names:
        help_text = (
            "the result folder; default one in out/ named after what ran"
            if command.default_folder
            else "also write the result as files into this folder"
        )
        parser.add_argument("--out", metavar="DIR", type=Path, help=help_text)


def _helps_in(docstring: str, names: Collection[str]) -> dict[str, str]:
    """Return the help texts of the named parameters in a docstring, with indented continuations."""
    helps: dict[str, str] = {}
    name = ""
    depth = 0
    for line in docstring.splitlines():
        indent = len(line) - len(line.lstrip())
        # Only names of parameters: a sentence of the docstring may have a colon too.
        first_line = _PARAMETER.fullmatch(line.strip())
        if name and indent > depth:
            helps[name] += f" {line.strip()}"
        elif first_line is not None and first_line[1] in names:
            name = first_line[1]
            depth = indent
            helps[name] = first_line[2]
        else:
            name = ""
    return helps


def _add_argument(
    parser: argparse.ArgumentParser, argument: _Argument, help_text: str, may_be_missing: bool, is_listing: bool
) -> None:
    """Add a positional argument or an option; ``run`` refuses a missing positional argument."""
    name = argument.parameter.name
    option = argument.option
    is_required = argument.is_required
    default = None if is_required else argument.parameter.default
    if isinstance(default, float):
        help_text = help_text.replace("{default}", f"{100.0 * default:g}%")
    # argparse formats its help texts with %, so a per cent sign is doubled.
    options: dict[str, Any] = {"help": help_text.replace("%", "%%"), "default": default}
    if option:
        options["dest"] = name
    if argument.is_flag:
        parser.add_argument(option, action="store_true", **options)
        return

    def read(text: str) -> Any:
        try:
            return argument.word.read(text)
        except ArgumentError as error:
            # argparse prints the message of no error but its own.
            raise argparse.ArgumentTypeError(str(error)) from error

    options |= {"metavar": argument.word.metavar, "type": read, "choices": argument.choices}
    if not option:
        if argument.is_repeated:
            options["nargs"] = "+" if is_required and not is_listing else "*"
        # With --list the word may be missing; without it ``run`` refuses that.
        elif not is_required or may_be_missing or is_listing:
            options["nargs"] = "?"
        parser.add_argument(name, **options)
        return
    options["required"] = is_required and not is_listing
    if argument.is_repeated:
        # A list, because argparse cannot append to a tuple, which a verb may have as its default.
        options |= {"action": "append", "default": list(default or ())}
    parser.add_argument(option, **options)


def run(parsed: argparse.Namespace, name: str, command: Command) -> int:
    """Call the function of a command with parsed arguments, deliver its result, and return the exit code."""
    if command.listing and parsed.list:
        return output.deliver(listing_of(command), parsed.json, None, "")
    verb = command.function()
    parameters = inspect.signature(verb).parameters
    values = {name: getattr(parsed, name) for name in parameters if name not in (PROGRESS, PLUGINS)}
    name_plugins(parsed.plugin)
    name_modules_in(str([values[parameter] for parameter in _NAMING if parameter in values]))
    for argument in arguments_of(verb):
        if command.listing and values[argument.parameter.name] is None and argument.is_required:
            raise UsageError(
                f"no {argument.word.metavar.lower()} was given; 'ppafo {name} --list' shows the available names"
            )
    folder = None
    if OUT not in parameters:
        folder = parsed.out
        if folder is None and command.default_folder:
            with read_by("command line"):
                folder = kind_at(command.default_folder)(values)
        # Before the verb runs: a folder that is refused must not cost a long run.
        output.check_output(folder, name)
    with output.progress_line() as progress, read_by("command line"):
        answer = verb(**values, **({PROGRESS: progress} if PROGRESS in parameters else {}))
    return output.deliver(answer, parsed.json, folder, name, has_written=OUT in parameters)


def listing_of(command: Command) -> output.CommandOutput:
    """Return the list of what comes with the package for a command."""
    listed = kind_at(command.listing)
    if isinstance(listed, TomlKind):
        files = {name: listed.load(name).document for name in listed.names()}
        rows = [
            {"name": name} | {key: str(file[key]) for key in ("title", "description") if key in file}
            for name, file in files.items()
        ]
        return output.listing(listed.noun, rows, ("name", list(rows[0])[-1]))
    entries = listed()
    return entries if isinstance(entries, output.CommandOutput) else output.listing(command.listed, entries)


_BAD_VALUE = re.compile(r"argument (?:--?\w+/)*(\S+): (?!invalid )(.+: .+)")
"""Pattern of an argparse message for an ArgumentTypeError."""

_NEGATIVE_NUMBER = re.compile(r"-\d+|-\d*\.\d+")


class UsageError(PpafoError):
    """Invalid command-line arguments."""


@final
class CommandParser(argparse.ArgumentParser):
    """Argument parser that raises ``UsageError`` instead of printing its usage and ending the process."""

    def error(self, message: str) -> NoReturn:
        """Raise argparse's message as a one-line ``UsageError`` that names the help."""
        if (bad_value := _BAD_VALUE.fullmatch(message)) is not None:
            raise UsageError(f"{bad_value[1]} {bad_value[2]}")
        raise UsageError(f"{message.removeprefix('argument ')}; see '{self.prog} --help'")

    def _print_message(self, message: str, _file: object = None) -> None:
        """Print the text of ``--help`` or ``--version``; unlike argparse, a failed write is an error."""
        with output.printing():
            print(message, end="", flush=True)

    def options(self) -> set[str]:
        """Return all options of the parser and its subcommands."""
        options = {name for action in self._actions for name in action.option_strings}
        for action in self._actions:
            if isinstance(action.choices, Mapping):
                options = options.union(*(parser.options() for parser in action.choices.values()))
        return options


def check_options(words: Sequence[str], parser: CommandParser) -> None:
    """Raise UsageError for an unknown option, before argparse reports missing arguments."""
    known = sorted(parser.options())
    for word in takewhile(lambda word: word != "--", words):
        name = word.partition("=")[0]
        # As argparse has it: a dash alone, numbers and words with a space are values.
        is_value = not word.startswith("-") or len(word) == 1 or " " in word or _NEGATIVE_NUMBER.fullmatch(word)
        # An option stands for the beginning of a long one, or is a short one with its value behind it.
        is_known = name in known or any(
            option.startswith(name) if name.startswith("--") else len(option) == 2 and name.startswith(option)
            for option in known
        )
        if not is_value and not is_known:
            # Without the dashes, which all have in common and which would make strangers look alike.
            names = [option.removeprefix("--") for option in known if option.startswith("--")]
            hint = (
                ": write overrides = ['PATH=VALUE'] into the design file"
                if name == "--set" and "design" in words[:1]
                else nearest_name(name.strip("-"), names).replace("'", "'--", 1)
            )
            raise UsageError(f"there is no option '{name}'{hint}; available: {', '.join(known)}")
