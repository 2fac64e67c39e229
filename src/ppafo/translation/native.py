"""Compilers of C of this machine: how each is found and called, and what its programs depend on.

What they make does what Python does with the composed text, to the bit.
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
"""Flags by which gcc vectorises over lanes: without the first four it turns choices into jumps. With the last two it
needs two thirds of the time and a third of the memory for the largest programs. The bits stay the same."""
_LIBRARY_AS_IT_RUNS = tuple(f"-fno-builtin-{name}" for name in sorted(LIBRARY))
"""Flags against constant folding of library calls, whose last bits would differ from the library's."""
_THIS_PROCESSOR = "-march=native" if platform.machine().lower() in ("x86_64", "amd64", "i686") else "-mcpu=native"
"""gcc and clang name the processor that they run on by one flag on x86, by another one elsewhere."""
_WIDEST_VECTORS = ("-mprefer-vector-width=512",) if _THIS_PROCESSOR.startswith("-march") else ()
LIBRARY_FILE = {"win32": "program.dll", "darwin": "program.dylib"}.get(sys.platform, "program.so")
"""Name of a compiled library, beside its composed text, as this system loads it."""


@dataclass(frozen=True, slots=True)
class CCompiler:
    """A compiler of C of this machine, as the engine takes one: its name, the command that runs it."""

    name: str
    command: tuple[str, ...]
    effort: Effort = Effort.FULL

    def with_effort(self, effort: Effort) -> "CCompiler":
        """Return the same compiler with another optimisation of its programs."""
        return replace(self, effort=effort)

    @property
    def flags(self) -> tuple[str, ...]:
        """Flags for the bits, and for this processor."""
        return (
            *FLAGS,
            self.effort.value,
            *_LIBRARY_AS_IT_RUNS,
            _THIS_PROCESSOR,
            *_WIDEST_VECTORS,
            *(FOR_GCC if self.name == "gcc" else ()),
        )

    def identity(self) -> str:
        """The compiler's own file, flags, what the processor can do, and the translator itself."""
        return repr((_file_identity(self.command[0]), self.flags, described_processor(), translator_hash()))

    def described(self) -> str:
        """Name and version of the compiler, as it says them."""
        from ppafo.translation.compiling import LONGEST_ANSWER, asked  # a run asks no compiler

        try:
            answer = asked([*self.command, "--version"], limit=LONGEST_ANSWER).stdout
        except CompilerError as failure:
            answer = str(failure)
        version = next(iter(answer.splitlines()), "")
        return f"C by {self.name}: {version}" if version else f"C by {self.name}"

    def compile_text(self, source: str, path: str, module: ModuleType) -> None:
        """Take a composed text to C and compile it; the library stays beside ``path`` where that is a place."""
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
            raise CompilerError(problem, passing=True) from error

    def run_text(self, source: str, path: str, module: ModuleType) -> None:
        """Load the library beside ``path``."""
        fill_module(module, Path(path).with_name(LIBRARY_FILE), parameters_of(source))


def compiler(name: str) -> CCompiler:
    """Return a compiler of C by name, ``gcc``, ``clang`` or ``zig``; SimulationError where it is not here."""
    command = _command(name)
    if not command:
        raise SimulationError(f"PPAFO_BACKEND={name}: '{name}' is not on this computer: {HOW_TO_INSTALL}; {WITHOUT_C}")
    return CCompiler(name, command)


def _command(name: str) -> tuple[str, ...]:
    """The command of a compiler; empty where it is not on this machine."""
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
    """Path, size and time of a compiler's file: an update changes them, and no process need be started."""
    file = Path(command).resolve()
    try:
        status = file.stat()
    except OSError:
        return str(file), 0, 0
    return str(file), status.st_size, status.st_mtime_ns


@cache
def described_processor() -> str:
    """Description of the processor by the system."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return f"{platform.machine()} {platform.processor()}"
    # Lines that say what the processor can do; its clock and its load change from run to run.
    wanted = ("model name", "flags", "Features", "CPU implementer", "CPU part", "isa")
    return "\n".join(sorted({line for line in lines if line.startswith(wanted)}))


@cache
def translator_hash() -> str:
    """Hash of the translator: the same text may become other C in another version of it."""
    digest = hashlib.sha256()
    # Sorted: folders list their files in no order.
    for file in sorted(Path(__file__).parent.iterdir()):
        if file.suffix in (".py", ".h"):
            digest.update(file.read_bytes())
    return digest.hexdigest()
