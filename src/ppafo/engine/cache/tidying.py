"""Contents of the cache folder, and their removal: automatically, or when a user clears the cache."""

import contextlib
import os
import re
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from ppafo.documents.regular_file import read_regular_file
from ppafo.engine.cache.folder import LEFT_OUT_FOR, LOCK, NOTE, TEXTS
from ppafo.engine.cache.kept import remove
from ppafo.wording import one_line

LONGEST_UNUSED = 90.0 * 86400.0
"""Time [s] after which an unused program or text is removed: about three months."""

MAXIMUM_BYTES = 500_000_000
"""Total size of all programs [byte] above which the least recently used are removed; one program has about 300 kB."""

PROGRAM = re.compile(r"ppafo_[a-z]+(_[a-z]+)?_[0-9a-f]{24}(-[0-9a-f]{12}|\..+)?")
"""Pattern of program names, ``ppafo_COMPILER_EFFORT_HASH-HASH``, including the forms of earlier releases."""
_ASIDE = re.compile(rf"\.writing-[0-9a-f]{{16}}|{re.escape(LOCK)}{PROGRAM.pattern}|{NOTE}[a-z]+-[0-9a-f]{{12}}")
"""Pattern of other names in the folder: programs being written, locks, and notes on compilers that do not work."""
_TEXT = re.compile(r"[a-z]+-[0-9a-f]{32}|\.writing-[0-9a-f]{16}")
"""Pattern of text names, ``KIND-HASH``, and of a text being written."""
_LONGEST_ASIDE = 86400.0
"""Age [s] after which temporary files were left by a killed process; longer than any compilation."""


@dataclass(frozen=True, slots=True)
class _CacheEntry:
    """File or folder in the cache: path, size [byte], and time of last use [s since 1970]."""

    path: Path
    size: int
    used: float


def list_programs(folder: Path) -> list[_CacheEntry]:
    """Return the programs in a cache folder, most recently used first."""
    return measured([*entries_named(folder, PROGRAM), *entries_named(folder / "__pycache__", PROGRAM)])


def list_texts(folder: Path) -> list[_CacheEntry]:
    """Return the texts in a cache folder, most recently used first.

    Other files in the folder are ignored, and so are all files if the folder is a link.
    """
    return [] if (folder / TEXTS).is_symlink() else measured(entries_named(folder / TEXTS, _TEXT))


def list_left_out(folder: Path) -> dict[str, str]:
    """Return the recorded reasons why compilers do not work, by compiler name."""
    reasons = {}
    for entry in entries_named(folder, _ASIDE):
        if entry.name.startswith(NOTE):
            with contextlib.suppress(OSError):
                note = read_regular_file(entry).decode("utf-8", "replace")
                if time.time() - entry.lstat().st_mtime < LEFT_OUT_FOR:
                    reasons[entry.name.removeprefix(NOTE).partition("-")[0]] = one_line(note)
    return reasons


def clear(folder: Path) -> int:
    """Remove all cached entries, and the folder if it is then empty; return the number of bytes freed."""
    freed = 0
    for entry in [*list_programs(folder), *measured(entries_named(folder, _ASIDE)), *list_texts(folder)]:
        remove(entry.path)
        freed += 0 if os.path.lexists(entry.path) else entry.size
    for emptied in (folder / TEXTS, folder / "__pycache__", folder):
        with contextlib.suppress(OSError):
            emptied.rmdir()
    return freed


def evict(folder: Path) -> None:
    """Remove programs unused for ``LONGEST_UNUSED`` or beyond ``MAXIMUM_BYTES``, and remains of killed processes."""
    evict_beyond(list_programs(folder), MAXIMUM_BYTES)
    for entry in measured(entries_named(folder, _ASIDE)):
        if time.time() - entry.used > _LONGEST_ASIDE:
            remove(entry.path)


def evict_beyond(entries: Iterable[_CacheEntry], maximum_bytes: int) -> None:
    """Remove entries unused for ``LONGEST_UNUSED`` and the least recently used entries beyond ``maximum_bytes``."""
    now, total = time.time(), 0
    # The list begins with what was used last, so that the total passes the limit at what is dropped.
    for entry in entries:
        total += entry.size
        if now - entry.used > LONGEST_UNUSED or total > maximum_bytes:
            remove(entry.path)


def entries_named(folder: Path, pattern: re.Pattern[str]) -> list[Path]:
    """Return the entries of a folder whose names match a pattern, unsorted; empty if the folder does not exist."""
    try:
        return [entry for entry in folder.iterdir() if pattern.fullmatch(entry.name)]
    except OSError:
        return []


def measured(paths: Iterable[Path]) -> list[_CacheEntry]:
    """Return files and folders with their sizes, most recently used first."""
    entries = []
    for path in paths:
        try:
            files = [path] if path.is_symlink() or not path.is_dir() else [path, *path.rglob("*")]
            size, used = sum(file.lstat().st_size for file in files), path.lstat().st_mtime
        except OSError:  # another process has removed it in this instant
            size, used = 0, time.time()
        entries.append(_CacheEntry(path, size, used))
    return sorted(entries, key=lambda entry: -entry.used)
