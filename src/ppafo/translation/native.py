"""C compilers of this computer: detection, command line, and identity for the cache key of compiled programs.

Compiled programs give results that are bit-identical to Python running the composed text.
"""

import hashlib
import importlib.util
import platform
import sys
import tempfile
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from shutil import which
from types import ModuleType

from ppafo.engine.compilers import FLAGS, LIBRARY, CompilerError, Effort
from ppafo.engine.loading import HOW_TO_INSTALL, WITHOUT_C
from ppafo.errors import SimulationError
from ppafo.translation.native_entries import fill_module, parameters_of
from ppafo.wording import reason

FOR_GCC = (
    *("-fno-thread-jumps", "-fno-ssa-phiopt", "-fno-tree-pre"),
    *("--param", "sra-max-scalarization-size-Ospeed=4096"),
    *("-fira-region=one", "--param", "max-combine-insns=2"),
)
"""Flags for gcc to vectorise loops over runs. The first four keep conditional expressions from becoming jumps. The
last two save a third of the time and two thirds of the memory for the largest programs. No flag changes results."""
_LIBRARY_AS_IT_RUNS = tuple(f"-fno-builtin-{name}" for name in sorted(LIBRARY))
"""Flags against constant folding of library calls, whose last bits may differ from the run-time library."""
_THIS_PROCESSOR = "-march=native" if platform.machine().lower() in ("x86_64", "amd64", "i686") else "-mcpu=native"
"""Flag of gcc and clang for the present processor; x86 and other architectures differ."""
_WIDEST_VECTORS = ("-mprefer-vector-width=512",) if _THIS_PROCESSOR.startswith("-march") else ()
LIBRARY_FILE = {"win32": "program.dll", "darwin": "program.dylib"}.get(sys.platform, "program.so")
"""File name of a compiled library on this operating system, next to its composed text."""


@dataclass(frozen=True, slots=True)
class CCompiler:
    """C compiler of this computer, with the compiler interface of the engine."""

    name: str
    command: tuple[str, ...]
    effort: Effort = Effort.FULL

    def with_effort(self, effort: Effort) -> "CCompiler":
        """Return the same compiler with another optimisation level."""
        return replace(self, effort=effort)

    @property
    def flags(self) -> tuple[str, ...]:
        """Compiler flags for reproducible arithmetic and the present processor."""
        return (
            *FLAGS,
            self.effort.value,
            *_LIBRARY_AS_IT_RUNS,
            _THIS_PROCESSOR,
            *_WIDEST_VECTORS,
            *(FOR_GCC if self.name == "gcc" else ()),
        )

    def identity(self) -> str:
        """Return the identity of compiler file, flags, processor features and translator, for cache keys."""
        return repr((_file_identity(self.command[0]), self.flags, described_processor(), translator_hash()))

    def compile_text(self, source: str, path: str, module: ModuleType) -> None:
        """Compile composed text through C into a module; the library is kept next to an absolute ``path``."""
        # Most programs are there: they are loaded without the translator.
        from ppafo.translation.compiling import compile_library
        from ppafo.translation.native_source import translated_text

        translated = translated_text(source)
        if Path(path).is_absolute():
            compile_library(translated, Path(path).with_name(LIBRARY_FILE), self.command, self.flags)
            self.run_text(source, path, module)
            return
        try:
            # A loaded library may be removed on Unix; on Windows its file stays until the process ends.
            with tempfile.TemporaryDirectory(prefix="ppafo-", ignore_cleanup_errors=True) as folder:
                library = Path(folder) / LIBRARY_FILE
                compile_library(translated, library, self.command, self.flags)
                fill_module(module, library, parameters_of(source))
        except OSError as error:
            problem = f"the output of {self.name} cannot be written to a temporary folder: {reason(error)}"
            raise CompilerError(problem) from error

    def run_text(self, source: str, path: str, module: ModuleType) -> None:
        """Load the library next to ``path`` and add its entries to the module."""
        fill_module(module, Path(path).with_name(LIBRARY_FILE), parameters_of(source))


def compiler(name: str) -> CCompiler:
    """Return the C compiler ``gcc``, ``clang`` or ``zig``. Raises SimulationError if it is not installed."""
    command = _command(name)
    if not command:
        raise SimulationError(f"PPAFO_BACKEND={name}: '{name}' is not installed: {HOW_TO_INSTALL}; {WITHOUT_C}")
    return CCompiler(name, command)


def _command(name: str) -> tuple[str, ...]:
    """Return the command line of a compiler; empty if not installed."""
    found = which(name)
    if name != "zig":
        return (found,) if found else ()
    # The package brings a compiler of one version; a zig on the path is whatever the user has.
    package = importlib.util.find_spec("ziglang")
    if package is not None and package.origin is not None:
        return (str(Path(package.origin).with_name("zig.exe" if sys.platform == "win32" else "zig")), "cc")
    return (found, "cc") if found else ()


@cache
def _file_identity(command: str) -> tuple[str, int, int]:
    """Return path, size and modification time of a compiler file, which change in an update."""
    file = Path(command).resolve()
    try:
        status = file.stat()
    except OSError:
        return str(file), 0, 0
    return str(file), status.st_size, status.st_mtime_ns


@cache
def described_processor() -> str:
    """Return the processor model as named by the operating system."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return f"{platform.machine()} {platform.processor()}"
    # Lines that say what the processor can do; its clock and its load change from run to run.
    wanted = ("model name", "flags", "Features", "CPU implementer", "CPU part", "isa")
    return "\n".join(sorted({line for line in lines if line.startswith(wanted)}))


@cache
def translator_hash() -> str:
    """Return the hash of the translator sources, a part of cache keys."""
    digest = hashlib.sha256()
    # Sorted: folders list their files in no order.
    for file in sorted(Path(__file__).parent.iterdir()):
        if file.suffix in (".py", ".h"):
            digest.update(file.read_bytes())
    return digest.hexdigest()
