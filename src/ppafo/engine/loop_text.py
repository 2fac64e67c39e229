"""Text of the loop over steps in the compiled module, for many runs at once or for a single run.

``for lane in lanes`` becomes a loop over the columns of ``x``, in which each phase call loads the groups that it reads
and stores the groups that it returns. For a single run, it becomes the plain call (``loop_rows.py``). Functions of
``lanes`` are expanded in place.
"""

import ast
from collections.abc import Callable, Mapping, Sequence
from types import FunctionType

from ppafo.engine.composer import Composer
from ppafo.engine.entries import HEADER, entry_text, indent, parse_expression, rewritten
from ppafo.engine.generator import StepText
from ppafo.engine.lane_rows import LOOP, VECTOR
from ppafo.engine.loop_rows import Call, Rows, RowsOfLanes, RowsOfRun, over_rows
from ppafo.engine.plain_python import parse_module
from ppafo.engine.program import Program
from ppafo.engine.reduction import HISTORIES, Reduction
from ppafo.engine.rows import given, taken
from ppafo.engine.source_text import SourceCollector
from ppafo.engine.step import loop
from ppafo.engine.step.lane import Now

NEEDS_PARTS = "needs_parts"
"""Last argument of a loop with both kinds of steps: 1 for steps divided by error control, else 0."""


class LoopText:
    """Generator of a function of the loop over steps, with called functions expanded in place.

    ``steps`` has the step of each program with its storage. With two programs, the loop tests ``NEEDS_PARTS`` wherever
    they differ. The method for a statement returns its translation, and raises ProgramError for an unsupported
    statement.
    """

    def __init__(self, steps: Mapping[Rows, StepText], function: Callable[..., None]) -> None:
        (self.rows, self.step), *others = steps.items()
        self.steps = steps
        self.function = function
        assert isinstance(function, FunctionType), "it is no other callable"
        self.reduction = Reduction(self.step, function)
        local = (*function.__code__.co_varnames, *HISTORIES, "record")
        known = self.step.placeholders
        rows = {"now": Now}
        self.composer = Composer(function, self.step.collector, self.step.add_inside, local, known, rows)
        self.other = LoopText(dict(others), function) if others else None

    def lines(self) -> list[ast.stmt]:
        """Statements of the whole function."""
        return self.block(self.reduction.definition.tree.body)

    def either(self, own: list[ast.stmt], other: list[ast.stmt]) -> list[ast.stmt]:
        """Statements of this program or of the other program, under a condition only if they differ."""
        if [*map(ast.dump, own)] == [*map(ast.dump, other)]:
            return own
        return [ast.If(parse_expression(f"{NEEDS_PARTS} == 1"), other or [ast.Pass()], own)]

    def expression(self, node: ast.expr) -> ast.expr:
        """Translation of an expression of the loop: reduced, with ``lanes`` replaced by arrays."""
        return self.composed(self.reduction.visit(node))

    def composed(self, reduced: ast.expr) -> ast.expr:
        """Translation of a reduced expression."""
        composed: ast.expr = self.composer.visit(rewritten(reduced, self.of_lanes))
        return composed

    def of_lanes(self, node: ast.expr) -> ast.expr | None:
        """Array or expression of the module for an array or function of ``lanes``; None for any other expression."""
        match node:
            case ast.Call(func=ast.Attribute(value=ast.Name(id="lanes"), attr=method)):
                arguments = [ast.unparse(rewritten(argument, self.of_lanes)) for argument in node.args]
                return parse_expression(self.rows.value(method, arguments))
            case ast.Attribute(value=ast.Name(id="lanes"), attr=name):
                return ast.Name("record" if name == "records" else name, ast.Load())
        return None

    def block(self, statements: Sequence[ast.stmt]) -> list[ast.stmt]:
        """Translation of a block of statements."""
        return [written for statement in statements for written in self.statement(statement)]

    def statement(self, node: ast.stmt) -> list[ast.stmt]:  # noqa: PLR0911 - one for each kind
        """Translation of a statement of any kind."""
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
        raise self.reduction.refuse(
            node, f"'{ast.unparse(node).splitlines()[0]}' is not supported in the loop over steps"
        )

    def branch(self, node: ast.If) -> list[ast.stmt]:
        """Translation of a condition on the parts, on all runs, or on numbers common to all runs."""
        question = node.test.operand if isinstance(node.test, ast.UnaryOp) else node.test
        if isinstance(question, ast.Call) and question.args and isinstance(question.args[0], ast.GeneratorExp):
            # ``any(CONDITION for lane in lanes)``, or ``not any(...)``.
            lines, answer = self.rows.any_of(question.args[0].elt, is_none=question is not node.test)
            asked = parse_expression(answer)
            return [*_parsed(lines), ast.If(asked, self.block(node.body), self.block(node.orelse))]
        own = self.decided(node)
        if own is None:
            # A decision of numbers that all runs have alike; nothing where neither side does anything.
            test = self.expression(node.test)
            if isinstance(test, ast.Constant):
                return self.block(node.body if test.value else node.orelse)
            body = self.block(node.body)
            otherwise = self.block(node.orelse)
            return [ast.If(test, body or [ast.Pass()], otherwise)] if body or otherwise else []
        if self.other is None:
            return self.block(own)
        other = self.other.decided(node)
        return self.block(own) if other is own else self.either(self.block(own), self.other.branch(node))

    def decided(self, node: ast.If) -> list[ast.stmt] | None:
        """Branch selected by a condition on the parts alone; None for any other condition."""
        test = self.reduction.condition(node.test)
        if not isinstance(test, ast.Constant):
            return None
        return node.body if test.value else node.orelse

    def phases(self, node: ast.For) -> list[ast.stmt]:
        """Translation of a loop over runs that calls phases."""
        own = _parsed(self.rows.over_lanes([self.phase(call) for call in node.body]))
        return own if self.other is None else self.either(own, self.other.phases(node))

    def phase(self, node: ast.stmt) -> Call:
        """Call of a phase in a loop over runs."""
        if not isinstance(node, ast.Expr) or not isinstance(node.value, ast.Call):
            raise self.reduction.refuse(
                node, f"'{ast.unparse(node).splitlines()[0]}': a loop over runs may only call phases"
            )
        called: FunctionType = self.reduction.outside_value(node.value.func)
        names = called.__code__.co_varnames[: called.__code__.co_argcount]
        arguments = list(zip(names, node.value.args, strict=True))[2:]
        own = {name: ast.unparse(self.expression(argument)) for name, argument in arguments}
        return Call(self.step.phase(called), own)

    def called(self, node: ast.Call) -> list[ast.stmt]:
        """Statements of a called function of the loop, or of a function of ``lanes``."""
        if isinstance(node.func, ast.Attribute) and ast.unparse(node.func.value) == "lanes":
            arguments = [ast.unparse(self.expression(argument)) for argument in node.args]
            return _parsed(self.rows.action(node.func.attr, arguments))
        function: FunctionType = self.reduction.outside_value(node.func)
        inner = LoopText(self.steps, function)
        names = function.__code__.co_varnames[: function.__code__.co_argcount]
        # Behind ``parts`` and ``lanes``; an argument of the parameter's own name is there already.
        begin: list[ast.stmt] = [
            ast.Assign([ast.Name(name, ast.Store())], value)
            for name, value in zip(names[2:], map(self.expression, node.args[2:]), strict=True)
            if not isinstance(value, ast.Name) or value.id != name
        ]
        if isinstance(self.rows, RowsOfRun):
            # The text for one run has readers.
            begin.append(ast.Expr(ast.Constant((function.__doc__ or "").split("\n")[0])))
        return [*begin, *inner.lines()]


def _parsed(lines: Sequence[str]) -> list[ast.stmt]:
    """Parse some lines into statements."""
    return parse_module("\n".join(lines)).body


def _unparsed(body: list[ast.stmt]) -> list[str]:
    """Return the lines of some statements."""
    return ast.unparse(ast.fix_missing_locations(ast.Module(body, []))).split("\n")


LOOP_OF_RUN = {
    name: kind for name, kind in LOOP.items() if name not in ("states", "parameters", "record", "trace", "trace_every")
}
"""Arguments of the loop of a run behind states, parameters and samples, with their types."""


def run_loop(step: StepText, outputs: str, in_parts: StepText | None) -> str:
    """Text of the function ``advance`` that advances one run of a program, and of the row ``outputs`` of a sample.

    ``states`` and ``parameters`` have the groups of a run; ``samples`` has the sample ``last`` and the previous sample
    ``before``. The text is meant for translation only, because it assigns to fields. With ``in_parts``, the same
    program with adaptive steps, the function contains both kinds of steps, selected by ``needs_parts``.
    """
    steps: dict[Rows, StepText] = {RowsOfRun(step, outputs): step}
    if in_parts is not None:
        steps[RowsOfRun(in_parts, outputs)] = in_parts
    whole = _unparsed(LoopText(steps, loop.advance).lines())
    groups = {"parameters": step.parameters, "states": step.states}
    begin = [f"{name} = {taken(array, name, row)}" for array, rows in groups.items() for name, row in rows.items()]
    arguments = ["states", "parameters", "samples", *LOOP_OF_RUN, *([NEEDS_PARTS] if in_parts else [])]
    sample = f"{outputs} = namedtuple({outputs!r}, {['time', *step.parts.traced]!r})"
    body = [repr("What the run is made of, and where it stands."), *begin, *whole]
    body += [repr("Where it stands now."), *given("states", step.states)]
    return "\n".join([sample, f"def advance({', '.join(arguments)}):", *indent(body)])


def write_lanes(program: Program, collector: SourceCollector, lanes: int = 0) -> str:
    """Source text of a program for ``lanes`` runs, 0 for as many as fit; ``collector`` then has all its inputs."""
    step = StepText(program, collector)
    rows = RowsOfLanes(step, lanes)
    states = len(rows.state_at)
    parameters = len(rows.parameter_at)
    lines = [
        f"x = empty_rows({rows.count}, {rows.lanes})",
        # A literal width lets the compiler unroll the loops of a small block.
        f"width = {rows.lanes if rows.lanes <= VECTOR else 'states.shape[1]'}",
        *over_rows(states, "x[row, lane] = states[row, lane]"),
        *over_rows(parameters, f"x[{states} + row, lane] = parameters[row, lane]"),
        *_unparsed(LoopText({rows: step}, loop.advance).lines()),
        *over_rows(states, "states[row, lane] = x[row, lane]"),
    ]
    return f"{HEADER}\n\n{collector.text()}\n\n\n{entry_text('advance', LOOP, lines)}"
