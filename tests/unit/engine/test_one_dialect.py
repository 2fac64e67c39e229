"""Python refuses what the compiler refuses: the same line, with file, line and what to do."""

from typing import Any

import pytest

from ppafo.engine.program import Program
from ppafo.engine.step import phases
from ppafo.engine.step.lane import Lane, Now
from ppafo.errors import ProgramError
from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario

begun, opened = phases.begin_step, phases.open_valve


def keeps_unkept(parts: Program, lane: Lane) -> None:
    """Set a group that no component hands on."""
    begun(parts, lane)
    lane.extra = 1.0  # type: ignore[attr-defined]


def asks_unkept(parts: Program, lane: Lane, now: Now) -> None:
    """Read it in a later phase."""
    opened(parts, lane, now)
    lane.length = lane.length + 0.0 * lane.extra  # type: ignore[attr-defined]


def squares(parts: Program, lane: Lane) -> None:
    """Take a power by a number that is written out."""
    begun(parts, lane)
    lane.before = lane.before**2


def counts_on(parts: Program, lane: Lane) -> None:
    """Change a name by an amount, and give an argument by its name."""
    begun(parts, lane=lane)
    before = lane.before
    before -= 0.0
    lane.before = before


def sets_on_one_side(parts: Program, lane: Lane) -> None:
    """Set a group of the step on one side of a decision alone."""
    if lane.timing.step > 1.0:
        lane.before = 0.0


def misspells(parts: Program, lane: Lane) -> None:
    """Ask for a field that the group has not."""
    lane.before = 0.0 * lane.timing.stepp  # type: ignore[attr-defined]


@pytest.mark.parametrize("backend", ["", "python"])
@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"begin_step": squares}, r"test_one_dialect\.py:\d+: 'before \*\* 2' cannot .*; write 'before \* before'"),
        (
            {"begin_step": sets_on_one_side},
            r"test_one_dialect\.py:\d+: 'lane.before' may be unset here: .*; set it earlier, on every path",
        ),
        ({"begin_step": misspells}, r"test_one_dialect\.py:\d+: timing has no 'stepp', did you mean 'step'\?"),
        (
            {"begin_step": keeps_unkept, "open_valve": asks_unkept},
            r"test_one_dialect\.py:\d+: 'lane.extra' is not handed on by an earlier phase .*'extra': handed",
        ),
    ],
)
def test_what_cannot_be_compiled_is_refused_by_every_backend(
    changed: dict[str, Any], message: str, backend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PPAFO_BACKEND", backend)
    for name, function in changed.items():
        monkeypatch.setattr(phases, name, function)
    with pytest.raises(ProgramError, match=message):
        simulate(load_scenario("step-response", ("run.duration=2 ms",)))


@pytest.mark.parametrize("backend", ["", "python"])
def test_a_name_may_be_changed_by_an_amount_and_an_argument_given_by_name(
    backend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PPAFO_BACKEND", backend)
    monkeypatch.setattr(phases, "begin_step", counts_on)
    assert simulate(load_scenario("step-response", ("run.duration=2 ms",))).status.kind == "completed"
