"""``ppafo examples``: what the how-to pages show, as files."""

import json
import re
import shlex
import textwrap
from importlib import resources
from pathlib import Path, PurePosixPath

import pytest

from ppafo.cli.examples import example_files, load_examples
from ppafo.cli.main import build_parser, main

ROOT = Path(__file__).parents[3]
EXAMPLES = load_examples()
PYPROJECT = PurePosixPath("pyproject.toml")
SCRIPTS = ("first-steps", "compare-controllers", "learn-a-controller", "actuators")
"""Examples that are no part of a page: scripts, which tests of their own run, and scenarios of actuators."""


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def blocks(page: str) -> list[str]:
    """The code blocks of a page, without their indentation."""
    text = (ROOT / page).read_text(encoding="utf-8")
    found = re.findall(r"^( *)```(?:toml|python)\n(.*?)^\1```", text, re.DOTALL | re.MULTILINE)
    return [textwrap.dedent(block) for _, block in found]


def test_every_folder_is_listed_and_every_entry_has_a_folder() -> None:
    folders = [item.name for item in (resources.files("ppafo") / "examples").iterdir() if item.is_dir()]
    assert sorted(EXAMPLES) == sorted(folders)


@pytest.mark.parametrize("name", [name for name in EXAMPLES if name not in SCRIPTS])
def test_the_files_of_an_example_are_what_its_page_shows(name: str) -> None:
    shown = blocks(EXAMPLES[name].page)
    for path, content in example_files(name).items():
        text = content.decode("utf-8")
        if path.name == "pyproject.toml":
            assert any(text.endswith(block) for block in shown), path
        elif path.name != "__init__.py":
            assert text in shown, path


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_command_is_one_and_every_file_that_it_names_is_there_or_made_or_needed(name: str) -> None:
    example = EXAMPLES[name]
    known = {str(path) for path in example_files(name)}
    for command in example.commands:
        words = shlex.split(command)
        if words[0] == "ppafo" and f'\n{words[1]} = "' not in example_files(name).get(PYPROJECT, b"").decode("utf-8"):
            build_parser(words[1]).parse_args(words[1:])
        named = {word.split(":")[0] for word in words if PurePosixPath(word.split(":")[0]).suffix in (".toml", ".py")}
        assert named <= known, command
        measured = {word for word in words if PurePosixPath(word).suffix in (".csv", ".mot")}
        assert all(word in example.needs for word in measured), command


def test_they_are_listed_with_what_they_show(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["examples"]) == 0
    printed = capsys.readouterr().out
    assert all(
        re.search(rf"^{name} +{re.escape(item.summary)}$", printed, re.MULTILINE) for name, item in EXAMPLES.items()
    )


def test_one_is_written_whole_with_its_folders(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["examples", "add-a-valve", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["files"] == [
        "my_valves/__init__.py",
        "my_valves/three_position.py",
        "pyproject.toml",
    ]
    written = {
        path.relative_to("add-a-valve").as_posix(): path.read_bytes() for path in Path("add-a-valve").rglob("*.*")
    }
    assert written == {str(path): content for path, content in example_files("add-a-valve").items()}


def test_what_is_there_is_not_touched(capsys: pytest.CaptureFixture[str]) -> None:
    Path("mine").mkdir()
    assert main(["examples", "tune", "--out", "mine"]) == 2
    assert "mine: already exists" in capsys.readouterr().err
    assert list(Path("mine").iterdir()) == []
