"""What the page on walking shows is run as it stands there."""

import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from ppafo.cli.main import main
from ppafo.walking import load_walk
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import gait_sensors_of, has_ideal_sensors

pytestmark = pytest.mark.thorough

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "walk.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


def test_the_commands_and_the_python_of_the_page_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    commands = [line for block in blocks("sh") for line in block.splitlines()]
    assert [main(shlex.split(command)[1:]) for command in commands] == [0] * 17
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
    assert printed[2:] == ["100 wearers, (100,)", "9 strides, (9, 101)"]
    assert {path.name for path in (tmp_path / "out" / "my-gait").iterdir()} == {
        *("my-gait.toml", "gait.json", "gait.txt", "gait.png", "gait.svg"),
        *("report.html", "ppafo.json"),
    }


def test_the_table_of_the_page_is_what_the_command_prints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    shown = [line.split() for line in PAGE.partition("\nprints\n")[2].splitlines()[1:12]]
    assert main(["walk", "solenoid", "--minutes", "0.2"]) == 0
    assert [line.split() for line in capsys.readouterr().out.splitlines()[2:13]] == shown
    assert len(shown) == 11


def test_the_walk_file_of_the_page_loads(tmp_path: Path) -> None:
    path = tmp_path / "stiff-ankle.toml"
    path.write_text(blocks("toml")[0])
    configuration = load_walk(path)
    assert configuration.controller.push_off_start == pytest.approx(0.42)
    assert gait_sensors_of(configuration).heel_fault.time == pytest.approx(3.0)
    assert not has_ideal_sensors(configuration)


def test_the_walk_file_of_the_page_loses_its_help_as_the_page_says(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "stiff-ankle.toml"
    path.write_text(blocks("toml")[0])
    (said,) = re.findall(r"^With `--minutes 0.2` this file has (help in 2 of 10 strides)", PAGE, re.MULTILINE)
    assert main(["walk", str(path), "--minutes", "0.2", "--out", str(tmp_path / "out")]) == 1
    printed = capsys.readouterr().out
    assert said in printed
    assert "less help" in printed.splitlines()[3]


def test_the_task_sequence_and_the_bottle_of_the_page_load(tmp_path: Path) -> None:
    (tmp_path / "door.toml").write_text(blocks("toml")[1])
    walk_file = tmp_path / "own.toml"
    walk_file.write_text(blocks("toml")[0] + blocks("toml")[2])
    assert walk_of(load_walk(walk_file)).bottle is not None
    walk_file.write_text(blocks("toml")[0])
    assert walk_of(load_walk(walk_file, [f"task_sequence={tmp_path / 'door.toml'}"])).task_sequence is not None


def test_the_segments_of_the_page_are_rows_of_what_the_command_prints(capsys: pytest.CaptureFixture[str]) -> None:
    rows = re.findall(r"^    \*? +(rest|start, 0.4 m/s|ramp, 1 m/s|whole task sequence) +(.*)$", PAGE, re.MULTILINE)
    assert len(rows) == 4
    assert main(["walk", "solenoid", "--task-sequence", "first-steps"]) == 0
    printed = capsys.readouterr().out
    for name, numbers in rows:
        (found,) = re.findall(rf"^\*? +{re.escape(name)} +(.*)$", printed, re.MULTILINE)
        cells = re.split(r" {2,}", found)
        assert re.split(r" {2,}", numbers) == [*cells[:7], cells[-1]]


def test_the_walk_on_its_bottle_ends_as_the_page_shows(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    command, _, after = PAGE.partition("    ppafo walk solenoid-regulators ")[2].partition("\n")
    shown = [line.strip() for line in after.lstrip("\n").partition("\n\n")[0].splitlines()]
    words = ["walk", "solenoid-regulators", *shlex.split(command)[:-1], str(tmp_path / "on-bottle")]
    assert main(words) == 0
    printed = capsys.readouterr().out.splitlines()
    assert len(shown) == 10
    assert [line for line in shown if line not in printed] == []
