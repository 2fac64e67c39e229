"""Functions of rows and numbers, called with arrays: compiled, or run by Python without a working compiler."""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, get_type_hints

from ppafo.engine.entries import ARRAY, FLOAT, HEADER, INLINE, entry_text
from ppafo.engine.in_python import WITHOUT_EXCEPTIONS, PythonFunctions
from ppafo.engine.loading import compiled
from ppafo.engine.rows import is_row, leaf_paths, leaves, rebuilt, row_expression
from ppafo.engine.source_text import Replacements, SourceCollector
from ppafo.model.declaration import PlainFunction

_ENTRY = "call_"
"""Prefix of the name of an entry, before the name of its function."""


def row_functions(*functions: PlainFunction) -> list[Callable[..., None]]:
    """Return each function with array arguments: numbers of its rows, numbers of its result, then its own numbers.

    Parameters must be annotated as NamedTuple classes of floats or as ``float``, the result as a NamedTuple class. The
    numbers of the result are written into the array.
    """
    module = compiled(row_source(functions))
    if module is None:
        return [_by_python(function) for function in functions]
    return [getattr(module, _ENTRY + function.__name__) for function in functions]


@cache
def row_source(functions: Sequence[PlainFunction]) -> str:
    """Return the module whose entries are the array functions of ``row_functions``."""
    collector, entries = SourceCollector(INLINE), []
    for function in functions:
        hints = get_type_hints(function)
        result = hints.pop("return")
        rows = {name: kind for name, kind in hints.items() if is_row(kind)}
        lines = []
        for name, kind in rows.items():
            cells = {path: f"row_{name}[{place}]" for place, path in enumerate(leaf_paths(kind, name))}
            lines.append(f"{name} = {row_expression(kind, name, cells, collector.add)}")
        lines.append(f"found = {collector.add(function)}({', '.join(hints)})")
        lines += [f"result[{place}] = {path}" for place, path in enumerate(leaf_paths(result, "found"))]
        types = {f"row_{name}": ARRAY for name in rows} | {"result": ARRAY}
        types |= dict.fromkeys((name for name in hints if name not in rows), FLOAT)
        entries.append(entry_text(_ENTRY + function.__name__, types, lines))
    return "\n\n\n".join([HEADER, collector.text(), *entries])


def _by_python(function: PlainFunction) -> Callable[..., None]:
    """Return an array function run by Python, with the results of compiled code where Python would raise."""
    kinds = [kind for name, kind in get_type_hints(function).items() if name != "return"]
    own, rows = PythonFunctions(Replacements(), {}, WITHOUT_EXCEPTIONS).of(function), sum(map(is_row, kinds))

    def called(*given: Any) -> None:
        arrays, result, rest = iter(given[:rows]), given[rows], iter(given[rows + 1 :])
        arguments = (rebuilt(kind, next(arrays).tolist()) if is_row(kind) else next(rest) for kind in kinds)
        result[:] = leaves(own(*arguments))

    return called
