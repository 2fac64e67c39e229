"""What the page on validation shows is run as it stands there."""

import json
import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from ppafo.cli.main import main
from ppafo.simulation.recorded.channels import COMMAND, SUPPLY
from ppafo.storage import read_csv

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "validate-a-model.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


def test_the_commands_of_the_page_end_as_the_page_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    commands = blocks("sh")[0].splitlines()
    codes = [main(shlex.split(command)[1:]) for command in commands]
    assert codes == [0, 0, 1]
    assert {"report.html", "validate.json"} <= {path.name for path in (tmp_path / "out" / "agreement").iterdir()}
    capsys.readouterr()
    names: dict[str, Any] = {}
    exec(blocks("python")[0], names)
    assert capsys.readouterr().out == "True ['pressure_1', 'pressure_2', 'pressure_difference', 'torque']\n"


def test_a_real_device_is_told_as_the_page_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (example,) = (block for block in blocks("sh") if "measured-cylinder" in block)
    new, folder, validate = example.splitlines()
    assert main(shlex.split(new)[1:]) == 0
    monkeypatch.chdir(folder.removeprefix("cd "))
    capsys.readouterr()
    assert main(shlex.split(validate)[1:]) == 1
    printed = capsys.readouterr().out.splitlines()
    assert [line for line in blocks("text")[0].splitlines() if line not in printed] == []


def test_the_recording_of_the_page_is_read(tmp_path: Path) -> None:
    path = tmp_path / "bench.csv"
    path.write_text(blocks("csv")[0])
    recording = read_csv(path)
    assert recording.names == (COMMAND, SUPPLY, "angle", "pressure_1", "pressure_2")
    assert recording["pressure_1"][0] == pytest.approx(101325.0 + 0.1 * 6894.757293168)


def test_the_column_map_of_the_page_reads_a_foreign_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("maps.toml").write_text(blocks("toml")[0])
    rows = [f"{n};{0 if n < 10 else 10};{-20 - 0.2 * n:.3f};{0.01 * n:.3f};{3.5 - 0.01 * n:.3f}" for n in range(300)]
    Path("bench.csv").write_text("\n".join(["t;u;phi;p1;p2", *rows, ""]).replace(".", ","))
    for columns in ("maps.toml", "maps.toml:logger"):
        words = ["validate", "ppafo2011", "bench.csv", "--columns", columns, "--threshold", "1000%", "--json"]
        words += ["--set", "supply.pressure=55 psi_g", "--set", "supply.dorsiflexion_pressure=55 psi_g"]
        assert main(words) == 0
        made = json.loads(capsys.readouterr().out)["recordings"][0]
        assert made["samples"] == 300
        assert set(made["channels"]) == {"angle", "pressure_1", "pressure_2", "pressure_difference"}
    assert main(["validate", "ppafo2011", "bench.csv", "--columns", "maps.toml:loger"]) == 2
    assert "did you mean 'logger'" in capsys.readouterr().err
