"""Syntax tree of a function from its source file, refused if Python runs different code."""

import ast
import inspect
import re
import textwrap
from collections.abc import Callable, Iterator
from functools import lru_cache
from types import CodeType, FunctionType, ModuleType
from typing import Any

from ppafo.engine.entries import PARSING
from ppafo.engine.plain_python import check_flow, check_grammar, parse_module, refusal
from ppafo.errors import ProgramError
from ppafo.wording import place

Adaptation = Callable[[FunctionType, ast.FunctionDef], ast.FunctionDef]
"""Function that converts the syntax tree of a definition to the compiled subset of Python."""


def emitted_name(item: Any) -> str:
    """Return the name of a function or NamedTuple class in the generated module: module path and own name."""
    module = item.__module__ or ""
    path = module.removeprefix("ppafo.") if module.startswith("ppafo.") else f"foreign.{module}"
    return re.sub(r"\W", "_", f"{path}_{item.__qualname__}")


def check_is_plain(function: Any) -> None:
    """Refuse all but plain functions, whose source text is the code that Python runs. ProgramError states why."""
    name = getattr(function, "__qualname__", None) or repr(function)
    if type(function) is not FunctionType:
        raise ProgramError(f"cannot compile {name}: it must be a plain function defined with 'def' in a .py file")
    if hasattr(function, "__wrapped__"):
        raise ProgramError(
            f"{place_of(function)}: '{name}' is wrapped by a decorator, which cannot be compiled; remove the decorator"
        )
    if function.__closure__:
        # A closure's value may change without a change of the function, and no text would show it.
        names = ", ".join(f"'{name}'" for name in function.__code__.co_freevars)
        raise ProgramError(
            f"{place_of(function)}: '{name}' uses {names} of the enclosing function; such variables cannot be "
            "compiled: pass them as parameters"
        )


def place_of(item: Any) -> str:
    """Return file and line of a function, or the module of any other object."""
    code = getattr(item, "__code__", None)
    return f"module {item.__module__}" if code is None else place(code.co_filename, code.co_firstlineno)


def parse_definition(function: FunctionType, adapt: Adaptation | None = None) -> ast.FunctionDef:
    """Return the definition of a plain function with the line numbers of its file.

    Raises ProgramError if the definition cannot be read or differs from the code that Python runs.
    """
    code = function.__code__
    file = code.co_filename
    name = function.__qualname__
    try:
        text = _source_text(function, code)
    except (OSError, TypeError) as error:
        raise ProgramError(f"cannot compile {name}: its source text is not available ({error})") from error
    try:
        tree: ast.stmt | None = parse_module("\n" * (code.co_firstlineno - 1) + text).body[0]
    except SyntaxError:
        tree = None
    if not isinstance(tree, ast.FunctionDef) or tree.name != code.co_name:
        raise refusal(file, code.co_firstlineno, f"'{name}' must be a plain function defined with 'def'")
    if tree.decorator_list:
        raise refusal(file, tree, f"'{name}' is decorated, which cannot be compiled; remove the decorator")
    adapted = tree if adapt is None else adapt(function, tree)
    check_grammar(adapted, file)
    if not _is_source_of(function, code, text):
        changed = "differs from its source text: the file changed after it was loaded; restart Python"
        raise refusal(file, code.co_firstlineno, f"'{name}' {changed}")
    check_flow(adapted, file, code.co_varnames)
    return adapted


# One function is a part of several programs of a session; reading its source takes longer than parsing it.
@lru_cache(maxsize=2048)
def _source_text(function: FunctionType, _code: CodeType) -> str:
    """Return the source text of a function with this code, without indentation; OSError if it is not available."""
    return textwrap.dedent(inspect.getsource(function))


@lru_cache(maxsize=2048)
def _is_source_of(function: FunctionType, code: CodeType, text: str) -> bool:
    """Return whether the code of a function is the bytecode of its source text."""
    modules = [name for name in code.co_names if isinstance(function.__globals__.get(name), ModuleType)]
    # Python compiles a call through a module name otherwise where it has seen the import.
    for imports in ([f"import {name}" for name in modules], []):
        with PARSING:
            module = compile("\n".join([*imports, text]), "<source>", "exec", dont_inherit=True)
        compiled = next(
            constant
            for constant in module.co_consts
            if isinstance(constant, CodeType) and constant.co_name == code.co_name
        )
        if _shape(compiled) == _shape(code):
            return True
    return False


def _shape(code: CodeType) -> tuple[Any, ...]:
    """Return the instructions of a code object, without line numbers and docstring."""
    # Texts are left out: a docstring may have changed without a change of what runs.
    constants = [(type(constant), repr(constant)) for constant in code.co_consts if not isinstance(constant, str)]
    return code.co_code, code.co_names, code.co_varnames, code.co_argcount, code.co_kwonlyargcount, constants


def source_lines(body: list[ast.stmt]) -> Iterator[int]:
    """Yield the source line number of each line that ``ast.unparse`` writes for some statements."""
    for statement in body:
        yield statement.lineno
        if isinstance(statement, ast.If | ast.For | ast.While):
            yield from source_lines(statement.body)
            otherwise = statement.orelse
            is_elif = isinstance(statement, ast.If) and len(otherwise) == 1 and isinstance(otherwise[0], ast.If)
            if otherwise and not is_elif:
                yield otherwise[0].lineno
            yield from source_lines(otherwise)
