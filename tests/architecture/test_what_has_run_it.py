"""Tools that have run each export (docs/evidence.md): tests exist, versions are the locked ones, none is missing."""

import re
from pathlib import Path

import pytest

from ppafo.cli.command_line import CommandGroup
from ppafo.cli.commands import COMMANDS

ROOT = Path(__file__).parents[2]
EVIDENCE = (ROOT / "docs" / "evidence.md").read_text(encoding="utf-8")
PAGE = EVIDENCE.partition("## Tools that have run the exports")[2].partition("\n## ")[0]
TESTS = re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", PAGE)


def test_every_row_of_the_table_names_a_test() -> None:
    rows = [line for line in PAGE.splitlines() if line.startswith("| ") and "---" not in line][1:]
    assert len(rows) >= 6
    assert [row for row in rows if "::" not in row] == []


@pytest.mark.parametrize(("file", "name"), TESTS)
def test_a_test_that_the_page_names_exists(file: str, name: str) -> None:
    assert f"\ndef {name}(" in (ROOT / file).read_text(encoding="utf-8")


def test_every_export_is_on_the_page() -> None:
    exports = COMMANDS["export"]
    assert isinstance(exports, CommandGroup)
    assert [name for name in exports.actions if name != "figure" and f"ppafo export {name}" not in PAGE] == []
