"""What the page on walking shows is run as it stands there."""

import contextlib
import io
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.walking import load_walk
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import gait_sensors_of, has_ideal_sensors

pytestmark = pytest.mark.thorough

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "walk.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """Text of each command of the page, one after the other in a folder, which is the current one."""
    commands = [line for block in blocks("sh") for line in block.splitlines() if line.startswith("ppafo ")]
    texts = {}
    with contextlib.chdir(tmp_path_factory.mktemp("page")):
        for command in commands:
            with contextlib.redirect_stdout(io.StringIO()) as text:
                assert main(shlex.split(command)[1:]) == 0, command
            texts[command] = text.getvalue()
        yield texts


def test_the_commands_of_the_page_write_the_files_that_it_lists(printed: dict[str, str]) -> None:
    assert len(printed) > 20
    table = PAGE.partition("| In the folder |")[2].partition("\n\n")[0]
    listed = {
        name for cell in re.findall(r"^\| (`.*?`) \|", table, re.MULTILINE) for name in re.findall(r"`(.*?)`", cell)
    }
    assert len(listed) > 6
    assert {name for name in listed if not Path("out", "walk", name).is_file()} == set()
    assert {path.name for path in Path("out", "my-gait").iterdir()} == {
        *("my-gait.toml", "gait.json", "gait.txt", "gait.png", "gait.svg"),
        *("report.html", "ppafo.json"),
    }


def test_the_python_of_the_page_prints_what_it_shows(capsys: pytest.CaptureFixture[str]) -> None:
    (shown,) = re.findall(r"^```text\n(solenoid .*?)^```", PAGE, re.DOTALL | re.MULTILINE)
    exec(blocks("python")[0], {})
    assert capsys.readouterr().out == shown


def test_the_table_of_the_page_is_what_the_command_prints(printed: dict[str, str]) -> None:
    shown = [line.split() for line in PAGE.partition("\nprints\n")[2].splitlines()[1:12]]
    lines = printed["ppafo walk solenoid --minutes 0.2 --out out/walk"].splitlines()
    assert [line.split() for line in lines[2:13]] == shown
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
    assert printed.splitlines()[1].startswith(f"the device does not help: {said}: fewer than half")
    assert "less help" in printed.splitlines()[4]


def test_the_task_sequence_and_the_bottle_of_the_page_load(tmp_path: Path) -> None:
    (tmp_path / "door.toml").write_text(blocks("toml")[1])
    walk_file = tmp_path / "own.toml"
    walk_file.write_text(blocks("toml")[0] + blocks("toml")[2])
    assert walk_of(load_walk(walk_file)).bottle is not None
    walk_file.write_text(blocks("toml")[0])
    assert walk_of(load_walk(walk_file, [f"task_sequence={tmp_path / 'door.toml'}"])).task_sequence is not None


def test_the_segments_of_the_page_are_rows_of_what_the_command_prints(printed: dict[str, str]) -> None:
    rows = re.findall(r"^    \*? +(rest|start, 0.4 m/s|ramp, 1 m/s|whole task sequence) +(.*)$", PAGE, re.MULTILINE)
    assert len(rows) == 4
    text = printed["ppafo walk solenoid --task-sequence first-steps --out out/first-steps"]
    for name, numbers in rows:
        (found,) = re.findall(rf"^\*? +{re.escape(name)} +(.*)$", text, re.MULTILINE)
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
