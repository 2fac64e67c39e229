"""Entries of generated modules, and the module of a composed text, made by the first compiler that works here.

An entry is a function that Python calls, with arrays and numbers, and that returns nothing. It states the types of its
parameters in the words of Numba, and every compiler reads them there.

``PPAFO_BACKEND`` names one compiler; without it clang, gcc, zig and Numba are tried in this order. All give the same
bits. One that does not work, because there are no headers or its libraries cannot be loaded, is reported in one line
and left out for a day; one that was killed or found no room on a disk, for the rest of the run.
"""

import ast
import contextlib
import inspect
import logging
import os
import re
import textwrap
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache, partial
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any, Protocol, TypeAlias, get_type_hints, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.cache import LEFT_OUT_FOR, cache_folder, is_kept, load_generated, note_name, refusal
from ppafo.engine.compilers import OFFERED, Compiler, CompilerError
from ppafo.errors import ProgramError, SimulationError, nearest_name, one_line

FLOAT, INT = "float64", "int64"
ARRAY, ARRAY_2D, ARRAY_3D = "float64[::1]", "float64[:, ::1]", "float64[:, :, ::1]"

Vector: TypeAlias = Annotated[NDArray[np.float64], ARRAY]
"""Numbers in a row, as a parameter of a function for ``array_module``."""
Table: TypeAlias = Annotated[NDArray[np.float64], ARRAY_2D]
"""Numbers in rows, the last index running quickest."""

HEADER = '''"""Generated from the functions of ppafo; their hash is in the file name. Not to be edited."""

import math
from collections import namedtuple

from numba import njit
'''
"""What a module begins with that has no lanes."""
INLINE = '@njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)'
"""How functions are compiled that its entries call."""
ENTRY = '@njit("void({})", cache=True, nogil=True, error_model="numpy")'
"""How an entry is compiled, for the types of its parameters."""

_ENTRY = re.compile(r"""^@njit\((["'])void\(([^"'\n]*)\)\1.*\)\ndef (\w+)\(""", re.MULTILINE)
_TYPE = re.compile(r"float64\[.*?\]|float64|int64")


@runtime_checkable
class Packing(Protocol):
    """An entry that is quicker where its arrays are handed over once."""

    def with_arrays(self, *arrays: NDArray[np.float64]) -> Callable[..., None]:
        """The entry as a function of what follows its arrays."""


def with_arrays(entry: Callable[..., None], *arrays: NDArray[np.float64]) -> Callable[..., None]:
    """An entry of a loaded module as a function of its numbers alone; the arrays, its first arguments, stay the same.

    A call then costs what one with a few numbers costs, by every compiler.
    """
    return entry.with_arrays(*arrays) if isinstance(entry, Packing) else partial(entry, *arrays)


def entry_text(name: str, parameters: Mapping[str, str], lines: Iterable[str]) -> str:
    """Text of an entry, from the types of its parameters in order and the lines of its body."""
    head = ENTRY.format(", ".join(parameters.values()))
    return "\n".join([head, f"def {name}({', '.join(parameters)}):", *(f"    {line}" for line in lines), ""])


def entry_types(source: str) -> dict[str, list[str]]:
    """Types of the parameters of all entries of a module, in order, by the name of the entry."""
    return {found[3]: _TYPE.findall(found[2]) for found in _ENTRY.finditer(source)}


def array_module(functions: Iterable[Callable[..., None]]) -> str:
    """Source of a module with these functions as its entries: each goes through its arrays and calls only ``math``.

    Their parameters are annotated as ``Vector``, ``Table``, ``float`` or ``int``.
    """
    plain: dict[Any, str] = {float: FLOAT, int: INT}
    entries = []
    for function in functions:
        hints = get_type_hints(function, include_extras=True)
        types = {name: plain.get(hint) or hint.__metadata__[0] for name, hint in hints.items() if name != "return"}
        (tree,) = ast.parse(textwrap.dedent(inspect.getsource(function))).body
        assert isinstance(tree, ast.FunctionDef)
        body = tree.body[1:] if ast.get_docstring(tree) is not None else tree.body
        lines = [line for item in body for line in ast.unparse(item).split("\n")]
        entries.append(entry_text(function.__name__, types, lines))
    return "\n\n".join([HEADER, *entries])


logger = logging.getLogger("ppafo")

BACKEND_VARIABLE = "PPAFO_BACKEND"
NUMBA = "numba"
ANY_OF_C = "c"
"""Names the first compiler of C that works."""
HOW_TO_INSTALL = "install gcc or clang, or 'pip install ppafo[native]', which brings zig"
WITHOUT_C = f"{BACKEND_VARIABLE}={NUMBA} needs no compiler of C"

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
    # The last one is kept even if it failed, so that its own error is what the user reads.
    return tuple(compiler for compiler in found if not _has_failed(compiler, folder)) or (found[-1],)


def chosen_compiler() -> Compiler:
    """Return the compiler that is tried first."""
    return compilers_to_try()[0]


def load_source(source: str) -> ModuleType:
    """Return the module of a composed text, compiled where it is not kept already.

    ProgramError where it cannot be compiled, SimulationError where no compiler works.
    """
    return _load_by(source, compilers_to_try())


@lru_cache(maxsize=64)
def _load_by(source: str, compilers: tuple[Compiler, ...]) -> ModuleType:
    compiler, *others = compilers
    try:
        return load_generated(source, compiler)
    except CompilerError as failure:
        # One reason, such as missing headers, often stops several compilers.
        failed = [item for item in compilers if item is compiler or item.name in failure.names]
        # The next compiler that the same reason does not stop.
        left = tuple(item for item in others if item not in failed)
        if not left:
            remedy = HOW_TO_INSTALL if compiler.name == NUMBA else WITHOUT_C
            raise SimulationError(f"{failure}; {remedy}") from failure
        with _LEAVING_OUT:
            if compiler.identity() not in _FAILED:  # another thread may have found it at the same time
                until = "in this run" if failure.passing else "for a day, or until 'ppafo doctor --clear'"
                logger.warning("ppafo: %s; models are compiled by %s instead %s", failure, left[0].name, until)
            _leave_out(failed, failure)
        return _load_by(source, left)
    except ProgramError as refused:
        if compiler.name == NUMBA:
            raise
        if compilers[-1].name != NUMBA:
            raise ProgramError(f"{refused}; {BACKEND_VARIABLE}={NUMBA} may compile it") from refused
        # A model that has no C, for instance because a law calls ``math.sin``.
        numba = compilers[-1]
        # Said once for a program: from the next start on it is found compiled.
        was_kept = is_kept(source, numba)
        module = load_generated(source, numba)
        if not was_kept:
            logger.warning("ppafo: %s; Numba compiles this model", refused)
        return module


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
    if compiler.name == NUMBA:
        return False  # to ask for its version would load it
    if folder is None or compiler.identity() in _FAILED:
        return compiler.identity() in _FAILED
    try:
        return time.time() - (folder / note_name(compiler)).lstat().st_mtime < LEFT_OUT_FOR
    except OSError:
        return False
