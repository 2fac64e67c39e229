"""Functions of the model over whole columns: their composed text, with NumPy's operations in the place of Python's.

A column has the numbers of all samples of a run. Each operation is one of whole columns, in the same order, so that
every number has the bits that the function itself gives; a choice works out both of its values. What has no such form,
a loop whose end depends on a number or a power, is called sample by sample.
"""

import ast
import operator
from collections import namedtuple
from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any

import numpy as np

from ppafo.engine.plain_python import parse_module
from ppafo.engine.rows import leaves, rebuilt
from ppafo.engine.source_text import COMPILED_BUILTINS, SourceCollector
from ppafo.errors import ProgramError
from ppafo.model.declaration import PlainFunction


def over_samples(function: PlainFunction, *arguments: Any) -> Any:
    """Value of a function of the model, in its own units, of rows and numbers any of which may be columns (samples,).

    What is the same for all samples may stay one number.
    """
    # A form that was made from a function that has changed since is made anew.
    composed = _composed(function)
    if composed is not None and not composed[0].made_from.is_current():
        _composed.cache_clear()
        composed = _composed(function)
    return called_over_samples(function, (None if composed is None else composed[1]), *arguments)


def called_over_samples(function: PlainFunction, of_columns: PlainFunction | None, *arguments: Any) -> Any:
    """Value of a function over samples whose form for columns is known; None where it has none."""
    if of_columns is not None:
        # A choice works out what no sample takes, too.
        with np.errstate(all="ignore"):
            return of_columns(*arguments)
    # Sample by sample.
    flat = [leaves(argument) if isinstance(argument, tuple) else [argument] for argument in arguments]
    columns = [value for row in flat for value in row if isinstance(value, np.ndarray)]
    if not columns:
        return function(*arguments)
    results = []
    for sample in range(columns[0].size):
        numbers = [[value[sample] if isinstance(value, np.ndarray) else value for value in row] for row in flat]
        parts = (
            rebuilt(type(argument), map(float, row)) if isinstance(argument, tuple) else float(row[0])
            for argument, row in zip(arguments, numbers, strict=True)
        )
        results.append(function(*parts))
    return _gathered(results)


@lru_cache(maxsize=64)
def _composed(function: PlainFunction) -> tuple[SourceCollector, PlainFunction | None] | None:
    collector = SourceCollector("")
    try:
        name = collector.add(function)
    except ProgramError:
        return None
    return collector, in_columns(collector.text(), name)


def in_columns(text: str, name: str) -> PlainFunction | None:
    """A function of a composed text for columns; None where it has no such form."""
    try:
        tree = _Columns().visit(parse_module(text))
    except ProgramError:
        return None
    scope: dict[str, Any] = {"namedtuple": namedtuple, **_OPERATIONS}
    exec(compile(ast.fix_missing_locations(tree), "<columns>", "exec"), scope)
    function: PlainFunction = scope[name]
    return function


def _gathered(results: list[Any]) -> Any:
    first = results[0]
    if not isinstance(first, tuple):
        return np.array(results, dtype=np.float64)
    parts = [_gathered([result[index] for result in results]) for index in range(len(first))]
    return type(first)(*parts) if hasattr(first, "_fields") else tuple(parts)


def _chosen(test: Any, yes: Callable[[], Any], no: Callable[[], Any]) -> Any:
    if isinstance(test, np.ndarray):
        return _where(test, yes(), no())
    return yes() if test else no()


def _where(test: Any, yes: Any, no: Any) -> Any:
    if not isinstance(test, np.ndarray):
        return yes if test else no
    if isinstance(yes, tuple):
        parts = [_where(test, one, other) for one, other in zip(yes, no, strict=True)]
        return type(yes)(*parts) if hasattr(yes, "_fields") else tuple(parts)
    return np.where(test, yes, no)


def _extreme(is_beyond: Callable[[Any, Any], Any], first: Any, *others: Any) -> Any:
    """The largest or smallest as Python has it: of equal numbers the first, also of 0 and -0."""
    for other in others:
        # A strict comparison, as Python's max has it; np.maximum would take 0.0 over -0.0, and spread NaN.
        first = _where(is_beyond(other, first), other, first)
    return first


def _without_fraction(number: Any) -> Any:
    # Python has no whole number -0.
    return np.trunc(number) + 0.0 if isinstance(number, np.ndarray) else int(number)


def _as_float(number: Any) -> Any:
    return number.astype(np.float64) if isinstance(number, np.ndarray) else float(number)


_OPERATIONS: dict[str, Callable[..., Any]] = {  # of one number, of two, or of any
    "_chosen": _chosen,
    "_all": np.logical_and,
    "_any": np.logical_or,
    "_not": np.logical_not,
    "_quotient": np.divide,
    "_root": np.sqrt,
    "max": partial(_extreme, operator.gt),
    "min": partial(_extreme, operator.lt),
    "int": _without_fraction,
    "float": _as_float,
}
_SAME_IN_COLUMNS = frozenset({"abs", "range", *_OPERATIONS})


def _is_elementwise(node: ast.AST) -> bool:
    if isinstance(node, ast.BinOp):
        return isinstance(node.op, ast.Add | ast.Sub | ast.Mult | ast.Div)
    if isinstance(node, ast.Compare):
        return len(node.ops) == 1
    if isinstance(node, ast.For) and isinstance(node.iter, ast.Call):
        return all(isinstance(argument, ast.Constant) for argument in node.iter.args)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        return node.func.id not in COMPILED_BUILTINS - _SAME_IN_COLUMNS
    # NumPy's other functions differ from ``math`` in the last bits.
    return not isinstance(node, ast.Call) or ast.unparse(node.func) == "math.sqrt"


def _call(name: str, *arguments: ast.expr) -> ast.expr:
    return ast.Call(ast.Name(name, ast.Load()), list(arguments), [])


def _later(value: ast.expr) -> ast.Lambda:
    return ast.Lambda(ast.arguments([], [], None, [], [], None, []), value)


class _Columns(ast.NodeTransformer):
    """Writes the operations of a composed text for columns."""

    def visit(self, node: ast.AST) -> Any:
        """Write a node. ProgramError for what has no such form."""
        if isinstance(node, ast.If | ast.While | ast.Starred | ast.AugAssign) or not _is_elementwise(node):
            raise ProgramError(f"'{ast.unparse(node)}' has no form for columns")
        return super().visit(node)

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        test, yes, no = (self.visit(part) for part in (node.test, node.body, node.orelse))
        return _call("_chosen", test, _later(yes), _later(no))

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.AST:
        # Both sides are computed: columns have no short circuit.
        name = "_all" if isinstance(node.op, ast.And) else "_any"
        joined: ast.expr
        joined, *others = (self.visit(part) for part in node.values)
        for other in others:
            joined = _call(name, joined, other)
        return joined

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.AST:
        inner = self.visit(node.operand)
        return _call("_not", inner) if isinstance(node.op, ast.Not) else ast.UnaryOp(node.op, inner)

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        left, right = self.visit(node.left), self.visit(node.right)
        # np.divide gives inf over 0 where Python's quotient raises, as compiled code does.
        return _call("_quotient", left, right) if isinstance(node.op, ast.Div) else ast.BinOp(left, node.op, right)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        if isinstance(node.func, ast.Attribute):
            return _call("_root", *map(self.visit, node.args))
        return self.generic_visit(node)
