"""Calls with a value that no argument takes: refused, by an error that names the argument; part of the table."""

import pytest

import ppafo
from scripts.wrong_calls import calls, drawn, functions, tried, workplace

CALLS, SEED = 250, 7
WITHOUT_ARGUMENTS = {"list_gaits", "list_scenarios", "list_sets", "list_studies", "list_tunings", "list_walks"}


def test_no_wrong_call_is_accepted_and_each_error_names_the_argument() -> None:
    with workplace() as recording:
        known = functions(recording)
        outcomes = {call: tried(call, known) for call in drawn(known, CALLS, SEED)}
    assert {call: found for call, found in outcomes.items() if found.kind != "named"} == {}


def test_the_table_has_every_public_function_and_each_of_its_arguments() -> None:
    from inspect import isclass, signature

    public = {name: getattr(ppafo, name) for name in ppafo.__all__ if not isclass(getattr(ppafo, name))}
    with workplace() as recording:
        known = functions(recording)
    assert set(known) == set(public) - WITHOUT_ARGUMENTS
    assert {name: set(function.kinds) for name, function in known.items()} == {
        name: set(signature(public[name]).parameters) for name in known
    }
    assert len(calls(known)) > 3075


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (
            lambda: ppafo.sweep("s", []),
            "too many positional arguments; available: study, overrides=, draws=",
        ),
        (lambda: ppafo.find("s", vary="a", such_that="b", higest=True), "did you mean 'highest'?"),
        (lambda: ppafo.find("s"), "find() needs vary and such_that: "),
        (lambda: ppafo.simulate("s", scenario="x"), "multiple values for argument 'scenario'"),
    ],
)
def test_a_mistyped_call_is_answered_with_what_to_write(call, said) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ppafo.ArgumentError) as caught:
        call()
    assert said in str(caught.value)
