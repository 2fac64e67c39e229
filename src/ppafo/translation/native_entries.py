"""Entries of a compiled C library, with the interface of the Python functions of the composed text.

Passing an array to C costs Python about a microsecond, passing a number a twentieth of a microsecond. The arrays of an
entry are therefore packed into one block of memory.
"""

import ctypes
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, TypeAlias

import numpy as np

from ppafo.engine.compilers import CompilerError
from ppafo.engine.entries import FLOAT, INT, entry_types
from ppafo.wording import one_line

PACKED = "_packed"
"""Name suffix of a library entry that takes its arrays in one block (``ppafo_array``, ``prelude.h``)."""
ROUNDS_AS_WRITTEN = "ppafo_rounds_as_written"
"""Name of the library function that returns 1 if every operation is rounded separately."""
_NO_FLOATS = ctypes.c_double * 0
_FLOATS = np.dtype(np.float64)
_NUMBERS: dict[str, Any] = {FLOAT: ctypes.c_double, INT: ctypes.c_int64}


Parameters: TypeAlias = tuple[tuple[int, ...], tuple[str, ...]]
"""Parameters of a library entry: dimensions of each array, then types of the numbers."""


def parameters_of(source: str) -> dict[str, Parameters]:
    """Return the parameters of each entry of a composed text, by name."""
    return {
        name: (
            # "float64[:, ::1]": the last index runs quickest.
            tuple(kind.count(":") - 1 for kind in types if kind not in _NUMBERS),
            tuple(kind for kind in types if kind in _NUMBERS),
        )
        for name, types in entry_types(source).items()
    }


@dataclass(frozen=True, slots=True)
class NativeEntry:
    """Callable entry of a library, with arrays followed by numbers as arguments.

    ``function`` takes all arrays packed into one block; ``dimensions`` has the number of dimensions of each array, and
    ``layout`` is the binary layout of the ``ppafo_array`` structs in the block.
    """

    function: Any
    dimensions: tuple[int, ...]
    layout: struct.Struct

    def __call__(self, *arguments: Any) -> None:
        """Call the entry with arrays followed by numbers.

        Raises TypeError for arrays that C would misread: wrong data type, wrong number of dimensions, or not
        contiguous.
        """
        packed: list[int] = []
        for array, dimensions in zip(arguments, self.dimensions, strict=False):
            if array.dtype != _FLOATS or array.ndim != dimensions:
                problem = f"not one of {array.dtype} {array.shape}"
                raise TypeError(
                    f"a compiled model needs a contiguous float64 array of {dimensions} dimensions, {problem}"
                )
            # Refuses what is read-only, or does not lie row after row.
            packed.append(ctypes.addressof(_NO_FLOATS.from_buffer(array)))
            packed += array.shape
        self.function(self.layout.pack(*packed), *arguments[len(self.dimensions) :])


def fill_module(module: ModuleType, library: Path, parameters: Mapping[str, Parameters]) -> None:
    """Add the entries of a library to a module.

    Raises CompilerError if the library cannot be loaded or lacks an entry, and if its arithmetic does not follow IEEE
    754, which environment variables and wrappers of a compiler can cause.
    """
    try:
        loaded = ctypes.CDLL(str(library))
    except OSError as error:
        raise CompilerError(f"the library of a compiled model cannot be loaded: {one_line(error)}") from error
    # (1 + 2^-30)(1 - 2^-30) - 1 rounds to 0 where the product is rounded by itself, and to -2^-60 where it is fused.
    small = 2.0**-30
    numbers = map(ctypes.c_double, (1.0 + small, 1.0 - small, -1.0, small * small))
    try:
        functions = {name: loaded[f"{name}{PACKED}"] for name in parameters}
        # One product tells whether the compiler fuses or reorders, whatever its flags were.
        rounds_as_written = loaded[ROUNDS_AS_WRITTEN](*numbers)
    except AttributeError:
        raise CompilerError("the library of a compiled model lacks functions of the model") from None
    if not rounds_as_written:
        raise CompilerError(
            "the compiler fuses or reorders sums and products, so results would differ from those of other compilers; "
            "remove -ffp-contract and -ffast-math from the script that calls the compiler and from the environment "
            "variables"
        )
    for name, (dimensions, types) in parameters.items():
        function = functions[name]
        function.restype = None
        function.argtypes = [ctypes.c_void_p, *(_NUMBERS[kind] for kind in types)]
        # An array is a pointer and its extents; the rest of three extents is padding.
        layout = struct.Struct("".join(f"P{count}q{8 * (3 - count)}x" for count in dimensions))
        setattr(module, name, NativeEntry(function, dimensions, layout))
