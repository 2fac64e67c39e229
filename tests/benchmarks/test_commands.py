"""The commands of the repository refuse as those of the package do; the package names them where it had them once."""

import importlib
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from benchmarks import __main__ as speed
from ppafo.cli.main import main as package
from ppafo.storage.owned_folder import MARK

Command = Callable[[Sequence[str]], int]
COMMANDS: dict[str, tuple[Command, list[str], str]] = {
    "bench": (speed.main, ["--quick"], "benchmarks.study.measure_speed"),
}


@pytest.fixture(params=COMMANDS)
def refuses(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Callable[[Path], bool]:
    """Whether a command refuses an output folder, in one line and before any work."""
    main, words, work = COMMANDS[request.param]

    def never(*_arguments: object) -> None:
        raise AssertionError("it ran")

    importlib.import_module(work.rpartition(".")[0])
    monkeypatch.setattr(work, never)
    return lambda out: main([*words, "--out", str(out)]) == 2


@pytest.mark.parametrize("theirs", ["notes.txt", "bench.md", MARK])
def test_a_folder_of_others_is_refused_before_anything_runs(
    refuses: Callable[[Path], bool], theirs: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / theirs).write_text("mine")
    assert refuses(out)
    said = capsys.readouterr().err
    assert str(out) in said
    assert len(said.splitlines()) == 1
    assert [path.read_text() for path in out.iterdir()] == ["mine"]


def test_a_result_of_another_command_is_refused(refuses: Callable[[Path], bool], tmp_path: Path) -> None:
    assert package(["doctor", "--schema", "scenario", "--out", str(tmp_path / "out")]) == 0
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}
    assert refuses(tmp_path / "out")
    assert {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()} == before


@pytest.mark.parametrize("deeper", ["", "deeper"])
def test_a_file_in_the_place_of_the_folder_is_refused(
    refuses: Callable[[Path], bool], deeper: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "file"
    file.write_text("mine")
    assert refuses(file / deeper)
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert captured.out == ""
    assert file.read_text() == "mine"


def test_a_mistyped_option_is_one_line_and_exit_code_2(capsys: pytest.CaptureFixture[str]) -> None:
    assert speed.main(["--jsom"]) == 2
    said = capsys.readouterr().err
    assert "did you mean '--json'" in said
    assert said.count("\n") == 1
