"""Types of values in a composed module, independent of the target language."""

from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True, slots=True)
class Scalar:
    """Type of a number: ``bool``, ``int`` (64 bits, products wrap), ``float`` (64 bits), ``int16`` or ``int32``."""

    name: str


BOOL = Scalar("bool")
INT = Scalar("int")
FLOAT = Scalar("float")
# Integer types of small processors, assigned by ``widths`` only.
INT16 = Scalar("int16")
INT32 = Scalar("int32")
_ORDER = (BOOL, INT, FLOAT)


@dataclass(frozen=True, slots=True)
class Row:
    """Type of a NamedTuple, with the types of its fields."""

    name: str
    fields: tuple[tuple[str, "Type"], ...]


@dataclass(frozen=True, slots=True)
class Items:
    """Type of a plain tuple: the types of its items."""

    types: tuple["Type", ...]

    @property
    def is_uniform(self) -> bool:
        """True if all items have the same type."""
        return len(set(self.types)) == 1


@dataclass(frozen=True, slots=True)
class Array:
    """Type of a float array; ``shape`` is () for an argument, whose extents are known only at run time."""

    dimensions: int
    shape: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class FunctionArgument:
    """Type of a function passed as an argument; the call is bound at translation."""

    name: str


@dataclass(frozen=True, slots=True)
class RowReference:
    """Type of a row passed by reference, so that the caller sees assignments to its fields."""

    row: Row


Type: TypeAlias = Scalar | Row | Items | Array | FunctionArgument | RowReference


def declared_type(word: str) -> Type:
    """Return the type that an entry declares, such as ``float64[:, ::1]``."""
    return {"int64": INT, "float64": FLOAT}.get(word) or Array(word.count(":") - 1)


def is_empty(kind: Type) -> bool:
    """Return whether a type contains no number: a function, or a row or tuple without numbers."""
    return all(map(is_empty, types_in(kind))) if isinstance(kind, Items | Row) else isinstance(kind, FunctionArgument)


def types_in(kind: Items | Row) -> tuple[Type, ...]:
    """Return the types of tuple items or row fields."""
    return kind.types if isinstance(kind, Items) else tuple(inner for _, inner in kind.fields)


def joined(first: Type, other: Type) -> Type | None:
    """Return the common type of two types, None if there is none."""
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
    """Return whether an integer or boolean meets a float, where -0 and large numbers differ from Python."""
    if isinstance(first, Scalar) and isinstance(other, Scalar):
        return first != other and FLOAT in (first, other)
    if isinstance(first, Items | Row) and isinstance(other, Items | Row):
        return any(mixes(*pair) for pair in zip(types_in(first), types_in(other), strict=True))
    return False
