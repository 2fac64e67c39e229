"""Code generator for C99 that is also valid C++, from the typed functions of a composed module.

Each Python function becomes one C function with the same name and docstring; rows become structs passed by value. The
generated code has no heap, no mutable globals and no recursion. The only library functions are ``sqrt`` and ``fabs``,
which are exact, unless type inference was told to allow others. Compiled with the flags of ``engine.compilers``, the
code gives results that are bit-identical to compiled Python modules.
"""

import inspect
import itertools
import math
import re
import textwrap
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files

from ppafo.engine.compilers import LIBRARY
from ppafo.engine.entries import INLINE
from ppafo.engine.loop_text import write_lanes
from ppafo.engine.program import Program
from ppafo.engine.source_text import SourceCollector
from ppafo.translation import typed
from ppafo.translation.scopes import Scopes, scopes_of
from ppafo.translation.typed import Function, Module, Statement, Term
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
    Scalar,
    Type,
    is_empty,
    types_in,
)
from ppafo.translation.walk import walk_module

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
"""Names of functions in C headers and in the surrounding files, which no function of a module may have."""
_MACRO = re.compile(
    r"(_[A-Z_]|(PPAFO|ppafo|DBL|FLT|LDBL|FP|MATH|M|INT|UINT|INTMAX|UINTMAX|SIZE|PTRDIFF|WCHAR|WINT|SIG|INT\d+|UINT\d+)_)"
)
"""Prefixes of names that headers or compilers reserve."""
_WORDS = {"and": "&&", "or": "||"}
_LEVELS = {"or": 2, "and": 3, **dict.fromkeys(("<", "<=", ">", ">=", "==", "!="), 5), "+": 8, "-": 8, "*": 9, "/": 9}
PART = "ppafo_part"
"""C name of the function that returns a slice of an array along the first index."""
# How strongly a text holds together: C's levels of precedence, as far as terms have them.
_CHOICE, _SIGN, _ATOM = 1, 10, 11
_WORKED_OUT = frozenset({"+", "-", "*", "&", "|", "^", ">>", "min", "max", "choice", "negative"})
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
    """Valid C identifier for a Python name, distinct from C keywords, from ``others`` and from names in ``outer``."""
    written = name
    # Python allows a final underscore on any name, so one more always ends at a free name.
    while written in _RESERVED or _MACRO.match(written) or written in outer or (written != name and written in others):
        written = f"v{written}" if _MACRO.match(written) else f"{written}_"
    return written


def is_free(name: str) -> bool:
    """Return whether a name is used neither by C nor by its headers."""
    return c_name(name) == name and name not in _OF_HEADERS


def member_name(kind: Row, name: str) -> str:
    """Name of the struct member for a field of a row."""
    return c_name(name, [own for own, _ in kind.fields])


@dataclass(frozen=True, slots=True)
class _CTerms:
    """Writer of terms as C expressions.

    ``type_name`` returns the C name of a type, ``name`` the C name of a local variable. ``places`` has names for the
    first indices of some arrays, ``functions`` has replacement names of functions. ``made`` is called with the type of
    each row that an expression constructs.
    """

    type_name: Callable[[Type], str]
    name: Callable[[str], str]
    places: Mapping[str, Sequence[str]]
    functions: Mapping[str, str]
    made: Callable[[Type], None]

    def term(self, term: Term, least: int = 0) -> str:
        """Text of a term, in parentheses if the surrounding operator binds more tightly than ``least``."""
        text, level = self.worked_out(term)
        # An int of 32 bits would carry digits that the small processor does not have.
        if term.type == INT16 and term.kind in _WORKED_OUT:
            # Arithmetic on 16 bits gives an int in C, which has 16 or 32.
            text, level = f"(int16_t)({text})", _SIGN
        return f"({text})" if level < least else text

    def worked_out(self, term: Term) -> tuple[str, int]:
        """Text of a term in C, and the precedence level of the text."""
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
        text = self.looked_up(term) or self.call(term)
        return (text, _ATOM) if text else self.operation(term)

    def looked_up(self, term: Term) -> str:
        """Text of a name, or of an element of a row, tuple or array; empty for any other term."""
        match term.kind:
            case "name":
                text = self.name(term.detail)
            case "field":
                kind, sign = term.parts[0].type, "."
                if isinstance(kind, RowReference):
                    kind, sign = kind.row, "->"
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
        """Text of an array element, whose first index may have a name."""
        owner, first, *further = term.parts
        assert isinstance(owner.type, Array)
        name, names = self.name(owner.detail), self.places.get(owner.detail, ())
        is_local = bool(owner.type.shape)
        least = 9 if further and not is_local else 0
        index = names[first.detail] if names and first.kind == "number" else self.term(first, least)
        if is_local:
            return f"{name}[{index}]{''.join(f'[{self.term(index)}]' for index in further)}"
        for number, coordinate in enumerate(further, 1):
            # Arrays are one block of memory: the last index runs fastest, and extents are known only at run time.
            before = index if number == 1 else f"({index})"
            index = f"{before} * {name}.extent[{number}] + {self.term(coordinate, 9)}"
        return f"{name}.values[{index}]"

    def call(self, term: Term) -> str:
        """Text of a call of a function of the module, the prelude or the C library; empty for any other term."""
        if term.kind in ("min", "max") and term.type in (INT, INT16, INT32):
            # The second operand first, as Python's min and max have it for equal numbers.
            first, second = (self.term(part, 6) for part in term.parts)
            sign = "<" if term.kind == "min" else ">"
            return f"({second} {sign} {first} ? {second} : {first})"
        if term.kind == "call":
            function = self.functions.get(term.detail, term.detail)
        elif term.kind == "build":
            function = f"make_{self.type_name(term.type)}"
            self.made(term.type)
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
            # What each first place has: the product of the further extents.
            assert isinstance(term.type, Array)
            sizes = (f"{arguments[0]}.extent[{at}]" for at in range(1, term.type.dimensions))
            arguments.append(" * ".join(sizes) or "1")
        return f"{function}({', '.join(arguments)})"

    def operation(self, term: Term) -> tuple[str, int]:
        """Text of a binary operation, and its precedence level."""
        # Operators that many misread get brackets around their operands, sums and products only where they need them.
        level = _LEVELS.get(term.kind, 0)
        inner = level if level >= _LEVELS["+"] else _LEVELS["+"] if level else _SIGN
        if term.kind in _WORDS:
            left, right = (self.term(part, level if part.kind == term.kind else _LEVELS["<"]) for part in term.parts)
        else:
            left, right = self.term(term.parts[0], inner), self.term(term.parts[1], inner + 1)
        return f"{left} {_WORDS.get(term.kind, term.kind)} {right}", level or _CHOICE

    def number(self, term: Term) -> tuple[str, int]:
        """Text of a numeric literal, and its precedence level."""
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
        """Text of a brace-enclosed initialiser for a struct or tuple, with nested braces for inner structs."""
        if term.kind != "build":
            return self.term(term)
        text = ", ".join(self.listed(part) for part in term.parts if not is_empty(part.type))
        is_array = isinstance(term.type, Items) and term.type.is_uniform
        return f"{{{{{text}}}}}" if is_array else f"{{{text}}}"

    def conversion(self, term: Term) -> tuple[str, int]:
        """Text of a type conversion, and its precedence level."""
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


WIDTH = 118
TIED = "\N{NO-BREAK SPACE}"
"""Non-breaking separator between two words that must stay on one line."""

_SCALARS = {"bool": "bool", "int": "int64_t", "float": "double", "int16": "int16_t", "int32": "int32_t"}
_PART = f"""
/* The numbers of an array from one first place up to another; size is what each first place has. */
PPAFO_INLINE ppafo_array {PART}(ppafo_array whole, int64_t first, int64_t beyond, int64_t size)
{{
    whole.values += first * size;
    whole.extent[0] = beyond - first;
    return whole;
}}
"""
LANE = "lane"
"""Name of loop variables whose iterations are independent; the compiler is told so."""


def program_source(program: Program) -> str:
    """Return the C translation unit of a program; its function ``advance`` advances one block of runs.

    Raises ProgramError, with file and line, for code outside the supported subset of Python.
    """
    collector = SourceCollector(INLINE)
    return translated(write_lanes(program, collector), collector)


def translated(composed: str, collector: SourceCollector) -> str:
    """Return the C translation unit of a composed module whose definitions are in ``collector``."""
    return c_source(
        walk_module(composed), documents_of(collector), "Generated from the functions of ppafo. Not to be edited."
    )


def documents_of(collector: SourceCollector) -> dict[str, str]:
    """Return the docstrings of the collected functions and classes, by their names in the composed module."""
    return {name: inspect.getdoc(owner) or "" for name, owner in collector.owners.items()}


@dataclass(frozen=True, slots=True)
class ReadableUnit:
    """Options for a translation unit meant for readers: short names, and no unused definitions.

    ``names`` maps names in the module to unique short names. ``declared`` maps rows to structs that the surrounding
    file declares. ``around`` is the text of the surrounding file. All functions are static.
    """

    names: Mapping[str, str]
    declared: Mapping[str, str]
    around: str


def c_source(
    module: Module,
    documents: Mapping[str, str],
    title: str,
    places: Mapping[str, Sequence[str]] | None = None,
    prelude: str = "prelude.h",
    reading: ReadableUnit | None = None,
) -> str:
    """Return the C translation unit with all functions of a module; shorter if ``reading`` is given.

    ``documents`` has the docstrings of rows and functions. ``places`` has names for the first indices of some arrays,
    which the surrounding file defines; the key ``x`` applies to all functions, ``advance.x`` to one. ``prelude`` is the
    name of the file that precedes all functions.
    """
    # What returns nothing but empty rows is never called: an empty value is not written.
    functions = [function for function in module if function.returns is None or not is_empty(function.returns)]
    names: dict[str, str] = {}
    if reading is not None:
        for function in functions:
            # A function for further types has their number behind its own name.
            names[function.name] = (
                f"{reading.names.get(function.source, function.source)}{function.name.removeprefix(function.source)}"
            )
    writer = _Writer(
        documents, {names.get(function.name, function.name) for function in functions}, places or {}, names, reading
    )
    before = files("ppafo.translation").joinpath(prelude).read_text(encoding="utf-8")
    bodies = [writer.function(function) for function in functions]
    # Now all structs have their names, which no local name may hide: what has one is written again.
    names_of_structs = {*writer.names.values(), *(f"make_{name}" for name in writer.names.values())}
    writer.outer |= names_of_structs
    for number, function in enumerate(functions):
        if writer.locals[function.name] & names_of_structs:
            bodies[number] = writer.function(function)
    parts = [_PART] if any(f"{PART}(" in body for body in bodies) else []
    structs = [text for kind in writer.structs for text in writer.written_struct(kind)]
    if reading is not None:
        own = "\n".join([*parts, *structs, *bodies])
        before = before.replace("#if !defined(PPAFO_INLINE)\n", "", 1).replace("#endif\n", "", 1)
        before = _prelude_for(before, own + reading.around)
        return "\n".join([_comment(title), before, own]).replace("PPAFO_INLINE", "static")
    return "\n".join([_comment(title), before, *parts, *structs, *bodies])


_DEFINES = re.compile(r"(?:^|\s|\*)(ppafo_\w+)\(|\} (ppafo_\w+);|#define (PPAFO_\w+)")


def _prelude_for(prelude: str, used: str) -> str:
    """Return the parts of a prelude that the following code uses."""
    kept: list[str] = []
    # From the end, so that a part which only a later part uses is kept with it.
    for part in reversed(prelude.split("\n\n")):
        head = part.split("{")[0] if "PPAFO_INLINE" in part else part
        defined = {name for definition in _DEFINES.finditer(head) for name in definition.groups() if name}
        words = set(re.findall(r"\w+", "\n".join([*kept, used])))
        if not defined or words & (defined - {"PPAFO_INLINE"}):
            kept.append(part)
    return "\n\n".join(kept[::-1])


def _comment(text: str, further: Iterable[str] = ()) -> str:
    """Return a block comment with the lines of ``text`` and ``further``."""
    # A docstring may contain the end of a C comment.
    lines = [line.rstrip() for line in text.replace("*/", "* /").replace("/*", "/ *").strip().splitlines()] + list(
        further
    )
    return "/* " + "\n * ".join(lines).replace(" * \n", " *\n") + " */" if lines else ""


@dataclass(slots=True)
class _Writer:
    """State of the code generator: structs by type; ``outer`` has the names of functions, finally also of structs."""

    documents: Mapping[str, str]
    outer: set[str]
    places: Mapping[str, Sequence[str]]
    functions: Mapping[str, str]
    reading: ReadableUnit | None = None
    structs: list[Items | Row] = field(default_factory=list)
    made: set[Type] = field(default_factory=set)
    names: dict[Type, str] = field(default_factory=dict)
    locals: dict[str, set[str]] = field(default_factory=dict)
    owner: str = ""

    def type_name(self, kind: Type) -> str:
        """C name of a type; a struct is declared at its first use."""
        if isinstance(kind, Scalar):
            return _SCALARS[kind.name]
        if isinstance(kind, Array):
            return "ppafo_array"
        if isinstance(kind, RowReference):
            return f"{self.type_name(kind.row)} *"
        if self.reading is not None and isinstance(kind, Row) and kind.name in self.reading.declared:
            return self.reading.declared[kind.name]
        assert isinstance(kind, Items | Row)
        if kind not in self.names:
            wanted = own = self.struct_name(kind)
            number = 1
            while {own, f"make_{own}"} & {*self.outer, *self.names.values()}:
                number += 1
                own = f"{wanted}_{number}"
            self.names[kind] = own
            for inner in types_in(kind):
                if not is_empty(inner):
                    self.type_name(inner)
            self.structs.append(kind)
        return self.names[kind]

    def struct_name(self, kind: Items | Row) -> str:
        """Preferred C name of a struct."""
        if isinstance(kind, Row):
            return kind.name if self.reading is None else self.reading.names.get(kind.name, kind.name)
        if kind.is_uniform:
            return f"{self.type_name(kind.types[0]).removesuffix('_t')}s_{len(kind.types)}"
        owner = self.owner if self.reading is None else self.reading.names.get(self.owner, self.owner)
        return f"{owner}_result"

    def written_struct(self, kind: Items | Row) -> list[str]:
        """Declaration of a struct with its constructor function; readable units omit uncalled constructors."""
        name = self.names[kind]
        if isinstance(kind, Items) and kind.is_uniform:
            inner, count = self.type_name(kind.types[0]), len(kind.types)
            members = [("", f"{inner}{TIED}item[{count}]")]
            parameters = [f"{inner}{TIED}item_{index}" for index in range(count)]
            made, fill = "made", [f"made.item[{index}] = item_{index};" for index in range(count)]
        else:
            if isinstance(kind, Row):
                named = [(member_name(kind, own), inner) for own, inner in kind.fields]
            else:
                named = [(f"item_{index}", inner) for index, inner in enumerate(types_in(kind))]
            held = {own: self.type_name(inner) for own, inner in named if not is_empty(inner)}
            members = [(own, f"{inner}{TIED}{own}") for own, inner in held.items()]
            given_as = {own: c_name(own, held, {name, *held.values()}) for own in held}
            parameters = [f"{inner}{TIED}{given_as[own]}" for own, inner in held.items()]
            made = c_name("made", given_as.values(), given_as.values())
            fill = [f"{made}.{own} = {given_as[own]};" for own, _ in members]
        said = _comment(self.documents.get(kind.name, "")) if isinstance(kind, Row) else ""
        declared = [f"    {text};".replace(TIED, " ") for _, text in members]
        head = _wrapped(f"PPAFO_INLINE {name} make_{name}({', '.join(parameters)})")
        body = ["{", f"    {name} {made};", *(f"    {line}" for line in fill), f"    return {made};", "}", ""]
        if self.reading is not None:
            declared = _together(text for _, text in members)
        struct = [*([said] if said else []), "typedef struct {", *declared, f"}} {name};", ""]
        if self.reading is not None:
            listed = ", ".join(parameter.rpartition(TIED)[2] for parameter in parameters)
            both = "{{{}}}" if isinstance(kind, Items) and kind.is_uniform else "{{}}"
            begin = _wrapped(f"    const {name} {made} = {both.replace('{}', listed)};", " " * 8)
            body = ["{", *begin, f"    return {made};", "}", ""]
            return [*struct, *([*head, *body] if kind in self.made else [])]
        return ["\n".join([*struct, *head, *body])]

    def function(self, function: Function) -> str:
        """C text of a function, with its comment."""
        self.owner = function.source
        writer = _Body(self, function, scopes_of(function))
        # An unused parameter is a warning, and warnings are errors where people read the export.
        unused = [name for name, _ in function.parameters if name not in writer.scopes.read]
        body = [*(f"    (void){writer.name(name)};" for name in unused), *writer.block(function.body, 1)]
        self.locals[function.name] = writer.used
        returns = "void" if function.returns is None else self.type_name(function.returns)
        changed = writer.scopes.changes.get(id(function.body), {})
        declared = []
        for name, kind in function.parameters:
            constant = "const " if isinstance(kind, RowReference) and name not in changed else ""
            between = "" if isinstance(kind, RowReference) else TIED
            declared.append(f"{constant}{self.type_name(kind)}{between}{writer.name(name)}")
        parameters = ", ".join(declared)
        is_shown = function.is_entry and self.reading is None
        linkage = f"PPAFO_ENTRY {returns}" if is_shown else f"PPAFO_INLINE {returns}"
        head = _wrapped(f"{linkage} {self.functions.get(function.name, function.name)}({parameters or 'void'})")
        bound = [f"Here {text}." for text in function.bound]
        said = _comment(self.documents.get(function.source, ""), bound)
        prototype = [*head[:-1], f"{head[-1]};", ""] if is_shown else []
        return "\n".join([*prototype, *([said] if said else []), *head, "{", *body, "}", ""])


class _Body:
    """Writer of the lines of one function body."""

    def __init__(self, writer: _Writer, function: Function, scopes: Scopes) -> None:
        self.writer = writer
        of_all, own = writer.places, f"{function.source}."
        of_one = {key.removeprefix(own): names for key, names in of_all.items() if key.startswith(own)}
        self.terms = _CTerms(writer.type_name, self.name, {**of_all, **of_one}, writer.functions, writer.made.add)
        self.scopes = scopes
        self.kinds: dict[str, Type] = dict(function.parameters) | scopes.types
        self.written: dict[str, str] = {}
        self.used: set[str] = set()

    def name(self, name: str) -> str:
        """C name of a local variable, unique in the function and distinct from all names of the file."""
        if name not in self.written:
            self.written[name] = c_name(name, self.kinds, self.writer.outer)
            self.used.add(self.written[name])
        return self.written[name]

    def block(self, body: tuple[Statement, ...], level: int) -> list[str]:
        """Lines of a block of statements, preceded by the declarations that they need."""
        lines: list[str] = []
        for name in self.scopes.before.get(id(body), []):
            kind = self.kinds[name]
            if name in self.scopes.read and not is_empty(kind):
                # A number begins as 0, so that no compiler fears for it.
                begin = {BOOL: " = false", FLOAT: " = 0.0"}
                value = begin.get(kind, " = 0") if isinstance(kind, Scalar) else ""
                lines.append(f"{'    ' * level}{self.writer.type_name(kind)} {self.name(name)}{value};")
        for statement in body:
            lines += self.statement(statement, level)
        return lines

    def statement(self, statement: Statement, level: int) -> Iterator[str]:
        """Yield the lines of a statement, including nested blocks."""
        match statement:
            case typed.Assign():
                # What nobody reads is not written: a compiler would warn of it.
                if statement.name in self.scopes.read and not is_empty(statement.value.type):
                    starts = self.scopes.first.get(id(statement), "")
                    declared = f"{starts}{self.writer.type_name(statement.value.type)} " if starts else ""
                    is_listed = starts and self.writer.reading is not None
                    value = self.terms.listed(statement.value) if is_listed else self.terms.term(statement.value)
                    yield from self.line(f"{declared.replace('let ', '')}{self.name(statement.name)} = {value};", level)
            case typed.Store():
                yield from self.store(statement, level)
            case typed.Return():
                value = ""
                # Where people read, a struct that is returned has a name.
                if statement.value.kind == "build" and self.writer.reading is not None:
                    value = c_name("made", self.kinds, {*self.writer.outer, *map(self.name, self.kinds)})
                    kind = self.writer.type_name(statement.value.type)
                    yield from self.line(f"const {kind} {value} = {self.terms.listed(statement.value)};", level)
                yield from self.line(f"return {value or self.terms.term(statement.value)};", level)
            case typed.CountedLoop():
                yield from self.counted_loop(statement, level)
            case typed.If() | typed.While():
                word = "while" if isinstance(statement, typed.While) else "if"
                yield from self.line(f"{word} ({self.terms.term(statement.test)}) {{", level)
                yield from self.block(statement.body, level + 1)
                if isinstance(statement, typed.If) and statement.otherwise:
                    yield from self.line("} else {", level)
                    yield from self.block(statement.otherwise, level + 1)
                yield from self.line("}", level)
            case _:
                yield from self.line(self.plain_line(statement), level)

    def plain_line(self, statement: typed.Note | typed.LocalArray | typed.ProcedureCall | typed.LoopExit) -> str:
        """Text of a statement that fits on one line."""
        match statement:
            case typed.Note():
                return _comment(statement.text)
            case typed.LocalArray():
                extents = "".join(f"[{extent}]" for extent in statement.type.shape)
                return f"PPAFO_ALIGNED double {self.name(statement.name)}{extents};"
            case typed.ProcedureCall():
                name = self.writer.functions.get(statement.function, statement.function)
                return f"{name}({', '.join(map(self.terms.term, statement.given))});"
            case typed.LoopExit():
                return f"{statement.word};"

    def line(self, text: str, level: int) -> Iterator[str]:
        yield from _wrapped("    " * level + text, "    " * (level + 1))

    def store(self, store: typed.Store, level: int) -> Iterator[str]:
        """Yield the lines of an assignment to an array element or to a field of a row."""
        value = store.value
        # Member by member reads better, but only where no member is read on the right.
        is_read = self.writer.reading is not None and not value.reads & store.element.reads
        if is_read and value.kind == "build" and isinstance(value.type, Row):
            for (name, kind), part in zip(value.type.fields, value.parts, strict=True):
                if not is_empty(kind):
                    yield from self.store(typed.Store(Term("field", kind, (store.element,), name), part), level)
            return
        yield from self.line(f"{self.terms.term(store.element)} = {self.terms.term(store.value)};", level)

    def counted_loop(self, loop: typed.CountedLoop, level: int) -> Iterator[str]:
        """Yield the lines of a counted loop; a variable used after the loop is set from a separate counter."""
        name = self.name(loop.name)
        is_own = id(loop) in self.scopes.counted or loop.name not in self.scopes.read
        # A loop's name ends at its last value in Python, one further in C.
        counter = name if is_own else f"{name}_next"
        while not is_own and counter in {*map(self.name, self.kinds), *self.writer.outer}:
            counter += "_"
        self.used.add(counter)
        sign, change = ("<", f"++{counter}") if loop.step == 1 else (">", f"{counter} += {loop.step}")
        sign = "<" if loop.step > 0 else ">"
        start, stop = self.terms.term(loop.start), self.terms.term(loop.stop, 6)
        if loop.name == LANE:
            # Without the pragma gcc fears that lanes overlap, and takes them one by one.
            yield from self.line("PPAFO_SIDE_BY_SIDE", level)
        yield from self.line(
            f"for ({self.writer.type_name(loop.start.type)} {counter} = {start}; {counter} {sign} {stop}; {change}) {{",
            level,
        )
        if not is_own:
            yield from self.line(f"{name} = {counter};", level + 1)
        yield from self.block(loop.body, level + 1)
        yield from self.line("}", level)


def _together(members: Iterable[str]) -> list[str]:
    """Declarations of struct members; neighbouring members of one type share a declaration."""
    lines: list[str] = []
    for kind, group in itertools.groupby((text.split(TIED) for text in members), key=lambda pair: pair[0]):
        lines += _wrapped(f"    {kind} {', '.join(pair[1] for pair in group)};", " " * 8)
    return lines


def _wrapped(line: str, further: str = "    ") -> list[str]:
    """Split a line of C code into lines within the length limit."""
    if len(line) <= WIDTH:
        return [line.replace(TIED, " ")]
    margin = line[: len(line) - len(line.lstrip())]
    lines = textwrap.wrap(
        line.strip(),
        WIDTH,
        initial_indent=margin,
        subsequent_indent=further,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [line.replace(TIED, " ") for line in lines]
