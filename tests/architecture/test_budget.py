"""The budget of the project only falls: counts stay within it, and no number in its own history ever rose."""

import ast
import subprocess
import tomllib
from itertools import pairwise
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BUDGET = ROOT / "tests" / "architecture" / "budget.toml"


def lines(folder: Path, *endings: str) -> int:
    """Lines of the files of a folder that end so."""
    files = [path for ending in endings for path in folder.rglob(f"*{ending}")]
    return sum(path.read_text(encoding="utf-8").count("\n") for path in files)


def code_and_definitions(package: Path) -> tuple[int, int]:
    """Lines of code (no docstring, import, signature, field, comment or blank), and functions with classes."""
    code, definitions = 0, 0
    for path in package.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        rows = {number for number, row in enumerate(text.splitlines(), 1) if row.strip() and row.strip()[0] != "#"}
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                definitions += 1
                rows -= set(range(node.lineno, node.body[0].lineno))
            is_text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
            if isinstance(node, ast.Import | ast.ImportFrom | ast.AnnAssign) or is_text:
                rows -= set(range(node.lineno, (node.end_lineno or 0) + 1))
        code += len(rows)
    return code, definitions


def counted() -> dict[str, int]:
    """Counts of this checkout by their names in the budget."""
    source = ROOT / "src" / "ppafo"
    code, definitions = code_and_definitions(source)
    documents = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    return {
        "source_lines": lines(source, ".py"),
        "source_code": code,
        "source_definitions": definitions,
        "test_lines": lines(ROOT / "tests", ".py"),
        "document_words": sum(len(path.read_text(encoding="utf-8").split()) for path in documents),
        "page_lines": lines(source / "page", ".js", ".css", ".html", ".c", ".h"),
    }


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
    rises = [
        f"{name}: {before[name]} to {after.get(name)}"
        for before, after in pairwise(budgets)
        for name in before
        if after.get(name, before[name] + 1) > before[name]
    ]
    assert rises == [], "the budget only falls, and no line leaves it"


def test_code_and_definitions_are_counted(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("from b import f\n\n\ndef g():\n    # Why.\n    return f()\n")
    (tmp_path / "b.py").write_text('def f():\n    """Text."""\n    return 1\n')
    assert code_and_definitions(tmp_path) == (2, 2)
