"""A compiled program in its place: its name, whether it is whole, and how its module is filled."""

import contextlib
import hashlib
import json
import logging
import os
import secrets
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from ppafo.documents.regular_file import read_regular_file
from ppafo.engine.cache.folder import cache_folder, is_own
from ppafo.engine.compilers import Compiler
from ppafo.engine.entries import without_origins

logger = logging.getLogger("ppafo")

CHECKSUMS = "checksums.json"


@dataclass(frozen=True, slots=True)
class RequestedProgram:
    """A program: its text, and what compiles it."""

    source: str
    compiler: Compiler

    @property
    def name(self) -> str:
        """Name of its module."""
        digest = hashlib.sha256(without_origins(self.source).encode()).hexdigest()[:24]
        return f"ppafo_{self.compiler.name}_{self.compiler.effort.name.lower()}_{digest}"

    def place(self, folder: Path) -> Path:
        """Path of the cached file in ``folder``."""
        return folder / f"{self.name}-{short_hash(self.compiler.identity())}"

    def compile(self, path: Path) -> ModuleType:
        """Compile it, beside ``path`` where that is a place."""
        return execute(self.name, self.source, path, self.compiler.compile_text)


def load_kept_module(kept: Path, wanted: RequestedProgram) -> ModuleType | None:
    """Return the module of a program that is there and whole; one that is damaged is removed."""
    if not os.path.lexists(kept):
        return None
    if not is_whole(kept):
        logger.warning("ppafo: the compiled model %s is damaged; it is made anew", kept.name)
        remove(kept)
        return None
    try:
        path = kept / f"{wanted.name}.py"
        module = execute(wanted.name, wanted.source, path, wanted.compiler.run_text)
        os.utime(kept)
    except OSError:  # another process has removed it in this instant, or the disk is full
        return sys.modules.get(wanted.name)
    return module


def execute(name: str, source: str, path: Path, execute: Callable[[str, str, ModuleType], None]) -> ModuleType:
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


def short_hash(described: str) -> str:
    """Return a short name of what a compiler says of itself."""
    return hashlib.sha256(described.encode()).hexdigest()[:12]


def is_whole(kept: Path) -> bool:
    """Return whether a program's folder is as it was written, file by file."""
    try:
        stated = json.loads(read_regular_file(kept / CHECKSUMS))
        # What else lies there is no part of it.
        files = stated.items() if isinstance(stated, dict) else ()
        names = [name for name, _ in files]
        return (
            bool(names)
            and is_own(kept, [CHECKSUMS, *names])
            and all(hashlib.sha256(read_regular_file(kept / name)).hexdigest() == digest for name, digest in files)
        )
    except (OSError, ValueError, RecursionError):
        return False


def remove(folder: Path) -> None:
    """Remove a program, a file or a link; what cannot be removed stays.

    A folder is moved aside first: to another process a program is there and whole, or not there.
    """
    with contextlib.suppress(OSError):
        if folder.is_dir() and not folder.is_symlink():
            aside = folder.with_name(f".writing-{secrets.token_hex(8)}")
            folder.rename(aside)
            shutil.rmtree(aside)
        else:
            folder.unlink()


def is_kept(source: str, compiler: Compiler) -> bool:
    """True where a program was loaded by this compiler already, or lies in the cache."""
    wanted, folder = RequestedProgram(source, compiler), cache_folder()
    return wanted.name in sys.modules or (folder is not None and os.path.lexists(wanted.place(folder)))
