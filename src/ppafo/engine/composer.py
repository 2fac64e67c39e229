"""Body of a function as the compiled module has it.

Names from outside the function are replaced by what they stand for: numbers, generated names, ``math``.
"""

import ast
import builtins
import functools
import inspect
import math
import types
from collections.abc import Callable, Mapping
from dataclasses import dataclass
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
_INSIDE = object()
"""Stands for a value that is known only while the function runs."""
_INSTEAD = {"print": "; take it out: under PPAFO_BACKEND=python a debugger stops in the function"}
"""Remedies for functions of Python."""


def each(convert: Callable[[float], float], row: Row) -> Row:
    """A row with each of its numbers, those of nested rows too, converted: whole numbers from floats, and back.

    The engine writes it out number by number, by the class that the row is declared to be.
    """
    make: Any = type(row)
    made_row: Row = make(*(each(convert, value) if isinstance(value, tuple) else convert(value) for value in row))
    return made_row


def is_step_function(function: object) -> bool:
    """True for a function of the step: its first parameter is ``parts``, what the device is made of."""
    return isinstance(function, FunctionType) and function.__code__.co_varnames[:1] == ("parts",)


@dataclass(frozen=True, slots=True)
class RewrittenNames:
    """Names of a function that was written anew: all that it has, values that some stand for, classes of rows."""

    local: frozenset[str]
    kept: Mapping[str, Any]
    rows: Mapping[str, Any]


class Composer(ast.NodeTransformer):
    """Rewrites the body of one function; ``add`` adds another to the module, ``note`` keeps what was looked up.

    ``rows_of`` says which rows of effects a function that was added needs: each call hands them over before its own
    arguments. ``needed`` has those that this function must be handed in its turn, because it has no such parameter.
    ``stands_for`` says which class a declared row has in this module, ``names`` what a function has that was written
    anew.
    """

    def __init__(
        self,
        function: types.FunctionType,
        add: Callable[[Any], str],
        note: Callable[[Mapping[str, Any], str, Any], None],
        rows_of: Callable[[str], tuple[str, ...]] = lambda _name: (),
        stands_for: Callable[[Any], Any] = lambda row: row,
        names: RewrittenNames | None = None,
    ) -> None:
        self.function = function
        self.add = add
        self.note = note
        self.rows_of = rows_of
        self.stands_for = stands_for
        self.local = frozenset(function.__code__.co_varnames) if names is None else names.local
        self.kept: Mapping[str, Any] = {} if names is None else names.kept
        self.rows: Mapping[str, Any] = {} if names is None else names.rows
        self.kinds: dict[str, Any] = {**function.__annotations__, **self.rows}
        self.given = frozenset(_parameters(function.__code__)) if names is None else names.local
        self.needed: set[str] = set()

    def refuse(self, where: ast.AST, problem: str) -> ProgramError:
        """The error for a place in the function."""
        return refusal(self.function.__code__.co_filename, where, problem)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.stmt:
        """Leave the annotation away."""
        if node.value is None:
            return ast.copy_location(ast.Pass(), node)
        return ast.copy_location(ast.Assign([node.target], self.visit(node.value)), node)

    def visit_Assign(self, node: ast.Assign) -> ast.stmt:
        """Remember which NamedTuple each name stands for, so that ``name._replace`` can be written out."""
        kind, target = self.kind_of(node.value), node.targets[0]
        parts = getattr(kind, "__args__", ())
        named = zip(target.elts, parts, strict=False) if isinstance(target, ast.Tuple) else ((target, kind),)
        for item, value in named:
            if isinstance(item, ast.Name) and item.id not in self.rows:
                # A name that stands for two kinds stands for none: nothing may then be written out for it.
                self.kinds[item.id] = value if self.kinds.get(item.id, value) is value else None
        return ast.copy_location(ast.Assign(node.targets, self.visit(node.value)), node)

    def visit_Expr(self, node: ast.Expr) -> ast.stmt:
        """Leave a text that stands alone away."""
        if isinstance(node.value, ast.Constant):
            return ast.copy_location(ast.Pass(), node)
        return ast.copy_location(ast.Expr(self.visit(node.value)), node)

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        """Refuse a power with a number that is written out: compilers and Python differ in its last bits."""
        left, right = self.visit(node.left), self.visit(node.right)
        # With a sign or without.
        unsigned = (side.operand if isinstance(side, ast.UnaryOp) else side for side in (left, right))
        if isinstance(node.op, ast.Pow) and any(isinstance(side, ast.Constant) for side in unsigned):
            times = {"2": 2, "2.0": 2, "3": 3, "3.0": 3}.get(ast.unparse(right), 0)
            product = f"write '{' * '.join([ast.unparse(node.left)] * times)}'" if times else "make both parameters"
            raise self.refuse(node, f"'{ast.unparse(node)}' cannot be compiled; {product}")
        return ast.copy_location(ast.BinOp(left, node.op, right), node)

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """Replace a name from outside."""
        value = self.value_of(node)
        return node if value is _INSIDE else self.handed_over(value, node)

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        """Replace ``module.name``. ProgramError where it cannot be compiled."""
        value = self.value_of(node)
        if value is not _INSIDE:
            return self.handed_over(value, node)
        owner = self.value_of(node.value)
        if owner is not _INSIDE and not isinstance(owner, tuple):
            raise self.refuse(node, f"'{ast.unparse(node)}' is of a {type(owner).__name__}, which cannot be compiled")
        row = self.stands_for(self.row_of(node.value))
        if row is not None and node.attr not in row._fields:
            hint = nearest_name(node.attr, row._fields)
            raise self.refuse(node, f"{ast.unparse(node.value)} has no '{node.attr}'{hint}")
        return ast.Attribute(self.visit(node.value), node.attr, node.ctx)

    def visit_Call(self, node: ast.Call) -> ast.expr:
        """Check the arguments of what is called; those that a NamedTuple has of its own are written out.

        ProgramError where one does not fit.
        """
        called = self.value_of(node.func)
        if called is each and len(node.args) > 1:
            return self.each_number(node.args[0], node.args[1])
        if called is _INSIDE:
            if isinstance(node.func, ast.Attribute) and node.func.attr == "_replace":
                return self.replaced(node, node.func.value)
            if isinstance(node.func, ast.Attribute):
                raise self.refuse(node, f"'{ast.unparse(node.func)}()' is a method, which is not compiled")
            self.generic_visit(node)
            return node
        called, node = self.with_parts(called, node)
        own: list[ast.expr] = []
        if isinstance(called, types.FunctionType) or is_row(called):
            own = self.own_arguments(called, node)
        function = self.stand_in(called, node.func)
        arguments = [*self.rows_for(function, node), *(self.visit(argument) for argument in node.args)]
        if not own:
            named = [ast.keyword(keyword.arg, self.visit(keyword.value)) for keyword in node.keywords]
            return ast.Call(function, arguments, named)
        return ast.Call(function, [*arguments, *own], [])

    def with_parts(self, called: Any, node: ast.Call) -> tuple[Any, ast.Call]:
        """A function that is called with ``parts=``, as the function with these parts, and the call without them.

        ProgramError where they are not known before the function runs.
        """
        given = next((keyword for keyword in node.keywords if keyword.arg == "parts"), None)
        if given is None or not isinstance(called, FunctionType):
            return called, node
        parts = self.value_of(given.value)
        if not is_made_of(parts):
            raise self.refuse(node, f"'parts={ast.unparse(given.value)}' must be parts of this function")
        others = [keyword for keyword in node.keywords if keyword is not given]
        # What a function hands on as it was given by a phase is the same for all of a program.
        frame = frame_of(self.function)
        is_own = frame is None or frame.function.__name__ == self.function.__name__
        is_same = is_own and parts is parts_of(self.function)
        name = called.__name__ if is_same else f"{called.__name__}_of_{self.function.__name__}"
        return made_of(called, name, parts), ast.copy_location(ast.Call(node.func, node.args, others), node)

    def rows_for(self, function: ast.expr, node: ast.AST) -> list[ast.expr]:
        """Rows of effects that a function of the module is handed first. ProgramError where a local name hides one."""
        rows = self.rows_of(function.id) if isinstance(function, ast.Name) else ()
        for row in rows:
            if row in self.local - self.given:
                raise self.refuse(node, f"the local name '{row}' hides the parameters of the effect '{row}'; rename it")
        self.needed.update(row for row in rows if row not in self.given)
        return [ast.Name(row, ast.Load()) for row in rows]

    def handed_over(self, value: Any, node: ast.expr) -> ast.expr:
        """Text of a value that is passed and not called. ProgramError for a function that needs rows of effects."""
        stand_in = self.stand_in(value, node)
        if isinstance(stand_in, ast.Name) and self.rows_of(stand_in.id):
            raise self.refuse(node, f"an effect acts inside '{ast.unparse(node)}', so that it can only be called")
        return stand_in

    def own_arguments(self, called: Any, node: ast.Call) -> list[ast.expr]:
        """Fields of a NamedTuple after those given by place, where some have the defaults of its class; else none.

        ProgramError where they do not fit.
        """
        if is_step_function(called) or any(isinstance(argument, ast.Starred) for argument in node.args):
            return []  # its groups are handed over by name; how many there are is known only to the compiler
        is_function = isinstance(called, types.FunctionType)
        takes: tuple[str, ...] = _parameters(called.__code__) if is_function else called._fields
        if len(node.args) == len(takes) and not node.keywords and not (is_function and called.__kwdefaults__):
            return []
        named = {keyword.arg: keyword.value for keyword in node.keywords if keyword.arg is not None}
        try:
            inspect.signature(called).bind(*node.args, **named)
        except TypeError as error:
            unknown = next((name for name in named if name not in takes), None)
            problem = f"has no '{unknown}'{nearest_name(unknown, takes)}" if unknown else str(error)
            raise self.refuse(node, f"{called.__name__}({', '.join(takes)}): {problem}") from error
        if is_function or len(node.args) + len(named) == len(takes):
            return []
        return [
            self.visit(named[name]) if name in named else self.literal(called._field_defaults[name], node, name)
            for name in takes[len(node.args) :]
        ]

    def kind_of(self, node: ast.expr) -> Any:
        """Declared type of a value, by the annotations of functions and fields; None if undeclared."""
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
        """The NamedTuple class that a value is declared to be, as its name stands now; None where it is none."""
        kind = self.kind_of(node)
        row = self.function.__globals__.get(kind if isinstance(kind, str) else getattr(kind, "__name__", ""), kind)
        return row if is_row(row) else None

    def fields_of(self, node: ast.expr) -> tuple[Any, list[ast.Attribute]]:
        """The class of a row and an expression for each of its fields. ProgramError where the class is not declared."""
        row, owner = self.stands_for(self.row_of(node)), node
        while isinstance(owner, ast.Attribute):
            owner = owner.value
        if row is None or not isinstance(owner, ast.Name):
            raise self.refuse(
                node,
                f"'{ast.unparse(node)}' must be a name that is annotated with its NamedTuple class, or a field of one",
            )
        return row, [ast.copy_location(ast.Attribute(node, name, ast.Load()), node) for name in row._fields]

    def replaced(self, node: ast.Call, changed: ast.expr) -> ast.expr:
        """``row._replace(field=...)`` as the row that it makes. ProgramError where there is no such field."""
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
        """``each(convert, row)`` as the row that it makes, number by number."""
        row, fields = self.fields_of(node)
        values = [
            self.each_number(convert, field_read)
            if is_row(row.__annotations__[field_read.attr])
            else ast.Call(self.visit(convert), [self.visit(field_read)], [])
            for field_read in fields
        ]
        return ast.Call(ast.Name(self.add(row), ast.Load()), values, [])

    def value_of(self, node: ast.expr) -> Any:
        """Present value of a name or ``module.name`` outside the function. ProgramError if it has none."""
        if isinstance(node, ast.Name) and node.id in self.kept:
            return self.kept[node.id]
        if isinstance(node, ast.Name) and node.id not in self.local:
            scope = self.function.__globals__
            if node.id in scope:
                self.note(scope, node.id, scope[node.id])
                return scope[node.id]
            if node.id in COMPILED_BUILTINS:
                return getattr(builtins, node.id)
            if hasattr(builtins, node.id):
                raise self.refuse(node, f"'{node.id}' cannot be compiled{_INSTEAD.get(node.id, '')}")
            hint = nearest_name(node.id, [*self.local, *scope, *COMPILED_BUILTINS])
            remedy = "; import math" if node.id == "math" else ""
            raise self.refuse(node, f"there is no '{node.id}'{hint}{remedy}")
        if not isinstance(node, ast.Attribute):
            return _INSIDE
        owner = self.value_of(node.value)
        if not isinstance(owner, types.ModuleType):
            is_known = is_made_of(owner) or owner is parts_of(self.function)
            return getattr(owner, node.attr, _INSIDE) if is_known else _INSIDE
        if not hasattr(owner, node.attr):
            hint = nearest_name(node.attr, dir(owner))
            raise self.refuse(node, f"module '{owner.__name__}' has no '{node.attr}'{hint}")
        value = getattr(owner, node.attr)
        self.note(vars(owner), node.attr, value)
        return value

    def stand_in(self, value: Any, node: ast.expr) -> ast.expr:
        """Text of a value from outside the function. ProgramError if it cannot be compiled.

        A function that remembers its results (``functools.lru_cache``) is what it remembers.
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
        if isinstance(value, types.FunctionType) or is_row(value):
            return self.global_name("", self.add(value), node)
        name = ast.unparse(node)
        if getattr(value, "__module__", "") == "numpy" or own.startswith("numpy"):
            raise self.refuse(
                node, f"'{name}' is from numpy, which cannot be compiled here; use 'math' for functions of one number"
            )
        return self.literal(value, node, f"'{name}'")

    def global_name(self, module: str, name: str, node: ast.expr) -> ast.expr:
        """A name of the generated module, which no local name may hide. ProgramError where a local name hides it."""
        first = module or name
        if first in self.local:
            raise self.refuse(node, f"the local name '{first}' hides '{ast.unparse(node)}'; give it another name")
        if not module:
            return ast.Name(name, ast.Load())
        return ast.Attribute(ast.Name(module, ast.Load()), name, ast.Load())

    def literal(self, value: Any, where: ast.AST, name: str) -> ast.expr:
        """A constant, to the last bit: a number, or a tuple or NamedTuple of them. ProgramError for anything else."""
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
        if isinstance(value, types.FunctionType):
            return ast.Name(self.add(value), ast.Load())
        raise self.refuse(
            where,
            f"cannot compile {self.function.__qualname__}: {name} is not a number, a tuple of numbers, a plain "
            f"function, a NamedTuple or the module math",
        )


def _parameters(code: types.CodeType) -> tuple[str, ...]:
    """Names of the parameters of a function."""
    return code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
