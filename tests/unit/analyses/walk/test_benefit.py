"""Second line of a walk: whether the device helps, against the same walk without it."""

import pytest

import ppafo
from ppafo.analyses.walk.benefit import benefit_sentence
from ppafo.walking.walk import compare_walks


@pytest.mark.parametrize(
    ("name", "verdict"),
    [
        ("solenoid", "the device helps in push-off but not in swing, against the same walk without it: "),
        ("off", "the device does not help, against the same walk without it: "),
    ],
)
def test_a_walk_is_judged_by_push_off_and_toes_and_simulates_no_other(name: str, verdict: str) -> None:
    comparison = compare_walks(ppafo.load_walk(name), minutes=0.1)
    said = benefit_sentence(comparison)
    assert said.startswith(verdict)
    assert "toes would drag (also without)" in said
