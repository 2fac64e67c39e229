"""Docstrings name the thing in the field's words, and a class name stands for one thing."""

import ast
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[2] / "src" / "ppafo"
QUESTIONS = frozenset({"How", "One", "Such", "That", "Those", "What", "Where", "Whether", "Which"})
"""First words of a docstring that asks or points instead of naming."""
CONTINUES = frozenset(
    {"And", "But", "By", "Else", "For", "From", "In", "Its", "Of", "Or", "So", "Their", "Then", "There", "They", "To"}
)
"""First words of a docstring that needs the line above it."""
SHARED: Mapping[str, int] = {
    "Asked": 2,
    "Block": 3,
    "Candidate": 2,
    "Case": 2,
    "Cause": 2,
    "Chamber": 2,
    "Change": 2,
    "Clock": 2,
    "Coil": 2,
    "Column": 3,
    "Columns": 2,
    "Compared": 2,
    "Comparison": 2,
    "Configuration": 2,
    "Course": 3,
    "Curve": 3,
    "Decay": 2,
    "Delays": 2,
    "Device": 2,
    "Effort": 2,
    "Estimate": 2,
    "Exchange": 2,
    "Experiment": 2,
    "Finding": 3,
    "Friction": 2,
    "Gain": 2,
    "Goal": 2,
    "Group": 2,
    "Interval": 3,
    "Joint": 3,
    "Landing": 2,
    "Levels": 2,
    "Limit": 2,
    "Limits": 2,
    "Look": 2,
    "Machine": 2,
    "Margins": 2,
    "Measured": 4,
    "Memory": 2,
    "Moment": 2,
    "Motion": 2,
    "Names": 3,
    "Number": 2,
    "Outcome": 5,
    "Outputs": 2,
    "Pace": 2,
    "Part": 2,
    "Person": 2,
    "Place": 2,
    "Plant": 2,
    "ProfileTable": 2,
    "Range": 2,
    "Reading": 3,
    "Readings": 3,
    "Recorded": 2,
    "Reported": 2,
    "Request": 2,
    "Row": 2,
    "Sample": 4,
    "Search": 2,
    "Seen": 2,
    "Segment": 3,
    "Sensor": 2,
    "Setting": 4,
    "Settings": 2,
    "Side": 2,
    "Sizes": 2,
    "Source": 3,
    "Start": 2,
    "State": 2,
    "Steps": 3,
    "Store": 2,
    "Stretch": 3,
    "Strides": 4,
    "Study": 2,
    "Switch": 2,
    "Task": 2,
    "Term": 3,
    "TorqueProfile": 2,
    "Trial": 2,
    "Tried": 4,
    "Variable": 2,
    "Work": 2,
    "_Names": 2,
    "_Table": 2,
}
"""Class names that stand in several modules, with their number: an entry may only leave or shrink."""


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
    assert {name: count for name, count in class_names(SOURCE).items() if count > SHARED.get(name, 1)} == {}


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
