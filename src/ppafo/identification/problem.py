"""Problem file of ``ppafo identify``: initial parameter set, recordings, column maps, and procedures to apply."""

from functools import partial
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from ppafo.documents.faults import line_of, refuse
from ppafo.documents.models import Quantified, SchemaVersion, StrictTable, Text, Texts, make_schema, validate
from ppafo.documents.regular_file import decoded
from ppafo.documents.toml_text import NAME, TomlKind, label, quote
from ppafo.errors import IdentificationError
from ppafo.identification.procedures import BenchProblem
from ppafo.identification.tolerances import Columns, Confidence, Tolerances
from ppafo.identification.trajectory.experiment import ALL_INPUTS
from ppafo.simulation.recorded.channels import LONGEST_STEP
from ppafo.storage.column_map import ColumnMap
from ppafo.wording import known_names, nearest_name

_Label = Annotated[
    str, Field(pattern=NAME, max_length=60, description="name of the experiment, also used in file names")
]
SHORTEST_STEP = 1.0e-6
"""Shortest time step that a problem file may request [s]."""
_FILE = TomlKind(
    "identification problem", "identification", resources.files("ppafo.identification"), IdentificationError
)


class NoiseSection(StrictTable):
    """Standard deviations of the noise by channel."""

    angle: Annotated[float, Quantified("rad", above=0.0)] | None = None
    pressure_1: Annotated[float, Quantified("Pa_d", above=0.0)] | None = None
    pressure_2: Annotated[float, Quantified("Pa_d", above=0.0)] | None = None


class PriorSection(StrictTable):
    """Prior of a parameter: a normal distribution."""

    mean: Annotated[Text, Field(description="most likely value, with its unit")]
    relative: Annotated[float, Field(gt=0.0, description="standard deviation over the mean")]


class ParameterSection(StrictTable):
    """Table [[trajectory.parameters]]: parameter to fit, with start, bounds and prior."""

    path: Text = Field(description="dotted path, such as friction.viscous_damping or initial.pressure_1")
    start: Text | None = Field(
        None, description="start of the search; default: from the bench procedures, else the set"
    )
    low: Text | None = Field(None, description="lower bound")
    high: Text | None = Field(None, description="upper bound")
    prior: PriorSection | Literal["bench"] | None = Field(
        None, description="what is known beforehand; 'bench': the interval of a bench procedure of this file"
    )
    recordings: Texts = Field((), description="experiments in which it acts, by label; default: all")


class ExperimentSection(StrictTable):
    """Table [[trajectory.experiments]]: recording with the scenario that models it.

    The scenario is run with the device of the problem. Without a scenario, the recorded command, supply and external
    torque drive the run, which starts from the recorded state.
    """

    label: _Label
    recording: Text = Field(description="file, relative to this one")
    columns: Columns = None
    scenario: Text | None = Field(None, description="name or relative file of a scenario; default: the recorded inputs")
    overrides: Texts = Field((), description="changes to the scenario, or to the device without one")
    start: Annotated[float, Quantified("s")] | None = Field(
        None, description="time of the recording at which the run begins; 0 s, or the first sample"
    )
    step: Annotated[float, Quantified("s", SHORTEST_STEP, LONGEST_STEP)] | None = Field(
        None, description="longest step of time in the run, such as '0.1 ms'"
    )
    channels: Texts | None = Field(
        None, description="compared channels; default: angle and pressures, unless locked or prescribed"
    )
    noise: NoiseSection = Field(
        NoiseSection(), description="least standard deviation by channel, '0.1 deg', '500 Pa_d'; default: none"
    )
    inputs: Texts | None = Field(
        None, description=f"recorded channels used as inputs of the run: {', '.join(ALL_INPUTS)}"
    )
    locked: Annotated[float, Quantified("rad")] | None = Field(
        None, description="angle at which the vane is locked, such as '75 deg'; without a scenario"
    )
    volume: Annotated[float, Quantified("m^3", above=0.0)] | None = Field(
        None, description="fixed volume in place of the vane, '60 cm^3'; without a scenario"
    )
    initial_state: Literal["scenario", "recording", "fitted"] | None = Field(
        None,
        description="state at the start; 'recording' and 'fitted' are one; default: the scenario, else the recording",
    )
    time_offset: Annotated[float, Quantified("s", above=0.0)] | None = Field(
        None, description="limit of a fitted delay of the samples behind the run, '20 ms'"
    )


class CandidateSection(StrictTable):
    """Table [[trajectory.candidates]]: possible next experiment."""

    label: _Label
    scenario: Text = Field(description="name of a scenario, or a file relative to this one")
    overrides: Texts = Field((), description="changes to the scenario")
    noise: NoiseSection = Field(NoiseSection(), description="by channel; default: what the fit finds")
    interval: Annotated[float, Quantified("s", SHORTEST_STEP)] = Field(
        default_factory=lambda: 1.0e-3, description="time between two samples; default 1 ms"
    )


class TrajectorySection(StrictTable):
    """Table [trajectory] of a problem file."""

    parameters: tuple[ParameterSection, ...] = Field(strict=False, min_length=1, description="free parameters")
    experiments: tuple[ExperimentSection, ...] = Field(strict=False, min_length=1, description="recordings to explain")
    confidence: Confidence = 0.95
    candidates: tuple[CandidateSection, ...] = Field(
        (), strict=False, description="experiments to rank by the information that they would bring"
    )


class DeviceProblem(StrictTable):
    """Table [device] of a problem file: initial parameter set, chosen valve and overrides."""

    set: Text = Field(description="name of a parameter set, or a path relative to this file")
    valve: Text | None = Field(None, description="name of a valve of the set; default: the chosen one")
    overrides: Texts = Field((), description="overrides of the set, kept in the new set")


class CitationSection(StrictTable):
    """Table [citation] of a problem file, as of a parameter set."""

    title: Text
    authors: Texts = ()
    year: Annotated[int | None, Field(ge=1800, le=2200)] = None
    doi: str = ""
    note: str = ""


class ProblemFile(StrictTable):
    """Layout of a problem file: initial parameter set, recordings, procedures and trajectory fit."""

    schema_version: SchemaVersion
    name: str = Field(pattern=NAME, max_length=100, description="name of the new parameter set")
    title: str = Field("", description="title of the new parameter set")
    device: DeviceProblem = Field(description="the set to start from")
    citation: CitationSection | None = Field(
        None, description="authors of the measurements; default: as in the starting set"
    )
    columns: dict[str, ColumnMap] = Field({}, description="column maps by name, for files with columns of other names")
    bench: Tolerances | None = Field(None, description="tolerances of the bench")
    procedure: tuple[Annotated[BenchProblem, Field(discriminator="kind")], ...] = Field(
        (), strict=False, min_length=1, description="bench procedures to apply"
    )
    trajectory: TrajectorySection | None = Field(
        None, description="fit to recordings of motion, after the bench procedures"
    )


def load_problem(path: str | Path) -> ProblemFile:
    """Return the problem in a TOML file; its paths are relative to its folder.

    Raises IdentificationError for an invalid file, and for recordings that are not there.
    """
    return parse_problem(_FILE.read(path), label(str(path)), Path(path).parent)


def parse_problem(content: bytes, file: str, folder: Path | None = None) -> ProblemFile:
    """Return the problem in the bytes of a TOML file; ``file`` is its name in messages.

    Raises IdentificationError for an invalid file, and for recordings that are not in its ``folder``.
    """
    problem = validate(ProblemFile, _FILE.parse(content, file), file, IdentificationError, content)
    # Each may be left out, which the layout allows, but not both.
    if not problem.procedure and problem.trajectory is None:
        raise IdentificationError(f"{file}: has neither a [[procedure]] nor a [trajectory]")
    experiments = () if problem.trajectory is None else problem.trajectory.experiments
    named = [(f"procedure.{number}", item.columns) for number, item in enumerate(problem.procedure, start=1)]
    named += [(f"trajectory.experiments.{number}", item.columns) for number, item in enumerate(experiments, start=1)]
    faults = {
        f"{table}.columns": f"{table}.columns = {quote(name)}: no such column map{known_names(name, problem.columns)}"
        for table, name in named
        if name is not None and name not in problem.columns
    }
    recordings = [
        (f"procedure.{number}.recordings.{place}", name)
        for number, item in enumerate(problem.procedure, start=1)
        for place, name in enumerate(item.recordings, start=1)
    ]
    recordings += [
        (f"trajectory.experiments.{number}.recording", item.recording)
        for number, item in enumerate(experiments, start=1)
    ]
    if folder is not None:
        for key, name in recordings:
            if not (folder / name).is_file():
                wrong = "is a folder" if (folder / name).is_dir() else "no such file"
                near = nearest_name(name, [each.name for each in folder.iterdir()])
                faults[key] = f"{key} = {quote(name)}: {wrong}{near}"
    if faults:
        refuse(faults, file, IdentificationError, partial(line_of, decoded(content)))
    return problem


json_schema = partial(make_schema, ProblemFile, "ppafo identification problem")
"""JSON Schema of a problem file."""
