"""The commands of the page on the simulated test bench are run as they stand there."""

import re
import shlex
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.rig.experiments import EXPERIMENTS
from ppafo.rig.preset import list_presets

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "identify.md"
COMMANDS = re.findall(r"^    ppafo (rig .*)$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)


def test_the_page_has_commands() -> None:
    assert len(COMMANDS) >= 4


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_page_works(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(shlex.split(command)) == 0


def test_the_page_names_every_preset_and_experiment() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert [name for name in (*EXPERIMENTS, *list_presets()) if f"`{name}`" not in text] == []
