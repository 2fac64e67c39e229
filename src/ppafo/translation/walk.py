"""Type inference for a composed module: types of all names, and typed statements.

A function is analysed once for each combination of parameter types. A function passed as an argument counts as a type,
so that the call is bound at translation. Code outside the subset is refused with the file and line of its source.
"""

import ast
import linecache
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from itertools import chain
from typing import Any

from ppafo.engine.compilers import UntranslatableError
from ppafo.engine.entries import entry_types
from ppafo.engine.plain_python import parse_module, place_in, refusal, stored_names
from ppafo.errors import ProgramError
from ppafo.translation import typed
from ppafo.translation.expressions import Expressions, kind_of
from ppafo.translation.scopes import ScopeNames, needed
from ppafo.translation.typed import Function, Module, Parameter, Statement, Term, converted
from ppafo.translation.value_types import (
    BOOL,
    FLOAT,
    INT,
    Array,
    FunctionArgument,
    Items,
    Row,
    RowReference,
    Scalar,
    Type,
    declared_type,
    is_empty,
    joined,
    mixes,
    types_in,
)


def walk_module(
    source: str, entries: Mapping[str, tuple[Type, ...]] | None = None, library: frozenset[str] = frozenset()
) -> Module:
    """Infer types for the functions that the entries of a module need. Raises ProgramError outside the subset.

    ``entries`` maps function names to parameter types; by default the functions that declare their types in a
    decorator. ``library`` has the functions of ``LIBRARY`` that may be called.
    """
    if entries is None:
        entries = {name: tuple(map(declared_type, words)) for name, words in entry_types(source).items()}
    walk = _ModuleWalk(source.split("\n"), entries, library)
    for node in parse_module(source).body:
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call) and isinstance(node.targets[0], ast.Name):
            walk.rows[node.targets[0].id] = ast.literal_eval(node.value.args[1])
        elif isinstance(node, ast.FunctionDef):
            walk.definitions[node.name] = node
    for name in walk.definitions:
        if name in walk.entries:
            walk.function(name, walk.entries[name])
    return walk.module


@dataclass(slots=True)
class _ModuleWalk:
    lines: list[str]
    entries: Mapping[str, tuple[Type, ...]]
    library: frozenset[str]
    rows: dict[str, list[str]] = field(default_factory=dict)
    definitions: dict[str, ast.FunctionDef] = field(default_factory=dict)
    done: dict[tuple[str, tuple[Type, ...]], Function] = field(default_factory=dict)
    open: set[tuple[str, tuple[Type, ...]]] = field(default_factory=set)
    names: set[str] = field(default_factory=set)
    scope_names: dict[str, ScopeNames] = field(default_factory=dict)
    module: Module = field(default_factory=list)

    def function(self, name: str, types: tuple[Type, ...]) -> Function:
        """Return a function specialised for parameter types."""
        key = name, types
        if key not in self.done:
            definition = self.definitions[name]
            if key in self.open:
                raise self.refused(definition, f"'{name}' calls itself")
            self.open.add(key)
            # Each choice of types is a function of its own, since C has no overloading.
            number = 1
            unique_name = name
            while unique_name in self.names or (number > 1 and unique_name in {*self.definitions, *self.rows}):
                number += 1
                unique_name = f"{name}_{number}"
            # Reserved before the body is walked, in which the same function may be met for other types.
            self.names.add(unique_name)
            self.done[key] = _FunctionWalk(self, definition).walked(unique_name, types)
            self.module.append(self.done[key])
        return self.done[key]

    def refused(self, where: ast.AST, problem: str) -> ProgramError:
        """Return the error for untranslatable code, with file and line of the original source."""
        number = getattr(where, "lineno", 0)
        place = place_in(self.lines, number)
        problem = f"cannot be translated to C: {problem}"
        if place is None:
            return UntranslatableError(f"generated loop over runs, line {number}: {problem}")
        return UntranslatableError(str(refusal(place.file, place.line, problem)))

    def mistaken(self, where: ast.AST, problem: str, sought: str = "") -> ProgramError:
        """Return the error for invalid code, with file and line of the source that contains ``sought``.

        In the problem text, ``{written}`` is replaced by the source line and ``{name}`` by the function name in this
        line.
        """
        number = getattr(where, "lineno", 0)
        place = place_in(self.lines, number)
        if place is None:
            written = self.lines[number - 1].strip()
            return ProgramError(f"the model cannot be compiled: {_as_written(problem, written)}")
        lines = range(place.line, max(place.line + 1, place.next_line))
        line = next((at for at in lines if sought and sought in linecache.getline(place.file, at)), place.line)
        return refusal(place.file, line, _as_written(problem, linecache.getline(place.file, line).strip()))


def _as_written(problem: str, written: str) -> str:
    """Insert source line and function name into the text of a problem."""
    name = written.removeprefix("def ").partition("(")[0]
    return problem.replace("{written}", written).replace("{name}", name)


class _FunctionWalk:
    """Translation of a function for a combination of types, repeated while types of names widen."""

    def __init__(self, module: _ModuleWalk, definition: ast.FunctionDef) -> None:
        self.module = module
        self.refused = module.refused
        self.definition = definition
        self.types: dict[str, Type] = {}
        if definition.name not in module.scope_names:
            module.scope_names[definition.name] = ScopeNames.of(definition)
        names = module.scope_names[definition.name]
        self.names = names.every
        self.read = names.read
        self.parameters = {argument.arg for argument in definition.args.args}
        self.fresh_names: set[str] = set()
        self.values = Expressions(
            self.types,
            names.counters,
            module.rows,
            module.definitions,
            module.library,
            made=module.function,
            refused=module.refused,
            mistaken=module.mistaken,
        )
        self.returns: Type | None = None
        self.first_return: ast.Return | None = None
        self.has_widened = False
        self.flags = 0
        self.flag = ""
        self.writes: ast.AST | None = None

    def walked(self, name: str, types: tuple[Type, ...]) -> Function:
        """Return the translated function with typed statements."""
        names = [argument.arg for argument in self.definition.args.args]
        self.types.update(zip(names, types, strict=True))
        # A name that gets a wider type further down, as in a loop, has it from the beginning: the body is translated
        # again until no type changes, which ends because types only widen.
        self.has_widened = True
        while self.has_widened:
            self.has_widened = False
            self.flags = 0
            self.fresh_names.clear()
            body = self.block(self.definition.body)
        for parameter, kind in zip(names, types, strict=True):
            if self.types[parameter] != kind:
                problem = f"parameter '{parameter}' is assigned a value of another type; use a new name for that value"
                raise self.refused(self.definition, problem)
        if self.writes is not None and self.returns is not None:
            raise self.refused(
                self.writes,
                f"function '{self.definition.name}' both returns a value and writes into an array; do only one",
            )
        passed = tuple(Parameter(name, self.types[name]) for name in names if not is_empty(self.types[name]))
        bound = tuple(
            f"{name} is {kind.name}"
            for name, kind in zip(names, types, strict=True)
            if isinstance(kind, FunctionArgument)
        )
        is_entry = self.returns is None and self.module.entries.get(self.definition.name) == types
        return Function(name, self.definition.name, passed, self.returns, needed(body, frozenset())[0], bound, is_entry)

    def block(self, body: Sequence[ast.stmt]) -> tuple[Statement, ...]:
        """Return the typed statements of a block."""
        return tuple(chain.from_iterable(map(self.statement, body)))

    def statement(self, node: ast.stmt) -> list[Statement]:
        """Return the typed statements for a Python statement."""
        match node:
            case ast.Pass():
                return []
            case ast.Continue():
                return [typed.LoopExit("continue")]
            case ast.Break():
                marks = [self.assign(self.flag, Term("number", BOOL, (), True), node)] if self.flag else []
                return [*marks, typed.LoopExit("break")]
            case ast.If():
                test = self.values.condition(node.test)
                return [typed.If(test, self.block(node.body), self.block(node.orelse))]
            case ast.While():
                test = self.values.condition(node.test)
                return self.loop(node, lambda: typed.While(test, self.block(node.body)))
        handler: Callable[[Any], list[Statement]] | None = getattr(self, f"do_{type(node).__name__.lower()}", None)
        if handler is None:
            raise self.refused(node, f"the statement '{ast.unparse(node).splitlines()[0]}' is not supported")
        return handler(node)

    def do_expr(self, node: ast.Expr) -> list[Statement]:
        if isinstance(node.value, ast.Constant):
            return [typed.Note(node.value.value)] if isinstance(node.value.value, str) else []
        name = self.values.name_called(node.value) if isinstance(node.value, ast.Call) else ""
        if not isinstance(node.value, ast.Call) or name not in self.module.definitions:
            raise self.refused(node, f"the statement '{ast.unparse(node)}' is not supported")
        function, arguments = self.values.called(name, node.value)
        if function.returns is not None:
            raise self.refused(node, f"'{ast.unparse(node)}' discards its return value; assign it to a name")
        self.writes = node
        return [typed.ProcedureCall(function.name, arguments)]

    def do_return(self, node: ast.Return) -> list[Statement]:
        assert node.value is not None, "a function that returns nothing is refused where it is composed"
        value = self.values.term(node.value)
        kind = value.type if self.returns is None else joined(self.returns, value.type)
        if kind is None:
            kinds = sorted({kind_of(kind) for kind in (self.returns, value.type) if kind is not None})
            problem = f"the function must return one type, but it returns {' or '.join(kinds)}"
            raise self.module.mistaken(self.first_return or node, problem)
        if self.returns is not None and mixes(self.returns, value.type):
            raise self.refused(
                node, "the function returns both an integer and a float; convert the integer with float()"
            )
        self.has_widened |= self.returns is not None and kind != self.returns
        self.returns, self.first_return = kind, self.first_return or node
        return [typed.Return(converted(value, kind))]

    def do_for(self, node: ast.For) -> list[Statement]:
        if not isinstance(node.target, ast.Name):
            raise self.refused(node, f"the loop variable '{ast.unparse(node.target)}' must be a single name")
        call = node.iter
        name = node.target.id
        if not (isinstance(call, ast.Call) and ast.unparse(call.func) == "range"):
            return self.loop_over_items(name, node)
        bounds = [self.values.integer(bound) for bound in call.args]
        if not 1 <= len(bounds) <= 3 or call.keywords:
            raise self.refused(node, f"'{ast.unparse(call)}' must have 1 to 3 positional arguments")
        start, stop = (Term("number", INT, (), 0), bounds[0]) if len(bounds) == 1 else bounds[:2]
        step = self.values.literal(call.args[2]) if len(bounds) == 3 else 1
        if step == 0:
            raise self.refused(node, f"'{ast.unparse(call)}' has a step of 0")
        self.note_type(name, INT, node)
        before: list[Statement] = []
        if stop.reads & {name, *stored_names(node.body)}:
            # Python asks for the end of a range once.
            end = self.fresh(f"{name}_stop", INT)
            before = [self.assign(end, stop, node)]
            stop = Term("name", INT, (), end)
        return [*before, *self.loop(node, lambda: typed.CountedLoop(name, start, stop, step, self.block(node.body)))]

    def loop_over_items(self, name: str, node: ast.For) -> list[Statement]:
        """Translate a loop over a tuple or a slice of a tuple into a counted loop."""
        owner = self.values.term(node.iter.value if isinstance(node.iter, ast.Subscript) else node.iter)
        if not isinstance(owner.type, Items) or not owner.type.is_uniform:
            raise self.refused(node, f"'{ast.unparse(node.iter)}' must be a tuple with items of one type")
        if owner.reads & {name, *stored_names(node.body)}:
            raise self.refused(node, f"the loop assigns '{ast.unparse(node.iter)}' while it iterates over it")
        indices = range(len(owner.type.types))
        if isinstance(node.iter, ast.Subscript):
            indices = indices[self.values.literal_slice(node.iter.slice)]
        counter = self.fresh(f"{name}_place", INT)
        self.note_type(counter, INT, node)
        element = Term("item", owner.type.types[0], (owner, Term("name", INT, (), counter)))
        assignment = self.assign(name, element, node)
        start, stop = (Term("number", INT, (), bound) for bound in (indices.start, indices.stop))
        return self.loop(node, lambda: typed.CountedLoop(counter, start, stop, 1, (assignment, *self.block(node.body))))

    def loop(self, node: ast.For | ast.While, make: Callable[[], Statement]) -> list[Statement]:
        """Translate a loop; an ``else`` block becomes conditional on a flag that each ``break`` sets."""
        around = self.flag
        if not node.orelse:
            self.flag = ""
            made = [make()]
        else:
            self.flags += 1
            flag = self.flag = self.fresh(f"was_left_{self.flags}", BOOL)
            before = self.assign(flag, Term("number", BOOL, (), False), node)
            test = Term("not", BOOL, (Term("name", BOOL, (), flag),))
            made = [before, make()]
            self.flag = around
            made.append(typed.If(test, self.block(node.orelse), ()))
        self.flag = around
        return made

    def do_augassign(self, node: ast.AugAssign) -> list[Statement]:
        left = copy(node.target)
        left.ctx = ast.Load()
        value = ast.copy_location(ast.BinOp(left, node.op, node.value), node)
        return self.do_assign(ast.copy_location(ast.Assign([node.target], value), node))

    def do_assign(self, node: ast.Assign) -> list[Statement]:
        if len(node.targets) != 1:
            raise self.refused(node, "an assignment must have one target; write one assignment for each name")
        target = node.targets[0]
        right = node.value
        called = right.func if isinstance(right, ast.Call) else None
        if isinstance(target, ast.Name) and isinstance(called, ast.Name) and called.id == "empty_rows":
            # A local array, whose shape is a literal.
            assert isinstance(right, ast.Call)
            kind = Array(2, tuple(map(ast.literal_eval, right.args)))
            self.note_type(target.id, kind, right)
            return [typed.LocalArray(target.id, kind)]
        value = self.values.term(right)
        return (
            self.assign_items(target, value, node) if isinstance(target, ast.Tuple) else self.put(target, value, node)
        )

    def put(self, target: ast.expr, value: Term, node: ast.AST) -> list[Statement]:
        """Translate an assignment to a name, an array element or a field."""
        if isinstance(target, ast.Name):
            return [self.assign(target.id, value, node)]
        if isinstance(target, ast.Attribute):
            return [self.set_field(target, value)]
        element = self.values.term(target) if isinstance(target, ast.Subscript) else value
        if not isinstance(target, ast.Subscript) or element.kind != "element" or not isinstance(value.type, Scalar):
            raise self.refused(node, f"'{ast.unparse(target)}' cannot be assigned")
        owner = element.parts[0].type
        if isinstance(owner, Array) and not owner.shape:
            self.writes = node
        return [typed.Store(element, converted(value, FLOAT))]

    def set_field(self, target: ast.Attribute, value: Term) -> Statement:
        """Translate an assignment to a field of a row, as in text written for translation."""
        element = self.values.term(ast.copy_location(ast.Attribute(target.value, target.attr, ast.Load()), target))
        owner = element
        while owner.kind in ("field", "item"):
            owner = owner.parts[0]
        is_shared = isinstance(owner.type, RowReference)
        if owner.kind != "name" or element is owner or (owner.detail in self.parameters and not is_shared):
            raise self.refused(target, f"'{ast.unparse(target)}' cannot be assigned")
        if joined(element.type, value.type) != element.type:
            raise self.refused(target, f"'{ast.unparse(target)}' is assigned a value of another type")
        if is_shared:
            self.writes = target
        return typed.Store(element, converted(value, element.type))

    def assign(self, name: str, value: Term, node: ast.AST) -> Statement:
        """Translate an assignment to a name; the value is converted to the inferred type of the name."""
        self.note_type(name, value.type, node)
        return typed.Assign(name, converted(value, self.types[name]))

    def fresh(self, wanted: str, kind: Type) -> str:
        """Return an unused local name for values of a type."""
        while wanted in self.names or wanted in self.fresh_names or joined(self.types.get(wanted, kind), kind) is None:
            wanted += "_"
        self.fresh_names.add(wanted)
        return wanted

    def note_type(self, name: str, kind: Type, node: ast.AST) -> None:
        """Widen the inferred type of a name for a new value."""
        before = self.types.get(name, kind)
        joint = joined(before, kind)
        if joint is None:
            raise self.refused(node, f"'{name}' is assigned values of different types; use one name for each type")
        if mixes(before, kind):
            raise self.refused(
                node, f"'{name}' is assigned both an integer and a float; convert the integer with float()"
            )
        self.has_widened |= joint != before
        self.types[name] = joint

    def assign_items(self, target: ast.Tuple, value: Term, node: ast.Assign) -> list[Statement]:
        """Translate tuple unpacking; the right-hand side is evaluated before any target is assigned."""
        names = [name.id for name in target.elts if isinstance(name, ast.Name)]
        is_stored = len(names) < len(target.elts)
        kind = value.type
        if not isinstance(kind, Items | Row) or len(types_in(kind)) != len(target.elts):
            other = "" if isinstance(kind, Items | Row) else f", but the value is {kind_of(kind)}"
            raise self.module.mistaken(node, f"'{{written}}' must have as many values as names{other}")
        before: list[Statement] = []
        if value.kind != "build" or value.reads & set(names) or (is_stored and value.reads):
            name = self.fresh("_and_".join(name for name in names if name != "_") or "items", kind)
            before = [self.assign(name, value, node)]
            value = Term("name", self.types[name], (), name)
        return before + [
            statement
            for index, element in enumerate(target.elts)
            if not isinstance(element, ast.Name) or element.id in self.read
            for statement in self.put(element, typed.item_of(value, index), node)
        ]
