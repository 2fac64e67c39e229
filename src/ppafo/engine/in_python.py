"""Functions of the model run by Python itself, as a program has them: the same code, and a debugger stops in it.

Where a program has something in the place of functions of the model, its actuator's and the laws of its effects, these
stand in copies of the functions that call them: the same code with other names around it, so that breakpoints in their
files hold. Compiled code goes on where Python raises, with what a division by zero gives: copies may do the same.

Steps (``interpreter.py``), recordings, solvers and linear models run their functions so.
"""

import ast
import inspect
import math
import sys
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from functools import lru_cache
from itertools import repeat
from types import CodeType, FunctionType, ModuleType, SimpleNamespace
from typing import Any, Protocol

import numpy as np

from ppafo.engine.linking import link_program
from ppafo.engine.plain_python import parse_module
from ppafo.engine.program import Program
from ppafo.engine.rows import leaves, rebuilt
from ppafo.model.binding import is_made_of
from ppafo.model.declaration import PlainFunction

OWN = "ppafo."
"""Begin of the names of modules whose functions are called by the names of the modules, too."""


class EffectRows(Protocol):
    """Parameters and states of effects by name, as they are at a call."""

    def __getitem__(self, name: str, /) -> Any:
        """The NamedTuple of a name."""


class PythonFunctions:
    """Functions in which some names stand for what a program has in their place; the functions themselves without any.

    With ``goes_on``, a division by zero and the root of a negative number give what compiled code gets.
    """

    def __init__(
        self, links: Mapping[Any, Any], effects: Mapping[Any, tuple[str, ...]], rows: EffectRows, goes_on: bool = False
    ) -> None:
        self._links, self._effects, self._rows, self._goes_on = links, effects, rows, goes_on
        self._made: dict[Any, Any] = {}

    def parts(self, program: Program) -> Any:
        """All that a program says of itself, worked out once."""
        names = [name for name in dir(program) if not name.startswith("_")]
        values = {name: getattr(program, name) for name in names}
        return SimpleNamespace(**{name: self._part(value) for name, value in values.items()})

    def _part(self, value: Any) -> Any:
        """A part of a program, with the functions that stand for its own."""
        if isinstance(value, FunctionType | ModuleType):
            return self.of(value)
        if isinstance(value, Mapping):
            return {key: self._part(part) for key, part in value.items()}
        if is_dataclass(value) and not isinstance(value, type):
            changed = {part.name: self._part(getattr(value, part.name)) for part in fields(value) if part.init}
            return replace(value, **changed)
        return value

    def of(self, value: Any, inside: Any = None) -> Any:
        """What stands for a value inside a function."""
        if not self._links and not self._goes_on:
            return value
        value = getattr(value, "__wrapped__", value)
        if isinstance(value, FunctionType):
            return self._function(self._links.get((inside, value), self._links.get(value, value)))
        if isinstance(value, ModuleType) and value.__name__.startswith(OWN):
            return self._module(value)
        if value is math and self._goes_on:
            return MATH
        return value

    def _module(self, module: ModuleType) -> Any:
        if module not in self._made:
            self._made[module] = space = SimpleNamespace()
            own = {name: value for name, value in vars(module).items() if not name.startswith("__")}
            vars(space).update({name: self.of(value) for name, value in own.items()})
        return self._made[module]

    def _function(self, function: FunctionType) -> Any:
        """A copy of a function whose names stand for what the program has; the function itself where none differs."""
        # A valve or law of somebody's own module calls the model too; the standard library does not.
        if function.__module__.partition(".")[0] in sys.stdlib_module_names:
            return function
        if function not in self._made:
            code = going_on(function) if self._goes_on else function.__code__
            scope = dict(function.__globals__)
            copied = FunctionType(code, scope, function.__name__, function.__defaults__, function.__closure__)
            rows = self._effects.get(function, ())
            self._made[function] = self._law(copied, rows) if rows else copied
            for name in _names_of(function.__code__):
                if name in scope:
                    scope[name] = self.of(scope[name], function)
            copied.__kwdefaults__ = self._named_defaults(function)
            if self._goes_on:
                scope |= {"_quotient": quotient, "int": whole_part}
        return self._made[function]

    def _named_defaults(self, function: FunctionType) -> dict[str, Any]:
        """Defaults of the parameters by name, and in its parts what the program has in the place of functions."""

        def linked(part: Any) -> Any:
            return type(part)(*map(linked, part)) if is_made_of(part) else self.of(part, function)

        return {name: linked(value) for name, value in (function.__kwdefaults__ or {}).items()}

    def _law(self, function: FunctionType, rows: tuple[str, ...]) -> PlainFunction:
        """Return the law of an effect, called as its port is, with the present rows of the effect."""
        names = function.__code__.co_varnames[: function.__code__.co_argcount]
        own = [name for name in names if name not in rows]

        def called(*arguments: Any, **named: Any) -> Any:
            given = dict(zip(own, arguments, strict=False))
            return function(**given, **named, **{row: self._rows[row] for row in rows})

        return called


def _names_of(code: CodeType) -> set[str]:
    """Names that a code reads, with those of the code in it."""
    names = set(code.co_names)
    return names.union(*(_names_of(constant) for constant in code.co_consts if isinstance(constant, CodeType)))


class _GoingOn(ast.NodeTransformer):
    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        if not isinstance(node.op, ast.Div):
            return node
        return ast.copy_location(ast.Call(ast.Name("_quotient", ast.Load()), [node.left, node.right], []), node)


@lru_cache(maxsize=1024)
def going_on(function: FunctionType) -> CodeType:
    """The code of a function with quotients that go on, on the lines of its file."""
    code = function.__code__
    text = textwrap.dedent(inspect.getsource(function))
    tree = _GoingOn().visit(parse_module("\n" * (code.co_firstlineno - 1) + text))
    whole = compile(ast.fix_missing_locations(tree), code.co_filename, "exec", dont_inherit=True)
    return next(
        constant for constant in whole.co_consts if isinstance(constant, CodeType) and constant.co_name == code.co_name
    )


def functions_of(program: Program, rows: EffectRows, goes_on: bool = False) -> PythonFunctions:
    """Return the functions of the model as a program has them, with rows of its effects; ProgramError as linking."""
    collector = SimpleNamespace(links={}, effects={})
    link_program(program, collector)
    return PythonFunctions(collector.links, collector.effects, rows, goes_on)


def in_program(
    function: PlainFunction, program: Program, effects: Sequence[Any], goes_on: bool = False
) -> PlainFunction:
    """Return a function of the model as a program has it, with parameters of its effects.

    Before its own arguments it takes the states of effects by name, an empty mapping where there are none.
    """
    rows = {effect.name: row for effect, row in zip(program.effects, effects, strict=True)}
    own = functions_of(program, rows, goes_on).of(function)

    def called(states: Mapping[str, Any], *arguments: Any) -> Any:
        rows.update(states)
        return own(*arguments)

    return called


def over_samples(function: PlainFunction, *arguments: Any, goes_on: Callable[[], PlainFunction] | None = None) -> Any:
    """Value of a function of the model at every sample, numbers as columns (samples,).

    Arguments are numbers, rows, and mappings of rows; what is a column in them has one number for each sample. Without
    any column it is one value. Where Python raises, the function is called with operations that go on; ``goes_on``
    makes that of a function that is not the model's own.
    """
    sizes = {column.size for argument in arguments for column in _columns_of(argument)}
    if not sizes:
        return function(*arguments)
    (size,) = sizes
    try:
        return _gathered(list(map(function, *(_samples_of(argument, size) for argument in arguments))))
    except (ArithmeticError, ValueError):
        # A run that diverged has numbers of which Python would make none.
        without_errors = PythonFunctions({}, {}, {}, goes_on=True).of(function) if goes_on is None else goes_on()
        return _gathered(list(map(without_errors, *(_samples_of(argument, size) for argument in arguments))))


def _columns_of(argument: Any) -> list[Any]:
    """All columns in an argument."""
    if isinstance(argument, Mapping):
        return [column for row in argument.values() for column in _columns_of(row)]
    values = leaves(argument) if isinstance(argument, tuple) else [argument]
    return [value for value in values if isinstance(value, np.ndarray) and value.ndim]


def _samples_of(argument: Any, size: int) -> Iterable[Any]:
    """An argument at each of so many samples."""
    if not _columns_of(argument):
        return repeat(argument, size)
    if isinstance(argument, Mapping):
        rows = zip(*(_samples_of(row, size) for row in argument.values()), strict=True)
        return (dict(zip(argument, at, strict=True)) for at in rows)
    if not isinstance(argument, tuple):
        column: list[float] = argument.tolist()
        return column
    numbers = zip(*(_samples_of(value, size) for value in leaves(argument)), strict=True)
    return (rebuilt(type(argument), values) for values in numbers)


def _gathered(results: list[Any]) -> Any:
    """Columns of the numbers of results of one shape."""
    first = results[0]
    if not isinstance(first, tuple):
        return np.array(results, dtype=np.float64)
    parts = [_gathered(list(part)) for part in zip(*results, strict=True)]
    return type(first)(*parts) if hasattr(first, "_fields") else tuple(parts)


# Operations that go on where Python would raise, with what compiled code gives there: a run that diverges divides by
# zero or takes the root of a negative number; compiled, it ends as one that failed.

LOWEST_INTEGER = -(2**63)
"""The lowest integer of 64 bits, which processors give for a number that is none of these integers."""


def quotient(dividend: float, divisor: float) -> float:
    """Return a quotient as IEEE 754 has it: by zero it is infinite, and NaN for zero by zero."""
    if divisor != 0.0:
        return dividend / divisor
    if dividend == 0.0 or math.isnan(dividend):
        return math.nan
    return math.copysign(math.inf, dividend) * math.copysign(1.0, divisor)


def whole_part(value: float) -> int:
    """Return a number without its fraction; ``LOWEST_INTEGER`` for NaN and for what 64 bits do not hold."""
    return int(value) if LOWEST_INTEGER <= value < -LOWEST_INTEGER else LOWEST_INTEGER


def power(base: float, exponent: float) -> float:
    """Return a power as the C library has it: NaN for a root of a negative number, where Python's is complex."""
    return float(MATH.pow(base, exponent))


def _square_root(value: float) -> float:
    """Return a square root, NaN of a negative number."""
    return math.nan if value < 0.0 else math.sqrt(value)


def _logarithm(value: float) -> float:
    """Return a natural logarithm: minus infinity of 0, NaN of a negative number."""
    return math.log(value) if value > 0.0 else (-math.inf if value == 0.0 else math.nan)


def _without_errors(function: Callable[..., float]) -> Callable[..., float]:
    """Return a function of ``math`` that is infinite where it overflows, and NaN where it has no value."""

    def called(*arguments: float) -> float:
        try:
            return function(*arguments)
        except OverflowError:
            return math.inf
        except ValueError:
            return math.nan

    return called


def _math() -> SimpleNamespace:
    """Return the module ``math`` with functions that go on."""
    public = {name: value for name, value in vars(math).items() if not name.startswith("_")}
    going_on = {name: _without_errors(value) if callable(value) else value for name, value in public.items()}
    return SimpleNamespace(**going_on | {"sqrt": _square_root, "log": _logarithm})


MATH = _math()
"""The module ``math``: infinite where a function overflows, NaN where it has no value."""
