"""C99, which is C++ too, from the typed functions of a composed module.

One C function for each of Python's, with its docstring and its names; rows become structs that are handed over by
value. There is no heap, no global that changes, no recursion, and no library function but ``sqrt`` and ``fabs``, which
are exact. Built as ``FLAGS`` say, it gives the bits of the lanes.
"""

import inspect
import math
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from ppafo.engine.lane_source import INLINE, write_lanes
from ppafo.engine.program import Program
from ppafo.engine.source_text import SourceCollector
from ppafo.translation import typed
from ppafo.translation.scopes import Scopes, scopes_of
from ppafo.translation.typed import BOOL, FLOAT, INT, Array, Function, Items, Module, Row, Statement, Term, Type, is_empty
from ppafo.translation.walk import walk_module

FLAGS = ("-std=c99", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-fwrapv")
"""Flags of gcc and clang: strict arithmetic; without the third last gcc is up to 20 times slower."""

WIDTH = 118
LANE = "lane"
"""Loops over this name see no other turn of themselves, which the compiler is told."""

_RESERVED = frozenset(
    """auto break case char const continue default do double else enum extern float for goto if inline int long register
    restrict return short signed sizeof static struct switch typedef union unsigned void volatile while bool true false
    and and_eq asm bitand bitor catch class compl constexpr decltype delete explicit export friend mutable namespace new
    noexcept not not_eq nullptr operator or or_eq private protected public template this throw try typeid typename using
    virtual wchar_t xor xor_eq unix linux gamma main fabs sqrt""".split()
)
_WORDS = {"and": "&&", "or": "||"}
_LEVELS = {"or": 2, "and": 3, **dict.fromkeys(("<", "<=", ">", ">=", "==", "!="), 5), "+": 8, "-": 8, "*": 9, "/": 9}
_CHOICE, _SIGN, _ATOM = 1, 10, 11
_HELPERS = {"min": "ppafo_smaller", "max": "ppafo_larger", "abs": "ppafo_whole_size", "//": "ppafo_floor_quotient", "%": "ppafo_floor_remainder"}
_SCALARS = {"bool": "bool", "int": "int64_t", "float": "double"}

PRELUDE = """#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#if defined(__GNUC__)
#define PPAFO_INLINE static inline __attribute__((always_inline, unused))
#elif defined(_MSC_VER)
#define PPAFO_INLINE static __forceinline
#else
#define PPAFO_INLINE static inline
#endif

#if defined(__clang__)
#define PPAFO_SIDE_BY_SIDE _Pragma("clang loop vectorize(assume_safety)")
#elif defined(__GNUC__)
#define PPAFO_SIDE_BY_SIDE _Pragma("GCC ivdep")
#else
#define PPAFO_SIDE_BY_SIDE
#endif

/* Numbers one after another, the last index running quickest. */
typedef struct {
    double *values;
    int64_t extent[3];
} ppafo_array;

/* The second where it is smaller, else the first: also where they are equal, or one is no number. */
PPAFO_INLINE double ppafo_smaller(double first, double second)
{
    return second < first ? second : first;
}

/* The second where it is larger, else the first. */
PPAFO_INLINE double ppafo_larger(double first, double second)
{
    return second > first ? second : first;
}

/* The whole part; the lowest integer for what has none or is beyond all of them, as processors of PCs have it. */
PPAFO_INLINE int64_t ppafo_whole_part(double value)
{
    return value >= -9223372036854775808.0 && value < 9223372036854775808.0 ? (int64_t)value : INT64_MIN;
}

PPAFO_INLINE int64_t ppafo_whole_size(int64_t value)
{
    return value < 0 ? (int64_t)(0 - (uint64_t)value) : value;
}

/* A product that wraps at 64 bits. */
PPAFO_INLINE int64_t ppafo_wrapped_product(int64_t left, int64_t right)
{
    return (int64_t)((uint64_t)left * (uint64_t)right);
}

/* The quotient rounded down, unlike that of C; 0 where the divisor is. */
PPAFO_INLINE int64_t ppafo_floor_quotient(int64_t left, int64_t right)
{
    if (right == 0 || right == -1) {
        return right == 0 ? 0 : (int64_t)(0 - (uint64_t)left);
    }
    return left / right - (left % right != 0 && (left % right < 0) != (right < 0) ? 1 : 0);
}

/* What a quotient rounded down leaves: of the divisor's sign, unlike that of C. */
PPAFO_INLINE int64_t ppafo_floor_remainder(int64_t left, int64_t right)
{
    if (right == 0 || right == -1) {
        return 0;
    }
    return left % right + (left % right != 0 && (left % right < 0) != (right < 0) ? right : 0);
}
"""


def program_source(program: Program) -> str:
    """A translation unit whose ``advance`` takes one block of a program through its steps, as that of the lanes does.

    ProgramError for what is outside the subset, with file and line.
    """
    collector = SourceCollector(INLINE)
    module = walk_module(write_lanes(program, collector))
    documents = {name: inspect.getdoc(item) or "" for name, item in collector.owners.items()}
    return c_source(module, documents, "Generated from the functions of ppafo. Not to be edited.")


def c_source(module: Module, documents: Mapping[str, str], title: str) -> str:
    """A translation unit with all functions of a module; ``documents`` has the docstrings of rows and functions."""
    writer = _Writer(documents)
    bodies = [writer.function(item) for item in module.functions]
    return "\n".join([_comment(title), PRELUDE, *writer.structs, *bodies])


def c_name(name: str) -> str:
    """A name of Python as C can have it."""
    return f"{name}_" if name in _RESERVED else name


def _comment(text: str, further: Iterable[str] = ()) -> str:
    """A block comment."""
    lines = [line.rstrip() for line in text.replace("*/", "* /").strip().splitlines()] + list(further)
    return "/* " + "\n * ".join(lines).replace(" * \n", " *\n") + " */" if lines else ""


@dataclass(slots=True)
class _Writer:
    """What has been written so far: structs by type, and the names that are taken."""

    documents: Mapping[str, str]
    structs: list[str] = field(default_factory=list)
    names: dict[Type, str] = field(default_factory=dict)
    taken: dict[str, int] = field(default_factory=dict)
    owner: str = ""

    def type_name(self, kind: Type) -> str:
        """Name of a type in C; a struct is written where it is met first."""
        if isinstance(kind, typed.Scalar):
            return _SCALARS[kind.name]
        if isinstance(kind, Array):
            return "ppafo_array"
        if kind not in self.names:
            wanted = self.struct_name(kind)
            self.taken[wanted] = self.taken.get(wanted, 0) + 1
            number = self.taken[wanted]
            self.names[kind] = wanted if number == 1 else f"{wanted}_{number}"
            self.structs.append(self.struct(kind, self.names[kind]))
        return self.names[kind]

    def struct_name(self, kind: Type) -> str:
        """What a struct would be called if no other were."""
        if isinstance(kind, Row):
            return kind.name
        assert isinstance(kind, Items)
        if kind.is_uniform:
            return f"{self.type_name(kind.types[0]).removesuffix('_t')}s_{len(kind.types)}"
        return f"{self.owner}_result"

    def members(self, kind: Type) -> list[tuple[str, Type]]:
        """Members of a struct that hold something, by their names in C."""
        if isinstance(kind, Row):
            return [(c_name(name), inner) for name, inner in kind.fields if not is_empty(inner)]
        assert isinstance(kind, Items)
        return [(f"item_{place}", inner) for place, inner in enumerate(kind.types) if not is_empty(inner)]

    def struct(self, kind: Type, name: str) -> str:
        """A struct, and the function that makes one."""
        if isinstance(kind, Items) and kind.is_uniform:
            inner, count = self.type_name(kind.types[0]), len(kind.types)
            members = [("", f"{inner} item[{count}]")]
            given = [f"{inner} item_{place}" for place in range(count)]
            fill = [f"made.item[{place}] = item_{place};" for place in range(count)]
        else:
            members = [(own, f"{self.type_name(inner)} {own}") for own, inner in self.members(kind)]
            given = [declared for _, declared in members]
            fill = [f"made.{own} = {own};" for own, _ in members]
        said = _comment(self.documents.get(name, "")) if isinstance(kind, Row) else ""
        declared = [f"    {text};" for _, text in members]
        return "\n".join(
            [*([said] if said else []), "typedef struct {", *declared, f"}} {name};", ""]
            + [*_wrapped(f"PPAFO_INLINE {name} make_{name}({', '.join(given)})"), "{", f"    {name} made;"]
            + [*(f"    {line}" for line in fill), "    return made;", "}", ""]
        )

    def function(self, item: Function) -> str:
        """One function with its comment."""
        self.owner = item.source
        body = _Body(self, item, scopes_of(item)).text()
        returns = "void" if item.returns is None else self.type_name(item.returns)
        given = ", ".join(f"{self.type_name(kind)} {c_name(name)}" for name, kind in item.parameters)
        linkage = "void" if item.returns is None else f"PPAFO_INLINE {returns}"
        head = _wrapped(f"{linkage} {item.name}({given or 'void'})")
        bound = [f"Here {text}." for text in item.bound]
        said = _comment(self.documents.get(item.source, ""), bound)
        prototype = [f"{' '.join(head)};", ""] if item.returns is None else []
        return "\n".join([*prototype, *([said] if said else []), *head, "{", *body, "}", ""])


class _Body:
    """The lines of one function."""

    def __init__(self, writer: _Writer, item: Function, scopes: Scopes) -> None:
        self.writer = writer
        self.item = item
        self.scopes = scopes
        self.kinds: dict[str, Type] = dict(item.parameters) | scopes.types

    def text(self) -> list[str]:
        unused = [name for name, _ in self.item.parameters if name not in self.scopes.read]
        return [*(f"    (void){c_name(name)};" for name in unused), *self.block(self.item.body, 1)]

    def block(self, body: tuple[Statement, ...], level: int) -> list[str]:
        """Some statements, with what must be declared before them."""
        margin = "    " * level
        lines = [f"{margin}{self.declared(name)};" for name in self.scopes.at_start(body)]
        for statement in body:
            writer: Callable[..., Iterator[str]] = getattr(self, f"write_{type(statement).__name__.lower()}")
            lines += writer(statement, level, self.scopes.first.get(id(statement), ""))
        return lines

    def declared(self, name: str) -> str:
        """A declaration without a value of its own: a number begins as 0, so that no compiler fears for it."""
        kind = self.kinds[name]
        begin = {"bool": " = false", "int": " = 0", "float": " = 0.0"}
        value = begin[kind.name] if isinstance(kind, typed.Scalar) else ""
        return f"{self.writer.type_name(kind)} {c_name(name)}{value}"

    def line(self, text: str, level: int) -> Iterator[str]:
        yield from _wrapped("    " * level + text, "    " * (level + 1))

    def write_assign(self, item: typed.Assign, level: int, starts: str) -> Iterator[str]:
        if item.name in self.scopes.read and not is_empty(item.value.type):
            declared = f"{starts}{self.writer.type_name(item.value.type)} " if starts else ""
            yield from self.line(f"{declared.replace('let ', '')}{c_name(item.name)} = {self.term(item.value)};", level)

    def write_reserve(self, item: typed.Reserve, level: int, starts: str) -> Iterator[str]:
        extents = "".join(f"[{extent}]" for extent in item.type.shape)
        yield from self.line(f"double {c_name(item.name)}{extents};", level)

    def write_store(self, item: typed.Store, level: int, starts: str) -> Iterator[str]:
        yield from self.line(f"{self.term(item.element)} = {self.term(item.value)};", level)

    def write_return(self, item: typed.Return, level: int, starts: str) -> Iterator[str]:
        yield from self.line(f"return {self.term(item.value)};", level)

    def write_leave(self, item: typed.Leave, level: int, starts: str) -> Iterator[str]:
        yield from self.line(f"{item.word};", level)

    def write_if(self, item: typed.If, level: int, starts: str) -> Iterator[str]:
        yield from self.line(f"if ({self.term(item.test)}) {{", level)
        yield from self.block(item.body, level + 1)
        if item.otherwise:
            yield from self.line("} else {", level)
            yield from self.block(item.otherwise, level + 1)
        yield from self.line("}", level)

    def write_while(self, item: typed.While, level: int, starts: str) -> Iterator[str]:
        yield from self.line(f"while ({self.term(item.test)}) {{", level)
        yield from self.block(item.body, level + 1)
        yield from self.line("}", level)

    def write_count(self, item: typed.Count, level: int, starts: str) -> Iterator[str]:
        """A loop that counts; a name that lives beyond it gets the number from a counter of its own."""
        name = c_name(item.name)
        is_own = id(item) in self.scopes.counted
        counter = name if is_own else f"{name}_next"
        sign, change = ("<", f"++{counter}") if item.step == 1 else (">", f"{counter} += {item.step}")
        sign = "<" if item.step > 0 else ">"
        start, stop = self.term(item.start), self.term(item.stop, 6)
        if item.name == LANE:
            yield from self.line("PPAFO_SIDE_BY_SIDE", level)
        yield from self.line(f"for (int64_t {counter} = {start}; {counter} {sign} {stop}; {change}) {{", level)
        if not is_own:
            yield from self.line(f"{name} = {counter};", level + 1)
        yield from self.block(item.body, level + 1)
        yield from self.line("}", level)

    def term(self, item: Term, least: int = 0) -> str:
        """A term as text, in brackets where what is around it binds more than ``least``."""
        text, level = self.written(item)
        return f"({text})" if level < least else text

    def written(self, item: Term) -> tuple[str, int]:
        """A term as text, and how strongly it holds together."""
        writer: Callable[[Term], tuple[str, int]] | None = getattr(self, f"of_{item.kind}", None)
        if writer is not None:
            return writer(item)
        if item.kind in _HELPERS and (item.type == INT or item.kind != "abs"):
            return self.helper(item), _ATOM
        if item.kind in ("sqrt", "abs"):
            return f"{'sqrt' if item.kind == 'sqrt' else 'fabs'}({self.term(item.parts[0])})", _ATOM
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
        if item.kind in ("min", "max") and item.type == INT:
            first, second = (self.term(part, 6) for part in item.parts)
            sign = "<" if item.kind == "min" else ">"
            return f"({second} {sign} {first} ? {second} : {first})"
        return f"{_HELPERS[item.kind]}({given})"

    def of_number(self, item: Term) -> tuple[str, int]:
        value = item.detail
        if item.type == BOOL:
            return ("true" if value else "false"), _ATOM
        if item.type == INT:
            is_wide = abs(value) > 2**31 - 1
            return (f"INT64_C({value})" if is_wide else str(value)), _ATOM if value >= 0 else _SIGN
        if math.isnan(value):
            return "(double)NAN", _SIGN
        if math.isinf(value):
            return ("(double)INFINITY", _SIGN) if value > 0.0 else ("-(double)INFINITY", _SIGN)
        return repr(float(value)), _ATOM if math.copysign(1.0, value) > 0.0 else _SIGN

    def of_name(self, item: Term) -> tuple[str, int]:
        return c_name(item.detail), _ATOM

    def of_field(self, item: Term) -> tuple[str, int]:
        return f"{self.term(item.parts[0], _ATOM)}.{c_name(item.detail)}", _ATOM

    def of_item(self, item: Term) -> tuple[str, int]:
        owner = self.term(item.parts[0], _ATOM)
        kind = item.parts[0].type
        place = str(item.detail) if len(item.parts) == 1 else self.term(item.parts[1])
        is_uniform = isinstance(kind, Items) and kind.is_uniform
        return (f"{owner}.item[{place}]" if is_uniform else f"{owner}.item_{place}"), _ATOM

    def of_element(self, item: Term) -> tuple[str, int]:
        owner, *places = item.parts
        assert isinstance(owner.type, Array)
        name = c_name(owner.detail)
        if owner.type.shape:
            return name + "".join(f"[{self.term(place)}]" for place in places), _ATOM
        index = self.term(places[0])
        for number, place in enumerate(places[1:], 1):
            index = f"({index}) * {name}.extent[{number}] + {self.term(place, 9)}"
        return f"{name}.values[{index}]", _ATOM

    def of_extent(self, item: Term) -> tuple[str, int]:
        return f"{c_name(item.parts[0].detail)}.extent[{item.detail}]", _ATOM

    def of_build(self, item: Term) -> tuple[str, int]:
        name = self.writer.type_name(item.type)
        return f"make_{name}({', '.join(self.term(part) for part in item.parts if not is_empty(part.type))})", _ATOM

    def of_call(self, item: Term) -> tuple[str, int]:
        return f"{item.detail}({', '.join(self.term(part) for part in item.parts)})", _ATOM

    def of_choice(self, item: Term) -> tuple[str, int]:
        test, yes, no = (self.term(part, _CHOICE + 1) for part in item.parts)
        return f"{test} ? {yes} : {no}", _CHOICE

    def of_convert(self, item: Term) -> tuple[str, int]:
        given = item.parts[0]
        if given.type == FLOAT:
            return f"ppafo_whole_part({self.term(given)})", _ATOM
        if given.type == BOOL:
            one, none = ("1.0", "0.0") if item.type == FLOAT else ("1", "0")
            return f"{self.term(given, _CHOICE + 1)} ? {one} : {none}", _CHOICE
        return f"(double){self.term(given, _SIGN)}", _SIGN

    def of_negative(self, item: Term) -> tuple[str, int]:
        return f"-{self.term(item.parts[0], _ATOM)}", _SIGN

    def of_not(self, item: Term) -> tuple[str, int]:
        return f"!{self.term(item.parts[0], _ATOM)}", _SIGN


def _wrapped(line: str, further: str = "    ") -> list[str]:
    """A line of C as lines that are not too long."""
    if len(line) <= WIDTH:
        return [line]
    margin = line[: len(line) - len(line.lstrip())]
    return textwrap.wrap(
        line.strip(), WIDTH, initial_indent=margin, subsequent_indent=further, break_long_words=False, break_on_hyphens=False
    )
