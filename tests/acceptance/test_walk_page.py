"""What the page on walking shows is run as it stands there."""

import contextlib
import io
import math
import re
import shlex
from functools import lru_cache
from pathlib import Path

import pytest

import ppafo
from ppafo.cli.main import main
from ppafo.simulation.plan import plan_run
from ppafo.walking import load_walk
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import gait_sensors_of

pytestmark = pytest.mark.long

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "walk.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


def command_with(words: str) -> str:
    """The one command of the page that has some words."""
    (command,) = [
        line.strip() for line in PAGE.splitlines() if line.strip().startswith("ppafo ") and f" {words} " in f" {line} "
    ]
    return command


@lru_cache
def printed(command: str) -> list[str]:
    """Lines that a command of the page prints, run without its folder."""
    with contextlib.redirect_stdout(io.StringIO()) as text:
        ended = main(shlex.split(command.partition(" --out ")[0])[1:])
    lines = text.getvalue().splitlines()
    assert ended == ("ended early" in lines[0]), command
    return lines


def test_the_python_of_the_page_prints_what_it_shows(capsys: pytest.CaptureFixture[str]) -> None:
    (shown,) = re.findall(r"^```text\n(solenoid .*?)^```", PAGE, re.DOTALL | re.MULTILINE)
    exec(blocks("python")[0], {})
    assert capsys.readouterr().out == shown


def test_the_table_of_the_page_is_what_the_command_prints() -> None:
    shown = [line.split() for line in PAGE.partition("\nprints\n")[2].partition("\n\nA stride")[0].splitlines()[1:]]
    lines = [line.split() for line in printed(command_with("--out out/walk"))]
    assert len(shown) == 14
    assert [line for line in shown if line not in lines] == []


def test_swings_are_those_of_the_table_of_the_page() -> None:
    rows = re.findall(r"^\| (\d), .*? \| ([\d.]+) deg \| (-?\d+) mm \| ([\d.]+) g \|$", PAGE, re.MULTILINE)
    commands = [line for line in PAGE.splitlines() if line.startswith("ppafo simulate swing-foot")]
    assert len(rows) == len(commands) == 5
    for (number, *shown), command in zip(rows, commands, strict=True):
        overrides = [word for word in shlex.split(command)[3:] if "=" in word]
        metrics = ppafo.simulate("swing-foot", overrides).metrics
        error, toes, gas = (metrics[name].value for name in ("foot_angle_error", "toe_clearance_error", "gas_supplied"))
        found = f"{math.degrees(error):.1f}", f"{1e3 * toes:.0f}", f"{1e3 * gas:.3f}"
        assert tuple(map(float, shown)) == pytest.approx(tuple(map(float, found)), abs=1e-9), number


def test_the_walk_file_of_the_page_loads(tmp_path: Path) -> None:
    path = tmp_path / "stiff-ankle.toml"
    path.write_text(blocks("toml")[0])
    configuration = load_walk(path)
    assert configuration.controller.push_off_start == pytest.approx(0.42)
    assert gait_sensors_of(configuration).force_noise == pytest.approx(5.0)
    assert not plan_run(configuration).program.ideal_sensors


def test_the_bottle_of_the_page_loads(tmp_path: Path) -> None:
    walk_file = tmp_path / "own.toml"
    walk_file.write_text(blocks("toml")[0] + blocks("toml")[1])
    assert walk_of(load_walk(walk_file)).bottle is not None


def test_the_walk_on_its_bottle_ends_as_the_page_shows() -> None:
    command = command_with("--out out/on-bottle")
    shown = PAGE.partition(command)[2].lstrip("\n").partition("\n\n")[0].splitlines()
    assert len(shown) == 10
    assert [line for line in shown if line.strip() not in printed(command)] == []
