"""Protocol of a compiler of programs, and the registered compilers.

The engine generates the text of a program and knows no language other than Python. Compilers that translate to C are in
other packages, which register them when the package is imported.
"""

from collections.abc import Callable
from enum import StrEnum
from types import ModuleType
from typing import Protocol

from ppafo.errors import ProgramError, SimulationError

FLAGS = ("-std=c99", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-fwrapv")
"""Flags of gcc and clang for reproducible arithmetic; without the second last, gcc code is up to 20 times slower."""
LIBRARY = frozenset({"exp", "log", "pow"})
"""Functions of every C library whose last bits depend on the library."""


class Effort(StrEnum):
    """Optimisation level of a compiled program; the results are bit-identical."""

    QUICK = "-O1"
    """Half the compilation time, but three times slower code: for runs that are shorter than the compilation."""
    FULL = "-O3"


class CompilerError(SimulationError):
    """Error of a compiler that does not work on this computer for any program; ``names`` are all compilers affected."""

    def __init__(self, problem: str, *names: str) -> None:
        super().__init__(problem)
        self.names = names


class UntranslatableError(ProgramError):
    """Error of a law that cannot be expressed in the language of the compiler, although Python can run it."""


class Compiler(Protocol):
    """Compiler of a composed text into a module; ``compile_text`` and ``run_text`` both fill ``module``.

    Both raise ProgramError for a mistake in the text, UntranslatableError for a text that the language of the compiler
    cannot express, and CompilerError if the compiler does not work. ``path`` is the path of the text, alone in its
    folder, or not an absolute path if nothing is stored.
    """

    @property
    def name(self) -> str:
        """Name of the compiler, in lower case."""

    @property
    def effort(self) -> Effort:
        """Optimisation level of its programs."""

    def with_effort(self, effort: Effort) -> "Compiler":
        """Return the same compiler with another optimisation level."""

    def identity(self) -> str:
        """Return the dependencies of a compiled program besides its text: compiler, version, flags, processor."""

    def compile_text(self, source: str, path: str, module: ModuleType) -> None:
        """Compile a text, and store next to ``path`` the files that ``run_text`` needs."""

    def run_text(self, source: str, path: str, module: ModuleType) -> None:
        """Load the files stored next to ``path``."""


OFFERED: dict[str, Callable[[], Compiler]] = {}
"""Registered compilers by name, preferred first; each raises SimulationError if it is missing on this computer."""
