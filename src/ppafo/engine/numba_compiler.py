"""Numba as a compiler of programs; their functions are compiled once in a process, however many programs call them.

Most of a program's functions occur in other programs too. Each is known by a hash of its text and of all that it
calls, so that what is shared is the same to the last bit; the hash is in its symbol, so that nothing else has its name.
"""

import ast
import contextlib
import gc
import hashlib
import importlib.util
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from ppafo.engine.plain_python import mistake, parse_module
from ppafo.engine.source_text import without_origins
from ppafo.errors import SimulationError, one_line

_LENGTH = 24
_SHARED: dict[str, Any] = {}
_ONE_AT_A_TIME = threading.RLock()
"""What is shared, and Numba's settings, belong to the whole process."""

_KEPT, _NOT_KEPT = "cache=True", "cache=False"


@dataclass(frozen=True, slots=True)
class NumbaCompiler:
    """Numba as the engine takes a compiler: it needs no other program on this computer."""

    name: str = "numba"
    seconds_per_byte: float = 2.5e-4

    def identity(self) -> str:
        """The processor, and the versions of Numba and of Python's own code."""
        return _identity()

    def described(self) -> str:
        """Its version, and LLVM's."""
        numba = _imported()
        import llvmlite.binding

        version = ".".join(map(str, llvmlite.binding.llvm_version_info))
        return f"Numba {numba.__version__} with LLVM {version}"

    def compile_text(self, source: str, path: str, module: ModuleType) -> None:
        """Run the text of a module that is to be compiled."""
        # A text that is not on disk has no folder in which Numba could keep its files.
        text = source if Path(path).is_absolute() else source.replace(_KEPT, _NOT_KEPT)
        _run_by_numba(text, path, module, _compile_text)

    def run_text(self, source: str, path: str, module: ModuleType) -> None:
        """Run the text of a module whose functions are found compiled beside it."""
        _run_by_numba(source, path, module, _run_text)


def numba_compiler() -> NumbaCompiler:
    """Return Numba; SimulationError where it is not installed."""
    if importlib.util.find_spec("numba") is None:
        raise SimulationError("Numba is not installed: pip install numba")
    return NumbaCompiler()


def _imported() -> ModuleType:
    """Import Numba; SimulationError where a setting of the user's own, in the environment or a file, stops it."""
    settings = "its settings: NUMBA_... in the environment, or .numba_config.yaml in the working folder"
    try:
        import numba
        from numba.core import config
    except _errors_of_settings() as error:
        raise SimulationError(f"Numba refuses {settings}: {one_line(error)}") from error
    if getattr(config, "DISABLE_JIT", 0):
        raise SimulationError(f"Numba compiles nothing, as DISABLE_JIT is set in {settings}")
    return numba


def _errors_of_settings() -> tuple[type[Exception], ...]:
    """What Numba raises at its import: its own error, and PyYAML's, with which it reads its file if it can."""
    yaml = sys.modules.get("yaml")
    return (ValueError,) if yaml is None else (ValueError, yaml.YAMLError)


@cache
def _identity() -> str:
    # Programs of another processor or version must not be taken for damaged ones.
    numba = _imported()
    from numba.core.registry import cpu_target

    processor = cpu_target.target_context.codegen().magic_tuple()
    return repr((processor, numba.__version__, sys.implementation.cache_tag))


def _run_by_numba(source: str, path: str, module: ModuleType, run: Callable[[str, str, ModuleType], None]) -> None:
    """Let Numba define what a text has, with its own files beside it; ProgramError for what it refuses."""
    from numba.core.errors import NumbaError

    try:
        with _ONE_AT_A_TIME, _numba_files_beside_source():
            if Path(path).is_absolute():
                # Where Numba cannot write it takes another folder, of which nobody knows what is in it: OSError
                # instead.
                folder = Path(path).parent / "__pycache__"
                folder.mkdir(mode=0o700, exist_ok=True)
                tempfile.TemporaryFile(dir=folder).close()
            run(source, path, module)
    except NumbaError as error:
        raise mistake(str(error), source) from None


def _run_text(source: str, path: str, module: ModuleType) -> None:
    exec(compile(source, path, "exec"), module.__dict__)


def _compile_text(source: str, path: str, module: ModuleType) -> None:
    from numba.core.errors import NumbaError

    before = dict(module.__dict__)
    is_collecting = gc.isenabled()
    gc.disable()  # a tenth of the time: the compiler makes much, and most of it goes without
    try:
        _run_with_shared(source, path, module)
    except NumbaError:
        # Once more and alone, so that the lines in the report are this program's.
        _SHARED.clear()
        module.__dict__.clear()
        module.__dict__.update(before)
        _run_text(source, path, module)
    finally:
        if is_collecting:
            gc.enable()


def _run_with_shared(source: str, path: str, module: ModuleType) -> None:
    """Run the text of a generated module in ``module``; what was defined before, with the same callees, is taken."""
    names = module.__dict__
    lines = source.split("\n")
    keys: dict[str, str] = {}
    body = parse_module(source, path).body
    imports = [node for node in body if isinstance(node, ast.Import | ast.ImportFrom)]
    for node in body:
        name = _shared_name(node)
        if not name:
            before = set(names)
            # With its imports, as when the whole is compiled: calls through a module have other bytecode without them,
            # and by the bytecode a kept program is found again.
            exec(compile(ast.Module([*imports, node], []), path, "exec"), names)
            is_alike = isinstance(node, ast.Import | ast.ImportFrom | ast.Assign)
            keys |= dict.fromkeys(set(names) - before, ast.unparse(node) if is_alike else path)
            continue
        used = {item.id: names[item.id] for item in ast.walk(node) if isinstance(item, ast.Name) and item.id in names}
        first = min([node.lineno, *(item.lineno for item in getattr(node, "decorator_list", ()))])
        text = without_origins("\n".join(lines[first - 1 : node.end_lineno]))
        described = "\n".join([text, *(f"{item} {keys.get(item, '')}" for item in sorted(used))])
        # Text and keys of all callees: equal only where the whole tree below a function is equal.
        key = hashlib.sha256(described.encode()).hexdigest()[:_LENGTH]
        if key not in _SHARED:
            scope = {"__name__": __name__, **used}
            exec(compile(ast.Module([node], []), path, "exec"), scope)
            made = scope[name]
            if isinstance(node, ast.FunctionDef):
                # Numba names machine code by this: two functions of one name must not share a symbol.
                made.py_func.__qualname__ = f"{name}_{key}"
            _SHARED[key] = made
        names[name], keys[name] = _SHARED[key], key


def _shared_name(node: ast.stmt) -> str:
    """Name of a function that other compiled ones call, or of a row; empty for what belongs to one program."""
    if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call) and isinstance(node.targets[0], ast.Name):
        return node.targets[0].id if ast.unparse(node.value.func) == "namedtuple" else ""
    if not isinstance(node, ast.FunctionDef) or len(node.decorator_list) != 1:
        return ""
    decorator = ast.unparse(node.decorator_list[0])
    # What is compiled for given types, or kept on disk, is a program's own.
    is_called = decorator == "njit" or (decorator.startswith("njit(") and "cache=" not in decorator)
    has_types = isinstance(node.decorator_list[0], ast.Call) and bool(node.decorator_list[0].args)
    return node.name if is_called and not has_types else ""


@contextlib.contextmanager
def _numba_files_beside_source() -> Iterator[None]:
    """Let Numba keep its files in the program's folder: nobody checks the files of ``NUMBA_CACHE_DIR``."""
    from numba.core import config

    others = {name: getattr(config, name) for name in ("CACHE_DIR", "CACHE_LOCATOR_CLASSES") if hasattr(config, name)}
    try:
        for name in others:
            setattr(config, name, "")
        yield
    finally:
        for name, value in others.items():
            setattr(config, name, value)
