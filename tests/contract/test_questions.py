"""Every verb: its signature is read, its defaults are those of what solves it, its answer can be written.

The command of the how-to page is installed as a package of its own would be, and is a command by that.
"""

import inspect
import json
import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from ppafo.analyses.linearise.model import EQUILIBRIUM
from ppafo.cli import output
from ppafo.cli.command_line import Command, CommandGroup, arguments_of
from ppafo.cli.commands import COMMANDS, OTHERS
from ppafo.cli.main import build_parser, main
from ppafo.parameters.publications.publication import PAPER
from ppafo.validation.settings import DEFAULT_LIMIT
from tests.page_code import block_with, write_package

VERBS: dict[str, Command] = {
    f"{name} {action}".strip(): command
    for name, one in COMMANDS.items()
    for action, command in (one.actions if isinstance(one, CommandGroup) else {"": one}).items()
}


@pytest.mark.parametrize("name", VERBS)
def test_every_parameter_of_a_verb_has_its_help_and_every_option_one_meaning(name: str) -> None:
    verb = VERBS[name].function()
    arguments = list(arguments_of(verb))
    for name_of, word in ((argument.parameter.name, argument.word) for argument in arguments):
        said = re.search(rf"^(?: {{4}})?{name_of}: \S", inspect.getdoc(verb) or "", re.MULTILINE)
        assert said is not None or word.help, name_of
    named = [argument.option for argument in arguments if argument.option]
    assert len(set(named)) == len(named)
    parser = build_parser(name.split())
    assert {*named, "--json", "--out"} <= parser.options()


def test_defaults_that_are_written_in_a_signature_are_those_of_the_modules() -> None:
    defaults = {
        "validate longest_delay": DEFAULT_LIMIT,
        "linearise at": EQUILIBRIUM,
        "reproduce study": PAPER,
    }
    for words, value in defaults.items():
        name, argument = words.split()
        assert inspect.signature(VERBS[name].function()).parameters[argument].default == value, words


def plain(
    name: str, times: int, *, files: Sequence[Path] = (), share: float = 0.5, loud: bool = False
) -> output.CommandOutput:
    """Say what was given.

    name: who
    times: how often
    files: some files
    share: a number; 50% unless given
    loud: whether to say it aloud
    """
    given = {"name": name, "times": times, "files": [str(file) for file in files], "share": share, "loud": loud}
    return output.CommandOutput(repr(given), given)


def test_a_function_with_plain_types_is_a_command(capsys: pytest.CaptureFixture[str]) -> None:
    OTHERS["plain"] = plain  # type: ignore[assignment]
    try:
        assert main(["plain", "me", "3", "--files", "a", "--files", "b", "--share", "0.25", "--loud", "--json"]) == 0
        found = json.loads(capsys.readouterr().out)
        assert found == {"name": "me", "times": 3, "files": ["a", "b"], "share": 0.25, "loud": True}
        assert main(["plain", "me", "often"]) == 2
        assert "often: must be a whole number" in capsys.readouterr().err
        assert main(["plain", "me", "3"]) == 0
        assert "'loud': False" in capsys.readouterr().out
        with pytest.raises(SystemExit):
            main(["plain", "--help"])
        assert "a number; 50% unless given" in capsys.readouterr().out
    finally:
        del OTHERS["plain"]


PAGE = "how-to/extend.md"
WORDS = ("torque-task-proportional", "--pressure", "30 psi_g", "--pressure", "60 psi_g")


@pytest.fixture
def _installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The package of the page, as an installer leaves it, with one more command that cannot be loaded."""
    module, entry_points = block_with(PAGE, "def pressures("), block_with(PAGE, 'entry-points."ppafo.commands"')
    write_package(
        tmp_path / "site", "my_analyses.pressures", module, f'{entry_points}broken = "my_analyses.nothing:broken"\n'
    )
    monkeypatch.syspath_prepend(tmp_path / "site")
    monkeypatch.chdir(tmp_path)
    yield
    for name in list(OTHERS):
        del OTHERS[name]
    for name in [name for name in sys.modules if name.split(".")[0] == "my_analyses"]:
        del sys.modules[name]


@pytest.mark.usefixtures("_installed")
def test_a_function_of_another_package_is_a_command_that_answers_what_its_page_shows(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = block_with(PAGE, "2 of 2 runs")
    assert main(["pressures", *WORDS]) == 0
    assert capsys.readouterr().out == shown
    assert main(["my_analyses.pressures:pressures", *WORDS, "--json", "--out", str(tmp_path / "out")]) == 0
    runs = json.loads(capsys.readouterr().out)["runs"]
    assert [run["supply.pressure"] for run in runs] == pytest.approx([308167.7, 515010.5])
    assert {"pressures.png", "pressures.json", "report.html"} <= {path.name for path in (tmp_path / "out").iterdir()}


@pytest.mark.usefixtures("_installed")
def test_a_command_of_another_package_is_in_the_help_and_in_hints_and_is_refused_in_one_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["pressure", *WORDS]) == 2
    assert "there is no command 'pressure', did you mean 'pressures'?" in capsys.readouterr().err
    assert "  pressures    show what a lower supply pressure costs" in build_parser(["--help"]).format_help()
    for words, said in (
        (["pressures", "torque-task"], "the following arguments are required: --pressure"),
        (["pressures", "torque-task", "--pressure", "40"], "there is no scenario or walk 'torque-task'"),
        (["pressures", "torque-task-solenoid", "--presure", "40"], "no option '--presure', did you mean '--pressure'"),
        (["broken"], "command 'broken' of package 'my-analyses' cannot be loaded: ModuleNotFoundError"),
    ):
        assert main(words) == 2
        printed = capsys.readouterr().err
        assert said in printed
        assert printed.count("\n") == 1
