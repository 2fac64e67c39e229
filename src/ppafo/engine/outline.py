"""A composed module without its functions: in their place stands a hash of all that they would be written from.

Writing the functions of a program takes nearly all the time of composing it. Where the text, or what was made of it, is
kept from earlier, its outline is enough to find it. Each function counts with its bytecode, its place and the content
of its file, its defaults, and with every name that it reads, down to the last constant. Two programs have one outline
only where they have one text.
"""

import functools
import hashlib
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

from ppafo.engine import plain_python, source_text
from ppafo.engine.source_text import Adaptation, Made, MadeFrom, Read, check_is_plain, emitted_name, is_row

_WRITTEN_BY = (source_text, plain_python)
"""The modules that decide how a function is written; the outline has their content in it."""


@dataclass(slots=True)
class Outline:
    """Takes the place of a ``SourceCollector`` that gathers the same definitions; its text is one line, the hash."""

    decorator: str
    adapt: Adaptation | None = None
    links: dict[Any, Any] = field(default_factory=dict)
    effects: dict[Any, tuple[str, ...]] = field(default_factory=dict)
    needs: dict[str, tuple[str, ...]] = field(default_factory=dict)
    made_from: MadeFrom = field(default_factory=MadeFrom)
    numbers: dict[Any, int] = field(default_factory=dict)
    parts: list[str] = field(default_factory=list)

    def add(self, item: Callable[..., Any] | type) -> str:
        """Take a function or NamedTuple class with all that it needs; return the name that it has in the module."""
        item = self.links.get(item, item)
        if not is_row(item):
            check_is_plain(item)
        self.parts.append(self._described(item))
        return emitted_name(item)

    def text(self) -> str:
        """The hash of everything that was added, as a line of the module."""
        made = hashlib.sha256()
        # A change in how functions are written changes the text, too.
        composers = [file_hash(module.__file__ or "") for module in _WRITTEN_BY]
        adapt = self.adapt
        adapted = "" if adapt is None else f"{emitted_name(adapt)} {file_hash(adapt.__code__.co_filename)}"
        for part in (sys.version, *composers, adapted, self.decorator, *self.parts):
            # Each part with its length, or two lists of parts could run into one another.
            made.update(f"{len(part)} {part}".encode("utf-8", "surrogatepass"))
        return f"# made from {made.hexdigest()}"

    def _described(self, value: Any, inside: Any = None) -> str:
        """What a value is in the text, read ``inside`` a function; what is described is numbered."""
        # The cache around a function is no part of what is compiled.
        value = value.__wrapped__ if isinstance(value, functools._lru_cache_wrapper) else value
        if isinstance(value, FunctionType):
            value = self.links.get((inside, value), self.links.get(value, value))
        if isinstance(value, FunctionType) or is_row(value):
            # Numbered before it is described: a function that calls itself ends here.
            if value not in self.numbers:
                self.numbers[value] = len(self.numbers)
                if isinstance(value, FunctionType):
                    described = self._function(value)
                else:
                    defaults = {name: self._described(given) for name, given in value._field_defaults.items()}
                    file = getattr(sys.modules.get(value.__module__), "__file__", None) or ""
                    described = repr(
                        (emitted_name(value), value._fields, defaults, file_hash(file), self._declared(value))
                    )
                self.parts.append(f"{self.numbers[value]} is {described}")
            return f"item {self.numbers[value]}"
        if isinstance(value, tuple):
            kind = self._described(type(value)) if is_row(type(value)) else "tuple"
            return f"{kind}({', '.join(map(self._described, value))})"
        if value is None or isinstance(value, bool | int | float | str | bytes):
            return f"{type(value).__name__} {value!r}"
        # A builtin function, a module or a class is written by its name; anything else is refused where it is read.
        if isinstance(value, ModuleType):
            return f"module {value.__name__}"
        return f"{type(value).__qualname__} {getattr(value, '__module__', '')} {getattr(value, '__qualname__', '')}"

    def _declared(self, item: Any) -> list[str]:
        """Rows that the annotations of a function or a row name: ``_replace`` and ``each`` write out their fields."""
        kinds = (kind for kind in item.__annotations__.values() if is_row(kind))
        return [self._described(self.links.get((kind, "_replace"), kind)) for kind in kinds]

    def _function(self, function: FunctionType) -> str:
        code, named_defaults = function.__code__, dict(function.__kwdefaults__ or {})
        made = Made(function=function, code=code, defaults=function.__defaults__, named_defaults=named_defaults)
        self.made_from.functions.append(made)
        given = self._described(function.__defaults__), self._described(tuple(named_defaults.items()))
        codes = list(_codes(code))
        names = sorted({name for inner in codes for name in inner.co_names})
        read = [
            f"{name} = {self._described(value, function)}"
            for name, value in self._read(function.__globals__, names, ())
        ]
        shapes = [
            (
                inner.co_code.hex(),
                inner.co_names,
                inner.co_varnames,
                [
                    (type(item).__name__, repr(item))
                    for item in inner.co_consts
                    if not isinstance(item, CodeType | frozenset)
                ],
            )
            for inner in codes
        ]
        # The text carries lines of files for messages, so that a moved function is another text.
        place = code.co_filename, code.co_firstlineno, file_hash(code.co_filename)
        counts = code.co_argcount, code.co_kwonlyargcount
        further = self._declared(function), self.effects.get(function, ())
        return repr((emitted_name(function), place, *counts, shapes, given, read, *further))

    def _read(
        self, scope: dict[str, Any], names: Sequence[str], above: tuple[ModuleType, ...]
    ) -> Iterator[tuple[str, Any]]:
        """Those names that stand for something in a scope or in a module that is read there, and what for."""
        for name in names:
            # A module may load what it has when it is first read.
            found = getattr(above[-1], name, self) if above else scope.get(name, self)
            if found is self:
                continue
            self.made_from.reads.append(Read(scope, name, found))
            yield name, found
            if isinstance(found, ModuleType) and found not in above:
                for inner, value in self._read(vars(found), names, (*above, found)):
                    yield f"{name}.{inner}", value


def _codes(code: CodeType) -> Iterator[CodeType]:
    yield code
    for item in code.co_consts:
        if isinstance(item, CodeType):
            yield from _codes(item)


def file_hash(file: str) -> str:
    """Return the hash of the content of a file as it is now; empty where there is none, as of what was typed in."""
    try:
        found = Path(file).stat()
        # Time and size tell whether a file has changed; only then is it read again.
        return _hash_of(file, found.st_mtime_ns, found.st_size)
    except (OSError, ValueError):
        return ""


@functools.lru_cache(maxsize=1024)
def _hash_of(file: str, _changed: int, _size: int) -> str:
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()
