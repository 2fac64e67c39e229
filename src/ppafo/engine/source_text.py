"""Collection of pure functions, with all functions that they call, into the text of one stand-alone compiled module.

The text contains everything that determines the machine code, so that its hash identifies the module. A second start
finds the compiled code on disk; any change of the physics gives another hash and a new compilation. Code that would
behave differently from Python is refused, with the file and line of its source.
"""

import ast
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import CodeType, FunctionType
from typing import Any, Generic, NamedTuple

from ppafo.engine.composer import Composer
from ppafo.engine.definitions import Adaptation, check_is_plain, emitted_name, parse_definition, place_of, source_lines
from ppafo.engine.entries import ORIGIN, without_origins
from ppafo.engine.plain_python import refusal
from ppafo.engine.rows import is_row
from ppafo.errors import ProgramError
from ppafo.model.declaration import PlainFunction
from ppafo.wording import one_line


class NameRead(NamedTuple):
    """Name that was looked up during composition, and its value."""

    scope: Mapping[str, Any]
    name: str
    value: Any


class _ComposedFrom(NamedTuple):
    """Function as it was at composition."""

    function: Any
    code: CodeType
    defaults: tuple[Any, ...] | None
    named_defaults: dict[str, Any]


@dataclass(slots=True)
class MadeFrom:
    """Names read and functions composed for a text, which determine whether the text is up to date."""

    reads: list[NameRead] = field(default_factory=list)
    functions: list[_ComposedFrom] = field(default_factory=list)

    def is_current(self) -> bool:
        """Return whether all names and functions still have the values used at composition."""
        return all(read.scope.get(read.name, read) is read.value for read in self.reads) and all(
            made.function.__code__ is made.code
            and made.function.__defaults__ is made.defaults
            and (made.function.__kwdefaults__ or {}) == made.named_defaults
            for made in self.functions
        )


@dataclass(slots=True)
class Replacements:
    """Replacements of functions and of NamedTuple classes in one program.

    Attributes:
        everywhere: replacement of a function, whichever function calls it
        inside: replacement of a called function in one caller, by caller and called function: a law that calls its own
            port calls what acted there before
        constructed: class that ``_replace`` constructs, by the declared class of a row
        rows: names of the rows that a replacement takes before the arguments of the function that it replaces
    """

    everywhere: dict[PlainFunction, PlainFunction] = field(default_factory=dict)
    inside: dict[tuple[PlainFunction, PlainFunction], PlainFunction] = field(default_factory=dict)
    constructed: dict[type, type] = field(default_factory=dict)
    rows: dict[PlainFunction, tuple[str, ...]] = field(default_factory=dict)

    def called(self, function: Any, caller: Any = None) -> Any:
        """Return the replacement of a called function, specific to ``caller`` if given; by default the function itself.

        A NamedTuple class is returned as it is.
        """
        replacement = self.everywhere.get(function, function)
        return replacement if caller is None else self.inside.get((caller, function), replacement)


@dataclass(slots=True)
class SourceCollector:
    """Collector of definitions in dependency order; ``adapt`` may rewrite a definition.

    Functions in ``replacements`` are added in their replaced form. Effect rows that a replacement takes become
    parameters of all its callers, up to the text around the module (``needs``, ``composed_lines``).
    """

    decorator: str
    adapt: Adaptation | None = None
    definitions: dict[str, str] = field(default_factory=dict)
    owners: dict[str, Any] = field(default_factory=dict)
    made_from: MadeFrom = field(default_factory=MadeFrom)
    replacements: Replacements = field(default_factory=Replacements)
    needs: dict[str, tuple[str, ...]] = field(default_factory=dict)

    def add(self, function: PlainFunction | type) -> str:
        """Add a function or NamedTuple class and all its dependencies; return its name in the module."""
        return self._add(self.replacements.called(function))

    def _add(self, item: Any) -> str:
        """Add a function or NamedTuple class without replacement. ProgramError if it cannot be compiled."""
        if not is_row(item):
            check_is_plain(item)
        name = emitted_name(item)
        owner = self.owners.setdefault(name, item)
        if owner is item and name in self.definitions:
            return name
        text = _row_text(item, name) if isinstance(item, type) else self._function_text(item, name)
        if owner is item:
            self.definitions[name] = text
        # A second thing of the same name is refused unless it is the same text, as after a module was loaded anew.
        elif without_origins(text) != without_origins(self.definitions.get(name, "")):
            raise ProgramError(
                f"{place_of(item)}: '{item.__module__}.{item.__qualname__}' and "
                f"'{owner.__module__}.{owner.__qualname__}' at {place_of(owner)} would both be named '{name}' in the "
                f"compiled model; rename one of them"
            )
        return name

    def text(self) -> str:
        """Return all definitions, called functions first."""
        return "\n\n\n".join(self.definitions.values())

    def note_read(self, scope: Mapping[str, Any], name: str, value: Any) -> None:
        """Record an outside name and its value, on which the generated text depends."""
        self.made_from.reads.append(NameRead(scope, name, value))

    def handed_to(self, name: str) -> tuple[str, ...]:
        """Return the effect parameters and states that a generated function takes as leading arguments."""
        return self.needs.get(name, ())

    def constructed(self, row: Any) -> Any:
        """Return the class that replaces a declared NamedTuple class in this module."""
        return self.replacements.constructed.get(row, row)

    def decorated(self, tree: ast.FunctionDef, file: str) -> str:
        """Return the text of a composed function, with the line numbers of its source file."""
        lines = " ".join(map(str, [tree.lineno, *source_lines(tree.body), (tree.end_lineno or tree.lineno) + 1]))
        return f"{ORIGIN} {one_line(file)}: {lines}\n{self.decorator}\n{ast.unparse(tree)}"

    def _function_text(self, function: FunctionType, name: str) -> str:
        """Return the text of a function under its name in the module; called functions are added first.

        Raises ProgramError if the function contains code that cannot be compiled, or calls itself.
        """
        tree = parse_definition(function, self.adapt)
        # Recorded before the body is composed, so that a function met again inside its own body is found.
        if any(known.function is function for known in self.made_from.functions):
            problem = f"'{function.__name__}' calls itself, which cannot be compiled"
            raise refusal(function.__code__.co_filename, tree, problem)
        named = dict(function.__kwdefaults__ or {})
        self.made_from.functions.append(_ComposedFrom(function, function.__code__, function.__defaults__, named))
        composer = Composer(function, self, self.add_inside)
        own_rows = self.replacements.rows.get(function, ())
        taken = [*tree.args.posonlyargs, *tree.args.args, *tree.args.kwonlyargs]
        names = [argument.arg for argument in taken if argument.arg not in composer.known]
        # Rows of effects come first in every function, so that callers can hand them over without knowing the rest.
        names.sort(key=lambda name: name not in own_rows)
        body = tree.body[1:] if ast.get_docstring(tree) is not None else tree.body
        tree.name = name
        tree.returns = None
        tree.body = [composer.visit(statement) for statement in body]
        # Rows of called functions for which this function has no parameter are passed on by its callers.
        passed_on = sorted(composer.rows_to_receive)
        if own_rows or passed_on:
            self.needs[name] = (*passed_on, *(row for row in names if row in own_rows))
        # Every call gives all arguments in their order, also those that have a default value.
        every = [ast.arg(parameter) for parameter in (*passed_on, *names)]
        tree.args = ast.arguments([], every, None, [], [], None, [])
        return self.decorated(tree, function.__code__.co_filename)

    def add_inside(self, function: Any, called: Any) -> str:
        """Add a function called inside another; a law that calls its own port gets the port's previous function."""
        if (function, called) in self.replacements.inside:
            return self._add(self.replacements.inside[function, called])
        if called in self.replacements.rows:
            raise ProgramError(
                f"{place_of(function)}: '{called.__name__}' is the law of an effect and cannot be called; call its port"
            )
        return self.add(called)


def composed_lines(lines: Iterable[str], needs: Mapping[str, tuple[str, ...]]) -> list[str]:
    """Lines of the text around a module, in which calls pass the rows of effects that functions need."""
    if not needs:
        return list(lines)
    calls = re.compile(rf"\b({'|'.join(map(re.escape, needs))})\(")
    return [calls.sub(lambda call: f"{call[0]}{', '.join(needs[call[1]])}, ", line) for line in lines]


def _row_text(row: Any, name: str) -> str:
    """Return the text of a NamedTuple class without methods; refused if this would change its behaviour."""
    own = vars(row)
    others = [base for base in row.__bases__[1:] if base is not Generic]
    if row.__bases__[0] is not tuple or others:
        raise ProgramError(f"{row.__module__}.{row.__qualname__} must be a NamedTuple, not a subclass of one")
    meanings = {name for name, value in own.items() if name.startswith("__") and isinstance(value, FunctionType)}
    meanings -= set(vars(NameRead)) | {"__str__", "__format__"}
    if meanings:
        names = ", ".join(sorted(meanings))
        raise ProgramError(
            f"{row.__module__}.{row.__qualname__} redefines {names}, which cannot be compiled; remove the method"
        )
    return f"{name} = namedtuple({name!r}, {list(row._fields)!r})"
