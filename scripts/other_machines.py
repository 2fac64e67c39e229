"""Programs in C on machines that this one is not: built by zig, run under an emulator, their bits brought back.

A driver of a few lines reads what the lanes would hand over, block by block, and writes what came of it.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from shutil import which
from types import ModuleType
from typing import Any

import numpy as np

from ppafo.engine.compilers import FLAGS, Effort
from ppafo.engine.lanes import Batch, BatchResult
from ppafo.errors import SimulationError
from ppafo.translation.native import compiler
from scripts.built_programs import program_source, run_native

DRIVER = r"""
#include <stdio.h>
#include <stdlib.h>

static int64_t whole(FILE *file)
{
    int64_t value = 0;
    if (fread(&value, sizeof value, 1, file) != 1) exit(3);
    return value;
}

static size_t size_of(ppafo_array array) { return (size_t)(array.extent[0] * array.extent[1] * array.extent[2]); }

int main(int count, char **words)
{
    FILE *in = fopen(words[1], "rb"), *out = fopen(words[2], "wb");
    if (count != 3 || !in || !out) return 2;
    for (int64_t left = whole(in); left > 0; --left) {
        ppafo_array arrays[6];
        int64_t numbers[10];
        double interval;
        for (int place = 0; place < 6; ++place) {
            for (int axis = 0; axis < 3; ++axis) arrays[place].extent[axis] = whole(in);
            arrays[place].values = calloc(size_of(arrays[place]) + 1, sizeof(double));
        }
        for (int place = 0; place < 9; ++place) numbers[place] = whole(in);
        if (fread(&interval, sizeof interval, 1, in) != 1) return 3;
        for (int place = 0; place < 2; ++place) {
            size_t size = size_of(arrays[place]);
            if (fread(arrays[place].values, sizeof(double), size, in) != size) return 3;
        }
        ppafo_array flat[6];
        for (int place = 0; place < 6; ++place) {
            flat[place] = arrays[place];
            if (place == 0 || place == 1 || place == 3) flat[place].extent[2] = 0;
        }
        advance(flat[0], flat[1], flat[2], flat[3], flat[4], flat[5], numbers[0], numbers[1], numbers[2], numbers[3],
            interval, numbers[4], numbers[5], numbers[6], numbers[7], numbers[8]);
        for (int place = 0; place < 6; ++place) {
            if (place == 0 || place > 3) fwrite(arrays[place].values, sizeof(double), size_of(arrays[place]), out);
            free(arrays[place].values);
        }
    }
    return fclose(out) != 0;
}
"""
UNDER_NODE = """
import { readFile } from 'node:fs/promises';
import { WASI } from 'node:wasi';
const [program, folder] = process.argv.slice(2);
const wasi = new WASI({ version: 'preview1', args: ['program', '/in', '/out'], preopens: { '/': folder } });
const built = await WebAssembly.compile(await readFile(program));
const instance = await WebAssembly.instantiate(built, wasi.getImportObject());
process.exitCode = wasi.start(instance);
"""
_ARRAYS, _INTERVAL = 6, 10
"""Arrays that ``advance`` takes first, and the place of its one number that is no whole one."""


@dataclass(frozen=True, slots=True)
class OtherMachine:
    """A machine that an emulator of this one stands for: its name in zig, and the commands that run a program of it."""

    title: str
    target: tuple[str, ...]
    suffix: str
    commands: tuple[str, ...]

    def missing(self) -> str:
        """What is not on this machine; empty where all is."""
        absent = [] if any(map(which, self.commands)) else [self.commands[0]]
        try:
            compiler("zig")
        except SimulationError:
            absent.append("zig")
        return " and ".join(absent)

    def run(self, program: Path, folder: Path) -> None:
        """Run a program with the files in a folder."""
        emulator = next(filter(None, map(which, self.commands)))
        line = [emulator, str(program), str(folder / "in"), str(folder / "out")]
        if self.suffix == ".wasm":
            script = folder / "run.mjs"
            script.write_text(UNDER_NODE, encoding="utf-8")
            line = [emulator, "--no-warnings", str(script), str(program), str(folder)]
        subprocess.run(line, check=True, env={**os.environ, "WINEDEBUG": "-all"}, stdout=sys.stderr)


MACHINES = {
    "arm": OtherMachine(
        "64-bit ARM, emulated by qemu", ("-target", "aarch64-linux-musl", "-static"), "", ("qemu-aarch64",)
    ),
    "wasm": OtherMachine(
        "WebAssembly with vectors under node",
        ("-target", "wasm32-wasi", "-mcpu=generic+simd128+bulk_memory"),
        ".wasm",
        ("node",),
    ),
    "windows": OtherMachine("Windows under Wine", ("-target", "x86_64-windows-gnu"), ".exe", ("wine64", "wine")),
}


def on_other_machine(name: str, batch: Batch) -> Callable[[Batch], BatchResult]:
    """Return what runs batches of the program of one on another machine."""
    folder = tempfile.TemporaryDirectory(prefix="ppafo-bits-")
    machine = MACHINES[name]
    program = Path(folder.name) / f"program{machine.suffix}"
    source = program.with_name("program.c")
    source.write_text(program_source(batch.program) + DRIVER, encoding="utf-8")
    line = [*compiler("zig").command, *FLAGS, Effort.FULL.value, *machine.target, str(source), "-o", str(program)]
    subprocess.run(line, check=True, capture_output=True)

    def run(given: Batch) -> BatchResult:
        assert folder  # the program is there for as long as somebody may run it
        calls = _Calls()
        run_native(calls.module(calls.note), given)
        place = program.parent
        calls.write(place / "in")
        machine.run(program, place)
        calls.read(place / "out")
        return run_native(calls.module(calls.fill), given)

    return run


class _Calls:
    """What the lanes hand over to ``advance``, call by call, and what has to come back."""

    def __init__(self) -> None:
        self.given: list[tuple[Any, ...]] = []
        self.results: Iterator[Any] = iter(())

    def module(self, advance: Callable[..., None]) -> ModuleType:
        """Stand for a compiled program."""
        made = ModuleType("calls")
        made.__dict__["advance"] = advance
        return made

    def note(self, *given: Any) -> None:
        """Note a call."""
        self.given.append(tuple(item.copy() if isinstance(item, np.ndarray) else item for item in given))

    def fill(self, *given: Any) -> None:
        """Fill the arrays of a call with its results."""
        for array in _results(given):
            array[...] = next(self.results).reshape(array.shape)

    def write(self, file: Path) -> None:
        """Write all calls as the driver reads them."""
        with file.open("wb") as out:
            out.write(np.int64(len(self.given)).tobytes())
            for given in self.given:
                for array in given[:_ARRAYS]:
                    out.write(np.array([*array.shape, *(1,) * (3 - array.ndim)], np.int64).tobytes())
                numbers = [*given[_ARRAYS:_INTERVAL], *given[_INTERVAL + 1 :]]
                out.write(np.array(numbers, np.int64).tobytes() + np.float64(given[_INTERVAL]).tobytes())
                out.write(given[0].tobytes() + given[1].tobytes())

    def read(self, file: Path) -> None:
        """Read what came back."""
        sizes = [array.size for given in self.given for array in _results(given)]
        found = np.fromfile(file, np.float64)
        assert found.size == sum(sizes), "the program wrote something else than its results"
        self.results = iter(np.split(found, np.cumsum(sizes)[:-1]))


def _results(given: Sequence[Any]) -> tuple[Any, ...]:
    """States, record and trace of a call."""
    return given[0], given[4], given[5]
