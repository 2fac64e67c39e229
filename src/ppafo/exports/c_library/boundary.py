"""The interface between the functions of an export and their callers: structs by name, or arrays of all numbers.

A library that people read hands over structs. Where runs go on side by side, as in a page, numbers lie in arrays with a
row for each; the composed functions are the same but for their first and last lines.
"""

from collections.abc import Callable, Iterable, Mapping

from ppafo.engine.rows import is_number, is_row, leaf_paths, members, row_expression
from ppafo.translation.value_types import FLOAT, Items, Row, RowReference, Type

NameOf = Callable[[type], str]


class Arrays:
    """Arrays of all numbers, one after another; ``array`` is the name of a parameter."""

    def cell(self, array: str, place: int, name: str) -> str:  # noqa: ARG002
        """Element of an array, by its index."""
        return f"{array}[{place}]"

    def taken(self, array: str, group: str, groups: Mapping[str, type], name_of: NameOf) -> str:
        """Expression for the row of one of several groups, from the numbers of all."""
        cells = {path: f"{array}[{index}]" for index, path in enumerate(_paths(groups))}
        return row_expression(groups[group], group, cells, name_of)

    def given(self, array: str, groups: Mapping[str, type]) -> list[str]:
        """Lines that hand back the numbers of groups, which have their names, one by one."""
        return [f"{array}[{index}] = {path}" for index, path in enumerate(_paths(groups))]

    def head(self, name: str, parameters: Mapping[str, str]) -> str:
        """The first lines of a function; ``parameters`` by name, with their types."""
        return f'@entry("void({", ".join(parameters.values())})")\ndef {name}({", ".join(parameters)}):'


class Structs:
    """Structs of groups of numbers, or of numbers."""

    def cell(self, array: str, place: int, name: str) -> str:  # noqa: ARG002
        """Field of a struct, by its name."""
        return f"{array}.{name}"

    def taken(self, array: str, group: str, groups: Mapping[str, type], name_of: NameOf) -> str:  # noqa: ARG002
        """The row of a group."""
        return f"{array}.{group}" if leaf_paths(groups[group], group) else "()"

    def given(self, array: str, groups: Mapping[str, type]) -> list[str]:
        """Lines that write groups."""
        return [f"{array}.{name} = {name}" for name, row in groups.items() if leaf_paths(row, name)]

    def head(self, name: str, parameters: Mapping[str, str]) -> str:
        """The function, whose types are stated where it is translated."""
        return f"def {name}({', '.join(parameters)}):"


Boundary = Arrays | Structs
"""Writes how functions take numbers from what they are handed, and give them back."""


def _paths(groups: Mapping[str, type]) -> list[str]:
    return [path for name, row in groups.items() for path in leaf_paths(row, name)]


def struct_of(name: str, groups: Mapping[str, type], name_of: NameOf) -> RowReference:
    """A struct of groups of rows, without those that hold no number."""
    # C has no empty structs.
    found = ((group, type_of(row, name_of)) for group, row in groups.items() if leaf_paths(row, group))
    return RowReference(Row(name, tuple(found)))


def struct_of_numbers(name: str, names: Iterable[str]) -> RowReference:
    """Return the C declaration of a struct whose members are numbers."""
    return RowReference(Row(name, tuple((field, FLOAT) for field in names)))


def type_of(row: object, name_of: NameOf) -> Type:
    """The type that a NamedTuple, a tuple of a fixed length or a float has in another language."""
    if is_number(row):
        return FLOAT
    inner = tuple((way.lstrip("."), type_of(kind, name_of)) for way, kind in members(row))
    # One that holds nothing is an empty tuple, as where rows are put together.
    if inner and is_row(row):
        assert isinstance(row, type)
        return Row(name_of(row), inner)
    # A tuple has no names in C either: its items are numbered.
    return Items(tuple(kind for _, kind in inner))
