"""Entries of composed texts: functions called from Python, with arrays and numbers as arguments and no return value.

A text is Python with two decorators: ``@entry`` declares the parameter types of a function, ``@inline`` marks functions
called by entries. Every compiler reads the decorators; for Python itself they do nothing.
"""

import ast
import threading
from collections.abc import Callable, Iterable, Mapping
from copy import deepcopy
from itertools import pairwise
from typing import Any, TypeVar

PARSING = threading.RLock()
"""Lock for creating syntax trees: Python 3.11 has one recursion depth for the trees of all threads, and raises
SystemError if the garbage collector lets a second thread parse before the first is done (CPython issue 106905).
"""

Node = TypeVar("Node", bound=ast.AST)

FLOAT = "float64"
INT = "int64"
ARRAY = "float64[::1]"

HEADER = '''"""Generated from the functions of ppafo; their hash is in the file name. Not to be edited."""

import math
from collections import namedtuple
'''
"""First lines of a composed text."""
INLINE = "@inline"
"""Decorator of functions called by entries."""
ENTRY = '@entry("void({})")'
"""Decorator of an entry, with a placeholder for the parameter types."""

ORIGIN = "# origin"
"""Prefix of the comment before each function that gives its source file and lines."""

_MARK = "@entry("


def entry_text(name: str, parameters: Mapping[str, str], lines: Iterable[str]) -> str:
    """Return the text of an entry, from its parameter types in order and the lines of its body."""
    head = ENTRY.format(", ".join(parameters.values()))
    return "\n".join([head, f"def {name}({', '.join(parameters)}):", *indent(lines), ""])


def indent(lines: Iterable[str]) -> list[str]:
    """Return lines of Python, indented by one more level."""
    return [f"    {line}" for line in lines]


def parse_expression(text: str) -> ast.expr:
    """Return the syntax tree of an expression; only one thread parses at a time."""
    with PARSING:
        return ast.parse(text, mode="eval").body


class _Rewriting(ast.NodeTransformer):
    """Transformer that replaces each expression for which ``made`` returns another, the outermost first."""

    def __init__(self, made: Callable[[ast.expr], ast.expr | None]) -> None:
        self.made = made

    def visit(self, node: ast.AST) -> Any:
        found = self.made(node) if isinstance(node, ast.expr) else None
        return self.generic_visit(node) if found is None else found


def rewritten(node: Node, made: Callable[[ast.expr], ast.expr | None]) -> Node:
    """Return a copy of a syntax tree with each expression replaced for which ``made`` returns another."""
    tree: Node = _Rewriting(made).visit(deepcopy(node))
    return tree


def entry_types(source: str) -> dict[str, list[str]]:
    """Return the parameter types of all entries of a text, in order, by entry name."""
    types = {}
    for mark, head in pairwise(source.split("\n")):
        if mark.startswith(_MARK):
            # The mark holds a signature, which reads as a call: void(float64[:, ::1], int64).
            signature = ast.literal_eval(parse_expression(mark.removeprefix(_MARK).removesuffix(")")))
            call = parse_expression(signature)
            assert isinstance(call, ast.Call)
            types[head.removeprefix("def ").partition("(")[0]] = [ast.unparse(kind) for kind in call.args]
    return types


def without_origins(source: str) -> str:
    """Return the text without the source-position comments, that is, the part that determines the machine code."""
    return "\n".join(line for line in source.split("\n") if not line.startswith(ORIGIN))
