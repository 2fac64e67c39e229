"""The commands of the page on the bottle are run as they stand there, and its numbers are those that come out."""

import json
import re
import shlex
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.studies.endurance import list_bottles
from ppafo.studies.endurance.bottle import PAPER_BOTTLE

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "how-long-does-the-bottle-last.md"
TEXT = " ".join(PAGE.read_text(encoding="utf-8").split())
COMMANDS = [
    shlex.split(line) for line in re.findall(r"^    ppafo (.*)$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
]
ROWS = re.findall(r"^\| `([^`]+=[^`]+)` \| (\d+) \| ([a-z ]+) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)


def results(words: list[str], capsys: pytest.CaptureFixture[str]) -> dict[str, float]:
    """What a command says, as JSON; without its ``--out``."""
    kept = words[: words.index("--out")] if "--out" in words else words
    assert main([*kept, "--json"]) == 0
    return dict(json.loads(capsys.readouterr().out))


def test_the_commands_of_the_page_run_one_after_the_other_and_give_its_numbers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert len(COMMANDS) == 9
    steps, savings = [], []
    for words in COMMANDS:
        assert main(words) == 0
        capsys.readouterr()
        if words[0] == "endurance" and "--list" not in words:
            document = results(words, capsys)
            steps.append(round(document["result"]["steps"]))  # type: ignore[index]
            savings += [document["reuse"]["balance"]["returned_mass"]] if "reuse" in document else []  # type: ignore[index]
    for count in steps[:-1]:
        assert re.search(rf"\b{count} (steps|tasks)", TEXT), count
    assert [f"{saved * 1e3:.3g}" for saved in savings] == re.findall(r"saves (\S+) g", TEXT)
    assert (tmp_path / "out" / "bottle" / "endurance.png").is_file()


def test_steps_of_a_warm_bottle_are_those_of_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    warm = [results(words, capsys)["result"]["steps_when_warm"] for words in COMMANDS[:2]]  # type: ignore[index]
    assert f"would give {warm[0]:.0f} and {warm[1]:.0f} steps" in TEXT


@pytest.mark.parametrize(("change", "steps", "ends"), ROWS)
def test_a_row_of_the_table_is_what_comes_out(
    change: str, steps: str, ends: str, capsys: pytest.CaptureFixture[str]
) -> None:
    result = results(["endurance", "--gas-per-step", "0.4 g", "--set", change], capsys)["result"]
    assert result["ending"]["kind"] == ends  # type: ignore[index]
    assert round(result["steps"]) == int(steps)  # type: ignore[index]


def test_the_table_has_rows() -> None:
    assert len(ROWS) == 10


def test_a_bottle_of_the_page_comes_with_the_package() -> None:
    assert PAPER_BOTTLE in list_bottles()
    assert "air-48ci-3000psi" in list_bottles()
