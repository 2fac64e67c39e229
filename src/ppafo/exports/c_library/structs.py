"""Structs by which the functions of an export and their callers hand on groups of numbers."""

from collections.abc import Callable, Iterable, Mapping

from ppafo.engine.rows import is_number, is_row, leaf_paths, members
from ppafo.translation.value_types import FLOAT, Items, Row, RowReference, Type

NameOf = Callable[[type], str]


def taken(array: str, group: str, groups: Mapping[str, type]) -> str:
    """Return the expression that reads the struct of a group."""
    return f"{array}.{group}" if leaf_paths(groups[group], group) else "()"


def given(array: str, groups: Mapping[str, type]) -> list[str]:
    """Return the lines that assign each group to its struct field."""
    return [f"{array}.{name} = {name}" for name, row in groups.items() if leaf_paths(row, name)]


def struct_of(name: str, groups: Mapping[str, type], name_of: NameOf) -> RowReference:
    """Return the C struct of groups of rows; groups without numbers are omitted."""
    # C has no empty structs.
    found = ((group, type_of(row, name_of)) for group, row in groups.items() if leaf_paths(row, group))
    return RowReference(Row(name, tuple(found)))


def struct_of_numbers(name: str, names: Iterable[str]) -> RowReference:
    """Return the C struct whose members are the named numbers."""
    return RowReference(Row(name, tuple((field, FLOAT) for field in names)))


def type_of(row: object, name_of: NameOf) -> Type:
    """Return the translated type of a NamedTuple, a tuple of fixed length or a float."""
    if is_number(row):
        return FLOAT
    inner = tuple((way.lstrip("."), type_of(kind, name_of)) for way, kind in members(row))
    # One that holds nothing is an empty tuple, as where rows are put together.
    if inner and is_row(row):
        assert isinstance(row, type)
        return Row(name_of(row), inner)
    # A tuple has no names in C either: its items are numbered.
    return Items(tuple(kind for _, kind in inner))
