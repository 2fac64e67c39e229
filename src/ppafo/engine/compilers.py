"""Protocol of a compiler of programs, and the compilers available.

The engine writes the text of a program and knows no other language than Python. What compiles it through C lies above
and is offered by the package as a whole, where it is imported.
"""

from collections.abc import Callable, Mapping
from enum import StrEnum
from types import ModuleType
from typing import Protocol

from ppafo.errors import ProgramError, SimulationError

FLAGS = ("-std=c99", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-fwrapv")
"""Flags of gcc and clang for strict arithmetic; without the second last gcc is up to 20 times slower."""
LIBRARY = frozenset({"exp", "log", "pow"})
"""Functions that every C library has, with last bits of its own."""


class Effort(StrEnum):
    """Optimisation of a compiled program; the results have the same bits."""

    QUICK = "-O1"
    """Compiled in half the time, three times slower in a run: for a run that takes less than its compilation."""
    FULL = "-O3"


class CompilerError(SimulationError):
    """A compiler does not work on this computer, whatever the program; ``names`` are all that fail for this reason.

    ``passing`` says that the reason may be gone in the next run, such as a disk that is full.
    """

    def __init__(self, problem: str, *names: str, passing: bool = False) -> None:
        super().__init__(problem)
        self.names, self.passing = names, passing


class UntranslatableError(ProgramError):
    """A law has no form in the language of the compiler, and is none the worse for it: Python can run it."""


class Compiler(Protocol):
    """Compiler of a composed text into a module; both ways fill ``module``.

    They raise ProgramError for a mistake in the text, UntranslatableError where it has no form in the language of the
    compiler, and CompilerError where the compiler does not work.
    ``path`` is where the text lies, alone in its folder, or no absolute path where nothing is kept.
    """

    @property
    def name(self) -> str:
        """Name of the compiler, in small letters."""

    @property
    def effort(self) -> Effort:
        """Optimisation of its programs."""

    def with_effort(self, effort: Effort) -> "Compiler":
        """Return the same compiler with another optimisation of its programs."""

    def identity(self) -> str:
        """Dependencies of a compiled program beside its text: compiler, version, flags, processor."""

    def described(self) -> str:
        """Name and version of the compiler, for people."""

    def compile_text(self, source: str, path: str, module: ModuleType) -> None:
        """Compile a text, and keep beside ``path`` what ``run_text`` needs."""

    def run_text(self, source: str, path: str, module: ModuleType) -> None:
        """Load what was kept beside ``path``."""


OFFERED: dict[str, Callable[[], Compiler]] = {}
"""Compilers by name, the one to prefer first; each raises SimulationError where it is not on this computer."""


def offer(compilers: Mapping[str, Callable[[], Compiler]]) -> None:
    """Let programs be compiled by these, each made when it is first needed, and preferred in this order."""
    OFFERED.update(compilers)
