"""NamedTuples of numbers, nested or not, as flat rows: paths of the numbers, and conversion in both directions.

A path such as ``state.angle`` or ``law.knots[3]`` names a number; nested rows are expanded in place. A field that is a
tuple of fixed length is declared as ``Annotated[tuple[float, ...], 16]``, of floats or of NamedTuples.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache, lru_cache
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np

from ppafo.model.columns import over_runs
from ppafo.model.declaration import number_of


class Member(NamedTuple):
    """Member of a row: the end of its path (``.name``, ``[3]``), and its type."""

    access: str
    kind: Any


def section_row(row: Any, settings: Mapping[str, Any], section: str, *further: Any) -> Any:
    """Return a NamedTuple filled with the numbers of a section from settings by path, its last fields with others.

    In functions that prepare a run or a default the call is expanded number by number.
    """
    return row(*(settings[f"{section}.{name}"] for name in row._fields[: len(row._fields) - len(further)]), *further)


def component_row(kind: Any, settings: Mapping[str, Any], section: str) -> Any:
    """Return the parameters of a component, such as a controller or a profile, filled as ``section_row`` does."""
    return rebuilt(kind.parameters, [settings[f"{section}.{quantity.name}"] for quantity in kind.quantities])


def is_row(candidate: object) -> bool:
    """Return whether an object is a NamedTuple class."""
    return isinstance(candidate, type) and issubclass(candidate, tuple) and hasattr(candidate, "_fields")


@cache
def members(row: Any) -> tuple[Member, ...]:
    """Return the members of a NamedTuple class, or of a declared tuple of fixed length; empty for anything else."""
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
    """Return whether a type is a single number, rather than a NamedTuple class or a declared tuple."""
    return not is_row(row) and get_origin(row) is not Annotated


def leaf_paths(row: Any, prefix: str) -> list[str]:
    """Return the paths of all numbers of a NamedTuple class (or of a float) in order, with the prefix ``prefix``."""
    return list(_leaf_paths(row, prefix))


@lru_cache(maxsize=4096)
def _leaf_paths(row: Any, prefix: str) -> tuple[str, ...]:
    if is_number(row):
        return (prefix,)
    return tuple(path for member in members(row) for path in _leaf_paths(member.kind, f"{prefix}{member.access}"))


def row_numbers(groups: Mapping[str, type], first: int = 0) -> dict[str, int]:
    """Return the row index of each number of some groups by path, counted from ``first``."""
    paths = [path for name, row in groups.items() for path in leaf_paths(row, name)]
    return {path: number for number, path in enumerate(paths, first)}


def row_expression(row: Any, path: str, cells: Mapping[str, str], name_of: Callable[[type], str]) -> str:
    """Return source text that constructs a NamedTuple (or a float) at a path; ``()`` for an empty NamedTuple.

    ``cells`` has the expression of each number by path, ``name_of`` returns the name of a class in the text.
    """
    if is_number(row):
        return cells[path]
    parts = [row_expression(member.kind, f"{path}{member.access}", cells, name_of) for member in members(row)]
    if not parts:
        return "()"
    return f"{name_of(row)}({', '.join(parts)})" if is_row(row) else f"({', '.join(parts)},)"


def taken(array: str, name: str, row: Any) -> str:
    """Return source text that reads a group from a struct of groups; one without numbers is not in it."""
    return f"{array}.{name}" if leaf_paths(row, name) else "()"


def given(array: str, groups: Mapping[str, Any]) -> list[str]:
    """Return lines of source text that store groups in a struct of groups."""
    return [f"{array}.{name} = {name}" for name, row in groups.items() if leaf_paths(row, name)]


def leaves(row: Any) -> list[Any]:
    """Return all numbers of a NamedTuple, floats or arrays (runs,), in the order of ``leaf_paths``."""
    values: list[Any] = []
    for value in row.values() if isinstance(row, Mapping) else row:
        values += leaves(value) if isinstance(value, tuple | Mapping) else [value]
    return values


def numbers(row: Any) -> list[float]:
    """Return all numbers of a NamedTuple of floats, in field units, in the order of ``leaf_paths``."""
    return [float(value) for value in leaves(row)]


def rebuilt(row: Any, values: Iterable[Any]) -> Any:
    """Return a NamedTuple of a class from the next ``values``, floats or arrays; the inverse of ``leaves``."""
    # Of an iterator this is the iterator itself: nested rows go on where the one before ended.
    rest = iter(values)
    if is_number(row):
        return next(rest)
    parts = [rebuilt(member.kind, rest) for member in members(row)]
    return row(*parts) if is_row(row) else tuple(parts)


def group_of(name: str, groups: Mapping[str, type], rows: "np.ndarray[Any, np.dtype[np.float64]]") -> Any:
    """Return the NamedTuple of one of the ``groups`` stored in ``rows`` (numbers, runs), with arrays (runs,).

    Raises KeyError for an unknown group name.
    """
    start = 0
    for group, row in groups.items():
        count = len(leaf_paths(row, group))
        if group == name:
            return rebuilt(row, rows[start : start + count])
        start += count
    raise KeyError(name)


def of_each(function: Callable[..., Any], *arguments: Any) -> Any:
    """Return the result of a function of numbers, rows and mappings of rows, run by run where any holds arrays (runs,).

    Every number of the result is then an array (runs,).
    """
    alone, numbers = one_by_one(function, arguments)
    return over_runs(alone, *numbers)


def one_by_one(function: Callable[..., Any], arguments: Sequence[Any]) -> tuple[Callable[..., Any], list[Any]]:
    """Return a function of the numbers of those arguments that hold arrays, and these numbers, in order."""
    varied = [any(isinstance(number, np.ndarray) and number.ndim for number in leaves([one])) for one in arguments]

    def alone(*values: float) -> Any:
        rest = iter(values)
        pairs = zip(arguments, varied, strict=True)
        return function(*(_refilled(one, rest) if is_varied else one for one, is_varied in pairs))

    return alone, leaves([one for one, is_varied in zip(arguments, varied, strict=True) if is_varied])


def _refilled(argument: Any, values: Iterator[float]) -> Any:
    """Return a number, a row or a mapping of rows with its numbers replaced by the next values."""
    if isinstance(argument, Mapping):
        return {name: _refilled(row, values) for name, row in argument.items()}
    if not isinstance(argument, tuple):
        return next(values)
    parts = [_refilled(part, values) for part in argument]
    return type(argument)(*parts) if hasattr(argument, "_fields") else tuple(parts)
