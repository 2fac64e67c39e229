"""Compiled program in the cache: name, integrity check, and loading of its module."""

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
from ppafo.engine.cache.folder import cache_folder, is_private
from ppafo.engine.compilers import Compiler
from ppafo.engine.entries import without_origins

logger = logging.getLogger("ppafo")

CHECKSUMS = "checksums.json"


@dataclass(frozen=True, slots=True)
class RequestedProgram:
    """Source text of a program, and the compiler that is to compile it."""

    source: str
    compiler: Compiler

    @property
    def name(self) -> str:
        """Name of the module."""
        digest = hashlib.sha256(without_origins(self.source).encode()).hexdigest()[:24]
        return f"ppafo_{self.compiler.name}_{self.compiler.effort.name.lower()}_{digest}"

    def folder_in(self, cache: Path) -> Path:
        """Folder of the program in the cache folder."""
        return cache / f"{self.name}-{short_hash(self.compiler.identity())}"

    def compile(self, path: Path) -> ModuleType:
        """Compile the program; the result is stored next to ``path`` if ``path`` is absolute."""
        return execute(self.name, self.source, path, self.compiler.compile_text)


def load_kept_module(folder: Path, program: RequestedProgram) -> ModuleType | None:
    """Return the module of a cached program; None if it is missing. A damaged program is removed."""
    if not os.path.lexists(folder):
        return None
    if not is_whole(folder):
        logger.warning("ppafo: the compiled model %s is damaged and is compiled again", folder.name)
        remove(folder)
        return None
    try:
        path = folder / f"{program.name}.py"
        module = execute(program.name, program.source, path, program.compiler.run_text)
        os.utime(folder)
    except OSError:  # another process has removed it in this instant, or the disk is full
        return sys.modules.get(program.name)
    return module


def execute(name: str, source: str, path: Path, fill: Callable[[str, str, ModuleType], None]) -> ModuleType:
    """Return the module filled by ``fill``; Python's own bytecode file, which may be damaged, is not used."""
    module = ModuleType(name)
    module.__file__ = str(path)
    sys.modules[name] = module
    try:
        fill(source, str(path), module)
    # A module that was interrupted half-way must not be found by the next import.
    except BaseException:
        del sys.modules[name]
        raise
    return module


def short_hash(described: str) -> str:
    """Return a short hash of the identity of a compiler."""
    return hashlib.sha256(described.encode()).hexdigest()[:12]


def is_whole(folder: Path) -> bool:
    """Return whether all files of a program folder have their recorded hashes."""
    try:
        stated = json.loads(read_regular_file(folder / CHECKSUMS))
        # Other files in the folder are no part of it.
        files = stated.items() if isinstance(stated, dict) else ()
        # What was made while others could write may still be another's.
        return (
            bool(files)
            and is_private(folder, *folder.rglob("*"))
            and all(hashlib.sha256(read_regular_file(folder / name)).hexdigest() == digest for name, digest in files)
        )
    except (OSError, ValueError, RecursionError):
        return False


def remove(folder: Path) -> None:
    """Remove a program, a file or a link; failures to remove are ignored.

    A folder is first renamed, so that other processes see either the complete program or none.
    """
    with contextlib.suppress(OSError):
        if folder.is_dir() and not folder.is_symlink():
            aside = folder.with_name(f".writing-{secrets.token_hex(8)}")
            folder.rename(aside)
            shutil.rmtree(aside)
        else:
            folder.unlink()


def is_kept(source: str, compiler: Compiler) -> bool:
    """Return whether a program was already loaded with this compiler or is in the cache."""
    program, cache = RequestedProgram(source, compiler), cache_folder()
    return program.name in sys.modules or (cache is not None and os.path.lexists(program.folder_in(cache)))
