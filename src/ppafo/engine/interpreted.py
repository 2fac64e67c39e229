"""A composed text as Python runs it, with what compiled code gives where Python would raise.

It is the last resort: the bits are those of every compiler, the time is some hundred times theirs. Arrays are handed to
it as memory views, whose elements are Python's own numbers.
"""

import ast
import linecache
import math
import traceback
from collections import namedtuple
from collections.abc import Callable
from functools import lru_cache
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np

from ppafo.engine.entries import entry_types
from ppafo.engine.plain_python import parse_module, place_in, refusal


@lru_cache(maxsize=64)
def interpreted(source: str) -> ModuleType:
    """Return the module of a composed text, whose entries Python runs."""
    module = ModuleType("ppafo_python")
    tree = ast.fix_missing_locations(_AsCompiled().visit(parse_module(source)))
    path = f"<composed model {hash(source):x}>"
    # A debugger and tracebacks show its lines.
    linecache.cache[path] = (len(source), None, source.splitlines(keepends=True), path)
    scope = module.__dict__
    scope |= {"math": MATH, "namedtuple": namedtuple, "entry": _entry, "inline": _as_it_is, "empty_rows": empty_rows}
    scope |= {"_quotient": quotient, "_power": _power, "int": whole_part}
    exec(compile(tree, path, "exec"), scope)
    for name in entry_types(source):
        scope[name] = _with_views(scope[name], path, source.split("\n"))
    return module


class _AsCompiled(ast.NodeTransformer):
    """Leaves away the imports, which the module has; a quotient and a power go on where Python would raise."""

    def visit_Import(self, _node: ast.Import) -> None:
        return None

    def visit_ImportFrom(self, _node: ast.ImportFrom) -> None:
        return None

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        called = {ast.Div: "_quotient", ast.Pow: "_power"}.get(type(node.op))
        if called is None:
            return node
        return ast.copy_location(ast.Call(ast.Name(called, ast.Load()), [node.left, node.right], []), node)


def _as_it_is(function: Callable[..., Any]) -> Callable[..., Any]:
    return function


def _entry(_types: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    return _as_it_is


def _with_views(entry: Callable[..., None], path: str, lines: list[str]) -> Callable[..., None]:
    """An entry that goes through its arrays as views; what a law does wrong is a ProgramError about its file."""

    def called(*given: Any) -> None:
        views: Any = (memoryview(item) if hasattr(item, "shape") else item for item in given)
        try:
            entry(*views)
        except (AttributeError, IndexError, NameError, TypeError) as error:
            numbers = [at.lineno for at in traceback.extract_tb(error.__traceback__) if at.filename == path]
            place = place_in(lines, numbers[-1] or 0) if numbers else None
            if place is None:
                raise
            raise refusal(place.file, place.line, str(error)) from error

    return called


def empty_rows(rows: int, lanes: int) -> memoryview:
    """Return the working array of a block."""
    made: Any = np.empty((rows, lanes))
    return memoryview(made)


def quotient(over: float, under: float) -> float:
    """Return a quotient as processors have it: infinite, or no number, where it is by zero."""
    if under != 0.0:
        return over / under
    if over == 0.0 or math.isnan(over):
        return math.nan
    return math.copysign(math.inf, over) * math.copysign(1.0, under)


def whole_part(value: float) -> int:
    """Return a number without its fraction; the lowest integer for what has none or is beyond all of them."""
    return int(value) if -(2.0**63) <= value < 2.0**63 else -(2**63)


def _power(base: float, exponent: float) -> float:
    return float(MATH.pow(base, exponent))


def _going_on(function: Callable[..., float]) -> Callable[..., float]:
    """A function of ``math`` that is infinite where it overflows, and no number where it has no value."""

    def called(*given: float) -> float:
        try:
            return function(*given)
        except OverflowError:
            return math.inf
        except ValueError:
            return math.nan

    return called


def _logarithm(value: float) -> float:
    return math.log(value) if value > 0.0 else (-math.inf if value == 0.0 else math.nan)


def _root(value: float) -> float:
    return math.nan if value < 0.0 else math.sqrt(value)


MATH = SimpleNamespace(
    **{name: _going_on(value) if callable(value) else value for name, value in vars(math).items() if name[0] != "_"}
    | {"sqrt": _root, "log": _logarithm}
)
"""The module ``math``, with what compiled code gives where Python raises."""
