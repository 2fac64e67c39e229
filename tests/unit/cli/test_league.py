"""``ppafo league``, from words to files."""

import json
from pathlib import Path

import pytest

from ppafo.cli.main import build_parser, main
from ppafo.questions.league.solve import DRAWS
from ppafo.questions.league.standing import ENTRANTS, SEED, WALKING_ENTRANTS
from ppafo.questions.league.walking import bound, contest
from ppafo.questions.league.walking.task import CONFIGURATION
from ppafo.storage.result_folder import MARK

pytestmark = pytest.mark.thorough

NAMES = ("league.txt", "league.json", "league.png", "league.svg", "report.html")
SHORT = ["--set", "run.duration=0.4 s", "--set", "reference.ramp_time=0.2 s", "--set", "reference.level=2 N m"]


def test_the_league_is_printed_and_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert main(["league", *SHORT, "--draws", "3", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert sorted(entry.name for entry in out.iterdir()) == sorted([*NAMES, MARK])
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
    assert "--draws -5: must be a whole number" in capsys.readouterr().err


def test_the_defaults_of_the_command_are_those_of_the_study() -> None:
    parsed = build_parser("league").parse_args(["league"])
    assert (parsed.scenario, parsed.draws, parsed.seed) == (None, DRAWS, SEED)
    walks = build_parser("league").parse_args(["league", "--walk"])
    assert (walks.walk, walks.minutes) == (CONFIGURATION, None)


def test_a_walking_league_is_printed_and_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    two = tuple(entrant for entrant in WALKING_ENTRANTS if entrant.name in ("event_proportional", "off"))
    monkeypatch.setattr(contest, "WALKING_ENTRANTS", two)
    monkeypatch.setattr(bound, "find_spec", lambda _: None)
    out = tmp_path / "out"
    assert main(["league", "--walk", "--minutes", "6 s", "--draws", "2", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert sorted(entry.name for entry in out.iterdir()) == sorted([*NAMES, MARK])
    document = json.loads((out / "league.json").read_text())
    assert [standing["name"] for standing in document["standings"]] == ["event_proportional", "off"]
    assert document["seconds"] == pytest.approx(6.0)
    assert "\nevent_proportional " in printed


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["torque-task-proportional", "--walk"], "give a scenario or --walk, not both"),
        (["--minutes", "0.2"], "--minutes needs a walk: add --walk"),
        (["--gait", "falisse2019-subject1"], "--gait needs a walk: add --walk"),
        (["--walk", "proportionl"], "did you mean 'proportional'"),
        (["--walk", "--minutes", "5"], "a league can walk for 0.1 to 1 minutes"),
        (["--walk", "--minutes", "soon"], "a number of minutes"),
        (["--walk", "--set", "controller.kind=off"], "has its own"),
    ],
)
def test_words_that_do_not_go_together_are_one_line(
    words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["league", *words, "--out", str(tmp_path / "out")]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
