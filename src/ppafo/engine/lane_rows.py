"""The rows of one program in a block of lanes or for a single run, and the lines that load and store them.

What writes the lanes' steps writes those of one run too: it loads groups, makes new ones, and stores them. For lanes
that is a copy from and to the rows of ``x``; for one run a group is a NamedTuple under its own name, so that a load is
nothing and a store an assignment. Lines that change a group for themselves alone get a name of their own for it.
"""

import ast
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeAlias, final

from ppafo.engine.components import Phases, RarePhase
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, row_expression, row_numbers
from ppafo.engine.source_text import Collector, composed_lines

LANES = 32
"""Most runs of a block."""

VECTOR = 8
"""Lanes that the widest processors take at once, and the fewest of a block: its columns are a whole number of these."""

FIRST_CACHE = 48 * 1024
"""Bytes of the first-level data cache of a core; a block that does not fit takes fewer runs."""


HANDED = ("held.", "carried.")
"""Groups of rows that a step is handed by the one before."""

OWN_ROWS = 4
"""Rows of the parts of a step: length of a part, time before it and after its begin [s], error of its gas [-]."""

_LOAD = re.compile(r"(?P<group>\w+) = (\(\)|\w+\([\w(), \[\]]*\))")
"""Line that makes a group from cells alone; anything that it may call instead has no other effect either."""


@lru_cache(maxsize=64)
def lanes_of(program: Program) -> int:
    """Runs of one block of a program."""
    groups = (program.state_rows(), program.parameter_rows(), program.step_rows())
    # Fewer lanes rather than a block that spills: a miss of the first cache costs more than half-used loops.
    rows = sum(len(leaf_paths(row, name)) for group in groups for name, row in group.items())
    return next((lanes for lanes in (LANES, LANES // 2) if 8 * lanes * rows <= FIRST_CACHE), VECTOR)


@final
class LaneRows:
    """Where each number of a program lies in the rows of ``x``: state, parameters, what a step hands on, its parts.

    One array for all of them lets the compiler see that no two rows overlap. From row ``aside`` on lies what lanes that
    wait for others keep, where few do: the state, what was left of the step, and what it was handed.
    """

    def __init__(self, program: Program, collector: Collector, lanes: int = 0) -> None:
        self.program = program
        self.lanes = lanes or lanes_of(program)
        self.add: Callable[[Callable[..., Any] | type], str] = collector.add
        self.needs = collector.needs
        states, parameters, of_step = program.state_rows(), program.parameter_rows(), program.step_rows()
        self.groups = parameters | states | of_step
        self.state_at = row_numbers(states)
        self.parameter_at = row_numbers(parameters, len(self.state_at))
        self.step_at = row_numbers(of_step, len(self.state_at) + len(self.parameter_at))
        numbered = self.state_at | self.parameter_at | self.step_at
        self.cells = {path: f"x[{row}, lane]" for path, row in numbered.items()}
        self.length, self.before, self.remaining, self.error = (
            f"x[{len(numbered) + place}, lane]" for place in range(OWN_ROWS)
        )
        self.aside = len(numbered) + OWN_ROWS
        kept = len(self.state_at) + 1 + sum(path.startswith(HANDED) for path in self.step_at)
        self.count = self.aside + (kept if program.parts_are_rare else 0)

    def load(self, group: str) -> str:
        """Line that makes the NamedTuple ``group`` from its rows."""
        return f"{group} = {row_expression(self.groups[group], group, self.cells, self.add)}"

    def store(self, group: str, name: str = "", flag: str = "") -> list[str]:
        """Lines that write the NamedTuple ``name`` (or ``group``) to the rows of ``group``; a flag may forbid it."""
        lines = []
        for path in leaf_paths(self.groups[group], group):
            value = (name or group) + path.removeprefix(group)
            lines.append(f"{self.cells[path]} = {value}" + (f" if {flag} else {path}" if flag else ""))
        return lines

    def keep(self, *names: str) -> list[str]:
        """Lines that keep what a phase hands on to the next ones of the step, by group."""
        return [line for name in names for line in self.store(name)]

    def over_lanes(self, lines: list[str]) -> list[str]:
        """A loop over all lanes of the block, with the rows of effects where a function that is called needs them."""
        lines = composed_lines(lines, self.needs)
        # Only the structs of effects that a line needs are loaded: each load costs time to compile.
        words = {word for line in lines for word in re.findall(r"\w+", line)}
        return over_lanes([*[self.load(row) for row in self.program.effect_rows if row in words], *lines])

    def over_phases(self, prelude: list[str], all_phases: Phases) -> list[str]:
        """Each phase in a loop of its own: loops this short let the processor work on several lanes at once.

        It looks some hundred instructions ahead, and one lane's division or root waits for the one before.
        """
        lines: list[str] = []
        for phase in all_phases:
            if isinstance(phase, RarePhase):
                loop = self.over_lanes([*prelude, *phase.lines])
                # Most steps need no rare phase in any lane; a sum over lanes is cheaper than its code.
                lines += [*count_lanes("wanting", f"{phase.cell} > 0.0"), "if wanting > 0:", *indent(loop)]
            else:
                lines += self.over_lanes([*prelude, *phase])
        return lines


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
        return self.over_phases([], [lines])

    def over_phases(self, prelude: list[str], all_phases: Phases) -> list[str]:
        """All phases one after another; each begins with the groups as they are behind the prelude."""
        lines, common = self.renamed(composed_lines(prelude, self.needs), {}, [])
        for phase in all_phases:
            own = composed_lines(phase.lines if isinstance(phase, RarePhase) else phase, self.needs)
            written, _ = self.renamed(own, common, lines)
            lines += [f"if {phase.cell} > 0.0:", *indent(written)] if isinstance(phase, RarePhase) else written
        return lines

    def renamed(self, lines: list[str], names: dict[str, str], before: list[str]) -> tuple[list[str], dict[str, str]]:
        """Lines in which a group that is changed, and not stored, has another name; and these names in the end."""
        tree = ast.parse("\n".join(lines))
        stored = {found[1] for line in lines if (found := _STORED.fullmatch(line.strip()))}
        used = {word for line in (*lines, *before) for word in re.findall(r"\w+", line)}
        writer = _Renaming(set(self.groups) - stored, dict(names), used)
        body = [writer.visit(item) for item in tree.body]
        text = [ast.unparse(item) for item in body if item is not None]
        return [line for item in text for line in item.split("\n")], writer.names


_STORED = re.compile(rf"{KEPT}\.(\w+) = \1")
"""A group that gets what lines made under its own name."""


@dataclass
class _Renaming(ast.NodeTransformer):
    """Gives groups that lines change for themselves other names; ``names`` has these as far as it came."""

    groups: set[str]
    names: dict[str, str]
    used: set[str]

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
        # Written out: the name on the left may differ from the one on the right.
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


Rows: TypeAlias = LaneRows | RunRows
"""Where the numbers of a step are: in the rows of a block of lanes, or under the names of a single run."""


def count_lanes(name: str, condition: str) -> list[str]:
    """Lines that count in ``name`` the lanes for which a condition holds.

    A sum of whole numbers is taken of several lanes at once, a largest float is not.
    """
    return [f"{name} = 0", "for lane in range(width):", f"    {name} += 1 if {condition} else 0"]


def indent(lines: list[str], levels: int = 1) -> list[str]:
    """The lines, some levels further in."""
    return ["    " * levels + line for line in lines]


def over_lanes(lines: list[str]) -> list[str]:
    """A loop over all lanes of the block, without loads that nothing in it asks for: they take time to compile."""
    kept: list[str] = []
    loaded_groups: set[str] = set()
    # From the end, so that what later lines ask for is known.
    for line in reversed(lines):
        load = _LOAD.fullmatch(line)
        words = re.findall(r"\w+", line)
        # A line that names its own group again, as in least = min(least, x), gathers over the lanes for what follows.
        if load is None or load["group"] in loaded_groups or words.count(load["group"]) > 1:
            kept.append(line)
            loaded_groups.update(words)
    return ["for lane in range(width):", *indent(kept[::-1])]
