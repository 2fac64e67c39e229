"""Entries of a library that was compiled from a composed module: how it shows them, and how Python calls them.

Handing an array to C costs Python about a microsecond, a number a twentieth of that. So the arrays of an entry are
packed into one block of memory, once where they stay the same.
"""

import ctypes
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.translation.typed import FLOAT, INT, Array, Scalar, Type

Entries = Mapping[str, tuple[Type, ...]]
"""Types of the parameters of entries, by name."""

_PACKED = "_packed"
_NOTHING, _FLOATS = ctypes.c_double * 0, np.dtype(np.float64)
_NUMBERS: dict[Scalar, Any] = {FLOAT: ctypes.c_double, INT: ctypes.c_int64}


@dataclass(frozen=True, slots=True)
class NativeEntry:
    """An entry of a library, called as that of a module by Numba: arrays, then numbers.

    ``function`` takes its arrays, of these dimensions, one after another as ``layout`` writes each ``ppafo_array``.
    """

    function: Any
    dimensions: tuple[int, ...]
    layout: struct.Struct

    def __call__(self, *given: Any) -> None:
        """Call it with arrays, and the numbers that follow them."""
        count = len(self.dimensions)
        self.function(self._packed(given[:count]), *given[count:])

    def with_arrays(self, *arrays: NDArray[np.float64]) -> Callable[..., None]:
        """The entry as a function of what follows these arrays, which it keeps.

        TypeError for what C would misread: arrays of other numbers or dimensions, or that lie otherwise in memory.
        """
        called: partial[None] = partial(self.function, self._packed(arrays))
        called.arrays = arrays  # type: ignore[attr-defined]
        return called

    def _packed(self, arrays: Sequence[Any]) -> bytes:
        numbers: list[int] = []
        for array, dimensions in zip(arrays, self.dimensions, strict=True):
            if array.dtype != _FLOATS or array.ndim != dimensions:
                problem = f"not one of {array.dtype} {array.shape}"
                raise TypeError(f"an array of floats in {dimensions} dimensions is needed, {problem}")
            # Refuses what is read-only, or does not lie row after row.
            numbers.append(ctypes.addressof(_NOTHING.from_buffer(array)))
            numbers += array.shape
        return self.layout.pack(*numbers)


def with_packed_entries(source: str, entries: Entries) -> str:
    """A translation unit that shows nothing but entries, which take their arrays one after another.

    All else is of the file alone. A call of ``advance`` that other libraries see would be one of what the C library of
    GNU has under this name.
    """
    texts = ["#define PPAFO_ENTRY static", source]
    for name, types in entries.items():
        arrays = [kind for kind in types if isinstance(kind, Array)]
        numbers = {
            f"number_{place}": "double" if kind == FLOAT else "int64_t"
            for place, kind in enumerate(types[len(arrays) :])
        }
        taken = ", ".join(["const ppafo_array *arrays", *(f"{kind} {number}" for number, kind in numbers.items())])
        given = ", ".join([*(f"arrays[{place}]" for place in range(len(arrays))), *numbers])
        texts.append(f"void {name}{_PACKED}({taken})\n{{\n    {name}({given});\n}}\n")
    return "\n".join(texts)


def load_entries(library: Path, entries: Entries) -> dict[str, NativeEntry]:
    """Return the entries of a library by name; OSError where it cannot be loaded, AttributeError where it lacks one."""
    loaded = ctypes.CDLL(str(library))
    return {name: _entry(loaded[f"{name}{_PACKED}"], types) for name, types in entries.items()}


def _entry(function: Any, types: Sequence[Type]) -> NativeEntry:
    dimensions = tuple(kind.dimensions for kind in types if isinstance(kind, Array))
    function.restype = None
    function.argtypes = [ctypes.c_void_p, *(_NUMBERS[kind] for kind in types if isinstance(kind, Scalar))]
    return NativeEntry(
        function, dimensions, struct.Struct("".join(f"P{count}q{8 * (3 - count)}x" for count in dimensions))
    )
