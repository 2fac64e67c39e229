"""The module of a composed text, made by the first compiler that works on this computer.

``PPAFO_BACKEND`` names one compiler; without it clang, gcc, zig and Numba are tried in this order. All give the same
bits. One that does not work, because there are no headers or its libraries cannot be loaded, is reported in one line
and left out for a day.
"""

import contextlib
import logging
import os
import threading
import time
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from types import ModuleType

from ppafo.engine.cache import cache_folder, is_kept, load_all, load_generated, note_name, refusal
from ppafo.engine.compilers import OFFERED, Compiler, CompilerError
from ppafo.errors import ProgramError, SimulationError, nearest_name, one_line

logger = logging.getLogger("ppafo")

BACKEND_VARIABLE = "PPAFO_BACKEND"
NUMBA = "numba"
ANY_OF_C = "c"
"""Names the first compiler of C that works."""
HOW_TO_INSTALL = "install gcc or clang, or 'pip install ppafo[native]', which brings zig"
WITHOUT_C = f"{BACKEND_VARIABLE}={NUMBA} needs no compiler of C"
LEFT_OUT_FOR = 86400.0
"""Seconds after which a compiler that did not work is tried again: headers may have been installed."""

_FAILED: set[str] = set()
"""Identities of compilers that failed in this process."""
_LEAVING_OUT = threading.Lock()


def compilers_to_try() -> tuple[Compiler, ...]:
    """Return the compilers of this computer in the order in which they are tried, at least one.

    SimulationError where ``PPAFO_BACKEND`` names none, or one that is not on this computer.
    """
    return _compilers(os.environ.get(BACKEND_VARIABLE, ""), cache_folder())


@lru_cache(maxsize=8)
def _compilers(name: str, folder: Path | None) -> tuple[Compiler, ...]:
    if name in OFFERED:
        return (OFFERED[name](),)
    if name not in ("", ANY_OF_C):
        allowed = (ANY_OF_C, *OFFERED)
        hint = nearest_name(name, allowed)
        raise SimulationError(f"{BACKEND_VARIABLE}: '{one_line(name)}' is none of {', '.join(allowed)}{hint}")
    found: list[Compiler] = []
    for candidate, make in OFFERED.items():
        if name != ANY_OF_C or candidate != NUMBA:
            with contextlib.suppress(SimulationError):
                found.append(make())
    if not found:
        where = f"{BACKEND_VARIABLE}={name}: " if name else ""
        raise SimulationError(f"{where}there is no compiler on this computer: {HOW_TO_INSTALL}")
    return tuple(compiler for compiler in found if not _has_failed(compiler, folder)) or (found[-1],)


def chosen_compiler() -> Compiler:
    """Return the compiler that is tried first."""
    return compilers_to_try()[0]


def load_source(source: str) -> ModuleType:
    """Return the module of a composed text, compiled where it is not kept already.

    ProgramError where it cannot be compiled, SimulationError where no compiler works.
    """
    return _load_by(source, compilers_to_try())


def load_sources(sources: Iterable[str]) -> None:
    """Load the modules of texts that are all needed, so that the progress of what is compiled can be counted."""
    load_all(sources, chosen_compiler(), load_source)


@lru_cache(maxsize=64)
def _load_by(source: str, compilers: tuple[Compiler, ...]) -> ModuleType:
    compiler, *others = compilers
    try:
        return load_generated(source, compiler)
    except CompilerError as failure:
        failed = [item for item in compilers if item is compiler or item.name in failure.names]
        left = tuple(item for item in others if item not in failed)
        if not left:
            remedy = HOW_TO_INSTALL if compiler.name == NUMBA else WITHOUT_C
            raise SimulationError(f"{failure}; {remedy}") from failure
        with _LEAVING_OUT:
            if compiler.identity() not in _FAILED:  # another thread may have found it at the same time
                logger.warning("ppafo: %s; models are compiled by %s instead", failure, left[0].name)
            _leave_out(failed, str(failure))
        return _load_by(source, left)
    except ProgramError as refused:
        if compiler.name == NUMBA:
            raise
        if compilers[-1].name != NUMBA:
            raise ProgramError(f"{refused}; {BACKEND_VARIABLE}={NUMBA} may compile it") from refused
        return _load_by_numba(source, compilers[-1], refused)


def _load_by_numba(source: str, numba: Compiler, refused: ProgramError) -> ModuleType:
    """A model that has no C, for instance because a law calls ``math.sin``."""
    was_kept = is_kept(source, numba)
    module = load_generated(source, numba)
    if not was_kept:
        logger.warning("ppafo: %s; Numba compiles this model", refused)
    return module


def _leave_out(failed: Iterable[Compiler], failure: str) -> None:
    """Remember in this process, and for a day beside the programs, that compilers do not work."""
    folder = cache_folder()
    for compiler in failed:
        _FAILED.add(compiler.identity())
        if folder is not None and not refusal(folder):
            with contextlib.suppress(OSError):
                (folder / note_name(compiler)).write_text(f"{failure}\n", encoding="utf-8")
    _compilers.cache_clear()


def _has_failed(compiler: Compiler, folder: Path | None) -> bool:
    if compiler.name == NUMBA:
        return False  # to ask for its version would load it
    if folder is None or compiler.identity() in _FAILED:
        return compiler.identity() in _FAILED
    try:
        return time.time() - (folder / note_name(compiler)).lstat().st_mtime < LEFT_OUT_FOR
    except OSError:
        return False
