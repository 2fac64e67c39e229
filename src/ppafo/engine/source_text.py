"""Collects pure functions, with all they call, into the text of one stand-alone compiled module.

The text holds everything that decides the machine code, so its hash names the module: a second start finds the
compiled code on disk, and a change anywhere in the physics gives another name and is compiled anew.
"""

import ast
import builtins
import inspect
import textwrap
import types
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ppafo.errors import SimulationError

ALLOWED_MODULES = ("math",)


def is_row(candidate: object) -> bool:
    """True for a NamedTuple class."""
    return isinstance(candidate, type) and issubclass(candidate, tuple) and hasattr(candidate, "_fields")


def emitted_name(item: Any) -> str:
    """Name that a function or NamedTuple class gets in the generated module: its module path and its own name."""
    path = item.__module__.removeprefix("ppafo.").replace(".", "_")
    return f"{path}_{item.__qualname__}"


@dataclass(slots=True)
class SourceCollector:
    """Gathers definitions in the order in which they must stand."""

    decorator: str
    definitions: dict[str, str] = field(default_factory=dict)

    def add(self, item: Callable[..., Any] | type) -> str:
        """Add a function or NamedTuple class and all that it needs; return the name it has in the module."""
        name = emitted_name(item)
        if name in self.definitions:
            return name
        if isinstance(item, type):
            self.definitions[name] = self._row_text(item, name)
        else:
            text = self._function_text(item, name)
            self.definitions[name] = f"{self.decorator}\n{text}"
        return name

    def text(self) -> str:
        """All definitions, callees first."""
        return "\n\n\n".join(self.definitions.values())

    def _row_text(self, row: type, name: str) -> str:
        fields = row._fields  # type: ignore[attr-defined]
        return f"{name} = namedtuple({name!r}, {list(fields)!r})"

    def _function_text(self, function: Callable[..., Any], name: str) -> str:
        tree = _parsed(function)
        tree.name = name
        tree.returns = None
        tree.decorator_list = []
        for argument in tree.args.args:
            argument.annotation = None
        if ast.get_docstring(tree) is not None:
            tree.body = tree.body[1:]
        local = set(function.__code__.co_varnames)
        renamed = _Renamer(self, function, local).visit(tree)
        return ast.unparse(ast.fix_missing_locations(renamed))


def _parsed(function: Callable[..., Any]) -> ast.FunctionDef:
    try:
        text = textwrap.dedent(inspect.getsource(function))
    except (OSError, TypeError) as error:
        raise SimulationError(f"cannot compile {function!r}: its source text is not available ({error})") from error
    node = ast.parse(text).body[0]
    if not isinstance(node, ast.FunctionDef):
        raise SimulationError(f"cannot compile {function!r}: it must be a plain function defined with 'def'")
    return node


class _Renamer(ast.NodeTransformer):
    """Replaces every global name by a literal, a generated name or an allowed module."""

    def __init__(self, collector: SourceCollector, function: Callable[..., Any], local: set[str]) -> None:
        self.collector = collector
        self.function = function
        self.local = local

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if node.id in self.local:
            return node
        scope = self.function.__globals__
        if node.id not in scope:
            if hasattr(builtins, node.id):
                return node
            raise SimulationError(f"cannot compile {self.function.__qualname__}: it uses the unknown name '{node.id}'")
        value = scope[node.id]
        if isinstance(value, types.ModuleType) and value.__name__ in ALLOWED_MODULES:
            return node
        return self._stand_in(value, node.id, node.ctx)

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        """Replace ``module.name`` of a module of this package."""
        module = self.function.__globals__.get(node.value.id) if isinstance(node.value, ast.Name) else None
        is_global = isinstance(node.value, ast.Name) and node.value.id not in self.local
        if is_global and isinstance(module, types.ModuleType) and module.__name__ not in ALLOWED_MODULES:
            return self._stand_in(getattr(module, node.attr), f"{module.__name__}.{node.attr}", node.ctx)
        return ast.Attribute(self.visit(node.value), node.attr, node.ctx)

    def _stand_in(self, value: Any, name: str, context: ast.expr_context) -> ast.expr:
        if isinstance(value, bool | int | float):
            return ast.Constant(value)
        if isinstance(value, types.FunctionType) or is_row(value):
            return ast.Name(self.collector.add(value), context)
        raise SimulationError(
            f"cannot compile {self.function.__qualname__}: '{name}' is not a number, a plain function, "
            f"a NamedTuple or the module {' or '.join(ALLOWED_MODULES)}"
        )
