"""Entry point of the command line: parser of the requested command, one-line errors, shell completion."""

import argparse
import gc
import sys
from collections.abc import Sequence
from functools import partial

from ppafo import interrupts
from ppafo.cli.command_line import (
    Command,
    CommandGroup,
    CommandParser,
    UsageError,
    add_parameters,
    check_options,
    listing_of,
    run,
)
from ppafo.cli.commands import COMMANDS, OTHERS, check_words, list_commands
from ppafo.cli.output import EXIT_INTERRUPTED
from ppafo.errors import PpafoError
from ppafo.kinds import fault_of_user, kind_at
from ppafo.version import __version__
from ppafo.wording import one_line

# Completion of the command line for bash and zsh: one script, made from the same signatures as the parser.

SHELLS = ("bash", "zsh")
_NAMES = {
    "SCENARIO": "ppafo.loading:list_all_scenarios",
    "WALK": "ppafo.walking:list_walks",
    "SET": "ppafo.parameters:list_sets",
    "PARAMETERS": "ppafo.parameters:list_sets",
    "GAIT": "ppafo.gait:list_gaits",
    "BOTTLE": "ppafo.parameters.bottles.bottle:list_bottles",
}
"""Functions that list bundled names for completion, by value placeholder of the help."""
_SCRIPT = """\
{head}_ppafo() {{
  local word="${{COMP_WORDS[COMP_CWORD]}}" words="{commands}"
  if [ "$COMP_CWORD" -gt 1 ]; then
    case "${{COMP_WORDS[*]:1:$((COMP_CWORD - 1))}} " in
{cases}
    esac
  fi
  COMPREPLY=($(compgen -W "$words" -- "$word"))
}}
complete -o default -F _ppafo ppafo
"""
FIRST_STEPS = """\
Model-based design of pneumatic powered orthoses. Start with one of these:

see it
  ppafo simulate torque-task-proportional   the paper's torque task; figures and a report go to out/
  ppafo walk solenoid                       a minute of walking with the device
  ppafo workbench --out page.html           all of it with sliders, in a browser
the paper
  ppafo reproduce                           its experiments against its reported numbers
your device
  ppafo new set mine                        a file to fill in; also for a scenario, a study, a walk
  ppafo design push-off                     from a torque profile to valve, pressure and bottle
  ppafo identify FILE                       from bench recordings to parameters with intervals
learn
  ppafo new example                         the examples of the how-to pages, ready to run

All commands: ppafo --help"""
"""Output of ``ppafo`` without arguments."""
EXIT_BAD_INPUT = 2
_LONGEST_MESSAGE = 1000
OBJECTS_BETWEEN_COLLECTIONS = 1_000_000
"""Threshold of garbage collection at start; Python's default of 700 costs a tenth of the start-up time."""


def completion_script(shell: str) -> str:
    """Return the shell script that completes commands, options and bundled names."""
    # Words that may follow the first words of a line; a group after its actions.
    following: dict[str, list[str]] = {}
    for name, entry in COMMANDS.items():
        if isinstance(entry, CommandGroup):
            following |= {f"{name} {action} ": _words(command) for action, command in entry.actions.items()}
            following[f"{name} "] = list(entry.actions)
        else:
            following[f"{name} "] = _words(entry)
    cases = [f'      "{words}"*) words="{" ".join(choices)}" ;;' for words, choices in following.items()]
    head = "autoload -U +X bashcompinit && bashcompinit\n" if shell == "zsh" else ""
    return _SCRIPT.format(head=head, commands=" ".join(COMMANDS), cases="\n".join(cases))


def _words(command: Command) -> list[str]:
    """Return the options of a command, and the names accepted as values."""
    parser = CommandParser(add_help=True)
    add_parameters(parser, command)
    words = sorted(option for option in parser.options() if option.startswith("--"))
    if command.listing:
        words += [row["name"] for rows in listing_of(command).document.values() for row in rows]
    # Private, but argparse tells it nowhere else.
    for action in parser._actions:
        words += map(str, action.choices or ())
        words += kind_at(_NAMES[action.metavar])() if action.metavar in _NAMES else ()
    return list(dict.fromkeys(words))


def build_parser(words: Sequence[str]) -> CommandParser:
    """Build the parser; only the module of the requested command is imported, for speed."""
    names = [word for word in words if not word.startswith("-")]
    description = "Model-based design of pneumatic powered orthoses."
    if not names and any(word.startswith(("-h", "--h")) for word in words):
        # Only for the help, as the list loads the commands of other packages.
        description = f"{description}\n\n{list_commands()}"
    parser = CommandParser(
        prog="ppafo",
        usage="ppafo [-h] [--version] COMMAND ...",
        description=description,
        epilog="'ppafo COMMAND --help' shows what a command takes.\n"
        "'ppafo --completion bash' (or zsh) prints a script that completes commands, options and names.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )

    parser.add_argument("--version", action="version", version=f"ppafo {__version__}")
    subparsers = parser.add_subparsers(dest="command", metavar="COMMAND", prog="ppafo", help=argparse.SUPPRESS)
    for name in dict.fromkeys((*COMMANDS, *OTHERS)):
        # Of every other command the name alone: a verb that is not called is not imported.
        if name not in names[:1]:
            subparsers.add_parser(name)
            continue
        command = COMMANDS.get(name) or Command("", loaded_verb=OTHERS[name])
        if isinstance(command, CommandGroup):
            group = subparsers.add_parser(name, description=_sentence(command.summary))
            actions = group.add_subparsers(dest="action", metavar="ACTION", required=True)
            for action, member in command.actions.items():
                summary = member.summary
                subparser = actions.add_parser(action, help=summary, description=_sentence(summary))
                if action in names[1:2]:
                    _add_command(subparser, f"{name} {action}", member, words)
        else:
            subparser = subparsers.add_parser(name, description=_sentence(command.summary))
            _add_command(subparser, name, command, words)
    return parser


def _add_command(parser: argparse.ArgumentParser, name: str, command: Command, words: Sequence[str]) -> None:
    add_parameters(parser, command, is_listing="--list" in words)
    parser.set_defaults(run=partial(run, name=name, command=command))


def _sentence(summary: str) -> str:
    return f"{summary[:1].upper()}{summary[1:]}."


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code: 0 success, 1 failed check, 2 bad input, 130 interrupted."""
    # A call from Python: its process goes on, and so must its garbage collection.
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
                raise UsageError(f"'{one_line(word)}' is not valid UTF-8; rename the file or folder")
        if words[:1] == ["--completion"]:  # its shell is a word that is no command
            if len(words) != 2 or words[1] not in SHELLS:
                raise UsageError(f"--completion {' '.join(words[1:])}: must be {' or '.join(SHELLS)}")
            print(completion_script(words[1]))
            return 0
        check_words(words)
        parser = build_parser(words)
        # Before argparse, which would complain of what is missing first.
        check_options(words, parser)
        parsed, unknown = parser.parse_known_args(words)
        if unknown:
            shown = " ".join(word for word in (parsed.command, getattr(parsed, "action", None)) if word)
            raise UsageError(f"unrecognized arguments: {' '.join(unknown)}; see 'ppafo {shown} --help'")
        if parsed.command is None:
            print(FIRST_STEPS, file=sys.stderr)
            return EXIT_BAD_INPUT
        return int(parsed.run(parsed))
    except PpafoError as error:
        interrupts.check()  # what an interrupt broke is no mistake of the user's
        lines = [f"{len(error.parts)} things are wrong:", *error.parts] if error.parts else [str(error)]
        for number, line in enumerate(map(one_line, lines)):
            # Without its middle where it repeats far more of the input than anybody reads.
            is_long = len(line) > _LONGEST_MESSAGE
            half = _LONGEST_MESSAGE // 2
            shown = f"{line[:half]} ... {line[-half:]}" if is_long else line
            print(f"{'  ' if number else 'ppafo: '}{shown}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except Exception as error:  # what a kind of another package raises while it runs is anybody's guess
        if not (line := fault_of_user(error)):
            raise
        print(f"ppafo: {one_line(line)}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt as interrupt:
        print(f"ppafo: {str(interrupt) or 'interrupted; no file is incomplete'}", file=sys.stderr)
        return EXIT_INTERRUPTED
