"""``ppafo league``, from words to files."""

import json
from pathlib import Path

import pytest

from ppafo.cli.main import build_parser, main
from ppafo.reporting.league_files import NAMES
from ppafo.studies.league import DRAWS, ENTRANTS, TASK

SHORT = ["--set", "run.duration=0.4 s", "--set", "reference.ramp_time=0.2 s", "--set", "reference.level=2 N m"]


def test_the_league_is_printed_and_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert main(["league", *SHORT, "--draws", "3", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert sorted(entry.name for entry in out.iterdir()) == sorted(NAMES)
    document = json.loads((out / "league.json").read_text())
    names = [standing["name"] for standing in document["standings"]]
    assert sorted(names) == sorted(entrant.name for entrant in ENTRANTS)
    errors = [standing["metrics"]["rms_error"]["value"] for standing in document["standings"]]
    assert errors == sorted(errors)
    assert all(f"\n{name} " in printed for name in names)
    page = (out / "report.html").read_text()
    assert all(
        standing["command"].split()[0] in page and standing["name"] in page for standing in document["standings"]
    )
    learnt = next(standing for standing in document["standings"] if standing["learning"])
    assert learnt["learning"]["errors"][learnt["learning"]["best"]] == min(learnt["learning"]["errors"])


def test_a_scenario_that_does_not_exist_is_one_line_and_nothing_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["league", "torque-task-proportionl", "--out", str(tmp_path / "out")]) == 2
    assert "did you mean 'torque-task-proportional'" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_league_without_draws_shows_dashes(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["league", "torque-task-slow-valve", "--set", "run.duration=0.2 s", "--draws", "0", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert {standing["robustness"] for standing in document["standings"]} == {None}
    assert "on_off" in document["absent"]


def test_a_number_of_draws_that_is_none_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["league", "--draws", "-5"]) == 2
    assert "draws = -5" in capsys.readouterr().err


def test_the_defaults_of_the_command_are_those_of_the_study() -> None:
    parsed = build_parser("league").parse_args(["league"])
    assert (parsed.scenario, parsed.draws) == (TASK, DRAWS)
