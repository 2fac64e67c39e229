"""Types of the values of a composed module, which say the same in every language; and those of its entries."""

from dataclasses import dataclass
from typing import TypeAlias

from ppafo.engine.entries import entry_types


@dataclass(frozen=True, slots=True)
class Scalar:
    """Type of a number: ``bool``, ``int`` (64 bits, products wrap), ``float`` (64 bits), ``int16`` or ``int32``."""

    name: str


BOOL, INT, FLOAT = Scalar("bool"), Scalar("int"), Scalar("float")
INT16, INT32 = Scalar("int16"), Scalar("int32")
"""Integer types that ``widths`` assigns for small processors; type inference itself finds none."""
_ORDER = (BOOL, INT, FLOAT)


@dataclass(frozen=True, slots=True)
class Row:
    """A NamedTuple with the types that its fields have in one place."""

    name: str
    fields: tuple[tuple[str, "Type"], ...]


@dataclass(frozen=True, slots=True)
class Items:
    """The type of a tuple without names, by the types of its items."""

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
class FunctionArgument:
    """A function that was handed over: it is bound when the call is translated."""

    name: str


@dataclass(frozen=True, slots=True)
class RowReference:
    """A row that is handed over by its place: what a function writes into it is seen outside."""

    row: Row


Type: TypeAlias = Scalar | Row | Items | Array | FunctionArgument | RowReference


def entries_of(source: str) -> dict[str, tuple[Type, ...]]:
    """Functions of a composed module that are called from outside, with the types of their parameters."""
    plain: dict[str, Type] = {"int64": INT, "float64": FLOAT}
    return {
        name: tuple(plain.get(word) or Array(word.count(":") - 1) for word in words)
        for name, words in entry_types(source).items()
    }


def is_empty(kind: Type) -> bool:
    """True for what holds no number: a function, a row or a tuple of nothing."""
    return all(map(is_empty, types_in(kind))) if isinstance(kind, Items | Row) else isinstance(kind, FunctionArgument)


def types_in(kind: Items | Row) -> tuple[Type, ...]:
    """Types of the items of a tuple, or of the fields of a row."""
    return kind.types if isinstance(kind, Items) else tuple(inner for _, inner in kind.fields)


def joined(first: Type, other: Type) -> Type | None:
    """The type that holds both, as where two branches meet; None where there is none."""
    if first == other:
        return first
    if isinstance(first, Scalar) and isinstance(other, Scalar):
        return max(first, other, key=_ORDER.index)
    # Tuples of different lengths have no common type.
    if isinstance(first, Items) and isinstance(other, Items) and len(first.types) == len(other.types):
        types = [joined(*pair) for pair in zip(first.types, other.types, strict=True)]
        return None if None in types else Items(tuple(kind for kind in types if kind is not None))
    if isinstance(first, Row) and isinstance(other, Row) and first.name == other.name:
        pairs = zip(first.fields, other.fields, strict=True)
        found = [(name, joined(inner, outer)) for (name, inner), (_, outer) in pairs]
        fields = tuple((name, kind) for name, kind in found if kind is not None)
        return Row(first.name, fields) if len(fields) == len(found) else None
    return None


def mixes(first: Type, other: Type) -> bool:
    """True where one has a whole number or truth value in the place of a float: -0 and large ones would differ."""
    if isinstance(first, Scalar) and isinstance(other, Scalar):
        return first != other and FLOAT in (first, other)
    if isinstance(first, Items | Row) and isinstance(other, Items | Row):
        return any(mixes(*pair) for pair in zip(types_in(first), types_in(other), strict=True))
    return False
