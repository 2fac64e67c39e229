"""Every question of the catalogue: its arguments are those of its function, it is a verb, its answer can be written."""

import inspect
import typing

import pytest

import ppafo
from ppafo.cli.main import build_parser
from ppafo.documents.toml_text import TomlKind
from ppafo.questions.catalogue import QUESTIONS, question
from ppafo.questions.question import Solved, load_name

NAMES = list(QUESTIONS)
NO_VERB_OF_ITS_OWN = {
    "walk": "compare_walks and walk_population are its verbs",
    "sweep": "the command also chooses the folder; ppafo.sweep is given it",
}


def solved_types(name: str) -> list[type]:
    """The classes that solving a question may return."""
    returned = typing.get_type_hints(question(name).solver())["return"]
    return list(typing.get_args(returned)) or [returned]


@pytest.mark.parametrize("name", NAMES)
def test_every_argument_is_a_parameter_of_what_solves_the_question(name: str) -> None:
    declared = question(name)
    signature = inspect.signature(declared.solver())
    given = {argument.parameter: None for argument in declared.arguments}
    assert all(sum(other.parameter == one for other in declared.arguments) == 1 for one in given if one != "highest")
    bound = signature.bind(**given, **({"progress": None} if "progress" in signature.parameters else {}))
    bound.apply_defaults()
    assert set(given) <= set(bound.arguments)


@pytest.mark.parametrize("name", NAMES)
def test_defaults_of_the_command_are_those_of_the_verb(name: str) -> None:
    declared = question(name)
    parameters = inspect.signature(declared.solver()).parameters
    for argument in declared.arguments:
        default = parameters[argument.parameter].default
        if default is not inspect.Parameter.empty:
            assert argument.default == default or not (argument.default or default), argument.words


@pytest.mark.parametrize("name", NAMES)
def test_what_a_question_comes_to_answers_draws_saves_and_becomes_data(name: str) -> None:
    for kind in solved_types(name):
        assert issubclass(kind, Solved)
        assert list(inspect.signature(load_name(f"{kind.__module__}:answer_of")).parameters)


@pytest.mark.parametrize("name", [name for name in NAMES if name not in NO_VERB_OF_ITS_OWN])
def test_every_question_is_a_verb_with_its_errors_documented(name: str) -> None:
    solver = question(name).solver()
    assert getattr(ppafo, solver.__name__) is solver
    assert solver.__doc__ is not None
    assert "Error" in solver.__doc__


@pytest.mark.parametrize("name", NAMES)
def test_the_parser_of_the_command_is_made_without_loading_what_solves_it(name: str) -> None:
    declared = question(name)
    help_text = build_parser(name).format_help()
    assert name in help_text
    if declared.library:
        assert isinstance(load_name(declared.library), TomlKind)
