"""Composition of a function body for the compiled module.

Names defined outside the function are replaced by their values: numbers, generated names, ``math``.
"""

import ast
import builtins
import functools
import inspect
import math
import types
from collections.abc import Callable, Iterable, Mapping
from types import FunctionType
from typing import Any, TypeVar

import numpy as np

from ppafo.engine.plain_python import refusal
from ppafo.engine.rows import is_row
from ppafo.errors import ProgramError
from ppafo.model.binding import frame_of, is_made_of, made_of, parts_of
from ppafo.wording import nearest_name

COMPILED_BUILTINS = frozenset(
    {"abs", "bool", "divmod", "enumerate", "float", "int", "len", "max", "min", "pow", "range", "round", "sum", "zip"}
)
Row = TypeVar("Row", bound=tuple[Any, ...])
_AT_RUN_TIME = object()
"""Placeholder for a value that is known only while the function runs."""
_REMEDIES = {"print": "; remove it: with PPAFO_BACKEND=python a debugger stops in the function"}
"""Remedies for built-in functions that cannot be compiled."""


def each(convert: Callable[[float], float], row: Row) -> Row:
    """Return a NamedTuple with ``convert`` applied to every number (float to int, or back), nested ones included.

    In compiled code the call is expanded number by number, according to the declared class.
    """
    make: Any = type(row)
    made_row: Row = make(*(each(convert, value) if isinstance(value, tuple) else convert(value) for value in row))
    return made_row


def is_step_function(function: object) -> bool:
    """Return whether the first parameter of a function is ``parts``, the components of the device."""
    return isinstance(function, FunctionType) and function.__code__.co_varnames[:1] == ("parts",)


class Composer(ast.NodeTransformer):
    """Rewriter of the body of one function; ``add_inside`` adds what the function uses to the module.

    ``local`` are its names, ``known`` the values of some names, and ``rows`` classes of rows by name. By default they
    are those of a function of the model, in which ``parts`` are a known value if they are bound to it.

    ``rows_to_receive`` are rows that called functions need and for which this function has no parameter, so that its
    callers have to pass them.
    """

    def __init__(
        self,
        function: FunctionType,
        module: Any,  # a ``SourceCollector``
        add_inside: Callable[[FunctionType, Any], str],
        local: Iterable[str] | None = None,
        known: Mapping[str, Any] | None = None,
        rows: Mapping[str, Any] | None = None,
    ) -> None:
        self.function = function
        self.module = module
        self.add_inside = add_inside
        names = function.__code__.co_varnames
        self.local = frozenset(names if local is None else local)
        self.parameters = frozenset(_parameters(function)) if local is None else self.local
        self.rows = rows or {}
        if known is None:
            parts = parts_of(function)
            known = {} if parts is None else {"parts": parts}
        self.known = known
        self.kinds: dict[str, Any] = {**function.__annotations__, **self.rows}
        self.rows_to_receive: set[str] = set()

    def add(self, item: Any) -> str:
        """Add a function or NamedTuple class that this function uses; return its name in the module."""
        return self.add_inside(self.function, item)

    def refuse(self, where: ast.AST, problem: str) -> ProgramError:
        """Return the error for a node of the function."""
        return refusal(self.function.__code__.co_filename, where, problem)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.stmt:
        """Remove the annotation."""
        if node.value is None:
            return ast.copy_location(ast.Pass(), node)
        return ast.copy_location(ast.Assign([node.target], self.visit(node.value)), node)

    def visit_Assign(self, node: ast.Assign) -> ast.stmt:
        """Record the NamedTuple class of each assigned name, so that ``name._replace`` can be expanded."""
        kind = self.kind_of(node.value)
        target = node.targets[0]
        parts = getattr(kind, "__args__", ())
        named = zip(target.elts, parts, strict=False) if isinstance(target, ast.Tuple) else ((target, kind),)
        for item, value in named:
            if isinstance(item, ast.Name) and item.id not in self.rows:
                # A name that stands for two kinds stands for none: nothing may then be written out for it.
                self.kinds[item.id] = value if self.kinds.get(item.id, value) is value else None
        return ast.copy_location(ast.Assign(node.targets, self.visit(node.value)), node)

    def visit_Expr(self, node: ast.Expr) -> ast.stmt:
        """Remove a docstring or other constant statement."""
        if isinstance(node.value, ast.Constant):
            return ast.copy_location(ast.Pass(), node)
        return ast.copy_location(ast.Expr(self.visit(node.value)), node)

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        """Refuse a power with a literal operand, because its last bits differ between compilers and Python."""
        left = self.visit(node.left)
        right = self.visit(node.right)
        # With a sign or without.
        unsigned = (side.operand if isinstance(side, ast.UnaryOp) else side for side in (left, right))
        if isinstance(node.op, ast.Pow) and any(isinstance(side, ast.Constant) for side in unsigned):
            times = {"2": 2, "2.0": 2, "3": 3, "3.0": 3}.get(ast.unparse(right), 0)
            product = (
                f"write '{' * '.join([ast.unparse(node.left)] * times)}'"
                if times
                else "pass base and exponent as parameters"
            )
            raise self.refuse(node, f"'{ast.unparse(node)}' cannot be compiled; {product}")
        return ast.copy_location(ast.BinOp(left, node.op, right), node)

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """Replace a name defined outside the function."""
        value = self.value_of(node)
        return node if value is _AT_RUN_TIME else self.passed_value(value, node)

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        """Replace ``module.name``. ProgramError if the value cannot be compiled."""
        value = self.value_of(node)
        if value is not _AT_RUN_TIME:
            return self.passed_value(value, node)
        owner = self.value_of(node.value)
        if owner is not _AT_RUN_TIME and not isinstance(owner, tuple):
            raise self.refuse(
                node, f"'{ast.unparse(node)}' is an attribute of a {type(owner).__name__}, which cannot be compiled"
            )
        row = self.module.constructed(self.row_of(node.value))
        if row is not None and node.attr not in row._fields:
            hint = nearest_name(node.attr, row._fields)
            raise self.refuse(node, f"{ast.unparse(node.value)} has no '{node.attr}'{hint}")
        return ast.Attribute(self.visit(node.value), node.attr, node.ctx)

    def visit_Call(self, node: ast.Call) -> ast.expr:
        """Check the arguments of a call; default values of a NamedTuple are inserted.

        Raises ProgramError if the arguments do not match.
        """
        called = self.value_of(node.func)
        if called is each and len(node.args) > 1:
            return self.each_number(node.args[0], node.args[1])
        if called is _AT_RUN_TIME:
            if isinstance(node.func, ast.Attribute) and node.func.attr == "_replace":
                return self.replaced(node, node.func.value)
            if isinstance(node.func, ast.Attribute):
                raise self.refuse(
                    node, f"'{ast.unparse(node.func)}()' is a method, which cannot be compiled; call a plain function"
                )
            self.generic_visit(node)
            return node
        called, node = self.with_parts(called, node)
        function = self.composed_value(called, node.func)
        arguments = [*self.rows_for(function, node), *(self.visit(argument) for argument in node.args)]
        if is_row(called) or (isinstance(called, FunctionType) and not is_step_function(called)):
            return ast.Call(function, [*arguments, *self.further_arguments(called, node)], [])
        return ast.Call(function, arguments, [ast.keyword(one.arg, self.visit(one.value)) for one in node.keywords])

    def with_parts(self, called: Any, node: ast.Call) -> tuple[Any, ast.Call]:
        """Return a function called with ``parts=`` as a function bound to these parts, and the call without ``parts``.

        Raises ProgramError if the parts are not known before the function runs.
        """
        given = next((keyword for keyword in node.keywords if keyword.arg == "parts"), None)
        if given is None or not isinstance(called, FunctionType):
            return called, node
        parts = self.value_of(given.value)
        if not is_made_of(parts):
            raise self.refuse(node, f"'parts={ast.unparse(given.value)}' must be 'parts', or an attribute of it")
        others = [keyword for keyword in node.keywords if keyword is not given]
        # An argument handed on as a phase gave it is the same in the whole program.
        frame = frame_of(self.function)
        is_own = frame is None or frame.__name__ == self.function.__name__
        is_same = is_own and parts is parts_of(self.function)
        name = called.__name__ if is_same else f"{called.__name__}_of_{self.function.__name__}"
        return made_of(called, name, parts), ast.copy_location(ast.Call(node.func, node.args, others), node)

    def rows_for(self, function: ast.expr, node: ast.AST) -> list[ast.expr]:
        """Rows of effects that are passed first to a function of the module. ProgramError if a local name hides one."""
        rows = self.module.handed_to(function.id) if isinstance(function, ast.Name) else ()
        for row in rows:
            if row in self.local - self.parameters:
                raise self.refuse(node, f"the local name '{row}' hides the parameters of the effect '{row}'; rename it")
        self.rows_to_receive.update(row for row in rows if row not in self.parameters)
        return [ast.Name(row, ast.Load()) for row in rows]

    def passed_value(self, value: Any, node: ast.expr) -> ast.expr:
        """Text of a value that is passed but not called. ProgramError for a function that needs rows of effects."""
        composed = self.composed_value(value, node)
        if isinstance(composed, ast.Name) and self.module.handed_to(composed.id):
            raise self.refuse(
                node, f"'{ast.unparse(node)}' contains an active effect, so it cannot be passed as a value; call it"
            )
        return composed

    def further_arguments(self, called: Any, node: ast.Call) -> list[ast.expr]:
        """Arguments of a function or fields of a NamedTuple after the positional ones, named or by default.

        Raises ProgramError if the arguments do not match.
        """
        if any(isinstance(argument, ast.Starred) for argument in node.args):
            return []  # how many there are is known only to the compiler, which refuses them
        takes: tuple[str, ...] = called._fields if is_row(called) else _parameters(called)
        if len(node.args) == len(takes) and not node.keywords:
            return []
        named = {keyword.arg: keyword.value for keyword in node.keywords if keyword.arg is not None}
        try:
            inspect.signature(called).bind(*node.args, **named)
        except TypeError as error:
            unknown = next((name for name in named if name not in takes), None)
            problem = f"has no '{unknown}'{nearest_name(unknown, takes)}" if unknown else str(error)
            raise self.refuse(node, f"{called.__name__}({', '.join(takes)}): {problem}") from error
        signature = inspect.signature(called).parameters
        # The values with which Python calls the function: the text of a default may mean something else by now.
        return [
            self.visit(named[name]) if name in named else self.literal(signature[name].default, node, "a default")
            for name in takes[len(node.args) :]
        ]

    def kind_of(self, node: ast.expr) -> Any:
        """Declared type of a value, from annotations of functions and fields; None if undeclared."""
        if isinstance(node, ast.Attribute) and (owner := self.row_of(node.value)) is not None:
            return owner.__annotations__.get(node.attr)
        if isinstance(node, ast.Call):
            called = self.value_of(node.func)
            if called is each or (isinstance(node.func, ast.Attribute) and node.func.attr == "_replace"):
                return self.kind_of(node.func.value if isinstance(node.func, ast.Attribute) else node.args[1])
            return getattr(called, "__annotations__", {}).get("return") if not is_row(called) else called
        if isinstance(node, ast.Name) and node.id not in self.local:
            return type(self.value_of(node))
        return self.kinds.get(node.id) if isinstance(node, ast.Name) else None

    def row_of(self, node: ast.expr) -> Any:
        """Declared NamedTuple class of a value, looked up by its present name; None if the type is not a NamedTuple."""
        kind = self.kind_of(node)
        row = self.function.__globals__.get(kind if isinstance(kind, str) else getattr(kind, "__name__", ""), kind)
        return row if is_row(row) else None

    def fields_of(self, node: ast.expr) -> tuple[Any, list[ast.Attribute]]:
        """Class of a row, and an expression for each field. ProgramError if the class is not declared."""
        row = self.module.constructed(self.row_of(node))
        owner = node
        while isinstance(owner, ast.Attribute):
            owner = owner.value
        if row is None or not isinstance(owner, ast.Name):
            raise self.refuse(
                node,
                f"'{ast.unparse(node)}' must be a name that is annotated with its NamedTuple class, or a field of one",
            )
        return row, [ast.copy_location(ast.Attribute(node, name, ast.Load()), node) for name in row._fields]

    def replaced(self, node: ast.Call, changed: ast.expr) -> ast.expr:
        """Expand ``row._replace(field=...)`` to a construction of the row. ProgramError if the field does not exist."""
        row, fields = self.fields_of(changed)
        given = {keyword.arg: keyword.value for keyword in node.keywords if keyword.arg is not None}
        unknown = sorted(given.keys() - set(row._fields))
        if unknown or node.args:
            hint = nearest_name(unknown[0], row._fields) if unknown else ""
            problem = f"has no '{unknown[0]}'{hint}" if unknown else "'_replace' takes fields by name"
            raise self.refuse(node, f"{row.__name__}({', '.join(row._fields)}): {problem}")
        values = [self.visit(given.get(field_read.attr, field_read)) for field_read in fields]
        return ast.Call(ast.Name(self.add(row), ast.Load()), values, [])

    def each_number(self, convert: ast.expr, node: ast.expr) -> ast.expr:
        """Expand ``each(convert, row)`` to a construction of the row, number by number."""
        row, fields = self.fields_of(node)
        values = [
            self.each_number(convert, field_read)
            if is_row(row.__annotations__[field_read.attr])
            else ast.Call(self.visit(convert), [self.visit(field_read)], [])
            for field_read in fields
        ]
        return ast.Call(ast.Name(self.add(row), ast.Load()), values, [])

    def value_of(self, node: ast.expr) -> Any:
        """Present value of a name or ``module.name`` outside the function. ProgramError if there is none."""
        if isinstance(node, ast.Name) and node.id in self.known:
            return self.known[node.id]
        if isinstance(node, ast.Name) and node.id not in self.local:
            scope = self.function.__globals__
            if node.id in scope:
                self.module.note_read(scope, node.id, scope[node.id])
                return scope[node.id]
            if node.id in COMPILED_BUILTINS:
                return getattr(builtins, node.id)
            if hasattr(builtins, node.id):
                raise self.refuse(node, f"'{node.id}' cannot be compiled{_REMEDIES.get(node.id, '')}")
            hint = nearest_name(node.id, [*self.local, *scope, *COMPILED_BUILTINS])
            remedy = "; import math" if node.id == "math" else ""
            raise self.refuse(node, f"the name '{node.id}' is not defined{hint}{remedy}")
        if not isinstance(node, ast.Attribute):
            return _AT_RUN_TIME
        owner = self.value_of(node.value)
        if not isinstance(owner, types.ModuleType):
            is_known = is_made_of(owner) or owner is parts_of(self.function)
            return getattr(owner, node.attr, _AT_RUN_TIME) if is_known else _AT_RUN_TIME
        if not hasattr(owner, node.attr):
            raise self.refuse(
                node, f"module '{owner.__name__}' has no '{node.attr}'{nearest_name(node.attr, dir(owner))}"
            )
        value = getattr(owner, node.attr)
        self.module.note_read(vars(owner), node.attr, value)
        return value

    def composed_value(self, value: Any, node: ast.expr) -> ast.expr:
        """Text of a value from outside the function. ProgramError if the value cannot be compiled.

        A function with a cache (``functools.lru_cache``) is replaced by the function without the cache.
        """
        value = value.__wrapped__ if isinstance(value, functools._lru_cache_wrapper) else value
        # ``inf`` and ``nan`` of math are written by name, as they are in most sources.
        if isinstance(node, ast.Attribute) and self.value_of(node.value) is math:
            return self.global_name("math", node.attr, node)
        own = str(getattr(value, "__name__", ""))
        if isinstance(value, types.BuiltinFunctionType) and getattr(math, own, None) is value:
            return self.global_name("math", own, node)
        if own in COMPILED_BUILTINS and getattr(builtins, own) is value:
            return self.global_name("", own, node)
        if isinstance(value, FunctionType) or is_row(value):
            return self.global_name("", self.add(value), node)
        name = ast.unparse(node)
        if getattr(value, "__module__", "") == "numpy" or own.startswith("numpy"):
            raise self.refuse(
                node, f"'{name}' is from numpy, which cannot be compiled; use 'math' for functions of one number"
            )
        return self.literal(value, node, f"'{name}'")

    def global_name(self, module: str, name: str, node: ast.expr) -> ast.expr:
        """Name of the generated module. ProgramError if a local name hides this name."""
        first = module or name
        if first in self.local:
            raise self.refuse(node, f"the local name '{first}' hides '{ast.unparse(node)}'; give it another name")
        if not module:
            return ast.Name(name, ast.Load())
        return ast.Attribute(ast.Name(module, ast.Load()), name, ast.Load())

    def literal(self, value: Any, where: ast.AST, name: str) -> ast.expr:
        """Exact literal of a constant: a number, or a tuple or NamedTuple of numbers. ProgramError otherwise."""
        if type(value) in (float, np.float64):
            # A minus sign of its own: -0.0 and the sign of NaN survive, which repr would lose in some languages.
            size: ast.expr = ast.Constant(abs(float(value)))
            return ast.UnaryOp(ast.USub(), size) if math.copysign(1.0, value) < 0.0 else size
        if type(value) is int and value < 0:
            return ast.UnaryOp(ast.USub(), ast.Constant(-value))
        if type(value) in (bool, int):
            return ast.Constant(value)
        if type(value) is tuple or value == ():  # a row without numbers is no struct
            return ast.Tuple([self.literal(inner, where, name) for inner in value], ast.Load())
        if is_row(type(value)):
            fields = [self.literal(inner, where, name) for inner in value]
            return ast.Call(ast.Name(self.add(type(value)), ast.Load()), fields, [])
        if isinstance(value, FunctionType):
            return ast.Name(self.add(value), ast.Load())
        raise self.refuse(
            where,
            f"cannot compile {self.function.__qualname__}: {name} must be a number, a tuple of numbers, a plain "
            f"function, a NamedTuple or the module 'math'",
        )


def _parameters(function: FunctionType) -> tuple[str, ...]:
    """Names of the parameters of a function in the module, in which no bound ``parts`` are left."""
    code = function.__code__
    names = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
    return names if parts_of(function) is None else tuple(name for name in names if name != "parts")
