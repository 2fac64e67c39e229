"""Generated modules on disk: compiled once for each computer, kept in a folder that nobody else can write.

Loading compiled code runs it, so a folder is used only where it belongs to this user, and a program only where it is
whole to the last bit. Whatever is wrong with the folder, a model is compiled and runs; only the next start waits again.
"""

import contextlib
import hashlib
import json
import logging
import os
import re
import secrets
import shutil
import stat
import sys
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import ModuleType

from ppafo.documents.regular_file import read_regular_file
from ppafo.engine.compile_times import SECONDS_FILE, announce, compile_side_by_side, estimate_seconds
from ppafo.engine.compilers import Compiler
from ppafo.engine.private_folder import WRITTEN_BY_OTHERS, refusal
from ppafo.engine.program_lock import LOCK, one_process
from ppafo.engine.source_text import without_origins
from ppafo.errors import reason

logger = logging.getLogger("ppafo")

CACHE_VARIABLE = "PPAFO_CACHE_DIR"
LONGEST_UNUSED = 90.0 * 86400.0
"""Seconds after which a program that no run has used is removed."""

MAXIMUM_BYTES = 500_000_000
"""Size of all programs above which those that were not used for longest are removed."""

_PROGRAM = re.compile(r"ppafo_[a-z]+_[0-9a-f]{24}(-[0-9a-f]{12}|\..+)?")
"""What the name of a program looks like; beside it, one of an earlier release, which lay in several files."""

NOTE = "not-working-"
_ASIDE = re.compile(rf"\.writing-[0-9a-f]{{16}}|{re.escape(LOCK)}{_PROGRAM.pattern}|{NOTE}[a-z]+-[0-9a-f]{{12}}")
_LONGEST_ASIDE = 86400.0
_CHECKSUMS = "checksums.json"
_LOADING: dict[str, threading.RLock] = {}


@dataclass(frozen=True, slots=True)
class CachedProgram:
    """A program in the cache: where it is, its bytes, and when it was last used, in seconds since 1970."""

    place: Path
    size: int
    used: float


def cache_folder() -> Path | None:
    """Return the folder of the programs: ``PPAFO_CACHE_DIR``, or the user's cache; None where the user has no home."""
    if os.environ.get(CACHE_VARIABLE):
        return Path(os.environ[CACHE_VARIABLE]).absolute()
    import platformdirs

    try:
        folder = Path(platformdirs.user_cache_dir("ppafo", appauthor=False)) / "programs"
    except RuntimeError:
        return None
    return folder if folder.is_absolute() else None


@dataclass(frozen=True, slots=True)
class _Wanted:
    """A program: its text, and what compiles it."""

    source: str
    compiler: Compiler

    @property
    def name(self) -> str:
        """Name of its module."""
        return f"ppafo_{self.compiler.name}_{hashlib.sha256(without_origins(self.source).encode()).hexdigest()[:24]}"

    def place(self, folder: Path) -> Path:
        """Where it is kept."""
        return folder / f"{self.name}-{_short_hash(self.compiler.identity())}"

    def compile(self, path: Path) -> ModuleType:
        """Compile it, beside ``path`` where that is a place."""
        return _execute(self.name, self.source, path, self.compiler.compile_text)

    def load(self, path: Path) -> ModuleType:
        """Load what was compiled beside ``path``."""
        return _execute(self.name, self.source, path, self.compiler.run_text)

    def estimate(self, kept: Iterable[Path]) -> float:
        """About how long it takes to compile [s]."""
        kind = self.name.rpartition("_")[0]
        alike = [place for place in kept if place.name.startswith(f"{kind}_")]
        return estimate_seconds(self.source, alike, self.compiler.seconds_per_byte)


def load_generated(source: str, compiler: Compiler) -> ModuleType:
    """Import the module with this source, from the cache where it is there and whole; else it is compiled.

    ProgramError where it cannot be compiled, in terms of the file that the function at fault was written in;
    CompilerError where the compiler does not work.
    """
    wanted = _Wanted(source, compiler)
    # A second thread must not get a module of which only the beginning has run.
    with _LOADING.setdefault(wanted.name, threading.RLock()):
        return sys.modules[wanted.name] if wanted.name in sys.modules else _import_program(wanted)


def load_all(sources: Iterable[str], compiler: Compiler, load: Callable[[str], ModuleType]) -> None:
    """Import the modules with these sources by ``load``; several that ``compiler`` must make are made side by side."""
    missing = [source for source in dict.fromkeys(sources) if not is_kept(source, compiler)]
    if len(missing) < 2:
        return
    folder = cache_folder()
    kept = [] if folder is None else _entries_named(folder, _PROGRAM)
    expected = sum(_Wanted(source, compiler).estimate(kept) for source in missing)
    where = "not kept" if folder is None or refusal(folder) else f"kept in {folder}"
    compile_side_by_side([partial(load, source) for source in missing], expected, where)


def is_kept(source: str, compiler: Compiler) -> bool:
    """True where a program was loaded by this compiler already, or lies in the cache."""
    wanted, folder = _Wanted(source, compiler), cache_folder()
    return wanted.name in sys.modules or (folder is not None and os.path.lexists(wanted.place(folder)))


def note_name(compiler: Compiler) -> str:
    """Name of the file in the cache that says why a compiler does not work on this computer."""
    return f"{NOTE}{compiler.name}-{_short_hash(compiler.identity())}"


def list_programs(folder: Path) -> list[CachedProgram]:
    """Return the programs in a cache folder, the one that was used last first."""
    places = [*_entries_named(folder, _PROGRAM), *_entries_named(folder / "__pycache__", _PROGRAM)]
    return sorted((_measure_program(place) for place in places), key=lambda item: -item.used)


def clear(folder: Path) -> int:
    """Remove all programs, and the folder where nothing else is in it; returns how many bytes that made free."""
    freed = 0
    for program in [*list_programs(folder), *map(_measure_program, _entries_named(folder, _ASIDE))]:
        _remove(program.place)
        freed += 0 if os.path.lexists(program.place) else program.size
    for emptied in (folder / "__pycache__", folder):
        with contextlib.suppress(OSError):
            emptied.rmdir()
    return freed


def evict(folder: Path) -> None:
    """Remove programs unused for ``LONGEST_UNUSED``, those beyond ``MAXIMUM_BYTES``, and what a killed process left."""
    now, total = time.time(), 0
    for program in list_programs(folder):
        total += program.size
        if now - program.used > LONGEST_UNUSED or total > MAXIMUM_BYTES:
            _remove(program.place)
    for place in _entries_named(folder, _ASIDE):
        if now - _measure_program(place).used > _LONGEST_ASIDE:
            _remove(place)


def _import_program(wanted: _Wanted) -> ModuleType:
    folder = cache_folder()
    why_not = refusal(folder)
    if folder is None or why_not:
        logger.warning("ppafo: compiled models are not kept: %s; %s names another folder", why_not, CACHE_VARIABLE)
        return _compile_in_memory(wanted)
    kept = wanted.place(folder)
    module = _load_kept_module(kept, wanted)
    if module is not None:
        return module
    try:
        with one_process(kept):
            return _load_kept_module(kept, wanted) or _compile_and_keep(kept, wanted)
    except OSError as error:
        logger.warning("ppafo: the compiled model is not kept in %s: %s", folder, reason(error))
        return _compile_in_memory(wanted)


def _load_kept_module(kept: Path, wanted: _Wanted) -> ModuleType | None:
    """Return the module of a program that is there and whole; one that is damaged is removed."""
    if not os.path.lexists(kept):
        return None
    if not _is_whole(kept):
        logger.warning("ppafo: the compiled model %s is damaged; it is made anew", kept.name)
        _remove(kept)
        return None
    try:
        module = wanted.load(kept / f"{wanted.name}.py")
        os.utime(kept)
    except OSError:  # another process has removed it in this instant, or the disk is full
        return sys.modules.get(wanted.name)
    return module


def _compile_and_keep(kept: Path, wanted: _Wanted) -> ModuleType:
    """Compile a program in a folder aside, which takes its place when it is whole."""
    aside = kept.with_name(f".writing-{secrets.token_hex(8)}")
    try:
        aside.mkdir(mode=0o700)
        path = aside / f"{wanted.name}.py"
        path.write_text(wanted.source, encoding="utf-8")
        start = time.perf_counter()
        with announce(wanted.estimate(_entries_named(kept.parent, _PROGRAM)), f"kept in {kept.parent}"):
            module = wanted.compile(path)
        (aside / SECONDS_FILE).write_text(f"{time.perf_counter() - start:.2f}", encoding="ascii")
        (aside / _CHECKSUMS).write_text(json.dumps(_checksums(aside), indent=2), encoding="utf-8")
        with contextlib.suppress(OSError):  # another process was quicker, with the same program
            aside.rename(kept)
        evict(kept.parent)
    except OSError:
        sys.modules.pop(wanted.name, None)
        raise
    finally:
        _remove(aside)
    return module


def _compile_in_memory(wanted: _Wanted) -> ModuleType:
    with announce(wanted.estimate(()), "not kept"):
        return wanted.compile(Path(f"<{wanted.name}>"))


def _execute(name: str, source: str, path: Path, execute: Callable[[str, str, ModuleType], None]) -> ModuleType:
    """Return the module that ``execute`` fills; Python's own compiled file, which may be damaged, is not asked."""
    module = ModuleType(name)
    module.__file__ = str(path)
    sys.modules[name] = module
    try:
        execute(source, str(path), module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _short_hash(described: str) -> str:
    return hashlib.sha256(described.encode()).hexdigest()[:12]


def _is_whole(kept: Path) -> bool:
    """Tell whether a program's folder is as it was written, file by file."""
    try:
        stated = json.loads(read_regular_file(kept / _CHECKSUMS))
        # What else lies there is no part of it: Numba tries, for an instant, whether it could write a file of its own.
        files = stated.items() if isinstance(stated, dict) else ()
        return _is_own(kept) and bool(files) and all(_checksum(kept / name) == given for name, given in files)
    except (OSError, ValueError, RecursionError):
        return False


def _is_own(kept: Path) -> bool:
    """Tell whether a program and all in it is this user's: one that came while others could write stays theirs."""
    found = [kept.lstat()]
    for place in kept.rglob("*"):
        with contextlib.suppress(FileNotFoundError):
            found.append(place.lstat())
    if not hasattr(os, "geteuid"):
        return stat.S_ISDIR(found[0].st_mode)
    is_whose = all(item.st_uid in (0, os.geteuid()) for item in found)
    folders = [item for item in found if stat.S_ISDIR(item.st_mode)]
    return is_whose and found[0] in folders and not any(item.st_mode & WRITTEN_BY_OTHERS for item in folders)


def _checksums(folder: Path) -> dict[str, str]:
    """Return the hash of every file of a program but the list of them itself."""
    files = sorted(path for path in folder.rglob("*") if not path.is_dir() and path.name != _CHECKSUMS)
    return {path.relative_to(folder).as_posix(): _checksum(path) for path in files}


def _checksum(path: Path) -> str:
    return hashlib.sha256(read_regular_file(path)).hexdigest()


def _entries_named(folder: Path, pattern: re.Pattern[str]) -> list[Path]:
    """Return what in a folder has such a name; what others put beside it is left alone."""
    try:
        return [place for place in folder.iterdir() if pattern.fullmatch(place.name)]
    except OSError:
        return []


def _measure_program(place: Path) -> CachedProgram:
    try:
        files = [place] if place.is_symlink() or not place.is_dir() else [place, *place.rglob("*")]
        return CachedProgram(place, sum(path.lstat().st_size for path in files), place.lstat().st_mtime)
    except OSError:  # another process has removed it in this instant
        return CachedProgram(place, 0, time.time())


def _remove(place: Path) -> None:
    """Remove a program, a file or a link; what cannot be removed stays.

    A folder is moved aside first: to another process a program is there and whole, or not there.
    """
    with contextlib.suppress(OSError):
        if place.is_dir() and not place.is_symlink():
            aside = place.with_name(f".writing-{secrets.token_hex(8)}")
            place.rename(aside)
            shutil.rmtree(aside)
        else:
            place.unlink()
