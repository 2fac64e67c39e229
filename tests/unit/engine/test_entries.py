"""Entries of generated modules: the same calls and bits by every compiler, and nothing that C would misread."""

import ast
import inspect
import textwrap
from collections.abc import Callable, Iterable
from typing import Annotated, Any, TypeAlias, get_type_hints

import numpy as np
import pytest
from numpy.typing import NDArray

from ppafo.engine.entries import (
    ARRAY,
    FLOAT,
    HEADER,
    INT,
    entry_text,
)
from tests.compilers_here import modules_of

ARRAY_2D = "float64[:, ::1]"

Vector: TypeAlias = Annotated[NDArray[np.float64], ARRAY]
"""Numbers in a row, as a parameter of a function for ``array_module``."""
Table: TypeAlias = Annotated[NDArray[np.float64], ARRAY_2D]
"""Numbers in rows, the last index running quickest."""


def array_module(functions: Iterable[Callable[..., None]]) -> str:
    """Text of a module with these functions as its entries: each goes through its arrays and calls only ``math``.

    Their parameters are annotated as ``Vector``, ``Table``, ``float`` or ``int``.
    """
    plain: dict[Any, str] = {float: FLOAT, int: INT}
    entries = []
    for function in functions:
        hints = get_type_hints(function, include_extras=True)
        types = {name: plain.get(hint) or hint.__metadata__[0] for name, hint in hints.items() if name != "return"}
        (tree,) = ast.parse(textwrap.dedent(inspect.getsource(function))).body
        assert isinstance(tree, ast.FunctionDef)
        body = tree.body[1:] if ast.get_docstring(tree) is not None else tree.body
        lines = [line for item in body for line in ast.unparse(item).split("\n")]
        entries.append(entry_text(function.__name__, types, lines))
    return "\n\n".join([HEADER, *entries])


def scaled(rows: Table, found: Vector, factor: float, first: int) -> None:
    """Sums of the rows from ``first`` on, each times a factor."""
    for row in range(first, rows.shape[0]):
        total = 0.0
        for column in range(rows.shape[1]):
            total += rows[row, column]
        found[row] = factor * total


def test_every_compiler_has_all_entries_of_a_module() -> None:
    rows, expected = np.arange(6.0).reshape(3, 2), np.zeros(3)
    scaled(rows, expected, 0.5, 1)
    for name, module in modules_of(array_module([scaled])).items():
        found = np.zeros(3)
        for first in (1, 2):
            module.scaled(rows, found, 0.5, first)
        assert found.tolist() == expected.tolist(), name


@pytest.mark.parametrize(
    "wrong",
    [
        np.ones((2, 3), dtype=np.float32),
        np.ones(6),
        np.ones((3, 2)).T,
        np.ones((2, 6))[:, ::2],
        np.broadcast_to(np.ones(3), (2, 3)),
    ],
    ids=["other numbers", "other dimensions", "columns first", "with gaps", "read-only"],
)
def test_an_array_that_c_would_misread_is_refused(wrong: Any) -> None:
    for module in modules_of(array_module([scaled])).values():
        with pytest.raises(TypeError):
            module.scaled(wrong, np.zeros(3), 1.0, 0)
