"""NamedTuples of numbers, nested or not, in a row: the paths of their numbers, and the way there and back.

A path such as ``state.angle`` or ``law.knots[3]`` names a number; nested rows stand in their place. A field that is a
tuple of a fixed length is declared as ``Annotated[tuple[float, ...], 16]``, of floats or of NamedTuples.
"""

from collections.abc import Callable, Iterable, Mapping
from functools import cache, lru_cache
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np

from ppafo.model.columns import over_runs
from ppafo.model.declaration import number_of


class Member(NamedTuple):
    """A part of a row: what its path ends with (``.name``, ``[3]``), and its type."""

    access: str
    kind: Any


def is_row(candidate: object) -> bool:
    """True for a NamedTuple class, of whose numbers a row of a lane is made."""
    return isinstance(candidate, type) and issubclass(candidate, tuple) and hasattr(candidate, "_fields")


@cache
def members(row: Any) -> tuple[Member, ...]:
    """The parts of a NamedTuple class, or of a declared tuple of a fixed length; none of anything else."""
    if is_row(row):
        hints = get_type_hints(row, include_extras=True)
        # Unit and range of a declared number are for files: here it is a float.
        return tuple(Member(f".{name}", float if number_of(hints[name]) else hints[name]) for name in row._fields)
    if get_origin(row) is Annotated:
        items, length = get_args(row)
        return tuple(Member(f"[{number}]", get_args(items)[0]) for number in range(length))
    return ()


# Far more than the classes of a process: this is asked again and again while texts are composed.
@lru_cache(maxsize=4096)
def is_number(row: Any) -> bool:
    """True for the type of a single number, false for a NamedTuple class or a declared tuple."""
    return not is_row(row) and get_origin(row) is not Annotated


def leaf_paths(row: Any, prefix: str) -> list[str]:
    """Paths of all numbers of a NamedTuple class (or of a float), in order, each beginning with ``prefix``."""
    return list(_leaf_paths(row, prefix))


@lru_cache(maxsize=4096)
def _leaf_paths(row: Any, prefix: str) -> tuple[str, ...]:
    if is_number(row):
        return (prefix,)
    return tuple(path for member in members(row) for path in _leaf_paths(member.kind, f"{prefix}{member.access}"))


def row_numbers(groups: Mapping[str, type], first: int = 0) -> dict[str, int]:
    """Number of the row of each number of some groups, by its path, from row ``first`` on."""
    paths = [path for name, row in groups.items() for path in leaf_paths(row, name)]
    return {path: number for number, path in enumerate(paths, first)}


def row_expression(row: Any, path: str, cells: Mapping[str, str], name_of: Callable[[type], str]) -> str:
    """Source text that makes a NamedTuple (or a float) of a path; an empty one is ``()``.

    ``cells`` has the expression of each number by its path, ``name_of`` gives the name of a class in the text.
    """
    if is_number(row):
        return cells[path]
    parts = [row_expression(member.kind, f"{path}{member.access}", cells, name_of) for member in members(row)]
    if not parts:
        return "()"
    return f"{name_of(row)}({', '.join(parts)})" if is_row(row) else f"({', '.join(parts)},)"


def leaves(row: Any) -> list[Any]:
    """All numbers of a NamedTuple, floats or arrays (runs,), in the order of ``leaf_paths``."""
    values: list[Any] = []
    for value in row:
        values += leaves(value) if isinstance(value, tuple) else [value]
    return values


def numbers(row: Any) -> list[float]:
    """All numbers of a NamedTuple of floats, in the units of its fields, in the order of ``leaf_paths``."""
    return [float(value) for value in leaves(row)]


def rebuilt(row: Any, values: Iterable[Any]) -> Any:
    """The NamedTuple of a class with the next of ``values``, floats or arrays, as its numbers: undoes ``leaves``."""
    # Of an iterator this is the iterator itself: nested rows go on where the one before ended.
    rest = iter(values)
    if is_number(row):
        return next(rest)
    parts = [rebuilt(member.kind, rest) for member in members(row)]
    return row(*parts) if is_row(row) else tuple(parts)


def group_of(name: str, groups: Mapping[str, type], rows: "np.ndarray[Any, np.dtype[np.float64]]") -> Any:
    """The NamedTuple of one of the ``groups`` that lie in ``rows`` (numbers, runs), with arrays (runs,).

    KeyError where no group has that name.
    """
    start = 0
    for group, row in groups.items():
        count = len(leaf_paths(row, group))
        if group == name:
            return rebuilt(row, rows[start : start + count])
        start += count
    raise KeyError(name)


def of_each(function: Callable[..., Any], *rows: Any) -> Any:
    """Result of a function of NamedTuples of floats; run by run if their fields are arrays (runs,)."""
    kinds, numbers = [type(row) for row in rows], leaves(rows)

    def from_numbers(*numbers: float) -> Any:
        rest = iter(numbers)
        return function(*(rebuilt(kind, rest) for kind in kinds))

    return over_runs(from_numbers, *numbers)
