"""Cache key of composed texts: hashes of the package's own files, and the parts of the program.

A text follows from the functions of its parts and from those that compose it. Where all of them stand in files of this
package, the bytes of these files, which are read once a process, and the names of the parts say which text it is. A
number or function of the package that a session has changed since counts too. A part from elsewhere, a law in a file of
a user or a function of a notebook, may change at any moment: what has one has no key, and is composed, which looks at
the source of all that it calls.
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
from ppafo.engine.source_text import MadeFrom, Read
from ppafo.model.binding import frame_of

COMPOSED = ("control", "engine", "metrics", "model", "processor", "signals")
"""Packages with functions that enter the text of a program, or that compose it."""
_PACKAGE = Path(__file__).parents[1]
_SUFFIXES = (".py", ".c", ".h")
_PLAIN = (bool, int, float, str)


class Key(NamedTuple):
    """Inputs of a text.

    Attributes:
        described: parts of the program in words
        files: hash of the files of the package that compose the text
        values: hash of the numbers and texts that each loaded module of them has under its names, by module
        made_from: names that the text depends on, with their values
    """

    described: str
    files: str
    values: Mapping[str, str]
    made_from: MadeFrom

    @property
    def words(self) -> str:
        """All inputs in one text; also Python's version, as each writes a syntax tree in its own way."""
        values = " ".join(self.values.values())
        return f"{sys.version} {self.files} {values} {self.described}"


def package_key(parts: Any, folders: tuple[str, ...] = COMPOSED) -> Key | None:
    """Return the key of what is composed of these parts by functions in ``folders``; None where one is elsewhere."""
    try:
        reads = list(_names_in(folders))
        described = _described(parts)
    except _ElsewhereError:
        return None
    # Beside the bytes of the files: a session may have given a name another number.
    numbers: dict[str, Any] = {}
    for read in reads:
        if not isinstance(read.value, FunctionType):
            digest = numbers.setdefault(read.scope["__name__"], hashlib.sha256())
            digest.update(f"{read.name} {read.value!r}\n".encode("utf-8", "surrogatepass"))
    values = {module: digest.hexdigest()[:16] for module, digest in numbers.items()}
    return Key(described=described, files=_hash_of_files(folders), values=values, made_from=MadeFrom(reads))


class _ElsewhereError(Exception):
    """A part does not stand in a file of this package, or is no longer what its name stands for."""


@cache
def _hash_of_files(folders: tuple[str, ...]) -> str:
    """Hash of the paths and bytes of the files."""
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


def _names_in(folders: tuple[str, ...]) -> Iterator[Read]:
    """Numbers and functions that the loaded modules of some folders have under their names."""
    own = tuple(f"ppafo.{folder}." for folder in folders)
    for name, module in sorted(sys.modules.items()):
        if not name.startswith(own):
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
            yield Read(scope, read, value)


def _is_plain(value: Any) -> bool:
    """True for numbers, texts and tuples of these."""
    return isinstance(value, _PLAIN) or (isinstance(value, tuple) and all(map(_is_plain, value)))


@cache
def _is_installed(file: str) -> bool:
    """True for a file of this package, of another one that is installed, or of Python."""
    places = (str(_PACKAGE), sys.prefix, sys.base_prefix)
    return file.startswith(("<frozen", "<string", *places)) or "site-packages" in file


def _described(value: Any) -> str:
    """A part, or what it holds, in words that no other one has."""
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
    """Qualified name of a function, class or module of the package."""
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
        return f"{'.'.join(names)}({_named(frame.function)}; {_described(frame.parts)})"
    if is_row(value):
        # Made of others, such as the settings of a law with those of its estimator: its fields are all of it.
        kinds = (_named(kind) if is_row(kind) else repr(kind) for kind in value.__annotations__.values())
        return f"{'.'.join(names)}({', '.join(value._fields)}: {', '.join(kinds)}; {_described(value._field_defaults)})"
    raise _ElsewhereError
