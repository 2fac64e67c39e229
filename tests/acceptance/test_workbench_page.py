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


def test_a_page_is_written_anew_and_the_file_of_somebody_else_is_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page, other = tmp_path / "page.html", tmp_path / "other.html"
    other.write_text("<p>mine</p>", encoding="utf-8")
    assert main(["workbench", "step-response", "--out", str(page)]) == 0
    before = page.read_bytes()
    assert main(["workbench", "step-response", "--set", "valve.area=14mm^2", "--out", str(page)]) == 0
    assert page.read_bytes() != before
    assert main(["workbench", "step-response", "--out", str(other)]) == 2
    assert "already exists" in capsys.readouterr().err
    assert other.read_text(encoding="utf-8") == "<p>mine</p>"
