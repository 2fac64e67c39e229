"""The commands of the page on the bottle are run as they stand there, and its numbers are those that come out."""

import json
import re
import shlex
from pathlib import Path
from typing import Any

import pytest

import ppafo
from ppafo.cli.main import main

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "bottle.md"
EVIDENCE = PAGE.parents[1] / "evidence.md"
TEXT = " ".join(PAGE.read_text(encoding="utf-8").split())
COMMANDS = [
    shlex.split(line) for line in re.findall(r"^    ppafo (.*)$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
]
ROWS = re.findall(r"^\| `([^`]+=[^`]+)` \| (\d+) \| ([a-z ]+) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)

SEVERAL = ["bottle", "out/walk-solenoid", "out/walk-proportional"]
REGULATED = re.findall(
    r"^\| `([\w-]+)` \| (-|`supply_line\.[^`]+`) \| (.*) \|$", EVIDENCE.read_text(encoding="utf-8"), re.MULTILINE
)


def results(words: list[str], capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    """What a command says, as JSON."""
    assert main([*words, "--json"]) == 0
    return dict(json.loads(capsys.readouterr().out))


FIRST_WALK = next(number for number, words in enumerate(COMMANDS) if words[0] == "walk")
AFTER_WALKS = 1 + COMMANDS.index(SEVERAL)


@pytest.mark.long
def test_bottles_of_numbers_and_of_a_task_last_as_long_as_the_page_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert len(COMMANDS) == 10
    counts = []
    for words in COMMANDS[:FIRST_WALK] + COMMANDS[AFTER_WALKS:]:
        if words[0] == "bottle" and "--list" not in words:
            counts.append(round(results(words, capsys)["strides"]))
        else:
            assert main(words) == 0
            capsys.readouterr()
    assert len(counts) == 5
    assert [count for count in counts if not re.search(rf"\b{count} (strides|tasks)", TEXT)] == []
    assert (tmp_path / "out" / "bottle" / "endurance.png").is_file()


@pytest.mark.parametrize(("name", "change", "numbers"), REGULATED)
def test_a_row_of_the_regulators_is_what_comes_out(name: str, change: str, numbers: str) -> None:
    metrics = ppafo.walk(name, minutes=0.2, overrides=re.findall(r"`(.*)`", change)).metrics
    gas, work, toes = (metrics[metric].value for metric in ("gas", "positive_push_off_work", "lowest_toes"))
    assert numbers == f"{1e3 * gas:.3f} | {work:.2f} | {f'{1e2 * toes:.1f}' if toes >= 0.0 else 'would drag'}"


@pytest.mark.parametrize(("change", "strides", "ends"), ROWS)
def test_a_row_of_the_table_is_what_comes_out(
    change: str, strides: str, ends: str, capsys: pytest.CaptureFixture[str]
) -> None:
    result = results(["bottle", "--gas-per-stride", "0.4 g", "--set", change], capsys)
    assert result["ending"] == ends
    assert round(result["strides"]) == int(strides)
