"""Interface between the functions of an export and their callers: structs by name, or arrays of all numbers.

A library for people to read passes structs. Where runs advance side by side, as in a page, numbers lie in arrays with
one row each. The composed functions differ only in their first and last lines.
"""

from collections.abc import Callable, Iterable, Mapping

from ppafo.engine.rows import is_number, is_row, leaf_paths, members, row_expression
from ppafo.translation.value_types import FLOAT, Items, Row, RowReference, Type

NameOf = Callable[[type], str]


class Arrays:
    """Interface by arrays of all numbers; ``array`` is the name of a parameter."""

    def cell(self, array: str, place: int, name: str) -> str:  # noqa: ARG002
        """Array element by its index."""
        return f"{array}[{place}]"

    def taken(self, array: str, group: str, groups: Mapping[str, type], name_of: NameOf) -> str:
        """Expression that reads the numbers of one group from the array of all numbers, as a struct."""
        cells = {path: f"{array}[{index}]" for index, path in enumerate(_paths(groups))}
        return row_expression(groups[group], group, cells, name_of)

    def given(self, array: str, groups: Mapping[str, type]) -> list[str]:
        """Lines that assign the numbers of each group, from the variable of the group's name, to the array."""
        return [f"{array}[{index}] = {path}" for index, path in enumerate(_paths(groups))]

    def head(self, name: str, parameters: Mapping[str, str]) -> str:
        """First lines of a function; ``parameters`` maps names to types."""
        return f'@entry("void({", ".join(parameters.values())})")\ndef {name}({", ".join(parameters)}):'


class Structs:
    """Interface by structs, of groups of numbers or of numbers."""

    def cell(self, array: str, place: int, name: str) -> str:  # noqa: ARG002
        """Struct field by its name."""
        return f"{array}.{name}"

    def taken(self, array: str, group: str, groups: Mapping[str, type], name_of: NameOf) -> str:  # noqa: ARG002
        """Expression that reads the struct of a group."""
        return f"{array}.{group}" if leaf_paths(groups[group], group) else "()"

    def given(self, array: str, groups: Mapping[str, type]) -> list[str]:
        """Lines that assign each group to its struct field."""
        return [f"{array}.{name} = {name}" for name, row in groups.items() if leaf_paths(row, name)]

    def head(self, name: str, parameters: Mapping[str, str]) -> str:
        """First line of a function; the translation adds the types."""
        return f"def {name}({', '.join(parameters)}):"


Boundary = Arrays | Structs
"""Interface by which exported functions read arguments and return results: arrays or structs."""


def _paths(groups: Mapping[str, type]) -> list[str]:
    return [path for name, row in groups.items() for path in leaf_paths(row, name)]


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
