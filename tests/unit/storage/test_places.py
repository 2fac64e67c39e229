"""Folders on a disk and at addresses behave alike."""

import os
import tracemalloc
from pathlib import Path

import pytest

from ppafo.errors import DataError
from ppafo.storage.places import Place, place_at, read_document


@pytest.fixture(params=["disk", "memory"])
def place(request: pytest.FixtureRequest, tmp_path: Path) -> Place:
    """An empty folder that is not there yet."""
    if request.param == "disk":
        return place_at(tmp_path / "new" / "folder")
    pytest.importorskip("fsspec")
    return place_at(f"memory://ppafo-{tmp_path.name}/folder")


def test_files_are_written_listed_read_replaced_and_removed(place: Place) -> None:
    assert place.names() == frozenset()
    place.write("one.json", b"1")
    place.write("deep/two.parquet", b"2")
    place.write("one.json", b"3")
    assert place.names() == {"one.json", "deep/two.parquet"}
    with place.open("one.json") as file:
        assert file.read() == b"3"
    place.remove("one.json")
    place.remove("one.json")
    place.tidy()
    assert place.names() == {"deep/two.parquet"}
    with pytest.raises(OSError):  # noqa: PT011  # whatever the file system calls it
        place.open("one.json")


def test_an_address_opens_the_same_folder_again(place: Place) -> None:
    place.write("one.json", b"1")
    assert place_at(place.address).names() == {"one.json"}


def test_what_another_process_may_be_writing_stays_and_what_is_left_from_days_ago_goes(tmp_path: Path) -> None:
    left, now_written = (tmp_path / f".study.json.writing-{mark}" for mark in ("0badcafe", "0badbeef"))
    for path in (left, now_written):
        path.write_bytes(b"{")
    os.utime(left, (0.0, 0.0))
    place = place_at(tmp_path)
    place.tidy()
    assert list(tmp_path.iterdir()) == [now_written]
    assert place.names() == frozenset()


def test_a_disk_says_how_much_is_free(tmp_path: Path) -> None:
    free = place_at(tmp_path / "not" / "yet").free_bytes()
    assert free is not None
    assert free > 0


def test_an_address_nobody_knows_is_one_line() -> None:
    pytest.importorskip("fsspec")
    with pytest.raises(DataError, match="nosuch://bucket/study: cannot be opened") as caught:
        place_at("nosuch://bucket/study")
    assert "\n" not in str(caught.value)


def test_an_address_without_the_extra_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "fsspec.core", None)
    with pytest.raises(DataError, match=r"pip install 'ppafo\[cluster\]'"):
        place_at("s3://bucket/study")


def test_a_small_document_takes_little_memory(place: Place) -> None:
    place.write("one.json", b'{"runs": 3}')
    tracemalloc.start()
    document = read_document(place, "one.json")
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert document == {"runs": 3}
    assert most < 10_000_000
