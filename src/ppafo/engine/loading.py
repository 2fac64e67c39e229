"""Module of a composed text: compiled by the first working C compiler, or run by Python.

``PPAFO_BACKEND`` selects one compiler, or Python; by default gcc, clang and zig are tried in this order, fastest code
first. Results are bit-identical. A compiler that does not work, because headers are missing or its libraries cannot be
loaded, is reported in one line and left out in this process. If no compiler is left, or a law cannot be translated to
C, Python runs the text, and one line reports this.
"""

import contextlib
import logging
import os
import sys
import threading
from collections.abc import Iterable
from contextvars import copy_context
from functools import cache, lru_cache
from types import ModuleType

from ppafo.engine.cache import announce, is_kept, load_or_compile, program_name
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
    return _compilers(os.environ.get(BACKEND_VARIABLE, ""))


@lru_cache(maxsize=8)
def _compilers(name: str) -> tuple[Compiler, ...]:
    """Return the compilers to try: the named compiler, or those of this computer that have not failed.

    Raises SimulationError for an unknown name, and if any C compiler was requested and none is available.
    """
    if name == PYTHON:
        return ()
    if name in OFFERED:
        return (OFFERED[name](),)
    if name not in ("", ANY_OF_C):
        allowed = (ANY_OF_C, *OFFERED, PYTHON)
        raise SimulationError(
            f"{BACKEND_VARIABLE} = '{one_line(name)}': must be {', '.join(allowed)}{nearest_name(name, allowed)}"
        )
    compilers: list[Compiler] = []
    for make in OFFERED.values():
        with contextlib.suppress(SimulationError):
            compilers.append(make())
    working = tuple(compiler for compiler in compilers if compiler.identity() not in _FAILED)
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
    name = program_name(source, compiler)
    # A second thread must not get a module of which only the beginning has run.
    with _LOADING.setdefault(name, threading.RLock()):
        return sys.modules[name] if name in sys.modules else load_or_compile(source, compiler)


def compile_together(programs: Iterable[tuple[str, Effort]], compiler: Compiler) -> None:
    """Compile the missing ones of some texts, each with its effort, in parallel, if there are two or more.

    A single missing program is compiled where it is needed, with its own message.
    """
    missing = [
        (source, effort)
        for source, effort in dict.fromkeys(programs)
        if not (is_kept(source, compiler) or is_kept(source, compiler.with_effort(effort)))
    ]
    if len(missing) < 2:
        return
    from concurrent.futures import ThreadPoolExecutor

    workers = min(len(missing), os.cpu_count() or 1)
    with announce(len(missing)), ThreadPoolExecutor(workers) as pool:
        started = [pool.submit(copy_context().run, compiled, source, effort) for source, effort in missing]
        for task in started:
            task.result()


@lru_cache(maxsize=64)
def _load_by(source: str, compilers: tuple[Compiler, ...], effort: Effort) -> ModuleType | None:
    """Return the module of a text compiled by the first working compiler; None if there is none.

    The only place that recovers from a failed compiler: it is left out, and the next one is tried. If the compiler
    named by ``PPAFO_BACKEND`` fails, raises SimulationError, or ProgramError for a law without C.
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
                instead = f"compiled by {left[0].name}" if left else "run by Python, some hundred times slower,"
                logger.warning("ppafo: %s; models are %s instead", failure, instead)
            _FAILED.update(other.identity() for other in failed)
            _compilers.cache_clear()
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
