"""A program built from its C by a compiler of this machine; it does what Python does with the composed text.

Handing an array to C costs Python about a microsecond, a number a twentieth of that. So the arrays of an entry are
packed into one block of memory, once where they stay the same.
"""

import ctypes
import hashlib
import importlib.util
import platform
import struct
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from shutil import which
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.compilers import FLAGS, CompilerError
from ppafo.engine.lane_rows import COMPILED, lanes_of
from ppafo.engine.lanes import Batch, BatchResult, LaneBlock, join_results
from ppafo.engine.loading import HOW_TO_INSTALL, WITHOUT_C
from ppafo.errors import SimulationError, one_line, reason
from ppafo.translation.value_types import FLOAT, INT, LIBRARY, Array, Scalar, Type, entries_of

Entries = Mapping[str, tuple[Type, ...]]
"""Types of the parameters of entries, by name."""

_PACKED = "_packed"
_ROUNDING = """\
int ppafo_rounds_as_written(double a, double b, double c, double d);
int ppafo_rounds_as_written(double a, double b, double c, double d)
{
#if defined(__x86_64__)
    /* Start-up code of unsafe arithmetic flushes small numbers of the whole thread to zero: undo that. */
    const unsigned int control = __builtin_ia32_stmxcsr();
    if ((control & 0x8040u) != 0u) {
        __builtin_ia32_ldmxcsr(control & ~0x8040u);
        return 0;
    }
#endif
    return a * b + c == 0.0 && (b + d) - b == 0.0;
}
"""
"""1 where each operation is rounded by itself; fused or reordered ones leave a rest of what `load_entries` gives."""
_NOTHING, _FLOATS = ctypes.c_double * 0, np.dtype(np.float64)
_NUMBERS: dict[Scalar, Any] = {FLOAT: ctypes.c_double, INT: ctypes.c_int64}


@dataclass(frozen=True, slots=True)
class NativeEntry:
    """An entry of a library, called as Python calls it: arrays, then numbers.

    ``function`` takes its arrays, of these dimensions, one after another as ``layout`` writes each ``ppafo_array``.
    """

    function: Any
    dimensions: tuple[int, ...]
    layout: struct.Struct

    def __call__(self, *arguments: Any) -> None:
        """Call it with arrays, and the numbers that follow them."""
        count = len(self.dimensions)
        self.function(self._packed(arguments[:count]), *arguments[count:])

    def with_arrays(self, *arrays: NDArray[np.float64]) -> Callable[..., None]:
        """The entry as a function of what follows these arrays, which it keeps.

        TypeError for what C would misread: arrays of other numbers or dimensions, or that lie otherwise in memory.
        """
        called: partial[None] = partial(self.function, self._packed(arrays))
        called.arrays = arrays  # type: ignore[attr-defined]
        return called

    def _packed(self, arrays: Sequence[Any]) -> bytes:
        numbers: list[int] = []
        for array, dimensions in zip(arrays, self.dimensions, strict=True):
            if array.dtype != _FLOATS or array.ndim != dimensions:
                problem = f"not one of {array.dtype} {array.shape}"
                raise TypeError(f"an array of floats in {dimensions} dimensions is needed, {problem}")
            # Refuses what is read-only, or does not lie row after row.
            numbers.append(ctypes.addressof(_NOTHING.from_buffer(array)))
            numbers += array.shape
        return self.layout.pack(*numbers)


def with_packed_entries(source: str, entries: Entries) -> str:
    """A translation unit that shows nothing but entries, which take their arrays one after another.

    All else is of the file alone. A call of ``advance`` that other libraries see would be one of what the C library of
    GNU has under this name.
    """
    texts = ["#define PPAFO_ENTRY static", source]
    for name, types in entries.items():
        arrays = [kind for kind in types if isinstance(kind, Array)]
        numbers = {
            f"number_{number}": "double" if kind == FLOAT else "int64_t"
            for number, kind in enumerate(types[len(arrays) :])
        }
        taken = ", ".join(["const ppafo_array *arrays", *(f"{kind} {number}" for number, kind in numbers.items())])
        packed = ", ".join([*(f"arrays[{number}]" for number in range(len(arrays))), *numbers])
        texts.append(f"void {name}{_PACKED}({taken})\n{{\n    {name}({packed});\n}}\n")
    return "\n".join([*texts, _ROUNDING])


def load_entries(library: Path, entries: Entries) -> dict[str, NativeEntry]:
    """Return the entries of a library by name.

    OSError where it cannot be loaded, AttributeError where it lacks one, CompilerError where its arithmetic is not
    IEEE 754's; an environment variable or a wrapper can make any compiler leave it.
    """
    loaded = ctypes.CDLL(str(library))
    # (1 + 2^-30)(1 - 2^-30) - 1 rounds to 0 where the product is rounded by itself, and to -2^-60 where it is fused.
    small = 2.0**-30
    numbers = map(ctypes.c_double, (1.0 + small, 1.0 - small, -1.0, small * small))
    # One product tells whether the compiler fuses or reorders, whatever its flags were.
    if not loaded.ppafo_rounds_as_written(*numbers):
        raise CompilerError(
            "the compiler joins or reorders sums and products, so that results would differ from other compilers' "
            "(look for -ffp-contract or -ffast-math in its wrapper or in the environment)"
        )
    found = {}
    for name, types in entries.items():
        function = loaded[f"{name}{_PACKED}"]
        function.restype = None
        function.argtypes = [ctypes.c_void_p, *(_NUMBERS[kind] for kind in types if isinstance(kind, Scalar))]
        # An array is a pointer and its extents; the rest of three extents is padding.
        dimensions = tuple(kind.dimensions for kind in types if isinstance(kind, Array))
        layout = struct.Struct("".join(f"P{count}q{8 * (3 - count)}x" for count in dimensions))
        found[name] = NativeEntry(function, dimensions, layout)
    return found


FOR_GCC = ("-fno-thread-jumps", "-fno-ssa-phiopt", "-fno-tree-pre", "--param", "sra-max-scalarization-size-Ospeed=4096")
"""What lets gcc take lanes side by side: without them it makes jumps of choices first. The bits stay as they are."""
_LIBRARY_AS_IT_RUNS = tuple(f"-fno-builtin-{name}" for name in sorted(LIBRARY))
"""Else a compiler works out what it can by itself, to other last bits than the library's, which Python calls."""
_THIS_PROCESSOR = "-march=native" if platform.machine().lower() in ("x86_64", "amd64", "i686") else "-mcpu=native"
_WIDEST_VECTORS = ("-mprefer-vector-width=512",) if _THIS_PROCESSOR.startswith("-march") else ()
_LIBRARY_FILE = {"win32": "program.dll", "darwin": "program.dylib"}.get(sys.platform, "program.so")
COMPILERS = ("gcc", "clang", "zig")
"""In the order of preference: most lanes are about as quick by each, a slow valve takes four times as long by the last
two."""
_LANE_LOOP = entries_of(f"{COMPILED}\ndef advance(")
_TITLE = "Generated from the functions of ppafo. Not to be edited."


@dataclass(frozen=True, slots=True)
class CCompiler:
    """A compiler of C of this machine, as the engine takes one: its name, the command that runs it."""

    name: str
    command: tuple[str, ...]

    @property
    def seconds_per_byte(self) -> float:
        """What a common computer takes for a byte of the composed text [s]."""
        return 2.0e-5

    @property
    def flags(self) -> tuple[str, ...]:
        """Flags for the bits, and for this processor."""
        return (
            *FLAGS,
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
        said = next(iter(answer.splitlines()), "")
        return f"C by {self.name}: {said}" if said else f"C by {self.name}"

    def compile_text(self, source: str, path: str, module: ModuleType) -> None:
        """Take a composed text to C and compile it; the library stays beside ``path`` where that is a place."""
        from ppafo.translation.compiling import compile_library  # most programs are there

        translated = translated_text(source)
        if Path(path).is_absolute():
            compile_library(translated, Path(path).with_name(_LIBRARY_FILE), self.command, self.flags)
            self.run_text(source, path, module)
            return
        try:
            # A loaded library may be removed on Unix; on Windows its file stays until the process ends.
            with tempfile.TemporaryDirectory(prefix="ppafo-", ignore_cleanup_errors=True) as folder:
                library = Path(folder) / _LIBRARY_FILE
                compile_library(translated, library, self.command, self.flags)
                _fill(module, library, entries_of(source))
        except OSError as error:
            problem = f"what {self.name} makes cannot be kept for an instant: {reason(error)}"
            raise CompilerError(problem, passing=True) from error

    def run_text(self, source: str, path: str, module: ModuleType) -> None:
        """Load the library beside ``path``."""
        _fill(module, Path(path).with_name(_LIBRARY_FILE), entries_of(source))


def compiler(name: str) -> CCompiler:
    """Return a compiler of C by name, one of ``COMPILERS``; SimulationError where it is not on this computer."""
    command = _command(name)
    if not command:
        raise SimulationError(f"PPAFO_BACKEND={name}: '{name}' is not on this computer: {HOW_TO_INSTALL}; {WITHOUT_C}")
    return CCompiler(name, command)


def _command(name: str) -> tuple[str, ...]:
    """The command of a compiler; empty where it is not on this machine."""
    if name != "zig":
        compiler = which(name)
        return (compiler,) if compiler else ()
    # The package brings a compiler of one version; a zig on the path is whatever the user has.
    package = importlib.util.find_spec("ziglang")
    if package is not None and package.origin is not None:
        return (str(Path(package.origin).with_name("zig.exe" if sys.platform == "win32" else "zig")), "cc")
    compiler = which("zig")
    return (compiler, "cc") if compiler else ()


@cache
def _file_identity(command: str) -> tuple[str, int, int]:
    """Where a compiler's file is, its size and its time: an update changes them, and no process need be started."""
    file = Path(command).resolve()
    try:
        status = file.stat()
    except OSError:
        return str(file), 0, 0
    return str(file), status.st_size, status.st_mtime_ns


@cache
def described_processor() -> str:
    """What the processor can do, as the system says it."""
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


def translated_text(source: str) -> str:
    """The C of a composed text; ProgramError for what has none."""
    # A model that is kept from earlier is loaded without the translator.
    from ppafo.translation.c99 import c_source
    from ppafo.translation.walk import walk_module

    return with_packed_entries(c_source(walk_module(source, library=LIBRARY), {}, _TITLE), entries_of(source))


def build(
    source: str,
    folder: Path,
    command: Sequence[str] = ("gcc",),
    flags: Sequence[str] = FLAGS,
    entries: Entries = _LANE_LOOP,
) -> ModuleType:
    """Compile C into a library in ``folder`` and load its entries, by themselves the ``advance`` of a lane loop.

    CompilerError where the compiler refuses it.
    """
    from ppafo.translation.compiling import compile_library

    library = folder / _LIBRARY_FILE
    compile_library(with_packed_entries(source, entries), library, command, flags)
    module = ModuleType(library.stem)
    _fill(module, library, entries)
    return module


def _fill(module: ModuleType, library: Path, entries: Entries) -> None:
    """Give a module the entries of a library."""
    try:
        module.__dict__.update(load_entries(library, entries))
    except OSError as error:
        raise CompilerError(f"the library of a compiled model cannot be loaded: {one_line(error)}") from error
    except AttributeError:
        raise CompilerError("the library of a compiled model lacks its functions") from None


def run_native(program: ModuleType, batch: Batch) -> BatchResult:
    """Results of a batch, block after block, on this thread."""
    runs, lanes = batch.states.shape[1], lanes_of(batch.program)
    results = []
    for first in range(0, runs, lanes):
        own = slice(first, min(first + lanes, runs))
        block = LaneBlock(program, batch.program, batch.clock, batch.parameters[:, own], batch.states[:, own])
        block.advance(batch.clock.step_count)
        results.append(block.result())
    return join_results(results)
