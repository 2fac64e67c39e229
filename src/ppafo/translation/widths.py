"""Integer widths of 16 and 32 bits for fixed-point code, by interval arithmetic over input ranges.

Every function of a module is evaluated with the ranges of its arguments. The range of all values of a name, field or
item determines its width. Values beyond 32 bits are refused, so that the remaining code cannot overflow.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, TypeAlias

from ppafo.errors import ProgramError
from ppafo.translation import typed
from ppafo.translation.typed import Function, Module, Parameter, Statement, Term, converted
from ppafo.translation.value_types import INT, INT16, INT32, Items, Row, Scalar, Type, types_in

# Loops are gone through turn by turn: more would take long, and no fixed-point law has them.
MOST_TURNS = 64
Range: TypeAlias = Any
"""``IntegerRange`` of a number, or a tuple of the ranges of row fields or tuple items, as its type in the term says."""
Names: TypeAlias = dict[str, Range]


class IntegerRange(NamedTuple):
    """Range of an integer, with both ends included."""

    low: int
    high: int


TRUTH = IntegerRange(0, 1)
_WIDTHS = ((INT16, IntegerRange(-(2**15), 2**15 - 1)), (INT32, IntegerRange(-(2**31), 2**31 - 1)))


class Narrowed(NamedTuple):
    """Module with 16-bit and 32-bit integers, and the range of its return value."""

    module: Module
    returned: Range


def narrowed(module: Module, given: Mapping[str, Range]) -> Narrowed:
    """Assign integer widths to a module, given the parameter ranges of its last function by name.

    Raises ProgramError for values that may exceed 32 bits, and for operations other than sums, shifts, selections and
    products with a power of two.
    """
    ranges = _Ranges({function.name: function for function in module})
    entry = module[-1]
    returned = ranges.call(entry, tuple(given[name] for name, _ in entry.parameters))
    called = [function for function in module if function.name in ranges.returned]
    return Narrowed([_Narrowing(ranges, function).function() for function in called], returned)


def hull(first: Range, other: Range) -> Range:
    """Return the smallest range that contains two ranges."""
    if isinstance(first, IntegerRange) and isinstance(other, IntegerRange):
        return IntegerRange(min(first.low, other.low), max(first.high, other.high))
    return tuple(hull(*pair) for pair in zip(first, other, strict=True))


_SIGNS: dict[str, Callable[[int, int], int]] = {
    "+": int.__add__,
    "-": int.__sub__,
    "*": int.__mul__,
    ">>": int.__rshift__,
    "min": min,
    "max": max,
}
_COMPARISONS = frozenset({"<", "<=", ">", ">=", "==", "!=", "and", "or", "not"})


@dataclass(slots=True)
class _Ranges:
    """Value ranges of all names, terms, row fields and return values; terms are keyed by ``id``."""

    functions: Mapping[str, Function]
    names: dict[tuple[str, str], Range] = field(default_factory=dict)
    terms: dict[int, IntegerRange] = field(default_factory=dict)
    parts: dict[Type, Range] = field(default_factory=dict)
    returned: dict[str, Range] = field(default_factory=dict)

    def call(self, function: Function, arguments: tuple[Range, ...]) -> Range:
        """Return the range of a function's return value, given the ranges of its parameters."""
        names: Names = {}
        for (name, kind), value in zip(function.parameters, arguments, strict=True):
            self.keep(function, names, name, kind, value)
        *body, last = function.body
        self.run(function, body, names)
        if not isinstance(last, typed.Return):
            raise _refused(function, "the only 'return' must be the last statement")
        result = self.value(function, last.value, names)
        self.returned[function.name] = hull(self.returned.get(function.name, result), result)
        return result

    def keep(self, function: Function, names: Names, name: str, kind: Type, value: Range) -> None:
        """Record the range of a value assigned to a name."""
        names[name] = value
        self.names[function.name, name] = hull(self.names.get((function.name, name), value), value)
        self.note(kind, value)

    def note(self, kind: Type, value: Range) -> None:
        """Extend the ranges of a row or tuple type, since all values of a type share widths."""
        if isinstance(kind, Row | Items):
            self.parts[kind] = hull(self.parts.get(kind, value), value)
            for part, own in zip(types_in(kind), value, strict=True):
                self.note(part, own)

    def run(self, function: Function, body: Sequence[Statement], names: Names) -> None:
        """Evaluate statements: update the ranges of names."""
        for statement in body:
            if isinstance(statement, typed.Assign):
                value = self.value(function, statement.value, names)
                self.keep(function, names, statement.name, statement.value.type, value)
            elif isinstance(statement, typed.CountedLoop) and statement.step == 1:
                self.count(function, statement, names)
            else:
                raise _refused(function, f"the statement '{type(statement).__name__.lower()}' is not supported")

    def count(self, function: Function, loop: typed.CountedLoop, names: Names) -> None:
        """Evaluate a loop by iterations; names then have their ranges over all possible counts."""
        start, stop = (self.value(function, part, names) for part in (loop.start, loop.stop))
        if start.low != start.high or stop.high - start.low > MOST_TURNS:
            raise _refused(function, f"a loop must have a literal start and at most {MOST_TURNS} iterations")
        # A loop without a turn leaves the counter as it was; it has a width all the same.
        self.keep(function, dict(names), loop.name, INT, IntegerRange(start.low, max(start.low, stop.high)))
        after = dict(names) if stop.low <= start.low else None
        for turn in range(start.low, stop.high):
            names[loop.name] = IntegerRange(turn, turn)
            self.run(function, loop.body, names)
            # From here on the loop may have ended.
            if turn + 1 >= stop.low:
                if after is None:
                    after = dict(names)
                _join(after, names)
        names.update(after or {})

    def value(self, function: Function, term: Term, names: Names) -> Range:
        """Return the range of a term, and extend its range over all evaluations."""
        parts = tuple(self.value(function, part, names) for part in term.parts)
        if term.kind == "name":
            value = names[term.detail]
        elif term.kind in ("field", "item") and len(parts) == 1:
            whole = parts[0]
            kind = term.parts[0].type
            index = [name for name, _ in kind.fields].index(term.detail) if isinstance(kind, Row) else int(term.detail)
            value = whole[index]
        elif term.kind == "build":
            value = parts
        elif term.kind == "call":
            value = self.call(self.functions[term.detail], parts)
        elif term.kind == "choice":
            value = hull(parts[1], parts[2])
        else:
            value = _calculated(function, term, [part for part in parts if isinstance(part, IntegerRange)])
        self.note(term.type, value)
        if isinstance(value, IntegerRange):
            # A term in a loop or in a function that is called twice is worked out for several ranges.
            known = self.terms.get(id(term), value)
            self.terms[id(term)] = every = IntegerRange(min(known.low, value.low), max(known.high, value.high))
            if term.type == INT and _width(every) is None:
                raise _refused(
                    function, f"a value may range from {every.low} to {every.high}, which does not fit in 32 bits"
                )
        return value


def _calculated(function: Function, term: Term, parts: list[IntegerRange]) -> IntegerRange:
    """Return the range of a sum, a product with a power of two, a shift, a minimum or a maximum."""
    if term.kind == "number":
        return IntegerRange(int(term.detail), int(term.detail))
    if term.kind in _COMPARISONS:
        return TRUTH
    if term.kind == "negative":
        return IntegerRange(-parts[0].high, -parts[0].low)
    # A mask of ones keeps what is below it, also of negative numbers in two's complement.
    if term.kind == "&" and parts[1].low == parts[1].high and parts[1].low >= 0:
        return IntegerRange(0, parts[1].high)
    if term.kind == "*" and not any(part.low == part.high and part.low.bit_count() == 1 for part in parts):
        raise _refused(function, "a product must have a power of two as one factor, so that a shift computes it")
    if term.kind not in _SIGNS:
        raise _refused(function, f"the operation '{term.kind}' is not supported")
    # Sums, products, shifts, min and max have their extremes at the ends of both ranges.
    left, other = parts
    ends = [_SIGNS[term.kind](left, right) for left in left for right in other]
    return IntegerRange(min(ends), max(ends))


def _join(names: Names, other: Names) -> None:
    """Merge the ranges of names at two ends of a loop; names assigned before one of them only are not read later."""
    for name, value in other.items():
        names[name] = hull(names.get(name, value), value)


def _refused(function: Function, problem: str) -> ProgramError:
    return ProgramError(f"{function.source}: cannot be converted to integers of 16 and 32 bits: {problem}")


def _width(interval: IntegerRange) -> Scalar | None:
    """Return the narrowest type for a range; None beyond 32 bits."""
    return next((kind for kind, own in _WIDTHS if own.low <= interval.low and interval.high <= own.high), None)


@dataclass(frozen=True, slots=True)
class _Narrowing:
    """Rewriting of a function with integer widths."""

    ranges: _Ranges
    item: Function

    def function(self) -> Function:
        """Return the function with widths in its parameters, return value and body."""
        assert self.item.returns is not None
        parameters = tuple(Parameter(name, self.of_name(name, kind)) for name, kind in self.item.parameters)
        returns = self.type_of(self.item.returns, self.ranges.returned[self.item.name])
        return replace(self.item, parameters=parameters, returns=returns, body=self.block(self.item.body, returns))

    def type_of(self, kind: Type, value: Range) -> Type:
        """Return a type with the widths required by a range of values."""
        if isinstance(kind, Row | Items):
            every = self.ranges.parts[kind]
            if isinstance(kind, Row):
                pairs = zip(kind.fields, every, strict=True)
                return Row(kind.name, tuple((name, self.type_of(inner, own)) for (name, inner), own in pairs))
            return Items(tuple(self.type_of(*pair) for pair in zip(kind.types, every, strict=True)))
        # A value beyond 32 bits was refused with its range.
        return _width(value) or kind if kind == INT else kind

    def of_name(self, name: str, kind: Type) -> Type:
        return self.type_of(kind, self.ranges.names[self.item.name, name])

    def block(self, body: tuple[Statement, ...], returns: Type) -> tuple[Statement, ...]:
        """Return the statements of a block with integer widths."""
        made: list[Statement] = []
        for statement in body:
            if isinstance(statement, typed.Assign):
                kind = self.of_name(statement.name, statement.value.type)
                made.append(typed.Assign(statement.name, converted(self.term(statement.value), kind)))
            elif isinstance(statement, typed.Return):
                made.append(typed.Return(converted(self.term(statement.value), returns)))
            else:
                assert isinstance(statement, typed.CountedLoop)
                kind = self.of_name(statement.name, INT)
                start, stop = (converted(self.term(part), kind) for part in (statement.start, statement.stop))
                made.append(
                    typed.CountedLoop(statement.name, start, stop, statement.step, self.block(statement.body, returns))
                )
        return tuple(made)

    def term(self, term: Term) -> Term:
        """Return a term with the width of its value and intermediate results."""
        if term.kind == "call":
            callee = _Narrowing(self.ranges, self.ranges.functions[term.detail])
            wanted = [callee.of_name(*parameter) for parameter in callee.item.parameters]
            parts = tuple(converted(self.term(part), kind) for part, kind in zip(term.parts, wanted, strict=True))
            found = self.ranges.returned[term.detail]
            return replace(term, type=self.type_of(term.type, found), parts=parts)
        if term.kind == "name":
            return replace(term, type=self.of_name(term.detail, term.type))
        parts = tuple(map(self.term, term.parts))
        if term.kind in ("field", "item"):
            owner = parts[0].type
            assert isinstance(owner, Items | Row)
            kind = dict(owner.fields)[term.detail] if isinstance(owner, Row) else None
            return replace(term, type=kind or types_in(owner)[term.detail], parts=parts)
        if term.kind == "build":
            whole = self.type_of(term.type, self.ranges.parts[term.type])
            assert isinstance(whole, Items | Row)
            return replace(term, type=whole, parts=tuple(map(converted, parts, types_in(whole))))
        return self.calculated(term, parts)

    def calculated(self, term: Term, parts: tuple[Term, ...]) -> Term:
        """Return an arithmetic term in the widest type of its operands and value."""
        own = self.type_of(term.type, self.ranges.terms[id(term)]) if isinstance(term.type, Scalar) else term.type
        if term.kind == "number":
            return replace(term, type=own, parts=parts)
        if term.kind == ">>":
            # An arithmetic shift to the right never leaves the width of what is shifted.
            own = parts[0].type
            return replace(term, type=own, parts=parts)
        whole = parts[1:] if term.kind == "choice" else parts
        if any(part.type in (INT16, INT32) for part in whole):
            kinds = {part.type for part in whole} | ({own} if term.type == INT else set())
            # C would widen both sides to int; here it is said, and 16 bits stay where they suffice.
            widest: Type = INT32 if INT32 in kinds else INT16
            whole = tuple(converted(part, widest) for part in whole)
            own = widest if term.type == INT else own
        elif term.kind == "choice" and not isinstance(term.type, Scalar):
            own = whole[0].type
        return replace(term, type=own, parts=(*parts[: len(parts) - len(whole)], *whole))
