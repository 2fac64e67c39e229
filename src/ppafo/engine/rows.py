"""How NamedTuples of floats lie in the rows of a lane block: one row for each number, nested ones flattened."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, lru_cache
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import numpy as np

from ppafo.model.columns import over_runs
from ppafo.model.declaration import number_of


def is_row(candidate: object) -> bool:
    """True for a NamedTuple class, of whose numbers a row of a lane is made."""
    return isinstance(candidate, type) and issubclass(candidate, tuple) and hasattr(candidate, "_fields")


@cache
def members(row: Any) -> tuple[tuple[str, Any], ...]:
    """What a NamedTuple class or a tuple of a fixed length is made of: how each is got at (``.name``, ``[3]``), and it.

    A field that is such a tuple is declared as ``Annotated[tuple[float, ...], 16]``, of floats or of NamedTuples.
    """
    if is_row(row):
        hints = get_type_hints(row, include_extras=True)
        # What is declared of a number is for files, and none of the engine's business.
        return tuple((f".{name}", float if number_of(hints[name]) else hints[name]) for name in row._fields)
    if get_origin(row) is Annotated:
        items, length = get_args(row)
        return tuple((f"[{number}]", get_args(items)[0]) for number in range(length))
    return ()


@lru_cache(maxsize=4096)
def is_number(row: Any) -> bool:
    """True for the type of a single number, false for a NamedTuple or a tuple."""
    return not is_row(row) and get_origin(row) is not Annotated


def leaf_paths(row: Any, prefix: str) -> list[str]:
    """Paths of all numbers in a NamedTuple class (or a float), in order, each beginning with ``prefix``: ``a.b[3]``."""
    return list(_leaf_paths(row, prefix))


@lru_cache(maxsize=4096)
def _leaf_paths(row: Any, prefix: str) -> tuple[str, ...]:
    if is_number(row):
        return (prefix,)
    return tuple(path for way, inner in members(row) for path in _leaf_paths(inner, f"{prefix}{way}"))


def row_numbers(groups: Mapping[str, type], first: int = 0) -> dict[str, int]:
    """Row of every number of some groups of rows, by its path such as ``state.angle``, from row ``first`` on."""
    paths = [path for name, row in groups.items() for path in leaf_paths(row, name)]
    return {path: number for number, path in enumerate(paths, first)}


def row_expression(row: Any, path: str, cells: dict[str, str], name_of: Callable[[type], str]) -> str:
    """Source text that makes a NamedTuple (or a float) from the cells that hold its numbers; an empty one is ``()``."""
    if is_number(row):
        return cells[path]
    inner = [row_expression(kind, f"{path}{way}", cells, name_of) for way, kind in members(row)]
    if not inner:
        return "()"
    return f"{name_of(row)}({', '.join(inner)})" if is_row(row) else f"({', '.join(inner)},)"


def leaves(row: Any) -> list[Any]:
    """All numbers of a NamedTuple, floats or arrays (runs,), in the order of ``leaf_paths``."""
    flat: list[Any] = []
    for value in row:
        flat += leaves(value) if isinstance(value, tuple) else [value]
    return flat


def numbers(row: Any) -> list[float]:
    """All numbers of a NamedTuple of floats, in the units of its fields, in the order of ``leaf_paths``."""
    return [float(value) for value in leaves(row)]


def table(groups: Sequence[Any], runs: int) -> "np.ndarray[tuple[int, int], np.dtype[np.float64]]":
    """Rows (numbers, runs) of some NamedTuples whose numbers are floats, the same for all runs, or arrays (runs,)."""
    flat = [value for group in groups for value in leaves(group)]
    rows = np.empty((len(flat), runs))
    for row, value in zip(rows, flat, strict=True):
        # Broadcast: a float fills the row of all runs.
        row[:] = value
    return rows


def rebuild(row: type, values: "np.ndarray[Any, Any] | list[float]") -> Any:
    """The NamedTuple whose numbers are ``values``, in the units of its fields; the inverse of ``numbers``."""
    return rebuilt(row, [float(value) for value in values])


def rebuilt(row: Any, values: Iterable[Any]) -> Any:
    """The NamedTuple whose numbers, floats or arrays, are the next of ``values``; the inverse of ``leaves``."""
    # Of an iterator this is the iterator itself: nested rows go on where the one before ended.
    rest = iter(values)
    if is_number(row):
        return next(rest)
    inner = [rebuilt(kind, rest) for _, kind in members(row)]
    return row(*inner) if is_row(row) else tuple(inner)


def group_of(name: str, groups: Mapping[str, type], rows: "np.ndarray[Any, Any]") -> Any:
    """The NamedTuple of a group of rows (rows, runs), such as ``Program.state_rows`` names, with arrays (runs,).

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
    """What a function makes of some NamedTuples of floats; where they have arrays (runs,), run by run."""
    kinds, numbers = [type(row) for row in rows], leaves(rows)

    def from_numbers(*numbers: float) -> Any:
        rest = iter(numbers)
        return function(*(rebuilt(kind, rest) for kind in kinds))

    return over_runs(from_numbers, *numbers)
