"""What the typed walk finds in a composed module: types, terms and statements that say the same in every language."""

from dataclasses import dataclass, field
from typing import Any, TypeAlias

from ppafo.engine.entries import entry_types


@dataclass(frozen=True, slots=True)
class Scalar:
    """One number: ``bool``, ``int`` (64 bits, products wrap), ``float`` (64 bits), ``int16`` or ``int32``."""

    name: str


BOOL, INT, FLOAT = Scalar("bool"), Scalar("int"), Scalar("float")
INT16, INT32 = Scalar("int16"), Scalar("int32")
"""What ``widths`` makes of whole numbers for small processors; the walk itself finds none."""
_ORDER = (BOOL, INT, FLOAT)


@dataclass(frozen=True, slots=True)
class Row:
    """A NamedTuple with the types that its fields have in one place."""

    name: str
    fields: tuple[tuple[str, "Type"], ...]


@dataclass(frozen=True, slots=True)
class Items:
    """A tuple without names."""

    types: tuple["Type", ...]

    @property
    def is_uniform(self) -> bool:
        """True where all items are of one type."""
        return len(set(self.types)) == 1


@dataclass(frozen=True, slots=True)
class Array:
    """An array of floats; ``shape`` is () for one that is handed over, whose extents are known when it runs."""

    dimensions: int
    shape: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Handed:
    """A function that was handed over: it is bound when the call is translated."""

    name: str


@dataclass(frozen=True, slots=True)
class Shared:
    """A row that is handed over by its place: what a function writes into it is seen outside."""

    row: Row


Type: TypeAlias = Scalar | Row | Items | Array | Handed | Shared


def entries_of(source: str) -> dict[str, tuple[Type, ...]]:
    """Functions of a composed module that are called from outside, with the types of their parameters."""
    plain: dict[str, Type] = {"int64": INT, "float64": FLOAT}
    return {
        name: tuple(plain.get(word) or Array(word.count(":") - 1) for word in words)
        for name, words in entry_types(source).items()
    }


_NONE: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class Term:
    """A value: what makes it, its type, the terms that it is made of, and a name or number where it has one.

    Kinds: number, name, field, item, build, call, choice, convert, negative, not, element (of an array), extent, part
    (of an array, along its first places), and the signs and functions of ``SIGNS``, ``FUNCTIONS`` and ``LIBRARY``.
    """

    kind: str
    type: Type
    parts: tuple["Term", ...] = ()
    detail: Any = None
    reads: frozenset[str] = field(init=False, compare=False, repr=False)
    """Local names whose values it takes."""

    def __post_init__(self) -> None:
        # Gathered once: asked again and again while scopes are found.
        names = frozenset((self.detail,)) if self.kind == "name" else _NONE
        object.__setattr__(self, "reads", names.union(*(part.reads for part in self.parts)) if self.parts else names)


SIGNS = frozenset({"+", "-", "*", "/", "//", "%", "&", "|", "^", ">>", "<", "<=", ">", ">=", "==", "!=", "and", "or"})
FUNCTIONS = frozenset({"abs", "min", "max", "sqrt"})
LIBRARY = frozenset({"exp", "log", "pow"})
"""Functions that every C library has, with last bits of its own."""


@dataclass(frozen=True, slots=True)
class Assign:
    """A local name gets a value."""

    name: str
    value: Term


@dataclass(frozen=True, slots=True)
class Reserve:
    """A local array without values yet."""

    name: str
    type: Array


@dataclass(frozen=True, slots=True)
class Store:
    """An element of an array gets a value."""

    element: Term
    value: Term


@dataclass(frozen=True, slots=True)
class If:
    """A branch."""

    test: Term
    body: tuple["Statement", ...]
    otherwise: tuple["Statement", ...]


@dataclass(frozen=True, slots=True)
class Count:
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
class Leave:
    """``break`` or ``continue``."""

    word: str


@dataclass(frozen=True, slots=True)
class Return:
    """The end of a function, with its value."""

    value: Term


@dataclass(frozen=True, slots=True)
class Perform:
    """A call of a function that returns nothing and writes into arrays which it is handed."""

    function: str
    given: tuple[Term, ...]


@dataclass(frozen=True, slots=True)
class Note:
    """What a text that is written for translation says of the lines behind it."""

    text: str


Statement: TypeAlias = Note | Assign | Reserve | Store | If | Count | While | Leave | Return | Perform


@dataclass(frozen=True, slots=True)
class Function:
    """One function for one choice of types; ``source`` is its name in the composed module.

    ``bound`` lists the functions that were handed over. What is empty is no parameter. ``returns`` None is nothing.
    ``is_entry`` is true for one that returns nothing and is called from outside.
    """

    name: str
    source: str
    parameters: tuple[tuple[str, Type], ...]
    returns: Type | None
    body: tuple[Statement, ...]
    bound: tuple[str, ...] = ()
    is_entry: bool = False


@dataclass(slots=True)
class Module:
    """All functions, callees first."""

    functions: list[Function] = field(default_factory=list)


def is_empty(kind: Type) -> bool:
    """True for what holds no number: a function, a row or a tuple of nothing."""
    return all(map(is_empty, types_in(kind))) if isinstance(kind, Items | Row) else isinstance(kind, Handed)


def types_in(kind: Items | Row) -> tuple[Type, ...]:
    """Types of the items of a tuple, or of the fields of a row."""
    return kind.types if isinstance(kind, Items) else tuple(inner for _, inner in kind.fields)


def joined(one: Type, other: Type) -> Type | None:
    """The type that holds both, as where two branches meet; None where there is none."""
    if one == other:
        return one
    if isinstance(one, Scalar) and isinstance(other, Scalar):
        return max(one, other, key=_ORDER.index)
    # Tuples of different lengths have no common type.
    if isinstance(one, Items) and isinstance(other, Items) and len(one.types) == len(other.types):
        types = [joined(*pair) for pair in zip(one.types, other.types, strict=True)]
        return None if None in types else Items(tuple(item for item in types if item is not None))
    if isinstance(one, Row) and isinstance(other, Row) and one.name == other.name:
        pairs = zip(one.fields, other.fields, strict=True)
        found = [(name, joined(inner, outer)) for (name, inner), (_, outer) in pairs]
        fields = tuple((name, kind) for name, kind in found if kind is not None)
        return Row(one.name, fields) if len(fields) == len(found) else None
    return None


def mixes(one: Type, other: Type) -> bool:
    """True where one has a whole number or truth value in the place of a float: -0 and large ones would differ."""
    if isinstance(one, Scalar) and isinstance(other, Scalar):
        return one != other and FLOAT in (one, other)
    if isinstance(one, Items | Row) and isinstance(other, Items | Row):
        return any(mixes(*pair) for pair in zip(types_in(one), types_in(other), strict=True))
    return False


def converted(term: Term, kind: Type) -> Term:
    """The value of a term as another type that holds it."""
    if term.type == kind:
        return term
    if isinstance(kind, Scalar):
        if term.kind == "number":
            return Term("number", kind, (), float(term.detail) if kind == FLOAT else int(term.detail))
        return Term("convert", kind, (term,))
    assert isinstance(kind, Items | Row)
    parts = (converted(item_of(term, place), inner) for place, inner in enumerate(types_in(kind)))
    return Term("build", kind, tuple(parts))


def field_of(term: Term, name: str) -> Term:
    """A field of a row."""
    row = term.type.row if isinstance(term.type, Shared) else term.type
    assert isinstance(row, Row)
    # A field of a struct that is just made is the value it was made of: no struct need exist.
    place = [own for own, _ in row.fields].index(name)
    return term.parts[place] if term.kind == "build" else Term("field", row.fields[place][1], (term,), name)


def item_of(term: Term, place: int) -> Term:
    """An item of a row or tuple by its place."""
    if isinstance(term.type, Row):
        return field_of(term, term.type.fields[place][0])
    assert isinstance(term.type, Items)
    return term.parts[place] if term.kind == "build" else Term("item", term.type.types[place], (term,), place)
