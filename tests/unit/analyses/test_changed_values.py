"""Results state the values that overrides changed: in the text, on the page and in JSON."""

from collections.abc import Callable
from typing import Any

import pytest

import ppafo
from ppafo.report.finding import REPORT, Finding, files_of

TASK, STUDY = "torque-task-proportional", "torque-task-uncertainty"
SHORT = "run.duration=1.5 s"
BOTH = ("torque-task-proportional", "torque-task-solenoid")
ASKED: dict[str, Callable[[list[str]], Finding[Any]]] = {
    "compare": lambda changes: ppafo.compare(BOTH, overrides=changes),
    "compare, of a study": lambda changes: ppafo.compare(study=STUDY, draws=32, overrides=changes),
    "find": lambda changes: ppafo.find(
        TASK, vary="reference.level=1..3 N m", such_that="follows", grid=3, overrides=changes
    ),
    "linearise": lambda changes: ppafo.linearise(TASK, at="1 s", overrides=changes),
    "sensitivity": lambda changes: ppafo.sensitivity(
        STUDY, configuration="proportional", metrics="rms_error", samples=64, overrides=changes
    ),
    "sweep": lambda changes: ppafo.sweep(STUDY, draws=2, overrides=changes),
}


@pytest.mark.parametrize("question", ASKED)
def test_an_answer_states_what_was_changed_for_it(question: str) -> None:
    finding = ASKED[question]([SHORT])
    opening = str(finding).split("\n\n")[0].splitlines()
    assert opening[-1] == f"values changed: {SHORT}"
    assert finding.to_dict()["overrides"] == [SHORT]
    assert "Values changed: <code>run.duration</code>=1.5" in files_of(finding)[REPORT].decode()


def test_an_answer_about_values_as_they_are_states_no_change() -> None:
    finding = ppafo.compare(BOTH)
    assert "values changed" not in str(finding)
    assert "overrides" not in finding.to_dict()
