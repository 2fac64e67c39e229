"""What the page on validation shows is run as it stands there."""

import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from ppafo.cli.main import main

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
