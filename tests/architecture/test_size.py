"""Functions and files stay short enough to be read at once."""

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
FILES = sorted(path for folder in ("src/ppafo", "benchmarks", "scripts") for path in (ROOT / folder).rglob("*.py"))
MOST_LINES_OF_A_FUNCTION = 60
MOST_LINES_OF_A_FILE = 350


def lengths_of_functions(text: str) -> Iterator[tuple[str, int]]:
    """Name and lines of the body, less the docstring, of every function, nested ones too."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            body = node.body[1:] if ast.get_docstring(node) is not None and len(node.body) > 1 else node.body
            yield node.name, (body[-1].end_lineno or 0) - body[0].lineno + 1


def test_lines_of_a_body_are_counted_without_its_docstring() -> None:
    text = 'def outer():\n    """Say\n\n    much.\n    """\n    def inner():\n        return 1\n\n    return inner\n'
    assert dict(lengths_of_functions(text)) == {"outer": 4, "inner": 1}


def test_no_function_is_too_long() -> None:
    offenders = [
        f"{path.relative_to(ROOT)}: {name} has {length} lines"
        for path in FILES
        for name, length in lengths_of_functions(path.read_text(encoding="utf-8"))
        if length > MOST_LINES_OF_A_FUNCTION
    ]
    assert offenders == []


def test_no_file_is_too_long() -> None:
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in FILES}
    assert len(lengths) > 100
    offenders = [
        f"{path.relative_to(ROOT)} has {length} lines"
        for path, length in lengths.items()
        if length > MOST_LINES_OF_A_FILE
    ]
    assert offenders == []
