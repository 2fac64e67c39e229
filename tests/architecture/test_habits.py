"""Habits that no linter knows: rows are built by keyword, every test can fail."""

import ast
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
MOST_BY_POSITION = 3
"""Rooms whose functions are compiled."""
CHECKERS = ("assert", "check", "raises", "warns", "fail")

Rows = Mapping[tuple[str, str], int]


@cache
def trees() -> Mapping[Path, ast.Module]:
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in sorted((ROOT / "src").rglob("*.py"))}


def module_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT / "src").with_suffix("").parts).removesuffix(".__init__")


def rows() -> Rows:
    """Number of fields of every NamedTuple, by module and name."""
    return {
        (module_of(path), node.name): sum(isinstance(item, ast.AnnAssign) for item in node.body)
        for path, tree in trees().items()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef) and any(ast.unparse(base) == "NamedTuple" for base in node.bases)
    }


def built_by_position(tree: ast.Module, module: str, known: Rows) -> Iterator[str]:
    """Rows of more than three fields that are built with as many values, or starred ones, by position."""
    here = {name: count for (place, name), count in known.items() if place == module}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module is not None:
            given = {item.asname or item.name: known.get((node.module, item.name), 0) for item in node.names}
            here |= given
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            is_starred = any(isinstance(item, ast.Starred) for item in node.args)
            is_large = here.get(node.func.id, 0) > MOST_BY_POSITION
            if is_large and (is_starred or len(node.args) > MOST_BY_POSITION):
                yield f"{module}:{node.lineno}: {node.func.id}"


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


def test_rows_of_more_than_three_fields_are_built_by_keyword() -> None:
    known = rows()
    assert len(known) > 80
    assert [line for path, tree in trees().items() for line in built_by_position(tree, module_of(path), known)] == []


def test_a_row_built_by_position_is_found() -> None:
    known = {("here", "Row"): 4}
    text = "Row(1, 2, 3, 4)\nRow(*four)\nRow(1, 2, 3, last=4)\nRow(first=1, second=2, third=3, last=4)\n"
    assert list(built_by_position(ast.parse(text), "here", known)) == ["here:1: Row", "here:2: Row"]


def test_every_test_asserts_something() -> None:
    files = sorted((ROOT / "tests").rglob("test_*.py"))
    silent = [
        f"{path.relative_to(ROOT)}: {name}"
        for path in files
        for name in silent_tests(ast.parse(path.read_text(encoding="utf-8")))
    ]
    assert silent == []


def test_a_test_without_an_assertion_is_found() -> None:
    text = "def helper():\n    assert 1\ndef run():\n    pass\ndef test_a():\n    helper()\ndef test_b():\n    run()\n"
    assert list(silent_tests(ast.parse(text))) == ["test_b"]
