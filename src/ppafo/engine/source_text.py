"""Collects pure functions, with all they call, into the text of one stand-alone compiled module.

The text holds everything that decides the machine code, so its hash names the module: a second start finds the
compiled code on disk, and a change anywhere in the physics gives another name and is compiled anew. What would run
otherwise than in Python is refused, in terms of the file that it was written in.
"""

import ast
import inspect
import re
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from types import CodeType, FunctionType, ModuleType
from typing import Any, Generic, NamedTuple, Protocol

from ppafo.engine.composed_names import Composer, is_row
from ppafo.engine.plain_python import check_flow, check_grammar, parse_module, place, refusal
from ppafo.errors import ProgramError, one_line

ORIGIN = "# origin"
"""Beginning of the line before each function that says which lines of which file it was made from."""


class Read(NamedTuple):
    """A name that was looked up while composing, and what it stood for."""

    scope: Mapping[str, Any]
    name: str
    value: Any


class Made(NamedTuple):
    """A function as it was when it was composed."""

    function: Any
    code: CodeType
    defaults: tuple[Any, ...] | None
    named_defaults: dict[str, Any]


def emitted_name(item: Any) -> str:
    """Name that a function or NamedTuple class gets in the generated module: its module path and its own name."""
    module = item.__module__ or ""
    path = module.removeprefix("ppafo.") if module.startswith("ppafo.") else f"foreign.{module}"
    return re.sub(r"\W", "_", f"{path}_{item.__qualname__}")


def without_origins(source: str) -> str:
    """The text without the lines that say where its functions stand: what decides the machine code."""
    return "\n".join(line for line in source.split("\n") if not line.startswith(ORIGIN))


def woven(lines: Iterable[str], needs: Mapping[str, tuple[str, ...]]) -> list[str]:
    """Lines of the text around a module, in which calls hand over the rows of effects that functions need."""
    if not needs:
        return list(lines)
    calls = re.compile(rf"\b({'|'.join(map(re.escape, needs))})\(")
    return [calls.sub(lambda call: f"{call[0]}{', '.join(needs[call[1]])}, ", line) for line in lines]


def is_unchanged(reads: Iterable[Read], functions: Iterable[Made]) -> bool:
    """True while every name stands for what it stood for, and every function is what it was."""
    return all(read.scope.get(read.name, read) is read.value for read in reads) and all(
        made.function.__code__ is made.code
        and made.function.__defaults__ is made.defaults
        and (made.function.__kwdefaults__ or {}) == made.named_defaults
        for made in functions
    )


Adaptation = Callable[[FunctionType, ast.FunctionDef], ast.FunctionDef]
"""Makes a definition one of the part of Python that is compiled; it is handed a copy of its own."""


def as_it_is(_function: FunctionType, tree: ast.FunctionDef) -> ast.FunctionDef:
    """The definition itself."""
    return tree


class Collector(Protocol):
    """Gathers definitions for the module around them: a ``SourceCollector`` writes them, an ``Outline`` hashes them."""

    @property
    def links(self) -> dict[Any, Any]:
        """What stands for others: under a pair of functions for its second inside its first alone.

        Under a row and ``"_replace"`` is the class that ``row._replace`` makes.
        """

    @property
    def effects(self) -> dict[Any, tuple[str, ...]]:
        """Laws of effects, each with the rows that it asks for by the names of its parameters."""

    @property
    def needs(self) -> dict[str, tuple[str, ...]]:
        """Rows of effects that functions of the module are handed before their own arguments, by emitted name."""

    def add(self, item: Callable[..., Any] | type) -> str:
        """Add a function or NamedTuple class and all that it needs; return the name it has in the module."""

    def text(self) -> str:
        """What stands for all definitions in the module."""


@dataclass(slots=True)
class SourceCollector:
    """Gathers definitions in the order in which they must stand; ``adapt`` may write a definition in another way.

    Where a function is among ``links``, the one that it is linked to is added and called in its place; a link under a
    pair holds inside the first of it. The ``effects`` are laws with the rows that they ask for: whoever calls one is
    handed these rows in its turn, and so on up to the text around the module (``needs``, ``woven``).
    """

    decorator: str
    adapt: Adaptation = as_it_is
    definitions: dict[str, str] = field(default_factory=dict)
    owners: dict[str, Any] = field(default_factory=dict)
    reads: list[Read] = field(default_factory=list)
    functions: list[Made] = field(default_factory=list)
    links: dict[Any, Any] = field(default_factory=dict)
    effects: dict[Any, tuple[str, ...]] = field(default_factory=dict)
    needs: dict[str, tuple[str, ...]] = field(default_factory=dict)

    def add(self, item: Callable[..., Any] | type) -> str:
        """Add a function or NamedTuple class and all that it needs; return the name it has in the module."""
        return self._add(self.links.get(item, item))

    def _add(self, item: Any) -> str:
        if not is_row(item):
            check_is_plain(item)
        name = emitted_name(item)
        owner = self.owners.setdefault(name, item)
        if owner is item and name in self.definitions:
            return name
        if owner is not item:
            self._check_is_the_same(item, owner, name)
            return name
        text = _row_text(item, name) if isinstance(item, type) else self._function_text(item, name)
        self.definitions[name] = text
        return name

    def text(self) -> str:
        """All definitions, callees first."""
        return "\n\n\n".join(self.definitions.values())

    def is_current(self) -> bool:
        """True while every name and function that was composed is what it was then."""
        return is_unchanged(self.reads, self.functions)

    def _check_is_the_same(self, item: Any, owner: Any, name: str) -> None:
        """Refuse a second thing of the same name, unless it is the same text, as after a module was loaded anew."""
        text = _row_text(item, name) if isinstance(item, type) else self._function_text(item, name)
        if without_origins(text) != without_origins(self.definitions.get(name, "")):
            raise ProgramError(
                f"{place_of(item)}: '{item.__module__}.{item.__qualname__}' and "
                f"'{owner.__module__}.{owner.__qualname__}' at {place_of(owner)} both get the name '{name}' in the "
                f"compiled model; give one of them another name"
            )

    def _function_text(self, function: Any, name: str) -> str:
        tree = parse_definition(function, self.adapt)
        file = function.__code__.co_filename
        made = Made(
            function=function,
            code=function.__code__,
            defaults=function.__defaults__,
            named_defaults=dict(function.__kwdefaults__ or {}),
        )
        if any(known.function is function for known in self.functions):
            raise refusal(file, tree, f"'{function.__name__}' calls itself, which cannot be compiled")
        self.functions.append(made)
        composer = Composer(
            function, lambda item: self._add_inside(function, item), self._note, self._rows_of, self._stands_for
        )
        arguments = tree.args
        asked = self.effects.get(function, ())
        if asked:
            arguments.args = sorted(arguments.args, key=lambda item: item.arg not in asked)
        for argument in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs):
            argument.annotation = None
        # What Python calls the function with, whatever the text of the default stands for by now.
        arguments.defaults = [composer.literal(value, tree, "a default") for value in made.defaults or ()]
        arguments.kw_defaults = [
            composer.literal(made.named_defaults[item.arg], tree, "a default")
            if item.arg in made.named_defaults
            else None
            for item in arguments.kwonlyargs
        ]
        body = tree.body[1:] if ast.get_docstring(tree) is not None else tree.body
        tree.name, tree.returns = name, None
        tree.body = [composer.visit(statement) for statement in body]
        handed = sorted(composer.needed)
        arguments.args = [*map(ast.arg, handed), *arguments.args]
        if asked or handed:
            own = [item.arg for item in arguments.args if item.arg in asked]
            self.needs[name] = (*handed, *own)
        lines = " ".join(map(str, [tree.lineno, *_line_numbers(tree.body), (tree.end_lineno or tree.lineno) + 1]))
        text = ast.unparse(tree)
        return f"{ORIGIN} {one_line(file)}: {lines}\n{self.decorator}\n{text}"

    def _add_inside(self, function: Any, item: Any) -> str:
        """Add what a function calls; a law of an effect that calls its own place gets what was there before it."""
        if (function, item) in self.links:
            return self._add(self.links[function, item])
        if item in self.effects and isinstance(item, FunctionType):
            raise ProgramError(
                f"{place_of(function)}: '{item.__name__}' is the law of an effect: call its place instead"
            )
        return self.add(item)

    def _stands_for(self, row: Any) -> Any:
        return self.links.get((row, "_replace"), row)

    def _rows_of(self, name: str) -> tuple[str, ...]:
        return self.needs.get(name, ())

    def _note(self, scope: Mapping[str, Any], name: str, value: Any) -> None:
        self.reads.append(Read(scope, name, value))


def check_is_plain(function: Any) -> None:
    """Refuse what is no plain function: its source text would not be what Python runs. ProgramError says why."""
    name = getattr(function, "__qualname__", None) or repr(function)
    if type(function) is not FunctionType:
        if not callable(function):
            raise ProgramError(f"cannot compile {name}: it is not a function")
        if type(function).__module__ == "builtins" and type(function).__name__ == "builtin_function_or_method":
            raise ProgramError(f"cannot compile {name}: its source text is not available")
        raise ProgramError(f"cannot compile {name}: it must be a plain function defined with 'def'")
    if hasattr(function, "__wrapped__"):
        raise ProgramError(
            f"{place_of(function)}: '{name}' is wrapped by a decorator, which cannot be compiled; remove it"
        )
    if function.__closure__:
        names = ", ".join(f"'{item}'" for item in function.__code__.co_freevars)
        raise ProgramError(
            f"{place_of(function)}: '{name}' uses {names} of the function around it, which cannot be compiled; "
            "make it a parameter"
        )


def place_of(item: Any) -> str:
    """File and line of a function, the module of anything else."""
    code = getattr(item, "__code__", None)
    return f"module {item.__module__}" if code is None else place(code.co_filename, code.co_firstlineno)


def parse_definition(function: FunctionType, adapt: Adaptation = as_it_is) -> ast.FunctionDef:
    """The definition of a plain function with the lines of its file; refused where it is not what Python runs.

    ProgramError where the definition cannot be read or is not what Python runs.
    """
    code = function.__code__
    file, name = code.co_filename, function.__qualname__
    try:
        text = textwrap.dedent(inspect.getsource(function))
    except (OSError, TypeError) as error:
        reason = f"its source text is not available ({error})"
        raise ProgramError(f"cannot compile {name}: {reason}") from error
    try:
        tree = parse_module("\n" * (code.co_firstlineno - 1) + text).body[0]
    except SyntaxError as error:
        raise refusal(file, code.co_firstlineno, f"the source text of '{name}' cannot be read alone") from error
    if not isinstance(tree, ast.FunctionDef) or tree.name != code.co_name:
        raise refusal(file, code.co_firstlineno, f"'{name}' must be a plain function defined with 'def'")
    if tree.decorator_list:
        raise refusal(file, tree, f"'{name}' is decorated, which cannot be compiled; remove the decorator")
    adapted = adapt(function, tree if adapt is as_it_is else deepcopy(tree))
    check_grammar(adapted, file)
    if _shape(code) not in (_shape(item) for item in _code_of(tree, function)):
        changed = "is not what its source text says; the file has changed since it was loaded: start again"
        raise refusal(file, tree, f"'{name}' {changed}")
    check_flow(adapted, file, code.co_varnames)
    return adapted


def _code_of(tree: ast.FunctionDef, function: FunctionType) -> Iterator[CodeType]:
    """The code that Python makes of a definition: it calls what is in a module otherwise where it sees the import."""
    names = function.__code__.co_names
    modules = [name for name in names if isinstance(function.__globals__.get(name), ModuleType)]
    imports = [parse_module(f"import {name}").body[0] for name in modules]
    for before in (imports, []):
        module = compile(ast.Module([*before, tree], []), "<source>", "exec", dont_inherit=True)
        yield next(item for item in module.co_consts if isinstance(item, CodeType) and item.co_name == tree.name)


def _shape(code: CodeType) -> tuple[Any, ...]:
    """What a code object computes, without the places of its lines and its docstring."""
    constants = [(type(item), repr(item)) for item in code.co_consts if not isinstance(item, str)]
    return code.co_code, code.co_names, code.co_varnames, code.co_argcount, code.co_kwonlyargcount, constants


def _row_text(row: Any, name: str) -> str:
    """The NamedTuple class without what numbers have no use for; refused where that would change what it does."""
    own = vars(row)
    others = [base for base in row.__bases__[1:] if base is not Generic]
    if row.__bases__[0] is not tuple or others:
        raise ProgramError(
            f"{row.__module__}.{row.__qualname__} must be a NamedTuple itself, not a class made from one"
        )
    meanings = {item for item, value in own.items() if item.startswith("__") and isinstance(value, FunctionType)}
    meanings -= set(vars(Read)) | {"__str__", "__format__"}
    if meanings:
        given = ", ".join(sorted(meanings))
        raise ProgramError(
            f"{row.__module__}.{row.__qualname__} gives {given} a meaning of its own, which cannot be compiled"
        )
    return f"{name} = namedtuple({name!r}, {list(row._fields)!r})"


def _line_numbers(body: list[ast.stmt]) -> Iterator[int]:
    """Line in its file of each line that ``ast.unparse`` writes for some statements."""
    for statement in body:
        yield statement.lineno
        if isinstance(statement, ast.If | ast.For | ast.While):
            yield from _line_numbers(statement.body)
            otherwise = statement.orelse
            is_elif = isinstance(statement, ast.If) and len(otherwise) == 1 and isinstance(otherwise[0], ast.If)
            if otherwise and not is_elif:
                yield otherwise[0].lineno
            yield from _line_numbers(otherwise)
