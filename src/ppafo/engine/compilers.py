"""Which compiler makes a program of its text: Numba, or one of C or of kernels, which is handed over from above.

The engine writes the text of a program and knows no other language. What compiles it through another one is offered by
the package as a whole, where it is imported, and taken where ``PPAFO_BACKEND`` asks for it.
"""

import os
from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Protocol

from ppafo.errors import SimulationError, nearest_name, one_line

BACKEND_VARIABLE = "PPAFO_BACKEND"
NUMBA = "numba"
"""What compiles where nothing else is asked for."""


class Compiler(Protocol):
    """Makes a module that does what the composed text says; both ways fill ``module``, and raise ProgramError.

    ``path`` is where the text lies, alone in its folder, or no place at all where nothing is kept.
    """

    @property
    def name(self) -> str:
        """A word of small letters, in the names of its programs."""

    @property
    def seconds_per_byte(self) -> float:
        """What a common computer takes for a byte of the text, until this one has compiled something [s]."""

    @property
    def runs_at_once(self) -> int:
        """Most runs of a call where the text is that of one lane, run for each column; 0 for a block of lanes."""

    def __hash__(self) -> int:
        """Tells compilers apart."""

    def identity(self) -> str:
        """What a compiled program depends on beside its text: compiler, version, flags, processor."""

    def described(self) -> str:
        """Its name and version, for people."""

    def compile_text(self, source: str, path: str, module: ModuleType) -> None:
        """Compile a text, and keep beside ``path`` what ``run_text`` needs."""

    def run_text(self, source: str, path: str, module: ModuleType) -> None:
        """Load what was kept beside ``path``."""


_OFFERED: dict[str, Callable[[], Compiler]] = {}


def offer(compilers: Mapping[str, Callable[[], Compiler]]) -> None:
    """Let ``PPAFO_BACKEND`` name compilers; each is made when it is first asked for."""
    _OFFERED.update(compilers)


def chosen_compiler() -> Compiler | None:
    """Return the compiler that ``PPAFO_BACKEND`` names, None for Numba; SimulationError for a name that is none."""
    name = os.environ.get(BACKEND_VARIABLE) or NUMBA
    if name == NUMBA:
        return None
    if name not in _OFFERED:
        allowed = (NUMBA, *_OFFERED)
        hint = nearest_name(name, allowed)
        raise SimulationError(f"{BACKEND_VARIABLE}: '{one_line(name)}' is none of {', '.join(allowed)}{hint}")
    return _OFFERED[name]()
