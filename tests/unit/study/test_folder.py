"""The folder of a study's results."""

import os
from pathlib import Path

import pytest

from ppafo.study.folder import StudyFolder, study_folder


@pytest.fixture
def folder(tmp_path: Path) -> StudyFolder:
    """An empty folder that is not there yet."""
    return study_folder(tmp_path / "new" / "folder")


def test_files_are_written_listed_read_replaced_and_removed(folder: StudyFolder) -> None:
    assert folder.names() == frozenset()
    folder.write("one.json", b"1")
    folder.write("deep/two.parquet", b"2")
    folder.write("one.json", b"3")
    assert folder.names() == {"one.json", "deep/two.parquet"}
    with folder.open("one.json") as file:
        assert file.read() == b"3"
    folder.remove("one.json")
    folder.remove("one.json")
    folder.tidy()
    assert folder.names() == {"deep/two.parquet"}
    with pytest.raises(FileNotFoundError):
        folder.open("one.json")


def test_what_another_process_may_be_writing_stays_and_what_is_left_from_days_ago_goes(tmp_path: Path) -> None:
    left, now_written = (tmp_path / f".study.json.writing-{mark}" for mark in ("0badcafe", "0badbeef"))
    for path in (left, now_written):
        path.write_bytes(b"{")
    os.utime(left, (0.0, 0.0))
    folder = study_folder(tmp_path)
    folder.tidy()
    assert list(tmp_path.iterdir()) == [now_written]
    assert folder.names() == frozenset()
