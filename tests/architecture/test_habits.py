"""A habit that no linter knows: every test can fail."""

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
CHECKERS = ("assert", "check", "raises", "warns", "fail")


def silent_tests(tree: ast.Module) -> Iterator[str]:
    """Tests that neither assert nor call what asserts: a function of their file that does, or one named so."""
    functions = {node.name: node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}

    def asserts(node: ast.FunctionDef, seen: frozenset[str]) -> bool:
        for item in ast.walk(node):
            if isinstance(item, ast.Assert):
                return True
            called = getattr(item.func, "attr", getattr(item.func, "id", "")) if isinstance(item, ast.Call) else ""
            if called.startswith(CHECKERS):
                return True
            if called in functions.keys() - seen and asserts(functions[called], seen | {called}):
                return True
        return False

    for name, node in functions.items():
        if name.startswith("test_") and not asserts(node, frozenset({name})):
            yield name


def test_every_test_asserts_something() -> None:
    files = sorted((ROOT / "tests").rglob("test_*.py"))
    silent = [
        f"{path.relative_to(ROOT)}: {name}"
        for path in files
        for name in silent_tests(ast.parse(path.read_text(encoding="utf-8")))
    ]
    assert silent == []
