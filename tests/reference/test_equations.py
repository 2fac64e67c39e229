"""Every equation has one function: run, export, linear model, solver and recording move with it."""

import shutil
from functools import lru_cache
from typing import Any

import pytest

from scripts.equations import PAGE, functions, listed, outcome_of, page_text, turned

TURNED = [name for name, one in functions().items() if "case" in one]
PLANT = tuple(f"({number}) " for number in range(1, 11))
"""Headings of the equations of the device on a bench."""


def test_the_page_has_the_functions_of_the_list() -> None:
    assert PAGE.read_text(encoding="utf-8") == page_text(), "run scripts/equations.py"


def test_all_functions_of_the_plant_are_changed_or_stand_for_one_that_is() -> None:
    plant = [
        one for section in listed()["section"] if section["title"].startswith(PLANT) for one in section["function"]
    ]
    assert len(plant) > 20
    assert [one["name"] for one in plant if one["name"] not in TURNED and one.get("stands_for") not in TURNED] == []


@lru_cache
def unchanged(case: str) -> dict[str, Any]:
    """Outcome of a case with the package as it is."""
    found = outcome_of(case)
    assert isinstance(found, dict), found
    return found


@pytest.mark.long
@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")
@pytest.mark.parametrize("name", TURNED)
def test_all_that_asks_a_changed_function_moves_or_the_change_is_refused_with_its_place(name: str) -> None:
    case = functions()[name]["case"]
    base = unchanged(case)
    for change, found in turned(name, case):
        if isinstance(found, str):
            assert f"ProgramError: {name.split('.')[-2]}.py:" in found
            continue
        assert found["compiled"] == found["python"] != base["compiled"], change
        assert found["exported"], change
        assert found.get("linear") is None or found["linear"] != base["linear"], change
        # Over the limits of the engine, and the part of the net torque that a recording does not account for.
        assert found.get("apart", 0.0) < 1.0, change
        assert found.get("open", 0.0) < 2.0 * base.get("open", 0.0) + 1.0e-3, change
