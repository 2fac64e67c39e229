"""Partial evaluation of a step function for one program: known parts are evaluated, groups become parameters.

Functions of ``engine.step`` differ from functions of the model in three ways. ``parts`` is known at composition, and so
is each name computed from known values only: such expressions are evaluated by Python, so that branches and loops over
them disappear. ``lane.GROUP`` becomes a parameter passed by the caller, like the rows of effects. A group set by the
function becomes a return value.
"""

import ast
import builtins
import sys
import types
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any, NamedTuple

from ppafo.engine.composer import is_step_function
from ppafo.engine.entries import rewritten
from ppafo.engine.plain_python import parse_module, refusal, stored_names
from ppafo.engine.rows import component_row, is_number, is_row, members, rebuilt, section_row
from ppafo.errors import ProgramError
from ppafo.model.binding import made_of

TRACE = "trace"
"""Name of the history of traced channels."""
HISTORIES = frozenset({"signal_history", "command_history", TRACE})
"""Arrays with a column per run; their last index is the index of the run."""
NUMBER = "lane_number"
"""Name of the run index in a composed function."""
_GROUP = "@"
"""Prefix of group names in a reduced function, until name conflicts are resolved."""
_UNKNOWN = object()
_STATEMENTS = (
    "a phase may assign names or 'lane' groups, call functions that do, branch with 'if', and loop over components"
)


class Slot(NamedTuple):
    """Element of a history that a function sets: all indices except the last, in terms of the function's parameters."""

    history: str
    places: tuple[ast.expr, ...]


Fields = frozenset[str] | None
"""Fields of a group that change; None for all fields."""


@dataclass(slots=True)
class Effects:
    """Groups that a function reads and groups and history elements that it sets, in order of occurrence.

    ``groups`` maps each group that is set to the fields that change, ``slots`` each history element to its indices.
    """

    reads: dict[str, None] = field(default_factory=dict)
    takes: tuple[str, ...] = ()
    """Own parameters that the function uses."""
    groups: dict[str, Fields] = field(default_factory=dict)
    slots: dict[str, Slot] = field(default_factory=dict)

    @property
    def results(self) -> list[str]:
        """Names of the returned values."""
        return [*self.groups, *self.slots]


_COMPREHENSIONS = ast.GeneratorExp | ast.ListComp | ast.SetComp | ast.DictComp


@dataclass(slots=True)
class Definition:
    """Syntax tree of a function, names read by its nodes, and compiled expressions."""

    tree: ast.FunctionDef
    names: dict[int, frozenset[str]] = field(default_factory=dict)
    codes: dict[int, CodeType] = field(default_factory=dict)

    def read_in(self, node: ast.AST) -> frozenset[str]:
        """Return the names that an expression reads, except names that it sets itself."""
        known = self.names.get(id(node))
        if known is None:
            if isinstance(node, ast.Name):
                known = frozenset({node.id})
            else:
                known = frozenset().union(*map(self.read_in, ast.iter_child_nodes(node)))
                if isinstance(node, _COMPREHENSIONS):
                    known -= {name.id for loop in node.generators for name in names_in(loop.target)}
            self.names[id(node)] = known
        return known

    def value(self, node: ast.expr, scope: dict[str, Any], known: dict[str, Any]) -> Any:
        """Return the value of an expression."""
        if id(node) not in self.codes:
            expression = ast.fix_missing_locations(ast.Expression(node))
            self.codes[id(node)] = compile(expression, "<parts>", "eval")
        # The text is that of a function which Python has loaded, with its own globals; no file, setting or argument
        # comes in as text. Before Python 3.12 a comprehension does not see local names: they become globals.
        return eval(self.codes[id(node)], {**scope, **known})


def names_in(node: ast.AST) -> list[ast.Name]:
    """Return every name in a tree, read or assigned."""
    return [inner for inner in ast.walk(node) if isinstance(inner, ast.Name)]


@lru_cache(maxsize=256)
def definition_of(function: FunctionType) -> Definition:
    """Return the definition of a function of the step. ProgramError if the source cannot be read."""
    file = sys.modules[function.__module__].__file__ if function.__module__ in sys.modules else None
    definition = _definitions(file or "").get(function.__code__.co_firstlineno)
    if definition is None:
        raise ProgramError(
            f"cannot compile {function.__qualname__}: its source text is not available; define it in a .py file"
        )
    return Definition(definition)


def group_of_name(node: ast.expr) -> str:
    """Return the group of a placeholder name in a reduced expression; empty for any other expression."""
    return node.id.removeprefix(_GROUP) if isinstance(node, ast.Name) and node.id.startswith(_GROUP) else ""


def uses_of_group(function: FunctionType, name: str) -> list[ast.Attribute]:
    """Return the reads of ``lane.NAME`` in a function of the step, in order."""
    nodes = [node for node in ast.walk(definition_of(function).tree) if isinstance(node, ast.Attribute)]
    found = [node for node in nodes if node.attr == name and isinstance(node.ctx, ast.Load)]
    return [node for node in found if isinstance(node.value, ast.Name) and node.value.id == "lane"]


@lru_cache(maxsize=64)
def _definitions(file: str) -> dict[int, ast.FunctionDef]:
    """Return the functions of a file by line number."""
    try:
        tree = parse_module(Path(file).read_text(encoding="utf-8"), file)
    except (OSError, SyntaxError):
        return {}
    return {statement.lineno: statement for statement in tree.body if isinstance(statement, ast.FunctionDef)}


class Reduction:
    """Reduction of one function for a ``StepText``, and for its ``parts`` or for others."""

    def __init__(self, module: Any, function: FunctionType, parts: Any = None) -> None:
        self.module = module
        self.function = function
        self.definition = definition_of(function)
        self.scope: dict[str, Any] = function.__globals__
        self.known: dict[str, Any] = {"parts": module.parts if parts is None else parts}
        # Local names whose values exist only while the function runs; those used in a generator are cell variables.
        self.run_time_names = {*function.__code__.co_varnames, *function.__code__.co_cellvars} - self.known.keys()
        stored = [name.id for name in names_in(self.definition.tree) if isinstance(name.ctx, ast.Store)]
        self.times_set = {name: stored.count(name) for name in stored}
        self.effects = Effects()
        self.groups_set: set[str] = set()
        self.parameters = [argument.arg for argument in self.definition.tree.args.args]
        self.spellings: dict[str, str] = {}

    def refuse(self, where: ast.AST, problem: str) -> ProgramError:
        """Return the error for a node of the function."""
        return refusal(self.function.__code__.co_filename, where, problem)

    def reduced(self) -> ast.FunctionDef:
        """Return the function with the groups that it reads as first parameters, without a return of groups."""
        tree = copy(self.definition.tree)
        tree.body = self.block(tree.body)
        groups = {*self.effects.reads, *self.effects.results}
        used = {name.id for line in tree.body for name in names_in(line)}
        parameters = [name for name in self.parameters if name != "lane" and name not in self.known and name in used]
        self.effects.takes = tuple(parameters)
        # A local name that is also the name of a group gets an underscore, and a group loses its prefix.
        respelt = {name: f"{name}_" for name in (stored_names(tree.body) | set(parameters)) & groups}
        for name in {name for line in tree.body for name in names_in(line)}:
            name.id = respelt.get(name.id, name.id.removeprefix(_GROUP))
        first = [NUMBER] if HISTORIES & self.effects.reads.keys() else []
        every = [*dict.fromkeys([*first, *self.effects.reads]), *(respelt.get(name, name) for name in parameters)]
        tree.args = ast.arguments([], [ast.arg(name) for name in every], None, [], [], None, [])
        return tree

    # Known names and values.

    def value_of(self, node: ast.expr) -> Any:
        """Return the value of an expression that depends on known names only, at least one; else ``_UNKNOWN``."""
        read = self.definition.read_in(node)
        if read & self.run_time_names or not read & self.known.keys():
            return _UNKNOWN
        self.note_reads(node)
        try:
            return self.definition.value(node, self.scope, self.known)
        except (NameError, AttributeError, TypeError) as error:
            raise self.refuse(node, f"'{ast.unparse(node)}': {error}") from error

    def outside_value(self, node: ast.expr) -> Any:
        """Return the value of an expression outside the function; ``_UNKNOWN`` if the value exists only inside."""
        value = self.value_of(node)
        if value is not _UNKNOWN:
            return value
        self.note_reads(node)
        if isinstance(node, ast.Name) and node.id not in self.run_time_names:
            return self.scope.get(node.id, getattr(builtins, node.id, _UNKNOWN))
        if isinstance(node, ast.Attribute):
            owner = self.outside_value(node.value)
            return getattr(owner, node.attr, _UNKNOWN) if isinstance(owner, types.ModuleType) else _UNKNOWN
        return _UNKNOWN

    def note_reads(self, node: ast.expr) -> None:
        """Record the outside names in an expression, including module attributes; the text depends on their values."""
        for inner in ast.walk(node):
            if isinstance(inner, ast.Name) and inner.id in self.scope and inner.id not in self.known:
                self.module.collector.note_read(self.scope, inner.id, self.scope[inner.id])
            if isinstance(inner, ast.Attribute) and isinstance(inner.value, ast.Name):
                owner = self.scope.get(inner.value.id)
                if isinstance(owner, types.ModuleType) and hasattr(owner, inner.attr):
                    self.module.collector.note_read(vars(owner), inner.attr, getattr(owner, inner.attr))

    def expression_of(self, value: Any) -> ast.expr:
        """Return an expression for a known value."""
        if value is None or type(value) in (bool, int, float):
            return ast.Constant(value)
        return self.placeholder(value)

    def placeholder(self, value: Any) -> ast.Name:
        """Return a placeholder name for a value."""
        name = f"kept_{id(value)}"
        self.module.placeholders[name] = value
        return ast.Name(name, ast.Load())

    # Expressions.

    def visit(self, node: ast.expr) -> ast.expr:
        """Return an expression with its known parts evaluated."""
        value = self.value_of(node)
        if value is not _UNKNOWN:
            return ast.copy_location(self.expression_of(value), node)
        handler: Callable[[Any], ast.expr] = getattr(
            self, f"of_{type(node).__name__.lower()}", self.with_reduced_operands
        )
        return ast.copy_location(handler(node), node)

    def with_reduced_operands(self, node: ast.expr) -> ast.expr:
        """Return an expression with reduced operands."""
        reduced = copy(node)
        for name, value in ast.iter_fields(node):
            if isinstance(value, ast.expr):
                setattr(reduced, name, self.visit(value))
            elif isinstance(value, list):
                setattr(reduced, name, [self.visit(item) if isinstance(item, ast.expr) else item for item in value])
        return reduced

    def condition(self, node: ast.expr) -> ast.expr:
        """Return a reduced condition, which is a constant if known."""
        value = self.value_of(node)
        return self.visit(node) if value is _UNKNOWN else ast.Constant(bool(value))

    def of_name(self, node: ast.Name) -> ast.expr:
        """Return a local name, renamed where the module requires it."""
        return ast.Name(self.spellings.get(node.id, node.id), node.ctx)

    def of_ifexp(self, node: ast.IfExp) -> ast.expr:
        """Return the selected side of a known conditional expression, else both sides reduced."""
        test = self.condition(node.test)
        if isinstance(test, ast.Constant):
            return self.visit(node.body if test.value else node.orelse)
        return ast.IfExp(test, self.visit(node.body), self.visit(node.orelse))

    def of_boolop(self, node: ast.BoolOp) -> ast.expr:
        """Return ``and`` or ``or`` with known operands evaluated."""
        deciding = isinstance(node.op, ast.Or)
        unknown = []
        for operand in map(self.condition, node.values):
            if not isinstance(operand, ast.Constant):
                unknown.append(operand)
            elif bool(operand.value) is deciding:
                # Operands before it have no effect but their value.
                return operand
        if not unknown:
            return ast.Constant(not deciding)
        return unknown[0] if len(unknown) == 1 else ast.BoolOp(node.op, unknown)

    def of_attribute(self, node: ast.Attribute) -> ast.expr:
        """Return a reduced attribute access: a group of numbers, or one field of a group."""
        name = self.group_path(node)
        return self.group_read(name) if name else self.with_reduced_operands(node)

    def of_subscript(self, node: ast.Subscript) -> ast.expr:
        """Return a group by its name, an element of a history, or an item."""
        path = self.group_path(node)
        if path:
            group, *fields = path.split(".")
            read: ast.expr = self.group_read(group)
            for name in fields:
                read = ast.Attribute(read, name, ast.Load())
            return read
        history = self.group_path(node.value)
        if isinstance(self.text_of(node.slice), str):
            # A setting by its path, which is an attribute until the text around the function has a name for it.
            return ast.Attribute(self.visit(node.value), self.text_of(node.slice), ast.Load())
        if history not in HISTORIES:
            return self.with_reduced_operands(node)
        indices = [*map(self.visit, _indices(node)), ast.Name(NUMBER, ast.Load())]
        return ast.Subscript(self.group_read(history), ast.Tuple(indices, ast.Load()), ast.Load())

    def group_path(self, node: ast.expr) -> str:
        """Return the group, or the path in a group, of ``lane.GROUP`` or ``lane["GROUP"]``; empty otherwise."""
        match node:
            case ast.Attribute(value=ast.Name(id="lane"), attr=name):
                return name
            case ast.Subscript(value=ast.Name(id="lane"), slice=index):
                path = self.text_of(index)
                if isinstance(path, str):
                    return path
                raise self.refuse(
                    node, f"'{ast.unparse(node)}': the name of the group must be known when the program is generated"
                )
        return ""

    def text_of(self, node: ast.expr) -> Any:
        """Return a text that is written out, known or outside the function; any other value if it is none."""
        return node.value if isinstance(node, ast.Constant) else self.outside_value(node)

    def group_read(self, name: str) -> ast.expr:
        """Return the name of a group, which becomes a parameter unless it was set before."""
        if name not in self.groups_set:
            self.effects.reads[name] = None
        return ast.Name(_GROUP + name, ast.Load())

    def of_call(self, node: ast.Call) -> ast.expr:
        """Return a call with the additional arguments of the called function."""
        called = self.outside_value(node.func)
        called, node = self.with_parts(getattr(called, "__wrapped__", called), node)
        if called is getattr:
            name = self.value_of(node.args[1])
            return ast.Attribute(self.visit(node.args[0]), name, ast.Load())
        if called in (section_row, component_row):
            kind = self.outside_value(node.args[0])
            section = self.text_of(node.args[2])
            if called is component_row:
                paths = (f"{section}.{quantity.name}" for quantity in kind.quantities)
                return self.row_of(kind.parameters, (ast.Attribute(node.args[1], path, ast.Load()) for path in paths))
            further = [part for argument in node.args[3:] for part in self.arguments(argument)]
            names = kind._fields[: len(kind._fields) - len(further)]
            numbers = [ast.Attribute(node.args[1], f"{section}.{name}", ast.Load()) for name in names]
            return ast.Call(self.placeholder(kind), [*numbers, *further], [])
        if called is rebuilt:
            return self.row_of(self.outside_value(node.args[0]), self.arguments(ast.Starred(node.args[1])))
        if is_step_function(called):
            arguments = self.step_arguments(called, node)
            if self.module.effects_of(called).results:
                raise self.refuse(
                    node, f"function '{called.__name__}' sets 'lane' groups and returns nothing: its call is no value"
                )
            return ast.Call(self.placeholder(called), arguments, [])
        if isinstance(called, FunctionType):
            for row in self.module.collector.handed_to(self.module.add_called(self.function, called)):
                self.group_read(row)
        # Arguments that a generator makes are written out.
        arguments = [part for argument in node.args for part in self.arguments(argument)]
        named = [ast.keyword(keyword.arg, self.visit(keyword.value)) for keyword in node.keywords]
        function = (
            self.placeholder(called) if isinstance(called, FunctionType) or is_row(called) else self.visit(node.func)
        )
        return ast.Call(function, arguments, named)

    def with_parts(self, called: Any, node: ast.Call) -> tuple[Any, ast.Call]:
        """Return a function called with ``parts=`` as a function bound to these parts, and the call without them."""
        given = next((keyword for keyword in node.keywords if keyword.arg == "parts"), None)
        if given is None or not isinstance(called, FunctionType) or is_step_function(called):
            return called, node
        others = [keyword for keyword in node.keywords if keyword is not given]
        made = made_of(called, called.__name__, self.value_of(given.value))
        return made, ast.copy_location(ast.Call(node.func, node.args, others), node)

    def step_arguments(self, called: FunctionType, node: ast.Call) -> list[ast.expr]:
        """Return the own arguments of a called function of the step, and add the function to the module."""
        own = self.arguments_by_name(called, node)[2:]
        self.module.add_called(self.function, called)
        effects = self.module.effects_of(called)
        for row in effects.reads:
            self.group_read(row)
        return [self.visit(value) for name, value in own if name in effects.takes]

    def arguments_by_name(self, called: FunctionType, node: ast.Call) -> list[tuple[str, ast.expr]]:
        """Return the arguments of a call of a step function by name, in order. ProgramError if they do not match."""
        names = called.__code__.co_varnames[: called.__code__.co_argcount]
        given = dict(zip(names, node.args, strict=False))
        named = {keyword.arg: keyword.value for keyword in node.keywords if keyword.arg is not None}
        given |= {name: value for name, value in named.items() if name not in given}
        if len(given) != len(node.args) + len(node.keywords) or given.keys() != set(names):
            raise self.refuse(node, f"{called.__name__}({', '.join(names)}): each argument must be given exactly once")
        return [(name, given[name]) for name in names]

    def arguments(self, node: ast.expr) -> Iterator[ast.expr]:
        """Yield the arguments of a call; ``*(... for ... in ...)`` is expanded to single arguments."""
        if not isinstance(node, ast.Starred) or not isinstance(node.value, ast.GeneratorExp):
            yield self.visit(node)
            return
        (loop,) = node.value.generators
        assert isinstance(loop.target, ast.Name)
        before = self.known
        running = self.run_time_names
        for element in self.items_of(loop.iter):
            self.known = {**before, loop.target.id: element}
            self.run_time_names = running - {loop.target.id}
            made = self.visit(node.value.elt)
            self.known = before
            self.run_time_names = running
            yield made

    def items_of(self, node: ast.expr) -> list[Any]:
        """Return the items of an iterable, which must be known."""
        if self.definition.read_in(node) & self.run_time_names:
            raise self.refuse(node, f"'{ast.unparse(node)}' must be known when the program is generated")
        return list(self.definition.value(node, self.scope, self.known))

    # Statements.

    def block(self, statements: Iterable[ast.stmt]) -> list[ast.stmt]:
        """Return reduced statements, without unreachable statements after an unconditional ``return``."""
        made: list[ast.stmt] = []
        for statement in statements:
            made += [ast.copy_location(line, statement) for line in self.statement(statement)]
            if made and isinstance(made[-1], ast.Return):
                break
        return made

    def statement(self, node: ast.stmt) -> list[ast.stmt]:
        """Return a reduced statement."""
        match node:
            case ast.Expr(value=ast.Call() as call):
                return self.call_that_sets(call)
            case ast.Expr() | ast.Assert():
                return []
            case ast.Return(value=ast.expr() as value):
                return [ast.Return(self.visit(value))]
            case ast.If():
                return self.branch(node)
            case ast.For():
                return self.unrolled(node)
            case ast.Assign(targets=[target]):
                return self.assignment(target, node.value)
            case ast.AnnAssign(target=ast.Name() as target, value=ast.expr() as value):
                return self.assignment(target, value)
            case ast.AugAssign(target=ast.Name(id=name) as target, op=op, value=value):
                before = ast.copy_location(ast.Name(name, ast.Load()), target)
                return self.assignment(target, ast.copy_location(ast.BinOp(before, op, value), node))
        line = ast.unparse(node).splitlines()[0]
        raise self.refuse(node, f"'{line}' is not supported in a phase: {_STATEMENTS}")

    def branch(self, node: ast.If) -> list[ast.stmt]:
        """Reduce an ``if`` to one branch if the condition is known; else groups set in one branch are also read."""
        test = self.condition(node.test)
        if isinstance(test, ast.Constant):
            return self.block(node.body if test.value else node.orelse)
        before = set(self.groups_set)
        body = self.block(node.body)
        set_in_body = self.groups_set
        self.groups_set = set(before)
        otherwise = self.block(node.orelse)
        for name in sorted((set_in_body ^ self.groups_set) - before):
            self.effects.reads[name] = None
        self.groups_set |= set_in_body
        return [ast.If(test, body or [ast.Pass()], otherwise)]

    def unrolled(self, node: ast.For) -> list[ast.stmt]:
        """Expand a loop over known items."""
        lines: list[ast.stmt] = []
        # A name first set inside the loop is spelt anew in each turn, since its values may differ in class.
        earlier = {name.id for name in names_in(self.definition.tree) if name.lineno < node.lineno}
        own = [name for name in stored_names(node.body) if name not in earlier]
        for number, element in enumerate(self.items_of(node.iter)):
            targets = node.target.elts if isinstance(node.target, ast.Tuple) else [node.target]
            values = element if isinstance(node.target, ast.Tuple) else (element,)
            for target, value in zip(targets, values, strict=True):
                assert isinstance(target, ast.Name)
                self.known[target.id] = value
                self.run_time_names.discard(target.id)
            if number:
                self.spellings |= {name: f"{name}_{number + 1}" for name in own}
            lines += self.block(node.body)
        for name in own:
            self.spellings.pop(name, None)
        return lines

    def assignment(self, target: ast.expr, value: ast.expr) -> list[ast.stmt]:
        """Reduce an assignment to names, groups or history elements."""
        if isinstance(target, ast.Name) and self.times_set[target.id] == 1:
            known = self.value_of(value)
            if known is not _UNKNOWN:
                self.known[target.id] = known
                self.run_time_names.discard(target.id)
                return []
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple) and not self.crosses(target, value):
            pairs = zip(target.elts, value.elts, strict=True)
            return [line for element, element_value in pairs for line in self.assignment(element, element_value)]
        fields = self.fields_changed(target, value)
        reduced = self.visit(value)
        if isinstance(target, ast.Tuple):
            names = [self.set_target(element, fields) for element in target.elts]
            return [ast.Assign([ast.Tuple([*names], ast.Store())], reduced)]
        name = self.set_target(target, fields)
        row = self.module.rows.get(group_of_name(name))
        if isinstance(reduced, ast.IfExp) and row is not None and not is_number(row):
            # A choice between rows becomes a row of choices between numbers, for which no compiler makes a branch.
            numbers = zip(self.numbers_of(row, reduced.body), self.numbers_of(row, reduced.orelse), strict=True)
            test = reduced.test
            reduced = self.row_of(row, (ast.IfExp(test, chosen, other) for chosen, other in numbers))
        is_unchanged = isinstance(reduced, ast.Name) and reduced.id == name.id
        return [] if is_unchanged else [ast.Assign([name], reduced)]

    def crosses(self, target: ast.Tuple, value: ast.Tuple) -> bool:
        """Return whether any of several values reads a target of the same assignment."""
        names = {ast.unparse(element) for element in target.elts}
        return any(ast.unparse(element) in names for part in value.elts for element in ast.walk(part))

    def set_target(self, target: ast.expr, fields: Fields) -> ast.Name:
        """Return the name for an assignment target."""
        name = self.group_path(target)
        if name:
            self.note_set(name, fields)
            return ast.Name(_GROUP + name, ast.Store())
        if isinstance(target, ast.Subscript) and self.group_path(target.value) in HISTORIES:
            history = self.group_path(target.value)
            places = tuple(map(self.visit, _indices(target)))
            known = [index.value for index in places if isinstance(index, ast.Constant)]
            # A trace has the names of its channels.
            words = [self.module.parts.traced[index] if history == TRACE else str(index) for index in known]
            name = "_".join(["new", history.removesuffix("_history"), *words]).replace(".", "_")
            self.note_slot(name, Slot(history, places))
            return ast.Name(_GROUP + name, ast.Store())
        if not isinstance(target, ast.Name):
            raise self.refuse(target, f"'{ast.unparse(target)}' cannot be assigned in a phase")
        return ast.Name(self.spellings.get(target.id, target.id), ast.Store())

    def note_set(self, name: str, fields: Fields) -> None:
        """Record a group that is set, and the fields that change."""
        known = self.effects.groups.get(name, frozenset())
        self.effects.groups[name] = None if known is None or fields is None else known | fields
        self.groups_set.add(name)

    def note_slot(self, name: str, slot: Slot) -> None:
        """Record a history element that is set."""
        self.effects.slots[name] = slot
        self.groups_set.add(name)

    def fields_changed(self, target: ast.expr, value: ast.expr) -> Fields:
        """Return the fields of a group changed by an assignment: the arguments of its ``_replace``, else all."""
        if not isinstance(value, ast.Call) or not isinstance(value.func, ast.Attribute):
            return None
        is_part = value.func.attr == "_replace" and self.group_path(target) == self.group_path(value.func.value) != ""
        return frozenset(keyword.arg for keyword in value.keywords if keyword.arg is not None) if is_part else None

    def row_of(self, kind: Any, numbers: Iterator[ast.expr]) -> ast.expr:
        """Return an expression for a row, nested or not, from the next numbers, as constructed by ``rebuilt``."""
        if is_number(kind):
            return next(numbers)
        inner = [self.row_of(inside, numbers) for _, inside in members(kind)]
        if not is_row(kind) or not inner:
            return ast.Tuple([*inner], ast.Load())
        return ast.Call(self.placeholder(kind), inner, [])

    def numbers_of(self, kind: Any, row: ast.expr) -> Iterator[ast.expr]:
        """Yield the expressions of the numbers of a row, nested or not, in order."""
        if is_number(kind):
            yield row
        for access, inside in members(kind):
            yield from self.numbers_of(inside, self.member_of(row, access))

    def member_of(self, owner: ast.expr, access: str) -> ast.expr:
        """Return the expression of ``.FIELD`` or ``[INDEX]`` of a row; a value if the row is known."""
        key = int(access[1:-1]) if access[0] == "[" else access[1:]
        if isinstance(owner, ast.Name) and owner.id in self.module.placeholders:
            value = self.module.placeholders[owner.id]
            return self.expression_of(value[key] if isinstance(key, int) else getattr(value, key))
        if isinstance(key, int):
            return ast.Subscript(owner, ast.Constant(key), ast.Load())
        return ast.Attribute(owner, key, ast.Load())

    def call_that_sets(self, node: ast.Call) -> list[ast.stmt]:
        """Reduce a call of a function that sets groups: its return values are assigned to these groups."""
        called = self.outside_value(node.func)
        if not is_step_function(called):
            raise self.refuse(node, f"'{ast.unparse(node)}' discards its return value; assign it to a name")
        arguments = self.step_arguments(called, node)
        effects = self.module.effects_of(called)
        if not effects.results:
            return []
        for group, fields in effects.groups.items():
            self.note_set(group, fields)
        own = self.arguments_by_name(called, node)[2:]
        given_by_name = {key: self.visit(value) for key, value in own} if effects.slots else {}
        for result, slot in effects.slots.items():
            places = tuple(with_arguments(index, given_by_name) for index in slot.places)
            self.note_slot(result, Slot(slot.history, places))
        call = ast.Call(self.placeholder(called), arguments, [])
        groups = [ast.Name(_GROUP + result, ast.Store()) for result in effects.results]
        if len(groups) == 1:
            return [ast.Assign([groups[0]], call)]
        returned = f"{called.__name__}_result"
        fields_read = [
            ast.Assign([group], ast.Attribute(ast.Name(returned, ast.Load()), result, ast.Load()))
            for group, result in zip(groups, effects.results, strict=True)
        ]
        return [ast.Assign([ast.Name(returned, ast.Store())], call), *fields_read]


def _indices(node: ast.Subscript) -> Sequence[ast.expr]:
    """Return the indices of an element."""
    return node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]


def with_arguments(expression: ast.expr, arguments: Mapping[str, ast.expr]) -> ast.expr:
    """Return an expression of a function with its parameters replaced by the caller's argument expressions."""
    return rewritten(expression, lambda node: arguments.get(node.id) if isinstance(node, ast.Name) else None)
