"""Model-based design of pneumatic powered orthoses.

    import ppafo

    result = ppafo.simulate("torque-task-proportional")
    result.plot().savefig("torque-task.png")

Everything below is loaded when it is first used, so that ``import ppafo`` is quick.
"""

import importlib
from functools import partial
from typing import TYPE_CHECKING, Any

from ppafo.engine.compilers import Compiler, offer
from ppafo.version import __version__ as __version__

if TYPE_CHECKING:
    from ppafo.errors import (
        DataError,
        IdentificationError,
        KindError,
        ParameterError,
        PpafoError,
        ProgramError,
        ScenarioError,
        SimulationError,
        StudyError,
        UnitError,
    )
    from ppafo.gait import Gait, list_gaits, load_gait
    from ppafo.live.workbench import workbench
    from ppafo.loading import load_scenario, scenario_from_dict
    from ppafo.metrics import Metric, evaluate
    from ppafo.model.sensors import Measurement
    from ppafo.parameters import ParameterSet, apply_overrides, list_sets, load_device, load_parameter_set
    from ppafo.parameters.audit import audit
    from ppafo.parameters.device import Device
    from ppafo.parameters.parts import Catalogue, Part, load_catalogue
    from ppafo.questions.bits.solve import bits
    from ppafo.questions.compare.answer import Comparison
    from ppafo.questions.compare.solve import compare
    from ppafo.questions.design.answer import Design
    from ppafo.questions.design.problem import load_design
    from ppafo.questions.design.solve import design
    from ppafo.questions.endurance.answer import Endurance
    from ppafo.questions.endurance.solve import endurance, endurance_of_walk
    from ppafo.questions.find.solve import Found, find
    from ppafo.questions.identify.answer import Identification
    from ppafo.questions.identify.solve import identify
    from ppafo.questions.league.answer import League
    from ppafo.questions.league.solve import league
    from ppafo.questions.linearise.answer import LinearModel
    from ppafo.questions.linearise.solve import linearise
    from ppafo.questions.montecarlo.solve import MonteCarlo, monte_carlo
    from ppafo.questions.parts.solve import Parts, parts
    from ppafo.questions.reproduce.answer import Reproduction
    from ppafo.questions.reproduce.solve import reproduce
    from ppafo.questions.sensitivity.solve import Sensitivity, sensitivity
    from ppafo.questions.size.answer import Sizing, size
    from ppafo.questions.size.problem import load_sizing
    from ppafo.questions.sweep.answer import StudyResults
    from ppafo.questions.sweep.results import load_study_results
    from ppafo.questions.sweep.solve import sweep
    from ppafo.questions.timing.answer import Timing, event_timing
    from ppafo.questions.tune.answer import Tuning
    from ppafo.questions.tune.problem import list_tunings, load_tuning
    from ppafo.questions.tune.solve import tune
    from ppafo.questions.unreported.solve import infer_settings
    from ppafo.questions.validate.solve import Validation, validate
    from ppafo.running import simulate
    from ppafo.signals import Channel, Recording
    from ppafo.simulation.loading import list_scenarios
    from ppafo.simulation.scenario import Scenario
    from ppafo.simulation.simulate import Result, Status, simulate_many
    from ppafo.storage import read_recording, read_result
    from ppafo.studies.loading import list_studies, load_study
    from ppafo.walking import compare_walks, list_walks, load_walk, walk_population
    from ppafo.walking.walk import walk

__all__ = [
    "Catalogue",
    "Channel",
    "Comparison",
    "DataError",
    "Design",
    "Device",
    "Endurance",
    "Found",
    "Gait",
    "Identification",
    "IdentificationError",
    "KindError",
    "League",
    "LinearModel",
    "Measurement",
    "Metric",
    "MonteCarlo",
    "ParameterError",
    "ParameterSet",
    "Part",
    "Parts",
    "PpafoError",
    "ProgramError",
    "Recording",
    "Reproduction",
    "Result",
    "Scenario",
    "ScenarioError",
    "Sensitivity",
    "SimulationError",
    "Sizing",
    "Status",
    "StudyError",
    "StudyResults",
    "Timing",
    "Tuning",
    "UnitError",
    "Validation",
    "apply_overrides",
    "audit",
    "bits",
    "compare",
    "compare_walks",
    "design",
    "endurance",
    "endurance_of_walk",
    "evaluate",
    "event_timing",
    "find",
    "identify",
    "infer_settings",
    "league",
    "linearise",
    "list_gaits",
    "list_scenarios",
    "list_sets",
    "list_studies",
    "list_tunings",
    "list_walks",
    "load_catalogue",
    "load_design",
    "load_device",
    "load_gait",
    "load_parameter_set",
    "load_scenario",
    "load_sizing",
    "load_study",
    "load_study_results",
    "load_tuning",
    "load_walk",
    "monte_carlo",
    "parts",
    "read_recording",
    "read_result",
    "reproduce",
    "scenario_from_dict",
    "sensitivity",
    "simulate",
    "simulate_many",
    "size",
    "sweep",
    "tune",
    "validate",
    "walk",
    "walk_population",
    "workbench",
]

_HOMES = {
    "ppafo.errors": (
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
    "ppafo.live.workbench": ("workbench",),
    "ppafo.metrics": ("Metric", "evaluate"),
    "ppafo.model.sensors": ("Measurement",),
    "ppafo.parameters": ("ParameterSet", "apply_overrides", "list_sets", "load_device", "load_parameter_set"),
    "ppafo.parameters.audit": ("audit",),
    "ppafo.parameters.device": ("Device",),
    "ppafo.parameters.parts": ("Catalogue", "Part", "load_catalogue"),
    "ppafo.signals": ("Channel", "Recording"),
    "ppafo.loading": ("load_scenario", "scenario_from_dict"),
    "ppafo.running": ("simulate",),
    "ppafo.simulation.loading": ("list_scenarios",),
    "ppafo.simulation.scenario": ("Scenario",),
    "ppafo.simulation.simulate": ("Result", "Status", "simulate_many"),
    "ppafo.storage": ("read_recording", "read_result"),
    "ppafo.studies.loading": ("list_studies", "load_study"),
    "ppafo.questions.sweep.results": ("StudyResults", "load_study_results"),
    "ppafo.questions.sweep.solve": ("sweep",),
    "ppafo.questions.identify.solve": ("Identification", "identify"),
    "ppafo.questions.reproduce.solve": ("Reproduction", "reproduce"),
    "ppafo.questions.bits.solve": ("bits",),
    "ppafo.questions.compare.solve": ("Comparison", "compare"),
    "ppafo.questions.design.problem": ("load_design",),
    "ppafo.questions.design.solve": ("Design", "design"),
    "ppafo.questions.endurance.solve": ("Endurance", "endurance", "endurance_of_walk"),
    "ppafo.questions.league.solve": ("League", "league"),
    "ppafo.questions.find.solve": ("Found", "find"),
    "ppafo.questions.linearise.solve": ("LinearModel", "linearise"),
    "ppafo.questions.montecarlo.solve": ("MonteCarlo", "monte_carlo"),
    "ppafo.questions.parts.solve": ("Parts", "parts"),
    "ppafo.questions.size.problem": ("load_sizing",),
    "ppafo.questions.size.answer": ("Sizing", "size"),
    "ppafo.questions.sensitivity.solve": ("Sensitivity", "sensitivity"),
    "ppafo.questions.unreported.solve": ("infer_settings",),
    "ppafo.questions.validate.solve": ("Validation", "validate"),
    "ppafo.questions.timing.answer": ("Timing", "event_timing"),
    "ppafo.questions.tune.problem": ("list_tunings", "load_tuning"),
    "ppafo.questions.tune.solve": ("Tuning", "tune"),
    "ppafo.walking": ("compare_walks", "list_walks", "load_walk", "walk", "walk_population"),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

_RENAMED = {"run_design": "design", "run_sizing": "size", "run_study": "sweep"}
"""Names of version 0.1 and what they are called now."""


def _compiler_of_c(name: str) -> Compiler:
    """Return a compiler of C, which knows the translation above the engine."""
    from ppafo.translation.native import compiler

    return compiler(name)


def _numba() -> Compiler:
    """Return Numba."""
    from ppafo.engine.numba_compiler import numba_compiler

    return numba_compiler()


offer({**{name: partial(_compiler_of_c, name) for name in ("clang", "gcc", "zig")}, "numba": _numba})


def __getattr__(name: str) -> Any:
    """Load a public name from its module the first time it is used."""
    if name in _RENAMED:
        raise AttributeError(f"ppafo.{name} is now called ppafo.{_RENAMED[name]}")
    if name not in _HOME_OF:
        raise AttributeError(f"module 'ppafo' has no attribute '{name}'")
    value = getattr(importlib.import_module(_HOME_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names, loaded or not."""
    return sorted([*__all__, "__version__"])
