"""What the README and the pages that took over its tables show runs as printed; their numbers are those of a run."""

import re
import shlex
from pathlib import Path

import pytest

from ppafo.analyses.reproduce.claims import Studies
from ppafo.analyses.reproduce.question import reproduce
from ppafo.analyses.reproduce.report import finding_of_studies
from ppafo.cli.commands import COMMANDS
from ppafo.cli.main import build_parser, main
from ppafo.report.finding import text_of
from ppafo.running import simulate
from ppafo.walking.walk import walk

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
ASKED, MEASURED_PAGE, STUDIES_PAGE = (
    (ROOT / "docs" / name).read_text(encoding="utf-8")
    for name in ("what-you-can-ask.md", "evidence.md", "the-paper.md")
)
TEXT = "\n".join((README, ASKED, MEASURED_PAGE))
# What the README may have: five minutes to read.
MOST_LINES = 80
MOST_WORDS = 600
CHECK_FAILED = 1


def blocks(language: str) -> list[str]:
    """The code blocks of README, questions and measurements in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)


def commands() -> list[list[str]]:
    """The words of every command that these pages show, without the name of the program."""
    lines = [line for block in blocks("sh") for line in block.splitlines()]
    words = [shlex.split(line) for line in lines]
    assert all(line[0] == "ppafo" for line in words)
    return [line[1:] for line in words]


def shown_claims() -> dict[str, list[str]]:
    """The cells of the tables of claims by claim: published, here, verdict."""
    rows = re.findall(r"^\| [^|]+ \| `(\w+)`" + 3 * r" \| ([^|]+)" + r" \|$", STUDIES_PAGE, re.MULTILINE)
    (printed,) = re.findall(r"^```text\nstudy .*?\n(.*?)^```", STUDIES_PAGE, re.DOTALL | re.MULTILINE)
    return {name: cells for name, *cells in rows} | claims_of(printed)


def claims_of(printed: str) -> dict[str, list[str]]:
    """The same of the lines that the command prints."""
    rows = [re.split(r" {2,}", line) for line in printed.splitlines()]
    return {name: cells for _, name, *cells in rows}


@pytest.fixture(scope="module")
def studies() -> Studies:
    """One run of every study, which the tests below only read."""
    found = reproduce(study="all").found
    assert isinstance(found, Studies)
    return found


@pytest.mark.parametrize("block", blocks("python"))
def test_the_python_of_the_readme_runs_as_printed(block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec(block, {})
    pictures = re.findall(r'savefig\("(.+?)"\)', block)
    assert [name for name in pictures if (tmp_path / name).stat().st_size < 10_000] == []


def test_there_are_three_lines_of_python() -> None:
    (block,) = blocks("python")
    assert len([line for line in block.splitlines() if line]) == 3
    assert block in f"\n{TEXT}"


@pytest.mark.parametrize("words", commands(), ids=" ".join)
def test_a_command_of_the_pages_is_understood(words: list[str]) -> None:
    parsed = build_parser(words).parse_args(words)
    assert callable(parsed.run)


def test_the_commands_of_the_pages_run_one_after_the_other_with_the_exit_codes_they_say(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    codes = {" ".join(words): main(words) for words in commands() if not runs_elsewhere(words)}
    assert capsys.readouterr().out
    failed = {command: code for command, code in codes.items() if code}
    found = ("sets audit ppafo2011-printed", "simulate torque-task-solenoid --check --out out/checked")
    assert failed == dict.fromkeys(found, CHECK_FAILED)
    for folder in ("first", "more", "valves", "walk"):
        assert (tmp_path / "out" / folder / "report.html").is_file()
    assert (tmp_path / "out" / "solenoid" / "figure.png").is_file()


def runs_elsewhere(words: list[str]) -> bool:
    """Whether a command takes half a minute and has tests of its own, or looks at what such a command has left."""
    return words[0] == "reproduce" or words[-1] == "out/reproduce"


def test_a_torque_that_a_joint_cannot_give_is_said_as_printed_and_what_is_said_to_help_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for words in (words for words in commands() if {"elbow", "hold", "hold.toml"} & set(words)):
        assert main(words) == 0
    said = capsys.readouterr().out
    (printed,) = re.findall(r"^> (the torque stays .*)$", README, re.MULTILINE)
    assert f"hold: completed\n{printed}\n" in said
    (pasted,) = re.findall(r"; for example, with (.*?) it follows", printed)
    mended = ["--set", "device.set=./elbow.toml", "--set", "reference.level=9 N m", *shlex.split(pasted)]
    assert main(["simulate", "hold.toml", *mended, "--check"]) == 0
    # Whether it follows its reference stands between how it ended and the numbers.
    ended, verdict, changed, blank = capsys.readouterr().out.splitlines()[:4]
    assert (ended, blank) == ("hold: completed", "")
    assert changed.startswith("values changed: device.set=./elbow.toml, reference.level=9 N m, ")
    assert verdict.startswith("the torque follows its reference; from 2 s on: RMS ")


def test_every_command_is_shown_or_named() -> None:
    assert [name for name in COMMANDS if f"ppafo {name}" not in TEXT] == []


def test_every_command_is_once_in_the_table_of_questions() -> None:
    rows = re.findall(r"^\| [^|]+ \| ((?:`\w+`(?:, )?)+) \| .+ \|$", ASKED.partition("## ")[0], re.MULTILINE)
    listed = [name for row in rows for name in re.findall(r"\w+", row)]
    missing = [f"| what somebody wants to know | `{name}` | a page |" for name in COMMANDS if name not in listed]
    assert missing == [], "add to the table of docs/what-you-can-ask.md, in words of a user:\n" + "\n".join(missing)
    assert sorted(listed) == sorted(COMMANDS)


def test_the_answers_of_the_five_minutes_are_those_of_runs() -> None:
    lines = dict(re.findall(r"^(\d)\. (.+)$", README, re.MULTILINE))
    first, more, pair = (
        simulate(name, changes).metrics
        for name, changes in (
            ("torque-task-proportional", ()),
            ("torque-task-proportional", ("supply.pressure=70 psi_g",)),
            ("torque-task-solenoid", ()),
        )
    )

    def error(metrics):
        return f"{metrics['rms_error'].value:.3g}"

    def gas(m):
        return f"{1e3 * m['gas_supplied'].value:.3g}"

    assert f"{error(first)} N m, {gas(first)} g" in lines["1"]
    assert f"{error(more)} N m, {gas(more)} g" in lines["2"]
    assert f"{error(pair)} and {error(first)} N m, {gas(pair)} and {gas(first)} g" in lines["3"]
    metrics = walk("solenoid", minutes=0.2).metrics
    assert f"{1e3 * metrics['gas'].value:.3g} g a stride" in lines["4"]


@pytest.mark.short
def test_the_table_of_claims_is_that_of_a_run(studies: Studies) -> None:
    assert shown_claims() == claims_of("\n".join(text_of(finding_of_studies(studies)).splitlines()[1:-2]))
