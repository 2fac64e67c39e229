"""Compiled programs: found in the cache where they are whole, else compiled and kept."""

import contextlib
import hashlib
import json
import logging
import os
import secrets
import sys
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import ModuleType

from ppafo.documents.regular_file import read_regular_file
from ppafo.engine.cache.announcing import SECONDS_FILE, announce, compile_side_by_side, estimate_seconds
from ppafo.engine.cache.folder import CACHE_VARIABLE, cache_folder, is_own, refusal
from ppafo.engine.cache.lock import one_process
from ppafo.engine.cache.tidying import NOTE, PROGRAM, entries_named, evict, remove
from ppafo.engine.compilers import Compiler
from ppafo.engine.entries import without_origins
from ppafo.errors import reason

logger = logging.getLogger("ppafo")

_CHECKSUMS = "checksums.json"
_LOADING: dict[str, threading.RLock] = {}


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


def load_all(sources: Iterable[str], compiler: Compiler, load: Callable[[str], object]) -> None:
    """Import the modules with these sources by ``load``; several that ``compiler`` must make are made side by side."""
    missing = [source for source in dict.fromkeys(sources) if not is_kept(source, compiler)]
    # One alone is compiled where it is needed, with its own message.
    if len(missing) < 2:
        return
    folder = cache_folder()
    kept = [] if folder is None else entries_named(folder, PROGRAM)
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


def _import_program(wanted: _Wanted) -> ModuleType:
    folder = cache_folder()
    # Loading runs what lies there, so the folder is looked at each time, not once for the process.
    why_not = refusal(folder)
    if folder is None or why_not:
        logger.warning("ppafo: compiled models are not kept: %s; %s names another folder", why_not, CACHE_VARIABLE)
    else:
        kept = wanted.place(folder)
        module = _load_kept_module(kept, wanted)
        if module is not None:
            return module
        try:
            with one_process(kept):
                # Another process may have compiled it while this one waited for the lock.
                return _load_kept_module(kept, wanted) or _compile_and_keep(kept, wanted)
        except OSError as error:
            logger.warning("ppafo: the compiled model is not kept in %s: %s", folder, reason(error))
    with announce(wanted.estimate(()), "not kept"):
        return wanted.compile(Path(f"<{wanted.name}>"))


def _load_kept_module(kept: Path, wanted: _Wanted) -> ModuleType | None:
    """Return the module of a program that is there and whole; one that is damaged is removed."""
    if not os.path.lexists(kept):
        return None
    if not is_whole(kept):
        logger.warning("ppafo: the compiled model %s is damaged; it is made anew", kept.name)
        remove(kept)
        return None
    try:
        path = kept / f"{wanted.name}.py"
        module = _execute(wanted.name, wanted.source, path, wanted.compiler.run_text)
        os.utime(kept)
    except OSError:  # another process has removed it in this instant, or the disk is full
        return sys.modules.get(wanted.name)
    return module


def _compile_and_keep(kept: Path, wanted: _Wanted) -> ModuleType:
    """Compile a program in a folder aside, which takes its place when it is whole."""
    # Written aside and renamed: to other processes a program is whole, or not there.
    aside = kept.with_name(f".writing-{secrets.token_hex(8)}")
    try:
        aside.mkdir(mode=0o700)
        path = aside / f"{wanted.name}.py"
        path.write_text(wanted.source, encoding="utf-8")
        start = time.perf_counter()
        with announce(wanted.estimate(entries_named(kept.parent, PROGRAM)), f"kept in {kept.parent}"):
            module = wanted.compile(path)
        (aside / SECONDS_FILE).write_text(f"{time.perf_counter() - start:.2f}", encoding="ascii")
        (aside / _CHECKSUMS).write_text(json.dumps(_checksums(aside), indent=2), encoding="utf-8")
        for place in aside.rglob("*"):  # compilers let a group write where the user's habits (umask) do
            place.chmod(0o700 if place.is_dir() else 0o600)
        with contextlib.suppress(OSError):  # another process was quicker, with the same program
            aside.rename(kept)
        evict(kept.parent)
    except OSError:
        sys.modules.pop(wanted.name, None)
        raise
    finally:
        remove(aside)
    return module


def _execute(name: str, source: str, path: Path, execute: Callable[[str, str, ModuleType], None]) -> ModuleType:
    """Return the module that ``execute`` fills; Python's own compiled file, which may be damaged, is not asked."""
    module = ModuleType(name)
    module.__file__ = str(path)
    sys.modules[name] = module
    try:
        execute(source, str(path), module)
    # A module that was interrupted half-way must not be found by the next import.
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _short_hash(described: str) -> str:
    return hashlib.sha256(described.encode()).hexdigest()[:12]


def is_whole(kept: Path) -> bool:
    """Return whether a program's folder is as it was written, file by file."""
    try:
        stated = json.loads(read_regular_file(kept / _CHECKSUMS))
        # What else lies there is no part of it.
        files = stated.items() if isinstance(stated, dict) else ()
        names = [name for name, _ in files]
        return (
            bool(names)
            and is_own(kept, [_CHECKSUMS, *names])
            and all(hashlib.sha256(read_regular_file(kept / name)).hexdigest() == given for name, given in files)
        )
    except (OSError, ValueError, RecursionError):
        return False


def _checksums(folder: Path) -> dict[str, str]:
    """Return the hash of every file of a program but the list of them itself."""
    files = sorted(path for path in folder.rglob("*") if not path.is_dir() and path.name != _CHECKSUMS)
    return {path.relative_to(folder).as_posix(): hashlib.sha256(read_regular_file(path)).hexdigest() for path in files}
