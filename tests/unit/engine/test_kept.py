"""What takes long to make is made once on a computer, and nothing of others is taken for it."""

import os
import time
from pathlib import Path

import pytest

from ppafo.engine.cache.folder import TEXTS
from ppafo.engine.cache.texts import kept_bytes
from ppafo.engine.cache.tidying import clear, list_texts


class Maker:
    """Makes a content and counts how often it was asked to."""

    def __init__(self, content: bytes = b"made") -> None:
        self.content = content
        self.times = 0

    def __call__(self) -> bytes:
        self.times += 1
        return self.content


def only_file(cache: Path) -> Path:
    """The one file that is kept."""
    (file,) = (cache / TEXTS).iterdir()
    return file


def test_the_same_is_made_once_and_something_else_anew(fresh_cache: Path) -> None:
    make, other = Maker(), Maker(b"other")
    assert [kept_bytes("text", "a program", make) for _ in range(3)] == [b"made"] * 3
    assert make.times == 1
    assert kept_bytes("text", "another program", other) == kept_bytes("form", "a program", other) == b"other"
    assert other.times == 2


@pytest.mark.parametrize("place", [0, 40, -1])
def test_what_is_damaged_is_made_anew_and_kept_again(fresh_cache: Path, place: int) -> None:
    make = Maker(bytes(100))
    kept_bytes("text", "a program", make)
    spoilt = bytearray(only_file(fresh_cache).read_bytes())
    spoilt[place] ^= 1
    only_file(fresh_cache).write_bytes(bytes(spoilt))
    assert kept_bytes("text", "a program", make) == make.content
    assert kept_bytes("text", "a program", make) == make.content
    assert make.times == 2


@pytest.mark.parametrize("content", [b"", b"short"])
def test_a_file_without_its_hash_is_not_read(fresh_cache: Path, content: bytes) -> None:
    make = Maker()
    kept_bytes("text", "a program", make)
    only_file(fresh_cache).write_bytes(content)
    assert kept_bytes("text", "a program", make) == b"made"
    assert make.times == 2


def test_nothing_is_left_of_what_could_not_be_made(fresh_cache: Path) -> None:
    def fail() -> bytes:
        raise ValueError("it cannot be made")

    with pytest.raises(ValueError, match="cannot be made"):
        kept_bytes("text", "a program", fail)
    assert not (fresh_cache / TEXTS).exists()


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="folders have no owners here")
@pytest.mark.parametrize("where", ["", TEXTS])
def test_a_folder_that_others_can_write_is_neither_read_nor_believed(fresh_cache: Path, where: str) -> None:
    make = Maker()
    kept_bytes("text", "a program", make)
    (fresh_cache / where).chmod(0o777)
    assert kept_bytes("text", "a program", make) == b"made"
    assert make.times == 2


def test_a_link_is_not_read_and_what_it_leads_to_is_not_removed(fresh_cache: Path, tmp_path: Path) -> None:
    make = Maker()
    kept_bytes("text", "a program", make)
    file = only_file(fresh_cache)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    file.rename(elsewhere / file.name)
    file.symlink_to(elsewhere / file.name)
    assert kept_bytes("text", "a program", make) == b"made"
    assert make.times == 2
    clear(fresh_cache)
    fresh_cache.mkdir()
    (fresh_cache / TEXTS).symlink_to(elsewhere)
    assert kept_bytes("text", "a program", make) == b"made"
    assert make.times == 3
    assert clear(fresh_cache) == 0
    assert (elsewhere / file.name).exists()


def test_what_was_not_used_for_long_goes_and_what_was_used_stays(fresh_cache: Path) -> None:
    old, used = Maker(), Maker()
    kept_bytes("text", "old", old)
    before = set((fresh_cache / TEXTS).iterdir())
    kept_bytes("text", "used", used)
    half_a_year_ago = time.time() - 180.0 * 86400.0
    for file in (fresh_cache / TEXTS).iterdir():
        os.utime(file, (half_a_year_ago, half_a_year_ago))
    kept_bytes("text", "used", used)
    kept_bytes("text", "new", Maker())
    assert before.isdisjoint((fresh_cache / TEXTS).iterdir())
    kept_bytes("text", "used", used)
    assert used.times == 1


def test_the_largest_size_is_kept_by_removing_what_was_used_first(
    fresh_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ppafo.engine.cache.texts.MAXIMUM_BYTES", 1000)
    for number in range(6):
        kept_bytes("text", f"program {number}", Maker(bytes(300)))
    assert sum(text.size for text in list_texts(fresh_cache)) <= 1000
    last = Maker()
    kept_bytes("text", "program 5", last)
    assert last.times == 0


def test_clearing_removes_it_and_leaves_what_others_put_there(fresh_cache: Path) -> None:
    kept_bytes("text", "a program", Maker())
    theirs = fresh_cache / TEXTS / "notes.txt"
    theirs.write_text("mine")
    assert clear(fresh_cache) == sum(map(len, [b"made"])) + 32
    assert list((fresh_cache / TEXTS).iterdir()) == [theirs]
    theirs.unlink()
    clear(fresh_cache)
    assert not (fresh_cache / TEXTS).exists()
