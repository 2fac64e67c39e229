"""The public Python interface, which docs/stability.md is about: a record of it, and the stub that type checkers read.

    python scripts/public_api.py

The record is ``tests/snapshots/public-api.txt``, so that a change of a name or a signature is read in review;
annotations and defaults stand as in the source, so that the text is the same under every version of Python and NumPy.
The stub is ``src/ppafo/__init__.pyi``, made of the table of the package. A test compares both with the package.
"""

import ast
import inspect
import json
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import ppafo

FILE = Path(__file__).parents[1] / "tests" / "snapshots" / "public-api.txt"
WIDTH = 100
STUB = Path(__file__).parents[1] / "src" / "ppafo" / "__init__.pyi"
HEAD = "# The public Python interface of ppafo: classes, functions, errors; written by scripts/public_api.py"


def declaration(value: Any) -> ast.stmt:
    """The statement of the source that defines a class or function."""
    return ast.parse(textwrap.dedent(inspect.getsource(value))).body[0]


def parameters(given: ast.arguments) -> Iterator[str]:
    """Each parameter with its annotation and default, as they are written."""
    gaps = len(given.args) - len(given.defaults)
    defaults: list[ast.expr | None] = [None] * gaps
    pairs = [*zip(given.args, [*defaults, *given.defaults], strict=True)]
    named = [*zip(given.kwonlyargs, given.kw_defaults, strict=True)]
    star = given.vararg.arg if given.vararg else ""
    for parameter, default in [*pairs, *([(ast.arg(f"*{star}"), None)] if named or star else []), *named]:
        yield ast.unparse(parameter) + (f" = {ast.unparse(default)}" if default is not None else "")


def signature(function: ast.FunctionDef) -> str:
    """Name, parameters and result of a function, over several lines where one is too long; a property has none."""
    result = "" if function.returns is None else f" -> {ast.unparse(function.returns)}"
    if any("property" in ast.unparse(decorator) for decorator in function.decorator_list):
        return f"{function.name}{result}"
    given = list(parameters(function.args))
    line = f"{function.name}({', '.join(given)}){result}"
    return line if len(line) <= WIDTH else "\n    ".join([f"{function.name}(", *given]) + f"\n){result}"


def members(kind: type) -> Iterator[str]:
    """Lines of the public fields and methods of a class, those of its ancestors in the package after its own."""
    for owner in kind.__mro__:
        if not owner.__module__.startswith("ppafo"):
            continue
        statement = declaration(owner)
        assert isinstance(statement, ast.ClassDef)
        for node in statement.body:
            if isinstance(node, ast.AnnAssign) and not ast.unparse(node.target).startswith("_"):
                yield ast.unparse(node)
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                yield signature(node)
            if isinstance(node, ast.Assign) and not ast.unparse(node.targets[0]).startswith("_"):
                # A method that several results share is a function of a module.
                name = ast.unparse(node.targets[0])
                shared = declaration(vars(owner)[name])
                assert isinstance(shared, ast.FunctionDef)
                shared.name = name
                yield signature(shared)


def lines_of(name: str, value: Any) -> Iterator[str]:
    """The lines of one public name."""
    if not inspect.isclass(value):
        statement = declaration(value)
        assert isinstance(statement, ast.FunctionDef)
        yield signature(statement)
        return
    bases = ", ".join(base.__name__ for base in value.__bases__ if base not in {object, tuple})
    yield f"class {name}({bases})" if bases else f"class {name}"
    yield from (textwrap.indent(line, "    ") for line in dict.fromkeys(members(value)))


def public_api() -> str:
    """The whole interface, by name; what the package lists in ``__all__`` and nothing else."""
    blocks = ("\n".join(lines_of(name, getattr(ppafo, name))) for name in sorted(ppafo.__all__))
    return "\n\n".join([HEAD, *blocks]) + "\n"


def stub() -> str:
    """The imports of all public names, which the package itself makes when a name is first used."""
    table = {**vars(ppafo)["_HOMES"], "ppafo.version": ("__version__",)}
    imports = [f"from {home} import {name} as {name}" for home in sorted(table) for name in sorted(table[home])]
    names = [f"    {json.dumps(name)}," for name in ppafo.__all__]
    return "\n".join(["# Written by scripts/public_api.py", "", *imports, "", "__all__ = [", *names, "]"]) + "\n"


if __name__ == "__main__":
    FILE.write_text(public_api(), encoding="utf-8")
    STUB.write_text(stub(), encoding="utf-8")
