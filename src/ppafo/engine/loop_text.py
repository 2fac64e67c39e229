"""The loop over steps in the text of a module: for many runs at once, or for a single one.

``for lane in lanes`` becomes a loop over the rows of ``x``, in which each call of a phase loads the groups that it asks
for and stores those that it returns; for a single run it is the bare call. Functions of ``lanes`` stand where they act.
"""

import ast
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from types import FunctionType
from typing import NamedTuple, Protocol

from ppafo.engine.entries import HEADER, indent, parse_expression
from ppafo.engine.generator import Composed, StepText
from ppafo.engine.lane_rows import ARGUMENTS, COMPILED, HANDED, VECTOR, lanes_of
from ppafo.engine.plain_python import parse_module
from ppafo.engine.program import Program
from ppafo.engine.reduction import HISTORIES, NUMBER, Reduction, Slot, is_known_part, with_arguments
from ppafo.engine.rows import leaf_paths, row_expression, row_numbers
from ppafo.engine.source_text import Names, SourceCollector
from ppafo.engine.step import loop
from ppafo.engine.step.lane import Now
from ppafo.errors import ProgramError

NEEDS_PARTS = "needs_parts"
"""The last argument of a loop that has both steps: 1 where the error decides about the parts of a step, else 0."""


class Call(NamedTuple):
    """A call of a phase: the phase, and its own arguments as text, by their names."""

    phase: Composed
    given: dict[str, str]

    def text(self, number: str) -> str:
        """The call for the lane of a number, with what the phase is handed."""
        handed = [number if name == NUMBER else name for name in self.phase.handed]
        own = [self.given[name] for name in self.phase.effects.takes]
        return f"{self.phase.name}({', '.join([*handed, *own])})"

    def places(self, slot: Slot) -> list[str]:
        """Where in its history the phase sets a number, but for the lane."""
        arguments = {name: parse_expression(text) for name, text in self.given.items()}
        return [ast.unparse(with_arguments(index, arguments)) for index in slot.places]


class Rows(Protocol):
    """Where the numbers of a step are: in rows of ``x`` for many runs, or under the names of a single run."""

    def over_lanes(self, calls: Sequence[Call]) -> list[str]:
        """Calls of phases for all runs."""

    def any_of(self, condition: ast.expr, is_none: bool) -> tuple[list[str], str]:
        """Lines before a question whether a condition holds in any run, or in none, and the question."""

    def acted(self, method: str, given: Sequence[str]) -> list[str]:
        """Lines for a function of ``lanes``."""

    def asked(self, method: str, given: Sequence[str]) -> str:
        """Expression for the value of a function of ``lanes``."""

    def noted(self, function: FunctionType) -> list[ast.stmt]:
        """What stands before the lines of a function of the loop."""


class LoopText:
    """Writes a function of the loop over steps, with those that it calls in their places.

    With the steps of two programs, the loop asks ``NEEDS_PARTS`` wherever these go on in another way.
    """

    def __init__(self, steps: Mapping[Rows, StepText], function: Callable[..., None]) -> None:
        (self.rows, self.step), *others = steps.items()
        self.steps, self.function = steps, function
        assert isinstance(function, FunctionType), "it is no other callable"
        self.reduction = Reduction(self.step, function, {})
        local = frozenset({*function.__code__.co_varnames, *HISTORIES, "record"})
        self.composer = self.step.composer(function, Names(local, self.step.kept, {"now": Now}))
        self.other = LoopText(dict(others), function) if others else None

    def lines(self) -> list[ast.stmt]:
        """Statements of the phase."""
        return self.block(self.reduction.definition.tree.body)

    def either(self, own: list[ast.stmt], other: list[ast.stmt]) -> list[ast.stmt]:
        """What this program does, or what the one does that divides its steps."""
        if [*map(ast.dump, own)] == [*map(ast.dump, other)]:
            return own
        (question,) = _parsed([f"{NEEDS_PARTS} == 1"])
        assert isinstance(question, ast.Expr)
        return [ast.If(question.value, other or [ast.Pass()], own)]

    def expression(self, node: ast.expr) -> ast.expr:
        """An expression of the loop, whose ``lanes`` are arrays of the module."""
        written: ast.expr = self.composer.visit(_OfLanes(self.rows).visit(self.reduction.visit(node)))
        return written

    def block(self, statements: Sequence[ast.stmt]) -> list[ast.stmt]:
        """Some statements."""
        return [line for statement in statements for line in self.statement(statement)]

    def statement(self, node: ast.stmt) -> list[ast.stmt]:  # noqa: PLR0911 - one for each kind
        """What a statement becomes."""
        match node:
            case ast.Expr(value=ast.Call() as call):
                return self.called(call)
            case ast.Expr() | ast.Assert():
                return []
            case ast.For(iter=ast.Name(id="lanes")):
                return self.phases(node)
            case ast.For(target=ast.Name()):
                return [
                    ast.For(node.target, self.expression(node.iter), self.block(node.body), self.block(node.orelse))
                ]
            case ast.While():
                return [ast.While(self.expression(node.test), self.block(node.body), [])]
            case ast.If():
                return self.branch(node)
            case ast.Assign(targets=[ast.Name() as target]):
                return [ast.Assign([target], self.expression(node.value))]
            case ast.AugAssign(target=ast.Name()):
                return [ast.AugAssign(node.target, node.op, self.expression(node.value))]
            case ast.Break():
                return [node]
        raise self.reduction.refuse(node, f"'{ast.unparse(node).splitlines()[0]}' is no statement of the loop")

    def branch(self, node: ast.If) -> list[ast.stmt]:
        """A decision: of the parts, of a question to all runs, or of numbers that all have."""
        test, is_none = node.test, False
        if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
            test, is_none = test.operand, True
        if isinstance(test, ast.Call) and isinstance(test.args[0] if test.args else None, ast.GeneratorExp):
            (question,) = test.args
            assert isinstance(question, ast.GeneratorExp)
            before, asked = self.rows.any_of(question.elt, is_none)
            (found,) = _parsed([asked])
            assert isinstance(found, ast.Expr)
            return [*_parsed(before), ast.If(found.value, self.block(node.body), self.block(node.orelse))]
        own = self.decided(node)
        if own is None:
            test = self.expression(node.test)
            if isinstance(test, ast.Constant):
                return self.block(node.body if test.value else node.orelse)
            body, otherwise = self.block(node.body), self.block(node.orelse)
            return [ast.If(test, body or [ast.Pass()], otherwise)] if body or otherwise else []
        other = None if self.other is None else self.other.decided(node)
        if self.other is None or other is own:
            return self.block(own)
        return self.either(self.block(own), self.other.branch(node))

    def decided(self, node: ast.If) -> list[ast.stmt] | None:
        """The statements of a decision of the parts; None for any other."""
        test = self.reduction.asked(node.test)
        if not isinstance(test, ast.Constant):
            return None
        return node.body if test.value else node.orelse

    def phases(self, node: ast.For) -> list[ast.stmt]:
        """A loop over lanes."""
        own = _parsed(self.rows.over_lanes([self.phase(phase) for phase in node.body]))
        return own if self.other is None else self.either(own, self.other.phases(node))

    def phase(self, node: ast.stmt) -> Call:
        """The call of a phase in a loop over lanes."""
        if not isinstance(node, ast.Expr) or not isinstance(node.value, ast.Call):
            raise self.reduction.refuse(node, "in a loop over lanes phases are called")
        called: FunctionType = self.reduction.outside(node.value.func)
        names = called.__code__.co_varnames[: called.__code__.co_argcount]
        arguments = list(zip(names, node.value.args, strict=True))[2:]
        known = {name: self.reduction.value_of(value) for name, value in arguments}
        known = {name: value for name, value in known.items() if is_known_part(value)}
        own = {name: ast.unparse(self.expression(value)) for name, value in arguments if name not in known}
        return Call(self.step.phase(called, known), own)

    def called(self, node: ast.Call) -> list[ast.stmt]:
        """The lines of a function of the loop, or what one of ``lanes`` does."""
        function = node.func
        if isinstance(function, ast.Attribute) and _is_lanes(function.value):
            return _parsed(
                self.rows.acted(function.attr, [ast.unparse(self.expression(argument)) for argument in node.args])
            )
        called: FunctionType = self.reduction.outside(function)
        inner = LoopText(self.steps, called)
        names = called.__code__.co_varnames[: called.__code__.co_argcount]
        arguments = zip(names[2:], map(self.expression, node.args[2:]), strict=True)
        begin: list[ast.stmt] = [
            ast.Assign([ast.Name(name, ast.Store())], value)
            for name, value in arguments
            if not isinstance(value, ast.Name) or value.id != name
        ]
        return [*begin, *self.rows.noted(called), *inner.lines()]


def _is_lanes(node: ast.expr) -> bool:
    return isinstance(node, ast.Name) and node.id == "lanes"


class _OfLanes(ast.NodeTransformer):
    """Puts arrays of the module in the place of those of ``lanes``, and what its functions give."""

    def __init__(self, rows: Rows) -> None:
        self.rows = rows

    def visit_Call(self, node: ast.Call) -> ast.expr:
        if isinstance(node.func, ast.Attribute) and _is_lanes(node.func.value):
            arguments = [ast.unparse(self.visit(argument)) for argument in node.args]
            (asked,) = _parsed([self.rows.asked(node.func.attr, arguments)])
            assert isinstance(asked, ast.Expr)
            return asked.value
        self.generic_visit(node)
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        if _is_lanes(node.value):
            return ast.Name("record" if node.attr == "records" else node.attr, ast.Load())
        self.generic_visit(node)
        return node


def _parsed(lines: Sequence[str]) -> list[ast.stmt]:
    return parse_module("\n".join(lines)).body


class _Cells(ast.NodeTransformer):
    """Puts what a lane has its numbers in in the place of these."""

    def __init__(self, cells: dict[str, str]) -> None:
        self.cells = cells

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        path = ast.unparse(node).removeprefix("lane.")
        return parse_expression(self.cells[path]) if path in self.cells else node


class _OfRun(ast.NodeTransformer):
    """Puts groups in the place of those of a lane."""

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        if isinstance(node.value, ast.Name) and node.value.id == "lane":
            return ast.Name(node.attr, ast.Load())
        self.generic_visit(node)
        return node


class RowsOfLanes:
    """Where each number of a program lies in the rows of ``x``: state, parameters, what a step hands on, its parts.

    One array for all of them lets the compiler see that no two rows overlap. From row ``aside`` on lies what lanes that
    wait for others keep, where few do: the state, what was left of the step, and what it was handed.
    """

    def __init__(self, step: StepText, lanes: int = 0) -> None:
        self.step = step
        self.lanes = lanes or lanes_of(step.parts)
        self.state_at = row_numbers(step.states)
        self.parameter_at = row_numbers(step.parameters, len(self.state_at))
        self.step_at = row_numbers(step.of_step, len(self.state_at) + len(self.parameter_at))
        numbered = self.state_at | self.parameter_at | self.step_at
        self.cells = {path: f"x[{row}, lane]" for path, row in numbered.items()}
        self.aside = len(numbered)
        # What was left of the step comes first: it says which lanes wait.
        handed = [path for path in self.step_at if path.startswith(HANDED)]
        self.kept = [*self.state_at, "remaining", *handed] if step.parts.parts_are_rare else []
        self.count = self.aside + len(self.kept)

    def load(self, group: str) -> str:
        """Line that makes the group from its rows."""
        return f"{group} = {row_expression(self.step.rows[group], group, self.cells, self.step.collector.add)}"

    def over_lanes(self, calls: Sequence[Call]) -> list[str]:
        """A loop over all lanes of the block."""
        lines = [line for call in calls for line in self.called(call)]
        return ["for lane in range(width):", *indent(lines or ["pass"])]

    def called(self, call: Call) -> list[str]:
        """Lines for one lane: what the phase asks for, the call, and what it returns in its rows."""
        effects, rows = call.phase.effects, self.step.rows
        for name in call.phase.handed:
            if name not in rows and name not in (NUMBER, *HISTORIES):
                raise ProgramError(f"{call.phase.name} asks for '{name}', which no phase before it has kept")
        if not effects.results:
            return []
        is_one = len(effects.results) == 1
        whole = effects.results[0] if is_one else call.phase.own
        lines = [self.load(name) for name in call.phase.handed if name in rows]
        lines.append(f"{whole} = {call.text('lane')}")
        for group, fields in effects.groups.items():
            for path in leaf_paths(rows[group], group):
                changes = fields is None or path.split(".")[1].partition("[")[0] in fields
                if changes and path in self.cells:
                    lines.append(f"{self.cells[path]} = {path if is_one else f'{whole}.{path}'}")
        for name, slot in effects.slots.items():
            cell = f"{slot.history}[{', '.join(call.places(slot))}, lane]"
            lines.append(f"{cell} = {name if is_one else f'{whole}.{name}'}")
        return lines

    def any_of(self, condition: ast.expr, is_none: bool) -> tuple[list[str], str]:
        """Lines that count lanes: a sum of whole numbers is taken of several at once, a largest float is not."""
        text = ast.unparse(_Cells(self.cells).visit(deepcopy(condition)))
        lines = ["counted = 0", "for lane in range(width):", f"    counted += 1 if {text} else 0"]
        return lines, "counted == 0" if is_none else "counted > 0"

    def acted(self, method: str, given: Sequence[str]) -> list[str]:
        """Lines for a function of ``lanes``."""
        count = len(self.state_at)
        remaining = f"x[{self.aside + count}, lane]"
        if method == "record":
            lanes = "1" if self.lanes == 1 else "record.shape[2]"
            return [
                "for row in range(record.shape[1]):",
                f"    for lane in range({lanes}):",
                f"        record[{given[0]}, row, lane] = x[row, lane]",
            ]
        further = [(self.cells[path], f"x[{self.aside + index}, lane]") for index, path in enumerate(self.kept)][count:]
        if method == "set_aside":
            lines = [f"{own} = {cell}" for cell, own in further]
            rows = over_rows(count, f"x[{self.aside} + row, lane] = x[row, lane]")
            return [*rows, "for lane in range(width):", *indent(lines)]
        assert method == "put_back", method
        lines = [f"{cell} = {cell} if {remaining} > 0.0 else {own}" for cell, own in further[1:]]
        again = f"x[row, lane] = x[row, lane] if {remaining} > 0.0 else x[{self.aside} + row, lane]"
        return [*over_rows(count, again), *(["for lane in range(width):", *indent(lines)] if lines else [])]

    def asked(self, method: str, given: Sequence[str]) -> str:
        """Whether a sample is traced, and where its trace is kept: one with less room than samples keeps the last."""
        index, trace_every = given
        return f"{index} % {trace_every} == 0" if method == "traces" else f"{index} // {trace_every} % trace.shape[0]"

    def noted(self, function: FunctionType) -> list[ast.stmt]:  # noqa: ARG002 - a protocol
        """Nobody reads this."""
        return []


class RowsOfRun:
    """Groups of a single run: NamedTuples under their own names, of which the outputs of a sample are a row, too."""

    def __init__(self, step: StepText, outputs: str) -> None:
        self.step, self.outputs = step, outputs

    def over_lanes(self, calls: Sequence[Call]) -> list[str]:
        """The bare calls."""
        lines: list[str] = []
        for call in calls:
            results, slots = call.phase.effects.results, call.phase.effects.slots
            if not results:
                continue
            text = call.text("0")
            if len(results) == 1:
                lines.append(f"{results[0]} = {text}")
                continue
            whole = call.phase.own
            lines.append(f"{whole} = {text}")
            traced = [f"{whole}.{name}" for name, slot in slots.items() if slot.history == "trace"]
            if traced:
                lines += ["samples.before = samples.last", f"samples.last = {self.outputs}(0.0, {', '.join(traced)})"]
            else:
                lines += [f"{name} = {whole}.{name}" for name in results]
            for name, slot in slots.items():
                if slot.history != "trace":
                    lines.append(f"{slot.history}[{', '.join(call.places(slot))}, 0] = {name}")
        return lines or ["pass"]

    def any_of(self, condition: ast.expr, is_none: bool) -> tuple[list[str], str]:
        """The question to the run."""
        text = ast.unparse(_OfRun().visit(deepcopy(condition)))
        return [], f"not {text}" if is_none else text

    def acted(self, method: str, given: Sequence[str]) -> list[str]:  # noqa: ARG002 - a protocol
        """A single run records nothing, and waits for no other."""
        return ["pass"]

    def asked(self, method: str, given: Sequence[str]) -> str:  # noqa: ARG002 - a protocol
        """Each sample is an output."""
        return "True" if method == "traces" else "0"

    def noted(self, function: FunctionType) -> list[ast.stmt]:
        """The docstring of a function of the loop."""
        return [ast.Expr(ast.Constant((function.__doc__ or "").split("\n")[0]))]


def over_rows(count: int, line: str) -> list[str]:
    """A line for all lanes of the first rows."""
    return [f"for row in range({count}):", "    for lane in range(width):", f"        {line}"]


def _unparsed(body: list[ast.stmt]) -> list[str]:
    return ast.unparse(ast.fix_missing_locations(ast.Module(body, []))).split("\n")


def lane_loop(step: StepText, head: str, name: str, arguments: str, lanes: int = 0) -> str:
    """The function ``name`` that takes a block of some lanes, 0 for as many as fit, some steps further."""
    rows = RowsOfLanes(step, lanes)
    states, parameters = len(rows.state_at), len(rows.parameter_at)
    lines = [
        f"x = empty_rows({rows.count}, {rows.lanes})",
        # A literal width lets the compiler unroll the loops of a small block.
        f"width = {rows.lanes if rows.lanes <= VECTOR else 'states.shape[1]'}",
        *over_rows(states, "x[row, lane] = states[row, lane]"),
        *over_rows(parameters, f"x[{states} + row, lane] = parameters[row, lane]"),
        *_unparsed(LoopText({rows: step}, loop.advance).lines()),
        *over_rows(states, "states[row, lane] = x[row, lane]"),
    ]
    return "\n".join([head, f"def {name}({arguments}):", *indent(lines)])


LOOP_ARRAYS = {"signal_history": 3, "command_history": 2}
"""Arrays of a loop behind its states, parameters and samples, with how many extents they have; the last one is 1."""
LOOP_NUMBERS = {
    **dict.fromkeys(("first_step", "step_count", "steps_in_all", "steps_per_sample"), "int64"),
    "interval": "float64",
    **dict.fromkeys(("last_record", "next_record", "signal_delay", "command_delay"), "int64"),
}


def run_loop(step: StepText, outputs: str, in_parts: StepText | None) -> str:
    """The function ``advance`` that takes one run of a program through its steps, and the row ``outputs`` of a sample.

    Its ``states`` and ``parameters`` have the groups of a run, ``samples`` has the ``last`` sample and that ``before``.
    It is for translation alone, as it writes into these. With ``in_parts``, the same program with steps that their
    error divides, it has both, and ``needs_parts`` chooses.
    """
    steps: dict[Rows, StepText] = {RowsOfRun(step, outputs): step}
    if in_parts is not None:
        steps[RowsOfRun(in_parts, outputs)] = in_parts
    whole = _unparsed(LoopText(steps, loop.advance).lines())
    # A group without numbers is not in the row of all.
    taken = [
        f"{name} = {f'{group}.{name}' if leaf_paths(row, name) else '()'}"
        for group, groups in (("parameters", step.parameters), ("states", step.states))
        for name, row in groups.items()
    ]
    left = [f"states.{name} = {name}" for name, row in step.states.items() if leaf_paths(row, name)]
    arguments = ["states", "parameters", "samples", *LOOP_ARRAYS, *LOOP_NUMBERS, *([NEEDS_PARTS] if in_parts else [])]
    sample = f"{outputs} = namedtuple({outputs!r}, {['time', *step.parts.traced]!r})"
    body = [repr("What the run is made of, and where it stands."), *taken, *whole]
    return "\n".join(
        [sample, f"def advance({', '.join(arguments)}):", *indent([*body, repr("Where it stands now."), *left])]
    )


def write_lanes(program: Program, collector: SourceCollector, lanes: int = 0) -> str:
    """Source text of a program of some lanes, 0 for as many as fit; ``collector`` then has all that it is made from."""
    advance = lane_loop(StepText(program, collector), COMPILED, "advance", ARGUMENTS, lanes)
    return f"{HEADER}\n\n{collector.text()}\n\n\n{advance}\n"
