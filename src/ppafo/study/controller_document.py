"""Python controller as plain data: its class with a hash of the source, and its settings after a reset."""

import copy
import hashlib
import inspect
import json
import math
import numbers
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

import numpy as np

from ppafo.control.kind import PythonController

DIGITS = 16
"""Number of hexadecimal digits kept of a SHA-256 hash."""
_DEEPEST, _LONGEST = 12, 64
"""Largest nesting depth of settings, and number of elements up to which a list is stored itself and not its hash."""


def controller_document(controller: PythonController) -> dict[str, Any]:
    """Return type, source hash and settings of a controller after a reset, as plain data."""
    try:
        fresh = copy.deepcopy(controller)
    except (TypeError, copy.Error, NotImplementedError, RecursionError):  # it holds what has no copy, such as a port
        fresh = controller
    else:
        # What a run left behind is no setting: a study resumes with the same object too.
        fresh.reset()
    return dict(_plain(fresh, ()))


def _source(code: type | FunctionType) -> dict[str, Any]:
    """Return the name of a class or function, and a hash of its source files (of a class and all its base classes).

    For a part without a file, the hash is of its compiled code.
    """
    digest = hashlib.sha256()
    for part in code.__mro__ if isinstance(code, type) else (code,):
        # The standard library is another one with another Python, which is no other controller.
        if part.__module__ != "__main__" and part.__module__.partition(".")[0] in sys.stdlib_module_names:
            continue
        try:
            text = Path(inspect.getfile(part)).read_bytes()
        except (TypeError, OSError):  # from a notebook, or typed in
            functions = [part] if isinstance(part, FunctionType) else vars(part).values()
            codes = [list(_instructions(each.__code__)) for each in functions if isinstance(each, FunctionType)]
            text = repr(codes).encode()
        digest.update(text)
    return {"type": f"{code.__module__}.{code.__qualname__}", "source": digest.hexdigest()[:DIGITS]}


def _instructions(code: CodeType) -> Iterator[object]:
    """Yield name, instructions, names and constants of compiled code, without file name and line numbers."""
    yield from (code.co_name, code.co_code, code.co_names)
    for constant in code.co_consts:
        yield list(_instructions(constant)) if isinstance(constant, CodeType) else constant


def _plain(value: Any, enclosing: tuple[int, ...]) -> Any:
    """Return a setting as JSON data; one that contains itself or is too deep, by ``enclosing``, by its type's name."""
    value = value.tolist() if isinstance(value, np.ndarray | np.generic) else value
    if value is None or isinstance(value, str | int):
        return value
    if isinstance(value, bytes):
        return hashlib.sha256(value).hexdigest()[:DIGITS]
    if isinstance(value, numbers.Number):
        # JSON has no complex numbers, and no infinite ones.
        return value if isinstance(value, float) and math.isfinite(value) else repr(value)
    if isinstance(value, type | FunctionType):
        return _source(value)
    if id(value) in enclosing or len(enclosing) >= _DEEPEST:
        return f"{type(value).__module__}.{type(value).__qualname__}"
    inside = (*enclosing, id(value))
    if isinstance(value, Mapping):
        return {str(key): _plain(inner, inside) for key, inner in value.items()}
    if isinstance(value, set | frozenset | tuple | list):
        items = [
            _plain(each, inside) for each in (sorted(value, key=repr) if isinstance(value, set | frozenset) else value)
        ]
        digest = hashlib.sha256(json.dumps(items).encode()).hexdigest()
        # Weights of a network, a long table of gains: that they are the same matters, not every one of them.
        return items if len(items) <= _LONGEST else {"items": len(items), "sha256": digest}
    try:
        state = object.__getstate__(value)
    except TypeError:  # a class of compiled code
        state = None
    tables = [table for table in (state if isinstance(state, tuple) else (state,)) if isinstance(table, dict)]
    return {
        **_source(type(value)),
        "settings": {str(k): _plain(v, inside) for table in tables for k, v in table.items()},
    }
