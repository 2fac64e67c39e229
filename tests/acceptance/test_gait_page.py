"""What the page on gaits shows is run as it stands there."""

import re
import shlex
import tomllib
from pathlib import Path
from typing import Any

import pytest

from ppafo.cli.main import main
from ppafo.gait.recorded.mapping import GaitMap
from ppafo.gait.recorded.reading import read_table
from ppafo.storage.opensim import read_opensim

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "use-your-own-gait.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


def test_the_commands_and_the_python_of_the_page_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    commands = [line for block in blocks("sh") for line in block.splitlines()]
    assert [main(shlex.split(command)[1:]) for command in commands] == [0] * 7
    files = {path.name for path in (tmp_path / "out" / "my-gait").iterdir()}
    assert files == {
        *("my-gait.toml", "gait.json", "gait.txt", "gait.png", "gait.svg"),
        *("report.html", "ppafo.json"),
    }
    assert {"ankle_angle_r", "ankle_angle_r_moment"} <= set(
        read_opensim(tmp_path / "out" / "opensim" / "recording.sto").columns
    )
    capsys.readouterr()
    names: dict[str, Any] = {}
    exec(blocks("python")[0], names)
    assert capsys.readouterr().out == "1.093 s, shank at heel strike 0.280 rad\n9 strides, (9, 101)\n"


def test_the_map_and_the_table_of_the_page_are_read(tmp_path: Path) -> None:
    whole, *knees = (tomllib.loads(block) for block in blocks("toml"))
    assert GaitMap.model_validate(whole).shank_angle.terms is not None
    maps = [GaitMap.model_validate(whole | knee).knee for knee in knees]
    assert [knee is not None and knee.thigh_length for knee in maps] == [None, "0.42 m"]
    path = tmp_path / "walk.csv"
    path.write_text(blocks("csv")[0] + "0.02,14.7,87.4,81.0\n")
    assert set(read_table(path).columns) == {"shank_angle", "ankle_angle", "vertical_force"}


def test_the_opensim_command_of_the_page_runs_on_the_real_files(
    shared_data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    command = next(line.strip() for line in PAGE.splitlines() if line.startswith("    ppafo gait import"))
    folder = shared_data / "gait" / "opensim_subject01"
    names = {"walk_ik.mot": "subject01_walk1_ik.mot", "walk_grf.mot": "subject01_walk1_grf_15s.mot"}
    monkeypatch.chdir(tmp_path)
    assert main([str(folder / names[word]) if word in names else word for word in shlex.split(command)[1:]]) == 0
    assert "stride time  1.229 s" in capsys.readouterr().out
