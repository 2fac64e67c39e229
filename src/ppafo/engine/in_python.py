"""Interpreted execution of model functions with the replacements of a program; debuggers can stop in the code.

A program may replace functions of the model by functions of its actuator and by laws of its effects. Copies of the
calling functions then use the replacements: the same code with other global names, so that breakpoints in the source
files work. Where Python raises an exception, compiled code continues with the result of IEEE 754; copies may do so too.

Steps (``interpreter.py``), recordings, solvers and linear models run their functions in this way.
"""

import ast
import contextlib
import inspect
import math
import operator
import sys
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from functools import lru_cache, partial
from types import CodeType, FunctionType, ModuleType, SimpleNamespace
from typing import Any, NamedTuple, Protocol

import numpy as np

from ppafo.engine.composer import COMPILED_BUILTINS
from ppafo.engine.linking import link_program
from ppafo.engine.plain_python import parse_module
from ppafo.engine.program import Program
from ppafo.engine.rows import one_by_one
from ppafo.engine.source_text import MadeFrom, NameRead, Replacements
from ppafo.errors import ProgramError
from ppafo.model.binding import is_made_of
from ppafo.model.columns import gather
from ppafo.model.declaration import PlainFunction

OWN = "ppafo."
"""Prefix of module names whose functions may also be called through the module name."""
LOWEST_INTEGER = -(2**63)
"""Lowest 64-bit integer, which processors return for numbers that 64-bit integers cannot represent."""


class _EffectRows(Protocol):
    """Present parameters and states of effects, by name."""

    def __getitem__(self, name: str, /) -> Any:
        """Return the NamedTuple of a name."""


class PythonFunctions:
    """Copies of functions with names replaced as in a program; without replacements, the original functions.

    ``operations`` replaces Python's operations, by operations that never raise or by operations on columns.
    """

    def __init__(
        self,
        replacements: Replacements,
        rows: _EffectRows,
        operations: "Operations | None" = None,
    ) -> None:
        self._replacements = replacements
        self._rows = rows
        self._operations = operations
        self._is_plain = operations is None and replacements == Replacements()
        self._copies: dict[Any, Any] = {}
        self.made_from = MadeFrom()

    def parts(self, program: Program) -> Any:
        """All public attributes of a program, computed once, with functions replaced."""
        names = [name for name in dir(program) if not name.startswith("_")]
        values = {name: getattr(program, name) for name in names}
        return SimpleNamespace(**{name: self.replaced(value) for name, value in values.items()})

    def replaced(self, value: Any) -> Any:
        """Return a program component or argument with the model functions in it replaced."""
        if isinstance(value, FunctionType | ModuleType):
            return self.of(value)
        if isinstance(value, Mapping):
            return {key: self.replaced(item) for key, item in value.items()}
        if is_made_of(value):
            return type(value)(*map(self.replaced, value))
        if is_dataclass(value) and not isinstance(value, type):
            changed = {item.name: self.replaced(getattr(value, item.name)) for item in fields(value) if item.init}
            return replace(value, **changed)
        return value

    def of(self, value: Any, inside: Any = None) -> Any:
        """Return the replacement of a function, module or other global value that a function uses."""
        if self._is_plain:
            return value
        value = getattr(value, "__wrapped__", value)
        if isinstance(value, FunctionType):
            return self._function(self._replacements.called(value, inside))
        if isinstance(value, ModuleType) and value.__name__.startswith(OWN):
            return self._module(value)
        return MATH if value is math and self._operations is WITHOUT_EXCEPTIONS else value

    def _module(self, module: ModuleType) -> Any:
        if module not in self._copies:
            self._copies[module] = space = SimpleNamespace()
            own = {name: value for name, value in vars(module).items() if not name.startswith("__")}
            vars(space).update({name: self.of(value) for name, value in own.items()})
        return self._copies[module]

    def _function(self, function: Any) -> Any:
        """Copy of a function with replaced global names; the function itself if no name differs."""
        # A valve or law of somebody's own module calls the model too; the standard library does not.
        if function.__module__.partition(".")[0] in sys.stdlib_module_names:
            return function
        if function not in self._copies:
            code = function.__code__ if self._operations is None else rewritten(function, self._operations.writer)
            names = function.__globals__
            # A module has many more names than a function asks for.
            read = {name: names[name] for name in _names_of(function.__code__) if name in names}
            self.made_from.reads += [NameRead(names, name, value) for name, value in read.items()]
            scope: dict[str, Any] = {"__builtins__": names["__builtins__"], "__name__": function.__module__}
            copied = FunctionType(code, scope, function.__name__, function.__defaults__, function.__closure__)
            rows = self._replacements.rows.get(function, ())
            self._copies[function] = self._law(copied, rows) if rows else copied
            scope |= {name: self.of(value, function) for name, value in read.items()}
            copied.__kwdefaults__ = self.replaced(function.__kwdefaults__ or {})
            if self._operations is not None:
                scope |= self._operations.names
            elif not rows and not copied.__kwdefaults__ and all(scope[name] is read[name] for name in read):
                self._copies[function] = function
        return self._copies[function]

    def _law(self, function: FunctionType, rows: tuple[str, ...]) -> PlainFunction:
        """Return the law of an effect with the signature of its port, bound to the present rows of the effect."""
        names = function.__code__.co_varnames[: function.__code__.co_argcount]
        own = [name for name in names if name not in rows]

        def called(*arguments: Any, **named: Any) -> Any:
            by_name = dict(zip(own, arguments, strict=False))
            return function(**by_name, **named, **{row: self._rows[row] for row in rows})

        return called


@lru_cache(maxsize=4096)
def _names_of(code: CodeType) -> frozenset[str]:
    """Names read by a code object and by the code objects nested in it."""
    names = frozenset(code.co_names)
    return names.union(*(_names_of(constant) for constant in code.co_consts if isinstance(constant, CodeType)))


def functions_of(program: Program, rows: _EffectRows, operations: "Operations | None" = None) -> PythonFunctions:
    """Return the model functions as replaced in a program, given the parameters and states of its effects.

    Raises ProgramError for an effect that cannot act.
    """
    return PythonFunctions(_replacements_in(program), rows, operations)


@lru_cache(maxsize=64)
def _replacements_in(program: Program) -> Replacements:
    """Replacements of model functions in a program, and the rows that the laws of its effects take."""
    replacements = Replacements()
    link_program(program, replacements)
    return replacements


def in_program(
    function: PlainFunction, program: Program, effects: Sequence[Any], operations: "Operations | None" = None
) -> PlainFunction:
    """Return a model function as replaced in a program, with the parameters of its effects.

    The first argument of the returned function are the effect states by name, an empty mapping if there are none.
    """
    rows = {effect.name: row for effect, row in zip(program.effects, effects, strict=True)}
    own = functions_of(program, rows, operations).of(function)

    def called(states: Mapping[str, Any], *arguments: Any, **named: Any) -> Any:
        rows.update(states)
        return own(*arguments, **named)

    return called


class Operations(NamedTuple):
    """Replacements of Python's operations: the syntax-tree transformer that inserts them, and their names."""

    writer: Callable[[FunctionType], ast.NodeTransformer]
    names: Mapping[str, Any]


@lru_cache(maxsize=1024)
def rewritten(function: FunctionType, writer: Callable[[FunctionType], ast.NodeTransformer]) -> CodeType:
    """Return the code of a function with other operations, on the original source lines; ProgramError if impossible."""
    code = function.__code__
    text = textwrap.dedent(inspect.getsource(function))
    tree = writer(function).visit(parse_module("\n" * (code.co_firstlineno - 1) + text))
    module = compile(ast.fix_missing_locations(tree), code.co_filename, "exec", dont_inherit=True)
    return next(
        constant for constant in module.co_consts if isinstance(constant, CodeType) and constant.co_name == code.co_name
    )


# Functions over samples: with operations of whole columns, each in the same order, so that every number has the bits
# that the function itself gives; a choice works out both of its values. What has no such form, a branch, a loop whose
# end depends on a number or a power, is called sample by sample.


def over_samples(function: PlainFunction, *arguments: Any) -> Any:
    """Evaluate a model function for NamedTuples and numbers, any of which may be arrays (samples,).

    Results that are the same for all samples may remain a single number.
    """
    return _over_samples(partial(_with_operations, function), arguments)


def _with_operations(function: PlainFunction, operations: "Operations | None") -> PlainFunction:
    """Return a model function with other operations, rebuilt if a global name of the function has changed since."""
    if operations is not COLUMNS:
        own: PlainFunction = PythonFunctions(Replacements(), {}, operations).of(function)
        return own
    functions, own = _for_columns(function)
    if functions.made_from.is_current():
        return own
    _for_columns.cache_clear()
    return _for_columns(function)[1]


@lru_cache(maxsize=256)
def _for_columns(function: PlainFunction) -> tuple[PythonFunctions, PlainFunction]:
    functions = PythonFunctions(Replacements(), {}, COLUMNS)
    return functions, functions.of(function)


def over_samples_in(
    program: Program, effects: Sequence[Any], function: PlainFunction, states: Mapping[str, Any], *arguments: Any
) -> Any:
    """Evaluate a model function as replaced in a program, for arrays (samples,) of arguments and effect states."""
    if _copied(program, function) is function:
        # No law of an effect acts in it.
        return over_samples(function, *arguments)
    return _over_samples(partial(in_program, function, program, effects), (states, *arguments))


@lru_cache(maxsize=256)
def _copied(program: Program, function: PlainFunction) -> Any:
    """Return a function as replaced in a program."""
    return functions_of(program, {}).of(function)


def _over_samples(make: Callable[[Operations | None], PlainFunction], arguments: Sequence[Any]) -> Any:
    """Evaluate the function that ``make`` builds for given operations, for arrays (samples,) of arguments."""
    alone, numbers = one_by_one(make(None), arguments)
    if not numbers:
        return alone()
    with contextlib.suppress(ProgramError), np.errstate(all="ignore"):
        # A choice works out what no sample takes, too.
        return make(COLUMNS)(*arguments)
    samples = [column.tolist() for column in np.broadcast_arrays(*numbers)]
    try:
        results = list(map(alone, *samples))
    except (ArithmeticError, ValueError):
        # A run that diverged has numbers of which Python would make none.
        results = list(map(one_by_one(make(WITHOUT_EXCEPTIONS), arguments)[0], *samples))
    return gather(results, np.arange(len(results)))


def _chosen(test: Any, yes: Callable[[], Any], no: Callable[[], Any]) -> Any:
    if isinstance(test, np.ndarray):
        return _where(test, yes(), no())
    return yes() if test else no()


def _where(test: Any, yes: Any, no: Any) -> Any:
    if not isinstance(test, np.ndarray):
        return yes if test else no
    if isinstance(yes, tuple):
        items = [_where(test, *pair) for pair in zip(yes, no, strict=True)]
        return type(yes)(*items) if hasattr(yes, "_fields") else tuple(items)
    return np.where(test, yes, no)


def _extreme(is_beyond: Callable[[Any, Any], Any], first: Any, *others: Any) -> Any:
    """Return the maximum or minimum as Python does: of equal numbers the first, also for 0 and -0."""
    for other in others:
        # A strict comparison, as Python's max has it; np.maximum would take 0.0 over -0.0, and spread NaN.
        first = _where(is_beyond(other, first), other, first)
    return first


_OF_COLUMNS: dict[str, Callable[..., Any]] = {  # of one number, of two, or of any
    "_chosen": _chosen,
    "_all": np.logical_and,
    "_any": np.logical_or,
    "_not": np.logical_not,
    "_quotient": np.divide,
    "_root": np.sqrt,
    "max": partial(_extreme, operator.gt),
    "min": partial(_extreme, operator.lt),
    # Python has no whole number -0.
    "int": lambda number: np.trunc(number) + 0.0 if isinstance(number, np.ndarray) else int(number),
    "float": lambda number: number.astype(np.float64) if isinstance(number, np.ndarray) else float(number),
}
_SAME_IN_COLUMNS = frozenset({"abs", "range", *_OF_COLUMNS})


def _call(name: str, *arguments: ast.expr) -> ast.expr:
    return ast.Call(ast.Name(name, ast.Load()), list(arguments), [])


def _deferred(value: ast.expr) -> ast.Lambda:
    return ast.Lambda(ast.arguments([], [], None, [], [], None, []), value)


class _ForColumns(ast.NodeTransformer):
    """Rewriter of the operations of a function for columns. ProgramError for code that cannot be vectorised."""

    def __init__(self, function: FunctionType) -> None:
        self.known = function.__globals__.keys() - set(function.__code__.co_varnames)

    def visit(self, node: ast.AST) -> Any:
        """Rewrite a node."""
        if isinstance(node, ast.If | ast.While | ast.Starred | ast.AugAssign) or not self.is_elementwise(node):
            raise ProgramError(f"'{ast.unparse(node)}' cannot be evaluated for arrays of runs")
        return super().visit(node)

    def is_elementwise(self, node: ast.AST) -> bool:
        """Return whether an expression also works elementwise on columns."""
        if isinstance(node, ast.BinOp):
            return isinstance(node.op, ast.Add | ast.Sub | ast.Mult | ast.Div)
        if isinstance(node, ast.Compare):
            return len(node.ops) == 1
        if isinstance(node, ast.For) and isinstance(node.iter, ast.Call):
            # The ends of a counted loop are constants of the module or of the text.
            names = {name.id for name in ast.walk(node.iter) if isinstance(name, ast.Name)} - {"range"}
            return names <= self.known
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            return node.func.id not in COMPILED_BUILTINS - _SAME_IN_COLUMNS
        # NumPy's other functions differ from ``math`` in the last bits.
        called = ast.unparse(node.func) if isinstance(node, ast.Call) else ""
        return called == "math.sqrt" or not called.startswith("math.")

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        node.body = [self.visit(line) for line in node.body if not isinstance(line, ast.Assert)]
        return node

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        test, yes, no = (self.visit(part) for part in (node.test, node.body, node.orelse))
        return _call("_chosen", test, _deferred(yes), _deferred(no))

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.AST:
        # Both sides are computed: columns have no short circuit.
        name = "_all" if isinstance(node.op, ast.And) else "_any"
        joined: ast.expr
        joined, *others = (self.visit(part) for part in node.values)
        for other in others:
            joined = _call(name, joined, other)
        return joined

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.AST:
        inner = self.visit(node.operand)
        return _call("_not", inner) if isinstance(node.op, ast.Not) else ast.UnaryOp(node.op, inner)

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        left = self.visit(node.left)
        right = self.visit(node.right)
        # np.divide gives inf over 0 where Python's quotient raises, as compiled code does.
        return _call("_quotient", left, right) if isinstance(node.op, ast.Div) else ast.BinOp(left, node.op, right)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        if ast.unparse(node.func) == "math.sqrt":
            return _call("_root", *map(self.visit, node.args))
        return self.generic_visit(node)


COLUMNS = Operations(_ForColumns, _OF_COLUMNS)
"""Operations on whole columns."""


# Operations that go on where Python would raise, with what compiled code gives there: a run that diverges divides by
# zero or takes the root of a negative number; compiled, it ends as one that failed.


def quotient(dividend: float, divisor: float) -> float:
    """Return a quotient as in IEEE 754: infinite for division by zero, and NaN for zero divided by zero."""
    if divisor != 0.0:
        return dividend / divisor
    if dividend == 0.0 or math.isnan(dividend):
        return math.nan
    return math.copysign(math.inf, dividend) * math.copysign(1.0, divisor)


def whole_part(value: float) -> int:
    """Return a number without its fraction; ``LOWEST_INTEGER`` for NaN and for numbers beyond 64 bits."""
    return int(value) if LOWEST_INTEGER <= value < -LOWEST_INTEGER else LOWEST_INTEGER


def _without_errors(function: Callable[..., float]) -> Callable[..., float]:
    """Return a function of ``math`` that returns infinity on overflow and NaN outside its domain."""

    def called(*arguments: float) -> float:
        try:
            return function(*arguments)
        except OverflowError:
            return math.inf
        except ValueError:
            return -math.inf if function is math.log and arguments[0] == 0.0 else math.nan

    return called


MATH = SimpleNamespace(
    **{
        name: _without_errors(value) if callable(value) else value
        for name, value in vars(math).items()
        if not name.startswith("_")
    }
)
"""Variant of ``math`` whose functions return infinity on overflow or at a pole, and NaN outside their domain."""


class _WithoutExceptions(ast.NodeTransformer):
    def __init__(self, _function: FunctionType) -> None:
        """Accept any function, because every function can be rewritten in this way."""

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        if not isinstance(node.op, ast.Div):
            return node
        return ast.copy_location(_call("_quotient", node.left, node.right), node)


WITHOUT_EXCEPTIONS = Operations(_WithoutExceptions, {"_quotient": quotient, "int": whole_part})
"""Operations that continue where Python would raise an exception."""
