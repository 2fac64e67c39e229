"""Problem file of ``ppafo identify``: initial parameter set, recordings, column maps, and procedures to apply."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal

from ppafo.documents.faults import line_of, refuse
from ppafo.documents.regular_file import decoded
from ppafo.documents.toml_text import TomlKind, quote
from ppafo.errors import IdentificationError
from ppafo.identification.procedures import BenchProblem
from ppafo.identification.tolerances import Columns, Confidence, Tolerances
from ppafo.model.declaration import Number
from ppafo.parameters.declared import SHORT_NAME, Words
from ppafo.parameters.parameter_set import Citation
from ppafo.parameters.records import SchemaVersion, checked_record, keyed, record_schema
from ppafo.simulation.recorded.channels import LONGEST_STEP
from ppafo.storage.column_map import ColumnMap
from ppafo.wording import known_names, nearest_name

_Label = Annotated[str, Words("name of the experiment, also used in file names", pattern=SHORT_NAME)]
Input = Literal["command", "supply_pressure", "external_torque", "dorsiflexion_pressure", "angle"]
"""Recorded channel that may replace an input of the scenario; a recorded angle is a prescribed motion."""
Compared = Literal["angle", "pressure_1", "pressure_2"]
"""Channel that a fit can compare with a recording [rad], [Pa], [Pa]."""
SHORTEST_STEP = 1.0e-6
"""Shortest time step that a problem file may request [s]."""
_FILE = TomlKind(
    "identification problem", "identification", resources.files("ppafo.identification"), IdentificationError
)
_above_zero = partial(Number, minimum=0.0, minimum_allowed=False)


@dataclass(frozen=True, slots=True)
class NoiseSection:
    """Standard deviations of the noise by channel."""

    angle: float | None = keyed(_above_zero("rad", ""), None)
    pressure_1: float | None = keyed(_above_zero("Pa_d", ""), None)
    pressure_2: float | None = keyed(_above_zero("Pa_d", ""), None)

    def by_channel(self) -> dict[str, float]:
        """Return the standard deviations that are stated, by channel [SI]."""
        return {name: value for name, value in asdict(self).items() if value is not None}


@dataclass(frozen=True, slots=True)
class PriorSection:
    """Prior of a parameter: a normal distribution."""

    mean: str = keyed("most likely value, with its unit")
    relative: float = keyed(_above_zero("", "standard deviation over the mean", plain=True))


@dataclass(frozen=True, slots=True)
class ParameterSection:
    """Table [[trajectory.parameters]]: parameter to fit, with start, bounds and prior."""

    path: str = keyed("dotted path, such as friction.viscous_damping or initial.pressure_1")
    start: str | None = keyed(
        "start of the search; default: the mean of the prior, else from the bench procedures, else the set", None
    )
    low: str | None = keyed("lower bound", None)
    high: str | None = keyed("upper bound", None)
    prior: PriorSection | Literal["bench"] | None = keyed(
        "what is known beforehand; 'bench': the interval of a bench procedure of this file", None
    )
    recordings: tuple[str, ...] = keyed("experiments in which it acts, by label; default: all", ())


@dataclass(frozen=True, slots=True, kw_only=True)
class ExperimentSection:
    """Table [[trajectory.experiments]]: recording with the scenario that models it.

    The scenario is run with the device of the problem. Without a scenario, the recorded command, supply and external
    torque drive the run, which starts from the recorded state.
    """

    label: _Label
    recording: str = keyed("file, relative to this one")
    columns: Columns = None
    scenario: str | None = keyed("name or relative file of a scenario; default: the recorded inputs", None)
    overrides: tuple[str, ...] = keyed("changes to the scenario, or to the device without one; of no fitted number", ())
    start: float | None = keyed(
        Number("s", "time of the recording at which the run begins; 0 s, or the first sample"), None
    )
    step: float | None = keyed(
        Number("s", "longest step of time in the run, such as '0.1 ms'", None, SHORTEST_STEP, LONGEST_STEP), None
    )
    channels: tuple[Compared, ...] | None = keyed(
        "compared channels; default: angle and pressures, unless locked or prescribed", None
    )
    noise: NoiseSection = keyed(
        "least standard deviation by channel, '0.1 deg', '500 Pa_d'; default: none", NoiseSection()
    )
    inputs: tuple[Input, ...] | None = keyed("recorded channels used as inputs of the run", None)
    locked: float | None = keyed(
        Number("rad", "angle at which the vane is locked, such as '75 deg'; without a scenario"), None
    )
    volume: float | None = keyed(
        _above_zero("m^3", "fixed volume in place of the vane, '60 cm^3'; without a scenario"), None
    )
    initial_state: Literal["scenario", "recording", "fitted"] | None = keyed(
        "state at the start; 'recording' and 'fitted' are one; default: the scenario, else the recording", None
    )
    time_offset: float | None = keyed(
        _above_zero("s", "limit of a fitted delay of the samples behind the run, '20 ms'"), None
    )


@dataclass(frozen=True, slots=True)
class CandidateSection:
    """Table [[trajectory.candidates]]: possible next experiment."""

    label: _Label
    scenario: str = keyed("name of a scenario, or a file relative to this one")
    overrides: tuple[str, ...] = keyed("changes to the scenario", ())
    noise: NoiseSection = keyed("by channel; default: what the fit finds", NoiseSection())
    interval: float = keyed(Number("s", "time between two samples; default 1 ms", minimum=SHORTEST_STEP), 1.0e-3)


@dataclass(frozen=True, slots=True)
class TrajectorySection:
    """Table [trajectory] of a problem file."""

    parameters: tuple[ParameterSection, ...] = keyed("free parameters")
    experiments: tuple[ExperimentSection, ...] = keyed("recordings to explain")
    confidence: Confidence = 0.95
    candidates: tuple[CandidateSection, ...] = keyed("experiments to rank by the information that they would bring", ())


@dataclass(frozen=True, slots=True)
class DeviceProblem:
    """Table [device] of a problem file: initial parameter set, chosen valve and overrides."""

    set: str = keyed("name of a parameter set, or a path relative to this file")
    valve: str | None = keyed("name of a valve of the set; default: the chosen one", None)
    overrides: tuple[str, ...] = keyed("overrides of the set, kept in the new set but where a value is identified", ())


@dataclass(frozen=True, slots=True, kw_only=True)
class ProblemFile:
    """Layout of a problem file: initial parameter set, recordings, procedures and trajectory fit."""

    schema_version: SchemaVersion
    name: str = keyed(Words("name of the new parameter set", pattern=SHORT_NAME))
    title: str = keyed("title of the new parameter set", "")
    device: DeviceProblem = keyed("the set to start from")
    citation: Citation | None = keyed("authors of the measurements; default: as in the starting set", None)
    columns: Mapping[str, ColumnMap] = keyed("column maps by name, for files with columns of other names", dict)
    bench: Tolerances | None = keyed("tolerances of the bench", None)
    procedure: tuple[BenchProblem, ...] = keyed("bench procedures to apply", ())
    trajectory: TrajectorySection | None = keyed("fit to recordings of motion, after the bench procedures", None)


def load_problem(path: str | Path) -> ProblemFile:
    """Return the problem in a TOML file; its paths are relative to its folder.

    Raises IdentificationError for an invalid file, and for recordings that are not there.
    """
    source = _FILE.load(path)
    problem = checked_record(ProblemFile, source)
    # Each may be left out, which the layout allows, but not both.
    if not problem.procedure and problem.trajectory is None:
        raise IdentificationError(f"{source.label}: has neither a [[procedure]] nor a [trajectory]")
    maps = {}
    recordings = dict[str, str]()
    for number, item in enumerate(problem.procedure, start=1):
        maps[f"procedure.{number}.columns"] = item.columns
        recordings |= {f"procedure.{number}.recordings.{at}": name for at, name in enumerate(item.recordings, start=1)}
    for number, experiment in enumerate(problem.trajectory.experiments if problem.trajectory else (), start=1):
        maps[f"trajectory.experiments.{number}.columns"] = experiment.columns
        recordings[f"trajectory.experiments.{number}.recording"] = experiment.recording
    faults = {
        key: f"{key} = {quote(name)}: no such column map{known_names(name, problem.columns)}"
        for key, name in maps.items()
        if name is not None and name not in problem.columns
    }
    for key, name in recordings.items():
        if not (source.folder / name).is_file():
            wrong = "is a folder" if (source.folder / name).is_dir() else "no such file"
            near = nearest_name(name, [each.name for each in source.folder.iterdir()])
            faults[key] = f"{key} = {quote(name)}: {wrong}{near}"
    if faults:
        refuse(faults, source.label, IdentificationError, partial(line_of, decoded(source.content)))
    return problem


json_schema = partial(record_schema, ProblemFile, "ppafo identification problem")
"""JSON Schema of a problem file."""
