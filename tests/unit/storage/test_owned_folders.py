"""Folders that a command makes whole: one policy for results and reproductions."""

from collections.abc import Callable
from pathlib import Path

import pytest

from ppafo.errors import DataError
from ppafo.reporting.reproduction_files import CLAIMS, FILES, check_reproduction_folder, write_reproduction

WHOLE = {name: name.encode() for name in FILES} | {CLAIMS: b'{"claims": []}'}


def contents(folder: Path) -> dict[str, bytes]:
    return {entry.name: entry.read_bytes() if entry.is_file() else b"" for entry in folder.iterdir()}


@pytest.mark.parametrize("there", [True, False], ids=["an empty folder", "no folder"])
def test_an_empty_or_absent_folder_is_taken(there: bool, tmp_path: Path) -> None:
    folder = tmp_path / "new" / "out"
    if there:
        folder.mkdir(parents=True)
    write_reproduction(folder, WHOLE)
    assert contents(folder) == WHOLE
    assert [entry.name for entry in folder.parent.iterdir()] == ["out"]


def test_an_earlier_reproduction_is_replaced_whole(tmp_path: Path) -> None:
    write_reproduction(tmp_path / "out", WHOLE)
    again = {CLAIMS: b'{"claims": [1]}', "report.html": b"new"}
    write_reproduction(tmp_path / "out", again)
    assert contents(tmp_path / "out") == again
    assert [entry.name for entry in tmp_path.iterdir()] == ["out"]


def something_else(folder: Path) -> str:
    (folder / "thesis.txt").write_text("years of work")
    return rf"is not empty and not a ppafo reproduction \(it has no {CLAIMS}\); choose another folder"


def claims_of_somebody_else(folder: Path) -> str:
    (folder / CLAIMS).write_text('["mine"]')
    return r"claims\.json: is not of a ppafo reproduction"


def claims_that_are_no_json(folder: Path) -> str:
    (folder / CLAIMS).write_text("mine")
    return r"claims\.json: is not JSON"


def a_reproduction_and_notes(folder: Path) -> str:
    write_reproduction(folder, WHOLE)
    (folder / "notes.txt").write_text("mine")
    return r"holds files that are not of its ppafo reproduction \(notes\.txt\)"


def a_reproduction_with_a_folder_in_it(folder: Path) -> str:
    write_reproduction(folder, WHOLE)
    (folder / "report.html").unlink()
    (folder / "report.html").mkdir()
    return r"holds files that are not of its ppafo reproduction \(report\.html\)"


FILLS = (
    something_else,
    claims_of_somebody_else,
    claims_that_are_no_json,
    a_reproduction_and_notes,
    a_reproduction_with_a_folder_in_it,
)


@pytest.mark.parametrize("fill", FILLS, ids=lambda fill: fill.__name__)
def test_a_folder_with_anything_of_somebody_elses_is_refused_and_left_alone(
    fill: Callable[[Path], str], tmp_path: Path
) -> None:
    folder = tmp_path / "out"
    folder.mkdir()
    message = fill(folder)
    before = contents(folder)
    with pytest.raises(DataError, match=message):
        check_reproduction_folder(folder)
    with pytest.raises(DataError, match=message):
        write_reproduction(folder, WHOLE)
    assert contents(folder) == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["out"]


def test_a_failure_while_writing_leaves_the_earlier_reproduction(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_reproduction(tmp_path / "out", WHOLE)
    write, calls = Path.write_bytes, iter(range(100))

    def full(self: Path, content: bytes) -> int:
        if next(calls) == 1:
            raise OSError(28, "No space left on device")
        return write(self, content)

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(DataError, match="out: cannot be written: no space left on device"):
        write_reproduction(tmp_path / "out", {CLAIMS: b'{"claims": [1]}', "report.html": b"new"})
    assert contents(tmp_path / "out") == WHOLE
    assert [entry.name for entry in tmp_path.iterdir()] == ["out"]
