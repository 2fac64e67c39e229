"""A program as a kernel of NVIDIA Warp, for graphics cards and, with the same bits, for the processor.

The kernel is made of the C of the program (``c99.py``), put into a function that Warp compiles as native code: so there
is no second text of what C99 says already, and no product is fused with a sum (``fuse_fp`` off). On a card each thread
takes one run, a column of the arrays; on the processor a call takes a block of lanes, as that of every other compiler.
"""

import importlib.util
import re
import tempfile
import threading
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ppafo.errors import SimulationError, one_line
from ppafo.translation.native import described_processor, translated_text, translator_hash

RUNS_ON_A_CARD = 32_768
"""Runs of one call on a graphics card: about as many threads as a large one holds at once."""
THREADS_OF_A_GROUP = 128
"""Threads that a card starts together; on the processor they are one."""
OPTIONS = {
    "fuse_fp": False,
    "fast_math": False,
    "enable_backward": False,
    "cpu_compiler_flags": "-march=native -fwrapv -Wno-pass-failed",
}
"""Options of a kernel's module: strict arithmetic, no adjoint, and the instructions of this processor."""
ARRAYS = {"states": 2, "parameters": 2, "signals": 3, "commands": 2, "record": 3, "trace": 3}
"""The arrays of ``advance`` and their axes."""
_COUNTS, _INTERVAL = 9, 4
"""Whole numbers of ``advance`` that follow, and the place among them of the one number that is none."""
_PROTOTYPE = re.compile(r"^PPAFO_ENTRY void advance\([^{;]*\);\n", re.MULTILINE)
"""A class has its functions once."""
_WORDS = """
#define PPAFO_INLINE static inline CUDA_CALLABLE
#define PPAFO_ENTRY static CUDA_CALLABLE
#if !defined(INT64_C)
#define INT64_C(value) value##LL
#endif
#if !defined(INT64_MIN)
#define INT64_MIN (-INT64_C(9223372036854775807) - 1)
#endif
"""
"""What the C finds in its headers otherwise; Warp has the rest of them itself."""
_OTHERWISE = "PPAFO_BACKEND=numba needs no Warp"
_CALLS = threading.Lock()
"""Warp is called by one thread at a time."""


@dataclass(frozen=True, slots=True)
class WarpCompiler:
    """Warp as the engine takes a compiler: for which device, and how many runs a call takes, 0 for a block of lanes."""

    device: str
    runs_at_once: int
    name: str = "warp"

    @property
    def seconds_per_byte(self) -> float:
        """What a common computer takes for a byte of the composed text [s]."""
        return 5.0e-5

    @property
    def options(self) -> dict[str, Any]:
        """Options of the module of a kernel."""
        # Where they differ from those of the launch, Warp would compile once more, into a folder of its own.
        return {**OPTIONS, "block_dim": 1 if self.device == "cpu" else THREADS_OF_A_GROUP}

    def identity(self) -> str:
        """Version of Warp, options, device, what the processor can do, and the translator itself."""
        return repr((self.described(), self.options, described_processor(), translator_hash()))

    def described(self) -> str:
        """Its version and where it runs."""
        warp = _warp()
        found = warp.get_device(self.device)
        where = f"{found.name} ({self.device}, compute capability {found.arch})" if found.is_cuda else "the processor"
        return f"Warp {warp.__version__} on {where}"

    def compile_text(self, source: str, path: str, module: ModuleType) -> None:
        """Compile the kernel of a composed text; it stays beside ``path`` where that is a place."""
        if Path(path).is_absolute():
            self._compile(source, Path(path).parent, module)
            return
        with tempfile.TemporaryDirectory(prefix="ppafo-", ignore_cleanup_errors=True) as folder:
            self._compile(source, Path(folder), module)

    def run_text(self, source: str, path: str, module: ModuleType) -> None:
        """Load the kernel beside ``path``."""
        kernel = _kernel(native_text(translated_text(source)), module.__name__, self.options)
        self._load(kernel, Path(path).parent, module)

    def _compile(self, source: str, folder: Path, module: ModuleType) -> None:
        kernel = _kernel(native_text(translated_text(source)), module.__name__, self.options)
        with _CALLS:
            _warp().compile_aot_module(kernel.module, device=self.device, module_dir=folder, strip_hash=True)
        self._load(kernel, folder, module)

    def _load(self, kernel: Any, folder: Path, module: ModuleType) -> None:
        with _CALLS:
            _warp().load_aot_module(kernel.module, device=self.device, module_dir=folder, strip_hash=True)
        module.__dict__["advance"] = lambda *given: self._advance(kernel, given)

    def _advance(self, kernel: Any, given: tuple[Any, ...]) -> None:
        """What the ``advance`` of every compiled program does, on the device."""
        warp, own, numbers = _warp(), given[: len(ARRAYS)], list(given[len(ARRAYS) :])
        interval = numbers.pop(_INTERVAL)
        threads = own[list(ARRAYS).index("record")].shape[2] if self.runs_at_once else 1
        is_shared = self.device == "cpu"
        try:
            with _CALLS:
                handed = [warp.array(item, dtype=warp.float64, device=self.device, copy=not is_shared) for item in own]
                counts = warp.array(np.array(numbers, np.int64), dtype=warp.int64, device=self.device)
                inputs, group = [*handed, counts, interval], self.options["block_dim"]
                warp.launch(kernel, dim=threads, inputs=inputs, device=self.device, block_dim=group)
                for item, on_device in [] if is_shared else zip(own, handed, strict=True):
                    item[...] = on_device.numpy()
        except RuntimeError as error:
            raise SimulationError(f"Warp cannot run on {self.device}: {one_line(error)}; {_OTHERWISE}") from None


def compiler() -> WarpCompiler:
    """Return Warp for the first graphics card that it can use, for the processor where there is none.

    SimulationError where Warp is not installed.
    """
    _warp()
    return WarpCompiler("cuda:0", RUNS_ON_A_CARD) if has_card() else WarpCompiler("cpu", 0)


def has_warp() -> bool:
    """True where Warp is installed."""
    return importlib.util.find_spec("warp") is not None


def has_card() -> bool:
    """True where Warp is installed and has a graphics card."""
    return has_warp() and bool(_warp().is_cuda_available())


def native_text(translated: str) -> str:
    """The body of a native function of Warp, from a translation unit in C.

    Its arguments are the arrays of ``advance``, ``counts``, all whole numbers of ``advance`` in order, ``interval``,
    and ``run``, the column with which each array begins. A function has no place for functions but in a type of its
    own, which also keeps their names apart from those of Warp.
    """
    views = "".join(f"\n    {{{name}.data + run, {{{_extents(name, axes)}}}}}," for name, axes in ARRAYS.items())
    arrays = [f"arrays[{place}]" for place in range(len(ARRAYS))]
    counts = [f"counts.data[{place}]" for place in range(_COUNTS)]
    given = ", ".join([*arrays, *counts[:_INTERVAL], "interval", *counts[_INTERVAL:]])
    return (
        f"{_WORDS}struct ppafo_program {{\n{_PROTOTYPE.sub('', translated)}}};\n"
        f"const ppafo_program::ppafo_array arrays[] = {{{views}\n}};\n"
        f"ppafo_program::advance({given});\n"
    )


def _extents(name: str, axes: int) -> str:
    return ", ".join([*(f"{name}.shape[{axis}]" for axis in range(axes)), *["0"] * (3 - axes)])


def _kernel(text: str, name: str, options: dict[str, Any]) -> Any:
    """The kernel of a native function that runs a program, in a module of this name and these options."""
    import warp

    # The names are those of ARRAYS: Warp reads arguments from the text of a function.
    def advance(
        states: warp.array2d[warp.float64],
        parameters: warp.array2d[warp.float64],
        signals: warp.array3d[warp.float64],
        commands: warp.array2d[warp.float64],
        record: warp.array3d[warp.float64],
        trace: warp.array3d[warp.float64],
        counts: warp.array[warp.int64],
        interval: warp.float64,
        run: int,
    ) -> None: ...

    advance_run = warp.func_native(text)(advance)
    module = warp.get_module(name)
    module.options.update(options)

    def advance_all(
        states: warp.array2d[warp.float64],
        parameters: warp.array2d[warp.float64],
        signals: warp.array3d[warp.float64],
        commands: warp.array2d[warp.float64],
        record: warp.array3d[warp.float64],
        trace: warp.array3d[warp.float64],
        counts: warp.array[warp.int64],
        interval: warp.float64,
    ) -> None:
        advance_run(states, parameters, signals, commands, record, trace, counts, interval, warp.tid())

    return warp.kernel(module=module, enable_backward=False)(advance_all)


def _warp() -> Any:
    """Warp itself, which says nothing but errors."""
    if not has_warp():
        raise SimulationError(
            f"PPAFO_BACKEND=warp: NVIDIA Warp is not on this computer: pip install 'ppafo[warp]'; {_OTHERWISE}"
        )
    import warp

    warp.config.log_level = warp.LOG_ERROR
    return warp
