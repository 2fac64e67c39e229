"""``print(result)`` is what the command prints, and the short form is one line; neither prints an array."""

import pytest

import ppafo
from ppafo.cli.command_line import CommandGroup
from ppafo.cli.commands import COMMANDS
from ppafo.cli.main import main

FEWEST_ANALYSES = 14


def test_a_printed_answer_is_what_its_command_prints(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bottle", "--gas-per-stride", "0.3 g", "--stride-time", "1 s"]) == 0
    found = ppafo.bottle(gas_per_stride=3.0e-4, stride_time=1.0)
    assert capsys.readouterr().out == f"{found}\n"
    assert repr(found) == f"<{type(found.found).__name__}: {found.title}>"


def test_every_analysis_returns_a_finding_which_prints_saves_and_draws_itself() -> None:
    commands = [
        each for one in COMMANDS.values() for each in (one.actions.values() if isinstance(one, CommandGroup) else [one])
    ]
    own = [command.function() for command in commands]
    words = ((one.__name__, one.__annotations__["return"]) for one in own)
    returned = {
        name: result if isinstance(result, str) else str(result) if "[" in str(result) else result.__name__
        for name, result in words
    }
    found = {name for name, words in returned.items() if all("Finding[" in part for part in words.split(" | "))}
    assert len(found) >= FEWEST_ANALYSES
    others = {name: words for name, words in returned.items() if name not in found}
    assert set(others.values()) == {"CommandOutput"}, others
