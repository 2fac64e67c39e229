"""Functions that Python applies to columns of runs, as functions of one run, which is what the subset has.

What prepares and judges runs takes settings by their names as text, and numbers that may be columns of
``model.columns``. For one run a name is a field, no number is a column, and a function over runs is called as it is.
"""

import ast
from types import FunctionType
from typing import Any

import numpy as np

from ppafo.engine.source_text import SourceCollector
from ppafo.model.columns import over_runs


def one_run_collector(decorator: str) -> SourceCollector:
    """A collector that also takes functions that Python applies to columns."""
    return SourceCollector(decorator, for_one_run)


def for_one_run(function: FunctionType, tree: ast.FunctionDef) -> ast.FunctionDef:
    """The definition of a function for one run."""
    tree = _ForOneRun(function.__globals__).visit(tree)
    return ast.fix_missing_locations(tree)


class _ForOneRun(ast.NodeTransformer):
    """Rewrites one definition; ``scope`` has the names that it sees."""

    def __init__(self, scope: dict[str, Any]) -> None:
        self.scope = scope

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        """``settings["delay"]`` is a field."""
        self.generic_visit(node)
        name = self.value_of(node.slice)
        return ast.copy_location(ast.Attribute(node.value, name, node.ctx), node) if isinstance(name, str) else node

    def visit_Call(self, node: ast.Call) -> ast.expr:
        """A function over runs is called for this one."""
        self.generic_visit(node)
        if self.value_of(node.func) is not over_runs:
            return node
        return ast.copy_location(ast.Call(node.args[0], node.args[1:], node.keywords), node)

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        """What is done for a column is left away."""
        self.generic_visit(node)
        return node.orelse if self.asks_for_column(node.test) else node

    def visit_If(self, node: ast.If) -> ast.stmt | list[ast.stmt]:
        """What is done for a column is left away."""
        self.generic_visit(node)
        return node.orelse if self.asks_for_column(node.test) else node

    def asks_for_column(self, node: ast.expr) -> bool:
        """True for a test of whether numbers are columns."""
        if isinstance(node, ast.BoolOp):
            return isinstance(node.op, ast.Or) and all(map(self.asks_for_column, node.values))
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name) or node.func.id != "isinstance":
            return False
        return self.value_of(node.args[1]) is np.ndarray

    def value_of(self, node: ast.expr) -> Any:
        """What a name, an attribute of one or a text stands for; None for anything else."""
        if isinstance(node, ast.Constant):
            return node.value
        if isinstance(node, ast.Name):
            return self.scope.get(node.id)
        return getattr(self.value_of(node.value), node.attr, None) if isinstance(node, ast.Attribute) else None
