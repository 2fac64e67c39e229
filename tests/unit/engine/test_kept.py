"""What takes long to make is made once on a computer, and nothing of others is taken for it."""

import os
import time
from pathlib import Path

import pytest

from ppafo.engine.cache.folder import TEXTS
from ppafo.engine.cache.texts import kept_bytes
from ppafo.engine.cache.tidying import clear


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
