"""What the page on sizing shows is run as it stands there."""

import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from ppafo.cli.main import main

pytestmark = pytest.mark.long

PAGES = Path(__file__).parents[2] / "docs" / "how-to"


def blocks(page: str, language: str) -> list[str]:
    """The code blocks of a page in one language."""
    text = (PAGES / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize(("place", "written"), [(0, "out/design/suggested.csv"), (1, "out/profile/suggested.csv")])
def test_the_commands_of_the_page_print_what_the_page_shows(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    place: int,
    written: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    commands = blocks("size-a-device.md", "sh")[place].splitlines()
    # The text blocks follow the commands in their order.
    first = sum(len(block.splitlines()) for block in blocks("size-a-device.md", "sh")[:place])
    for command, shown in zip(commands, blocks("size-a-device.md", "text")[first:], strict=False):
        main(shlex.split(command)[1:])
        printed = capsys.readouterr().out.splitlines()
        assert len(shown.splitlines()) > 3
        assert [line for line in shown.splitlines() if line and line not in printed] == []
    assert (tmp_path / written).exists()


def test_the_file_and_the_python_of_a_profile_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my-profile.toml").write_text(blocks("size-a-device.md", "toml")[0])
    names: dict[str, Any] = {}
    exec(blocks("size-a-device.md", "python")[0], names)
    assert capsys.readouterr().out.startswith("of-the-scenario paper-co2-9oz ")
