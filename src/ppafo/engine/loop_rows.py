"""Storage of the numbers of a step in the text of the loop: rows of ``x`` for many runs, names for one run.

The writer of the loop (``loop_text.py``) asks these for each phase that is called, each question to all runs, and each
function of ``lanes``.
"""

import ast
from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from types import FunctionType
from typing import NamedTuple, Protocol

from ppafo.engine.entries import indent, parse_expression
from ppafo.engine.generator import ComposedFunction, StepText
from ppafo.engine.lane_rows import HANDED, lanes_of
from ppafo.engine.reduction import NUMBER, TRACE, Slot, group_of_name, with_arguments
from ppafo.engine.rows import leaf_paths, row_expression, row_numbers


class Call(NamedTuple):
    """A call of a phase in a loop over lanes."""

    phase: ComposedFunction
    arguments: Mapping[str, str]
    """The phase's own arguments as text, by their names."""

    def text(self, number: str) -> str:
        """The call for the lane of a number, with the groups that the phase is handed."""
        handed = [number if name == NUMBER else name for name in self.phase.handed]
        own = [self.arguments[name] for name in self.phase.effects.takes]
        return f"{self.phase.name}({', '.join([*handed, *own])})"

    @property
    def returned(self) -> str:
        """Name that the value of the call gets: its only result's, or one of its own for several results."""
        results = self.phase.effects.results
        return results[0] if len(results) == 1 else self.phase.own

    def result(self, name: str) -> str:
        """Expression of a result, once the value of the call has its name."""
        return name if name == self.returned else f"{self.returned}.{name}"

    def stored(self, slot: Slot, number: str) -> str:
        """Element of a history that the phase sets, for the lane of a number."""
        arguments = {name: parse_expression(text) for name, text in self.arguments.items()}
        places = [ast.unparse(with_arguments(index, arguments)) for index in slot.places]
        return f"{slot.history}[{', '.join([*places, number])}]"


class Rows(Protocol):
    """Storage of the numbers of a step, as the writer of the loop uses it."""

    arrays: frozenset[str]
    """Names of arrays in which numbers are, beside those of the loop over steps."""

    def over_lanes(self, calls: Sequence[Call]) -> list[str]:
        """Lines that call phases, one after the other, for each run."""

    def for_lane(self, call: Call) -> list[str]:
        """Lines that call a phase for the present run."""

    def with_cells(self, node: ast.expr) -> ast.expr:
        """An expression with the numbers of the present run in the place of ``lane.GROUP.FIELD``."""

    def any_of(self, condition: ast.expr, is_none: bool) -> tuple[list[str], str]:
        """Lines before, and expression of, the answer whether a condition on ``lane`` holds in any run, or in none."""

    def action(self, method: str, arguments: Sequence[str]) -> list[str]:
        """Lines for a function of ``lanes`` that does something: ``record``, ``set_aside`` or ``put_back``."""

    def value(self, method: str, arguments: Sequence[str]) -> str:
        """Expression for a function of ``lanes`` that gives something: ``traces`` or ``slot``."""

    def heading(self, function: FunctionType) -> list[ast.stmt]:
        """First statements of a function of the loop."""


class RowsOfLanes:
    """Row of ``x`` of each number of a program: state, parameters, intermediates of a step, its parts.

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

        self.arrays: frozenset[str] = frozenset()

    def load(self, group: str) -> str:
        """Line that makes the group from its rows."""
        return f"{group} = {row_expression(self.step.rows[group], group, self.cells, self.step.collector.add)}"

    def over_lanes(self, calls: Sequence[Call]) -> list[str]:
        """A loop over all lanes of the block."""
        lines = [line for call in calls for line in self.for_lane(call)]
        return _for_each_lane(lines or ["pass"])

    def for_lane(self, call: Call) -> list[str]:
        """Lines for one lane: what the phase asks for, the call, and what it returns in its rows."""
        effects, rows = call.phase.effects, self.step.rows
        if not effects.results:
            return []
        lines = [self.load(name) for name in call.phase.handed if name in rows]
        lines.append(f"{call.returned} = {call.text('lane')}")
        for group, fields in effects.groups.items():
            for path in leaf_paths(rows[group], group):
                changes = fields is None or path.split(".")[1].partition("[")[0] in fields
                if changes and path in self.cells:
                    lines.append(f"{self.cells[path]} = {call.result(group)}{path.removeprefix(group)}")
        return lines + [f"{call.stored(slot, 'lane')} = {call.result(name)}" for name, slot in effects.slots.items()]

    def with_cells(self, node: ast.expr) -> ast.expr:
        """An expression with the cells of its numbers."""
        written: ast.expr = _Cells(self.cells).visit(deepcopy(node))
        return written

    def any_of(self, condition: ast.expr, is_none: bool) -> tuple[list[str], str]:
        """A count of lanes: a sum of whole numbers is taken of several at once, a largest float is not."""
        text = ast.unparse(self.with_cells(condition))
        lines = ["counted = 0", "for lane in range(width):", f"    counted += 1 if {text} else 0"]
        return lines, "counted == 0" if is_none else "counted > 0"

    def action(self, method: str, arguments: Sequence[str]) -> list[str]:
        """Lines that copy rows: to a sample of the record, aside for lanes that wait, or back again."""
        if method == "record":
            return [
                "for row in range(record.shape[1]):",
                f"    for lane in range({'1' if self.lanes == 1 else 'record.shape[2]'}):",
                f"        record[{arguments[0]}, row, lane] = x[row, lane]",
            ]
        states = len(self.state_at)
        cells = [(self.cells[path], f"x[{self.aside + index}, lane]") for index, path in enumerate(self.kept)]
        # Behind the state: first what was left of the step, then what it was handed.
        beside = cells[states:]
        if method == "set_aside":
            copied = over_rows(states, f"x[{self.aside} + row, lane] = x[row, lane]")
            return [*copied, *_for_each_lane(f"{aside} = {cell}" for cell, aside in beside)]
        # A lane whose step was done when it was set aside has waited since.
        goes_on = f"x[{self.aside + states}, lane] > 0.0"
        copied = over_rows(states, f"x[row, lane] = x[row, lane] if {goes_on} else x[{self.aside} + row, lane]")
        lines = [f"{cell} = {cell} if {goes_on} else {aside}" for cell, aside in beside[1:]]
        return [*copied, *(_for_each_lane(lines) if lines else [])]

    def value(self, method: str, arguments: Sequence[str]) -> str:
        """Test whether a sample is traced, or its index in the trace: a ring that keeps the last samples."""
        index, trace_every = arguments
        return f"{index} % {trace_every} == 0" if method == "traces" else f"{index} // {trace_every} % trace.shape[0]"

    def heading(self, function: FunctionType) -> list[ast.stmt]:  # noqa: ARG002 - a protocol
        """Nothing: no person reads this text."""
        return []


class RowsOfRun:
    """Groups of a single run: NamedTuples under their own names, of which the outputs of a sample are a row, too."""

    def __init__(self, step: StepText, outputs: str) -> None:
        self.step, self.outputs = step, outputs
        self.arrays: frozenset[str] = frozenset()

    def over_lanes(self, calls: Sequence[Call]) -> list[str]:
        """The bare calls, whose results get the names of their groups."""
        return [line for call in calls for line in self.for_lane(call)] or ["pass"]

    def for_lane(self, call: Call) -> list[str]:
        """Lines for one call: groups that it sets, numbers of histories, and of a trace the row of the sample."""
        effects = call.phase.effects
        if not effects.results:
            return []
        lines = [f"{call.returned} = {call.text('0')}"]
        lines += [f"{group} = {call.result(group)}" for group in effects.groups if group != call.returned]
        traced = [call.result(name) for name, slot in effects.slots.items() if slot.history == TRACE]
        if traced:
            lines += ["samples.before = samples.last", f"samples.last = {self.outputs}(0.0, {', '.join(traced)})"]
        kept = {name: slot for name, slot in effects.slots.items() if slot.history != TRACE}
        return lines + [f"{call.stored(slot, '0')} = {call.result(name)}" for name, slot in kept.items()]

    def with_cells(self, node: ast.expr) -> ast.expr:
        """An expression with the names of its groups."""
        written: ast.expr = _OfRun().visit(deepcopy(node))
        return written

    def any_of(self, condition: ast.expr, is_none: bool) -> tuple[list[str], str]:
        """The condition of the run itself."""
        text = ast.unparse(self.with_cells(condition))
        return [], f"not {text}" if is_none else text

    def action(self, method: str, arguments: Sequence[str]) -> list[str]:  # noqa: ARG002 - a protocol
        """Nothing: a single run records nothing, and waits for no other."""
        return ["pass"]

    def value(self, method: str, arguments: Sequence[str]) -> str:  # noqa: ARG002 - a protocol
        """Constant: every sample is traced, at the first index."""
        return "True" if method == "traces" else "0"

    def heading(self, function: FunctionType) -> list[ast.stmt]:
        """The first line of the function's docstring."""
        return [ast.Expr(ast.Constant((function.__doc__ or "").split("\n")[0]))]


class _Cells(ast.NodeTransformer):
    """Puts the cell of each number in the place of ``lane.GROUP.FIELD``."""

    def __init__(self, cells: Mapping[str, str]) -> None:
        self.cells = cells

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        root: ast.expr = node
        while isinstance(root, ast.Attribute):
            root = root.value
        group = group_of_name(root)
        path = ast.unparse(node).removeprefix(f"{ast.unparse(root)}.")
        path = f"{group}.{path}" if group else path
        return parse_expression(self.cells[path]) if path in self.cells else node


class _OfRun(ast.NodeTransformer):
    """Puts the name of a group in the place of ``lane.GROUP``."""

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        if isinstance(node.value, ast.Name) and node.value.id == "lane":
            return ast.Name(node.attr, ast.Load())
        self.generic_visit(node)
        return node

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return ast.Name(group_of_name(node) or node.id, node.ctx)


def over_rows(count: int, line: str) -> list[str]:
    """A loop with a line for all lanes of the first ``count`` rows."""
    return [f"for row in range({count}):", *indent(_for_each_lane([line]))]


def _for_each_lane(lines: Iterable[str]) -> list[str]:
    """A loop with some lines for all lanes of the block."""
    return ["for lane in range(width):", *indent(lines)]
