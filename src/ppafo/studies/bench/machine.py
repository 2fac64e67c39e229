"""What the numbers were measured on."""

import importlib
import os
import platform
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

PACKAGES = ("ppafo", "numpy", "numba", "llvmlite", "scipy", "scikit-sundae", "jax", "jaxlib")


@dataclass(frozen=True, slots=True)
class Machine:
    """Processor, cores that this process may use, width of its vectors, and versions (None: not installed)."""

    processor: str
    system: str
    cores: int
    has_avx512: bool
    python: str
    packages: dict[str, str | None]


def usable_cores() -> tuple[int, ...]:
    """Numbers of the cores that this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return tuple(sorted(os.sched_getaffinity(0)))
    return tuple(range(os.cpu_count() or 1))


def describe_machine() -> Machine:
    """Facts about this computer and the installed packages."""
    return Machine(
        processor=_processor(),
        system=f"{platform.system()} {platform.machine()}",
        cores=len(usable_cores()),
        has_avx512=has_avx512(),
        python=platform.python_version(),
        packages={name: _version(name) for name in PACKAGES},
    )


def has_avx512() -> bool:
    """True where the compiler may use vectors of eight doubles."""
    codegen = importlib.import_module("numba.core.codegen")
    return "+avx512f" in str(codegen.get_host_cpu_features()).split(",")


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None
