"""What the pages on comparing, uncertainty, searching and tuning show is run as it stands there."""

import math
import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from ppafo.cli.main import main

HOW_TO = Path(__file__).parents[2] / "docs" / "how-to"
NUMBER = r"[+-]?\d[\d,]*\.?\d*(?:e[+-]?\d+)?"
PRINTED_BY_PYTHON = {
    "compare.md": "256 True\n",
    "uncertainty.md": "['supply.pressure', 'actuator.torque_constant']\n",
    "optimise.md": "498700.0 1\nTrue True {}\n",
}


def blocks(page: str, language: str) -> list[str]:
    """The code blocks of a page in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", (HOW_TO / page).read_text("utf-8"), re.DOTALL | re.MULTILINE)


def is_like(shown: str, printed: str) -> bool:
    """Tell whether two lines have the same words, and numbers that differ by rounding at most."""
    if re.split(r"\s+", re.sub(NUMBER, "0", shown).strip()) != re.split(r"\s+", re.sub(NUMBER, "0", printed).strip()):
        return False
    pairs = zip(re.findall(NUMBER, shown), re.findall(NUMBER, printed), strict=True)
    numbers = [(float(one.replace(",", "")), float(other.replace(",", ""))) for one, other in pairs]
    return all(math.isclose(one, other, rel_tol=0.02, abs_tol=2e-3) for one, other in numbers)


@pytest.mark.parametrize("page", PRINTED_BY_PYTHON)
def test_the_commands_of_the_page_print_what_it_shows(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for text in blocks(page, "toml"):
        name = re.search(r'^name = "(.+?)"$', text, re.MULTILINE)
        assert name is not None
        (tmp_path / f"{name[1]}.toml").write_text(text)
    commands = [line for block in blocks(page, "sh") for line in block.splitlines()]
    assert commands
    assert [main(shlex.split(command)[1:]) for command in commands] == [0] * len(commands)
    printed = capsys.readouterr().out.splitlines()
    for shown in [line for block in blocks(page, "text") for line in block.splitlines() if line]:
        assert any(is_like(shown, line) for line in printed), shown


@pytest.mark.parametrize("page", PRINTED_BY_PYTHON)
def test_the_python_of_the_page_prints_what_it_says(page: str, capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, Any] = {}
    for block in blocks(page, "python"):
        exec(block, names)
    assert capsys.readouterr().out == PRINTED_BY_PYTHON[page]
