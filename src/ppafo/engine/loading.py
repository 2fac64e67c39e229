"""The module of a composed text: by the first compiler of C that works here, or as Python runs it.

``PPAFO_BACKEND`` names one compiler, or Python; without it gcc, clang and zig are tried in this order, the quickest
code first. All give the same bits. One that does not work, because there are no headers or its libraries cannot be
loaded, is reported in one line and left out for a day; one that was killed or found no room on a disk, for the rest of
the run. Where none is left, and where a law has no C, Python runs the text, and one line says so.
"""

import contextlib
import logging
import os
import threading
import time
from collections.abc import Iterable
from functools import cache, lru_cache
from pathlib import Path
from types import ModuleType

from ppafo.engine.cache.folder import LEFT_OUT_FOR, cache_folder, refusal
from ppafo.engine.cache.kept import is_kept
from ppafo.engine.cache.programs import load_generated, note_name
from ppafo.engine.compilers import OFFERED, Compiler, CompilerError, Effort, UntranslatableError
from ppafo.errors import ProgramError, SimulationError
from ppafo.wording import nearest_name, one_line

logger = logging.getLogger("ppafo")

BACKEND_VARIABLE = "PPAFO_BACKEND"
PYTHON = "python"
"""Lets Python run the models."""
ANY_OF_C = "c"
"""Names the first compiler of C that works."""
HOW_TO_INSTALL = "install gcc or clang, or 'pip install ppafo[native]', which brings zig"
WITHOUT_C = f"{BACKEND_VARIABLE}={PYTHON} needs no compiler, and takes some hundred times as long"

_FAILED: set[str] = set()
"""Identities of compilers that failed in this process."""
_LEAVING_OUT = threading.Lock()


def compilers_to_try() -> tuple[Compiler, ...]:
    """Return the compilers of this computer in the order in which they are tried; none where Python runs the models.

    SimulationError where ``PPAFO_BACKEND`` names none, or one that is not on this computer.
    """
    return _compilers(os.environ.get(BACKEND_VARIABLE, ""), cache_folder())


@lru_cache(maxsize=8)
def _compilers(name: str, folder: Path | None) -> tuple[Compiler, ...]:
    """Return the compilers to try: the one of a name, or those of this computer that are not noted to have failed.

    SimulationError for a name that is none, and where any of C was asked for and none is there.
    """
    if name == PYTHON:
        return ()
    if name in OFFERED:
        return (OFFERED[name](),)
    if name not in ("", ANY_OF_C):
        allowed = (ANY_OF_C, *OFFERED, PYTHON)
        hint = nearest_name(name, allowed)
        raise SimulationError(f"{BACKEND_VARIABLE}: '{one_line(name)}' is not one of {', '.join(allowed)}{hint}")
    compilers: list[Compiler] = []
    for make in OFFERED.values():
        with contextlib.suppress(SimulationError):
            compilers.append(make())
    working = tuple(compiler for compiler in compilers if not _has_failed(compiler, folder))
    if name and not compilers:
        raise SimulationError(f"{BACKEND_VARIABLE}={name}: there is no compiler on this computer: {HOW_TO_INSTALL}")
    # The last one is kept even if it failed, so that its own error is what the user reads.
    return working or (tuple(compilers[-1:]) if name else ())


def backend_described() -> str:
    """Return what runs the models here, with its version."""
    compilers = compilers_to_try()
    return compilers[0].described() if compilers else "Python itself, which compiles nothing"


def compiled(source: str, effort: Effort = Effort.FULL) -> ModuleType | None:
    """Return the module of a composed text by a compiler; None where Python has to run it, which a line has said.

    A quick program is not made where the full one is kept. ProgramError for a mistake in it, SimulationError where the
    compiler that ``PPAFO_BACKEND`` names does not work.
    """
    return None if runs_by_python() else _load_by(source, compilers_to_try(), effort)


def runs_by_python() -> bool:
    """Return whether no compiler is to be tried, which a line has said where nobody asked for it."""
    if compilers_to_try():
        return False
    if os.environ.get(BACKEND_VARIABLE) != PYTHON:
        _say_slow(f"there is no compiler of C that works here; {HOW_TO_INSTALL}")
    return True


@lru_cache(maxsize=64)
def _load_by(source: str, compilers: tuple[Compiler, ...], effort: Effort) -> ModuleType | None:
    """Return the module of a text by the first of some compilers that works; None where none does.

    SimulationError, or ProgramError for a law without C, where ``PPAFO_BACKEND`` names one that does not do.
    """
    if not compilers:
        return None
    compiler, *others = compilers
    try:
        return load_generated(source, compiler if is_kept(source, compiler) else compiler.with_effort(effort))
    except CompilerError as failure:
        # One reason, such as missing headers, often stops several compilers.
        failed = [other for other in compilers if other is compiler or other.name in failure.names]
        # The next compiler that the same reason does not stop.
        left = tuple(other for other in others if other not in failed)
        if not left and os.environ.get(BACKEND_VARIABLE):
            raise SimulationError(f"{failure}; {WITHOUT_C}") from failure
        with _LEAVING_OUT:
            if compiler.identity() not in _FAILED:  # another thread may have found it at the same time
                until = "in this run" if failure.passing else "for a day, or until 'ppafo doctor --clear'"
                instead = f"compiled by {left[0].name}" if left else "run by Python, some hundred times slower,"
                logger.warning("ppafo: %s; models are %s instead %s", failure, instead, until)
            _leave_out(failed, failure)
        return _load_by(source, left, effort)
    except UntranslatableError as refused:
        if os.environ.get(BACKEND_VARIABLE):
            raise ProgramError(f"{refused}; {BACKEND_VARIABLE}={PYTHON} runs it") from refused
        # A law that calls, for instance, ``math.sin``.
        _say_slow(str(refused))
        return None


@cache
def _say_slow(why: str) -> None:
    """Say once in a process why Python runs a model."""
    logger.warning("ppafo: %s: Python runs the model, some hundred times slower than compiled", why)


def _leave_out(failed: Iterable[Compiler], failure: CompilerError) -> None:
    """Remember in this process, and beside the programs if the reason lasts, that compilers do not work."""
    folder = cache_folder()
    for compiler in failed:
        _FAILED.add(compiler.identity())
        if folder is not None and not failure.passing and not refusal(folder):
            with contextlib.suppress(OSError):
                (folder / note_name(compiler)).write_text(f"{failure}\n", encoding="utf-8")
    _compilers.cache_clear()


def _has_failed(compiler: Compiler, folder: Path | None) -> bool:
    if folder is None or compiler.identity() in _FAILED:
        return compiler.identity() in _FAILED
    try:
        return time.time() - (folder / note_name(compiler)).lstat().st_mtime < LEFT_OUT_FOR
    except OSError:
        return False
