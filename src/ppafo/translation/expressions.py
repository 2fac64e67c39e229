"""Type inference for expressions of a composed module: a typed term for each expression.

Code outside the subset is refused with the file and line of its source.
"""

import ast
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ppafo.engine.compilers import LIBRARY
from ppafo.errors import ProgramError
from ppafo.translation import typed
from ppafo.translation.typed import FUNCTIONS, Function, Term, converted
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
"""Largest magnitude up to which floats represent every integer."""
INTEGER_OPERATORS = frozenset({"&", "|", "^", ">>"})
_REMEDIES = {
    "exp": ", because its last bits differ between computers; for exp(-rate * step) use decay_factors(rate, step) of "
    "ppafo.model.sensors, otherwise exponential(exponent) of ppafo.model.elementary",
    "log": ", because its last bits differ between computers; use logarithm(number) of ppafo.model.elementary",
    "pow": ", because its last bits differ between computers; use power(base, exponent) of ppafo.model.elementary",
}
"""Remedy for an unsupported library function, if the package has a replacement."""


@dataclass(frozen=True, slots=True)
class Expressions:
    """Type inference for the expressions of a function.

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
            raise self.refused(node, f"the expression '{ast.unparse(node)}' is not supported")
        return handler(node)

    def scalar(self, node: ast.expr, least: Scalar = BOOL) -> Term:
        """Return the term of an expression that must be a number, converted at least to type ``least``."""
        term = self.term(node)
        if not isinstance(term.type, Scalar):
            raise self.refused(node, f"'{ast.unparse(node)}' must be a single number")
        kind = joined(term.type, least)
        assert kind is not None
        return converted(term, kind)

    def integer(self, node: ast.expr) -> Term:
        """Return the term of an expression that must be an integer."""
        term = self.scalar(node, INT)
        if term.type != INT:
            raise self.refused(node, f"'{ast.unparse(node)}' must be an integer")
        return term

    def condition(self, node: ast.expr) -> Term:
        """Return the term of an expression used as a condition."""
        if isinstance(node, ast.BoolOp):
            return _linked(node, [self.condition(value) for value in node.values])
        term = self.scalar(node)
        return term if term.type == BOOL else Term("!=", BOOL, (term, converted(Term("number", INT, (), 0), term.type)))

    def literal_slice(self, node: ast.expr) -> slice:
        """Return the slice of a tuple index, whose bounds must be literals."""
        if not isinstance(node, ast.Slice) or node.step is not None:
            raise self.refused(node, f"the index '{ast.unparse(node)}' must be a slice without a step, such as 1:3")
        return slice(*(None if bound is None else self.literal(bound) for bound in (node.lower, node.upper)))

    def literal(self, node: ast.expr) -> int:
        """Return the value of an integer literal."""
        number = _literal(self.integer(node))
        if number is None:
            raise self.refused(node, f"'{ast.unparse(node)}' must be an integer literal")
        return number

    def _of_constant(self, node: ast.Constant) -> Term:
        kinds: dict[type, Type] = {bool: BOOL, int: INT, float: FLOAT}
        is_too_large = type(node.value) is int and node.value >= 2**63
        # Beyond 63 bits C has no signed number.
        if type(node.value) not in kinds or is_too_large:
            raise self.refused(
                node, f"the constant {node.value!r} must be a float, a boolean or an integer of at most 63 bits"
            )
        return Term("number", kinds[type(node.value)], (), node.value)

    def _of_name(self, node: ast.Name) -> Term:
        if node.id in self.types:
            return Term("name", self.types[node.id], (), node.id)
        if node.id in self.definitions:
            return Term("name", FunctionArgument(node.id), (), node.id)
        raise self.refused(node, f"the name '{node.id}' is not defined")

    def _of_attribute(self, node: ast.Attribute) -> Term:
        if isinstance(node.value, ast.Name) and node.value.id == "math" and node.attr in CONSTANTS:
            return Term("number", FLOAT, (), CONSTANTS[node.attr])
        owner = self.term(node.value)
        row = owner.type.row if isinstance(owner.type, RowReference) else owner.type
        if not isinstance(row, Row) or node.attr not in dict(row.fields):
            fields = [field for field, _ in row.fields] if isinstance(row, Row) else []
            hint = nearest_name(node.attr, fields) or f"; available: {', '.join(fields)}"
            problem = f"has no '{node.attr}'{hint}" if fields else f"is {kind_of(row)} and has no '{node.attr}'"
            raise self.mistaken(node, f"{ast.unparse(node.value)} {problem}", f".{node.attr}")
        return typed.field_of(owner, node.attr)

    def _of_subscript(self, node: ast.Subscript) -> Term:
        if isinstance(node.value, ast.Attribute) and node.value.attr == "shape":
            array = self.term(node.value.value)
            dimension = self.literal(node.slice)
            kind = array.type
            if array.kind != "name" or not isinstance(kind, Array) or dimension not in range(kind.dimensions):
                raise self.refused(node, f"'{ast.unparse(node)}' must be the size of an existing dimension of an array")
            return (
                Term("number", INT, (), kind.shape[dimension])
                if kind.shape
                else Term("extent", INT, (array,), dimension)
            )
        owner = self.term(node.value)
        if isinstance(owner.type, Array):
            return self.element(owner, owner.type, node)
        if not isinstance(owner.type, Items | Row):
            raise self.refused(node, f"'{ast.unparse(node.value)}' cannot be indexed, because it is not a tuple")
        count = len(types_in(owner.type))
        if isinstance(node.slice, ast.Slice):
            parts = tuple(typed.item_of(owner, number) for number in range(count)[self.literal_slice(node.slice)])
            return Term("build", Items(tuple(part.type for part in parts)), parts)
        index = self.integer(node.slice)
        number = _literal(index)
        if number is not None:
            if not -count <= number < count:
                raise self.refused(
                    node, f"the index of '{ast.unparse(node)}' is out of range; the tuple has {count} items"
                )
            return typed.item_of(owner, range(count)[number])
        if not isinstance(owner.type, Items) or not owner.type.is_uniform:
            raise self.refused(
                node, f"'{ast.unparse(node)}' indexes a tuple of several types; the index must be an integer literal"
            )
        return Term("item", owner.type.types[0], (owner, self.from_start(index, Term("number", INT, (), count))))

    def element(self, owner: Term, kind: Array, node: ast.Subscript) -> Term:
        """Return the term of an array element with all indices, or of a slice along the first index."""
        if owner.kind != "name":
            raise self.refused(node, f"'{ast.unparse(node)}' indexes an expression; assign the array to a name first")
        if isinstance(node.slice, ast.Slice):
            begin = node.slice.lower
            end = node.slice.upper
            if begin is None or end is None or node.slice.step is not None or kind.shape:
                problem = f"the slice '{ast.unparse(node.slice)}' must have a start, a stop and no step"
                raise self.refused(node.slice, problem)
            # Both bounds lie in it: what is beyond is not looked for.
            count = Term("extent", INT, (owner,), 0)
            bounds = (self.from_start(self.integer(bound), count) for bound in (begin, end))
            return Term("part", Array(kind.dimensions), (owner, *bounds))
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        extents = kind.shape or (None,) * kind.dimensions
        if len(indices) != len(extents):
            raise self.refused(node, f"'{ast.unparse(node)}' must have {len(extents)} indices, not {len(indices)}")
        terms = []
        for dimension, (index, extent) in enumerate(zip(indices, extents, strict=True)):
            count = Term("extent", INT, (owner,), dimension) if extent is None else Term("number", INT, (), extent)
            terms.append(self.from_start(self.integer(index), count))
        return Term("element", FLOAT, (owner, *terms))

    def from_start(self, index: Term, count: Term) -> Term:
        """Return an index counted from the start, since negative Python indices count from the end."""
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
                raise self.refused(element, f"'{ast.unparse(element)}' must be a tuple")
            parts += [typed.item_of(unpacked, index) for index in range(len(types_in(unpacked.type)))]
        return Term("build", Items(tuple(part.type for part in parts)), tuple(parts))

    def _of_unaryop(self, node: ast.UnaryOp) -> Term:
        if isinstance(node.op, ast.Not):
            return Term("not", BOOL, (self.condition(node.operand),))
        if not isinstance(node.op, ast.USub):
            raise self.refused(node, f"the operator in '{ast.unparse(node)}' is not supported")
        value = self.scalar(node.operand, INT)
        return Term("negative", value.type, (value,))

    def _of_binop(self, node: ast.BinOp) -> Term:
        if isinstance(node.op, ast.Pow) and "pow" in self.library:
            parts = tuple(self.scalar(side, FLOAT) for side in (node.left, node.right))
            # Compilers replace powers of literals by products or roots, whose last bits differ from the library's.
            if any((part.parts[0] if part.kind == "negative" else part).kind == "number" for part in parts):
                problem = "must not have a literal base or exponent; write a product, or use parameters"
                raise self.refused(node, f"the power '{ast.unparse(node)}' {problem}")
            return Term("pow", FLOAT, parts)
        sign = SIGN_OF.get(type(node.op), "")
        self.check_sides(node, sign, self.term(node.left), self.term(node.right))
        left = self.scalar(node.left, INT)
        right = self.scalar(node.right, INT)
        is_whole = left.type == right.type == INT
        if not sign or (not is_whole and sign in INTEGER_OPERATORS | {"//", "%"}):
            raise self.refused(node, f"the operator in '{ast.unparse(node)}' has no equivalent in C for these types")
        # A shift by 64 or more, or by less than 0, is undefined in C.
        if sign == ">>" and _literal(right) not in range(64):
            raise self.refused(node, f"'{ast.unparse(node)}' must shift by an integer literal from 0 to 63")
        kind = INT if is_whole and sign != "/" else FLOAT
        return Term(sign, kind, (converted(left, kind), converted(right, kind)))

    def check_sides(self, node: ast.expr, sign: str, left: Term, right: Term) -> None:
        """Raise ProgramError for an operator between a number and a value of another kind."""
        if isinstance(left.type, Scalar) != isinstance(right.type, Scalar):
            sides = f"{kind_of(left.type)} and {kind_of(right.type)}"
            raise self.mistaken(node, f"'{{written}}' applies '{sign}' to {sides}, which cannot be compiled")

    def _of_boolop(self, node: ast.BoolOp) -> Term:
        parts = [self.term(value) for value in node.values]
        if any(part.type != BOOL for part in parts):
            raise self.refused(node, f"the operands of '{ast.unparse(node)}' must be booleans")
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
                raise self.refused(node, f"the comparison '{ast.unparse(node)}' is not supported")
            # A large integer that becomes a float may round, and Python compares the exact numbers.
            if kind == FLOAT and not all(map(self.is_exact, (left, right))):
                raise self.refused(
                    node, f"'{ast.unparse(node)}' compares an integer with a float; convert the integer with float()"
                )
            comparison = Term(SIGN_OF[type(sign)], BOOL, (converted(left, kind), converted(right, kind)))
            made = comparison if made is None else Term("and", BOOL, (made, comparison))
        assert made is not None
        return made

    def is_exact(self, term: Term) -> bool:
        """Return whether a float represents a term exactly: float, flag, small literal or loop counter."""
        number = _literal(term)
        if term.type == FLOAT or number is not None:
            return number is None or abs(number) <= EXACT
        return (term.kind == "convert" and term.parts[0].type == BOOL) or (
            term.kind == "name" and term.detail in self.counters
        )

    def _of_ifexp(self, node: ast.IfExp) -> Term:
        test = self.condition(node.test)
        yes = self.term(node.body)
        no = self.term(node.orelse)
        kind = joined(yes.type, no.type)
        if kind is None:
            raise self.refused(node, f"both branches of '{ast.unparse(node)}' must have the same type")
        # In C both sides get one type: an int that becomes a float loses digits, and -0 differs from 0.
        if mixes(yes.type, no.type):
            raise self.refused(
                node, f"'{ast.unparse(node)}' mixes an integer and a float; convert the integer with float()"
            )
        return Term("choice", kind, (test, converted(yes, kind), converted(no, kind)))

    def name_called(self, node: ast.Call) -> str:
        """Return the name of a called function; a function argument is replaced by the function passed."""
        name = node.func.id if isinstance(node.func, ast.Name) else ast.unparse(node.func)
        if any(isinstance(argument, ast.Starred) for argument in node.args):
            raise self.refused(node, f"'{ast.unparse(node)}' expands a tuple into arguments; pass each argument")
        argument_type = self.types.get(name)
        return argument_type.name if isinstance(argument_type, FunctionArgument) else name

    def _of_call(self, node: ast.Call) -> Term:
        name = self.name_called(node)
        if name in self.rows:
            fields = self.rows[name]
            values = dict(zip(fields, map(self.term, node.args), strict=False))
            values |= {str(keyword.arg): self.term(keyword.value) for keyword in node.keywords}
            if set(values) != set(fields):
                raise self.refused(node, f"'{ast.unparse(node)}' must give each of the fields {', '.join(fields)}")
            parts = tuple(values[name] for name in fields)
            return Term("build", Row(name, tuple(zip(fields, (part.type for part in parts), strict=True))), parts)
        if name in self.definitions:
            function, arguments = self.called(name, node)
            if function.returns is None:
                raise self.refused(node, f"function '{name}' returns nothing, so its call cannot be used as a value")
            return Term("call", function.returns, arguments, function.name)
        return self.built_in(name, node)

    def called(self, name: str, node: ast.Call) -> tuple[Function, tuple[Term, ...]]:
        """Return the called function of the module, with its arguments."""
        definition = self.definitions[name]
        names = [argument.arg for argument in definition.args.args]
        values = list(map(self.term, node.args))
        # Calls between functions were checked when they were composed; this is a call of the engine's own.
        if len(values) != len(names) or node.keywords:
            missing = names[len(values) :]
            problem = f"missing a required argument: '{missing[0]}'" if missing else "too many arguments"
            called = f"({', '.join(map(ast.unparse, node.args))})"
            problem = f"{{name}}({', '.join(names)}): the engine calls it with {called}: {problem}"
            raise self.mistaken(definition, problem)
        types = tuple(value.type for value in values)
        # An array of known shape is a local one, which C hands over as a pointer of another type.
        if any(isinstance(kind, Array) and kind.shape for kind in types):
            raise self.refused(node, f"'{ast.unparse(node)}' must not pass a local array")
        return self.made(name, types), tuple(value for value in values if not is_empty(value.type))

    def built_in(self, name: str, node: ast.Call) -> Term:
        """Return the term of a call to a built-in function of every target language."""
        function = name.removeprefix("math.")
        least = FLOAT if function in LIBRARY | {"sqrt", "float"} else INT
        known = FUNCTIONS | {"float", "int", "bool", "len"} | (self.library - {"pow"})
        if function not in known or node.keywords:
            raise self.refused(node, f"the function '{name}' is not supported{_REMEDIES.get(function, '')}")
        if len(node.args) < 1 or (function in ("min", "max")) != (len(node.args) > 1):
            raise self.refused(node, f"'{ast.unparse(node)}' has the wrong number of arguments, {len(node.args)}")
        # Lengths of tuples are known: they become numbers.
        if function == "len":
            kind = self.term(node.args[0]).type
            if not isinstance(kind, Items | Row):
                raise self.refused(node, f"'{ast.unparse(node.args[0])}' has no length, because it is not a tuple")
            return Term("number", INT, (), len(types_in(kind)))
        if function == "bool":
            return self.condition(node.args[0])
        made, *others = [self.scalar(argument, least) for argument in node.args]
        kind = made.type
        if function in ("float", "int"):
            return made if function == "float" or kind == INT else Term("convert", INT, (made,))
        # Python's min returns the number as it is, an int or a float: C has one type for both.
        if any(other.type != kind for other in others):
            raise self.refused(
                node, f"'{ast.unparse(node)}' mixes an integer and a float; convert the integer with float()"
            )
        if not others:
            return Term(function, kind, (made,))
        for other in others:
            made = Term(function, kind, (made, other))
        return made


def _linked(node: ast.BoolOp, parts: list[Term]) -> Term:
    """Join boolean terms by ``and`` or ``or``."""
    made = parts[0]
    for part in parts[1:]:
        made = Term(SIGN_OF[type(node.op)], BOOL, (made, part))
    return made


def kind_of(kind: Type) -> str:
    """Return the description of a type for messages."""
    if isinstance(kind, Scalar):
        return "a number"
    if isinstance(kind, Row):
        return f"a {kind.name.rpartition('_')[2]}"
    return "a tuple" if isinstance(kind, Items) else "no number"


def _literal(term: Term) -> int | None:
    """Return the value of an integer literal; None for any other term."""
    sign, term = (-1, term.parts[0]) if term.kind == "negative" else (1, term)
    return sign * int(term.detail) if term.kind == "number" and term.type == INT else None
