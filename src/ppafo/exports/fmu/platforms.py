"""Platforms for which a unit contains a compiled library, and their compilers."""

import importlib.util
import platform
import shutil
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ppafo.errors import ProgramError
from ppafo.storage.files import temporary_folder
from ppafo.translation.compiling import asked, complaint

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-fwrapv")
"""Compiler flags for results bit-identical to the package."""
HIDDEN = ("-shared", "-fPIC", "-fvisibility=hidden")
"""Compiler flags of a shared library that exports only the functions of FMI."""
_REMEDY = "reinstall gcc or clang, or run pip install 'ppafo[native]'"
"""Remedy in messages if a compiler cannot be run."""


@dataclass(frozen=True, slots=True)
class _Platform:
    """Platform: its folder in a unit of FMI 2 (None: unsupported) and of FMI 3, compiler target and file suffix.

    ``trial`` describes how the authors ran the binary of this platform.
    """

    folder_2: str | None
    folder_3: str
    target: str
    suffix: str
    trial: str


PLATFORMS = {
    "linux64": _Platform("linux64", "x86_64-linux", "x86_64-linux-gnu.2.17", ".so", "run in the tests"),
    "win64": _Platform("win64", "x86_64-windows", "x86_64-windows-gnu", ".dll", "run under Wine"),
    "linux-aarch64": _Platform(None, "aarch64-linux", "aarch64-linux-gnu.2.17", ".so", "run under qemu"),
}
"""Platforms by name."""


def host_platform() -> str | None:
    """Return the platform of this computer; None if units do not support it."""
    machine = {"x86_64": "64", "amd64": "64", "aarch64": "-aarch64", "arm64": "-aarch64"}.get(
        platform.machine().lower()
    )
    system = {"Linux": "linux", "Windows": "win"}.get(platform.system())
    name = f"{system}{machine}"
    return name if name in PLATFORMS else None


def build(name: str, sources: Mapping[str, bytes], main: str) -> bytes:
    """Return the compiled library of a unit for a platform; ``main`` is the compiled file of the C ``sources``.

    Raises ProgramError if the platform has no compiler or the compilation fails.
    """
    # No -march: a unit runs on processors that nobody here has seen.
    command = [*compiler_for(name), *FLAGS, *HIDDEN]
    with temporary_folder("ppafo", sources) as folder:
        library = Path(folder) / f"unit{PLATFORMS[name].suffix}"
        # Windows has the mathematics in its C library.
        mathematics = [] if name == "win64" else ["-lm"]
        done = asked([*command, main, "-o", library.name, *mathematics], _REMEDY, folder, Path(folder))
        if done.returncode != 0:
            raise ProgramError(f"{command[0]} failed to build the library for {name}: {complaint(done)}")
        if not library.is_file():
            raise ProgramError(f"{command[0]} reported success but wrote no library for {name}; {_REMEDY}")
        return library.read_bytes()


def compiler_for(name: str) -> Sequence[str]:
    """Return the command of a compiler for a platform; ProgramError if there is none."""
    if importlib.util.find_spec("ziglang") is not None:
        # zig turns undefined behaviour into traps in what it calls a debug build.
        options = ("-s", "-fno-sanitize=undefined")
        return [sys.executable, "-m", "ziglang", "cc", "-target", PLATFORMS[name].target, *options]
    compiler = next(filter(None, map(shutil.which, ("gcc", "clang"))), None)
    # A library of this system's gcc runs on systems that are at least as new; zig links against an old one.
    if name == host_platform() == "linux64" and compiler is not None:
        return [compiler, "-s"]
    needed = "gcc, clang or the package ziglang" if name == "linux64" else "the package ziglang"
    raise ProgramError(f"platform {name} needs {needed}; install it with pip install 'ppafo[native]'")
