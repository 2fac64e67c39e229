"""Collects pure functions, with all they call, into the text of one stand-alone compiled module.

The text holds everything that decides the machine code, so its hash names the module: a second start finds the
compiled code on disk, and a change anywhere in the physics gives another name and is compiled anew. What would run
otherwise than in Python is refused, in terms of the file that it was written in.

Names from outside a function are replaced by what they stand for (``Composer``): numbers, generated names, ``math``.
"""

import ast
import builtins
import functools
import inspect
import math
import re
import textwrap
import types
from collections.abc import Callable, Iterable, Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from types import CodeType, FunctionType, ModuleType
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from ppafo.engine.entries import ORIGIN, without_origins
from ppafo.engine.plain_python import check_flow, check_grammar, parse_module, place, refusal
from ppafo.engine.rows import is_row
from ppafo.errors import ProgramError
from ppafo.model.binding import frame_of, is_made_of, made_of, parts_of
from ppafo.model.declaration import PlainFunction
from ppafo.wording import nearest_name, one_line

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
        if isinstance(node.op, ast.Pow) and any(map(_is_written_out, (left, right))):
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


def _is_written_out(node: ast.expr) -> bool:
    """True for a number in a text, with a sign or without."""
    return isinstance(node.operand if isinstance(node, ast.UnaryOp) else node, ast.Constant)


def _parameters(code: types.CodeType) -> tuple[str, ...]:
    """Names of the parameters of a function."""
    return code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]


class Read(NamedTuple):
    """A name that was looked up while composing, and what it stood for."""

    scope: Mapping[str, Any]
    name: str
    value: Any


class Made(NamedTuple):
    """A function as it was when it was composed."""

    function: Any
    code: CodeType
    defaults: tuple[Any, ...] | None
    named_defaults: dict[str, Any]


def emitted_name(item: Any) -> str:
    """Name that a function or NamedTuple class gets in the generated module: its module path and its own name."""
    module = item.__module__ or ""
    path = module.removeprefix("ppafo.") if module.startswith("ppafo.") else f"foreign.{module}"
    return re.sub(r"\W", "_", f"{path}_{item.__qualname__}")


def composed_lines(lines: Iterable[str], needs: Mapping[str, tuple[str, ...]]) -> list[str]:
    """Lines of the text around a module, in which calls hand over the rows of effects that functions need."""
    if not needs:
        return list(lines)
    calls = re.compile(rf"\b({'|'.join(map(re.escape, needs))})\(")
    return [calls.sub(lambda call: f"{call[0]}{', '.join(needs[call[1]])}, ", line) for line in lines]


@dataclass(slots=True)
class MadeFrom:
    """Names that were read and functions that were composed for a text, by which it stays current or not."""

    reads: list[Read] = field(default_factory=list)
    functions: list[Made] = field(default_factory=list)

    def is_current(self) -> bool:
        """True while every name stands for what it stood for, and every function is what it was."""
        return all(read.scope.get(read.name, read) is read.value for read in self.reads) and all(
            made.function.__code__ is made.code
            and made.function.__defaults__ is made.defaults
            and (made.function.__kwdefaults__ or {}) == made.named_defaults
            for made in self.functions
        )


Adaptation = Callable[[FunctionType, ast.FunctionDef], ast.FunctionDef]
"""Makes a definition one of the part of Python that is compiled; it is handed a copy of its own."""


@dataclass(slots=True)
class SourceCollector:
    """Gathers definitions in the order in which they must stand; ``adapt`` may write a definition in another way.

    Where a function is among ``links``, the one that it is linked to is added and called in its place; a link under a
    pair holds inside the first of it. The ``effects`` are laws with the rows that they ask for: whoever calls one is
    handed these rows in its turn, and so on up to the text around the module (``needs``, ``composed_lines``).
    """

    decorator: str
    adapt: Adaptation | None = None
    definitions: dict[str, str] = field(default_factory=dict)
    owners: dict[str, Any] = field(default_factory=dict)
    made_from: MadeFrom = field(default_factory=MadeFrom)
    links: dict[Any, Any] = field(default_factory=dict)
    effects: dict[Any, tuple[str, ...]] = field(default_factory=dict)
    needs: dict[str, tuple[str, ...]] = field(default_factory=dict)

    def add(self, function: PlainFunction | type) -> str:
        """Add a function or NamedTuple class and all that it needs; return the name it has in the module."""
        return self._add(self.links.get(function, function))

    def _add(self, item: Any) -> str:
        """Add the function or NamedTuple class itself, not what it is linked to. ProgramError where it cannot be."""
        if not is_row(item):
            check_is_plain(item)
        name = emitted_name(item)
        owner = self.owners.setdefault(name, item)
        if owner is item and name in self.definitions:
            return name
        text = _row_text(item, name) if isinstance(item, type) else self._function_text(item, name)
        if owner is item:
            self.definitions[name] = text
        # A second thing of the same name is refused unless it is the same text, as after a module was loaded anew.
        elif without_origins(text) != without_origins(self.definitions.get(name, "")):
            raise ProgramError(
                f"{place_of(item)}: '{item.__module__}.{item.__qualname__}' and "
                f"'{owner.__module__}.{owner.__qualname__}' at {place_of(owner)} both get the name '{name}' in the "
                f"compiled model; give one of them another name"
            )
        return name

    def text(self) -> str:
        """All definitions, callees first."""
        return "\n\n\n".join(self.definitions.values())

    def note_read(self, scope: Mapping[str, Any], name: str, value: Any) -> None:
        """Keep that a name was looked up while composing, and what it stood for."""
        self.made_from.reads.append(Read(scope, name, value))

    def stands_for(self, row: Any) -> Any:
        """The class that a declared row has in this module."""
        return self.links.get((row, "_replace"), row)

    def define(self, name: str, item: Any, text: str) -> None:
        """Add a text that was written elsewhere for a function."""
        self.owners[name], self.definitions[name] = item, text

    def decorated(self, tree: ast.FunctionDef, file: str) -> str:
        """The text of a function that is composed, with the lines of its file."""
        lines = " ".join(map(str, [tree.lineno, *_line_numbers(tree.body), (tree.end_lineno or tree.lineno) + 1]))
        return f"{ORIGIN} {one_line(file)}: {lines}\n{self.decorator}\n{ast.unparse(tree)}"

    def _function_text(self, function: FunctionType, name: str) -> str:
        """The text of a function under its name in the module; all that it calls is added before.

        ProgramError where something in it cannot be compiled, or where it calls itself.
        """
        tree = parse_definition(function, self.adapt)
        self._note_function(function, tree)
        composer = Composer(
            function,
            lambda called: self.add_inside(function, called),
            self.note_read,
            lambda callee: self.needs.get(callee, ()),
            self.stands_for,
        )
        parts = parts_of(function)
        composer.kept = {} if parts is None else {"parts": parts}
        tree.args.kwonlyargs = [argument for argument in tree.args.kwonlyargs if argument.arg not in composer.kept]
        rows = self.effects.get(function, ())
        _compose_parameters(composer, tree, rows)
        body = tree.body[1:] if ast.get_docstring(tree) is not None else tree.body
        tree.name, tree.returns = name, None
        tree.body = [composer.visit(statement) for statement in body]
        # Rows that what it calls needs, and that it has no parameter for, are handed to it in its turn.
        handed = sorted(composer.needed)
        parameters = [*map(ast.arg, handed), *tree.args.args]
        if rows or handed:
            self.needs[name] = (*handed, *(argument.arg for argument in parameters if argument.arg in rows))
        tree.args.args = parameters
        return self.decorated(tree, function.__code__.co_filename)

    def _note_function(self, function: FunctionType, tree: ast.FunctionDef) -> None:
        """Keep a function as it is now, before its body is read, so that one met again inside it calls itself."""
        if any(known.function is function for known in self.made_from.functions):
            problem = f"'{function.__name__}' calls itself, which cannot be compiled"
            raise refusal(function.__code__.co_filename, tree, problem)
        self.made_from.functions.append(
            Made(
                function=function,
                code=function.__code__,
                defaults=function.__defaults__,
                named_defaults=dict(function.__kwdefaults__ or {}),
            )
        )

    def add_inside(self, function: Any, called: Any) -> str:
        """Add what a function calls; a law of an effect that calls its own port gets what was there before it."""
        if (function, called) in self.links:
            return self._add(self.links[function, called])
        if called in self.effects and isinstance(called, FunctionType):
            raise ProgramError(
                f"{place_of(function)}: '{called.__name__}' is the law of an effect: call its port instead"
            )
        return self.add(called)


def _compose_parameters(composer: Composer, tree: ast.FunctionDef, rows: tuple[str, ...]) -> None:
    """Write the parameters of a function as the module has them: without annotations, ``rows`` of effects first."""
    function, arguments = composer.function, tree.args
    if rows:
        # In every function, so that callers can hand them over without knowing the rest.
        arguments.args = sorted(arguments.args, key=lambda argument: argument.arg not in rows)
    for argument in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs):
        argument.annotation = None
    # What Python calls the function with, whatever the text of the default stands for by now.
    arguments.defaults = [composer.literal(value, tree, "a default") for value in function.__defaults__ or ()]
    named = function.__kwdefaults__ or {}
    arguments.kw_defaults = [
        composer.literal(named[argument.arg], tree, "a default") if argument.arg in named else None
        for argument in arguments.kwonlyargs
    ]


def check_is_plain(function: Any) -> None:
    """Refuse what is no plain function: its source text would not be what Python runs. ProgramError says why."""
    name = getattr(function, "__qualname__", None) or repr(function)
    if type(function) is not FunctionType:
        if not callable(function):
            raise ProgramError(f"cannot compile {name}: it is not a function")
        if type(function).__module__ == "builtins" and type(function).__name__ == "builtin_function_or_method":
            raise ProgramError(f"cannot compile {name}: its source text is not available")
        raise ProgramError(f"cannot compile {name}: it must be a plain function defined with 'def'")
    if hasattr(function, "__wrapped__"):
        raise ProgramError(
            f"{place_of(function)}: '{name}' is wrapped by a decorator, which cannot be compiled; remove it"
        )
    if function.__closure__:
        # A closure's value may change without a change of the function, and no text would show it.
        names = ", ".join(f"'{name}'" for name in function.__code__.co_freevars)
        raise ProgramError(
            f"{place_of(function)}: '{name}' uses {names} of the function around it, which cannot be compiled; "
            "make it a parameter"
        )


def place_of(item: Any) -> str:
    """File and line of a function, the module of anything else."""
    code = getattr(item, "__code__", None)
    return f"module {item.__module__}" if code is None else place(code.co_filename, code.co_firstlineno)


def parse_definition(function: FunctionType, adapt: Adaptation | None = None) -> ast.FunctionDef:
    """The definition of a plain function with the lines of its file; refused where it is not what Python runs.

    ProgramError where the definition cannot be read or is not what Python runs.
    """
    code = function.__code__
    file, name = code.co_filename, function.__qualname__
    try:
        text = textwrap.dedent(inspect.getsource(function))
    except (OSError, TypeError) as error:
        reason = f"its source text is not available ({error})"
        raise ProgramError(f"cannot compile {name}: {reason}") from error
    try:
        tree = parse_module("\n" * (code.co_firstlineno - 1) + text).body[0]
    except SyntaxError as error:
        raise refusal(file, code.co_firstlineno, f"the source text of '{name}' cannot be read alone") from error
    if not isinstance(tree, ast.FunctionDef) or tree.name != code.co_name:
        raise refusal(file, code.co_firstlineno, f"'{name}' must be a plain function defined with 'def'")
    if tree.decorator_list:
        raise refusal(file, tree, f"'{name}' is decorated, which cannot be compiled; remove the decorator")
    # A copy, since the tree is compared with what Python runs below.
    adapted = tree if adapt is None else adapt(function, deepcopy(tree))
    check_grammar(adapted, file)
    if _shape(code) not in (_shape(other) for other in _code_of(tree, function)):
        changed = "is not what its source text says; the file has changed since it was loaded: start again"
        raise refusal(file, tree, f"'{name}' {changed}")
    check_flow(adapted, file, code.co_varnames)
    return adapted


def _code_of(tree: ast.FunctionDef, function: FunctionType) -> Iterator[CodeType]:
    """The code that Python makes of a definition: it calls what is in a module otherwise where it sees the import."""
    names = function.__code__.co_names
    modules = [name for name in names if isinstance(function.__globals__.get(name), ModuleType)]
    imports = [parse_module(f"import {name}").body[0] for name in modules]
    # Python compiles a call through a module name otherwise where it has seen the import.
    for before in (imports, []):
        module = compile(ast.Module([*before, tree], []), "<source>", "exec", dont_inherit=True)
        yield next(
            constant
            for constant in module.co_consts
            if isinstance(constant, CodeType) and constant.co_name == tree.name
        )


def _shape(code: CodeType) -> tuple[Any, ...]:
    """Instructions of a code object, without line numbers and docstring."""
    # Texts are left out: a docstring may have changed without a change of what runs.
    constants = [(type(constant), repr(constant)) for constant in code.co_consts if not isinstance(constant, str)]
    return code.co_code, code.co_names, code.co_varnames, code.co_argcount, code.co_kwonlyargcount, constants


def _row_text(row: Any, name: str) -> str:
    """The NamedTuple class without what numbers have no use for; refused where that would change what it does."""
    own = vars(row)
    others = [base for base in row.__bases__[1:] if base is not Generic]
    if row.__bases__[0] is not tuple or others:
        raise ProgramError(
            f"{row.__module__}.{row.__qualname__} must be a NamedTuple itself, not a class made from one"
        )
    meanings = {name for name, value in own.items() if name.startswith("__") and isinstance(value, FunctionType)}
    meanings -= set(vars(Read)) | {"__str__", "__format__"}
    if meanings:
        names = ", ".join(sorted(meanings))
        raise ProgramError(
            f"{row.__module__}.{row.__qualname__} gives {names} a meaning of its own, which cannot be compiled"
        )
    return f"{name} = namedtuple({name!r}, {list(row._fields)!r})"


def _line_numbers(body: list[ast.stmt]) -> Iterator[int]:
    """Line in its file of each line that ``ast.unparse`` writes for some statements."""
    for statement in body:
        yield statement.lineno
        if isinstance(statement, ast.If | ast.For | ast.While):
            yield from _line_numbers(statement.body)
            otherwise = statement.orelse
            is_elif = isinstance(statement, ast.If) and len(otherwise) == 1 and isinstance(otherwise[0], ast.If)
            if otherwise and not is_elif:
                yield otherwise[0].lineno
            yield from _line_numbers(otherwise)
