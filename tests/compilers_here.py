"""The compilers of this computer, for tests that compare what they make."""

from types import ModuleType

from ppafo.engine.cache import load_generated
from ppafo.engine.compilers import OFFERED, Compiler
from ppafo.errors import SimulationError


def compilers_here() -> dict[str, Compiler]:
    """Those that are installed, by name."""
    found = {}
    for name, make in OFFERED.items():
        try:
            found[name] = make()
        except SimulationError:
            continue
    return found


def modules_of(source: str) -> dict[str, ModuleType]:
    """The module of a composed text by each of them."""
    return {name: load_generated(source, compiler) for name, compiler in compilers_here().items()}
