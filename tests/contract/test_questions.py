"""Every question of the catalogue: its arguments are those of its function, it is a verb, its answer can be written.

That of the how-to page is installed as a package of its own would be, and is a command by that.
"""

import inspect
import json
import sys
import types
import typing
from collections.abc import Iterator
from pathlib import Path

import pytest

import ppafo
from ppafo.cli.main import build_parser, main
from ppafo.documents.toml_text import TomlKind
from ppafo.questions.catalogue import QUESTIONS
from ppafo.questions.question import Solved, load_name
from ppafo.study.finding import Finding
from tests.page_code import code_blocks, write_package

NAMES = list(QUESTIONS)
NO_VERB_OF_ITS_OWN = {
    "walk": "compare_walks and walk_population are its verbs",
    "sweep": "the command also chooses the folder; ppafo.sweep is given it",
}


def solved_types(name: str) -> list[type]:
    """The classes that solving a question may return."""
    returned = typing.get_type_hints(QUESTIONS[name].solver())["return"]
    kinds = typing.get_args(returned) if typing.get_origin(returned) in (typing.Union, types.UnionType) else (returned,)
    return [typing.get_origin(kind) or kind for kind in kinds]


@pytest.mark.parametrize("name", NAMES)
def test_every_argument_is_a_parameter_of_what_solves_the_question(name: str) -> None:
    declared = QUESTIONS[name]
    signature = inspect.signature(declared.solver())
    given = {argument.parameter: None for argument in declared.arguments}
    assert all(sum(other.parameter == one for other in declared.arguments) == 1 for one in given if one != "highest")
    bound = signature.bind(**given, **({"progress": None} if "progress" in signature.parameters else {}))
    bound.apply_defaults()
    assert set(given) <= set(bound.arguments)


@pytest.mark.parametrize("name", NAMES)
def test_defaults_of_the_command_are_those_of_the_verb(name: str) -> None:
    declared = QUESTIONS[name]
    parameters = inspect.signature(declared.solver()).parameters
    for argument in declared.arguments:
        default = parameters[argument.parameter].default
        if default is not inspect.Parameter.empty:
            assert argument.default == default or not (argument.default or default), argument.words


@pytest.mark.parametrize("name", NAMES)
def test_what_a_question_comes_to_answers_draws_saves_and_becomes_data(name: str) -> None:
    for kind in solved_types(name):
        assert issubclass(kind, Solved)
        assert kind is Finding or list(inspect.signature(load_name(f"{kind.__module__}:answer_of")).parameters)


@pytest.mark.parametrize("name", [name for name in NAMES if name not in NO_VERB_OF_ITS_OWN])
def test_every_question_is_a_verb_with_its_errors_documented(name: str) -> None:
    solver, (home, _, verb) = QUESTIONS[name].solver(), QUESTIONS[name].solve.partition(":")
    result = solved_types(name)[0]
    names = {result.__name__: result.__module__, verb: home}
    imports = [f"    from {place} import {name} as {name}" for name, place in names.items()]
    homes = [f'    "{place}": ({", ".join(repr(n) for n in names if names[n] == place)},),' for place in names.values()]
    assert getattr(ppafo, verb, None) is solver, "\n".join(
        [
            "paste into src/ppafo/__init__.py, below TYPE_CHECKING:",
            *imports,
            "and into _HOMES:",
            *dict.fromkeys(homes),
            "then: python scripts/public_api.py",
        ]
    )
    assert solver.__doc__ is not None
    assert "Error" in solver.__doc__


@pytest.mark.parametrize("name", NAMES)
def test_the_parser_of_the_command_is_made_without_loading_what_solves_it(name: str) -> None:
    declared = QUESTIONS[name]
    help_text = build_parser(name).format_help()
    assert name in help_text
    if declared.library:
        assert isinstance(load_name(declared.library), TomlKind)


PAGE = "how-to/add-a-question.md"
WORDS = ("torque-task-proportional", "--pressure", "30 psi_g", "--pressure", "60 psi_g")


@pytest.fixture
def _installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The package of the page, as an installer leaves it, with one more question that cannot be loaded."""
    (module,), (entry_points,) = code_blocks(PAGE, "python"), code_blocks(PAGE, "toml")
    write_package(
        tmp_path / "site", "my_questions.pressures", module, f'{entry_points}broken = "my_questions.nothing:QUESTION"\n'
    )
    monkeypatch.syspath_prepend(tmp_path / "site")
    monkeypatch.chdir(tmp_path)
    yield
    for name in set(QUESTIONS) - set(NAMES):
        del QUESTIONS[name]
    for name in [name for name in sys.modules if name.split(".")[0] == "my_questions"]:
        del sys.modules[name]


@pytest.mark.usefixtures("_installed")
def test_a_question_of_another_package_is_a_command_that_answers_what_its_page_shows(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (shown,) = code_blocks(PAGE, "text")
    assert main(["pressures", *WORDS]) == 0
    assert capsys.readouterr().out == shown
    assert main(["my_questions.pressures:QUESTION", *WORDS, "--json", "--out", str(tmp_path / "out")]) == 0
    runs = json.loads(capsys.readouterr().out)["runs"]
    assert [run["supply.pressure"] for run in runs] == pytest.approx([308167.7, 515010.5])
    assert {"pressures.png", "pressures.json", "report.html"} <= {path.name for path in (tmp_path / "out").iterdir()}


@pytest.mark.usefixtures("_installed")
def test_a_question_of_another_package_is_in_the_help_and_in_hints_and_is_refused_in_one_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["pressure", *WORDS]) == 2
    assert "there is no command 'pressure', did you mean 'pressures'?" in capsys.readouterr().err
    assert "  pressures    show what a lower supply pressure costs" in build_parser(None).format_help()
    for words, said in (
        (["pressures", "torque-task"], "the following arguments are required: --pressure"),
        (["pressures", "torque-task", "--pressure", "40 psi_g"], "there is no scenario or walk 'torque-task'"),
        (
            ["pressures", "torque-task-solenoid", "--presure", "40 psi_g"],
            "no option '--presure', did you mean '--pressure'",
        ),
        (["broken"], "question 'broken' of package 'my-questions' cannot be loaded: ModuleNotFoundError"),
    ):
        assert main(words) == 2
        printed = capsys.readouterr().err
        assert said in printed
        assert printed.count("\n") == 1
