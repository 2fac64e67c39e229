"""Cache key of composed texts: hashes of the package files, and the components of the program.

A text depends on the functions of its components and on the composing functions. If all of them are defined in files of
this package, the contents of the files, read once per process, and the names of the components determine the text.
Numbers and functions of the package that were replaced in the present process are included in the key. A component from
elsewhere, such as a law in a user's file or a function in a notebook, may change at any time. A program with such a
component has no key and is composed again, which reads the source of all called functions.
"""

import hashlib
import os
import sys
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import cache, reduce
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, NamedTuple

from ppafo.engine.rows import is_row
from ppafo.engine.source_text import MadeFrom, NameRead
from ppafo.model.binding import frame_of, parts_of

COMPOSED = ("control", "engine", "metrics", "model", "processor", "signals")
"""Subpackages with functions that become part of a program text, or that compose the text."""
_WRITING = (
    *("ppafo.engine.cache", "ppafo.engine.generator", "ppafo.engine.loop_", "ppafo.engine.reduction"),
    "ppafo.translation.",
)
"""Modules that write or store texts. A process loads them only for a text that is not stored yet, so that a key with
their values would not be found again; of these modules the files alone are in the key."""
_PACKAGE = Path(__file__).parents[1]
_SUFFIXES = (".py", ".c", ".h")
_PLAIN = (bool, int, float, str)


class Key(NamedTuple):
    """Inputs that determine a composed text in words, and the names that it depends on, with their values."""

    words: str
    made_from: MadeFrom


def package_key(parts: Any, folders: tuple[str, ...] = COMPOSED) -> Key | None:
    """Return the key of a text composed of these parts by functions in ``folders``; None for parts from elsewhere."""
    try:
        reads = list(_names_in(folders))
        described = _described(parts)
    except _ElsewhereError:
        return None
    # Beside the bytes of the files: a session may have given a name another number.
    numbers = hashlib.sha256()
    for read in reads:
        if not isinstance(read.value, FunctionType):
            numbers.update(f"{read.scope['__name__']} {read.name} {read.value!r}\n".encode("utf-8", "surrogatepass"))
    # Each version of Python writes syntax trees differently.
    return Key(f"{sys.version} {_hash_of_files(folders)} {numbers.hexdigest()} {described}", MadeFrom(reads))


class _ElsewhereError(Exception):
    """Error for a part that is not defined in a package file, or that no longer has its original value."""


@cache
def _hash_of_files(folders: tuple[str, ...]) -> str:
    """Return the hash of paths and contents of the files."""
    digest = hashlib.sha256()
    root = str(_PACKAGE)
    # Names as texts: paths of hundreds of files take longer than their bytes.
    files = [
        f"{directory}{os.sep}{name}"
        for folder in folders
        for directory, _, names in os.walk(f"{root}{os.sep}{folder}")
        for name in names
        if name.endswith(_SUFFIXES)
    ]
    for file in sorted(files):
        with open(file, "rb") as opened:  # noqa: PTH123
            content = opened.read()
        digest.update(f"{file[len(root) :]} {len(content)} ".encode())
        digest.update(content)
    return digest.hexdigest()


def _names_in(folders: tuple[str, ...]) -> Iterator[NameRead]:
    """Yield the numbers and functions defined in the loaded modules of some folders."""
    own = tuple(f"ppafo.{folder}." for folder in folders)
    for name, module in sorted(sys.modules.items()):
        if not name.startswith(own) or name.startswith(_WRITING):
            continue
        # A module that was loaded from another file is no longer that of the package.
        if not str(getattr(module, "__file__", None) or _PACKAGE).startswith(str(_PACKAGE)):
            raise _ElsewhereError
        scope = vars(module)
        for read, value in scope.items():
            if read.startswith("__") or not (isinstance(value, FunctionType) or _is_plain(value)):
                continue
            if isinstance(value, FunctionType) and not _is_installed(value.__code__.co_filename):
                raise _ElsewhereError
            yield NameRead(scope, read, value)


def _is_plain(value: Any) -> bool:
    """Return whether a value is a number, a text or a tuple of such values."""
    return isinstance(value, _PLAIN) or (isinstance(value, tuple) and all(map(_is_plain, value)))


@cache
def _is_installed(file: str) -> bool:
    """Return whether a file belongs to this package, to another installed package or to Python."""
    places = (str(_PACKAGE), sys.prefix, sys.base_prefix)
    return file.startswith(("<frozen", "<string", *places)) or "site-packages" in file


def _described(value: Any) -> str:
    """Return a unique description of a part or of its contents."""
    if value is None or isinstance(value, bool | int | float | str):
        return f"{type(value).__name__} {value!r}"
    if isinstance(value, FunctionType | type | ModuleType):
        return _named(value)
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{_described(key)}: {_described(inner)}' for key, inner in value.items())}}}"
    if isinstance(value, tuple | list):
        kind = _named(type(value)) if hasattr(value, "_fields") else type(value).__name__
        return f"{kind}({', '.join(map(_described, value))})"
    if is_dataclass(value):
        held = (f"{part.name}={_described(getattr(value, part.name))}" for part in fields(value))
        return f"{_named(type(value))}({', '.join(held)})"
    raise _ElsewhereError


def _named(value: Any) -> str:
    """Return the qualified name of a function, class or module of the package."""
    module = value.__name__ if isinstance(value, ModuleType) else value.__module__
    if isinstance(value, type) and module == "builtins":
        return value.__qualname__
    if not module.startswith("ppafo."):
        raise _ElsewhereError
    if isinstance(value, ModuleType):
        return module
    names = [module, *value.__qualname__.split(".")]
    stands: Any = reduce(lambda owner, name: getattr(owner, name, None), names[1:], sys.modules.get(names[0]))
    if stands is value:
        return ".".join(names)
    frame = frame_of(value) if isinstance(value, FunctionType) else None
    if frame is not None:
        return f"{'.'.join(names)}({_named(frame)}; {_described(parts_of(value))})"
    if is_row(value):
        # Made of others, such as the settings of a law with those of its estimator: its fields are all of it.
        kinds = (_named(kind) if is_row(kind) else repr(kind) for kind in value.__annotations__.values())
        return f"{'.'.join(names)}({', '.join(value._fields)}: {', '.join(kinds)}; {_described(value._field_defaults)})"
    raise _ElsewhereError
