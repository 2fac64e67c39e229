"""``ppafo compare``, ``sensitivity`` and ``tune``: text, JSON, files, and what is refused."""

import json
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.study import runs

STUDY = "torque-task-uncertainty"
SHORT = ["--set", "run.duration=0.3 s"]
TUNING = """
schema_version = 1
name = "trial"
scenario = "torque-task-proportional"
overrides = ["reference.level=4 N m", "run.duration=0.3 s"]
search = [{ path = "controller.proportional_gain", minimum = "0.05 1/(N m)", maximum = "0.5 1/(N m)" }]
objective = [{ metric = "rms_error" }]
effort = { starts = 1, generations = 2, candidates_per_gain = 5 }
"""


@pytest.fixture
def tuning(tmp_path: Path) -> Path:
    """A small tuning file."""
    path = tmp_path / "trial.toml"
    path.write_text(TUNING)
    return path


def commands(tuning: Path) -> dict[str, list[str]]:
    """A quick run of each command."""
    return {
        "compare": ["compare", "--study", STUDY, "--baseline", "solenoid", "--draws", "64", *SHORT],
        "sensitivity": [
            *("sensitivity", STUDY, "--samples", "64", "--metric", "gas_supplied"),
            *("--configuration", "proportional", "--independent", *SHORT),
        ],
        "tune": ["tune", str(tuning)],
    }


@pytest.mark.parametrize("command", ["compare", "sensitivity", "tune"])
def test_each_command_prints_and_leaves_a_report_with_its_figures(
    command: str, tuning: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main([*commands(tuning)[command], "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert f"report: {out / 'report.html'}" in printed
    page = (out / "report.html").read_text()
    assert "data:image/svg+xml" in page
    assert "nothing on this page was measured" in page
    assert {path.suffix for path in out.iterdir()} == {".png", ".svg", ".json", ".txt", ".html"}
    text = next(path for path in out.iterdir() if path.suffix == ".txt" and path.name != "overrides.txt").read_text()
    assert text.splitlines()[0] == printed.splitlines()[0]


@pytest.mark.parametrize("command", ["compare", "sensitivity", "tune"])
def test_each_command_prints_one_json_document_the_same_every_time(
    command: str, tuning: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    printed = []
    for _ in range(2):
        assert main([*commands(tuning)[command], "--json"]) == 0
        printed.append(capsys.readouterr().out)
    assert json.loads(printed[0])
    assert printed[0] == printed[1]


def test_a_goal_that_no_gains_can_keep_is_exit_code_1_and_says_why(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "above.toml"
    path.write_text(
        """
schema_version = 1
name = "above"
scenario = "torque-task-proportional"
overrides = ["reference.level=5 N m", "run.duration=1 s", "reference.ramp_time=0.5 s"]
search = [{ path = "controller.proportional_gain", minimum = "0.05 1/(N m)", maximum = "1 1/(N m)" }]
objective = [{ metric = "rms_error" }]
constraints = [{ metric = "rms_error_hold", at_most = "0.1 N m" }]
robust = { study = "torque-task-uncertainty", measure = "quantile", share = 0.9, draws = 8 }
effort = { starts = 1, generations = 1, candidates_per_gain = 4 }
"""
    )
    assert main(["tune", str(path)]) == 1
    assert "the reference requires more torque than the actuator gives" in capsys.readouterr().out.splitlines()[0]


def test_an_interruption_leaves_nothing(
    tuning: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_words: object, **_more: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(runs, "run_ensemble", interrupted)
    for words in commands(tuning).values():
        assert main([*words, "--out", str(tmp_path / "out")]) == 130
        assert not (tmp_path / "out").exists()
    assert "interrupted; no file is incomplete" in capsys.readouterr().err
