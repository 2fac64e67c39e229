"""Folders that a command makes whole: one policy for results and reproductions."""

import errno
import json
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from ppafo.errors import DataError
from ppafo.storage import files
from ppafo.storage.owned_folder import MARK, check_owned_folder, marked_folder, write_marked_folder

CLAIMS = "claims.json"
WHOLE = {"report.html": b"report", "step-response.csv": b"rows", CLAIMS: b'{"claims": []}'}


def check_reproduction_folder(folder: Path) -> None:
    check_owned_folder(folder, marked_folder("reproduce"))


def write_reproduction(folder: Path, contents: dict[str, bytes]) -> None:
    write_marked_folder(folder, contents, "reproduce")


def contents(folder: Path) -> dict[str, bytes]:
    entries = [entry for entry in folder.iterdir() if entry.name != MARK]
    return {entry.name: entry.read_bytes() if entry.is_file() else b"" for entry in entries}


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


def test_only_files_whose_hash_the_mark_states_are_removed(tmp_path: Path) -> None:
    # A folder from elsewhere, whose mark lists the name of a file of the user's.
    out = tmp_path / "out"
    write_reproduction(tmp_path / "theirs", {"thesis.txt": b"theirs"})
    out.mkdir()
    (out / MARK).write_bytes((tmp_path / "theirs" / MARK).read_bytes())
    (out / "thesis.txt").write_text("years of work")
    changed = r"files that were changed since its result of 'ppafo reproduce' was written \(thesis\.txt\)"
    with pytest.raises(DataError, match=changed):
        write_reproduction(out, WHOLE)
    (out / "thesis.txt").unlink()
    (out / "thesis.txt").symlink_to("nowhere")
    with pytest.raises(DataError, match=changed):
        write_reproduction(out, WHOLE)
    (out / "thesis.txt").unlink()
    write_reproduction(out, WHOLE)
    assert contents(out) == WHOLE


def test_a_mark_without_hashes_removes_nothing(tmp_path: Path) -> None:
    mark = {"format": "ppafo files", "schema_version": 1, "command": "reproduce", "files": ["thesis.txt"]}
    (tmp_path / MARK).write_text(json.dumps(mark))
    (tmp_path / "thesis.txt").write_text("years of work")
    with pytest.raises(DataError, match=r"has no file hashes"):
        write_reproduction(tmp_path, WHOLE)


def test_folders_inside_a_result_are_its_own_and_what_others_put_into_them_is_not(tmp_path: Path) -> None:
    out, kind = tmp_path / "out", marked_folder("export c")
    write_marked_folder(out, {"README.md": b"", "sources/deep/engine.c": b"1"}, "export c")
    write_marked_folder(out, {"README.md": b"", "sources/deep/engine.c": b"2"}, "export c")
    assert (out / "sources" / "deep" / "engine.c").read_bytes() == b"2"
    (out / "sources" / "deep" / "notes.txt").write_text("mine")
    with pytest.raises(DataError, match=r"\(sources/deep/notes\.txt\)"):
        check_owned_folder(out, kind)
    (out / "sources" / "deep" / "notes.txt").unlink()
    (out / "sources" / "mine").mkdir()
    with pytest.raises(DataError, match=r"\(sources/mine\)"):
        check_owned_folder(out, kind)


def something_else(folder: Path) -> str:
    (folder / "thesis.txt").write_text("years of work")
    return rf"is not empty and not a result of 'ppafo reproduce' \(it has no {MARK}\); choose another folder"


def a_reproduction_and_notes(folder: Path) -> str:
    write_reproduction(folder, WHOLE)
    (folder / "notes.txt").write_text("mine")
    return r"contains files that are not part of its result of 'ppafo reproduce' \(notes\.txt\)"


def a_reproduction_with_a_folder_in_it(folder: Path) -> str:
    write_reproduction(folder, WHOLE)
    (folder / "report.html").unlink()
    (folder / "report.html").mkdir()
    return r"contains files that are not part of its result of 'ppafo reproduce' \(report\.html\)"


FILLS = (
    something_else,
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


@pytest.mark.parametrize("there", [WHOLE, {}], ids=["an earlier result", "an empty folder"])
def test_folder_that_cannot_be_renamed_is_refused_before_anything_runs(
    there: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    if there:
        write_reproduction(out, there)
    rename = Path.rename

    def busy(self: Path, target: Path) -> Path:
        if self == out:
            raise OSError(errno.EBUSY, "Device or resource busy")
        return rename(self, target)

    check_reproduction_folder(out)
    monkeypatch.setattr(Path, "rename", busy)
    with pytest.raises(DataError, match=r"cannot be replaced \(device or resource busy\); choose a new subfolder"):
        check_reproduction_folder(out)
    assert contents(out) == there
    assert [entry.name for entry in tmp_path.iterdir()] == ["out"]


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux lets two folders change places in one step")
def test_earlier_result_and_new_one_change_places_in_one_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_reproduction(tmp_path / "out", WHOLE)
    if not files._exchange(tmp_path / "out", tmp_path / "out"):
        pytest.skip("not on this file system")

    def never(self: Path, target: Path) -> Path:
        raise AssertionError(f"{self} is renamed to {target}: a kill now would leave no result in its place")

    monkeypatch.setattr("ppafo.storage.owned_folder.check_folder_can_be_replaced", print)
    monkeypatch.setattr(Path, "rename", never)
    again = {CLAIMS: b'{"claims": [1]}', "report.html": b"new"}
    write_reproduction(tmp_path / "out", again)
    assert contents(tmp_path / "out") == again
    assert [entry.name for entry in tmp_path.iterdir()] == ["out"]
