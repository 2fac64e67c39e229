"""What the page on comparing controllers shows runs as it stands there, and its errors and gas are those of a run."""

import re
import shlex
from pathlib import Path
from typing import Any

import pytest

import ppafo
from ppafo.cli.main import build_parser, main
from ppafo.questions.league.standing import ENTRANTS, WALKING_ENTRANTS, learn
from ppafo.questions.league.walking.measures import walk_measures
from ppafo.questions.league.walking.task import walking_task

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "compare-controllers.md"
TEXT = PAGE.read_text(encoding="utf-8")
TASKS = {
    "Within reach of the supply": ("torque-task-proportional", ["reference.level=4 N m"]),
    "With a slow spool": ("torque-task-slow-valve", []),
}


def blocks(language: str) -> list[str]:
    """The code blocks of the page in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)


def table_after(heading: str) -> dict[str, list[str]]:
    """Cells of the first table after some words, by the name of the controller."""
    table = re.findall(r"(?:^\|.*\|\n)+", TEXT.partition(heading)[2], re.MULTILINE)[0]
    rows = re.findall(r"^\| `(\S+)` \| (.+) \|$", table, re.MULTILINE)
    return {name: cells.split(" | ") for name, cells in rows}


def commands() -> list[list[str]]:
    """The words of every command, without the name of the program."""
    return [shlex.split(line)[1:] for block in blocks("sh") for line in block.splitlines()]


def test_the_commands_of_the_page_are_understood_and_its_simulations_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert len(commands()) == 6
    for words in commands():
        assert callable(build_parser(words[0]).parse_args(words).run)
        if words[0] == "simulate":
            assert main(words) == 0


def test_the_python_of_the_page_runs(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("casadi", reason="the lower bound needs the extra 'optimal'")
    names: dict[str, Any] = {}
    for block in blocks("python"):
        exec(block, names)
    printed = capsys.readouterr().out
    assert "True" in printed.splitlines()[0]
    assert names["bound"].is_attainable


@pytest.mark.parametrize("heading", TASKS)
def test_errors_and_gas_of_a_table_are_those_of_a_run(heading: str) -> None:
    scenario, overrides = TASKS[heading]
    shown = table_after(heading)
    assert len(shown) >= 8
    for entrant in ENTRANTS:
        if entrant.name not in shown:
            continue
        task = ppafo.load_scenario(scenario, [*entrant.overrides, *overrides])
        metrics = ppafo.simulate(learn(task).scenario if entrant.learns else task).metrics
        error, gas = float(shown[entrant.name][0]), float(shown[entrant.name][2])
        assert metrics["rms_error"].value == pytest.approx(error, abs=6e-5), entrant.name
        assert 1e3 * metrics["gas_supplied"].value == pytest.approx(gas, abs=6e-4), entrant.name


@pytest.mark.thorough
def test_errors_toes_and_gas_of_the_walking_table_are_those_of_a_walk() -> None:
    shown = table_after("## On a leg that walks")
    assert set(shown) == {entrant.name for entrant in WALKING_ENTRANTS}
    task = walking_task()
    for entrant in WALKING_ENTRANTS:
        found = walk_measures(task, task.configuration(entrant.kind, entrant.valve, entrant.overrides))
        error, at_lag, toes, gas = (float(shown[entrant.name][column]) for column in (0, 3, 4, 5))
        assert found["torque_error"] == pytest.approx(error, abs=6e-4), entrant.name
        assert found["lagged_error"] == pytest.approx(at_lag, abs=6e-4), entrant.name
        assert 1e3 * found["toe_height"] == pytest.approx(toes, abs=0.6), entrant.name
        assert 1e3 * found["gas"] == pytest.approx(gas, abs=6e-4), entrant.name


def test_no_number_of_the_walking_table_is_below_the_bound() -> None:
    for cells in table_after("## On a leg that walks").values():
        assert all(cell == "-" or float(cell) >= 0.0 for cell in (cells[1], cells[6]))
