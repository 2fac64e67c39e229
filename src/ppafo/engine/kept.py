"""What was made before and takes long to make, kept beside the compiled programs and found by what it was made from.

A file of it begins with the hash of the rest. One that is damaged or another user's is made anew; whatever is wrong
with the folder, only the next process makes it again.
"""

import contextlib
import hashlib
import os
import re
import secrets
import stat
import time
from collections.abc import Callable
from pathlib import Path

from ppafo.documents.regular_file import read_regular_file
from ppafo.engine.cache import LONGEST_UNUSED, WRITTEN_BY_OTHERS, cache_folder, refusal

FOLDER = "made"
"""Folder of these files in that of the programs."""

MAXIMUM_BYTES = 50_000_000
"""Size of all files above which those that were not used for longest are removed."""

_HASH_BYTES = hashlib.sha256().digest_size
_OWN_NAME = re.compile(r"[a-z]+-[0-9a-f]{32}|\.writing-[0-9a-f]{16}")


def kept(kind: str, made_from: str, make: Callable[[], bytes]) -> bytes:
    """Return what ``make`` makes of ``made_from``, all that it depends on; from the disk where it was made before."""
    folder = cache_folder()
    if folder is None or refusal(folder):
        return make()
    key = hashlib.sha256(made_from.encode("utf-8", "surrogatepass")).hexdigest()[:32]
    place = folder / FOLDER / f"{kind}-{key}"
    content = _read(place)
    if content is None:
        content = make()
        with contextlib.suppress(OSError):
            _write(place, content)
            _evict(place.parent)
    return content


def kept_sizes(folder: Path) -> list[int]:
    """Return the sizes [bytes] of what is kept in the folder of the programs."""
    sizes = []
    for place in _files(folder / FOLDER):
        with contextlib.suppress(OSError):  # another process has removed it in this instant
            sizes.append(place.lstat().st_size)
    return sizes


def clear_kept(folder: Path) -> int:
    """Remove all of it from the folder of the programs; returns how many bytes that made free."""
    sizes = [_remove(place) for place in _files(folder / FOLDER)]
    with contextlib.suppress(OSError):
        (folder / FOLDER).rmdir()
    return sum(sizes)


def _read(place: Path) -> bytes | None:
    try:
        found, above = place.lstat(), place.parent.lstat()
        if not (stat.S_ISREG(found.st_mode) and stat.S_ISDIR(above.st_mode) and _is_own(found, above)):
            return None
        content = read_regular_file(place)
        os.utime(place)
    except OSError:
        return None
    stated, rest = content[:_HASH_BYTES], content[_HASH_BYTES:]
    return rest if hashlib.sha256(rest).digest() == stated else None


def _is_own(found: os.stat_result, above: os.stat_result) -> bool:
    """Tell whether a file is this user's, and so its folder, where nobody else can write: what is in it may be run."""
    if not hasattr(os, "geteuid"):
        return True
    return {found.st_uid, above.st_uid} <= {0, os.geteuid()} and not above.st_mode & WRITTEN_BY_OTHERS


def _write(place: Path, content: bytes) -> None:
    if place.parent.is_symlink():
        return
    place.parent.mkdir(mode=0o700, exist_ok=True)
    aside = place.with_name(f".writing-{secrets.token_hex(8)}")
    try:
        aside.write_bytes(hashlib.sha256(content).digest() + content)
        aside.replace(place)
    finally:
        aside.unlink(missing_ok=True)


def _evict(folder: Path) -> None:
    """Remove what was not used for long, and beyond the largest size what was not used for longest."""
    total, now = 0, time.time()
    for place in sorted(_files(folder), key=_last_used, reverse=True):
        with contextlib.suppress(OSError):
            total += place.lstat().st_size
            if total > MAXIMUM_BYTES or now - _last_used(place) > LONGEST_UNUSED:
                _remove(place)


def _last_used(place: Path) -> float:
    try:
        return place.lstat().st_mtime
    except OSError:  # another process has removed it in this instant
        return 0.0


def _files(folder: Path) -> list[Path]:
    """The files of this module in a folder that is no link; what others put beside them is left alone."""
    try:
        return [] if folder.is_symlink() else [item for item in folder.iterdir() if _OWN_NAME.fullmatch(item.name)]
    except OSError:
        return []


def _remove(place: Path) -> int:
    """Remove a file; returns its size, 0 where it stays."""
    try:
        size = place.lstat().st_size
        place.unlink()
    except OSError:
        return 0
    return size
