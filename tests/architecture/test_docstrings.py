"""Docstrings name the thing in the field's words, and a class name stands for one thing."""

import ast
from collections import Counter
from pathlib import Path

SOURCE = Path(__file__).parents[2] / "src" / "ppafo"


def class_names(root: Path) -> Counter[str]:
    """Classes of a package by name, at the top of its modules."""
    found: Counter[str] = Counter()
    for path in root.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        found.update(node.name for node in tree.body if isinstance(node, ast.ClassDef))
    return found


def test_a_class_name_stands_for_one_thing() -> None:
    assert [name for name, count in class_names(SOURCE).items() if count > 1] == []
