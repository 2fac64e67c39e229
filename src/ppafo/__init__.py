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
from typing import TYPE_CHECKING, Any

from ppafo.engine.compilers import Compiler, offer
from ppafo.version import __version__ as __version__

if TYPE_CHECKING:
    from ppafo.analyses.compare.question import compare as compare
    from ppafo.analyses.design.loading import load_design as load_design
    from ppafo.analyses.design.profile.answer import Sizing as Sizing
    from ppafo.analyses.design.question import design as design
    from ppafo.analyses.endurance.answer import Endurance as Endurance
    from ppafo.analyses.endurance.question import bottle as bottle
    from ppafo.analyses.endurance.solve import endurance_of_walk as endurance_of_walk
    from ppafo.analyses.find.question import find as find
    from ppafo.analyses.identify.answer import Identification as Identification
    from ppafo.analyses.identify.question import identify as identify
    from ppafo.analyses.linearise.model import LinearModel as LinearModel
    from ppafo.analyses.linearise.question import linearise as linearise
    from ppafo.analyses.parts.answer import Parts as Parts
    from ppafo.analyses.parts.question import parts as parts
    from ppafo.analyses.reproduce.answer import Reproduction as Reproduction
    from ppafo.analyses.reproduce.question import reproduce as reproduce
    from ppafo.analyses.sensitivity.question import sensitivity as sensitivity
    from ppafo.analyses.sweep.answer import load_study_results as load_study_results
    from ppafo.analyses.sweep.results import StudyResults as StudyResults
    from ppafo.analyses.sweep.solve import sweep as sweep
    from ppafo.analyses.sweep.statistic import estimate as estimate
    from ppafo.analyses.tune.problem import list_tunings as list_tunings
    from ppafo.analyses.tune.problem import load_tuning as load_tuning
    from ppafo.analyses.tune.question import tune as tune
    from ppafo.analyses.validate.question import validate as validate
    from ppafo.analyses.validate.result import Validation as Validation
    from ppafo.errors import ArgumentError as ArgumentError
    from ppafo.errors import DataError as DataError
    from ppafo.errors import IdentificationError as IdentificationError
    from ppafo.errors import KindError as KindError
    from ppafo.errors import ParameterError as ParameterError
    from ppafo.errors import PpafoError as PpafoError
    from ppafo.errors import ProgramError as ProgramError
    from ppafo.errors import ScenarioError as ScenarioError
    from ppafo.errors import SimulationError as SimulationError
    from ppafo.errors import StudyError as StudyError
    from ppafo.errors import UnitError as UnitError
    from ppafo.gait import Gait as Gait
    from ppafo.gait import list_gaits as list_gaits
    from ppafo.gait import load_gait as load_gait
    from ppafo.loading import load_scenario as load_scenario
    from ppafo.loading import scenario_from_dict as scenario_from_dict
    from ppafo.measuring import evaluate as evaluate
    from ppafo.metrics import Metric as Metric
    from ppafo.model.sensors import Measurement as Measurement
    from ppafo.page.workbench import workbench as workbench
    from ppafo.parameters import ParameterSet as ParameterSet
    from ppafo.parameters import apply_overrides as apply_overrides
    from ppafo.parameters import list_sets as list_sets
    from ppafo.parameters import load_device as load_device
    from ppafo.parameters import load_parameter_set as load_parameter_set
    from ppafo.parameters.audit import audit as audit
    from ppafo.parameters.device import Device as Device
    from ppafo.parameters.parts import Catalogue as Catalogue
    from ppafo.parameters.parts import Part as Part
    from ppafo.parameters.parts import load_catalogue as load_catalogue
    from ppafo.report.finding import Finding as Finding
    from ppafo.running import simulate as simulate
    from ppafo.running import simulate_many as simulate_many
    from ppafo.signals import Channel as Channel
    from ppafo.signals import Recording as Recording
    from ppafo.simulation.loading import list_scenarios as list_scenarios
    from ppafo.simulation.scenario import Scenario as Scenario
    from ppafo.simulation.simulate import Result as Result
    from ppafo.simulation.simulate import Status as Status
    from ppafo.storage import read_recording as read_recording
    from ppafo.storage import read_result as read_result
    from ppafo.studies.loading import list_studies as list_studies
    from ppafo.studies.loading import load_study as load_study
    from ppafo.walking import compare_walks as compare_walks
    from ppafo.walking import list_walks as list_walks
    from ppafo.walking import load_walk as load_walk
    from ppafo.walking import walk_population as walk_population
    from ppafo.walking.walk import walk as walk

_HOMES = {
    "ppafo.analyses.compare.question": ("compare",),
    "ppafo.analyses.design.question": ("design",),
    "ppafo.analyses.find.question": ("find",),
    "ppafo.analyses.identify.question": ("identify",),
    "ppafo.analyses.linearise.question": ("linearise",),
    "ppafo.analyses.reproduce.question": ("reproduce",),
    "ppafo.analyses.sensitivity.question": ("sensitivity",),
    "ppafo.analyses.tune.question": ("tune",),
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
    "ppafo.parameters.audit": ("audit",),
    "ppafo.parameters.device": ("Device",),
    "ppafo.parameters.parts": ("Catalogue", "Part", "load_catalogue"),
    "ppafo.analyses.design.loading": ("load_design",),
    "ppafo.analyses.design.profile.answer": ("Sizing",),
    "ppafo.analyses.endurance.answer": ("Endurance",),
    "ppafo.analyses.endurance.question": ("bottle",),
    "ppafo.analyses.endurance.solve": ("endurance_of_walk",),
    "ppafo.analyses.identify.answer": ("Identification",),
    "ppafo.analyses.linearise.model": ("LinearModel",),
    "ppafo.analyses.parts.answer": ("Parts",),
    "ppafo.analyses.parts.question": ("parts",),
    "ppafo.analyses.reproduce.answer": ("Reproduction",),
    "ppafo.analyses.sweep.answer": ("load_study_results",),
    "ppafo.analyses.sweep.results": ("StudyResults",),
    "ppafo.analyses.sweep.solve": ("sweep",),
    "ppafo.analyses.sweep.statistic": ("estimate",),
    "ppafo.analyses.tune.problem": ("list_tunings", "load_tuning"),
    "ppafo.analyses.validate.question": ("validate",),
    "ppafo.analyses.validate.result": ("Validation",),
    "ppafo.running": ("simulate", "simulate_many"),
    "ppafo.signals": ("Channel", "Recording"),
    "ppafo.simulation.loading": ("list_scenarios",),
    "ppafo.simulation.scenario": ("Scenario",),
    "ppafo.simulation.simulate": ("Result", "Status"),
    "ppafo.storage": ("read_recording", "read_result"),
    "ppafo.studies.loading": ("list_studies", "load_study"),
    "ppafo.report.finding": ("Finding",),
    "ppafo.walking": ("compare_walks", "list_walks", "load_walk", "walk_population"),
    "ppafo.walking.walk": ("walk",),
}
"""Defining module of each public name: repeats the imports above, which are deferred until a name is used."""

_HOME_OF = dict(sorted((name, module) for module, names in _HOMES.items() for name in names))
__all__ = list(_HOME_OF)


def _compiler_of_c(name: str) -> Compiler:
    """Return a compiler of C, which knows the translation above the engine."""
    from ppafo.translation.native import compiler

    return compiler(name)


# By name, as the engine knows nothing of the translation above it. A slow valve takes four times as long by clang.
offer({name: partial(_compiler_of_c, name) for name in ("gcc", "clang", "zig")})


def __getattr__(name: str) -> Any:
    """Load a public name from its module the first time it is used."""
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
    """List the public names, loaded or not."""
    return sorted([*__all__, "__version__"])
