"""Result folders: complete, or not there."""

from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.signals import Channel, Recording
from ppafo.storage import check_result_folder, files, read_stored, write_result
from ppafo.storage.reading import read_recording

DOCUMENT = {"status": {"kind": "completed"}, "scenario": {"name": "task"}}


def recording(level: float = 1.0) -> Recording:
    return Recording("task", np.array([0.0, 0.1]), {"angle": Channel(np.full(2, level), "rad")}, "simulated")


def names(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir())


def test_a_folder_is_read_back_exactly_from_either_file(tmp_path: Path) -> None:
    folder = write_result(tmp_path / "task", recording(), DOCUMENT, {})
    stored = read_stored(folder)
    assert stored.recording == recording()
    assert stored.document["scenario"] == {"name": "task"}
    for place in (folder, folder / "recording.nc", folder / "recording.csv"):
        assert read_recording(place) == recording()


def test_an_empty_folder_is_filled_and_an_earlier_result_is_replaced_whole(tmp_path: Path) -> None:
    folder = tmp_path / "task"
    folder.mkdir()
    write_result(folder, recording(1.0), DOCUMENT, {"figure.pdf": b"old"})
    write_result(folder, recording(2.0), DOCUMENT, {})
    assert read_stored(folder).recording == recording(2.0)
    assert names(folder) == ["recording.csv", "recording.nc", "run.json"]
    assert names(tmp_path) == ["task"]


def test_a_file_in_the_place_of_the_folder_or_above_it_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(DataError, match="is a file; a ppafo result needs a folder"):
        check_result_folder(file)
    with pytest.raises(DataError, match=r"task: cannot be written: '.*file' is a file, not a folder"):
        check_result_folder(file / "task")


def test_a_check_leaves_no_trace(tmp_path: Path) -> None:
    check_result_folder(tmp_path / "new" / "task")
    assert names(tmp_path) == []


def interrupt_at(monkeypatch: pytest.MonkeyPatch, method: str, call: int) -> None:
    """Raise KeyboardInterrupt at the given call of a method of Path."""
    original = getattr(Path, method)
    calls = iter(range(1, 1000))

    def interrupted(self: Path, *arguments: object, **options: object) -> object:
        if next(calls) == call:
            raise KeyboardInterrupt
        return original(self, *arguments, **options)

    monkeypatch.setattr(Path, method, interrupted)


@pytest.mark.parametrize(
    ("method", "call"), [("write_bytes", 1), ("write_bytes", 2), ("write_bytes", 3), ("rename", 1), ("mkdir", 2)]
)
def test_an_interrupt_leaves_no_folder_and_nothing_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, method: str, call: int
) -> None:
    interrupt_at(monkeypatch, method, call)
    with pytest.raises(KeyboardInterrupt):
        write_result(tmp_path / "task", recording(), DOCUMENT, {})
    assert names(tmp_path) == []


@pytest.mark.parametrize(("method", "call"), [("write_bytes", 2), ("rename", 1), ("rename", 2), ("rename", 3)])
def test_an_interrupt_leaves_an_earlier_result_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, method: str, call: int
) -> None:
    folder = write_result(tmp_path / "task", recording(1.0), DOCUMENT, {})
    monkeypatch.setattr(files, "_exchange", print)
    interrupt_at(monkeypatch, method, call)
    with pytest.raises(KeyboardInterrupt):
        write_result(folder, recording(2.0), DOCUMENT, {})
    monkeypatch.undo()
    assert read_stored(folder).recording == recording(1.0)
    assert names(tmp_path) == ["task"]


def test_a_recording_that_changed_on_disk_is_refused_before_it_is_opened(tmp_path: Path) -> None:
    folder = write_result(tmp_path / "task", recording(), DOCUMENT, {})
    damaged = bytearray((folder / "recording.nc").read_bytes())
    damaged[len(damaged) // 2] ^= 1
    (folder / "recording.nc").write_bytes(damaged)
    with pytest.raises(DataError, match=r"recording\.nc: is not the file that was written with run\.json"):
        read_stored(folder)


@pytest.mark.parametrize(
    "content",
    ["{", "[]", '{"format": "ppafo result", "schema_version": 99}', '{"format": "ppafo result", "schema_version": 1}'],
)
def test_a_document_of_another_kind_or_version_is_refused(tmp_path: Path, content: str) -> None:
    folder = write_result(tmp_path / "task", recording(), DOCUMENT, {})
    (folder / "run.json").write_text(content)
    with pytest.raises(DataError, match=r"run\.json: "):
        read_stored(folder)
