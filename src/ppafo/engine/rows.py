"""How NamedTuples of floats lie in the rows of a lane block: one row for each number, nested ones flattened."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, get_type_hints

import numpy as np

from ppafo.engine.source_text import is_row


def leaf_paths(row: type, prefix: str) -> list[str]:
    """Attribute paths of all numbers in a NamedTuple class (or a float), in order, each beginning with ``prefix``."""
    if not is_row(row):
        return [prefix]
    paths = []
    hints = get_type_hints(row)
    for name in row._fields:  # type: ignore[attr-defined]
        path = f"{prefix}.{name}"
        paths += leaf_paths(hints[name], path) if is_row(hints[name]) else [path]
    return paths


def row_numbers(groups: Mapping[str, type]) -> dict[str, int]:
    """Row of every number of some groups of rows, by its path such as ``state.angle``."""
    paths = [path for name, row in groups.items() for path in leaf_paths(row, name)]
    return {path: number for number, path in enumerate(paths)}


def row_expression(row: type, path: str, cells: dict[str, str], name_of: Callable[[type], str]) -> str:
    """Source text that makes a NamedTuple (or a float) from the cells that hold its numbers; an empty one is ``()``."""
    if not is_row(row):
        return cells[path]
    fields = row._fields  # type: ignore[attr-defined]
    if not fields:
        return "()"
    hints = get_type_hints(row)
    inner = [
        row_expression(hints[name], f"{path}.{name}", cells, name_of)
        if is_row(hints[name])
        else cells[f"{path}.{name}"]
        for name in fields
    ]
    return f"{name_of(row)}({', '.join(inner)})"


def leaves(row: Any) -> list[Any]:
    """All numbers of a NamedTuple, floats or arrays (runs,), in the order of ``leaf_paths``."""
    flat: list[Any] = []
    for value in row:
        flat += leaves(value) if isinstance(value, tuple) else [value]
    return flat


def numbers(row: Any) -> list[float]:
    """All numbers of a NamedTuple of floats, in the order of ``leaf_paths``."""
    return [float(value) for value in leaves(row)]


def table(groups: Sequence[Any], runs: int) -> "np.ndarray[tuple[int, int], np.dtype[np.float64]]":
    """Rows (numbers, runs) of some NamedTuples whose numbers are floats, the same for all runs, or arrays (runs,)."""
    flat = [value for group in groups for value in leaves(group)]
    rows = np.empty((len(flat), runs))
    for row, value in zip(rows, flat, strict=True):
        row[:] = value
    return rows


def rebuild(row: type, values: "np.ndarray[Any, Any] | list[float]") -> Any:
    """The NamedTuple whose numbers are ``values``; the inverse of ``numbers``."""
    return rebuilt(row, [float(value) for value in values])


def rebuilt(row: type, values: Iterable[Any]) -> Any:
    """The NamedTuple whose numbers, floats or arrays, are ``values``; the inverse of ``leaves``."""
    return _rebuild(row, iter(values))


def _rebuild(row: type, values: Any) -> Any:
    hints = get_type_hints(row)
    fields = row._fields  # type: ignore[attr-defined]
    return row(*[_rebuild(hints[name], values) if is_row(hints[name]) else next(values) for name in fields])
