"""The WebAssembly programs that come with the package are those of its physics as it is."""

from typing import Never

import pytest

from ppafo.exports.c_library import library_of
from ppafo.loading import load_scenario
from ppafo.page import wasm
from ppafo.simulation.loading import list_scenarios
from ppafo.walking import list_walks

RENEW = "python scripts/wasm_programs.py builds them anew"


class StaleError(Exception):
    """A program is not there, and would be built."""


def must_not_build(*_given: object) -> Never:
    """Stands for the compiler."""
    raise StaleError


def is_stale(name: str) -> bool:
    """Whether the page of a scenario or a walk would need a program that does not come with the package."""
    scenario = load_scenario(name)
    try:
        wasm.program_of(library_of(scenario), scenario)
    except StaleError:
        return True
    return False


@pytest.fixture
def _without_a_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wasm, "check_can_build", must_not_build)


@pytest.mark.short
@pytest.mark.usefixtures("_without_a_compiler")
def test_every_scenario_and_walk_has_its_program() -> None:
    """Some tenths of a second for each whose functions changed since it was last looked at, else hundredths."""
    stale = [name for name in (*list_scenarios(), *list_walks()) if is_stale(name)]
    assert not stale, f"{', '.join(stale)}: {RENEW}"


@pytest.mark.usefixtures("_without_a_compiler", "fresh_cache")
def test_changed_physics_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ppafo.metrics.switching.OSCILLATION_THRESHOLD", 0.06)
    assert is_stale("torque-task-solenoid")
