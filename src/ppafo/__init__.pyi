# Written by scripts/public_api.py

from ppafo.analyses.compare import compare as compare
from ppafo.analyses.design.problem import load_design as load_design
from ppafo.analyses.design.question import design as design
from ppafo.analyses.design.search import Sizing as Sizing
from ppafo.analyses.endurance.discharge import Endurance as Endurance
from ppafo.analyses.endurance.question import bottle as bottle
from ppafo.analyses.find import find as find
from ppafo.analyses.identify import Identification as Identification
from ppafo.analyses.identify import identify as identify
from ppafo.analyses.linearise.model import LinearModel as LinearModel
from ppafo.analyses.linearise.question import linearise as linearise
from ppafo.analyses.reproduce.paper import Reproduction as Reproduction
from ppafo.analyses.reproduce.question import reproduce as reproduce
from ppafo.analyses.sensitivity import sensitivity as sensitivity
from ppafo.analyses.sets.audit import audit as audit
from ppafo.analyses.study_results import StudyResults as StudyResults
from ppafo.analyses.study_results import load_study_results as load_study_results
from ppafo.analyses.sweep import sweep as sweep
from ppafo.analyses.tune import tune as tune
from ppafo.analyses.tuning import list_tunings as list_tunings
from ppafo.analyses.tuning import load_tuning as load_tuning
from ppafo.analyses.validate import Validation as Validation
from ppafo.analyses.validate import validate as validate
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
from ppafo.parameters.device import Device as Device
from ppafo.report.finding import Finding as Finding
from ppafo.report.recording_figure import read_result as read_result
from ppafo.running import SteppedRun as SteppedRun
from ppafo.running import simulate as simulate
from ppafo.running import simulate_many as simulate_many
from ppafo.running import start as start
from ppafo.signals import Channel as Channel
from ppafo.signals import Recording as Recording
from ppafo.simulation.loading import list_scenarios as list_scenarios
from ppafo.simulation.scenario import Scenario as Scenario
from ppafo.simulation.simulate import Result as Result
from ppafo.simulation.simulate import Status as Status
from ppafo.storage.reading import read_recording as read_recording
from ppafo.studies.loading import list_studies as list_studies
from ppafo.studies.loading import load_study as load_study
from ppafo.version import __version__ as __version__
from ppafo.walking import compare_walks as compare_walks
from ppafo.walking import list_walks as list_walks
from ppafo.walking import load_walk as load_walk
from ppafo.walking.walk import walk as walk

__all__ = [
    "ArgumentError",
    "Channel",
    "DataError",
    "Device",
    "Endurance",
    "Finding",
    "Gait",
    "Identification",
    "IdentificationError",
    "KindError",
    "LinearModel",
    "Measurement",
    "Metric",
    "ParameterError",
    "ParameterSet",
    "PpafoError",
    "ProgramError",
    "Recording",
    "Reproduction",
    "Result",
    "Scenario",
    "ScenarioError",
    "SimulationError",
    "Sizing",
    "Status",
    "SteppedRun",
    "StudyError",
    "StudyResults",
    "UnitError",
    "Validation",
    "apply_overrides",
    "audit",
    "bottle",
    "compare",
    "compare_walks",
    "design",
    "evaluate",
    "find",
    "identify",
    "linearise",
    "list_gaits",
    "list_scenarios",
    "list_sets",
    "list_studies",
    "list_tunings",
    "list_walks",
    "load_design",
    "load_device",
    "load_gait",
    "load_parameter_set",
    "load_scenario",
    "load_study",
    "load_study_results",
    "load_tuning",
    "load_walk",
    "read_recording",
    "read_result",
    "reproduce",
    "scenario_from_dict",
    "sensitivity",
    "simulate",
    "simulate_many",
    "start",
    "sweep",
    "tune",
    "validate",
    "walk",
    "workbench",
]
