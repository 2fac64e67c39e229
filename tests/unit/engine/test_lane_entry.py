"""Functions of lanes on arrays that stay between calls: decisions and names of each lane, and what is refused."""

from typing import Any, NamedTuple

import numpy as np
import pytest

from ppafo.engine.entries import HEADER, INLINE
from ppafo.engine.generator import StepText
from ppafo.engine.loop_text import lane_entry
from ppafo.engine.source_text import SourceCollector
from ppafo.errors import ProgramError
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from tests.interpreted import load_source


class RunCounter(NamedTuple):
    """A number, and how much more it gets at once."""

    number: float
    more: float


def add(parts: Any, lane: Any, share: float) -> None:
    """Some more."""
    lane.tally = lane.tally._replace(number=lane.tally.number + share * lane.tally.more)


def count(parts: Any, lanes: Any, turns: int, share: float) -> None:
    """Add to every lane that is below 10, half as much to one above 5."""
    for lane in lanes:
        if lane.tally.number >= 10.0:
            continue
        own = 0.5 * share if lane.tally.number > 5.0 else share
        if parts.walks:
            add(parts, lane, 1000.0)
        for _turn in range(turns):
            add(parts, lane, own)


def waits(parts: Any, lanes: Any, turns: int) -> None:
    """No statement of a lane."""
    for lane in lanes:
        while lane.tally.number < turns:
            add(parts, lane, 1.0)


def source(function: Any) -> str:
    """A module with one entry."""
    collector = SourceCollector(INLINE)
    step = StepText(plan_run(load_scenario("step-response")).program, collector, further={"tally": RunCounter})
    entry = lane_entry(step, function, {"tallies": {"tally": RunCounter}})
    return "\n\n\n".join([HEADER, collector.text(), entry])


@pytest.mark.parametrize("backend", ["", "python"])
def test_each_lane_decides_for_itself_and_keeps_its_numbers(backend: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PPAFO_BACKEND", backend)
    tallies = np.array([[0.0, 6.0, 12.0], [1.0, 2.0, 3.0]])
    module = load_source(source(count))
    for _ in range(2):
        module.count(tallies, np.zeros((5, 1, 3)), 2, 4.0)
    assert tallies.tolist() == [[12.0, 14.0, 12.0], [1.0, 2.0, 3.0]]


def test_what_is_no_statement_of_a_lane_is_refused_with_its_line() -> None:
    with pytest.raises(
        ProgramError, match=r"test_lane_entry\.py:\d+: .*'while lane.*is not supported in a loop over runs"
    ):
        source(waits)
