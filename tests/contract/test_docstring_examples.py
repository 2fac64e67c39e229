"""Every command and every public function shows in its docstring how it is called, and prints what stands there."""

import doctest
import inspect
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import ppafo
from ppafo.cli.command_line import CommandGroup
from ppafo.cli.commands import COMMANDS

LONGEST = 6
"""Lines of an example with its answer."""
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def functions() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Each function by the name of its command, or else by its public name."""
    seen = set()
    for name, entry in COMMANDS.items():
        if isinstance(entry, CommandGroup):
            commands = {f"{name} {action}": command for action, command in entry.actions.items()}
        else:
            commands = {name: entry}
        for words, command in commands.items():
            seen.add(command.function())
            yield f"ppafo {words}", command.function()
    for name in ppafo.__all__:
        value = getattr(ppafo, name)
        if inspect.isfunction(value) and value not in seen:
            yield f"ppafo.{name}", value


FUNCTIONS = dict(functions())
COSTLY = ("ppafo design", "ppafo reproduce", "ppafo tune")
"""Examples that take many seconds: their pages run these commands."""


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_example_of_a_docstring_prints_what_it_shows(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    function = FUNCTIONS[name]
    scope = dict(vars(sys.modules[function.__module__]))
    example = doctest.DocTestParser().get_doctest(inspect.getdoc(function) or "", scope, name, None, 0)
    lines = sum(len((part.source + part.want).splitlines()) for part in example.examples)
    assert 2 <= lines <= LONGEST, f"{name}: its docstring needs an example of at most {LONGEST} lines, not {lines}"
    assert any(part.want for part in example.examples), f"{name}: its example prints nothing"
    if name in COSTLY:
        return
    monkeypatch.chdir(tmp_path)
    said: list[str] = []
    doctest.DocTestRunner(optionflags=FLAGS).run(example, out=said.append)
    assert not said, "".join(said)
