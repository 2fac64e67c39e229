"""Typed terms as text of C."""

import math
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

from ppafo.translation.typed import BOOL, FLOAT, INT, INT16, INT32, LIBRARY, Array, Items, Row, Term, Type, is_empty

_RESERVED = frozenset(
    word
    for line in (
        "auto break case char const continue default do double else enum extern float for goto if inline int long",
        "register restrict return short signed sizeof static struct switch typedef union unsigned void volatile",
        "while bool true false and and_eq asm bitand bitor catch class compl concept consteval constexpr constinit",
        "const_cast co_await co_return co_yield decltype delete dynamic_cast explicit export friend mutable",
        "namespace new noexcept not not_eq nullptr operator or or_eq private protected public reinterpret_cast",
        "requires static_assert static_cast template this thread_local throw try typeid typename typeof",
        "typeof_unqual using virtual wchar_t char8_t char16_t char32_t alignas alignof xor xor_eq unix linux i386",
        "gamma main fabs sqrt exp log pow advance int8_t int16_t int32_t int64_t uint8_t uint16_t uint32_t uint64_t",
        "size_t intptr_t uintptr_t NAN INFINITY HUGE_VAL HUGE_VALF HUGE_VALL DECIMAL_DIG NULL math_errhandling",
    )
    for word in line.split()
)
_MACRO = re.compile(
    r"(_[A-Z_]|(PPAFO|ppafo|DBL|FLT|LDBL|FP|MATH|M|INT|UINT|INTMAX|UINTMAX|SIZE|PTRDIFF|WCHAR|WINT|SIG|INT\d+|UINT\d+)_)"
)
"""How names begin that headers or compilers keep for themselves."""
_WORDS = {"and": "&&", "or": "||"}
_LEVELS = {"or": 2, "and": 3, **dict.fromkeys(("<", "<=", ">", ">=", "==", "!="), 5), "+": 8, "-": 8, "*": 9, "/": 9}
PART = "ppafo_part"
"""A part of an array along its first places."""
_CHOICE, _SIGN, _ATOM = 1, 10, 11
_WORKED_OUT = frozenset({"+", "-", "*", "&", "|", "^", ">>", "min", "max", "choice", "negative"})
_HELPERS = {
    "min": "ppafo_smaller",
    "max": "ppafo_larger",
    "abs": "ppafo_whole_size",
    "//": "ppafo_floor_quotient",
    "%": "ppafo_floor_remainder",
}
_OF_C = {"sqrt": "sqrt", "abs": "fabs", **{name: name for name in LIBRARY}}


def c_name(name: str, others: Collection[str] = (), outer: Collection[str] = ()) -> str:
    """A name of Python as C can have it: not one of C's, of the ``others`` beside it, or of the file around it."""
    found = name
    while found in _RESERVED or _MACRO.match(found) or found in outer or (found != name and found in others):
        found = f"v{found}" if _MACRO.match(found) else f"{found}_"
    return found


def member_name(kind: Row, name: str) -> str:
    """The member of a struct for a field of a row."""
    return c_name(name, [own for own, _ in kind.fields])


@dataclass(frozen=True, slots=True)
class CTerms:
    """Writes terms; ``type_name`` gives the name of a type in C, ``name`` that of a local name.

    ``places`` has names for the first places of some arrays.
    """

    type_name: Callable[[Type], str]
    name: Callable[[str], str]
    places: Mapping[str, Sequence[str]]

    def term(self, item: Term, least: int = 0) -> str:
        """A term as text, in brackets where what is around it binds more than ``least``."""
        text, level = self.written(item)
        return f"({text})" if level < least else text

    def written(self, item: Term) -> tuple[str, int]:
        """A term as text, and how strongly it holds together."""
        if item.type == INT16 and item.kind in _WORKED_OUT:
            # What is worked out from 16 bits has those of an int in C, which are 16 or 32.
            return f"(int16_t)({self.worked_out(item)[0]})", _SIGN
        return self.worked_out(item)

    def worked_out(self, item: Term) -> tuple[str, int]:
        """A term as C works it out."""
        writer: Callable[[Term], tuple[str, int]] | None = getattr(self, f"_of_{item.kind}", None)
        if writer is not None:
            return writer(item)
        if item.kind in _HELPERS and (item.type == INT or item.kind != "abs"):
            return self.helper(item), _ATOM
        if item.kind in _OF_C:
            return f"{_OF_C[item.kind]}({', '.join(map(self.term, item.parts))})", _ATOM
        if item.kind == "*" and item.type == INT:
            return f"ppafo_wrapped_product({self.term(item.parts[0])}, {self.term(item.parts[1])})", _ATOM
        # Signs that many misread get brackets around what they join, those of sums and products as they need them.
        level = _LEVELS.get(item.kind, 0)
        inner = level if level >= _LEVELS["+"] else _LEVELS["+"] if level else _SIGN
        if item.kind in _WORDS:
            left, right = (self.term(part, level if part.kind == item.kind else _LEVELS["<"]) for part in item.parts)
        else:
            left, right = self.term(item.parts[0], inner), self.term(item.parts[1], inner + 1)
        return f"{left} {_WORDS.get(item.kind, item.kind)} {right}", level or _CHOICE

    def helper(self, item: Term) -> str:
        """A call of a function of the prelude."""
        given = ", ".join(self.term(part) for part in item.parts)
        if item.kind in ("min", "max") and item.type in (INT, INT16, INT32):
            first, second = (self.term(part, 6) for part in item.parts)
            sign = "<" if item.kind == "min" else ">"
            return f"({second} {sign} {first} ? {second} : {first})"
        return f"{_HELPERS[item.kind]}({given})"

    def _of_number(self, item: Term) -> tuple[str, int]:
        value = item.detail
        if item.type == BOOL:
            return ("true" if value else "false"), _ATOM
        if item.type in (INT16, INT32):
            text = f"INT32_C({abs(value)})" if item.type == INT32 else str(abs(value))
            return (text, _ATOM) if value >= 0 else (f"-{text}", _SIGN)
        if item.type == INT:
            return (f"INT64_C({value})" if value >= 0 else f"-INT64_C({-value})"), _ATOM if value >= 0 else _SIGN
        if math.isnan(value):
            return "(double)NAN", _SIGN
        if math.isinf(value):
            return ("(double)INFINITY", _SIGN) if value > 0.0 else ("-(double)INFINITY", _SIGN)
        return repr(float(value)), _ATOM if math.copysign(1.0, value) > 0.0 else _SIGN

    def _of_name(self, item: Term) -> tuple[str, int]:
        return self.name(item.detail), _ATOM

    def _of_field(self, item: Term) -> tuple[str, int]:
        kind = item.parts[0].type
        assert isinstance(kind, Row)
        return f"{self.term(item.parts[0], _ATOM)}.{member_name(kind, item.detail)}", _ATOM

    def _of_item(self, item: Term) -> tuple[str, int]:
        owner = self.term(item.parts[0], _ATOM)
        kind = item.parts[0].type
        place = str(item.detail) if len(item.parts) == 1 else self.term(item.parts[1])
        is_uniform = isinstance(kind, Items) and kind.is_uniform
        return (f"{owner}.item[{place}]" if is_uniform else f"{owner}.item_{place}"), _ATOM

    def _of_element(self, item: Term) -> tuple[str, int]:
        owner, *places = item.parts
        assert isinstance(owner.type, Array)
        name = self.name(owner.detail)
        if owner.type.shape:
            further = "".join(f"[{self.term(place)}]" for place in places[1:])
            return f"{name}[{self.place(owner, places[0])}]{further}", _ATOM
        index = self.place(owner, places[0], 9 if len(places) > 1 else 0)
        for number, place in enumerate(places[1:], 1):
            index = f"{index if number == 1 else f'({index})'} * {name}.extent[{number}] + {self.term(place, 9)}"
        return f"{name}.values[{index}]", _ATOM

    def place(self, owner: Term, place: Term, least: int = 0) -> str:
        """The first place in an array, by its name where it has one."""
        names = self.places.get(owner.detail, ())
        return names[place.detail] if names and place.kind == "number" else self.term(place, least)

    def _of_part(self, item: Term) -> tuple[str, int]:
        owner, first, beyond = item.parts
        assert isinstance(owner.type, Array)
        name = self.name(owner.detail)
        size = " * ".join(f"{name}.extent[{at}]" for at in range(1, owner.type.dimensions)) or "1"
        return f"{PART}({name}, {self.term(first)}, {self.term(beyond)}, {size})", _ATOM

    def _of_extent(self, item: Term) -> tuple[str, int]:
        return f"{self.name(item.parts[0].detail)}.extent[{item.detail}]", _ATOM

    def _of_build(self, item: Term) -> tuple[str, int]:
        name = self.type_name(item.type)
        return f"make_{name}({', '.join(self.term(part) for part in item.parts if not is_empty(part.type))})", _ATOM

    def _of_call(self, item: Term) -> tuple[str, int]:
        return f"{item.detail}({', '.join(self.term(part) for part in item.parts)})", _ATOM

    def _of_choice(self, item: Term) -> tuple[str, int]:
        test, yes, no = (self.term(part, _CHOICE + 1) for part in item.parts)
        return f"{test} ? {yes} : {no}", _CHOICE

    def _of_convert(self, item: Term) -> tuple[str, int]:
        given = item.parts[0]
        if item.type in (INT16, INT32):
            text = f"({self.term(given, _CHOICE + 1)} ? 1 : 0)" if given.type == BOOL else self.term(given, _SIGN)
            return f"({'int16_t' if item.type == INT16 else 'int32_t'}){text}", _SIGN
        if given.type == FLOAT:
            return f"ppafo_whole_part({self.term(given)})", _ATOM
        if given.type == BOOL:
            one, none = ("1.0", "0.0") if item.type == FLOAT else ("INT64_C(1)", "INT64_C(0)")
            return f"{self.term(given, _CHOICE + 1)} ? {one} : {none}", _CHOICE
        return f"(double){self.term(given, _SIGN)}", _SIGN

    def _of_negative(self, item: Term) -> tuple[str, int]:
        return f"-{self.term(item.parts[0], _ATOM)}", _SIGN

    def _of_not(self, item: Term) -> tuple[str, int]:
        return f"!{self.term(item.parts[0], _ATOM)}", _SIGN
