"""Type inference for a composed module: types of all names, and typed statements for each line.

A function is analysed once for each combination of parameter types. A function passed as an argument counts as a type,
so that the call is bound at translation. Code outside the subset is refused with the file and line of its source.
"""

import ast
import linecache
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from itertools import chain
from typing import Any

from ppafo.engine.compilers import LIBRARY, UntranslatableError
from ppafo.engine.plain_python import parse_module, place_in, refusal
from ppafo.errors import ProgramError
from ppafo.translation import typed
from ppafo.translation.scopes import ScopeNames, changed, needed
from ppafo.translation.typed import FUNCTIONS, Function, Module, Parameter, Statement, Term, converted
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
    entries_of,
    is_empty,
    joined,
    mixes,
    types_in,
)
from ppafo.wording import nearest_name

SIGN_OF: dict[type[ast.AST], str] = {
    **{ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "//", ast.Mod: "%"},
    **{ast.BitAnd: "&", ast.BitOr: "|", ast.BitXor: "^", ast.RShift: ">>"},
    **{ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="},
    **{ast.And: "and", ast.Or: "or"},
}
CONSTANTS = {"inf": math.inf, "nan": math.nan, "pi": math.pi}
EXACT = 2**53
"""Largest magnitude up to which a float represents every integer."""
WHOLE_ONLY = frozenset({"&", "|", "^", ">>"})


@dataclass(frozen=True, slots=True)
class Expressions:
    """Type inference for the expressions of one function.

    ``types`` has the types of local names, ``counters`` names that only count up from 0, ``rows`` the fields of each
    row class, ``definitions`` the functions of the module, and ``library`` the C library functions that may be called.
    ``made`` returns the function for given parameter types. ``refused`` creates the error for untranslatable code,
    ``mistaken`` the error for code that is invalid in Python as well.
    """

    types: Mapping[str, Type]
    counters: Collection[str]
    rows: Mapping[str, Sequence[str]]
    definitions: Mapping[str, ast.FunctionDef]
    library: frozenset[str]
    made: Callable[[str, tuple[Type, ...]], Function]
    refused: Callable[[ast.AST, str], ProgramError]
    mistaken: Callable[..., ProgramError]

    def term(self, node: ast.expr) -> Term:
        """Return the typed term of an expression."""
        handler: Callable[[Any], Term] | None = getattr(self, f"_of_{type(node).__name__.lower()}", None)
        if handler is None:
            raise self.refused(node, f"'{ast.unparse(node)}' is not supported in compiled functions")
        return handler(node)

    def scalar(self, node: ast.expr, least: Scalar = BOOL) -> Term:
        """Return the term of an expression that must be a single number, converted to ``least`` or a wider type."""
        term = self.term(node)
        if not isinstance(term.type, Scalar):
            raise self.refused(node, f"'{ast.unparse(node)}' is not one number")
        kind = joined(term.type, least)
        assert kind is not None
        return converted(term, kind)

    def integer(self, node: ast.expr) -> Term:
        """Return the term of an expression that must be an integer."""
        term = self.scalar(node, INT)
        if term.type != INT:
            raise self.refused(node, f"'{ast.unparse(node)}' is not an integer")
        return term

    def condition(self, node: ast.expr) -> Term:
        """Return the term of an expression used as a condition."""
        if isinstance(node, ast.BoolOp):
            return _linked(node, [self.condition(value) for value in node.values])
        term = self.scalar(node)
        return term if term.type == BOOL else Term("!=", BOOL, (term, converted(Term("number", INT, (), 0), term.type)))

    def literal_slice(self, node: ast.expr) -> slice:
        """Return the slice of a tuple, whose bounds must be literals."""
        if not isinstance(node, ast.Slice) or node.step is not None:
            raise self.refused(node, f"'{ast.unparse(node)}' is not a part of a tuple")
        return slice(*(None if bound is None else self.literal(bound) for bound in (node.lower, node.upper)))

    def literal(self, node: ast.expr) -> int:
        """Return the value of an integer literal."""
        number = _literal(self.integer(node))
        if number is None:
            raise self.refused(node, f"'{ast.unparse(node)}' must be a literal number")
        return number

    def _of_constant(self, node: ast.Constant) -> Term:
        kinds: dict[type, Type] = {bool: BOOL, int: INT, float: FLOAT}
        is_too_large = type(node.value) is int and node.value >= 2**63
        # Beyond 63 bits C has no signed number.
        if type(node.value) not in kinds or is_too_large:
            raise self.refused(node, f"the constant {node.value!r}")
        return Term("number", kinds[type(node.value)], (), node.value)

    def _of_name(self, node: ast.Name) -> Term:
        if node.id in self.types:
            return Term("name", self.types[node.id], (), node.id)
        if node.id in self.definitions:
            return Term("name", FunctionArgument(node.id), (), node.id)
        raise self.refused(node, f"'{node.id}' has no value")

    def _of_attribute(self, node: ast.Attribute) -> Term:
        if isinstance(node.value, ast.Name) and node.value.id == "math" and node.attr in CONSTANTS:
            return Term("number", FLOAT, (), CONSTANTS[node.attr])
        owner = self.term(node.value)
        row = owner.type.row if isinstance(owner.type, RowReference) else owner.type
        if not isinstance(row, Row) or node.attr not in dict(row.fields):
            fields = [field for field, _ in row.fields] if isinstance(row, Row) else []
            hint = nearest_name(node.attr, fields) or f"; it has {', '.join(fields)}"
            problem = f"has no '{node.attr}'{hint}" if fields else f"is {kind_of(row)} and has no '{node.attr}'"
            raise self.mistaken(node, f"{ast.unparse(node.value)} {problem}", f".{node.attr}")
        return typed.field_of(owner, node.attr)

    def _of_subscript(self, node: ast.Subscript) -> Term:
        if isinstance(node.value, ast.Attribute) and node.value.attr == "shape":
            array, dimension = self.term(node.value.value), self.literal(node.slice)
            kind = array.type
            if array.kind != "name" or not isinstance(kind, Array) or dimension not in range(kind.dimensions):
                raise self.refused(node, f"'{ast.unparse(node)}' is not an extent of an array")
            return (
                Term("number", INT, (), kind.shape[dimension])
                if kind.shape
                else Term("extent", INT, (array,), dimension)
            )
        owner = self.term(node.value)
        if isinstance(owner.type, Array):
            return self.element(owner, owner.type, node)
        if not isinstance(owner.type, Items | Row):
            raise self.refused(node, f"'{ast.unparse(node.value)}' has no items")
        count = len(types_in(owner.type))
        if isinstance(node.slice, ast.Slice):
            parts = tuple(typed.item_of(owner, number) for number in range(count)[self.literal_slice(node.slice)])
            return Term("build", Items(tuple(part.type for part in parts)), parts)
        index = self.integer(node.slice)
        number = _literal(index)
        if number is not None:
            if not -count <= number < count:
                raise self.refused(node, f"'{ast.unparse(node)}' is beyond the {count} items")
            return typed.item_of(owner, range(count)[number])
        if not isinstance(owner.type, Items) or not owner.type.is_uniform:
            raise self.refused(node, f"'{ast.unparse(node)}' indexes a tuple of several types by a variable")
        return Term("item", owner.type.types[0], (owner, self.from_start(index, Term("number", INT, (), count))))

    def element(self, owner: Term, kind: Array, node: ast.Subscript) -> Term:
        """Return the term of an array element with all its indices, or of a slice along the first index."""
        if owner.kind != "name":
            raise self.refused(node, f"'{ast.unparse(node)}' indexes an array that has no name")
        if isinstance(node.slice, ast.Slice):
            begin, end = node.slice.lower, node.slice.upper
            if begin is None or end is None or node.slice.step is not None or kind.shape:
                problem = f"'{ast.unparse(node.slice)}' is not a slice with start and stop"
                raise self.refused(node.slice, problem)
            # Both bounds lie in it: what is beyond is not looked for.
            count = Term("extent", INT, (owner,), 0)
            bounds = (self.from_start(self.integer(bound), count) for bound in (begin, end))
            return Term("part", Array(kind.dimensions), (owner, *bounds))
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        extents = kind.shape or (None,) * kind.dimensions
        if len(indices) != len(extents):
            raise self.refused(node, f"'{ast.unparse(node)}' does not have {len(extents)} places")
        terms = []
        for dimension, (index, extent) in enumerate(zip(indices, extents, strict=True)):
            count = Term("extent", INT, (owner,), dimension) if extent is None else Term("number", INT, (), extent)
            terms.append(self.from_start(self.integer(index), count))
        return Term("element", FLOAT, (owner, *terms))

    def from_start(self, index: Term, count: Term) -> Term:
        """Return an index counted from the start, because Python counts negative indices from the end."""
        if self.is_from_zero(index):
            return index
        is_negative = Term("<", BOOL, (index, Term("number", INT, (), 0)))
        return Term("choice", INT, (is_negative, Term("+", INT, (index, count)), index))

    def is_from_zero(self, term: Term) -> bool:
        """Return whether an integer term cannot be negative."""
        if term.kind in ("number", "%", "//", ">>", "&") and term.type == INT:
            known = term if term.kind == "number" else term.parts[1]
            is_literal = (_literal(known) or 0) > 0 or (term.kind == "number" and _literal(known) == 0)
            return is_literal and (term.kind in ("number", "%", "&") or self.is_from_zero(term.parts[0]))
        if term.kind == "name":
            return term.detail in self.counters
        if term.kind in ("+", "*", "min"):
            return all(map(self.is_from_zero, term.parts))
        if term.kind == "choice":
            return all(map(self.is_from_zero, term.parts[1:]))
        return term.kind == "extent" or (term.kind == "convert" and term.parts[0].type == BOOL)

    def _of_tuple(self, node: ast.Tuple) -> Term:
        parts: list[Term] = []
        for element in node.elts:
            if not isinstance(element, ast.Starred):
                parts.append(self.term(element))
                continue
            unpacked = self.term(element.value)
            if not isinstance(unpacked.type, Items | Row):
                raise self.refused(element, f"'{ast.unparse(element)}' is no tuple")
            parts += [typed.item_of(unpacked, index) for index in range(len(types_in(unpacked.type)))]
        return Term("build", Items(tuple(part.type for part in parts)), tuple(parts))

    def _of_unaryop(self, node: ast.UnaryOp) -> Term:
        if isinstance(node.op, ast.Not):
            return Term("not", BOOL, (self.condition(node.operand),))
        if not isinstance(node.op, ast.USub):
            raise self.refused(node, f"'{ast.unparse(node)}'")
        value = self.scalar(node.operand, INT)
        return Term("negative", value.type, (value,))

    def _of_binop(self, node: ast.BinOp) -> Term:
        if isinstance(node.op, ast.Pow) and "pow" in self.library:
            parts = tuple(self.scalar(side, FLOAT) for side in (node.left, node.right))
            # Compilers replace powers of literals by products or roots, whose last bits differ from the library's.
            if any((part.parts[0] if part.kind == "negative" else part).kind == "number" for part in parts):
                problem = "a power with a literal base or exponent"
                raise self.refused(node, f"'{ast.unparse(node)}', {problem}")
            return Term("pow", FLOAT, parts)
        sign = SIGN_OF.get(type(node.op), "")
        self.check_sides(node, sign, self.term(node.left), self.term(node.right))
        left, right = self.scalar(node.left, INT), self.scalar(node.right, INT)
        is_whole = left.type == right.type == INT
        if not sign or (not is_whole and sign in WHOLE_ONLY | {"//", "%"}):
            raise self.refused(node, f"'{ast.unparse(node)}' needs a library function")
        # A shift by 64 or more, or by less than 0, is undefined in C.
        if sign == ">>" and _literal(right) not in range(64):
            raise self.refused(node, f"'{ast.unparse(node)}' shifts by other than a literal from 0 to 63")
        kind = INT if is_whole and sign != "/" else FLOAT
        return Term(sign, kind, (converted(left, kind), converted(right, kind)))

    def check_sides(self, node: ast.expr, sign: str, left: Term, right: Term) -> None:
        """Raise ProgramError for an operator between a number and a value of another kind."""
        if isinstance(left.type, Scalar) != isinstance(right.type, Scalar):
            sides = f"{kind_of(left.type)} and {kind_of(right.type)}"
            raise self.mistaken(node, f"'{sign}' cannot be compiled for {sides}, in '{{written}}'")

    def _of_boolop(self, node: ast.BoolOp) -> Term:
        parts = [self.term(value) for value in node.values]
        if any(part.type != BOOL for part in parts):
            raise self.refused(node, f"the value of '{ast.unparse(node)}', which is no truth value in Python")
        return _linked(node, parts)

    def _of_compare(self, node: ast.Compare) -> Term:
        sides = [self.term(side) for side in (node.left, *node.comparators)]
        for op, left, right in zip(node.ops, sides, sides[1:], strict=False):
            self.check_sides(node, SIGN_OF.get(type(op), ""), left, right)
        values = [self.scalar(side, INT) for side in (node.left, *node.comparators)]
        # A chain of comparisons is joined by "and"; its terms are free of side effects, so each may stand twice.
        made: Term | None = None
        for sign, left, right in zip(node.ops, values, values[1:], strict=False):
            kind = joined(left.type, right.type)
            if type(sign) not in SIGN_OF or kind is None:
                raise self.refused(node, f"'{ast.unparse(node)}'")
            # A large integer that becomes a float may round, and Python compares the exact numbers.
            if kind == FLOAT and not all(map(self.is_exact, (left, right))):
                raise self.refused(node, f"'{ast.unparse(node)}' compares a whole number with a float")
            comparison = Term(SIGN_OF[type(sign)], BOOL, (converted(left, kind), converted(right, kind)))
            made = comparison if made is None else Term("and", BOOL, (made, comparison))
        assert made is not None
        return made

    def is_exact(self, term: Term) -> bool:
        """Return whether a float represents the term exactly: a float, truth value, small literal or loop counter."""
        number = _literal(term)
        if term.type == FLOAT or number is not None:
            return number is None or abs(number) <= EXACT
        return (term.kind == "convert" and term.parts[0].type == BOOL) or (
            term.kind == "name" and term.detail in self.counters
        )

    def _of_ifexp(self, node: ast.IfExp) -> Term:
        test, yes, no = self.condition(node.test), self.term(node.body), self.term(node.orelse)
        kind = joined(yes.type, no.type)
        if kind is None:
            raise self.refused(node, "a choice between values of different types")
        # In C both sides get one type: an int that becomes a float loses digits, and -0 differs from 0.
        if mixes(yes.type, no.type):
            raise self.refused(node, f"'{ast.unparse(node)}', a choice between a whole number and a float")
        return Term("choice", kind, (test, converted(yes, kind), converted(no, kind)))

    def name_called(self, node: ast.Call) -> str:
        """Return the name of the called function, with functions passed as arguments resolved."""
        name = node.func.id if isinstance(node.func, ast.Name) else ast.unparse(node.func)
        if any(isinstance(argument, ast.Starred) for argument in node.args):
            raise self.refused(node, f"'{ast.unparse(node)}' passes a tuple as arguments")
        argument_type = self.types.get(name)
        return argument_type.name if isinstance(argument_type, FunctionArgument) else name

    def _of_call(self, node: ast.Call) -> Term:
        name = self.name_called(node)
        if name in self.rows:
            fields = self.rows[name]
            values = dict(zip(fields, map(self.term, node.args), strict=False))
            values |= {str(keyword.arg): self.term(keyword.value) for keyword in node.keywords}
            if set(values) != set(fields):
                raise self.refused(node, f"'{ast.unparse(node)}' does not give every field")
            parts = tuple(values[name] for name in fields)
            return Term("build", Row(name, tuple(zip(fields, (part.type for part in parts), strict=True))), parts)
        if name in self.definitions:
            function, arguments = self.called(name, node)
            if function.returns is None:
                raise self.refused(node, f"'{name}' returns nothing")
            return Term("call", function.returns, arguments, function.name)
        return self.built_in(name, node)

    def called(self, name: str, node: ast.Call) -> tuple[Function, tuple[Term, ...]]:
        """Return the called function of the module and the arguments passed to the function."""
        definition = self.definitions[name]
        takes = definition.args
        names = [argument.arg for argument in (*takes.posonlyargs, *takes.args, *takes.kwonlyargs)]
        positional = [argument.arg for argument in (*takes.posonlyargs, *takes.args)]
        defaults = dict(zip(positional[::-1], takes.defaults[::-1], strict=False))
        defaults |= {
            argument.arg: value for argument, value in zip(takes.kwonlyargs, takes.kw_defaults, strict=True) if value
        }
        values = {name: self.term(value) for name, value in defaults.items()}
        # Defaults first, then arguments by place, then by name: the last one holds.
        values |= dict(zip(names, map(self.term, node.args), strict=False))
        values |= {str(keyword.arg): self.term(keyword.value) for keyword in node.keywords}
        # What functions call each other with is known since they were composed; this is a call of the engine's own.
        missing = [name for name in names if name not in values]
        if missing or len(node.args) > len(positional) or len(values) > len(names):
            problem = f"missing a required argument: '{missing[0]}'" if missing else "too many arguments"
            called = f"({', '.join(map(ast.unparse, node.args))})"
            problem = f"{{name}}({', '.join(names)}): the engine calls it with {called}: {problem}"
            raise self.mistaken(definition, problem)
        types = tuple(values[name].type for name in names)
        # An array of known shape is a local one, which C hands over as a pointer of another type.
        if any(isinstance(kind, Array) and kind.shape for kind in types):
            raise self.refused(node, f"'{ast.unparse(node)}' passes an array expression")
        return self.made(name, types), tuple(values[name] for name in names if not is_empty(values[name].type))

    def built_in(self, name: str, node: ast.Call) -> Term:
        """Return the term of a call of a function available in every language."""
        function = name.removeprefix("math.")
        least = FLOAT if function in LIBRARY | {"sqrt", "float"} else INT
        known = FUNCTIONS | {"float", "int", "bool", "len"} | (self.library - {"pow"})
        if function not in known or node.keywords:
            raise self.refused(node, f"'{name}' is a function of a library{_INSTEAD.get(function, '')}")
        if len(node.args) < 1 or (function in ("min", "max")) != (len(node.args) > 1):
            raise self.refused(node, f"'{ast.unparse(node)}' with {len(node.args)} arguments")
        # Lengths of tuples are known: they become numbers.
        if function == "len":
            kind = self.term(node.args[0]).type
            if not isinstance(kind, Items | Row):
                raise self.refused(node, f"'{ast.unparse(node.args[0])}' has no items")
            return Term("number", INT, (), len(types_in(kind)))
        if function == "bool":
            return self.condition(node.args[0])
        made, *others = [self.scalar(argument, least) for argument in node.args]
        kind = made.type
        if function in ("float", "int"):
            return made if function == "float" or kind == INT else Term("convert", INT, (made,))
        # Python's min returns the number as it is, an int or a float: C has one type for both.
        if any(other.type != kind for other in others):
            raise self.refused(node, f"'{ast.unparse(node)}', a choice between a whole number and a float")
        if not others:
            return Term(function, kind, (made,))
        for other in others:
            made = Term(function, kind, (made, other))
        return made


def _linked(node: ast.BoolOp, parts: list[Term]) -> Term:
    """Join truth values by ``and`` or ``or``."""
    made = parts[0]
    for part in parts[1:]:
        made = Term(SIGN_OF[type(node.op)], BOOL, (made, part))
    return made


def _as_written(problem: str, written: str) -> str:
    """Insert the source line, and the name defined in this line, into the text of a problem."""
    name = written.removeprefix("def ").partition("(")[0]
    return problem.replace("{written}", written).replace("{name}", name)


def kind_of(kind: Type) -> str:
    """Return the description of a type used in messages."""
    if isinstance(kind, Scalar):
        return "a number"
    if isinstance(kind, Row):
        return f"a {kind.name.rpartition('_')[2]}"
    return "a tuple" if isinstance(kind, Items) else "no number"


_INSTEAD = {
    "exp": ", whose last bits differ between computers: decay_factors(rate, step) of ppafo.model.sensors gives "
    "exp(-rate * step) with the same bits everywhere, exponential(exponent) of ppafo.model.elementary any other",
    "log": ", whose last bits differ between computers: take logarithm(number) of ppafo.model.elementary",
    "pow": ", whose last bits differ between computers: take power(base, exponent) of ppafo.model.elementary",
}
"""Replacement for a function of a library, if the package has one."""


def _literal(term: Term) -> int | None:
    """Return the value of an integer literal; None for any other term."""
    sign, term = (-1, term.parts[0]) if term.kind == "negative" else (1, term)
    return sign * int(term.detail) if term.kind == "number" and term.type == INT else None


def walk_module(
    source: str, entries: Mapping[str, tuple[Type, ...]] | None = None, library: frozenset[str] = frozenset()
) -> Module:
    """Return the typed functions that the entries of a composed module need. ProgramError for code outside the subset.

    ``entries`` maps function names to parameter types; by default the functions that declare their types in a
    decorator. ``library`` has the functions of ``LIBRARY`` that may be called.
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
        """Return the function specialised for the given parameter types."""
        key = name, types
        if key not in self.done:
            definition = self.definitions[name]
            if key in self.open:
                raise self.refused(definition, f"'{name}' calls itself")
            self.open.add(key)
            # Each choice of types is a function of its own, since C has no overloading.
            number, unique_name = 1, name
            while unique_name in self.names or (number > 1 and unique_name in {*self.definitions, *self.rows}):
                number += 1
                unique_name = f"{name}_{number}"
            # Reserved before the body is walked, in which the same function may be met for other types.
            self.names.add(unique_name)
            self.done[key] = _FunctionWalk(self, definition).walked(unique_name, types)
            self.module.append(self.done[key])
        return self.done[key]

    def refused(self, where: ast.AST, problem: str) -> ProgramError:
        """Return the error for untranslatable code at a node, with file and line of the original source."""
        number = getattr(where, "lineno", 0)
        place = place_in(self.lines, number)
        problem = f"{problem}, which cannot be translated"
        if place is None:
            return UntranslatableError(f"the lane loop, line {number} of the composed module: {problem}")
        return UntranslatableError(str(refusal(place.file, place.line, problem)))

    def mistaken(self, where: ast.AST, problem: str, sought: str = "") -> ProgramError:
        """Return the error for invalid code at a node, with file and line of the source that contains ``sought``.

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


class _FunctionWalk:
    """Translation of one function for one combination of types; repeated if a name turns out to have a wider type."""

    def __init__(self, module: _ModuleWalk, definition: ast.FunctionDef) -> None:
        self.module = module
        self.refused = module.refused
        self.definition = definition
        self.types: dict[str, Type] = {}
        if definition.name not in module.scope_names:
            module.scope_names[definition.name] = ScopeNames.of(definition)
        names = module.scope_names[definition.name]
        self.names, self.read = names.every, names.read
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
        """Return the function as typed statements."""
        parameters = self.definition.args
        names = [argument.arg for argument in (*parameters.posonlyargs, *parameters.args, *parameters.kwonlyargs)]
        self.types.update(zip(names, types, strict=True))
        # A name that gets a wider type further down, as in a loop, has it from the beginning: the body is translated
        # again until no type changes, which ends because types only widen.
        self.has_widened = True
        while self.has_widened:
            self.has_widened, self.flags = False, 0
            self.fresh_names.clear()
            body = self.block(self.definition.body)
        for parameter, kind in zip(names, types, strict=True):
            if self.types[parameter] != kind:
                problem = f"'{parameter}' is given as one type and becomes another; give the second a name of its own"
                raise self.refused(self.definition, problem)
        if self.writes is not None and self.returns is not None:
            raise self.refused(self.writes, f"'{self.definition.name}' returns a value and writes into an array")
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
            raise self.refused(node, f"'{ast.unparse(node).splitlines()[0]}' is not supported in compiled functions")
        return handler(node)

    def do_expr(self, node: ast.Expr) -> list[Statement]:
        if isinstance(node.value, ast.Constant):
            return [typed.Note(node.value.value)] if isinstance(node.value.value, str) else []
        name = self.values.name_called(node.value) if isinstance(node.value, ast.Call) else ""
        if not isinstance(node.value, ast.Call) or name not in self.module.definitions:
            raise self.refused(node, f"'{ast.unparse(node)}' is not supported in compiled functions")
        function, arguments = self.values.called(name, node.value)
        if function.returns is not None:
            raise self.refused(node, f"'{ast.unparse(node)}' discards its return value")
        self.writes = node
        return [typed.ProcedureCall(function.name, arguments)]

    def do_return(self, node: ast.Return) -> list[Statement]:
        if node.value is None:
            raise self.refused(node, "'return' without a value")
        value = self.values.term(node.value)
        kind = value.type if self.returns is None else joined(self.returns, value.type)
        if kind is None:
            kinds = sorted({kind_of(kind) for kind in (self.returns, value.type) if kind is not None})
            problem = f"the paths through the function return different types: {' or '.join(kinds)}"
            raise self.module.mistaken(self.first_return or node, problem)
        if self.returns is not None and mixes(self.returns, value.type):
            raise self.refused(node, "a function that returns a whole number in one place and a float in another")
        self.has_widened |= self.returns is not None and kind != self.returns
        self.returns, self.first_return = kind, self.first_return or node
        return [typed.Return(converted(value, kind))]

    def do_for(self, node: ast.For) -> list[Statement]:
        if not isinstance(node.target, ast.Name):
            raise self.refused(node, f"'for {ast.unparse(node.target)}'")
        call, name = node.iter, node.target.id
        if not (isinstance(call, ast.Call) and ast.unparse(call.func) == "range"):
            return self.loop_over_items(name, node)
        bounds = [self.values.integer(bound) for bound in call.args]
        if not 1 <= len(bounds) <= 3 or call.keywords:
            raise self.refused(node, f"'{ast.unparse(call)}'")
        start, stop = (Term("number", INT, (), 0), bounds[0]) if len(bounds) == 1 else bounds[:2]
        step = self.values.literal(call.args[2]) if len(bounds) == 3 else 1
        if step == 0:
            raise self.refused(node, f"'{ast.unparse(call)}' discards its result")
        self.note_type(name, INT, node)
        before: list[Statement] = []
        if stop.reads & {name, *changed(node.body)}:
            # Python asks for the end of a range once.
            end = self.fresh(f"{name}_stop", INT)
            before, stop = [self.assign(end, stop, node)], Term("name", INT, (), end)
        return [*before, *self.loop(node, lambda: typed.CountedLoop(name, start, stop, step, self.block(node.body)))]

    def loop_over_items(self, name: str, node: ast.For) -> list[Statement]:
        """Translate a loop over a tuple or a slice of a tuple into a counted loop."""
        owner = self.values.term(node.iter.value if isinstance(node.iter, ast.Subscript) else node.iter)
        if not isinstance(owner.type, Items) or not owner.type.is_uniform:
            raise self.refused(node, f"'{ast.unparse(node.iter)}' is no tuple of one type")
        if owner.reads & {name, *changed(node.body)}:
            raise self.refused(node, f"a loop over '{ast.unparse(node.iter)}' that changes it")
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
            raise self.refused(node, "one value assigned to several names")
        target, right = node.targets[0], node.value
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
            raise self.refused(node, f"'{ast.unparse(target)}' on the left")
        owner = element.parts[0].type
        if isinstance(owner, Array) and not owner.shape:
            self.writes = node
        return [typed.Store(element, converted(value, FLOAT))]

    def set_field(self, target: ast.Attribute, value: Term) -> Statement:
        """Translate an assignment to a field of a row, which only texts written for translation contain."""
        element = self.values.term(ast.copy_location(ast.Attribute(target.value, target.attr, ast.Load()), target))
        owner = element
        while owner.kind in ("field", "item"):
            owner = owner.parts[0]
        is_shared = isinstance(owner.type, RowReference)
        if owner.kind != "name" or element is owner or (owner.detail in self.parameters and not is_shared):
            raise self.refused(target, f"'{ast.unparse(target)}' on the left")
        if joined(element.type, value.type) != element.type:
            raise self.refused(target, f"'{ast.unparse(target)}' gets a value of another type")
        if is_shared:
            self.writes = target
        return typed.Store(element, converted(value, element.type))

    def assign(self, name: str, value: Term, node: ast.AST) -> Statement:
        """Translate an assignment to a name, with the value converted to the inferred type of the name."""
        self.note_type(name, value.type, node)
        return typed.Assign(name, converted(value, self.types[name]))

    def fresh(self, wanted: str, kind: Type) -> str:
        """Return an unused local name for values of a given type."""
        while wanted in self.names or wanted in self.fresh_names or joined(self.types.get(wanted, kind), kind) is None:
            wanted += "_"
        self.fresh_names.add(wanted)
        return wanted

    def note_type(self, name: str, kind: Type, node: ast.AST) -> None:
        """Widen the inferred type of a name as required by a new value."""
        before = self.types.get(name, kind)
        joint = joined(before, kind)
        if joint is None:
            raise self.refused(node, f"'{name}' holds values of different types")
        if mixes(before, kind):
            raise self.refused(node, f"'{name}' holds a whole number in one place and a float in another")
        self.has_widened |= joint != before
        self.types[name] = joint

    def assign_items(self, target: ast.Tuple, value: Term, node: ast.Assign) -> list[Statement]:
        """Translate tuple unpacking: the right-hand side is evaluated completely before any target is assigned."""
        names = [name.id for name in target.elts if isinstance(name, ast.Name)]
        is_stored = len(names) < len(target.elts)
        kind = value.type
        if not isinstance(kind, Items | Row) or len(types_in(kind)) != len(target.elts):
            other = "" if isinstance(kind, Items | Row) else f", not {kind_of(kind)}"
            raise self.module.mistaken(node, f"'{{written}}' needs as many values as there are names{other}")
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
