"""What the page on walking shows is run as it stands there."""

import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from ppafo.cli.main import main
from ppafo.walking import load_walk
from ppafo.walking.planning import gait_sensors_of, has_ideal_sensors

pytestmark = pytest.mark.thorough

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "let-it-walk.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


def test_the_commands_and_the_python_of_the_page_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    commands = [line for block in blocks("sh") for line in block.splitlines()]
    assert [main(shlex.split(command)[1:]) for command in commands] == [0] * 16
    table = PAGE.partition("| In the folder |")[2].partition("\n\n")[0]
    listed = {
        name for cell in re.findall(r"^\| (`.*?`) \|", table, re.MULTILINE) for name in re.findall(r"`(.*?)`", cell)
    }
    assert len(listed) > 6
    assert {name for name in listed if not (tmp_path / "out" / "walk" / name).is_file()} == set()
    capsys.readouterr()
    names: dict[str, Any] = {}
    exec(blocks("python")[0], names)
    printed = capsys.readouterr().out.splitlines()
    assert printed[0].startswith("completed 0.")
    assert printed[2] == "100 wearers, (100,)"
    assert (tmp_path / "out" / "walk.sto").stat().st_size > 10_000


def test_the_table_of_the_page_is_what_the_command_prints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    shown = [line.split() for line in PAGE.partition("    ppafo walk")[2].splitlines()[2:13]]
    assert main(["walk", "solenoid", "--minutes", "0.2"]) == 0
    assert [line.split() for line in capsys.readouterr().out.splitlines()[2:13]] == shown
    assert len(shown) == 11


def test_the_walk_file_of_the_page_loads(tmp_path: Path) -> None:
    path = tmp_path / "stiff-ankle.toml"
    path.write_text(blocks("toml")[0])
    configuration = load_walk(path)
    assert configuration.control.settings["push_off_start"] == pytest.approx(0.42)
    assert gait_sensors_of(configuration).heel_fault.time == pytest.approx(3.0)
    assert not has_ideal_sensors(configuration)
