"""The budget of the project only falls: counts stay within it, and no number in its own history ever rose."""

import ast
import io
import subprocess
import tokenize
import tomllib
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[2]
BUDGET = ROOT / "tests" / "architecture" / "budget.toml"


FIRST_NAME = "source_tokens"
"""The history begins at the commit that introduced this name: before it the budget counted lines, which packing met."""
LAYOUT = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENCODING,
    tokenize.ENDMARKER,
}


class CodeCounts(NamedTuple):
    """Counts of Python code that no layout of lines changes; docstrings and comments are free."""

    tokens: int
    statements: int
    definitions: int


def is_text(node: ast.AST) -> bool:
    """Whether a node is a docstring or another text that stands alone."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def code_counts(text: str) -> CodeCounts:
    """Counts of one file. Each element of a tuple assignment is a statement, as if it stood in a line of its own."""
    statements = 0
    definitions = 0
    text_rows: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        if is_text(node):
            text_rows |= set(range(node.lineno, node.end_lineno + 1))
        elif isinstance(node, ast.stmt):
            statements += 1
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            definitions += 1
        if (
            isinstance(node, ast.Assign)
            and isinstance(node.targets[0], ast.Tuple)
            and isinstance(node.value, ast.Tuple)
        ):
            statements += len(node.value.elts) - 1
    words = tokenize.generate_tokens(io.StringIO(text).readline)
    tokens = sum(word.type not in LAYOUT and word.start[0] not in text_rows for word in words)
    return CodeCounts(tokens, statements, definitions)


def folder_counts(folder: Path) -> CodeCounts:
    """Sums over the Python files of a folder."""
    files = [code_counts(path.read_text(encoding="utf-8")) for path in folder.rglob("*.py")]
    return CodeCounts(*(sum(column) for column in zip(*files, strict=True)))


def counted() -> dict[str, int]:
    """Counts of this checkout by their names in the budget."""
    source = ROOT / "src" / "ppafo"
    code = folder_counts(source)
    documents = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    pages = [path for path in (source / "page").rglob("*") if path.suffix in {".js", ".css", ".html", ".c", ".h"}]
    return {
        "source_tokens": code.tokens,
        "source_statements": code.statements,
        "source_definitions": code.definitions,
        "source_files": sum(1 for _ in source.rglob("*.py")),
        "test_tokens": folder_counts(ROOT / "tests").tokens,
        "document_words": sum(len(path.read_text(encoding="utf-8").split()) for path in documents),
        "page_lines": sum(path.read_text(encoding="utf-8").count("\n") for path in pages),
    }


def rises(budgets: Sequence[Mapping[str, int]]) -> list[str]:
    """Names of consecutive budgets that rose or left, from the first budget that counts tokens."""
    counting_tokens = [budget for budget in budgets if FIRST_NAME in budget]
    return [
        f"{name}: {before[name]} to {after.get(name)}"
        for before, after in pairwise(counting_tokens)
        for name in before
        if after.get(name, before[name] + 1) > before[name]
    ]


def test_the_project_stays_within_its_budget() -> None:
    budget = tomllib.loads(BUDGET.read_text(encoding="utf-8"))
    now = counted()
    assert set(budget) == set(now)
    assert {name: now[name] for name in budget if now[name] > budget[name]} == {}, "take something out"


def test_no_number_of_the_budget_ever_rose() -> None:
    path = BUDGET.relative_to(ROOT).as_posix()

    def git(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(["git", *words], cwd=ROOT, check=False, capture_output=True, text=True)

    # The main line alone: branches that both lower the budget may be merged in either order.
    log = git("log", "--first-parent", "-m", "--format=%H", "--", path)
    if log.returncode or not (commits := log.stdout.split()):
        pytest.skip("no history of the budget here")
    texts = [git("show", f"{commit}:{path}").stdout for commit in reversed(commits)]
    budgets = [tomllib.loads(text) for text in [*texts, BUDGET.read_text(encoding="utf-8")] if text]
    assert rises(budgets) == [], "the budget only falls, and no line leaves it"


def test_a_rise_and_a_name_that_leaves_are_found_from_the_first_count_of_tokens() -> None:
    old = {"source_lines": 10}
    first = {"source_tokens": 100, "source_files": 7}
    assert rises([old, {"source_lines": 20}, first, first | {"source_files": 6}]) == []
    assert rises([old, first, first | {"source_files": 8}]) == ["source_files: 7 to 8"]
    assert rises([first, {"source_tokens": 100}]) == ["source_files: 7 to None"]


def test_packing_and_text_change_no_count() -> None:
    unpacked = "def f():\n    a = 1\n    b = g()\n    return a\n"
    packed = "def f():\n    a, b = 1, g()\n    return a\n"
    explained = 'def f():\n    """Text."""\n\n    # Why.\n    a = 1\n    b = g()\n    return a\n'
    assert code_counts(unpacked) == CodeCounts(tokens=15, statements=4, definitions=1)
    assert code_counts(explained) == code_counts(unpacked)
    assert code_counts(packed).statements == code_counts(unpacked).statements


def test_an_assignment_of_several_values_holds_the_result_of_one_expression() -> None:
    packed = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in (ROOT / "src" / "ppafo").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Tuple) and isinstance(node.targets[0], ast.Tuple)
    ]
    # Those that are left assign at once what each needs of the others, as a recursion does.
    assert len(packed) < 20, packed
