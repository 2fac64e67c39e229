"""Completion of the command line for bash and zsh: one script, made from the same signatures as the parser.

shtab would take an extra and the parser of all commands at once, and complete no names of scenarios by itself.
"""

from collections.abc import Iterator

from ppafo.cli.command_line import Command, CommandParser, Group, add_parameters
from ppafo.cli.commands import COMMANDS
from ppafo.kinds import kind_at

SHELLS = ("bash", "zsh")
_NAMES = {
    "SCENARIO": "ppafo.loading:list_all_scenarios",
    "WALK": "ppafo.walking:list_walks",
    "SET": "ppafo.parameters:list_sets",
    "PARAMETERS": "ppafo.parameters:list_sets",
    "GAIT": "ppafo.gait:list_gaits",
    "BOTTLE": "ppafo.parameters.bottles.bottle:list_bottles",
}
"""What lists the names that come with the package, by the word for a value in the help."""
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


def completion_script(shell: str) -> str:
    """Return the script that completes commands, options and names of the package in a shell of ``SHELLS``."""
    cases = [f'      "{words}"*) words="{" ".join(found)}" ;;' for words, found in _cases()]
    head = "autoload -U +X bashcompinit && bashcompinit\n" if shell == "zsh" else ""
    return _SCRIPT.format(head=head, commands=" ".join(COMMANDS), cases="\n".join(cases))


def _cases() -> Iterator[tuple[str, list[str]]]:
    """Yield the first words of a line, and what may follow them; a group after its actions."""
    for name, one in COMMANDS.items():
        if isinstance(one, Group):
            yield from ((f"{name} {action} ", _words(command)) for action, command in one.actions.items())
            yield f"{name} ", list(one.actions)
        else:
            yield f"{name} ", _words(one)


def _words(command: Command) -> list[str]:
    """Return the options of a command, and the names that its values may have."""
    parser = CommandParser(add_help=True)
    add_parameters(parser, command)
    found = sorted(option for option in parser.options() if option.startswith("--"))
    if command.library:
        found += kind_at(command.library).names()
    # Private, but argparse tells it nowhere else.
    for action in parser._actions:
        found += map(str, action.choices or ())
        found += kind_at(_NAMES[action.metavar])() if action.metavar in _NAMES else ()
    return list(dict.fromkeys(found))
