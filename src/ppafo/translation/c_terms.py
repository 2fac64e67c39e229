"""Names and expressions of generated C99: identifiers that C allows, and the C text of typed terms."""

import math
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

from ppafo.engine.compilers import LIBRARY
from ppafo.translation.typed import Term
from ppafo.translation.value_types import (
    BOOL,
    FLOAT,
    INT,
    INT16,
    INT32,
    Array,
    Items,
    Row,
    RowReference,
    Type,
    is_empty,
)

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
_OF_HEADERS = frozenset(
    word
    for line in (
        "abs accept access acos acosh asin asinh atan atan2 atanh bind cbrt ceil connect copysign cos cosh erf erfc",
        "exp2 expm1 fdim floor fma fmax fmin fmod frexp hypot ilogb index isnan isinf j0 j1 jn ldexp lgamma listen",
        "div link llrint llround log10 log1p log2 logb lrint lround modf nan nearbyint nextafter pause pipe",
        "raise read recv remainder remove remquo rename rindex rint round scalbln scalbn select send shutdown signal",
        "sin sinh sleep socket sync system tan tanh tgamma time trunc unit unlink wait write y0 y1 yn",
    )
    for word in line.split()
)
"""Function names in C headers and surrounding files, not available to functions of a module."""
_MACRO = re.compile(
    r"(_[A-Z_]|(PPAFO|ppafo|DBL|FLT|LDBL|FP|MATH|M|INT|UINT|INTMAX|UINTMAX|SIZE|PTRDIFF|WCHAR|WINT|SIG|INT\d+|UINT\d+)_)"
)
"""Prefixes of names reserved by headers or compilers."""
_WORDS = {"and": "&&", "or": "||"}
_LEVELS = {"or": 2, "and": 3, **dict.fromkeys(("<", "<=", ">", ">=", "==", "!="), 5), "+": 8, "-": 8, "*": 9, "/": 9}
PART = "ppafo_part"
"""C name of the helper function that slices an array along the first index."""
# Levels of precedence of C, as far as terms have them.
_CHOICE = 1
_SIGN = 10
_ATOM = 11
_ARITHMETIC = frozenset({"+", "-", "*", "&", "|", "^", ">>", "min", "max", "choice", "negative"})
_HELPERS = {
    "min": "ppafo_smaller",
    "max": "ppafo_larger",
    "abs": "ppafo_whole_size",
    # Signed overflow is undefined in C: the product of unsigned numbers wraps, as Python's text says.
    "*": "ppafo_wrapped_product",
    "//": "ppafo_floor_quotient",
    "%": "ppafo_floor_remainder",
}
_OF_C = {"sqrt": "sqrt", "abs": "fabs", **{name: name for name in LIBRARY}}


def c_name(name: str, others: Collection[str] = (), outer: Collection[str] = ()) -> str:
    """Return a valid C identifier for a Python name, different from C keywords, ``others`` and ``outer``."""
    written = name
    # Python allows a final underscore on any name, so one more always ends at a free name.
    while written in _RESERVED or _MACRO.match(written) or written in outer or (written != name and written in others):
        written = f"v{written}" if _MACRO.match(written) else f"{written}_"
    return written


def is_free(name: str) -> bool:
    """Return whether neither C nor its headers use a name."""
    return c_name(name) == name and name not in _OF_HEADERS


def member_name(kind: Row, name: str) -> str:
    """Return the name of the struct member for a field of a row."""
    return c_name(name, [own for own, _ in kind.fields])


@dataclass(frozen=True, slots=True)
class CTerms:
    """Writer of typed terms as C expressions.

    ``type_name`` returns the C name of a type, ``name`` the C name of a local variable. ``functions`` has replacement
    names of functions. ``note_constructed`` is called with the type of each row that an expression constructs.
    """

    type_name: Callable[[Type], str]
    name: Callable[[str], str]
    functions: Mapping[str, str]
    note_constructed: Callable[[Type], None]

    def term(self, term: Term, least: int = 0) -> str:
        """Return the C expression of a term, in parentheses if it binds less tightly than ``least``."""
        text, level = self.text_and_level(term)
        # An int of 32 bits would carry digits that the small processor does not have.
        if term.type == INT16 and term.kind in _ARITHMETIC:
            # Arithmetic on 16 bits gives an int in C, which has 16 or 32.
            text = f"(int16_t)({text})"
            level = _SIGN
        return f"({text})" if level < least else text

    def text_and_level(self, term: Term) -> tuple[str, int]:
        """Return the C expression of a term, and its precedence level."""
        match term.kind:
            case "number":
                return self.number(term)
            case "convert":
                return self.conversion(term)
            case "negative" | "not":
                sign = "-" if term.kind == "negative" else "!"
                return f"{sign}{self.term(term.parts[0], _ATOM)}", _SIGN
            case "choice":
                test, yes, no = (self.term(part, _CHOICE + 1) for part in term.parts)
                return f"{test} ? {yes} : {no}", _CHOICE
        text = self.storage(term) or self.call(term)
        return (text, _ATOM) if text else self.operation(term)

    def storage(self, term: Term) -> str:
        """Return the C expression of a name, or of an element of a row, tuple or array; else empty."""
        match term.kind:
            case "name":
                text = self.name(term.detail)
            case "field":
                kind = term.parts[0].type
                sign = "."
                if isinstance(kind, RowReference):
                    kind = kind.row
                    sign = "->"
                assert isinstance(kind, Row)
                text = f"{self.term(term.parts[0], _ATOM)}{sign}{member_name(kind, term.detail)}"
            case "item":
                index = str(term.detail) if len(term.parts) == 1 else self.term(term.parts[1])
                kind = term.parts[0].type
                is_uniform = isinstance(kind, Items) and kind.is_uniform
                member = f"item[{index}]" if is_uniform else f"item_{index}"
                text = f"{self.term(term.parts[0], _ATOM)}.{member}"
            case "element":
                text = self.element(term)
            case "extent":
                text = f"{self.name(term.parts[0].detail)}.extent[{term.detail}]"
            case _:
                text = ""
        return text

    def element(self, term: Term) -> str:
        """Return the C expression of an array element."""
        owner, first, *further = term.parts
        assert isinstance(owner.type, Array)
        name = self.name(owner.detail)
        is_local = bool(owner.type.shape)
        least = 9 if further and not is_local else 0
        index = self.term(first, least)
        if is_local:
            return f"{name}[{index}]{''.join(f'[{self.term(index)}]' for index in further)}"
        for number, coordinate in enumerate(further, 1):
            # Arrays are one block of memory: the last index runs fastest, and extents are known only at run time.
            before = index if number == 1 else f"({index})"
            index = f"{before} * {name}.extent[{number}] + {self.term(coordinate, 9)}"
        return f"{name}.values[{index}]"

    def call(self, term: Term) -> str:
        """Return the C call of a function of the module, the prelude or the C library; else empty."""
        if term.kind in ("min", "max") and term.type in (INT, INT16, INT32):
            # The second operand first, as Python's min and max have it for equal numbers.
            first, second = (self.term(part, 6) for part in term.parts)
            sign = "<" if term.kind == "min" else ">"
            return f"({second} {sign} {first} ? {second} : {first})"
        if term.kind == "call":
            function = self.functions.get(term.detail, term.detail)
        elif term.kind == "build":
            function = f"make_{self.type_name(term.type)}"
            self.note_constructed(term.type)
        elif term.kind == "part":
            function = PART
        elif term.kind in _HELPERS and (term.type == INT or term.kind not in ("abs", "*")):
            function = _HELPERS[term.kind]
        elif term.kind in _OF_C:
            function = _OF_C[term.kind]
        else:
            return ""
        arguments = [self.term(part) for part in term.parts if not is_empty(part.type)]
        if term.kind == "part":
            # Size of an element of the first dimension: the product of the further extents.
            assert isinstance(term.type, Array)
            sizes = (f"{arguments[0]}.extent[{at}]" for at in range(1, term.type.dimensions))
            arguments.append(" * ".join(sizes) or "1")
        return f"{function}({', '.join(arguments)})"

    def operation(self, term: Term) -> tuple[str, int]:
        """Return the C expression of a binary operation, and its precedence level."""
        # Operators that many misread get brackets around their operands, sums and products only where they need them.
        level = _LEVELS.get(term.kind, 0)
        inner = level if level >= _LEVELS["+"] else _LEVELS["+"] if level else _SIGN
        if term.kind in _WORDS:
            left, right = (self.term(part, level if part.kind == term.kind else _LEVELS["<"]) for part in term.parts)
        else:
            left = self.term(term.parts[0], inner)
            right = self.term(term.parts[1], inner + 1)
        return f"{left} {_WORDS.get(term.kind, term.kind)} {right}", level or _CHOICE

    def number(self, term: Term) -> tuple[str, int]:
        """Return the C literal of a number, and its precedence level."""
        value = term.detail
        if term.type == BOOL:
            return ("true" if value else "false"), _ATOM
        if term.type in (INT16, INT32):
            text = f"INT32_C({abs(value)})" if term.type == INT32 else str(abs(value))
            return (text, _ATOM) if value >= 0 else (f"-{text}", _SIGN)
        if term.type == INT:
            # Literals of 64 bits: a plain one is an int, which may have 32.
            return (f"INT64_C({value})" if value >= 0 else f"-INT64_C({-value})"), _ATOM if value >= 0 else _SIGN
        if math.isnan(value):
            # NAN and INFINITY are floats in C: the cast keeps operations double.
            return "(double)NAN", _SIGN
        if math.isinf(value):
            return ("(double)INFINITY", _SIGN) if value > 0.0 else ("-(double)INFINITY", _SIGN)
        return repr(float(value)), _ATOM if math.copysign(1.0, value) > 0.0 else _SIGN

    def listed(self, term: Term) -> str:
        """Return a brace-enclosed initialiser of a struct or tuple, with nested braces for inner structs."""
        if term.kind != "build":
            return self.term(term)
        text = ", ".join(self.listed(part) for part in term.parts if not is_empty(part.type))
        is_array = isinstance(term.type, Items) and term.type.is_uniform
        return f"{{{{{text}}}}}" if is_array else f"{{{text}}}"

    def conversion(self, term: Term) -> tuple[str, int]:
        """Return the C expression of a type conversion, and its precedence level."""
        source = term.parts[0]
        if term.type in (INT16, INT32):
            text = f"({self.term(source, _CHOICE + 1)} ? 1 : 0)" if source.type == BOOL else self.term(source, _SIGN)
            return f"({'int16_t' if term.type == INT16 else 'int32_t'}){text}", _SIGN
        if source.type == FLOAT:
            # A conversion of NaN or a large float is undefined in C: the prelude says what it gives.
            return f"ppafo_whole_part({self.term(source)})", _ATOM
        if source.type == BOOL:
            one, none = ("1.0", "0.0") if term.type == FLOAT else ("INT64_C(1)", "INT64_C(0)")
            return f"{self.term(source, _CHOICE + 1)} ? {one} : {none}", _CHOICE
        return f"(double){self.term(source, _SIGN)}", _SIGN
