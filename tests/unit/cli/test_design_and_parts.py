"""``ppafo design`` and ``ppafo sets parts``, from files to files."""

import json
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.parameters.parts import load_catalogue

DESIGN = """
schema_version = 1
name = "tiny"

[[task]]
name = "ramp"
scenarios = { proportional = "torque-task-proportional" }
overrides = ["run.duration=0.3 s", "reference.ramp_time=0.2 s", "reference.level=4 N m"]

[parts]
valves = ["enfield-ls-v05s"]
actuators = ["smc-crb2bw40-90d"]
regulators = ["festo-lrma-qs-4"]

[variables."supply.pressure"]
lowest = "30 psi_g"
highest = "90 psi_g"

[search]
screening = 32
population = 16
generations = 1
"""
SIZING = """
schema_version = 1
name = "tiny"
scenario = "torque-task-proportional"
simulated = 1
gain_factors = [1.0]

[profile]
time = ["0 s", "0.3 s", "0.6 s", "1 s"]
torque = ["0 N m", "3 N m", "3 N m", "0 N m"]

[use]
repetitions = 50

[limits]
rms_error = "0.7 N m"

[parts]
valves = ["enfield-ls-v05s"]
bottles = ["pipeline-jacpac-9oz"]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "design.toml").write_text(DESIGN)
    (tmp_path / "sizing.toml").write_text(SIZING)
    return tmp_path


def test_a_design_is_printed_and_written_with_its_doubts(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = folder / "out"
    assert main(["design", str(folder / "design.toml"), "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "suggested: it has the smallest sum of error, gas and mass" in printed
    assert "join(" not in printed
    assert printed.count("\n*  enfield-ls-v05s ") == 1
    assert "enfield-ls-v05s  mass (assumed)" in printed
    names = ["design.json", "design.txt", "front.csv", "front.png", "front.svg", "ppafo.json", "report.html"]
    names += ["suggested.png", "suggested.svg"]
    assert sorted(path.name for path in out.iterdir()) == names
    document = json.loads((out / "design.json").read_text())
    assert 0 <= document["suggested"] < len(document["front"])
    assert {item["part"] for item in document["doubtful"]} == {"enfield-ls-v05s", "festo-lrma-qs-4"}
    lines = (out / "front.csv").read_text().splitlines()
    assert lines[0] == "valve,actuator,error [N m],gas [kg],mass [kg],supply.pressure [Pa_a]"
    assert len(lines) == 1 + len(document["front"])
    report = (out / "report.html").read_text()
    assert "Check before buying" in report
    assert "mass 300\N{NO-BREAK SPACE}g is assumed" in report
    assert "<script" not in report


def test_a_sizing_is_printed_and_written(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = folder / "out"
    assert main(["design", str(folder / "sizing.toml"), "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "(typed, not measured)" in printed
    assert "\n*  enfield-ls-v05s " in printed
    assert "suggested: enfield-ls-v05s at " in printed
    names = ["design.json", "design.txt", "ppafo.json", "profile.png", "profile.svg", "report.html", "suggested.csv"]
    names += ["torque.png", "torque.svg"]
    assert sorted(path.name for path in out.iterdir()) == names
    document = json.loads((out / "design.json").read_text())
    assert document["suggested"] == "enfield-ls-v05s"
    assert document["valves"][0]["bottle"] == "pipeline-jacpac-9oz"
    assert (out / "suggested.csv").read_text().startswith("# simulated")
    report = (out / "report.html").read_text()
    assert "mass 300\N{NO-BREAK SPACE}g is assumed" in report
    assert "Enfield Technologies LS-V05s" in report


def test_a_sizing_without_a_suggestion_ends_with_1_and_says_why(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "hard.toml").write_text(SIZING.replace("0.7 N m", "0.001 N m"))
    assert main(["design", str(folder / "hard.toml"), "--out", str(folder / "out")]) == 1
    assert "no suggestion: no valve keeps the error limit" in capsys.readouterr().out
    assert "no valve keeps the error limit" in (folder / "out" / "report.html").read_text()


def test_parts_are_listed_with_what_is_doubtful_and_what_is_not_known(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sets", "parts"]) == 0
    printed = capsys.readouterr().out
    assert all(part.name in printed for part in load_catalogue().parts)
    assert main(["sets", "parts", "enfield-ls-v05s"]) == 0
    printed = capsys.readouterr().out
    assert "31.6 mm^2  published" in printed
    assert "not known: largest_pressure, nominal_flow, spool_frequency" in printed
