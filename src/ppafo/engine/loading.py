"""Module of a composed text: compiled by the first working C compiler, or run by Python.

``PPAFO_BACKEND`` selects one compiler, or Python; by default gcc, clang and zig are tried in this order, fastest code
first. Results are bit-identical. A compiler that does not work, because headers are missing or its libraries cannot be
loaded, is reported in one line and skipped for a day; after a kill or a full disk, only in the present process. If no
compiler is left, or a law cannot be translated to C, Python runs the text, and one line reports this.
"""

import contextlib
import logging
import os
import sys
import threading
import time
from collections.abc import Iterable
from functools import cache, lru_cache
from pathlib import Path
from types import ModuleType

from ppafo.engine.cache.folder import CACHE_VARIABLE, LEFT_OUT_FOR, NOTE, cache_folder, refusal
from ppafo.engine.cache.kept import RequestedProgram, is_kept, load_kept_module, short_hash
from ppafo.engine.compilers import OFFERED, Compiler, CompilerError, Effort, UntranslatableError
from ppafo.errors import ProgramError, SimulationError
from ppafo.wording import nearest_name, one_line

logger = logging.getLogger("ppafo")

BACKEND_VARIABLE = "PPAFO_BACKEND"
PYTHON = "python"
"""Value of ``PPAFO_BACKEND`` that lets Python run the models."""
ANY_OF_C = "c"
"""Value of ``PPAFO_BACKEND`` that selects the first working C compiler."""
HOW_TO_INSTALL = "install gcc or clang, or 'pip install ppafo[native]', which includes zig"
WITHOUT_C = f"{BACKEND_VARIABLE}={PYTHON} needs no compiler, but is some hundred times slower"

_FAILED: set[str] = set()
"""Identities of compilers that have failed in this process."""
_LEAVING_OUT = threading.Lock()
_LOADING: dict[str, threading.RLock] = {}


def compilers_to_try() -> tuple[Compiler, ...]:
    """Return the compilers of this computer in order of preference; none if Python runs the models.

    Raises SimulationError if ``PPAFO_BACKEND`` names an unknown compiler, or one that this computer does not have.
    """
    return _compilers(os.environ.get(BACKEND_VARIABLE, ""), cache_folder())


@lru_cache(maxsize=8)
def _compilers(name: str, folder: Path | None) -> tuple[Compiler, ...]:
    """Return the compilers to try: the named compiler, or those of this computer without a recorded failure.

    Raises SimulationError for an unknown name, and if any C compiler was requested and none is available.
    """
    if name == PYTHON:
        return ()
    if name in OFFERED:
        return (OFFERED[name](),)
    if name not in ("", ANY_OF_C):
        allowed = (ANY_OF_C, *OFFERED, PYTHON)
        hint = nearest_name(name, allowed)
        raise SimulationError(f"{BACKEND_VARIABLE} = '{one_line(name)}': must be {', '.join(allowed)}{hint}")
    compilers: list[Compiler] = []
    for make in OFFERED.values():
        with contextlib.suppress(SimulationError):
            compilers.append(make())
    working = tuple(compiler for compiler in compilers if not _has_failed(compiler, folder))
    if name and not compilers:
        raise SimulationError(f"{BACKEND_VARIABLE}={name}: no C compiler was found: {HOW_TO_INSTALL}")
    # The last one is kept even if it failed, so that its own error is what the user reads.
    return working or (tuple(compilers[-1:]) if name else ())


def compiled(source: str, effort: Effort = Effort.FULL) -> ModuleType | None:
    """Return the compiled module of a composed text; None if Python has to run the text, which is then logged.

    A quick program is not compiled if the fully optimised one is cached. Raises ProgramError for a mistake in the text,
    and SimulationError if the compiler named by ``PPAFO_BACKEND`` does not work.
    """
    compilers = compilers_to_try()
    if not compilers and os.environ.get(BACKEND_VARIABLE) != PYTHON:
        _say_slow(f"no working C compiler was found; {HOW_TO_INSTALL}")
    return _load_by(source, compilers, effort)


def load_generated(source: str, compiler: Compiler) -> ModuleType:
    """Import the module with this source, from the cache if available and intact, otherwise after compilation.

    Raises ProgramError if the source cannot be compiled, with the source file of the faulty function, and CompilerError
    if the compiler does not work.
    """
    program = RequestedProgram(source, compiler)
    # A second thread must not get a module of which only the beginning has run.
    with _LOADING.setdefault(program.name, threading.RLock()):
        if program.name in sys.modules:
            return sys.modules[program.name]
        cache = cache_folder()
        # Loading runs what lies there, so the folder is looked at each time, not once for the process.
        why_not = refusal(cache)
        folder = None if cache is None or why_not else program.folder_in(cache)
        if folder is None:
            logger.warning("ppafo: compiled models are not cached: %s; change %s", why_not, CACHE_VARIABLE)
        module = None if folder is None else load_kept_module(folder, program)
        if module is not None:
            return module
        from ppafo.engine.cache.making import make  # most programs are there

        return make(program, folder)


@lru_cache(maxsize=64)
def _load_by(source: str, compilers: tuple[Compiler, ...], effort: Effort) -> ModuleType | None:
    """Return the module of a text compiled by the first working compiler; None if there is none.

    The only place that recovers from a failed compiler: it is left out for a day, and the next one is tried. If the
    compiler named by ``PPAFO_BACKEND`` fails, raises SimulationError, or ProgramError for a law without C.
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
            raise ProgramError(f"{refused}; set {BACKEND_VARIABLE}={PYTHON} to run it in Python") from refused
        # A law that calls, for instance, ``math.sin``.
        _say_slow(str(refused))
        return None


@cache
def _say_slow(why: str) -> None:
    """Log once per process why Python runs a model."""
    logger.warning("ppafo: %s: Python runs the model, some hundred times slower than compiled", why)


def _leave_out(failed: Iterable[Compiler], failure: CompilerError) -> None:
    """Record the failure of compilers, in this process and, for a lasting cause, in the cache folder."""
    folder = cache_folder()
    for compiler in failed:
        _FAILED.add(compiler.identity())
        if folder is not None and not failure.passing and not refusal(folder):
            with contextlib.suppress(OSError):
                (folder / note_name(compiler)).write_text(f"{failure}\n", encoding="utf-8")
    _compilers.cache_clear()


def note_name(compiler: Compiler) -> str:
    """Return the name of the cache file with the reason why a compiler does not work on this computer."""
    return f"{NOTE}{compiler.name}-{short_hash(compiler.identity())}"


def _has_failed(compiler: Compiler, folder: Path | None) -> bool:
    if folder is None or compiler.identity() in _FAILED:
        return compiler.identity() in _FAILED
    try:
        return time.time() - (folder / note_name(compiler)).lstat().st_mtime < LEFT_OUT_FOR
    except OSError:
        return False
