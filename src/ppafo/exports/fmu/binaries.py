"""Binaries of a unit, built for any platform by ziglang where it is there, else for this one by gcc or clang."""

import importlib.util
import platform
import shutil
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ppafo.errors import ProgramError
from ppafo.exports.fmu import component
from ppafo.translation.compiler_process import asked, complaint

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-fwrapv")
_ANOTHER = "install gcc, clang or 'pip install ppafo[native]' anew"
HIDDEN = ("-shared", "-fPIC", "-fvisibility=hidden")


@dataclass(frozen=True, slots=True)
class Platform:
    """A kind of computer: its folder in a unit of FMI 2 (None: there is none) and of FMI 3, and how it is built for.

    ``tried`` says what the binary of this platform was run on by the authors.
    """

    folder_2: str | None
    folder_3: str
    target: str
    suffix: str
    tried: str


PLATFORMS = {
    "linux64": Platform("linux64", "x86_64-linux", "x86_64-linux-gnu.2.17", ".so", "run in the tests"),
    "win64": Platform("win64", "x86_64-windows", "x86_64-windows-gnu", ".dll", "run under Wine"),
    "linux-aarch64": Platform(None, "aarch64-linux", "aarch64-linux-gnu.2.17", ".so", "run under qemu"),
    "darwin64": Platform("darwin64", "x86_64-darwin", "x86_64-macos", ".dylib", "not run"),
    "darwin-aarch64": Platform(None, "aarch64-darwin", "aarch64-macos", ".dylib", "not run"),
    "wasm32": Platform(None, "wasm32-wasip2", "wasm32-wasi", ".wasm", "after a draft, fmi-ls-wasm; run under wasmtime"),
}
"""Platforms by the name under which they are asked for."""


def host_platform() -> str | None:
    """The platform of this computer, None where a unit has none for it."""
    machine = {"x86_64": "64", "amd64": "64", "aarch64": "-aarch64", "arm64": "-aarch64"}.get(
        platform.machine().lower()
    )
    system = {"Linux": "linux", "Windows": "win", "Darwin": "darwin"}.get(platform.system())
    name = f"{system}{machine}"
    return name if name in PLATFORMS else None


def build(name: str, sources: Mapping[str, bytes], main: str) -> bytes:
    """The library of a unit for a platform. ProgramError where no compiler is there for it, or it refuses."""
    if name == "wasm32":
        around = component.sources_of_component(sources, main)
        return component.component_of(build_library(name, around, component.SOURCE, component.FLAGS))
    return build_library(name, sources, main, HIDDEN)


def build_library(name: str, sources: Mapping[str, bytes], main: str, flags: Sequence[str]) -> bytes:
    """A library of some sources for a platform; ProgramError as of a unit."""
    command = [*compiler_for(name), *FLAGS, *flags]
    with tempfile.TemporaryDirectory() as folder:
        for file, content in sources.items():
            (Path(folder) / file).write_bytes(content)
        library = Path(folder) / f"unit{PLATFORMS[name].suffix}"
        mathematics = [] if name in ("win64", "wasm32") else ["-lm"]
        done = asked([*command, main, "-o", library.name, *mathematics], _ANOTHER, folder)
        if done.returncode != 0:
            raise ProgramError(f"{command[0]} does not build the library for {name}: {complaint(done)}")
        if not library.is_file():
            raise ProgramError(f"{command[0]} says that all is well, but made no library for {name}; {_ANOTHER}")
        return library.read_bytes()


def compiler_for(name: str) -> Sequence[str]:
    """The words of a compiler for a platform. ProgramError where there is none."""
    if importlib.util.find_spec("ziglang") is not None:
        return [
            sys.executable,
            "-m",
            "ziglang",
            "cc",
            "-target",
            PLATFORMS[name].target,
            "-s",
            "-fno-sanitize=undefined",
        ]
    found = next(filter(None, map(shutil.which, ("gcc", "clang"))), None)
    if name == host_platform() == "linux64" and found is not None:
        return [found, "-s"]
    needed = "gcc, clang or the package ziglang" if name == "linux64" else "the package ziglang"
    raise ProgramError(f"platform {name} needs {needed} (pip install 'ppafo[native]')")
