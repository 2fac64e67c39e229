"""The step run by Python itself: the same functions, the same bits, and a debugger stops in them.

Where a program has something in the place of functions of the model, its actuator's and the laws of its effects, these
stand in copies of the functions that call them: the same code with other names around it, so that breakpoints in their
files hold. Compiled code goes on where Python raises, with what a division by zero gives: there the steps are done
again with operations that go on, too.
"""

import ast
import inspect
import math
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from functools import lru_cache
from types import CodeType, FunctionType, ModuleType, SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.going_on import MATH, quotient, whole_part
from ppafo.engine.linking import link_program
from ppafo.engine.plain_python import parse_module
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, numbers, rebuilt
from ppafo.engine.step import loop
from ppafo.engine.step.lane import Lane
from ppafo.model.binding import is_made_of
from ppafo.model.declaration import PlainFunction

Floats = NDArray[np.float64]
OWN = "ppafo."
"""Begin of the names of modules whose functions may call what has something in its place."""


class PythonProgram:
    """What a compiled program is to a block of lanes."""

    def __init__(self, program: Program) -> None:
        self._program = program

    def advance(
        self,
        states: Floats,
        parameters: Floats,
        signal_history: Floats,
        command_history: Floats,
        record: Floats,
        trace: Floats,
        *clock: Any,
    ) -> None:
        """Take all runs some steps further."""
        arrays = (signal_history, command_history, record, trace)
        # What was written before Python raised is as it was: the steps are done again from where they began.
        before = [array.copy() for array in arrays[:2]]
        try:
            self._advanced(states, parameters, arrays, clock, goes_on=False)
        except (ArithmeticError, ValueError):
            for array, kept in zip(arrays, before, strict=False):
                array[:] = kept
            self._advanced(states, parameters, arrays, clock, goes_on=True)

    def _advanced(
        self,
        states: Floats,
        parameters: Floats,
        arrays: tuple[Floats, ...],
        clock: tuple[Any, ...],
        goes_on: bool,
    ) -> None:
        """Run the loop over steps on lanes made of the rows, and write their states back.

        With ``goes_on``, operations that Python refuses give what compiled code gets.
        """
        program = self._program
        lanes = PythonLanes(program, states, parameters, *arrays)
        links = SimpleNamespace(links={}, effects={})
        link_program(program, links)
        linked = Linked(links.links, links.effects, lanes, goes_on)
        parts: Any = linked.parts(program)
        linked.of(loop.advance)(parts, lanes, *clock)
        for number, lane in enumerate(lanes.lanes):
            states[:, number] = lanes.row_of(lane)


class PythonLanes:
    """The runs of a block; while one is gone through, laws of effects find its rows in ``now``."""

    def __init__(
        self,
        program: Program,
        states: Floats,
        parameters: Floats,
        signal_history: Floats,
        command_history: Floats,
        record: Floats,
        trace: Floats,
    ) -> None:
        self.groups, self.records, self.trace = program.state_rows(), record, trace
        self.signal_history, self.command_history = signal_history, command_history
        # Lanes that only fill a vector repeat the last run.
        width = record.shape[2] if record.size else states.shape[1]
        self.lanes = [Lane() for _ in range(width)]
        self.now = self.lanes[0]
        for number, lane in enumerate(self.lanes):
            for groups, table in ((self.groups, states), (program.parameter_rows(), parameters)):
                start = 0
                for name, row in groups.items():
                    count = len(leaf_paths(row, name))
                    lane[name] = rebuilt(row, table[start : start + count, number].tolist()) if count else ()
                    start += count
            lane.trace, lane.command_history = trace[:, :, number], command_history[:, number]
            lane.signal_history = signal_history[:, :, number]

    def __iter__(self) -> Iterator[Lane]:
        """Each run."""
        for lane in self.lanes:
            self.now = lane
            yield lane

    def row_of(self, lane: Lane) -> list[float]:
        """The state of a lane as a row has it."""
        return [value for name in self.groups for value in numbers(lane[name])]

    def record(self, index: int) -> None:
        """Keep the state of all runs as a sample."""
        for number, lane in enumerate(self.lanes):
            self.records[index, :, number] = self.row_of(lane)

    def set_aside(self) -> None:
        """Keep what lanes that wait get again: their state, and what the step was handed."""
        for lane in self.lanes:
            names = (*self.groups, "remaining", "held", "carried")
            lane["kept"] = {name: lane[name] for name in names if hasattr(lane, name)}

    def put_back(self) -> None:
        """Give it to those that had nothing left of their step."""
        for lane in self.lanes:
            if not lane["kept"]["remaining"] > 0.0:
                vars(lane).update(lane["kept"] | {"remaining": lane.remaining})

    def traces(self, index: int, trace_every: int) -> bool:
        """Whether a sample is traced."""
        return index % trace_every == 0

    def slot(self, index: int, trace_every: int) -> int:
        """Where its trace is kept: one with less room than samples keeps the last."""
        return index // trace_every % len(self.trace)


class Linked:
    """Functions in which some names stand for what a program has in their place; the functions themselves without any.

    With ``goes_on``, a division by zero and the root of a negative number give what compiled code gets.
    """

    def __init__(
        self, links: Mapping[Any, Any], effects: Mapping[Any, tuple[str, ...]], lanes: PythonLanes, goes_on: bool
    ) -> None:
        self._links, self._effects, self._lanes, self._goes_on = links, effects, lanes, goes_on
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
        if not function.__module__.startswith(OWN) and not self._goes_on and function not in self._effects:
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
        """The law of an effect, called as its port is; its own rows are those of the lane that is gone through."""
        names = function.__code__.co_varnames[: function.__code__.co_argcount]
        own = [name for name in names if name not in rows]

        def called(*arguments: Any) -> Any:
            return function(**dict(zip(own, arguments, strict=True)), **{row: self._lanes.now[row] for row in rows})

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
