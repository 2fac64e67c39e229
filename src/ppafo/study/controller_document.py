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
_DEEPEST = 12
"""Largest nesting depth of settings."""
_LONGEST = 64
"""Number of elements up to which a list is stored itself; of a longer list the hash is stored."""
_Enclosing = tuple[int, ...]
"""Identities of the enclosing values, to detect a value that contains itself."""


def controller_document(controller: PythonController) -> dict[str, Any]:
    """Return type, source hash and settings of a controller after a reset, as plain data."""
    try:
        fresh = copy.deepcopy(controller)
    except (TypeError, copy.Error, NotImplementedError, RecursionError):  # it holds what has no copy, such as a port
        return _object(controller, ())
    # What a run left behind is no setting: a study resumes with the same object too.
    fresh.reset()
    return _object(fresh, ())


def _object(value: object, enclosing: _Enclosing) -> dict[str, Any]:
    """Return class and attributes of an object as plain data; no attributes for an object of compiled code."""
    try:
        state = object.__getstate__(value)
    except TypeError:  # a class of compiled code
        state = None
    tables = [table for table in (state if isinstance(state, tuple) else (state,)) if isinstance(table, dict)]
    settings = {str(name): setting for table in tables for name, setting in table.items()}
    return {**_source(type(value), type(value).__mro__), "settings": _plain_setting(settings, enclosing)}


def _source(code: type | FunctionType, parts: tuple[type | FunctionType, ...]) -> dict[str, Any]:
    """Return the name of a class or function, and a hash of its source files (of a class and all its base classes).

    For a part without a file, the hash is of its compiled code.
    """
    digest = hashlib.sha256()
    for part in parts:
        # The standard library is another one with another Python, which is no other controller.
        if part.__module__ != "__main__" and part.__module__.partition(".")[0] in sys.stdlib_module_names:
            continue
        try:
            text = Path(inspect.getfile(part)).read_bytes()
        except (TypeError, OSError):  # from a notebook, or typed in
            functions = [part] if isinstance(part, FunctionType) else vars(part).values()
            text = repr(
                [list(_instructions(function.__code__)) for function in functions if isinstance(function, FunctionType)]
            ).encode()
        digest.update(text)
    return {"type": f"{code.__module__}.{code.__qualname__}", "source": digest.hexdigest()[:DIGITS]}


def _instructions(code: CodeType) -> Iterator[object]:
    """Yield name, instructions, names and constants of compiled code, without file name and line numbers."""
    yield from (code.co_name, code.co_code, code.co_names)
    for constant in code.co_consts:
        yield list(_instructions(constant)) if isinstance(constant, CodeType) else constant


def _plain_setting(value: object, enclosing: _Enclosing) -> Any:
    """Return a setting as JSON data; a recursive or too deeply nested value is replaced by its type's name."""
    if value is None or isinstance(value, str | bytes | bool | numbers.Number | np.generic):
        scalar = value.item() if isinstance(value, np.generic) else value
        if isinstance(scalar, bytes):
            return hashlib.sha256(scalar).hexdigest()[:DIGITS]
        # JSON has no complex numbers, and no infinite ones.
        is_plain = scalar is None or isinstance(scalar, str | int)
        return scalar if is_plain or (isinstance(scalar, float) and math.isfinite(scalar)) else repr(scalar)
    if isinstance(value, type | FunctionType):
        return _source(value, (value,))
    if id(value) in enclosing or len(enclosing) >= _DEEPEST:
        return f"{type(value).__module__}.{type(value).__qualname__}"
    inside = (*enclosing, id(value))
    if isinstance(value, Mapping):
        return {str(key): _plain_setting(inner, inside) for key, inner in value.items()}
    items: Any = np.atleast_1d(value).tolist() if isinstance(value, np.ndarray) else value
    if isinstance(items, set | frozenset):
        items = sorted(items, key=repr)
    if not isinstance(items, tuple | list):
        return _object(value, inside)
    plain_items = [_plain_setting(inner, inside) for inner in items]
    digest = hashlib.sha256(json.dumps(plain_items).encode()).hexdigest()
    # Weights of a network, a long table of gains: that they are the same matters, not every one of them.
    return plain_items if len(plain_items) <= _LONGEST else {"items": len(plain_items), "sha256": digest}
