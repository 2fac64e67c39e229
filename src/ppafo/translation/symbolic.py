"""CasADi expressions from the typed functions of a composed module, for exact derivatives and for optimisers.

A function of the model is called with rows of numbers and CasADi symbols, and returns what Python would: floats become
expressions, loops are written out, a choice between two values keeps both. Where the sides of all comparisons are
``decided`` at a point, only what holds there is written: the smooth piece of the model that the point lies on.
"""

import math
import operator
from collections import namedtuple
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Protocol

from ppafo.engine.linking import link_effects
from ppafo.engine.rows import is_number, is_row, members
from ppafo.engine.source_text import SourceCollector, emitted_name
from ppafo.errors import ProgramError, SimulationError
from ppafo.model.declaration import PlainFunction
from ppafo.model.effects.kind import Effect
from ppafo.translation import typed
from ppafo.translation.typed import Function, Statement, Term
from ppafo.translation.value_types import FLOAT, INT, Handed, Items, Row, Type, is_empty
from ppafo.translation.walk import walk_module

Compare = Callable[[str, Any, Any, str], Any]
"""From a sign, two values and where they are compared: the expression of it, or a truth value where it is decided."""


class Wrapper(Protocol):
    """What stands before a function of the model: it is called with that function and with its arguments."""

    def __call__(self, function: Callable[..., Any], /, *arguments: Any) -> Any:
        """Return what stands for the function's value."""


Around = Mapping[str, Wrapper]
Acting = Mapping[Effect, Any]
"""Effects in the order in which they act, with their parameters."""


def _quotient(left: Any, right: Any) -> Any:
    """A quotient as compiled code has it: infinite, or no number, over 0."""
    if isinstance(left, int | float) and isinstance(right, int | float) and right == 0:
        return math.nan if left == 0 or math.isnan(left) else math.copysign(math.inf, left) * math.copysign(1.0, right)
    return left / right


_COMPARISONS: dict[str, Callable[[Any, Any], Any]] = {
    **{"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge},
    **{"==": operator.eq, "!=": operator.ne},
}
_ARITHMETIC: dict[str, Any] = {
    **{"+": operator.add, "-": operator.sub, "*": operator.mul, "//": operator.floordiv, "%": operator.mod},
    **{"&": operator.and_, "|": operator.or_, "^": operator.xor, ">>": operator.rshift},
    "/": _quotient,
    "negative": operator.neg,
}
_WHOLE_ONLY = frozenset({"//", "%", "&", "|", "^", ">>"})


def both_sides(sign: str, left: Any, right: Any, _where: str) -> Any:
    """The comparison as an expression, so that a choice keeps both of its values."""
    return _COMPARISONS[sign](left, right)


@dataclass(frozen=True, slots=True)
class Symbolic:
    """A function of the model that takes CasADi symbols in the place of floats; call it as the function itself.

    ``around`` has functions by the name of the model's function that they stand before: each is called with that
    function and with its arguments. ``compare`` says what becomes of a comparison. ``rows`` are the parameters of the
    effects that act inside it.
    """

    walked: "_Walked"
    around: Around = field(default_factory=dict)
    compare: Compare = both_sides
    rows: tuple[Any, ...] = ()

    def __call__(self, *values: Any) -> Any:
        """The function's value, in its own units."""
        # Structs of effects come first, as in every composed function.
        every = (*self.rows, *values)
        arguments = [value for value, is_given in zip(every, self.walked.is_given, strict=True) if is_given]
        return self.result(self.walked.functions[self.walked.name], arguments)

    def result(self, function: Function, arguments: list[Any]) -> Any:
        """The value of one function of the module for arguments that are not empty."""

        def own(*values: Any) -> Any:
            names = [name for name, _ in function.parameters]
            call = _Call(self, function)
            return call.block(function.body, dict(zip(names, values, strict=True)))

        before = self.around.get(function.source)
        return own(*arguments) if before is None else before(own, *arguments)


def symbolic(
    function: PlainFunction,
    *given: type | PlainFunction,
    around: Mapping[PlainFunction, Wrapper] | None = None,
    compare: Compare = both_sides,
    acting: Acting | None = None,
) -> Symbolic:
    """A function of the model for CasADi, from its text; ``given`` are the types of its parameters.

    These are ``float``, classes of NamedTuples, or functions that are handed over. ``acting`` are the effects that act
    in it, with their parameters. ProgramError, with file and line,
    for what is outside the subset.
    """
    before = {emitted_name(wrapped): wrapper for wrapped, wrapper in (around or {}).items()}
    rows = {effect.name: row for effect, row in (acting or {}).items()}
    effects = tuple(acting or ())
    # A function of the model that has changed since, as in a notebook, is walked again.
    if not _walked(function, given, effects).collector.made_from.is_current():
        _walked.cache_clear()
    walked = _walked(function, given, effects)
    return Symbolic(walked, before, compare, tuple(rows[name] for name in walked.collector.needs.get(walked.name, ())))


@dataclass(frozen=True, slots=True)
class _Walked:
    """A function with all that it calls: what it was composed from, functions of the module, where each was written.

    ``name`` is its own in the module; ``is_given`` says which of its parameters hold numbers.
    """

    collector: SourceCollector
    functions: Mapping[str, Function]
    places: Mapping[str, str]
    name: str
    is_given: tuple[bool, ...]


@lru_cache(maxsize=32)
def _walked(function: PlainFunction, given: tuple[type | PlainFunction, ...], effects: tuple[Effect, ...]) -> _Walked:
    """The typed functions of a function of the model, for types of its parameters, with effects in their order."""
    collector = SourceCollector("@function")
    link_effects(effects, collector)
    name = collector.add(function)
    asked = {effect.name: effect.parameters for effect in effects}
    needed = collector.needs.get(name, ())
    stated = [row.removesuffix("_state") for row in needed if row not in asked]
    if stated:
        raise SimulationError(f"effect '{stated[0]}' has a state of its own, which no linear model has: switch it off")
    first = [asked[row] for row in needed]
    types = tuple(_type_of(kind, collector) for kind in (*first, *given))
    module = walk_module(collector.text(), {name: types})
    places = {
        own: f"{owner.__module__.removeprefix('ppafo.')}.{owner.__qualname__}"
        for own, owner in collector.owners.items()
    }
    functions = {member.name: member for member in module.functions}
    return _Walked(collector, functions, places, name, tuple(not is_empty(kind) for kind in types))


def _type_of(kind: Any, collector: SourceCollector) -> Type:
    """The type of a parameter; functions and rows are added to the module."""
    if is_row(kind):
        name = collector.add(kind)
        return Row(name, tuple((way.removeprefix("."), _type_of(kind, collector)) for way, kind in members(kind)))
    if isinstance(kind, type) and is_number(kind):
        return FLOAT
    if callable(kind) and not members(kind):
        return Handed(collector.add(kind))
    return Items(tuple(_type_of(kind, collector) for _, kind in members(kind)))


@lru_cache(maxsize=256)
def _class_of_row(name: str, fields: tuple[str, ...]) -> Callable[..., tuple[Any, ...]]:
    """The class of a row whose fields hold expressions; one for each name with its fields."""
    return namedtuple(name, fields)


@dataclass(frozen=True, slots=True)
class _Call:
    """One call of a function: ``names`` hold the values so far."""

    home: Symbolic
    function: Function

    def refused(self, problem: str) -> ProgramError:
        return ProgramError(f"{self.home.walked.places[self.function.source]}: {problem}, which has no expression")

    def block(self, body: tuple[Statement, ...], names: dict[str, Any]) -> Any:
        """What some statements return, None where they return nothing; ``names`` are changed."""
        for index, statement in enumerate(body):
            if isinstance(statement, typed.Return):
                return self.value(statement.value, names)
            if isinstance(statement, typed.Assign):
                names[statement.name] = self.value(statement.value, names)
            elif isinstance(statement, typed.Count):
                self.counted(statement, names)
            elif isinstance(statement, typed.If):
                test = self.value(statement.test, names)
                if isinstance(test, bool):
                    value = self.block(statement.body if test else statement.otherwise, names)
                    if value is not None:
                        return value
                elif _returns(statement):
                    # A branch that may return takes what follows with it, on both ways: an expression has one value.
                    rest = body[index + 1 :]
                    yes, no = (self.block((*way, *rest), dict(names)) for way in (statement.body, statement.otherwise))
                    return self.chosen(test, yes, no)
                else:
                    self.branched(statement, test, names)
            else:
                raise self.refused(f"'{type(statement).__name__.lower()}' of the lane loop")
        return None

    def branched(self, branch: typed.If, test: Any, names: dict[str, Any]) -> None:
        """Both ways of a branch, and for each name the value that holds."""
        yes, no = dict(names), dict(names)
        self.block(branch.body, yes)
        self.block(branch.otherwise, no)
        for name in yes.keys() | no.keys():
            one, other = yes.get(name, no.get(name)), no.get(name, yes.get(name))
            names[name] = one if one is other else self.chosen(test, one, other)

    def counted(self, loop: typed.Count, names: dict[str, Any]) -> None:
        """A loop, written out."""
        start, stop = self.value(loop.start, names), self.value(loop.stop, names)
        if not isinstance(start, int) or not isinstance(stop, int) or _returns(loop):
            raise self.refused(f"a loop over '{loop.name}' whose end is not written out")
        # CasADi has no loops that fit here: each turn becomes expressions of its own.
        for number in range(start, stop, loop.step):
            names[loop.name] = number
            self.block(loop.body, names)

    def value(self, term: Term, names: dict[str, Any]) -> Any:
        """The value of a term."""
        if term.kind in ("name", "number"):
            return names.get(term.detail) if term.kind == "name" else term.detail
        parts = [self.value(part, names) for part in term.parts]
        match term.kind:
            case "call":
                value = self.home.result(self.home.walked.functions[term.detail], parts)
            case "build" if isinstance(term.type, Row):
                value = _class_of_row(term.type.name, tuple(name for name, _ in term.type.fields))(*parts)
            case "build":
                value = tuple(parts)
            case "field":
                value = getattr(parts[0], term.detail)
            case "item":
                value = parts[0][parts[1] if len(parts) > 1 else term.detail]
            case "choice":
                value = self.chosen(*parts)
            case "min" | "max":
                value = self.extreme(term, *parts)
            case _:
                value = self.calculated(term, parts)
        return value

    def calculated(self, term: Term, parts: list[Any]) -> Any:
        """A number or truth value that is worked out from others."""
        import casadi

        first, is_symbol = parts[0], isinstance(parts[0], casadi.SX)
        if term.kind in _COMPARISONS:
            compared = self.compared(term.kind, parts[0], parts[1], _text(term))
        elif term.kind in ("and", "or", "not"):
            compared = _logical(term.kind, *parts)
        elif term.kind == "abs":
            is_negative = self.compared("<", first, 0.0, f"{_text(term.parts[0])} < 0.0")
            compared = (-first if is_negative else first) if isinstance(is_negative, bool) else casadi.fabs(first)
        elif term.kind == "sqrt" and is_symbol:
            compared = casadi.sqrt(first)
        elif term.kind == "sqrt":
            compared = math.sqrt(first) if first >= 0.0 else math.nan
        elif term.kind == "convert":
            if is_symbol and term.type == INT:
                raise self.refused("the whole part of a number")
            compared = first if is_symbol else int(first) if term.type == INT else float(first)
        elif term.kind not in _ARITHMETIC:
            raise self.refused(f"'{term.kind}' of the lane loop")
        elif term.kind in _WHOLE_ONLY and not all(isinstance(part, int) for part in parts):
            raise self.refused(f"'{_text(term)}' of whole numbers")
        else:
            compared = _ARITHMETIC[term.kind](*parts)
        return compared

    def compared(self, sign: str, left: Any, right: Any, words: str) -> Any:
        """A comparison: a truth value where both numbers are known or it is decided, else an expression."""
        if isinstance(left, int | float) and isinstance(right, int | float):
            return bool(_COMPARISONS[sign](left, right))
        return self.home.compare(sign, left, right, f"{self.home.walked.places[self.function.source]}: {words}")

    def extreme(self, term: Term, first: Any, second: Any) -> Any:
        """The smaller or the larger of two numbers.

        Of equal ones these are the second and the first, as if the first were a little larger: only so have the ratio
        and the sign of two equal pressures, which ``>=`` tells apart, derivatives of one side.
        """
        import casadi

        sign = "<=" if term.kind == "min" else ">"
        one, other = (_text(part) for part in term.parts)
        is_second = self.compared(sign, second, first, f"{other} {sign} {one}")
        if isinstance(is_second, bool):
            return second if is_second else first
        # Not by CasADi's own functions, whose derivative at equal numbers is the mean of both sides.
        return casadi.if_else(is_second, second, first)

    def chosen(self, test: Any, yes: Any, no: Any) -> Any:
        """One of two values, of all numbers in them where they are rows."""
        import casadi

        if isinstance(test, bool):
            return yes if test else no
        # A struct is chosen number by number: CasADi knows only single expressions.
        if isinstance(yes, tuple):
            parts = [self.chosen(test, one, other) for one, other in zip(yes, no, strict=True)]
            return type(yes)(*parts) if hasattr(yes, "_fields") else tuple(parts)
        if isinstance(yes, int | float) and isinstance(no, int | float) and yes == no:
            return yes
        if isinstance(yes, int):
            raise self.refused("a whole number or truth value that depends on a comparison")
        return casadi.if_else(test, yes, no)


def _text(term: Term, is_inside: bool = False) -> str:
    """A term as Python has it."""
    parts = [_text(part, True) for part in term.parts]
    if term.kind in ("name", "number"):
        return str(term.detail)
    if term.kind in ("field", "item"):
        return f"{parts[0]}.{term.detail}" if term.kind == "field" else f"{parts[0]}[{(*parts, term.detail)[1]}]"
    if term.kind in ("call", "build", "abs", "min", "max", "sqrt"):
        name = term.detail if term.kind == "call" else "" if term.kind == "build" else term.kind
        return f"{name}({', '.join(_text(part) for part in term.parts)})"
    if term.kind == "convert":
        return parts[0]
    if term.kind == "choice":
        text = f"{parts[1]} if {parts[0]} else {parts[2]}"
    elif term.kind in ("negative", "not"):
        return f"-{parts[0]}" if term.kind == "negative" else f"not {parts[0]}"
    else:
        text = f" {term.kind} ".join(parts)
    return f"({text})" if is_inside else text


def _returns(statement: Statement) -> bool:
    """True where a statement may end its function or its loop."""
    if isinstance(statement, typed.Return | typed.Leave):
        return True
    if isinstance(statement, typed.If):
        return any(map(_returns, (*statement.body, *statement.otherwise)))
    return isinstance(statement, typed.Count | typed.While) and any(map(_returns, statement.body))


def _logical(word: str, left: Any, right: Any = None) -> Any:
    """What ``and``, ``or`` or ``not`` makes of truth values that are known or not."""
    import casadi

    if word == "not":
        return not left if isinstance(left, bool) else casadi.logic_not(left)
    for one, other in ((left, right), (right, left)):
        if isinstance(one, bool):
            return (other if one else False) if word == "and" else (True if one else other)
    return (casadi.logic_and if word == "and" else casadi.logic_or)(left, right)
