"""A setting means the same at every door: words of a user, drawn, against the single run with them."""

import shutil

import pytest

from ppafo.simulation import numbers
from ppafo.simulation.loading import list_scenarios
from ppafo.walking import list_walks
from scripts.one_meaning import at_library, at_study

needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")


@pytest.mark.parametrize("name", [*list_scenarios(), *list_walks()])
def test_columns_of_a_study_are_single_runs_with_the_same_words(name: str) -> None:
    found = at_study(name, 12, seed=11)
    assert found.differing == []
    assert found.same >= 4


@needs_gcc
@pytest.mark.parametrize("name", ["torque-task-slow-valve", "proportional-regulators"])
def test_settings_of_a_library_are_single_runs_with_the_same_words(name: str) -> None:
    found = at_library(name, 24, seed=13)
    assert found.differing == []
    assert found.same > 8


def test_a_door_at_which_nothing_follows_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numbers, "resolved", lambda _, replaced, *__: dict(replaced))
    # Which paths a seed draws depends on the numbers that there are; most draws have none that others follow.
    assert any(len(at_study("torque-task-solenoid", 60, seed=seed).differing) > 5 for seed in range(12, 32))
