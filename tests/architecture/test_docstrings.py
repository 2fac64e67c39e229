"""Docstrings name the thing in the field's words, and a class name stands for one thing."""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[2] / "src" / "ppafo"
QUESTIONS = frozenset({"How", "One", "Such", "That", "Those", "What", "Where", "Whether", "Which"})
"""First words of a docstring that asks or points instead of naming."""
CONTINUES = frozenset(
    {"And", "But", "By", "Else", "For", "From", "In", "Its", "Of", "Or", "So", "Their", "Then", "There", "They", "To"}
)
"""First words of a docstring that needs the line above it."""


def docstrings(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Docstrings of a module, its classes, functions, constants and fields, each with its line."""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        for item in body if isinstance(body, list) else []:
            if (
                isinstance(item, ast.Expr)
                and isinstance(item.value, ast.Constant)
                and isinstance(item.value.value, str)
            ):
                yield item.lineno, item.value.value


def fault_of(text: str) -> str:
    """The words by which a docstring does not name its thing; empty if it does."""
    first = re.match(r"\w*", text.strip())
    word = first.group() if first else ""
    pointing = re.search(r"\bthat\s+of\b", text, re.IGNORECASE)
    return word if word in QUESTIONS | CONTINUES else pointing.group() if pointing else ""


def class_names(root: Path) -> Counter[str]:
    """Classes of a package by name, at the top of its modules."""
    found: Counter[str] = Counter()
    for path in root.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        found.update(node.name for node in tree.body if isinstance(node, ast.ClassDef))
    return found


def test_a_docstring_names_its_thing() -> None:
    found = []
    for path in sorted(SOURCE.rglob("*.py")):
        for line, text in docstrings(ast.parse(path.read_text(encoding="utf-8"))):
            if fault := fault_of(text):
                found.append(f"{path.relative_to(SOURCE).as_posix()}:{line}: {fault}: {text.strip().splitlines()[0]}")
    assert found == []


def test_a_class_name_stands_for_one_thing() -> None:
    assert [name for name, count in class_names(SOURCE).items() if count > 1] == []


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("What stands in the file of a walk.", "What"),
        ("And how often they gave less help.", "And"),
        ("Pressure of a chamber,\nor that\nof the supply.", "that\nof"),
        ("Peak torque of the mean stride [N m].", ""),
    ],
)
def test_a_docstring_that_does_not_name_its_thing_is_found(text: str, fault: str) -> None:
    assert fault_of(text) == fault


def test_a_class_name_in_two_modules_is_found(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("class Trial:\n    pass\n")
    (tmp_path / "b.py").write_text("class Trial:\n    pass\n\n\nclass Once:\n    pass\n")
    assert class_names(tmp_path) == Counter(Trial=2, Once=1)
