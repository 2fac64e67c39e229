"""Entries of composed texts: functions that Python calls, with arrays and numbers, and that return nothing.

A text is Python with two marks: ``@entry`` states the types of the parameters of a function, ``@inline`` stands before
what the entries call. Every compiler reads them there; Python itself runs the text with marks that do nothing.
"""

import ast
import threading
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

PARSING = threading.RLock()
"""Held by whoever makes a syntax tree: Python 3.11 keeps one depth for the trees of all threads, and ends with a
SystemError where the garbage collector lets a second one parse before the first is done (CPython issue 106905)."""

FLOAT, INT = "float64", "int64"
ARRAY, ARRAY_2D, ARRAY_3D = "float64[::1]", "float64[:, ::1]", "float64[:, :, ::1]"

HEADER = '''"""Generated from the functions of ppafo; their hash is in the file name. Not to be edited."""

import math
from collections import namedtuple
'''
"""First lines of a composed text."""
INLINE = "@inline"
"""The mark of functions that its entries call."""
ENTRY = '@entry("void({})")'
"""The mark of an entry, for the types of its parameters."""

ORIGIN = "# origin"
"""Beginning of the line before each function that says which lines of which file it was made from."""

_MARK = "@entry("


def with_arrays(entry: Callable[..., None], *arrays: NDArray[np.float64]) -> Callable[..., None]:
    """An entry of a loaded module as a function of its numbers alone; the arrays, its first arguments, stay the same.

    A call then costs what one with a few numbers costs.
    """
    packed: Callable[..., Callable[..., None]] | None = getattr(entry, "with_arrays", None)
    return partial(entry, *arrays) if packed is None else packed(*arrays)


def entry_text(name: str, parameters: Mapping[str, str], lines: Iterable[str]) -> str:
    """Text of an entry, from the types of its parameters in order and the lines of its body."""
    head = ENTRY.format(", ".join(parameters.values()))
    return "\n".join([head, f"def {name}({', '.join(parameters)}):", *indent(lines), ""])


def indent(lines: Iterable[str]) -> list[str]:
    """Lines of Python, each one level further in."""
    return [f"    {line}" for line in lines]


def parse_expression(text: str) -> ast.expr:
    """Return the syntax tree of an expression, one thread at a time."""
    with PARSING:
        return ast.parse(text, mode="eval").body


def entry_types(source: str) -> dict[str, list[str]]:
    """Types of the parameters of all entries of a text, in order, by the name of the entry."""
    types = {}
    for mark, head in pairwise(source.split("\n")):
        if mark.startswith(_MARK):
            # The mark holds a signature, which reads as a call: void(float64[:, ::1], int64).
            signature = ast.literal_eval(parse_expression(mark.removeprefix(_MARK).removesuffix(")")))
            call = parse_expression(signature)
            assert isinstance(call, ast.Call)
            types[head.removeprefix("def ").partition("(")[0]] = [ast.unparse(kind) for kind in call.args]
    return types


def without_origins(source: str) -> str:
    """Return the text without the lines that say where its functions stand: what decides the machine code."""
    return "\n".join(line for line in source.split("\n") if not line.startswith(ORIGIN))
