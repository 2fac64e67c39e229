"""What a controller written in Python is: enough to tell it from another one when a study resumes."""

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

_DEEPEST, _LONGEST, _DIGITS = 12, 64, 16
"""Levels of settings that are looked into, items of a list that is kept and not hashed, and digits of a hash."""

Inside = tuple[int, ...]
"""Identities of what a value is inside of, so that what holds itself comes to an end."""


def controller_document(controller: PythonController) -> dict[str, Any]:
    """Return type, hash of the source text and settings of a controller as it is after a reset, as plain data."""
    try:
        fresh = copy.deepcopy(controller)
    except (TypeError, copy.Error, NotImplementedError, RecursionError):  # it holds what has no copy, such as a port
        return _object(controller, ())
    # What a run left behind is no setting: a study resumes with the same object too.
    fresh.reset()
    return _object(fresh, ())


def _object(value: object, inside: Inside) -> dict[str, Any]:
    try:
        found = object.__getstate__(value)
    except TypeError:  # made outside of Python
        found = None
    tables = [table for table in (found if isinstance(found, tuple) else (found,)) if isinstance(table, dict)]
    settings = {str(name): item for table in tables for name, item in table.items()}
    kind = type(value)
    return {"type": _name(kind), "source": _hash_of(kind.__mro__), "settings": _plain(settings, inside)}


def _name(made: type | FunctionType) -> str:
    return f"{made.__module__}.{made.__qualname__}"


def _hash_of(made: tuple[type | FunctionType, ...]) -> str:
    """Return a hash of the files in which classes or functions are written; of their code where there is no file."""
    digest = hashlib.sha256()
    for one in made:
        # The standard library is another one with another Python, which is no other controller.
        if one.__module__ == "__main__" or one.__module__.partition(".")[0] not in sys.stdlib_module_names:
            digest.update(_text_of(one))
    return digest.hexdigest()[:_DIGITS]


def _text_of(made: type | FunctionType) -> bytes:
    try:
        return Path(inspect.getfile(made)).read_bytes()
    except (TypeError, OSError):  # from a notebook, or typed in
        functions = [made] if isinstance(made, FunctionType) else vars(made).values()
        return repr([list(_code(one.__code__)) for one in functions if isinstance(one, FunctionType)]).encode()


def _code(code: CodeType) -> Iterator[object]:
    yield from (code.co_name, code.co_code, code.co_names)
    for constant in code.co_consts:
        yield list(_code(constant)) if isinstance(constant, CodeType) else constant


def _plain(value: object, inside: Inside) -> Any:
    """Return a setting as data that JSON can hold; one that holds itself, or lies too deep, is its type's name."""
    if value is None or isinstance(value, str | bool | numbers.Number | np.generic):
        return _number_or_text(value)
    if isinstance(value, bytes):
        return hashlib.sha256(value).hexdigest()[:_DIGITS]
    if isinstance(value, type | FunctionType):
        return {"type": _name(value), "source": _hash_of((value,))}
    if id(value) in inside or len(inside) >= _DEEPEST:
        return _name(type(value))
    deeper = (*inside, id(value))
    if isinstance(value, Mapping):
        return {str(key): _plain(item, deeper) for key, item in value.items()}
    items = _items(value)
    return _object(value, deeper) if items is None else _shortened([_plain(item, deeper) for item in items])


def _number_or_text(value: object) -> Any:
    bare = value.item() if isinstance(value, np.generic) else value
    if bare is None or isinstance(bare, str | bool | int):
        return bare
    return bare if isinstance(bare, float) and math.isfinite(bare) else repr(bare)


def _items(value: object) -> list[Any] | None:
    """Return what a collection has in it, None of what is none."""
    if isinstance(value, np.ndarray):
        return list(value.tolist()) if value.ndim else [value.item()]
    if isinstance(value, set | frozenset):
        return sorted(value, key=repr)
    return list(value) if isinstance(value, tuple | list) else None


def _shortened(items: list[Any]) -> Any:
    if len(items) <= _LONGEST:
        return items
    return {"items": len(items), "sha256": hashlib.sha256(json.dumps(items).encode()).hexdigest()}
