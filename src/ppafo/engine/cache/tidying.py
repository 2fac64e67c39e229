"""Contents of the cache folder, and their removal: automatic, or when a user clears it."""

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
"""Seconds after which a program or text that no run has used is removed: about a season."""

MAXIMUM_BYTES = 500_000_000
"""Size of all programs above which those that were not used for longest are removed; one has some 300 kB."""

PROGRAM = re.compile(r"ppafo_[a-z]+(_[a-z]+)?_[0-9a-f]{24}(-[0-9a-f]{12}|\..+)?")
"""Names of programs, ``ppafo_COMPILER_EFFORT_HASH-HASH``; also of earlier releases, in other forms."""
_ASIDE = re.compile(rf"\.writing-[0-9a-f]{{16}}|{re.escape(LOCK)}{PROGRAM.pattern}|{NOTE}[a-z]+-[0-9a-f]{{12}}")
"""Names of what lies beside the programs: one that is being written, locks, and notes on compilers that do not work."""
_TEXT = re.compile(r"[a-z]+-[0-9a-f]{32}|\.writing-[0-9a-f]{16}")
"""Names of texts, ``KIND-HASH``, and of one that is being written."""
_LONGEST_ASIDE = 86400.0
"""Seconds, longer than any compilation, after which what lies aside was left by a process that was killed."""


@dataclass(frozen=True, slots=True)
class CacheEntry:
    """A file or folder in the cache: where it is, its bytes, and when it was last used, in seconds since 1970."""

    path: Path
    size: int
    used: float


def list_programs(folder: Path) -> list[CacheEntry]:
    """Return the programs in a cache folder, the one that was used last first."""
    return measured([*entries_named(folder, PROGRAM), *entries_named(folder / "__pycache__", PROGRAM)])


def list_texts(folder: Path) -> list[CacheEntry]:
    """Return the texts in a cache folder, the one that was used last first.

    What others put beside them is left alone, and so is all where their folder is a link.
    """
    return [] if (folder / TEXTS).is_symlink() else measured(entries_named(folder / TEXTS, _TEXT))


def list_left_out(folder: Path) -> dict[str, str]:
    """Return why compilers were left out lately, by their names."""
    reasons = {}
    for entry in entries_named(folder, _ASIDE):
        if entry.name.startswith(NOTE):
            with contextlib.suppress(OSError):
                note = read_regular_file(entry).decode("utf-8", "replace")
                if time.time() - entry.lstat().st_mtime < LEFT_OUT_FOR:
                    reasons[entry.name.removeprefix(NOTE).partition("-")[0]] = one_line(note)
    return reasons


def clear(folder: Path) -> int:
    """Remove all that is kept, and the folder where nothing else is in it; return how many bytes that freed."""
    freed = 0
    for entry in [*list_programs(folder), *measured(entries_named(folder, _ASIDE)), *list_texts(folder)]:
        remove(entry.path)
        freed += 0 if os.path.lexists(entry.path) else entry.size
    for emptied in (folder / TEXTS, folder / "__pycache__", folder):
        with contextlib.suppress(OSError):
            emptied.rmdir()
    return freed


def evict(folder: Path) -> None:
    """Remove programs unused for ``LONGEST_UNUSED``, those beyond ``MAXIMUM_BYTES``, and what a killed process left."""
    evict_beyond(list_programs(folder), MAXIMUM_BYTES)
    for entry in measured(entries_named(folder, _ASIDE)):
        if time.time() - entry.used > _LONGEST_ASIDE:
            remove(entry.path)


def evict_beyond(entries: Iterable[CacheEntry], maximum_bytes: int) -> None:
    """Remove entries unused for ``LONGEST_UNUSED`` and those beyond ``maximum_bytes``; the last used come first."""
    now, total = time.time(), 0
    # The list begins with what was used last, so that the total passes the limit at what is dropped.
    for entry in entries:
        total += entry.size
        if now - entry.used > LONGEST_UNUSED or total > maximum_bytes:
            remove(entry.path)


def entries_named(folder: Path, pattern: re.Pattern[str]) -> list[Path]:
    """Return the entries of a folder with such a name, in no order; none where there is no such folder."""
    try:
        return [entry for entry in folder.iterdir() if pattern.fullmatch(entry.name)]
    except OSError:
        return []


def measured(paths: Iterable[Path]) -> list[CacheEntry]:
    """Return files and folders with their sizes, the one that was used last first."""
    entries = []
    for path in paths:
        try:
            files = [path] if path.is_symlink() or not path.is_dir() else [path, *path.rglob("*")]
            size, used = sum(file.lstat().st_size for file in files), path.lstat().st_mtime
        except OSError:  # another process has removed it in this instant
            size, used = 0, time.time()
        entries.append(CacheEntry(path, size, used))
    return sorted(entries, key=lambda entry: -entry.used)
