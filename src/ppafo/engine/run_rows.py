"""The rows of one program where a single run goes through it: each group is a local name, and there are no lanes.

What writes the lanes' steps writes a single run's too: it loads groups, makes new ones, and stores them. For lanes
that is a copy from and to the rows of ``x``; for one run a group is a NamedTuple under its own name, so that a load is
nothing and a store an assignment. Lines that change a group for themselves alone get a name of their own for it.
"""

import ast
import re
from collections.abc import Callable
from typing import Any, final

from ppafo.engine.components import Phases, RarePhase
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, row_expression, row_numbers
from ppafo.engine.source_text import Collector, composed_lines

KEPT = "kept"
"""``kept.state`` is the group itself, whatever lines made of its name in between; the finished text has ``state``."""


@final
class RunRows:
    """Names of the numbers of a program for one run; in all that writes a step it stands in the place of ``LaneRows``.

    ``outputs`` is the row of what is traced at a sample, behind its time.
    """

    def __init__(self, program: Program, collector: Collector, outputs: str) -> None:
        self.program = program
        self.outputs = outputs
        self.add: Callable[[Callable[..., Any] | type], str] = collector.add
        self.needs = collector.needs
        self.groups = program.parameter_rows() | program.state_rows() | program.step_rows()
        self.state_at = row_numbers(program.state_rows())
        self.cells = {path: f"{KEPT}.{path}" for name, row in self.groups.items() for path in leaf_paths(row, name)}
        self.length, self.before, self.remaining, self.error = (
            "part_length",
            "part_before",
            "part_remaining",
            "part_error",
        )

    def load(self, group: str) -> str:
        """Line after which ``group`` is what was stored under it."""
        return f"{group} = {KEPT}.{group}"

    def store(self, group: str, name: str = "", flag: str = "") -> list[str]:
        """Lines that make ``name`` (or ``group``) the group from now on; a flag may forbid it."""
        if not leaf_paths(self.groups[group], group):
            return []
        return [f"{KEPT}.{group} = {name or group}" + (f" if {flag} else {KEPT}.{group}" if flag else "")]

    def keep(self, *names: str) -> list[str]:
        """Lines that keep what a phase hands on to the next ones of the step, by group."""
        return [line for name in names for line in self.store(name)]

    def over_lanes(self, lines: list[str]) -> list[str]:
        """The lines for the run, with the rows of effects where a function that is called needs them."""
        return self.in_turn([lines])

    def over_phases(self, prelude: list[str], all_phases: Phases) -> list[str]:
        """All phases one after another, behind what they share."""
        return self.in_turn([prelude, *all_phases], shared=1)

    def in_turn(self, parts: Phases, shared: int = 0) -> list[str]:
        """Parts of a step one after another; each begins with the groups as they are, and with the ``shared`` first."""
        lines: list[str] = []
        common: dict[str, str] = {}
        for place, part in enumerate(parts):
            own = composed_lines(part.lines if isinstance(part, RarePhase) else part, self.needs)
            written, names = self.renamed(own, common, lines)
            common = names if place < shared else common
            if isinstance(part, RarePhase):
                written = [f"if {part.cell} > 0.0:", *(f"    {line}" for line in written)]
            lines += written
        return lines

    def renamed(self, lines: list[str], names: dict[str, str], before: list[str]) -> tuple[list[str], dict[str, str]]:
        """Lines in which a group that is changed, and not stored, has another name; and these names in the end."""
        tree = ast.parse("\n".join(lines))
        # A group that is stored keeps its name: later parts read it.
        stored = {found[1] for line in lines if (found := _STORED.fullmatch(line.strip()))}
        used = {word for line in (*lines, *before) for word in re.findall(r"\w+", line)}
        writer = _Renaming(set(self.groups) - stored, dict(names), used)
        body = [writer.visit(item) for item in tree.body]
        text = [ast.unparse(item) for item in body if item is not None]
        return [line for item in text for line in item.split("\n")], writer.names

    def loaded(self, groups: dict[str, type], whole: str) -> list[str]:
        """Lines that take groups out of a row of them; one that is empty is not in it."""
        return [f"{name} = {f'{whole}.{name}' if leaf_paths(row, name) else '()'}" for name, row in groups.items()]

    def empty(self, group: str) -> str:
        """Line that makes a group of zeros."""
        row = self.groups[group]
        zeros = dict.fromkeys(leaf_paths(row, group), "0.0")
        return f"{group} = {row_expression(row, group, zeros, self.add)}"


_STORED = re.compile(rf"{KEPT}\.(\w+) = \1")
"""A group that gets what lines made under its own name."""


class _Renaming(ast.NodeTransformer):
    """Gives groups that lines change for themselves other names; ``names`` has these as far as it came."""

    def __init__(self, groups: set[str], names: dict[str, str], used: set[str]) -> None:
        self.groups = groups
        self.names = names
        self.used = used
        self.depth = 0

    def visit_Assign(self, node: ast.Assign) -> ast.stmt | None:
        target, value = node.targets[0], node.value
        is_kept = isinstance(value, ast.Attribute) and isinstance(value.value, ast.Name) and value.value.id == KEPT
        if is_kept and isinstance(target, ast.Name) and target.id == ast.unparse(value).removeprefix(f"{KEPT}."):
            self.names.pop(target.id, None)
            return None
        if _STORED.fullmatch(ast.unparse(node)):
            return None
        value = self.visit(value)
        return ast.Assign([self.on_the_left(target)], value, lineno=0)

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.stmt:
        # Written out: the name on the left may be another one than that on the right.
        sum_of_both = ast.BinOp(ast.parse(ast.unparse(node.target), mode="eval").body, node.op, node.value)
        return ast.Assign([self.on_the_left(node.target)], self.visit(sum_of_both), lineno=0)

    def on_the_left(self, target: ast.expr) -> ast.expr:
        if isinstance(target, ast.Tuple):
            return ast.Tuple([self.on_the_left(item) for item in target.elts], ast.Store())
        if not isinstance(target, ast.Name) or target.id not in self.groups:
            return target
        if target.id not in self.names:
            wanted = f"{target.id}_now"
            while wanted in self.used:
                wanted += "_"
            self.names[target.id] = wanted
        return ast.Name(self.names[target.id], ast.Store())

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return ast.Name(self.names.get(node.id, node.id), node.ctx)
