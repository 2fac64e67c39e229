"""Compiled subset of Python, and the one-line errors for code outside the subset.

Code that is visibly outside the subset is refused before composition. Errors that depend on the types of values are
found by type inference (``translation/walk.py``) and reported for the line of the user's file (``place_in``).
"""

import ast
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from ppafo.engine.entries import ORIGIN, PARSING
from ppafo.errors import ProgramError
from ppafo.kinds import fault_of_user
from ppafo.wording import one_line, place

_PLAIN = {
    *(ast.Return, ast.Assign, ast.AugAssign, ast.AnnAssign, ast.For, ast.While, ast.If, ast.Break, ast.Continue),
    *(ast.Pass, ast.Expr, ast.BoolOp, ast.BinOp, ast.UnaryOp, ast.IfExp, ast.Compare, ast.Call, ast.keyword),
    *(ast.Constant, ast.Attribute, ast.Subscript, ast.Name, ast.Tuple, ast.Slice, ast.Starred),
}
_PACKAGE = Path(__file__).parents[1]
_INSTEAD = "a law may use numbers, tuples, NamedTuples, 'math' and other plain functions"


def refusal(file: str, where: ast.AST | int, problem: str) -> ProgramError:
    """Return the error for a position in a file: one line that starts with ``my_law.py:12: ``."""
    line = where if isinstance(where, int) else getattr(where, "lineno", 0)
    # A fault in a function of this package comes from what a kind of another package gave it.
    blamed = fault_of_user(TypeError(problem)) if Path(file).is_relative_to(_PACKAGE) else ""
    return ProgramError(blamed or f"{place(file, line)}: {one_line(problem)}")


def parse_module(text: str, path: str = "<unknown>") -> ast.Module:
    """Return the syntax tree of a text; only one thread parses at a time. SyntaxError as raised by Python."""
    with PARSING:
        return ast.parse(text, path)


def check_grammar(tree: ast.FunctionDef, file: str) -> None:
    """Raise ProgramError, with file and line, for the first construct in a file that cannot be compiled."""
    problems: list[tuple[ast.stmt | ast.expr | ast.keyword, str]] = []
    if tree.args.vararg or tree.args.kwarg or getattr(tree, "type_params", None):
        problem = f"'{tree.name}' takes a variable number of arguments, which cannot be compiled; name each argument"
        problems.append((tree, problem))
    left_away: set[ast.AST] = set()
    for node in (node for statement in tree.body for node in ast.walk(statement)):
        if isinstance(node, ast.AnnAssign):  # Python does not run the annotation of a local name
            left_away.update(ast.walk(node.annotation))
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            left_away.add(node.value)
        elif isinstance(node, ast.stmt | ast.expr | ast.keyword) and node not in left_away:
            problems.append((node, _problem(node)))
    present = [(where, problem) for where, problem in problems if problem]
    if present:
        where, problem = min(present, key=lambda problem: (problem[0].lineno, problem[0].col_offset))
        raise refusal(file, where, problem)


def _problem(node: ast.AST) -> str:
    """Return the reason why a node cannot be compiled, and the remedy; empty if the node can be compiled."""
    is_unpacked = isinstance(node, ast.keyword) and node.arg is None
    is_gathered = isinstance(node, ast.Starred) and not isinstance(node.ctx, ast.Load)
    is_text = isinstance(node, ast.Constant) and not isinstance(node.value, bool | int | float | None)
    if type(node) not in _PLAIN or is_unpacked or is_gathered or is_text:
        return f"'{ast.unparse(node).splitlines()[0]}' cannot be compiled; {_INSTEAD}"
    if isinstance(node, ast.Attribute | ast.Subscript) and not isinstance(node.ctx, ast.Load):
        return f"'{ast.unparse(node)}' cannot be assigned: a NamedTuple is immutable; make a new one"
    return ""


def check_flow(tree: ast.FunctionDef, file: str, local: Iterable[str]) -> None:
    """Refuse a function that can end without a value, or that reads one of its ``local`` names before assignment.

    Raises ProgramError with file and line.
    """
    arguments = tree.args
    parameters = {argument.arg for argument in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)}
    if _Flow(file, set(local)).end_of(tree.body, parameters) is not None:
        raise refusal(file, tree, f"'{tree.name}' can end without 'return'; every path through it must return a value")


@dataclass(frozen=True, slots=True)
class _Flow:
    """Analysis of which names are assigned; None after a return."""

    file: str
    local: set[str]

    def end_of(self, body: list[ast.stmt], bound: set[str]) -> set[str] | None:
        """Return the names assigned after some statements; None if they do not reach their end."""
        now: set[str] | None = set(bound)
        for statement in body:
            if now is None:
                return None
            now = self.after(statement, now)
        return now

    def after(self, statement: ast.stmt, bound: set[str]) -> set[str] | None:
        """Return the names assigned after a statement; None if the statement does not reach its end."""
        if isinstance(statement, ast.If):
            self.read(statement.test, bound)
            ends = [self.end_of(branch, bound) for branch in (statement.body, statement.orelse)]
            # Only branches that go on decide: a name that one of them lacks may have no value.
            going_on = [end for end in ends if end is not None]
            return set.intersection(*going_on) if going_on else None
        if isinstance(statement, ast.For | ast.While):
            return self.after_loop(statement, bound)
        if isinstance(statement, ast.Return) and getattr(statement.value, "value", statement) is None:
            raise refusal(self.file, statement, "'return' has no value; return a value")
        if isinstance(statement, ast.AugAssign) and stored_names([statement.target]) - bound:
            raise self.unbound(statement, ast.unparse(statement.target))
        value = getattr(statement, "value", None)
        if isinstance(value, ast.expr):
            self.read(value, bound)
        ends_here = isinstance(statement, ast.Return | ast.Break | ast.Continue)
        targets = statement.targets if isinstance(statement, ast.Assign) else [getattr(statement, "target", None)]
        stored = set() if value is None else stored_names(filter(None, targets))
        return None if ends_here else bound | stored

    def after_loop(self, statement: ast.For | ast.While, bound: set[str]) -> set[str] | None:
        """Return the names assigned after a loop, whose body may not run at all."""
        if isinstance(statement, ast.For):
            self.read(statement.iter, bound)
            # The body may run not once, so that what it assigns does not count after the loop.
            self.end_of(statement.body, bound | stored_names([statement.target]))
            return self.end_of(statement.orelse, bound)
        self.read(statement.test, bound)
        self.end_of(statement.body, bound)
        is_endless = isinstance(statement.test, ast.Constant) and bool(statement.test.value)
        # A break of an inner loop counts too: the name is then checked once too often, never too seldom.
        breaks = any(isinstance(node, ast.Break) for node in ast.walk(statement))
        return None if is_endless and not breaks else self.end_of(statement.orelse, bound)

    def read(self, node: ast.AST, bound: set[str]) -> None:
        """Refuse the reading of a local name that may be unassigned."""
        missing = self.local - bound
        for inner in ast.walk(node) if missing else ():
            if isinstance(inner, ast.Name) and inner.id in missing:
                raise self.unbound(inner, inner.id)

    def unbound(self, where: ast.AST, name: str) -> ProgramError:
        """Return the error for an unassigned name."""
        return refusal(self.file, where, f"'{name}' may be unassigned here; assign it earlier, on every path")


def stored_names(trees: Iterable[ast.AST]) -> set[str]:
    """Return the names that some statements or targets assign."""
    names = (node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Name))
    return {name.id for name in names if isinstance(name.ctx, ast.Store)}


_ORIGIN = re.compile(rf"{re.escape(ORIGIN)} (?P<file>.*): (?P<lines>[\d ]+)$")


class _SourcePosition(NamedTuple):
    """Line of a user's file where a statement starts, and the line where the next statement starts."""

    file: str
    line: int
    next_line: int


def place_in(lines: list[str], number: int) -> _SourcePosition | None:
    """Return the source position of line ``number`` of a generated text; None for lines without a source file."""
    for start in range(min(number, len(lines)) - 1, -1, -1):
        origin = _ORIGIN.match(lines[start])
        if origin is None:
            if lines[start].startswith("@entry(") and start + 1 < number and not lines[start - 1].startswith(ORIGIN):
                return None
            continue
        at = [int(line) for line in origin["lines"].split()]
        # Two lines stand before the first of a function: its decorator and its def.
        index = number - 1 - (start + 2)
        if not 0 <= index < len(at) - 1:
            return None
        return _SourcePosition(origin["file"], at[index], min(line for line in at if line > at[index]))
    return None
