"""``ppafo new example``: what the how-to pages show, as files."""

import json
import shlex
from importlib import resources
from pathlib import Path, PurePosixPath

import pytest

from ppafo.cli.main import build_parser, main
from ppafo.cli.new import example_files, load_examples
from tests.page_code import code_blocks

EXAMPLES = load_examples()
PYPROJECT = PurePosixPath("pyproject.toml")
SCRIPTS = ("first-steps", "gymnasium", "hardware-in-the-loop")
"""Examples that no page shows: tests/acceptance/test_examples.py runs them."""
DATA = ("muscle-pair.toml", "step-response-muscles.toml", "lever.toml", "chamber.toml")
"""A set, its scenario, a column map and a second problem, which pages name."""
SHOWN_IN_PART = ("muscle_pair.py",)
"""A module of which a page shows whole functions."""


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_every_folder_is_listed_and_every_entry_has_a_folder() -> None:
    folders = [item.name for item in (resources.files("ppafo") / "examples").iterdir() if item.is_dir()]
    assert sorted(EXAMPLES) == sorted(folders)


@pytest.mark.parametrize("name", [name for name in EXAMPLES if name not in SCRIPTS])
def test_the_files_of_an_example_are_what_its_page_shows(name: str) -> None:
    shown = code_blocks(EXAMPLES[name]["page"].removeprefix("docs/"), "toml", "python")
    for path, content in example_files(name).items():
        text = content.decode("utf-8")
        if path.name == "pyproject.toml":
            assert any(text.endswith(block) for block in shown), path
        elif path.name in SHOWN_IN_PART:
            parts = [block.strip().split("\n\n\n") for block in shown if block.startswith("def ")]
            assert [part for block in parts for part in block if part not in text] == [], path
            assert sum(map(len, parts)) > 1
        elif path.suffix not in (".csv", ".txt") and path.name not in ("__init__.py", *DATA):
            assert text in shown, path


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_command_is_one_and_every_file_that_it_names_is_there(name: str) -> None:
    known = {str(path) for path in example_files(name)}
    for command in EXAMPLES[name]["commands"]:
        words = shlex.split(command)
        if words[0] == "ppafo" and f'\n{words[1]} = "' not in example_files(name).get(PYPROJECT, b"").decode("utf-8"):
            build_parser(words[1:]).parse_args(words[1:])
        named = {word.split(":")[0] for word in words if PurePosixPath(word.split(":")[0]).suffix in (".toml", ".py")}
        assert named <= known, command


def test_one_is_written_whole_with_its_folders(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "example", "add-a-controller", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["files"] == [
        "my_laws/__init__.py",
        "my_laws/hysteresis.py",
        "pyproject.toml",
    ]
    folder = Path("add-a-controller")
    written = {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*.*")}
    assert written == {str(path): content for path, content in example_files("add-a-controller").items()}
