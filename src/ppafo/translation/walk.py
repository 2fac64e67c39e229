"""The typed walk over a composed module: which types its names have, and what each line does with them.

A function is walked once for each choice of types that it is called with; a function that is handed over counts as a
type, so that it is bound here. What is outside the subset is refused with the file and the line that it comes from.
"""

import ast
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from typing import Any

from ppafo.engine.compile_errors import place_in
from ppafo.engine.entries import entry_types
from ppafo.engine.plain_python import parse_module, refusal
from ppafo.errors import ProgramError
from ppafo.translation import typed
from ppafo.translation.expressions import Expressions
from ppafo.translation.scopes import Names, changed, needed
from ppafo.translation.typed import (
    BOOL,
    FLOAT,
    INT,
    Array,
    Function,
    Handed,
    Items,
    Module,
    Row,
    Scalar,
    Statement,
    Term,
    Type,
    converted,
    is_empty,
    joined,
)


def walk_module(
    source: str, entries: Mapping[str, tuple[Type, ...]] | None = None, library: frozenset[str] = frozenset()
) -> Module:
    """All functions of a composed module that its entries need. ProgramError for what is outside the subset.

    Entries are functions with types of their parameters, by name; without any those that state them in a decorator.
    ``library`` has those of ``LIBRARY`` that may be called.
    """
    walk = _ModuleWalk(source.split("\n"), entries_of(source) if entries is None else entries, library)
    for node in parse_module(source).body:
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call) and isinstance(node.targets[0], ast.Name):
            walk.rows[node.targets[0].id] = ast.literal_eval(node.value.args[1])
        elif isinstance(node, ast.FunctionDef):
            walk.definitions[node.name] = node
    for name in walk.definitions:
        if name in walk.entries:
            walk.function(name, walk.entries[name])
    return walk.module


def entries_of(source: str) -> dict[str, tuple[Type, ...]]:
    """Functions of a composed module that are called from outside, with the types of their parameters."""
    plain: dict[str, Type] = {"int64": INT, "float64": FLOAT}
    return {
        name: tuple(plain.get(word) or Array(word.count(":") - 1) for word in words)
        for name, words in entry_types(source).items()
    }


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
    found: dict[str, Names] = field(default_factory=dict)
    module: Module = field(default_factory=Module)

    def function(self, name: str, types: tuple[Type, ...]) -> Function:
        """A function for some types of its parameters."""
        key = name, types
        if key not in self.done:
            definition = self.definitions[name]
            if key in self.open:
                raise self.refused(definition, f"'{name}' calls itself")
            self.open.add(key)
            number, own = 1, name
            while own in self.names or (number > 1 and (own in self.definitions or own in self.rows)):
                number += 1
                own = f"{name}_{number}"
            self.names.add(own)
            self.done[key] = _FunctionWalk(self, definition).walked(own, types)
            self.module.functions.append(self.done[key])
        return self.done[key]

    def refused(self, where: ast.AST, problem: str) -> ProgramError:
        """The error for a place in the composed text, in terms of the file that it was written in."""
        number = getattr(where, "lineno", 0)
        found = place_in(self.lines, number)
        problem = f"{problem}, which cannot be translated"
        if found is None:
            return ProgramError(f"the lane loop, line {number} of the composed module: {problem}")
        return refusal(found.file, found.line, problem)


class _FunctionWalk:
    """One function for one choice of types; gone through again where a name turns out to hold a wider type."""

    def __init__(self, module: _ModuleWalk, definition: ast.FunctionDef) -> None:
        self.module = module
        self.definition = definition
        self.types: dict[str, Type] = {}
        if definition.name not in module.found:
            module.found[definition.name] = Names.of(definition)
        found = module.found[definition.name]
        self.names, self.read = found.every, found.read
        self.made: set[str] = set()
        self.values = Expressions(
            self.types,
            found.counters,
            module.rows,
            module.definitions,
            module.library,
            made=module.function,
            refused=module.refused,
        )
        self.returns: Type | None = None
        self.has_widened = False
        self.flags = 0
        self.flag = ""
        self.writes: ast.AST | None = None

    def walked(self, name: str, types: tuple[Type, ...]) -> Function:
        """The function as typed statements."""
        given = self.definition.args
        names = [item.arg for item in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
        self.types.update(zip(names, types, strict=True))
        # Types only grow, so this ends.
        self.has_widened = True
        while self.has_widened:
            self.has_widened, self.flags = False, 0
            self.made.clear()
            body = self.block(self.definition.body)
        for parameter, kind in zip(names, types, strict=True):
            if self.types[parameter] != kind:
                problem = f"'{parameter}' is given as one type and becomes another; give the second a name of its own"
                raise self.refused(self.definition, problem)
        if self.writes is not None and self.returns is not None:
            raise self.refused(self.writes, f"'{self.definition.name}' returns a value and writes into an array")
        kept = tuple((item, self.types[item]) for item in names if not is_empty(self.types[item]))
        bound = tuple(
            f"{item} is {kind.name}" for item, kind in zip(names, types, strict=True) if isinstance(kind, Handed)
        )
        is_entry = self.returns is None and self.module.entries.get(self.definition.name) == types
        return Function(name, self.definition.name, kept, self.returns, needed(body, frozenset())[0], bound, is_entry)

    def refused(self, where: ast.AST, problem: str) -> ProgramError:
        """The error for a place in this function."""
        return self.module.refused(where, problem)

    def block(self, body: Sequence[ast.stmt]) -> tuple[Statement, ...]:
        """Some statements."""
        found: list[Statement] = []
        for node in body:
            handler: Callable[[Any], list[Statement]] | None = getattr(self, f"do_{type(node).__name__.lower()}", None)
            if handler is None:
                raise self.refused(node, f"'{ast.unparse(node).splitlines()[0]}' is no statement of the subset")
            found += handler(node)
        return tuple(found)

    def do_pass(self, _node: ast.Pass) -> list[Statement]:
        return []

    def do_expr(self, node: ast.Expr) -> list[Statement]:
        if isinstance(node.value, ast.Constant):
            return []
        name = self.values.name_called(node.value) if isinstance(node.value, ast.Call) else ""
        if not isinstance(node.value, ast.Call) or name not in self.module.definitions:
            raise self.refused(node, f"'{ast.unparse(node)}' is no statement of the subset")
        function, given = self.values.called(name, node.value)
        if function.returns is not None:
            raise self.refused(node, f"'{ast.unparse(node)}' throws away what it returns")
        self.writes = node
        return [typed.Perform(function.name, given)]

    def do_break(self, node: ast.Break) -> list[Statement]:
        marks = [self.assign(self.flag, Term("number", BOOL, (), True), node)] if self.flag else []
        return [*marks, typed.Leave("break")]

    def do_continue(self, _node: ast.Continue) -> list[Statement]:
        return [typed.Leave("continue")]

    def do_return(self, node: ast.Return) -> list[Statement]:
        if node.value is None:
            raise self.refused(node, "'return' without a value")
        value = self.values.term(node.value)
        kind = value.type if self.returns is None else joined(self.returns, value.type)
        if kind is None:
            raise self.refused(node, "a function that returns values of different forms")
        if self.returns is not None and typed.mixes(self.returns, value.type):
            raise self.refused(node, "a function that returns a whole number in one place and a float in another")
        self.has_widened |= self.returns is not None and kind != self.returns
        self.returns = kind
        return [typed.Return(converted(value, kind))]

    def do_if(self, node: ast.If) -> list[Statement]:
        test = self.values.condition(node.test)
        return [typed.If(test, self.block(node.body), self.block(node.orelse))]

    def do_while(self, node: ast.While) -> list[Statement]:
        test = self.values.condition(node.test)
        return self.loop(node, lambda: typed.While(test, self.block(node.body)))

    def do_for(self, node: ast.For) -> list[Statement]:
        if not isinstance(node.target, ast.Name):
            raise self.refused(node, f"'for {ast.unparse(node.target)}'")
        call, name = node.iter, node.target.id
        if not (isinstance(call, ast.Call) and ast.unparse(call.func) == "range"):
            return self.loop_over_items(name, node)
        bounds = [self.values.whole(item) for item in call.args]
        if not 1 <= len(bounds) <= 3 or call.keywords:
            raise self.refused(node, f"'{ast.unparse(call)}'")
        start, stop = (Term("number", INT, (), 0), bounds[0]) if len(bounds) == 1 else bounds[:2]
        step = self.values.literal(call.args[2]) if len(bounds) == 3 else 1
        if step == 0:
            raise self.refused(node, f"'{ast.unparse(call)}' goes nowhere")
        self.note_type(name, INT, node)
        before: list[Statement] = []
        if stop.reads & {name, *changed(node.body)}:
            # Python asks for the end of a range once.
            end = self.fresh(f"{name}_stop", INT)
            before, stop = [self.assign(end, stop, node)], Term("name", INT, (), end)
        return [*before, *self.loop(node, lambda: typed.Count(name, start, stop, step, self.block(node.body)))]

    def loop_over_items(self, name: str, node: ast.For) -> list[Statement]:
        """A loop over the items of a tuple, or of a part of it, as one that counts."""
        whole = node.iter.value if isinstance(node.iter, ast.Subscript) else node.iter
        owner = self.values.term(whole)
        if not isinstance(owner.type, Items) or not owner.type.is_uniform:
            raise self.refused(node, f"'{ast.unparse(node.iter)}' is no tuple of one type")
        if owner.reads & {name, *changed(node.body)}:
            raise self.refused(node, f"a loop over '{ast.unparse(node.iter)}' that changes it")
        places = range(len(owner.type.types))
        if isinstance(node.iter, ast.Subscript):
            places = places[self.values.part(node.iter.slice)]
        counter = self.fresh(f"{name}_place", INT)
        self.note_type(counter, INT, node)
        item = Term("item", owner.type.types[0], (owner, Term("name", INT, (), counter)))
        taken = self.assign(name, item, node)
        start, stop = (Term("number", INT, (), place) for place in (places.start, places.stop))
        return self.loop(node, lambda: typed.Count(counter, start, stop, 1, (taken, *self.block(node.body))))

    def loop(self, node: ast.For | ast.While, make: Callable[[], Statement]) -> list[Statement]:
        """A loop; what follows where it was not left is under a flag, which each ``break`` of it sets."""
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
            raise self.refused(node, "one value for several names")
        target = node.targets[0]
        if isinstance(target, ast.Name) and isinstance(node.value, ast.Call) and _is_empty_array(node.value):
            return [self.reserve(target.id, node.value)]
        value = self.values.term(node.value)
        return (
            self.assign_items(target, value, node) if isinstance(target, ast.Tuple) else self.put(target, value, node)
        )

    def put(self, target: ast.expr, value: Term, node: ast.AST) -> list[Statement]:
        """A name or an element of an array gets a value."""
        if isinstance(target, ast.Name):
            return [self.assign(target.id, value, node)]
        element = self.values.term(target) if isinstance(target, ast.Subscript) else value
        if not isinstance(target, ast.Subscript) or element.kind != "element" or not isinstance(value.type, Scalar):
            raise self.refused(node, f"'{ast.unparse(target)}' on the left")
        owner = element.parts[0].type
        if isinstance(owner, Array) and not owner.shape:
            self.writes = node
        return [typed.Store(element, converted(value, FLOAT))]

    def reserve(self, name: str, node: ast.Call) -> Statement:
        """A local array, whose shape is a literal."""
        kind = Array(2, tuple(ast.literal_eval(extent) for extent in node.args))
        self.note_type(name, kind, node)
        return typed.Reserve(name, kind)

    def assign(self, name: str, value: Term, node: ast.AST) -> Statement:
        """A name gets a value, as the type that holds all that it ever gets."""
        self.note_type(name, value.type, node)
        return typed.Assign(name, converted(value, self.types[name]))

    def fresh(self, wanted: str, kind: Type) -> str:
        """A name that the text does not have, for values of one form."""
        while wanted in self.names or wanted in self.made or joined(self.types.get(wanted, kind), kind) is None:
            wanted += "_"
        self.made.add(wanted)
        return wanted

    def note_type(self, name: str, kind: Type, node: ast.AST) -> None:
        """Widen the type of a name where it must be."""
        before = self.types.get(name, kind)
        found = joined(before, kind)
        if found is None:
            raise self.refused(node, f"'{name}' holds values of different forms")
        if typed.mixes(before, kind):
            raise self.refused(node, f"'{name}' holds a whole number in one place and a float in another")
        self.has_widened |= found != before
        self.types[name] = found

    def assign_items(self, target: ast.Tuple, value: Term, node: ast.Assign) -> list[Statement]:
        """Several names or elements get the items of a tuple, which has its value before any of them changes."""
        names = [item.id for item in target.elts if isinstance(item, ast.Name)]
        is_stored = len(names) < len(target.elts)
        kind = value.type
        length = len(kind.types) if isinstance(kind, Items) else len(kind.fields) if isinstance(kind, Row) else -1
        if length != len(target.elts):
            raise self.refused(node, f"'{ast.unparse(target)}' does not fit what is on the right")
        before: list[Statement] = []
        if value.kind != "build" or value.reads & set(names) or (is_stored and value.reads):
            whole = self.fresh("_and_".join(name for name in names if name != "_") or "items", kind)
            before = [self.assign(whole, value, node)]
            value = Term("name", self.types[whole], (), whole)
        return before + [
            statement
            for at, item in enumerate(target.elts)
            if not isinstance(item, ast.Name) or item.id in self.read
            for statement in self.put(item, typed.item_of(value, at), node)
        ]


def _is_empty_array(node: ast.Call) -> bool:
    """True for ``empty_rows(...)``."""
    return isinstance(node.func, ast.Name) and node.func.id == "empty_rows"
