"""What every command says, its help and one refusal of each family, is recorded, so that a change of wording is read.

Each file of ``tests/snapshots/commands`` is a session at the command line: lines that begin with ``$`` are run, the
rest is what they print. To record anew, after a change of wording or a new line with ``$``, and then read what changed:

    pytest --inline-snapshot=fix tests/contract/test_command_words.py
"""

import re
import shlex
import textwrap
from collections.abc import Iterator
from pathlib import Path

import pytest
from inline_snapshot import external_file

from ppafo.cli.commands import COMMANDS
from ppafo.cli.main import main

SNAPSHOTS = Path(__file__).parents[1] / "snapshots" / "commands"
SESSIONS = sorted(SNAPSHOTS.glob("*.txt"))
PROMPT = "$ "
WIDTH = 100


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in with what users give by mistake, and a terminal without colours of a fixed width."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", str(WIDTH))
    monkeypatch.setenv("NO_COLOR", "1")
    for name in ("FORCE_COLOR", "PYTHON_COLORS"):
        monkeypatch.delenv(name, raising=False)
    (tmp_path / "foreign").mkdir()
    (tmp_path / "foreign" / "notes.txt").write_text("of somebody else\n", encoding="utf-8")
    (tmp_path / "empty.toml").write_text("", encoding="utf-8")
    (tmp_path / "broken.toml").write_text("[device\n", encoding="utf-8")
    (tmp_path / "misspelt.toml").write_text('nmae = "mine"\n', encoding="utf-8")
    (tmp_path / "empty.csv").write_text("", encoding="utf-8")
    (tmp_path / "words.csv").write_text("time,angle\n0,ten\n", encoding="utf-8")
    return tmp_path


def wrapped_usage(text: str) -> str:
    """The usage of a help text in lines of our own: versions of Python break it in different places."""
    head, gap, rest = text.partition("\n\n")
    joined = re.sub(r"\[(?:[^][]|\[[^][]*\])*\]", lambda option: option[0].replace(" ", "\0"), " ".join(head.split()))
    lines = textwrap.fill(joined, WIDTH, subsequent_indent="    ", break_on_hyphens=False, break_long_words=False)
    return lines.replace("\0", " ") + gap + rest


def aligned_actions(text: str) -> str:
    """A help text with its actions and options in one column: versions of Python measure the column differently."""
    entry = re.compile(r"^( {2,4}\S+(?:, \S+)?)(?:\n {8,}| {2,})(?=\S)", re.MULTILINE)
    return entry.sub(lambda found: f"{found[1]:<17}", text) if " ...\n" in text else text


def plain_choices(text: str) -> str:
    """A complaint of argparse with its choices unquoted, as Python 3.14 writes them; earlier ones quote."""
    return re.sub(r"\(choose from [^)]*\)", lambda found: found[0].replace("'", ""), text)


def run_words(line: str, capsys: pytest.CaptureFixture[str]) -> Iterator[str]:
    """What running one line prints, the lines of standard error marked, and the exit code."""
    program, *words = shlex.split(line)
    assert program == "ppafo"
    try:
        code: object = main(words)
    except SystemExit as end:
        code = end.code
    out, errors = capsys.readouterr()
    said = wrapped_usage(aligned_actions(out)) if out.startswith("usage: ") else out
    yield from said.rstrip().splitlines()
    yield from (f"[stderr] {line}" for line in plain_choices(errors).splitlines())
    yield f"[exit {code}]"


def recorded_lines(session: Path) -> list[str]:
    """The command lines of a session."""
    lines = session.read_text(encoding="utf-8").splitlines()
    return [line.removeprefix(PROMPT) for line in lines if line.startswith(PROMPT)]


@pytest.mark.parametrize("session", SESSIONS, ids=lambda path: path.stem)
def test_a_command_says_what_was_recorded_and_leaves_no_file(
    session: Path, desk: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = sorted(desk.rglob("*"))
    blocks = ["\n".join([PROMPT + line, *run_words(line, capsys)]) for line in recorded_lines(session)]
    spoken = "\n\n".join(blocks).replace(str(desk), "DESK") + "\n"
    assert sorted(desk.rglob("*")) == before
    assert spoken == external_file(session)


def test_every_command_has_a_session_and_no_other_is_kept() -> None:
    kept = [path.stem for path in SESSIONS]
    missing = [
        f"printf '$ ppafo {name} --help\\n' > tests/snapshots/commands/{name}.txt"
        for name in COMMANDS
        if name not in kept
    ]
    assert missing == [], (
        "begin the session, add what it alone refuses as lines with $, and record what they print:\n"
        + "\n".join(missing)
        + "\npytest --inline-snapshot=fix tests/contract/test_command_words.py"
    )
    assert set(kept) == {"ppafo", *COMMANDS}
