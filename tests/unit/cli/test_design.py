"""``ppafo design``, from a file to files."""

import json
from pathlib import Path

import pytest

from ppafo.cli.main import main

SIZING = """
schema_version = 1
name = "tiny"
scenario = "torque-task-proportional"
simulated = 1
bottles = ["paper-co2-9oz"]
gain_factors = [1.0]

[profile]
time = ["0 s", "0.3 s", "0.6 s", "1 s"]
torque = ["0 N m", "3 N m", "3 N m", "0 N m"]

[use]
repetitions = 50

[limits]
rms_error = "0.7 N m"

[valves.enfield-ls-v05s]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "sizing.toml").write_text(SIZING)
    return tmp_path


def test_a_sizing_is_printed_and_written(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = folder / "out"
    assert main(["design", str(folder / "sizing.toml"), "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "suggested: enfield-ls-v05s at " in printed
    names = ["design.json", "design.txt", "ppafo.json", "profile.png", "profile.svg", "report.html", "suggested.csv"]
    names += ["torque.png", "torque.svg"]
    assert sorted(path.name for path in out.iterdir()) == names
    document = json.loads((out / "design.json").read_text())
    assert document["suggested"] == "enfield-ls-v05s"
    assert document["valves"][0]["bottle"] == "paper-co2-9oz"
    assert (out / "suggested.csv").read_text().startswith("# simulated")


def test_a_sizing_without_a_suggestion_ends_with_1_and_says_why(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "hard.toml").write_text(SIZING.replace("0.7 N m", "0.001 N m"))
    assert main(["design", str(folder / "hard.toml"), "--out", str(folder / "out")]) == 1
    assert "no suggestion: no valve keeps the error limit" in capsys.readouterr().out
    assert "no valve keeps the error limit" in (folder / "out" / "report.html").read_text()
