"""The ways on which events are timed, and walks that cannot be timed."""

import pytest

from ppafo.errors import ScenarioError
from ppafo.questions.timing.answer import event_timing


@pytest.mark.parametrize(
    ("override", "reason"),
    [
        ("course=corridor", "its own courses"),
    ],
)
def test_a_walk_whose_events_cannot_be_timed_is_refused_in_one_line(override: str, reason: str) -> None:
    with pytest.raises(ScenarioError, match=reason):
        event_timing("solenoid", overrides=(override,))
