"""What the page on exports says of workbenches runs as it stands there."""

import re
import shlex
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.page.html import is_page

DOCS = Path(__file__).parents[2] / "docs"
TEXT = (DOCS / "how-to" / "export.md").read_text(encoding="utf-8")


def test_the_commands_of_the_page_write_pages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```sh\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)
    commands = [shlex.split(line)[1:] for block in blocks for line in block.splitlines() if " workbench " in line]
    assert [main(words) for words in commands] == [0, 0]
    assert is_page(tmp_path / "out" / "workbench.html")
    assert is_page(tmp_path / "out" / "valves.html")
