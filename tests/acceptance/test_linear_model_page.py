"""What the page on linear models shows runs as it stands there, and prints the numbers of the page."""

import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from ppafo.cli.main import main

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "linear-model.md"
TEXT = PAGE.read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    """The code blocks of the page in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)


def test_the_commands_of_the_page_write_what_it_lists(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    commands = [shlex.split(line)[1:] for line in blocks("sh")[0].splitlines()]
    assert [main(words) for words in commands] == [0, 0]
    for name in ("report.html", "linearise.json", "linearise.npz", "frequency-response.png"):
        assert (tmp_path / "out" / "linear" / name).is_file()
        assert (tmp_path / "out" / "linear-on-the-way" / name).is_file()
    assert (tmp_path / "out" / "linear" / "steps.png").is_file()


def test_the_python_of_the_page_prints_the_numbers_of_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("control", reason="loop shaping needs the extra 'control'")
    names: dict[str, Any] = {}
    for block in blocks("python"):
        exec(block, names)
    shaped, paper, own = capsys.readouterr().out.splitlines()
    assert f"`{shaped}`" in TEXT
    assert f"leave {paper}, these {own.removesuffix(' N m')} N m" in TEXT
