"""Code generator for C99 that is also valid C++, for the typed functions of a composed module.

Each Python function becomes one C function with the same name and docstring; rows become structs passed by value. The
generated code has no heap, no mutable globals and no recursion. The only library functions are ``sqrt`` and ``fabs``,
which are exact, unless type inference was told to allow others. Compiled with the flags of ``engine.compilers``, the
code gives results that are bit-identical to compiled Python modules.
"""

import inspect
import itertools
import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files

from ppafo.engine.source_text import SourceCollector
from ppafo.translation import typed
from ppafo.translation.c_terms import PART, CTerms, c_name, member_name
from ppafo.translation.scopes import Scopes
from ppafo.translation.typed import Function, Module, Statement, Term
from ppafo.translation.value_types import BOOL, FLOAT, Array, Items, Row, RowReference, Scalar, Type, is_empty, types_in

WIDTH = 118
TIED = "\N{NO-BREAK SPACE}"
"""Non-breaking space between two words of generated code that must stay on one line."""

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
"""Name of a loop variable with independent iterations, for which a compiler pragma is emitted."""


def documents_of(collector: SourceCollector) -> dict[str, str]:
    """Return the docstrings of the collected functions and classes, by their names in the composed module."""
    return {name: inspect.getdoc(owner) or "" for name, owner in collector.owners.items()}


def c_source(
    module: Module,
    documents: Mapping[str, str],
    title: str,
    prelude: str = "prelude.h",
    names: Mapping[str, str] | None = None,
    declared: Mapping[str, str] | None = None,
    around: str | None = None,
) -> str:
    """Return the C translation unit of a module.

    ``documents`` has the docstrings of rows and functions. ``prelude`` is the name of the file that precedes all
    functions. ``names`` maps names in the module to unique short names, ``declared`` rows to structs that the text
    ``around`` declares; in such a text all functions are static, and what it does not use of the prelude is left out.
    """
    # A function that returns only empty rows is never called: an empty value is not written.
    functions = [function for function in module if function.returns is None or not is_empty(function.returns)]
    short = names or {}
    # A function for further types has their number behind its own name.
    own = {one.name: f"{short.get(one.source, one.source)}{one.name.removeprefix(one.source)}" for one in functions}
    writer = _Writer(documents, set(own.values()), own, short, declared or {}, has_entries=around is None)
    before = files("ppafo.translation").joinpath(prelude).read_text(encoding="utf-8")
    bodies = [writer.function(function) for function in functions]
    # Now all structs have their names, which no local name may hide: what has one is written again.
    names_of_structs = {*writer.struct_names.values(), *(f"make_{name}" for name in writer.struct_names.values())}
    writer.outer |= names_of_structs
    for number, function in enumerate(functions):
        if writer.locals[function.name] & names_of_structs:
            bodies[number] = writer.function(function)
    if around is not None:
        bodies = _called(bodies, [writer.functions.get(function.name, function.name) for function in functions], around)
    parts = [_PART] if any(f"{PART}(" in body for body in bodies) else []
    text = "\n".join([*parts, *(line for kind in writer.structs for line in writer.written_struct(kind)), *bodies])
    if around is None:
        return "\n".join([_comment(title), before, text])
    before = before.replace("#if !defined(PPAFO_INLINE)\n", "", 1).replace("#endif\n", "", 1)
    before = _prelude_for(before, text + around)
    return "\n".join([_comment(title), before, text]).replace("PPAFO_INLINE", "static")


def _called(bodies: Sequence[str], names: Sequence[str], around: str) -> list[str]:
    """Return the functions that others after them or the text around call; of a dropped value none is called."""
    kept: list[str] = []
    for body, name in zip(reversed(bodies), reversed(names), strict=True):
        if re.search(rf"\b{name}\(", "\n".join([*kept, around])):
            kept.append(body)
    return kept[::-1]


_DEFINES = re.compile(r"(?:^|\s|\*)(ppafo_\w+)\(|\} (ppafo_\w+);|#define (PPAFO_\w+)")


def _prelude_for(prelude: str, used: str) -> str:
    """Return the parts of a prelude that generated code uses."""
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
    """Return a C block comment with the lines of ``text`` and further lines."""
    # A docstring may contain the end of a C comment.
    lines = [line.rstrip() for line in text.replace("*/", "* /").replace("/*", "/ *").strip().splitlines()] + list(
        further
    )
    return "/* " + "\n * ".join(lines).replace(" * \n", " *\n") + " */" if lines else ""


@dataclass(slots=True)
class _Writer:
    """State of the code generator for a translation unit: struct names by type, and used names."""

    documents: Mapping[str, str]
    outer: set[str]
    functions: Mapping[str, str]
    short: Mapping[str, str]
    declared: Mapping[str, str]
    has_entries: bool
    structs: list[Items | Row] = field(default_factory=list)
    constructed: set[Type] = field(default_factory=set)
    struct_names: dict[Type, str] = field(default_factory=dict)
    locals: dict[str, set[str]] = field(default_factory=dict)
    owner: str = ""

    def type_name(self, kind: Type) -> str:
        """Return the C name of a type; a struct is declared at its first use."""
        if isinstance(kind, Scalar):
            return _SCALARS[kind.name]
        if isinstance(kind, Array):
            return "ppafo_array"
        if isinstance(kind, RowReference):
            return f"{self.type_name(kind.row)} *"
        if isinstance(kind, Row) and kind.name in self.declared:
            return self.declared[kind.name]
        assert isinstance(kind, Items | Row)
        if kind not in self.struct_names:
            wanted = own = self.struct_name(kind)
            number = 1
            while {own, f"make_{own}"} & {*self.outer, *self.struct_names.values()}:
                number += 1
                own = f"{wanted}_{number}"
            self.struct_names[kind] = own
            for inner in types_in(kind):
                if not is_empty(inner):
                    self.type_name(inner)
            self.structs.append(kind)
        return self.struct_names[kind]

    def struct_name(self, kind: Items | Row) -> str:
        """Return the preferred C name of a struct."""
        if isinstance(kind, Row):
            return self.short.get(kind.name, kind.name)
        if kind.is_uniform:
            return f"{self.type_name(kind.types[0]).removesuffix('_t')}s_{len(kind.types)}"
        return f"{self.short.get(self.owner, self.owner)}_result"

    def written_struct(self, kind: Items | Row) -> list[str]:
        """Return the declaration of a struct, with its constructor function where one is called."""
        name = self.struct_names[kind]
        is_array = isinstance(kind, Items) and kind.is_uniform
        if isinstance(kind, Items) and kind.is_uniform:
            inner = self.type_name(kind.types[0])
            count = len(kind.types)
            members = [(inner, f"item[{count}]")]
            taken = {f"item_{index}": inner for index in range(count)}
            variable = "made"
        else:
            named = (
                [(member_name(kind, own), inner) for own, inner in kind.fields]
                if isinstance(kind, Row)
                else [(f"item_{index}", inner) for index, inner in enumerate(types_in(kind))]
            )
            types = {own: self.type_name(inner) for own, inner in named if not is_empty(inner)}
            members = [(inner, own) for own, inner in types.items()]
            taken = {c_name(own, types, {name, *types.values()}): inner for own, inner in types.items()}
            variable = c_name("made", taken, taken)
        comment = _comment(self.documents.get(kind.name, "")) if isinstance(kind, Row) else ""
        declared: list[str] = []
        # Neighbouring members of one type share a declaration.
        for shared, group in itertools.groupby(members, key=lambda member: member[0]):
            declared += _wrapped(f"    {shared} {', '.join(own for _, own in group)};", " " * 8)
        struct = [*([comment] if comment else []), "typedef struct {", *declared, f"}} {name};", ""]
        if kind not in self.constructed:
            return struct
        listed = f"{{{', '.join(taken)}}}"
        begin = f"    const {name} {variable} = {f'{{{listed}}}' if is_array else listed};"
        parameters = ", ".join(f"{inner}{TIED}{own}" for own, inner in taken.items())
        head = _wrapped(f"PPAFO_INLINE {name} make_{name}({parameters})")
        return [*struct, *head, "{", *_wrapped(begin, " " * 8), f"    return {variable};", "}", ""]

    def function(self, function: Function) -> str:
        """Return the C code of a function, with its comment."""
        self.owner = function.source
        writer = _Body(self, function, Scopes(function))
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
        is_shown = function.is_entry and self.has_entries
        linkage = f"PPAFO_ENTRY {returns}" if is_shown else f"PPAFO_INLINE {returns}"
        head = _wrapped(f"{linkage} {self.functions.get(function.name, function.name)}({parameters or 'void'})")
        bound = [f"Here {text}." for text in function.bound]
        comment = _comment(self.documents.get(function.source, ""), bound)
        prototype = [*head[:-1], f"{head[-1]};", ""] if is_shown else []
        return "\n".join([*prototype, *([comment] if comment else []), *head, "{", *body, "}", ""])


class _Body:
    """Code generator for a function body."""

    def __init__(self, writer: _Writer, function: Function, scopes: Scopes) -> None:
        self.writer = writer
        self.terms = CTerms(writer.type_name, self.name, writer.functions, writer.constructed.add)
        self.scopes = scopes
        self.kinds: dict[str, Type] = dict(function.parameters) | scopes.types
        self.written: dict[str, str] = {}
        self.used: set[str] = set()

    def name(self, name: str) -> str:
        """Return the C name of a local variable, unique in the function and among all names of the file."""
        if name not in self.written:
            self.written[name] = c_name(name, self.kinds, self.writer.outer)
            self.used.add(self.written[name])
        return self.written[name]

    def block(self, body: tuple[Statement, ...], level: int) -> list[str]:
        """Return the lines of a block of statements, preceded by the declarations that it needs."""
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
                # A name that is never read is not written: a compiler would warn of it.
                if statement.name in self.scopes.read and not is_empty(statement.value.type):
                    starts = self.scopes.first.get(id(statement), "")
                    declared = f"{starts}{self.writer.type_name(statement.value.type)} " if starts else ""
                    value = self.terms.listed(statement.value) if starts else self.terms.term(statement.value)
                    yield from self.line(f"{declared.replace('let ', '')}{self.name(statement.name)} = {value};", level)
            case typed.Store():
                yield from self.store(statement, level)
            case typed.Return():
                value = ""
                # A struct that is returned has a name, for readers.
                if statement.value.kind == "build":
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
            case typed.Note():
                yield from self.line(_comment(statement.text), level)
            case typed.LocalArray():
                extents = "".join(f"[{extent}]" for extent in statement.type.shape)
                yield from self.line(f"PPAFO_ALIGNED double {self.name(statement.name)}{extents};", level)
            case typed.ProcedureCall():
                name = self.writer.functions.get(statement.function, statement.function)
                yield from self.line(f"{name}({', '.join(map(self.terms.term, statement.given))});", level)
            case typed.LoopExit():
                yield from self.line(f"{statement.word};", level)

    def line(self, text: str, level: int) -> Iterator[str]:
        yield from _wrapped("    " * level + text, "    " * (level + 1))

    def store(self, store: typed.Store, level: int) -> Iterator[str]:
        """Yield the lines of an assignment to an array element or to a field of a row."""
        value = store.value
        # Member by member reads better, but only where no member is read on the right.
        if not value.reads & store.element.reads and value.kind == "build" and isinstance(value.type, Row):
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
        start = self.terms.term(loop.start)
        stop = self.terms.term(loop.stop, 6)
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


def _wrapped(line: str, further: str = "    ") -> list[str]:
    """Wrap a line of C code at the length limit."""
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
