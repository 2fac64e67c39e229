"""Every equation has one function: run, export, linear model, solver and recording move with it."""

import shutil
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import pytest

from scripts.equations import PAGE, functions, outcomes, page_text

TURNED = [name for name, one in functions().items() if "case" in one]

LARGEST_DEPARTURES = {"start": 1.0e-9, "linear": 2.0e-3, "isentrope": 1.0e-4}
"""Largest departures [-] of what follows from the equations; differences of runs have 6e-4."""


def test_the_page_has_the_functions_of_the_list() -> None:
    assert PAGE.read_text(encoding="utf-8") == page_text(), "run scripts/equations.py"


def test_all_functions_are_changed_or_stand_for_one_that_is_or_say_why_not() -> None:
    assert [
        name
        for name, one in functions().items()
        if not (name in TURNED or one.get("stands_for") in TURNED or one.get("why"))
    ] == []


@pytest.fixture(scope="module")
def outcome_of() -> Iterator[Callable[[str, str], Any]]:
    """Outcome of a case with a changed function, or with the package as it is."""
    with outcomes() as found:
        yield cache(found)


@pytest.mark.long
@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")
@pytest.mark.parametrize("name", TURNED)
def test_all_that_asks_a_changed_function_moves_or_the_change_is_refused_with_its_place(
    name: str, outcome_of: Callable[[str, str], Any]
) -> None:
    case = functions()[name]["case"]
    base = outcome_of(case, "")
    found = outcome_of(case, name)
    if isinstance(found, str):
        module = name.split(".")[-2]
        # A law that commands what no valve takes is refused by its name.
        assert f"ProgramError: {module}.py:" in found or f"KindError: controller '{module}'" in found
        return
    if "recorded" in base:
        assert found != base
        return
    assert found["compiled"] == found["python"] != base["compiled"]
    assert found["exported"]
    assert found.get("linear") is None or found["linear"] != base["linear"]
    # Over the limits of the engine, and the part of the net torque that a recording does not account for.
    assert found.get("apart", 0.0) < 1.0
    assert found.get("open", 0.0) < 2.0 * base.get("open", 0.0) + 1.0e-3
    departures = found.get("consequences", {})
    assert [each for each in departures if departures[each] > LARGEST_DEPARTURES[each]] == functions()[name].get(
        "breaks", []
    )
