"""Typed intermediate representation of a composed module, independent of the target language.

Type inference (``walk.py``) creates the representation from Python syntax trees. The code generator for C and the range
analysis read it.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

from ppafo.translation.value_types import FLOAT, Array, Items, Row, RowReference, Scalar, Type, types_in

FUNCTIONS = frozenset({"abs", "min", "max", "sqrt"})
"""Functions of every target language; functions of a C library may be added (``engine.compilers.LIBRARY``)."""
_NONE: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Term:
    """Typed expression; its ``kind`` determines the meaning of ``parts`` and ``detail``.

    - number and name: no parts; ``detail`` is the number or the local name.
    - field and item: the part is the row or tuple; ``detail`` is the field name or the item index.
    - build: values of a row or tuple in order. call: arguments; ``detail`` is the function name.
    - choice: condition, value if true, value if false. convert, negative, not: the single operand.
    - element: an array and one index per dimension. part: an array and the bounds of a slice along the first index.
      extent: an array; ``detail`` is the dimension, from 0.
    - an arithmetic or comparison operator in Python notation, ``and``, ``or``: the left and the right operand.
    - a function of ``FUNCTIONS`` or of the C library: its arguments.
    """

    kind: str
    type: Type
    parts: tuple["Term", ...] = ()
    detail: Any = None

    @cached_property
    def reads(self) -> frozenset[str]:
        """Local names read by the expression."""
        # Gathered once: asked again and again while scopes are found.
        names = frozenset((self.detail,)) if self.kind == "name" else _NONE
        return names.union(*(part.reads for part in self.parts)) if self.parts else names


@dataclass(frozen=True, slots=True)
class Assign:
    """Assignment to a local name."""

    name: str
    value: Term


@dataclass(frozen=True, slots=True)
class LocalArray:
    """Declaration of a local array with uninitialised elements."""

    name: str
    type: Array


@dataclass(frozen=True, slots=True)
class Store:
    """Assignment to an element of an array or to a field of a row."""

    element: Term
    value: Term


@dataclass(frozen=True, slots=True)
class If:
    """Conditional statement with the branches ``body`` and ``otherwise``."""

    test: Term
    body: tuple["Statement", ...]
    otherwise: tuple["Statement", ...]


@dataclass(frozen=True, slots=True)
class CountedLoop:
    """Counted loop: ``for name in range(start, stop, step)``."""

    name: str
    start: Term
    stop: Term
    step: int
    body: tuple["Statement", ...]


@dataclass(frozen=True, slots=True)
class While:
    """Loop that repeats while ``test`` is true."""

    test: Term
    body: tuple["Statement", ...]


@dataclass(frozen=True, slots=True)
class LoopExit:
    """``break`` or ``continue`` of the innermost loop."""

    word: str


@dataclass(frozen=True, slots=True)
class Return:
    """Return statement with a value."""

    value: Term


@dataclass(frozen=True, slots=True)
class ProcedureCall:
    """Call of a function without return value, which writes into its array arguments."""

    function: str
    given: tuple[Term, ...]


@dataclass(frozen=True, slots=True)
class Note:
    """Comment on the following lines of a translated text."""

    text: str


Statement: TypeAlias = Note | Assign | LocalArray | Store | If | CountedLoop | While | LoopExit | Return | ProcedureCall


class Parameter(NamedTuple):
    """Parameter of a function; rows without numbers do not occur."""

    name: str
    type: Type


@dataclass(frozen=True, slots=True)
class Function:
    """Function specialised for a combination of parameter types."""

    name: str
    source: str
    """Name of the function in the composed module."""
    parameters: tuple[Parameter, ...]
    returns: Type | None
    """Type of the return value; None if the function returns nothing."""
    body: tuple[Statement, ...]
    bound: tuple[str, ...] = ()
    """Functions passed as arguments, each as ``NAME is FUNCTION``."""
    is_entry: bool = False
    """True if the function returns nothing and is called from outside."""


Module: TypeAlias = list[Function]
"""Functions of a translated text, each after the functions that it calls."""


def converted(term: Term, kind: Type) -> Term:
    """Return a term converted to a wider type."""
    if term.type == kind:
        return term
    if isinstance(kind, Scalar):
        if term.kind == "number":
            return Term("number", kind, (), float(term.detail) if kind == FLOAT else int(term.detail))
        return Term("convert", kind, (term,))
    assert isinstance(kind, Items | Row)
    parts = (converted(item_of(term, index), inner) for index, inner in enumerate(types_in(kind)))
    return Term("build", kind, tuple(parts))


def field_of(term: Term, name: str) -> Term:
    """Return the term of a field of a row, by name."""
    row = term.type.row if isinstance(term.type, RowReference) else term.type
    assert isinstance(row, Row)
    # A field of a struct that is just made is the value it was made of: no struct need exist.
    index = [field_name for field_name, _ in row.fields].index(name)
    return term.parts[index] if term.kind == "build" else Term("field", row.fields[index][1], (term,), name)


def item_of(term: Term, index: int) -> Term:
    """Return the term of an item of a row or tuple, by index."""
    if isinstance(term.type, Row):
        return field_of(term, term.type.fields[index][0])
    assert isinstance(term.type, Items)
    return term.parts[index] if term.kind == "build" else Term("item", term.type.types[index], (term,), index)
