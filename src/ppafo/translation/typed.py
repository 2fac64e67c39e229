"""A composed module with its types: terms and statements that mean the same in every language.

The typed walk (``walk.py``) makes them of Python's syntax trees; writers of C, of expressions and of ranges read them.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

from ppafo.translation.value_types import FLOAT, Array, Items, Row, RowReference, Scalar, Type, types_in

FUNCTIONS = frozenset({"abs", "min", "max", "sqrt"})
"""Functions that every language has; those of a C library may come with them (``engine.compilers.LIBRARY``)."""
_NONE: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Term:
    """A value. Its ``kind`` says what makes it, and with it what ``parts`` and ``detail`` are.

    - number and name: no parts; the number, the local name.
    - field and item: the row or tuple that has it; the field's name, the item's place.
    - build: the values of a row or tuple in order. call: the arguments; the function's name.
    - choice: the test, the value where it holds, the value where not. convert, negative, not: the one value.
    - element: an array and an index for each of its places. part: an array and indexes of its first places.
      extent: an array; which of its extents, from 0.
    - a sign of arithmetic or comparison as Python writes it, ``and``, ``or``: the left and the right side.
    - a function of ``FUNCTIONS`` or of the C library: its arguments.
    """

    kind: str
    type: Type
    parts: tuple["Term", ...] = ()
    detail: Any = None

    @cached_property
    def reads(self) -> frozenset[str]:
        """Local names whose values it takes."""
        # Gathered once: asked again and again while scopes are found.
        names = frozenset((self.detail,)) if self.kind == "name" else _NONE
        return names.union(*(part.reads for part in self.parts)) if self.parts else names


@dataclass(frozen=True, slots=True)
class Assign:
    """An assignment to a local name."""

    name: str
    value: Term


@dataclass(frozen=True, slots=True)
class LocalArray:
    """A local array whose elements are not set yet."""

    name: str
    type: Array


@dataclass(frozen=True, slots=True)
class Store:
    """An assignment to an element of an array."""

    element: Term
    value: Term


@dataclass(frozen=True, slots=True)
class If:
    """A branch on a test: one body or the other."""

    test: Term
    body: tuple["Statement", ...]
    otherwise: tuple["Statement", ...]


@dataclass(frozen=True, slots=True)
class CountedLoop:
    """A loop of ``name`` from ``start`` by ``step`` up to ``stop``, which it does not reach."""

    name: str
    start: Term
    stop: Term
    step: int
    body: tuple["Statement", ...]


@dataclass(frozen=True, slots=True)
class While:
    """A loop as long as ``test`` holds."""

    test: Term
    body: tuple["Statement", ...]


@dataclass(frozen=True, slots=True)
class LoopExit:
    """``break`` or ``continue`` of the loop around it."""

    word: str


@dataclass(frozen=True, slots=True)
class Return:
    """The end of a function, with its value."""

    value: Term


@dataclass(frozen=True, slots=True)
class ProcedureCall:
    """A call of a function that returns nothing and writes into arrays which it is handed."""

    function: str
    given: tuple[Term, ...]


@dataclass(frozen=True, slots=True)
class Note:
    """Comment in a translated text about the lines after it."""

    text: str


Statement: TypeAlias = Note | Assign | LocalArray | Store | If | CountedLoop | While | LoopExit | Return | ProcedureCall


class Parameter(NamedTuple):
    """A parameter of a function; a row without numbers is none."""

    name: str
    type: Type


@dataclass(frozen=True, slots=True)
class Function:
    """Function for one choice of types."""

    name: str
    source: str
    """Name in the composed module, which has the function once for all types."""
    parameters: tuple[Parameter, ...]
    returns: Type | None
    """None where it returns nothing."""
    body: tuple[Statement, ...]
    bound: tuple[str, ...] = ()
    """Functions passed as arguments, each as ``NAME is FUNCTION``."""
    is_entry: bool = False
    """True where it returns nothing and is called from outside."""


Module: TypeAlias = list[Function]
"""All functions of a translated text, each after those that it calls."""


def converted(term: Term, kind: Type) -> Term:
    """The value of a term as another type that holds it."""
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
    """Return the term for a field of a row, by its name."""
    row = term.type.row if isinstance(term.type, RowReference) else term.type
    assert isinstance(row, Row)
    # A field of a struct that is just made is the value it was made of: no struct need exist.
    index = [field_name for field_name, _ in row.fields].index(name)
    return term.parts[index] if term.kind == "build" else Term("field", row.fields[index][1], (term,), name)


def item_of(term: Term, index: int) -> Term:
    """Return the term for an item of a row or of a tuple, by its index."""
    if isinstance(term.type, Row):
        return field_of(term, term.type.fields[index][0])
    assert isinstance(term.type, Items)
    return term.parts[index] if term.kind == "build" else Term("item", term.type.types[index], (term,), index)
