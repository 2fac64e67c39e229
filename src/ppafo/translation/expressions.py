"""Expressions of a composed module as typed terms."""

import ast
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ppafo.errors import ProgramError
from ppafo.translation import typed
from ppafo.translation.typed import (
    BOOL,
    FLOAT,
    FUNCTIONS,
    INT,
    LIBRARY,
    Array,
    Function,
    Handed,
    Items,
    Row,
    Scalar,
    Term,
    Type,
    converted,
    count_of,
    is_empty,
    joined,
)

SIGN_OF: dict[type[ast.AST], str] = {
    **{ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "//", ast.Mod: "%"},
    **{ast.BitAnd: "&", ast.BitOr: "|", ast.BitXor: "^", ast.RShift: ">>"},
    **{ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="},
    **{ast.And: "and", ast.Or: "or"},
}
CONSTANTS = {"inf": math.inf, "nan": math.nan, "pi": math.pi}
EXACT = 2**53
"""Up to here a float holds every whole number."""
WHOLE_ONLY = frozenset({"&", "|", "^", ">>"})


@dataclass(frozen=True, slots=True)
class Expressions:
    """Expressions of one function: its names with their types, those that only count up from 0, rows and functions.

    ``library`` has the functions of the C library that it may call. ``made`` gives a function for types of its
    parameters, ``refused`` the error for a place.
    """

    types: Mapping[str, Type]
    counters: Collection[str]
    rows: Mapping[str, Sequence[str]]
    definitions: Mapping[str, ast.FunctionDef]
    library: frozenset[str]
    made: Callable[[str, tuple[Type, ...]], Function]
    refused: Callable[[ast.AST, str], ProgramError]

    def term(self, node: ast.expr) -> Term:
        """The value of an expression."""
        handler: Callable[[Any], Term] | None = getattr(self, f"_of_{type(node).__name__.lower()}", None)
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
        if isinstance(node, ast.BoolOp):
            return _linked(node, [self.condition(item) for item in node.values])
        found = self.scalar(node)
        return (
            found
            if found.type == BOOL
            else Term("!=", BOOL, (found, converted(Term("number", INT, (), 0), found.type)))
        )

    def part(self, node: ast.expr) -> slice:
        """A part of a tuple, whose bounds are literal."""
        if not isinstance(node, ast.Slice) or node.step is not None:
            raise self.refused(node, f"'{ast.unparse(node)}' is no part of a tuple")
        return slice(*(None if item is None else self.literal(item) for item in (node.lower, node.upper)))

    def literal(self, node: ast.expr) -> int:
        """A whole number that is written out."""
        number = _literal(self.whole(node))
        if number is None:
            raise self.refused(node, f"'{ast.unparse(node)}' must be a number that is written out")
        return number

    def _of_constant(self, node: ast.Constant) -> Term:
        kinds: dict[type, Type] = {bool: BOOL, int: INT, float: FLOAT}
        is_too_large = type(node.value) is int and node.value >= 2**63
        if type(node.value) not in kinds or is_too_large:
            raise self.refused(node, f"the constant {node.value!r}")
        return Term("number", kinds[type(node.value)], (), node.value)

    def _of_name(self, node: ast.Name) -> Term:
        if node.id in self.types:
            return Term("name", self.types[node.id], (), node.id)
        if node.id in self.definitions:
            return Term("name", Handed(node.id), (), node.id)
        raise self.refused(node, f"'{node.id}' has no value")

    def _of_attribute(self, node: ast.Attribute) -> Term:
        if isinstance(node.value, ast.Name) and node.value.id == "math" and node.attr in CONSTANTS:
            return Term("number", FLOAT, (), CONSTANTS[node.attr])
        owner = self.term(node.value)
        if not isinstance(owner.type, Row) or node.attr not in dict(owner.type.fields):
            raise self.refused(node, f"'{ast.unparse(node)}' is no field")
        return typed.field_of(owner, node.attr)

    def _of_subscript(self, node: ast.Subscript) -> Term:
        if isinstance(node.value, ast.Attribute) and node.value.attr == "shape":
            array, at = self.term(node.value.value), self.literal(node.slice)
            if array.kind != "name" or not isinstance(array.type, Array) or at not in range(array.type.dimensions):
                raise self.refused(node, f"'{ast.unparse(node)}' is no extent of an array")
            return (
                Term("number", INT, (), array.type.shape[at]) if array.type.shape else Term("extent", INT, (array,), at)
            )
        owner = self.term(node.value)
        if isinstance(owner.type, Array):
            return self.element(owner, owner.type, node)
        if not isinstance(owner.type, Items | Row):
            raise self.refused(node, f"'{ast.unparse(node.value)}' has no items")
        count = count_of(owner.type)
        if isinstance(node.slice, ast.Slice):
            parts = tuple(typed.item_of(owner, place) for place in range(count)[self.part(node.slice)])
            return Term("build", Items(tuple(part.type for part in parts)), parts)
        place = self.whole(node.slice)
        number = _literal(place)
        if number is not None:
            if not -count <= number < count:
                raise self.refused(node, f"'{ast.unparse(node)}' is beyond the {count} items")
            return typed.item_of(owner, range(count)[number])
        if not isinstance(owner.type, Items) or not owner.type.is_uniform:
            raise self.refused(node, f"'{ast.unparse(node)}' takes an item of a tuple of several types by a variable")
        return Term("item", owner.type.types[0], (owner, self.from_start(place, Term("number", INT, (), count))))

    def element(self, owner: Term, kind: Array, node: ast.Subscript) -> Term:
        """An element of an array, which has all its places, or a part of it from one first place up to another."""
        if owner.kind != "name":
            raise self.refused(node, f"'{ast.unparse(node)}' is taken of an array without a name")
        if isinstance(node.slice, ast.Slice):
            return self.part_of_array(owner, kind, node.slice)
        places = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        extents = kind.shape or (None,) * kind.dimensions
        if len(places) != len(extents):
            raise self.refused(node, f"'{ast.unparse(node)}' does not have {len(extents)} places")
        given = []
        for at, (place, extent) in enumerate(zip(places, extents, strict=True)):
            count = Term("extent", INT, (owner,), at) if extent is None else Term("number", INT, (), extent)
            given.append(self.from_start(self.whole(place), count))
        return Term("element", FLOAT, (owner, *given))

    def part_of_array(self, owner: Term, kind: Array, node: ast.Slice) -> Term:
        """The places of an array from one up to another, which are in it: what is beyond is not looked for."""
        if node.lower is None or node.upper is None or node.step is not None or kind.shape:
            raise self.refused(node, f"'{ast.unparse(node)}' is not from one place of an array up to another")
        count = Term("extent", INT, (owner,), 0)
        first, beyond = (self.from_start(self.whole(item), count) for item in (node.lower, node.upper))
        return Term("part", Array(kind.dimensions), (owner, first, beyond))

    def from_start(self, place: Term, count: Term) -> Term:
        """A place counted from the start, where Python counts a negative one from the end."""
        if self.is_from_zero(place):
            return place
        is_negative = Term("<", BOOL, (place, Term("number", INT, (), 0)))
        return Term("choice", INT, (is_negative, Term("+", INT, (place, count)), place))

    def is_from_zero(self, item: Term) -> bool:
        """True for a whole number that cannot be negative."""
        if item.kind in ("number", "%", "//", ">>", "&") and item.type == INT:
            known = item if item.kind == "number" else item.parts[1]
            is_literal = (_literal(known) or 0) > 0 or (item.kind == "number" and _literal(known) == 0)
            return is_literal and (item.kind in ("number", "%", "&") or self.is_from_zero(item.parts[0]))
        if item.kind == "name":
            return item.detail in self.counters
        if item.kind in ("+", "*", "min"):
            return all(map(self.is_from_zero, item.parts))
        if item.kind == "choice":
            return all(map(self.is_from_zero, item.parts[1:]))
        return item.kind == "extent" or (item.kind == "convert" and item.parts[0].type == BOOL)

    def _of_tuple(self, node: ast.Tuple) -> Term:
        parts = tuple(part for item in node.elts for part in self.items(item))
        return Term("build", Items(tuple(part.type for part in parts)), parts)

    def items(self, node: ast.expr) -> list[Term]:
        """What an item of a tuple that is written out stands for: itself, or with a star all that it holds."""
        if not isinstance(node, ast.Starred):
            return [self.term(node)]
        whole = self.term(node.value)
        if not isinstance(whole.type, Items | Row):
            raise self.refused(node, f"'{ast.unparse(node)}' is no tuple")
        return [typed.item_of(whole, place) for place in range(count_of(whole.type))]

    def _of_unaryop(self, node: ast.UnaryOp) -> Term:
        if isinstance(node.op, ast.Not):
            return Term("not", BOOL, (self.condition(node.operand),))
        if not isinstance(node.op, ast.USub):
            raise self.refused(node, f"'{ast.unparse(node)}'")
        value = self.scalar(node.operand, INT)
        return Term("negative", value.type, (value,))

    def _of_binop(self, node: ast.BinOp) -> Term:
        if isinstance(node.op, ast.Pow) and "pow" in self.library:
            return self.power(node)
        sign = SIGN_OF.get(type(node.op), "")
        left, right = self.scalar(node.left, INT), self.scalar(node.right, INT)
        is_whole = left.type == right.type == INT
        if not sign or (not is_whole and sign in WHOLE_ONLY | {"//", "%"}):
            raise self.refused(node, f"'{ast.unparse(node)}' needs a library function")
        if sign == ">>" and _literal(right) not in range(64):
            raise self.refused(node, f"'{ast.unparse(node)}' shifts by what is not written out as 0 to 63")
        kind = INT if is_whole and sign != "/" else FLOAT
        return Term(sign, kind, (converted(left, kind), converted(right, kind)))

    def power(self, node: ast.BinOp) -> Term:
        """A power of floats; compilers make something else of one whose base or exponent they see."""
        parts = tuple(self.scalar(item, FLOAT) for item in (node.left, node.right))
        if any((part.parts[0] if part.kind == "negative" else part).kind == "number" for part in parts):
            raise self.refused(node, f"'{ast.unparse(node)}', a power of a number or by a number that is written out")
        return Term("pow", FLOAT, parts)

    def _of_boolop(self, node: ast.BoolOp) -> Term:
        parts = [self.term(item) for item in node.values]
        if any(part.type != BOOL for part in parts):
            raise self.refused(node, f"the value of '{ast.unparse(node)}', which is no truth value in Python")
        return _linked(node, parts)

    def _of_compare(self, node: ast.Compare) -> Term:
        values = [self.scalar(item, INT) for item in (node.left, *node.comparators)]
        made: Term | None = None
        for sign, left, right in zip(node.ops, values, values[1:], strict=False):
            kind = joined(left.type, right.type)
            if type(sign) not in SIGN_OF or kind is None:
                raise self.refused(node, f"'{ast.unparse(node)}'")
            if kind == FLOAT and not all(map(self.is_exact, (left, right))):
                raise self.refused(node, f"'{ast.unparse(node)}' compares a whole number with a float")
            one = Term(SIGN_OF[type(sign)], BOOL, (converted(left, kind), converted(right, kind)))
            made = one if made is None else Term("and", BOOL, (made, one))
        assert made is not None
        return made

    def is_exact(self, item: Term) -> bool:
        """True for what a float holds exactly: a float, a truth value, a small literal, a counter."""
        number = _literal(item)
        if item.type == FLOAT or number is not None:
            return number is None or abs(number) <= EXACT
        return (item.kind == "convert" and item.parts[0].type == BOOL) or (
            item.kind == "name" and item.detail in self.counters
        )

    def _of_ifexp(self, node: ast.IfExp) -> Term:
        test, yes, no = self.condition(node.test), self.term(node.body), self.term(node.orelse)
        kind = joined(yes.type, no.type)
        if kind is None:
            raise self.refused(node, "a choice between values of different forms")
        if typed.mixes(yes.type, no.type):
            raise self.refused(node, f"'{ast.unparse(node)}', a choice between a whole number and a float")
        return Term("choice", kind, (test, converted(yes, kind), converted(no, kind)))

    def name_called(self, node: ast.Call) -> str:
        """The name of what is called; that of the function itself where it was handed over."""
        name = node.func.id if isinstance(node.func, ast.Name) else ast.unparse(node.func)
        if any(isinstance(item, ast.Starred) for item in node.args):
            raise self.refused(node, f"'{ast.unparse(node)}' hands over a tuple as arguments")
        handed = self.types.get(name)
        return handed.name if isinstance(handed, Handed) else name

    def _of_call(self, node: ast.Call) -> Term:
        name = self.name_called(node)
        if name in self.rows:
            return self.build(name, node)
        if name in self.definitions:
            function, given = self.called(name, node)
            if function.returns is None:
                raise self.refused(node, f"'{name}' returns nothing")
            return Term("call", function.returns, given, function.name)
        return self.built_in(name, node)

    def build(self, name: str, node: ast.Call) -> Term:
        """A row from its fields."""
        fields = self.rows[name]
        given = dict(zip(fields, map(self.term, node.args), strict=False))
        given |= {str(item.arg): self.term(item.value) for item in node.keywords}
        if set(given) != set(fields):
            raise self.refused(node, f"'{ast.unparse(node)}' does not give every field")
        parts = tuple(given[item] for item in fields)
        return Term("build", Row(name, tuple((item, given[item].type) for item in fields)), parts)

    def called(self, name: str, node: ast.Call) -> tuple[Function, tuple[Term, ...]]:
        """Another function of the module that is called, and what it is handed."""
        takes = self.definitions[name].args
        names = [item.arg for item in (*takes.posonlyargs, *takes.args, *takes.kwonlyargs)]
        placed = [item.arg for item in (*takes.posonlyargs, *takes.args)]
        defaults = dict(zip(placed[::-1], takes.defaults[::-1], strict=False))
        defaults |= {item.arg: value for item, value in zip(takes.kwonlyargs, takes.kw_defaults, strict=True) if value}
        given = {item: self.term(value) for item, value in defaults.items()}
        given |= dict(zip(names, map(self.term, node.args), strict=False))
        given |= {str(item.arg): self.term(item.value) for item in node.keywords}
        if set(given) != set(names):
            raise self.refused(node, f"'{ast.unparse(node)}' does not give every argument")
        types = tuple(given[item].type for item in names)
        if any(isinstance(kind, Array) and kind.shape for kind in types):
            raise self.refused(node, f"'{ast.unparse(node)}' hands over an array of its own")
        return self.made(name, types), tuple(given[item] for item in names if not is_empty(given[item].type))

    def built_in(self, name: str, node: ast.Call) -> Term:
        """A call of a function that every language has."""
        own = name.removeprefix("math.")
        least = FLOAT if own in LIBRARY | {"sqrt", "float"} else INT
        known = FUNCTIONS | {"float", "int", "bool", "len"} | (self.library - {"pow"})
        if own not in known or node.keywords:
            raise self.refused(node, f"'{name}' is a function of a library")
        if len(node.args) < 1 or (own in ("min", "max")) != (len(node.args) > 1):
            raise self.refused(node, f"'{ast.unparse(node)}' with {len(node.args)} arguments")
        if own == "len":
            kind = self.term(node.args[0]).type
            if not isinstance(kind, Items | Row):
                raise self.refused(node, f"'{ast.unparse(node.args[0])}' has no items")
            return Term("number", INT, (), count_of(kind))
        if own == "bool":
            return self.condition(node.args[0])
        values = [self.scalar(item, least) for item in node.args]
        if own == "float":
            return values[0]
        if own == "int":
            return values[0] if values[0].type == INT else Term("convert", INT, (values[0],))
        return self.joined_by(own, values, node)

    def joined_by(self, own: str, values: list[Term], node: ast.Call) -> Term:
        """The size or root of one number, or the smallest or largest of several of one type."""
        if len({value.type for value in values}) > 1:
            raise self.refused(node, f"'{ast.unparse(node)}', a choice between a whole number and a float")
        kind = values[0].type
        made, *others = [converted(value, kind) for value in values]
        if not others:
            return Term(own, kind, (made,))
        for other in others:
            made = Term(own, kind, (made, other))
        return made


def _linked(node: ast.BoolOp, parts: list[Term]) -> Term:
    """Truth values with ``and`` or ``or`` between them."""
    made = parts[0]
    for part in parts[1:]:
        made = Term(SIGN_OF[type(node.op)], BOOL, (made, part))
    return made


def _literal(item: Term) -> int | None:
    """The whole number that a term writes out; None for any other term."""
    sign, item = (-1, item.parts[0]) if item.kind == "negative" else (1, item)
    return sign * int(item.detail) if item.kind == "number" and item.type == INT else None
