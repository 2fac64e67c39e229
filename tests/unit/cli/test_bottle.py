"""``ppafo bottle``: what it prints and writes, and what it refuses."""

import json
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.storage.comma_separated import read_csv

QUICK = ["bottle", "--gas-per-stride", "1 g", "--stride-time", "1.1 s"]


def test_json_is_in_si_and_says_simulated(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*QUICK, "--json", "--set", "bottle.gas_mass=100 g"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["kind"] == "simulated"
    assert document["bottle"]["gas_mass"] == pytest.approx(0.1)
    assert document["bottle"]["values"]["bottle.gas_mass"]["source"] == "override"
    assert document["walking_time"] == pytest.approx(1.1 * document["strides"])
    assert "CoolProp" in document["bottle"]["properties"]


def test_the_folder_has_all_files_and_is_made_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert main([*QUICK, "--out", str(out)]) == 0
    assert main([*QUICK, "--out", str(out)]) == 0
    figures = {"endurance.png", "endurance.svg"}
    assert {path.name for path in out.iterdir()} == figures | {
        "bottle.csv",
        "endurance.json",
        "endurance.txt",
        "ppafo.json",
        "report.html",
    }
    course = read_csv(out / "bottle.csv")
    assert course.kind == "simulated"
    assert course["bottle_mass"][0] == pytest.approx(0.255)
    report = (out / "report.html").read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")
    assert "<td><code>bottle.room_heat_transfer</code></td><td>0.5 W/K</td><td>assumed</td>" in report
    assert (out / "endurance.png").stat().st_size > 10_000
