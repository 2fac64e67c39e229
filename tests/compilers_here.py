"""The compilers of this computer, for tests that compare what they make, and one that runs its text as it is."""

import sys
from dataclasses import dataclass, replace
from types import ModuleType

from ppafo.engine.compilers import OFFERED, Compiler, Effort
from ppafo.engine.loading import load_generated
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


def first_compiler() -> Compiler:
    """The one that models are compiled by."""
    return next(iter(compilers_here().values()))


@dataclass(frozen=True, slots=True)
class ScriptCompiler:
    """Runs a text of Python when it is compiled and when it is loaded, for what all compilers have in common.

    With ``says`` it says on the side when it compiles.
    """

    says: bool = False
    name: str = "script"
    effort: Effort = Effort.FULL

    def with_effort(self, effort: Effort) -> "ScriptCompiler":
        """Return the same compiler with another optimisation of its programs."""
        return replace(self, effort=effort)

    def identity(self) -> str:
        """Always the same."""
        return "script"

    def compile_text(self, source: str, path: str, module: ModuleType) -> None:
        """Run the text."""
        if self.says:
            sys.stderr.write("compiling")
        self.run_text(source, path, module)

    def run_text(self, source: str, path: str, module: ModuleType) -> None:
        """Run the text."""
        exec(compile(source, path, "exec"), module.__dict__)
