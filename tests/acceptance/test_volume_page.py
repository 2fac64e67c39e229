"""The commands and the Python of the page on volumes are run as they stand there, and print what it shows."""

import itertools
import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from ppafo.cli.main import main

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "which-volume.md").read_text(encoding="utf-8")
COMMANDS = [shlex.split(line) for line in re.findall(r"^    ppafo (.*)$", PAGE, re.MULTILINE) if " (" not in line]
COMMANDS = [words for words in COMMANDS if words[0] in {"audit", "walk"}]


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


def shown_below(words: list[str]) -> list[str]:
    """Lines that the page shows under a command."""
    lines = PAGE.splitlines()
    start = next(
        number
        for number, line in enumerate(lines)
        if line.startswith(f"    ppafo {words[0]}") and shlex.split(line)[1:] == words
    )
    block = itertools.takewhile(lambda line: line.startswith("    "), lines[start + 2 :])
    return [line.removeprefix("    ") for line in block]


def test_the_page_shows_an_audit_and_two_walks() -> None:
    assert [words[0] for words in COMMANDS] == ["audit", "walk", "walk"]
    assert all(len(shown_below(words)) >= 5 for words in COMMANDS)


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_a_command_prints_what_stands_below_it(
    words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(words) == (1 if words[0] == "audit" else 0)
    assert "\n".join(shown_below(words)) in capsys.readouterr().out


def test_the_python_prints_what_stands_below_it(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, Any] = {}
    exec(blocks("python")[0], names)
    assert capsys.readouterr().out == blocks("text")[0]
