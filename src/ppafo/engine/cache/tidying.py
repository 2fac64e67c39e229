"""What lies in the cache folder, and how it goes again: by itself, or when a user clears it."""

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
from ppafo.errors import one_line

LONGEST_UNUSED = 90.0 * 86400.0
"""Seconds after which a program that no run has used is removed."""

MAXIMUM_BYTES = 500_000_000
"""Size of all programs above which those that were not used for longest are removed."""

PROGRAM = re.compile(r"ppafo_[a-z]+_[0-9a-f]{24}(-[0-9a-f]{12}|\..+)?")
"""Names of programs; also of an earlier release, whose programs lay in several files."""
_ASIDE = re.compile(rf"\.writing-[0-9a-f]{{16}}|{re.escape(LOCK)}{PROGRAM.pattern}|{NOTE}[a-z]+-[0-9a-f]{{12}}")
_TEXT = re.compile(r"[a-z]+-[0-9a-f]{32}|\.writing-[0-9a-f]{16}")
_LONGEST_ASIDE = 86400.0


@dataclass(frozen=True, slots=True)
class CachedProgram:
    """A program in the cache: where it is, its bytes, and when it was last used, in seconds since 1970."""

    place: Path
    size: int
    used: float


def list_left_out(folder: Path) -> dict[str, str]:
    """Return why compilers were left out lately, by their names."""
    left_out = {}
    for entry in entries_named(folder, _ASIDE):
        if entry.name.startswith(NOTE):
            with contextlib.suppress(OSError):
                text = read_regular_file(entry).decode("utf-8", "replace")
                if time.time() - entry.lstat().st_mtime < LEFT_OUT_FOR:
                    left_out[entry.name.removeprefix(NOTE).partition("-")[0]] = one_line(text)
    return left_out


def list_programs(folder: Path) -> list[CachedProgram]:
    """Return the programs in a cache folder, the one that was used last first."""
    return measured([*entries_named(folder, PROGRAM), *entries_named(folder / "__pycache__", PROGRAM)])


def clear(folder: Path) -> int:
    """Remove all that is kept, and the folder where nothing else is in it; return how many bytes that freed."""
    freed = 0
    aside, made = measured(entries_named(folder, _ASIDE)), measured(texts(folder))
    for program in [*list_programs(folder), *aside, *made]:
        remove(program.place)
        freed += 0 if os.path.lexists(program.place) else program.size
    for emptied in (folder / TEXTS, folder / "__pycache__", folder):
        with contextlib.suppress(OSError):
            emptied.rmdir()
    return freed


def evict(folder: Path) -> None:
    """Remove programs unused for ``LONGEST_UNUSED``, those beyond ``MAXIMUM_BYTES``, and what a killed process left."""
    evict_beyond(list_programs(folder), MAXIMUM_BYTES)
    for left in measured(entries_named(folder, _ASIDE)):
        # A day is longer than any compilation: what is older was left by a process that was killed.
        if time.time() - left.used > _LONGEST_ASIDE:
            remove(left.place)


def evict_beyond(programs: Iterable[CachedProgram], most: int) -> None:
    """Remove what was unused for ``LONGEST_UNUSED`` and what is beyond ``most`` bytes, the last used coming first."""
    now, total = time.time(), 0
    # The list begins with what was used last, so that the total passes the limit at what is dropped.
    for program in programs:
        total += program.size
        if now - program.used > LONGEST_UNUSED or total > most:
            remove(program.place)


def entries_named(folder: Path, pattern: re.Pattern[str]) -> list[Path]:
    """Return the entries of a folder with such a name; what others put beside them is left alone."""
    try:
        return [entry for entry in folder.iterdir() if pattern.fullmatch(entry.name)]
    except OSError:
        return []


def measured(places: Iterable[Path]) -> list[CachedProgram]:
    """Return programs and files with their sizes, the one that was used last first."""
    entries = []
    for path in places:
        try:
            files = [path] if path.is_symlink() or not path.is_dir() else [path, *path.rglob("*")]
            size, used = sum(path.lstat().st_size for path in files), path.lstat().st_mtime
        except OSError:  # another process has removed it in this instant
            size, used = 0, time.time()
        entries.append(CachedProgram(path, size, used))
    return sorted(entries, key=lambda entry: -entry.used)


def texts(folder: Path) -> list[Path]:
    """Return the texts in the folder of the programs, where theirs is no link; what others put beside them stays."""
    return [] if (folder / TEXTS).is_symlink() else entries_named(folder / TEXTS, _TEXT)


def kept_sizes(folder: Path) -> list[int]:
    """Return the sizes [bytes] of the texts that are kept in the folder of the programs."""
    return [made.size for made in measured(texts(folder))]
