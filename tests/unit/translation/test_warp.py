"""Programs as kernels of NVIDIA Warp: the same bits, by lanes or a thread for each run; one line where it is absent.

What Warp is given is C++, which a compiler of this machine takes too: so the text, and how the engine hands it many
runs at once, are tested where there is no Warp.
"""

import ctypes
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from ppafo.engine import compilers
from ppafo.engine.cache import list_programs
from ppafo.engine.lanes import Batch, load_program, load_source, run_batch, write_source
from ppafo.engine.metering import add_meters
from ppafo.engine.run import batch_of
from ppafo.errors import SimulationError
from ppafo.metrics import METRICS
from ppafo.questions.bits.runs import digest, drawn_batch, failures, plain_batch
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.translation import warp as by_warp
from ppafo.translation.native import translated_text

needs_warp = pytest.mark.skipif(find_spec("warp") is None, reason="needs the extra 'warp'")
needs_gcc = pytest.mark.skipif(shutil.which("g++") is None, reason="no g++ on this machine")
RUNS_AT_ONCE = 64
FORMS = {
    "a block of lanes": by_warp.WarpCompiler("cpu", 0),
    "a thread for each run": by_warp.WarpCompiler("cpu", RUNS_AT_ONCE, "warpruns"),
}
SHORT = ["run.duration=20 ms"]
AROUND = """
#include <float.h>
#include <math.h>
#include <stdint.h>
#define CUDA_CALLABLE
template <typename T> struct array_of { T *data; int shape[4]; };
extern "C" void advance_run(array_of<double> states, array_of<double> parameters, array_of<double> signals,
    array_of<double> commands, array_of<double> record, array_of<double> trace, array_of<int64_t> counts,
    double interval, int run)
{
BODY
}
"""


class Values(ctypes.Structure):
    _fields_ = (("data", ctypes.c_void_p), ("shape", ctypes.c_int * 4))


def handed(array: Any) -> Values:
    return Values(array.ctypes.data, (ctypes.c_int * 4)(*array.shape, *(0,) * (4 - array.ndim)))


@dataclass(frozen=True)
class CppCompiler:
    """Takes the body of the kernel to g++, and runs it column by column, as threads of a graphics card would."""

    folder: Path
    name: str = "cpp"
    runs_at_once: int = RUNS_AT_ONCE
    seconds_per_byte: float = 1.0e-4

    def identity(self) -> str:
        return str(self.folder)

    def described(self) -> str:
        return self.name

    def compile_text(self, source: str, path: str, module: ModuleType) -> None:
        body = by_warp.native_text(translated_text(source))
        library = self.folder / f"{Path(path).stem}.so"
        line = [
            "g++",
            "-x",
            "c++",
            "-std=c++17",
            "-O1",
            "-ffp-contract=off",
            "-w",
            "-shared",
            "-fPIC",
            "-",
            "-o",
            library,
        ]
        subprocess.run(line, input=AROUND.replace("BODY", body), text=True, check=True)
        entry = ctypes.CDLL(str(library)).advance_run
        entry.restype = None

        def advance(*given: Any) -> None:
            arrays, numbers = given[:6], list(given[6:])
            interval = numbers.pop(4)
            counts = np.array(numbers, np.int64)
            for run in range(arrays[4].shape[2]):
                entry(*map(handed, arrays), handed(counts), ctypes.c_double(interval), ctypes.c_int(run))

        module.__dict__["advance"] = advance

    run_text = compile_text


def recorded() -> Batch:
    """A short torque task of both solenoids, recorded."""
    return batch_of(plan_run(load_scenario("torque-task-solenoid", SHORT)))


def metered() -> Batch:
    """Drawn torque tasks with every meter and a trace of the angle."""
    batch = batch_of(plan_run(load_scenario("torque-task-proportional", SHORT)))
    meters = {meter.name: meter for kind in METRICS.values() for meter in kind.meters}
    drawn = drawn_batch(batch, 100)
    kept = Batch(batch.program, batch.clock, drawn.parameters, drawn.states)
    return add_meters(kept, tuple(meters.values()), ("angle",), trace_every=2)


BATCHES = {
    "recorded": recorded,
    "metered": metered,
    "drawn": lambda: drawn_batch(plain_batch("torque-task-proportional"), 300),
    "noisy": lambda: drawn_batch(plain_batch("noisy-sensors"), 100),
    "walk": lambda: drawn_batch(plain_batch("proportional"), 20),
}


def bits_by(compiler: Any, batch: Batch, monkeypatch: pytest.MonkeyPatch, threads: int = 2) -> str:
    """The hash of a batch, compiled by one that is offered for this test; None for Numba."""
    if compiler is not None:
        monkeypatch.setitem(compilers._OFFERED, compiler.name, lambda: compiler)
    monkeypatch.setenv("PPAFO_BACKEND", "numba" if compiler is None else compiler.name)
    load_source.cache_clear()
    return digest(run_batch(batch, threads))


def forget_programs(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a new process."""
    for name in [item for item in sys.modules if re.match("ppafo_(warp|cpp)", item)]:
        monkeypatch.delitem(sys.modules, name)


@needs_gcc
@pytest.mark.parametrize("kind", ["recorded", "metered", "drawn"])
def test_what_a_card_is_given_has_the_bits_of_the_lanes_run_by_run(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PPAFO_CACHE_DIR", str(tmp_path / "cache"))
    forget_programs(monkeypatch)
    batch = BATCHES[kind]()
    found = bits_by(CppCompiler(tmp_path), batch, monkeypatch)
    monkeypatch.undo()
    assert found == bits_by(None, batch, monkeypatch)


@needs_warp
@pytest.mark.parametrize("kind", BATCHES)
@pytest.mark.parametrize("form", FORMS)
def test_warp_and_numba_give_the_same_bits(form: str, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    batch = BATCHES[kind]()
    expected = bits_by(None, batch, monkeypatch)
    assert bits_by(FORMS[form], batch, monkeypatch) == expected


@needs_warp
@pytest.mark.skipif(not by_warp.has_card(), reason="no graphics card that Warp can use")
@pytest.mark.parametrize("kind", BATCHES)
def test_a_graphics_card_and_numba_give_the_same_bits(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    batch = BATCHES[kind]()
    expected = bits_by(None, batch, monkeypatch)
    assert bits_by(by_warp.compiler(), batch, monkeypatch) == expected


def test_some_of_the_draws_fail_so_that_failures_are_compared_too() -> None:
    assert 0 < failures(run_batch(BATCHES["drawn"]())) < 300


@needs_warp
def test_a_kernel_is_kept_and_found_again(fresh_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import warp

    forget_programs(monkeypatch)
    compiler = FORMS["a block of lanes"]
    batch = recorded()
    expected = bits_by(compiler, batch, monkeypatch)
    (kept,) = list_programs(fresh_cache)
    assert kept.place.name.startswith("ppafo_warp_")
    assert list(kept.place.glob("*.o"))
    forget_programs(monkeypatch)
    monkeypatch.delattr(warp, "compile_aot_module")
    assert bits_by(compiler, batch, monkeypatch) == expected


@needs_warp
def test_without_a_folder_for_it_a_kernel_runs_all_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compiler, batch = FORMS["a block of lanes"], recorded()
    expected = bits_by(compiler, batch, monkeypatch)
    (tmp_path / "file").touch()
    monkeypatch.setenv("PPAFO_CACHE_DIR", str(tmp_path / "file"))
    forget_programs(monkeypatch)
    assert bits_by(compiler, batch, monkeypatch) == expected


@needs_warp
@pytest.mark.parametrize("kind", ["recorded", "walk"])
def test_the_instructions_of_a_card_are_rounded_one_by_one(kind: str, tmp_path: Path) -> None:
    import warp

    if not warp.is_cuda_available() and sys.platform == "darwin":
        pytest.skip("Warp for macOS compiles nothing for graphics cards")
    source = write_source(BATCHES[kind]().program, 1)[1]
    kernel = by_warp._kernel(by_warp.native_text(translated_text(source)), f"for_a_card_{kind}", by_warp.OPTIONS)
    (made,) = warp.compile_aot_module(kernel.module, arch=90, module_dir=tmp_path, use_ptx=True, strip_hash=True)
    found = re.findall(r"\b((?:add|sub|mul|div|rcp|sqrt|fma|mad)\b\S*\.f64)", made.read_text(encoding="latin-1"))
    assert {"mul.rn.f64", "add.rn.f64", "div.rn.f64", "sqrt.rn.f64"} <= set(found)
    assert set(found) <= {f"{name}.rn.f64" for name in ("add", "sub", "mul", "div", "rcp", "sqrt")}


def test_a_computer_without_warp_is_told_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(by_warp, "has_warp", lambda: False)
    monkeypatch.setenv("PPAFO_BACKEND", "warp")
    with pytest.raises(SimulationError, match=r"NVIDIA Warp is not.*ppafo\[warp\].*=numba needs no Warp"):
        load_program(recorded().program)
