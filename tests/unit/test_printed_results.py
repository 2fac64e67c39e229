"""``print(result)`` is what the command prints, and the short form is one line; neither prints an array."""

import sys
from pathlib import Path

import pytest
from ppafo.report.solved import Solved

import ppafo
from ppafo.cli.main import main
from ppafo.kinds import kind_at

FEWEST_ANSWERS = 14


@pytest.mark.parametrize("name", ["step-response", "torque-task-solenoid"])
def test_a_printed_run_is_what_its_command_prints(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate", name, "--out", str(tmp_path / "run")]) == 0
    result = ppafo.simulate(name)
    assert capsys.readouterr().out.startswith(f"{result}\n\n{result.error().sentence}\n\nwritten: ")


def test_a_printed_answer_is_what_its_command_prints(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sets", "parts"]) == 0
    found = ppafo.parts()
    assert capsys.readouterr().out == f"{found}\n"
    assert repr(found) == f"<Parts: {found.title}>"


def test_every_public_answer_prints_its_table_and_has_a_short_form() -> None:
    for place in ppafo._HOME_OF.items():
        kind_at(":".join(reversed(place)))
    for place in ("design.wearer.solve:WearerSizing", "walk.answer:WalkPair"):
        kind_at(f"ppafo.analyses.{place}")

    # A dataclass with slots is made from another class of its name.
    classes = [one for one in Solved.__subclasses__() if getattr(sys.modules[one.__module__], one.__name__) is one]
    assert len(classes) >= FEWEST_ANSWERS
    for one in classes:
        assert one.__str__ is Solved.__str__, one
        assert one.__repr__ is Solved.__repr__ or one is ppafo.StudyResults, one
