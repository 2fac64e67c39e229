"""Model-based design of pneumatic powered orthoses.

    import ppafo

    result = ppafo.simulate("torque-task-proportional")
    result.plot().savefig("torque-task.png")

Everything below is loaded when it is first used, so that ``import ppafo`` is quick.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ppafo.errors import (
        DataError,
        IdentificationError,
        ParameterError,
        PpafoError,
        ScenarioError,
        SimulationError,
        StudyError,
        UnitError,
    )
    from ppafo.gait import Gait, list_gaits, load_gait
    from ppafo.metrics import Metric, evaluate
    from ppafo.model.sensors import Measurement
    from ppafo.parameters import ParameterSet, apply_overrides, list_sets, load_device, load_parameter_set
    from ppafo.parameters.audit import audit
    from ppafo.parameters.device import Device
    from ppafo.parameters.parts import Catalogue, Part, load_catalogue
    from ppafo.signals import Channel, Recording
    from ppafo.simulation.loading import list_scenarios, load_scenario, scenario_from_dict
    from ppafo.simulation.result import Result, Status
    from ppafo.simulation.scenario import Scenario
    from ppafo.simulation.simulate import simulate, simulate_many
    from ppafo.storage import read_recording, read_result
    from ppafo.studies.comparison import Comparison, compare
    from ppafo.studies.design import Design, load_design, run_design
    from ppafo.studies.monte_carlo import MonteCarlo, monte_carlo
    from ppafo.studies.sensitivity import Sensitivity, sensitivity
    from ppafo.studies.sizing import Sizing, load_sizing, run_sizing
    from ppafo.studies.sweep.loading import list_studies, load_study
    from ppafo.studies.sweep.results import StudyResults, load_study_results
    from ppafo.studies.sweep.run import run_study
    from ppafo.studies.tuning import Tuning, list_tunings, load_tuning, tune
    from ppafo.walking import compare_walks, list_walks, load_walk, walk_population
    from ppafo.walking.walk import walk

__version__ = "0.1.0"

__all__ = [
    "Catalogue",
    "Channel",
    "Comparison",
    "DataError",
    "Design",
    "Device",
    "Gait",
    "IdentificationError",
    "Measurement",
    "Metric",
    "MonteCarlo",
    "ParameterError",
    "ParameterSet",
    "Part",
    "PpafoError",
    "Recording",
    "Result",
    "Scenario",
    "ScenarioError",
    "Sensitivity",
    "SimulationError",
    "Sizing",
    "Status",
    "StudyError",
    "StudyResults",
    "Tuning",
    "UnitError",
    "apply_overrides",
    "audit",
    "compare",
    "compare_walks",
    "evaluate",
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
    "read_recording",
    "read_result",
    "run_design",
    "run_sizing",
    "run_study",
    "scenario_from_dict",
    "sensitivity",
    "simulate",
    "simulate_many",
    "tune",
    "walk",
    "walk_population",
]

_HOMES = {
    "ppafo.errors": (
        "DataError",
        "IdentificationError",
        "ParameterError",
        "PpafoError",
        "ScenarioError",
        "SimulationError",
        "StudyError",
        "UnitError",
    ),
    "ppafo.gait": ("Gait", "list_gaits", "load_gait"),
    "ppafo.metrics": ("Metric", "evaluate"),
    "ppafo.model.sensors": ("Measurement",),
    "ppafo.parameters": ("ParameterSet", "apply_overrides", "list_sets", "load_device", "load_parameter_set"),
    "ppafo.parameters.audit": ("audit",),
    "ppafo.parameters.device": ("Device",),
    "ppafo.parameters.parts": ("Catalogue", "Part", "load_catalogue"),
    "ppafo.signals": ("Channel", "Recording"),
    "ppafo.simulation.loading": ("list_scenarios", "load_scenario", "scenario_from_dict"),
    "ppafo.simulation.result": ("Result", "Status"),
    "ppafo.simulation.scenario": ("Scenario",),
    "ppafo.simulation.simulate": ("simulate", "simulate_many"),
    "ppafo.storage": ("read_recording", "read_result"),
    "ppafo.studies.sweep.loading": ("list_studies", "load_study"),
    "ppafo.studies.sweep.results": ("StudyResults", "load_study_results"),
    "ppafo.studies.sweep.run": ("run_study",),
    "ppafo.studies.comparison": ("Comparison", "compare"),
    "ppafo.studies.monte_carlo": ("MonteCarlo", "monte_carlo"),
    "ppafo.studies.sensitivity": ("Sensitivity", "sensitivity"),
    "ppafo.studies.tuning": ("Tuning", "list_tunings", "load_tuning", "tune"),
    "ppafo.studies.design": ("Design", "load_design", "run_design"),
    "ppafo.studies.sizing": ("Sizing", "load_sizing", "run_sizing"),
    "ppafo.walking": ("compare_walks", "list_walks", "load_walk", "walk", "walk_population"),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Load a public name from its module the first time it is asked for."""
    if name not in _HOME_OF:
        raise AttributeError(f"module 'ppafo' has no attribute '{name}'")
    value = getattr(importlib.import_module(_HOME_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names, loaded or not."""
    return sorted([*__all__, "__version__"])
