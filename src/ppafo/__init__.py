"""Model-based design of pneumatic powered orthoses.

    import ppafo

    result = ppafo.simulate("torque-task-proportional")
    result.plot().savefig("torque-task.png")

Everything below is loaded when it is first used, so that ``import ppafo`` is quick.
"""

# Before all else: an interrupt may come while the rest is loaded.
import ppafo.first_moments as _first_moments  # noqa: F401, I001

import importlib
from functools import partial
from typing import Any

from ppafo.engine.compilers import OFFERED, Compiler
from ppafo.version import __version__ as __version__

_HOMES = {
    "ppafo.analyses.compare": ("compare",),
    "ppafo.analyses.design.question": ("design",),
    "ppafo.analyses.find": ("find",),
    "ppafo.analyses.identify": ("Identification", "identify"),
    "ppafo.analyses.linearise.question": ("linearise",),
    "ppafo.analyses.reproduce.question": ("reproduce",),
    "ppafo.analyses.sensitivity": ("sensitivity",),
    "ppafo.analyses.tune": ("tune",),
    "ppafo.errors": (
        "ArgumentError",
        "DataError",
        "IdentificationError",
        "KindError",
        "ParameterError",
        "PpafoError",
        "ProgramError",
        "ScenarioError",
        "SimulationError",
        "StudyError",
        "UnitError",
    ),
    "ppafo.gait": ("Gait", "list_gaits", "load_gait"),
    "ppafo.page.workbench": ("workbench",),
    "ppafo.loading": ("load_scenario", "scenario_from_dict"),
    "ppafo.measuring": ("evaluate",),
    "ppafo.metrics": ("Metric",),
    "ppafo.model.sensors": ("Measurement",),
    "ppafo.parameters": ("ParameterSet", "apply_overrides", "list_sets", "load_device", "load_parameter_set"),
    "ppafo.parameters.device": ("Device",),
    "ppafo.analyses.design.problem": ("load_design",),
    "ppafo.analyses.design.search": ("Sizing",),
    "ppafo.analyses.endurance.discharge": ("Endurance",),
    "ppafo.analyses.endurance.question": ("bottle",),
    "ppafo.analyses.linearise.model": ("LinearModel",),
    "ppafo.analyses.reproduce.paper": ("Reproduction",),
    "ppafo.analyses.sets.audit": ("audit",),
    "ppafo.analyses.study_results": ("StudyResults", "load_study_results"),
    "ppafo.analyses.sweep": ("sweep",),
    "ppafo.analyses.tuning": ("list_tunings", "load_tuning"),
    "ppafo.analyses.validate": ("Validation", "validate"),
    "ppafo.running": ("SteppedRun", "simulate", "simulate_many", "start"),
    "ppafo.signals": ("Channel", "Recording"),
    "ppafo.simulation.loading": ("list_scenarios",),
    "ppafo.simulation.scenario": ("Scenario",),
    "ppafo.simulation.simulate": ("Result", "Status"),
    "ppafo.storage.reading": ("read_recording",),
    "ppafo.studies.loading": ("list_studies", "load_study"),
    "ppafo.report.finding": ("Finding",),
    "ppafo.report.recording_figure": ("read_result",),
    "ppafo.walking": ("compare_walks", "list_walks", "load_walk"),
    "ppafo.walking.walk": ("walk",),
}
"""Module of each public name, from which ``__init__.pyi`` is generated."""

_HOME_OF = dict(sorted((name, module) for module, names in _HOMES.items() for name in names))
__all__ = list(_HOME_OF)


def _compiler_of_c(name: str) -> Compiler:
    """Return the C compiler ``gcc``, ``clang`` or ``zig``, imported at its first use."""
    from ppafo.translation.native import compiler

    return compiler(name)


# By name, as the engine knows nothing of the translation above it. A slow valve takes four times as long by clang.
OFFERED.update({name: partial(_compiler_of_c, name) for name in ("gcc", "clang", "zig")})


def __getattr__(name: str) -> Any:
    """Load a public name from its module at its first use."""
    if name not in _HOME_OF:
        raise AttributeError(f"module 'ppafo' has no attribute '{name}'")
    home = _HOME_OF[name]
    try:
        module = importlib.import_module(home)
    except ModuleNotFoundError as error:
        if error.name != home.rpartition(".")[0]:
            raise
        raise AttributeError(f"ppafo.{name} is part of {error.name}, which is not installed") from None
    value = getattr(module, name)
    # Loaded by every function that has a door.
    from ppafo.arguments.values import show_plainly

    show_plainly(value)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the public names, loaded or not."""
    return sorted([*__all__, "__version__"])
