"""Storage of the numbers of a step in the generated loop: rows of ``x`` for many runs, local names for one run.

The generator of the loop (``loop_text.py``) asks either storage for the text of each phase call, each condition over
all runs, and each function of ``lanes``.
"""

import ast
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple, TypeAlias

from ppafo.engine.entries import indent, parse_expression, rewritten
from ppafo.engine.generator import ComposedFunction, StepText
from ppafo.engine.lane_rows import HANDED, lanes_of
from ppafo.engine.reduction import NUMBER, TRACE, Slot, with_arguments
from ppafo.engine.rows import leaf_paths, row_expression, row_numbers


class Call(NamedTuple):
    """Call of a phase in a loop over runs."""

    phase: ComposedFunction
    arguments: Mapping[str, str]
    """The phase's own arguments as text, by parameter name."""

    def text(self, number: str) -> str:
        """Text of the call for one run, with the groups passed to the phase."""
        groups = [number if name == NUMBER else name for name in self.phase.handed]
        own = [self.arguments[name] for name in self.phase.effects.takes]
        return f"{self.phase.name}({', '.join([*groups, *own])})"

    @property
    def returned(self) -> str:
        """Name of the returned value: the name of its only result, or a separate name for several results."""
        results = self.phase.effects.results
        return results[0] if len(results) == 1 else self.phase.own

    def result(self, name: str) -> str:
        """Expression of one result, after the returned value has been assigned."""
        return name if name == self.returned else f"{self.returned}.{name}"

    def stored(self, slot: Slot, number: str) -> str:
        """Expression of the history element that the phase sets, for one run."""
        arguments = {name: parse_expression(text) for name, text in self.arguments.items()}
        indices = [ast.unparse(with_arguments(index, arguments)) for index in slot.places]
        return f"{slot.history}[{', '.join([*indices, number])}]"


class RowsOfLanes:
    """Row of ``x`` for each number of a program: state, parameters, intermediate values of a step and of its parts.

    With a single array for all numbers, the compiler knows that rows do not overlap. If waiting is rare, the rows from
    ``aside`` on contain the saved numbers of waiting runs: state, remainder of the step, values of the previous step.
    """

    def __init__(self, step: StepText, lanes: int = 0) -> None:
        self.step = step
        self.lanes = lanes or lanes_of(step.parts)
        self.state_at = row_numbers(step.states)
        self.parameter_at = row_numbers(step.parameters, len(self.state_at))
        self.step_at = row_numbers(step.of_step, len(self.state_at) + len(self.parameter_at))
        row_at = self.state_at | self.parameter_at | self.step_at
        self.cells = {path: f"x[{row}, lane]" for path, row in row_at.items()}
        self.aside = len(row_at)
        # Paths of the saved numbers; behind the state comes the remainder, which is 0 for a run that does not wait.
        handed = [path for path in self.step_at if path.startswith(HANDED)]
        self.saved = [*self.state_at, "remaining", *handed] if step.parts.parts_are_rare else []
        self.count = self.aside + len(self.saved)

    def over_lanes(self, calls: Sequence[Call]) -> list[str]:
        """Lines of a loop over all runs of the block."""
        lines = [line for call in calls for line in self.for_lane(call)]
        return _for_each_lane(lines or ["pass"])

    def for_lane(self, call: Call) -> list[str]:
        """Lines for one run: load the groups, call the phase, and store the results."""
        effects = call.phase.effects
        rows = self.step.rows
        if not effects.results:
            return []
        loaded = {group: rows[group] for group in call.phase.handed if group in rows}
        lines = [
            f"{group} = {row_expression(row, group, self.cells, self.step.collector.add)}"
            for group, row in loaded.items()
        ]
        lines.append(f"{call.returned} = {call.text('lane')}")
        for group, fields in effects.groups.items():
            for path in leaf_paths(rows[group], group):
                is_changed = fields is None or path.split(".")[1].partition("[")[0] in fields
                if is_changed and path in self.cells:
                    lines.append(f"{self.cells[path]} = {call.result(group)}{path.removeprefix(group)}")
        return lines + [f"{call.stored(slot, 'lane')} = {call.result(name)}" for name, slot in effects.slots.items()]

    def any_of(self, condition: ast.expr, is_none: bool) -> tuple[list[str], str]:
        """Lines that count the runs with a condition, and the test of the count, which can be vectorised."""
        cells = {f"lane.{path}": parse_expression(cell) for path, cell in self.cells.items()}
        text = ast.unparse(rewritten(condition, lambda node: cells.get(ast.unparse(node))))
        lines = ["counted = 0", "for lane in range(width):", f"    counted += 1 if {text} else 0"]
        return lines, "counted == 0" if is_none else "counted > 0"

    def action(self, method: str, arguments: Sequence[str]) -> list[str]:
        """Lines that copy rows: to a recorded sample, to the saved data of waiting runs, or back."""
        if method == "record":
            return [
                "for row in range(record.shape[1]):",
                f"    for lane in range({'1' if self.lanes == 1 else 'record.shape[2]'}):",
                f"        record[{arguments[0]}, row, lane] = x[row, lane]",
            ]
        states = len(self.state_at)
        numbers = [(self.cells[path], f"x[{self.aside + index}, lane]") for index, path in enumerate(self.saved)]
        remaining, *handed = numbers[states:]
        if method == "set_aside":
            copied = over_rows(states, f"x[{self.aside} + row, lane] = x[row, lane]")
            return [*copied, *_for_each_lane(f"{saved} = {cell}" for cell, saved in (remaining, *handed))]
        # A lane whose step was complete when it was set aside takes its saved numbers back.
        goes_on = f"{remaining[1]} > 0.0"
        copied = over_rows(states, f"x[row, lane] = x[row, lane] if {goes_on} else x[{self.aside} + row, lane]")
        lines = [f"{cell} = {cell} if {goes_on} else {saved}" for cell, saved in handed]
        return [*copied, *(_for_each_lane(lines) if lines else [])]

    def value(self, method: str, arguments: Sequence[str]) -> str:
        """Expression for a sample query: ``traces`` (whether it is traced) or ``slot`` (its index in the trace)."""
        index, trace_every = arguments
        return f"{index} % {trace_every} == 0" if method == "traces" else f"{index} // {trace_every} % trace.shape[0]"


class RowsOfRun:
    """Groups of a single run: NamedTuples under their own names, including the outputs of a sample."""

    def __init__(self, step: StepText, outputs: str) -> None:
        self.step = step
        self.outputs = outputs

    def over_lanes(self, calls: Sequence[Call]) -> list[str]:
        """Lines of plain calls, whose results are assigned to the names of their groups."""
        return [line for call in calls for line in self.for_lane(call)] or ["pass"]

    def for_lane(self, call: Call) -> list[str]:
        """Lines for one call: assignment of groups and history elements, and the row of a traced sample."""
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

    def any_of(self, condition: ast.expr, is_none: bool) -> tuple[list[str], str]:
        """No lines, and the condition itself: a single run needs no count of runs."""
        names = {f"lane.{group}": ast.Name(group, ast.Load()) for group in self.step.rows}
        text = ast.unparse(rewritten(condition, lambda node: names.get(ast.unparse(node))))
        return [], f"not {text}" if is_none else text

    def action(self, method: str, arguments: Sequence[str]) -> list[str]:  # noqa: ARG002 - as for many runs
        """Return an empty statement, because a single run records nothing and does not wait."""
        return ["pass"]

    def value(self, method: str, arguments: Sequence[str]) -> str:  # noqa: ARG002 - as for many runs
        """Constant result of a query on a sample: every sample is traced, at the first index of the trace."""
        return "True" if method == "traces" else "0"


Rows: TypeAlias = RowsOfLanes | RowsOfRun
"""Storage of the numbers of a step, as used by the generator of the loop."""


def over_rows(count: int, line: str) -> list[str]:
    """Lines of a loop that apply a line to all runs in the first ``count`` rows."""
    return [f"for row in range({count}):", *indent(_for_each_lane([line]))]


def _for_each_lane(lines: Iterable[str]) -> list[str]:
    """Lines of a loop that apply some lines to all runs of the block."""
    return ["for lane in range(width):", *indent(lines)]
