"""A composed text as Python runs it, with what compiled code gives where Python would raise.

Tests need no compiler then: the package itself runs functions, not their text (``ppafo/engine/interpreter.py``). Arrays
are handed over as memory views, whose elements are Python's own numbers.
"""

import ast
import linecache
import traceback
from collections import namedtuple
from collections.abc import Callable
from functools import lru_cache
from types import ModuleType
from typing import Any

import numpy as np

from ppafo.engine.entries import entry_types
from ppafo.engine.in_python import MATH, quotient, whole_part
from ppafo.engine.loading import compiled
from ppafo.engine.plain_python import parse_module, place_in, refusal
from ppafo.model.declaration import PlainFunction


def load_source(source: str) -> ModuleType:
    """The module of a composed text: compiled, or where no compiler works as Python runs it."""
    return compiled(source) or interpreted(source)


def power(base: float, exponent: float) -> float:
    """A power as the C library has it: NaN for a root of a negative number, where Python's is complex."""
    return float(MATH.pow(base, exponent))


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
    scope |= {"_quotient": quotient, "_power": power, "int": whole_part}
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


def _as_it_is(function: PlainFunction) -> PlainFunction:
    return function


def _entry(_types: str) -> Callable[[PlainFunction], PlainFunction]:
    return _as_it_is


def _with_views(entry: Callable[..., None], path: str, lines: list[str]) -> Callable[..., None]:
    """An entry that goes through its arrays as views; what a law does wrong is a ProgramError about its file."""

    def called(*arguments: Any) -> None:
        views: Any = (memoryview(argument) if hasattr(argument, "shape") else argument for argument in arguments)
        try:
            entry(*views)
        except (AttributeError, IndexError, NameError, TypeError) as error:
            numbers = [at.lineno for at in traceback.extract_tb(error.__traceback__) if at.filename == path]
            origin = place_in(lines, numbers[-1] or 0) if numbers else None
            if origin is None:
                raise
            raise refusal(origin.file, origin.line, str(error)) from error

    return called


def empty_rows(rows: int, lanes: int) -> memoryview:
    """Return the working array of a block, rows by lanes, whose numbers are not set."""
    made: Any = np.empty((rows, lanes))
    return memoryview(made)
