"""The typed walk over a composed module: which types its names have, and what each line does with them.

A function is walked once for each choice of types that it is called with; a function that is handed over counts as a
type, so that it is bound here. What is outside the subset is refused with the file and the line that it comes from.
"""

import ast
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from ppafo.engine.compile_errors import place_in
from ppafo.engine.plain_python import refusal
from ppafo.errors import ProgramError
from ppafo.translation import typed
from ppafo.translation.scopes import needed
from ppafo.translation.typed import (
    BOOL,
    FLOAT,
    FUNCTIONS,
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

SIGN_OF: dict[type[ast.AST], str] = {
    **{ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "//", ast.Mod: "%"},
    **{ast.BitAnd: "&", ast.BitOr: "|", ast.BitXor: "^", ast.RShift: ">>"},
    **{ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="},
    **{ast.And: "and", ast.Or: "or"},
}
WHOLE_ONLY = frozenset({"&", "|", "^", ">>"})
_ARRAY = re.compile(r"float64\[(.*?)\]|int64|float64")


def walk_module(source: str) -> Module:
    """All functions of a composed module that its compiled entries need. ProgramError for what is outside the subset."""
    walk = _ModuleWalk(source.split("\n"))
    for node in ast.parse(source).body:
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call) and isinstance(node.targets[0], ast.Name):
            walk.rows[node.targets[0].id] = ast.literal_eval(node.value.args[1])
        elif isinstance(node, ast.FunctionDef):
            walk.definitions[node.name] = node
    for name, node in walk.definitions.items():
        types = _entry_types(node)
        if types is not None:
            walk.function(name, types, node)
    return walk.module


def _entry_types(node: ast.FunctionDef) -> tuple[Type, ...] | None:
    """Types of the parameters that an entry states in its decorator; None for what only others call."""
    stated = [item.args[0] for item in node.decorator_list if isinstance(item, ast.Call) and item.args]
    if not stated:
        return None
    written = ast.literal_eval(stated[0]).partition("(")[2].rpartition(")")[0]
    found = _ARRAY.finditer(written)
    plain: dict[str, Type] = {"int64": INT, "float64": FLOAT}
    return tuple(plain.get(item[0]) or Array(item[1].count(":") - 1) for item in found)


@dataclass(slots=True)
class _ModuleWalk:
    lines: list[str]
    rows: dict[str, list[str]] = field(default_factory=dict)
    definitions: dict[str, ast.FunctionDef] = field(default_factory=dict)
    done: dict[tuple[str, tuple[Type, ...]], Function] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    module: Module = field(default_factory=Module)

    def function(self, name: str, types: tuple[Type, ...], where: ast.AST) -> Function:
        """A function for some types of its parameters."""
        key = name, types
        if key not in self.done:
            definition = self.definitions[name]
            self.counts[name] = self.counts.get(name, 0) + 1
            number = self.counts[name]
            own = name if number == 1 else f"{name}_{number}"
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
        self.returns: Type | None = None
        self.has_widened = False
        self.flags = 0

    def walked(self, name: str, types: tuple[Type, ...]) -> Function:
        """The function as typed statements."""
        given = self.definition.args
        names = [item.arg for item in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
        self.types = dict(zip(names, types, strict=True))
        for _ in range(10):
            self.has_widened, self.flags = False, 0
            body = self.block(self.definition.body)
            if not self.has_widened:
                break
        for parameter, kind in zip(names, types, strict=True):
            if self.types[parameter] != kind:
                problem = f"'{parameter}' is given as one type and becomes another; give the second a name of its own"
                raise self.refused(self.definition, problem)
        kept = tuple((item, self.types[item]) for item in names if not is_empty(self.types[item]))
        bound = tuple(f"{item} is {kind.name}" for item, kind in zip(names, types, strict=True) if isinstance(kind, Handed))
        return Function(name, self.definition.name, kept, self.returns, needed(body, frozenset())[0], bound)

    def refused(self, where: ast.AST, problem: str) -> ProgramError:
        """The error for a place in this function."""
        return self.module.refused(where, problem)

    def block(self, body: Sequence[ast.stmt], flag: str = "") -> tuple[Statement, ...]:
        """Some statements; ``flag`` is set before each ``break`` of the loop around them."""
        found: list[Statement] = []
        for node in body:
            handler: Callable[[Any, str], list[Statement]] | None = getattr(self, f"do_{type(node).__name__}", None)
            if handler is None:
                raise self.refused(node, f"'{ast.unparse(node).splitlines()[0]}' is no statement of the subset")
            found += handler(node, flag)
        return tuple(found)

    def do_Pass(self, node: ast.Pass, flag: str) -> list[Statement]:
        return []

    def do_Expr(self, node: ast.Expr, flag: str) -> list[Statement]:
        return []

    def do_Break(self, node: ast.Break, flag: str) -> list[Statement]:
        return [*([self.assign(flag, Term("number", BOOL, (), True), node)] if flag else []), typed.Leave("break")]

    def do_Continue(self, node: ast.Continue, flag: str) -> list[Statement]:
        return [typed.Leave("continue")]

    def do_Return(self, node: ast.Return, flag: str) -> list[Statement]:
        if node.value is None:
            raise self.refused(node, "'return' without a value")
        value = self.term(node.value)
        kind = value.type if self.returns is None else joined(self.returns, value.type)
        if kind is None:
            raise self.refused(node, "a function that returns values of different forms")
        self.has_widened |= self.returns is not None and kind != self.returns
        self.returns = kind
        return [typed.Return(converted(value, kind))]

    def do_If(self, node: ast.If, flag: str) -> list[Statement]:
        test = self.condition(node.test)
        return [typed.If(test, self.block(node.body, flag), self.block(node.orelse, flag))]

    def do_While(self, node: ast.While, flag: str) -> list[Statement]:
        test = self.condition(node.test)
        return self.loop(node, lambda own: typed.While(test, self.block(node.body, own)))

    def do_For(self, node: ast.For, flag: str) -> list[Statement]:
        if not isinstance(node.target, ast.Name):
            raise self.refused(node, f"'for {ast.unparse(node.target)}'")
        call, name = node.iter, node.target.id
        if not (isinstance(call, ast.Call) and ast.unparse(call.func) == "range"):
            return self.loop_over_items(name, node)
        bounds = [self.whole(item) for item in call.args]
        start, stop = (Term("number", INT, (), 0), bounds[0]) if len(bounds) == 1 else bounds[:2]
        step = ast.literal_eval(call.args[2]) if len(bounds) == 3 else 1
        self.note_type(name, INT, node)
        return self.loop(node, lambda own: typed.Count(name, start, stop, step, self.block(node.body, own)))

    def loop_over_items(self, name: str, node: ast.For) -> list[Statement]:
        """A loop over the items of a tuple, or of a part of it, as one that counts."""
        whole = node.iter.value if isinstance(node.iter, ast.Subscript) else node.iter
        owner = self.term(whole)
        if not isinstance(owner.type, Items) or not owner.type.is_uniform:
            raise self.refused(node, f"'{ast.unparse(node.iter)}' is no tuple of one type")
        places = range(len(owner.type.types))
        if isinstance(node.iter, ast.Subscript):
            places = places[self.part(node.iter.slice)]
        counter = f"{name}_place"
        self.note_type(counter, INT, node)
        item = Term("item", owner.type.types[0], (owner, Term("name", INT, (), counter)))
        taken = self.assign(name, item, node)
        start, stop = (Term("number", INT, (), place) for place in (places.start, places.stop))
        return self.loop(node, lambda own: typed.Count(counter, start, stop, 1, (taken, *self.block(node.body, own))))

    def part(self, node: ast.expr) -> slice:
        """A part of a tuple, whose bounds are literal."""
        if not isinstance(node, ast.Slice) or node.step is not None:
            raise self.refused(node, f"'{ast.unparse(node)}' is no part of a tuple")
        return slice(*(None if item is None else ast.literal_eval(item) for item in (node.lower, node.upper)))

    def loop(self, node: ast.For | ast.While, make: Callable[[str], Statement]) -> list[Statement]:
        """A loop; what follows where it was not left is under a flag."""
        if not node.orelse:
            return [make("")]
        self.flags += 1
        flag = f"was_left_{self.flags}"
        before = self.assign(flag, Term("number", BOOL, (), False), node)
        test = Term("not", BOOL, (Term("name", BOOL, (), flag),))
        return [before, make(flag), typed.If(test, self.block(node.orelse), ())]

    def do_AugAssign(self, node: ast.AugAssign, flag: str) -> list[Statement]:
        left = ast.copy_location(ast.Name(ast.unparse(node.target), ast.Load()), node)
        value = ast.copy_location(ast.BinOp(left, node.op, node.value), node)
        return self.do_Assign(ast.copy_location(ast.Assign([node.target], value), node), flag)

    def do_Assign(self, node: ast.Assign, flag: str) -> list[Statement]:
        if len(node.targets) != 1:
            raise self.refused(node, "one value for several names")
        target = node.targets[0]
        if isinstance(target, ast.Name) and ast.unparse(node.value).startswith("np.empty("):
            return [self.reserve(target.id, node)]
        value = self.term(node.value)
        if isinstance(target, ast.Name):
            return [self.assign(target.id, value, node)]
        if isinstance(target, ast.Subscript):
            return [typed.Store(self.term(target), converted(value, FLOAT))]
        if not isinstance(target, ast.Tuple):
            raise self.refused(node, f"'{ast.unparse(target)}' on the left")
        return self.assign_items(target, value, node)

    def reserve(self, name: str, node: ast.Assign) -> Statement:
        """A local array, whose shape is a literal."""
        assert isinstance(node.value, ast.Call)
        kind = Array(2, ast.literal_eval(node.value.args[0]))
        self.note_type(name, kind, node)
        return typed.Reserve(name, kind)

    def assign(self, name: str, value: Term, node: ast.AST) -> Statement:
        """A name gets a value, as the type that holds all that it ever gets."""
        self.note_type(name, value.type, node)
        return typed.Assign(name, converted(value, self.types[name]))

    def note_type(self, name: str, kind: Type, node: ast.AST) -> None:
        """Widen the type of a name where it must be."""
        before = self.types.get(name, kind)
        found = joined(before, kind)
        if found is None:
            raise self.refused(node, f"'{name}' holds values of different forms")
        self.has_widened |= found != before
        self.types[name] = found

    def assign_items(self, target: ast.Tuple, value: Term, node: ast.Assign) -> list[Statement]:
        """Several names get the items of a tuple; what is on the right has its value before any name changes."""
        names = [item.id for item in target.elts if isinstance(item, ast.Name)]
        kind = value.type
        length = len(kind.types) if isinstance(kind, Items) else len(kind.fields) if isinstance(kind, Row) else -1
        if len(names) != len(target.elts) or length != len(names):
            raise self.refused(node, f"'{ast.unparse(target)}' does not fit what is on the right")
        before: list[Statement] = []
        read = {item.id for item in ast.walk(node.value) if isinstance(item, ast.Name)}
        if value.kind != "build" or read & set(names):
            whole = "_and_".join(name for name in names if name != "_")
            before = [self.assign(whole, value, node)]
            value = Term("name", self.types[whole], (), whole)
        return [*before, *(self.assign(name, typed.item_of(value, at), node) for at, name in enumerate(names) if name != "_")]

    def term(self, node: ast.expr) -> Term:
        """The value of an expression."""
        handler: Callable[[Any], Term] | None = getattr(self, f"of_{type(node).__name__}", None)
        if handler is None:
            raise self.refused(node, f"'{ast.unparse(node)}' is no expression of the subset")
        return handler(node)

    def scalar(self, node: ast.expr, least: Scalar = BOOL) -> Term:
        """The value of an expression that must be one number, as ``least`` or a wider type."""
        found = self.term(node)
        if not isinstance(found.type, Scalar):
            raise self.refused(node, f"'{ast.unparse(node)}' is not one number")
        kind = joined(found.type, least)
        assert kind is not None
        return converted(found, kind)

    def whole(self, node: ast.expr) -> Term:
        """The value of an expression that must be a whole number."""
        found = self.scalar(node, INT)
        if found.type != INT:
            raise self.refused(node, f"'{ast.unparse(node)}' is no whole number")
        return found

    def condition(self, node: ast.expr) -> Term:
        """Whether an expression is true."""
        found = self.scalar(node)
        return found if found.type == BOOL else Term("!=", BOOL, (found, converted(Term("number", INT, (), 0), found.type)))

    def of_Constant(self, node: ast.Constant) -> Term:
        kinds: dict[type, Type] = {bool: BOOL, int: INT, float: FLOAT}
        if type(node.value) not in kinds:
            raise self.refused(node, f"the constant {node.value!r}")
        return Term("number", kinds[type(node.value)], (), node.value)

    def of_Name(self, node: ast.Name) -> Term:
        if node.id in self.types:
            return Term("name", self.types[node.id], (), node.id)
        if node.id in self.module.definitions:
            return Term("name", Handed(node.id), (), node.id)
        raise self.refused(node, f"'{node.id}' has no value")

    def of_Attribute(self, node: ast.Attribute) -> Term:
        numbers = {"math.inf": float("inf"), "math.nan": float("nan"), "math.pi": 3.141592653589793}
        written = ast.unparse(node)
        if written in numbers:
            return Term("number", FLOAT, (), numbers[written])
        owner = self.term(node.value)
        if not isinstance(owner.type, Row) or node.attr not in dict(owner.type.fields):
            raise self.refused(node, f"'{written}' is no field")
        return typed.field_of(owner, node.attr)

    def of_Subscript(self, node: ast.Subscript) -> Term:
        if isinstance(node.value, ast.Attribute) and node.value.attr == "shape":
            assert isinstance(node.value.value, ast.Name)
            return Term("extent", INT, (self.of_Name(node.value.value),), ast.literal_eval(node.slice))
        owner = self.term(node.value)
        if isinstance(owner.type, Array):
            places = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
            return Term("element", FLOAT, (owner, *(self.whole(place) for place in places)))
        if not isinstance(owner.type, Items | Row):
            raise self.refused(node, f"'{ast.unparse(node.value)}' has no items")
        count = len(owner.type.types) if isinstance(owner.type, Items) else len(owner.type.fields)
        if isinstance(node.slice, ast.Slice):
            parts = tuple(typed.item_of(owner, place) for place in range(count)[self.part(node.slice)])
            return Term("build", Items(tuple(part.type for part in parts)), parts)
        place = self.whole(node.slice)
        number = -place.parts[0].detail if place.kind == "negative" else place.detail
        if place.kind in ("number", "negative"):
            return typed.item_of(owner, range(count)[number])
        if not isinstance(owner.type, Items) or not owner.type.is_uniform:
            raise self.refused(node, f"'{ast.unparse(node)}' takes an item of a tuple of several types by a variable")
        return Term("item", owner.type.types[0], (owner, place))

    def of_Tuple(self, node: ast.Tuple) -> Term:
        parts = tuple(self.term(item) for item in node.elts)
        return Term("build", Items(tuple(part.type for part in parts)), parts)

    def of_UnaryOp(self, node: ast.UnaryOp) -> Term:
        if isinstance(node.op, ast.Not):
            return Term("not", BOOL, (self.condition(node.operand),))
        if not isinstance(node.op, ast.USub):
            raise self.refused(node, f"'{ast.unparse(node)}'")
        value = self.scalar(node.operand, INT)
        return Term("negative", value.type, (value,))

    def of_BinOp(self, node: ast.BinOp) -> Term:
        sign = SIGN_OF.get(type(node.op), "")
        left, right = self.scalar(node.left, INT), self.scalar(node.right, INT)
        is_whole = left.type == right.type == INT
        if not sign or (not is_whole and sign in WHOLE_ONLY | {"//", "%"}):
            raise self.refused(node, f"'{ast.unparse(node)}' needs a library function")
        kind = INT if is_whole and sign != "/" else FLOAT
        return Term(sign, kind, (converted(left, kind), converted(right, kind)))

    def of_BoolOp(self, node: ast.BoolOp) -> Term:
        parts = [self.condition(item) for item in node.values]
        made = parts[0]
        for part in parts[1:]:
            made = Term(SIGN_OF[type(node.op)], BOOL, (made, part))
        return made

    def of_Compare(self, node: ast.Compare) -> Term:
        values = [self.scalar(item, INT) for item in (node.left, *node.comparators)]
        made: Term | None = None
        for sign, left, right in zip(node.ops, values, values[1:], strict=False):
            kind = joined(left.type, right.type)
            if type(sign) not in SIGN_OF or kind is None:
                raise self.refused(node, f"'{ast.unparse(node)}'")
            one = Term(SIGN_OF[type(sign)], BOOL, (converted(left, kind), converted(right, kind)))
            made = one if made is None else Term("and", BOOL, (made, one))
        assert made is not None
        return made

    def of_IfExp(self, node: ast.IfExp) -> Term:
        test, yes, no = self.condition(node.test), self.term(node.body), self.term(node.orelse)
        kind = joined(yes.type, no.type)
        if kind is None:
            raise self.refused(node, "a choice between values of different forms")
        return Term("choice", kind, (test, converted(yes, kind), converted(no, kind)))

    def of_Call(self, node: ast.Call) -> Term:
        name = ast.unparse(node.func)
        if any(isinstance(item, ast.Starred) for item in node.args):
            raise self.refused(node, f"'{ast.unparse(node)}' hands over a tuple as arguments")
        handed = self.types.get(name)
        name = handed.name if isinstance(handed, Handed) else name
        if name in self.module.rows:
            return self.build(name, node)
        if name in self.module.definitions:
            return self.call(name, node)
        return self.built_in(name, node)

    def build(self, name: str, node: ast.Call) -> Term:
        """A row from its fields."""
        fields = self.module.rows[name]
        given = dict(zip(fields, map(self.term, node.args), strict=False))
        given |= {str(item.arg): self.term(item.value) for item in node.keywords}
        if set(given) != set(fields):
            raise self.refused(node, f"'{ast.unparse(node)}' does not give every field")
        parts = tuple(given[item] for item in fields)
        return Term("build", Row(name, tuple((item, given[item].type) for item in fields)), parts)

    def call(self, name: str, node: ast.Call) -> Term:
        """A call of another function of the module."""
        takes = self.module.definitions[name].args
        names = [item.arg for item in (*takes.posonlyargs, *takes.args, *takes.kwonlyargs)]
        placed = [item.arg for item in (*takes.posonlyargs, *takes.args)]
        defaults = dict(zip(placed[::-1], takes.defaults[::-1], strict=False))
        defaults |= {item.arg: value for item, value in zip(takes.kwonlyargs, takes.kw_defaults, strict=True) if value}
        given = {item: self.term(value) for item, value in defaults.items()}
        given |= dict(zip(names, map(self.term, node.args), strict=False))
        given |= {str(item.arg): self.term(item.value) for item in node.keywords}
        if set(given) != set(names):
            raise self.refused(node, f"'{ast.unparse(node)}' does not give every argument")
        function = self.module.function(name, tuple(given[item].type for item in names), node)
        if function.returns is None:
            raise self.refused(node, f"'{name}' returns nothing")
        parts = tuple(given[item] for item in names if not is_empty(given[item].type))
        return Term("call", function.returns, parts, function.name)

    def built_in(self, name: str, node: ast.Call) -> Term:
        """A call of a function that every language has."""
        own = name.removeprefix("math.")
        least = FLOAT if own in ("sqrt", "float") else INT
        if own not in FUNCTIONS | {"float", "int", "bool", "len"} or node.keywords:
            raise self.refused(node, f"'{name}' is a function of a library")
        if own == "len":
            kind = self.term(node.args[0]).type
            return Term("number", INT, (), len(kind.types if isinstance(kind, Items) else getattr(kind, "fields", ())))
        if own == "bool":
            return self.condition(node.args[0])
        values = [self.scalar(item, least) for item in node.args]
        if own == "float":
            return values[0]
        if own == "int":
            return values[0] if values[0].type == INT else Term("convert", INT, (values[0],))
        kind = FLOAT if any(value.type == FLOAT for value in values) else INT
        made, *others = [converted(value, kind) for value in values]
        if not others:
            return Term(own, kind, (made,))
        for other in others:
            made = Term(own, kind, (made, other))
        return made
