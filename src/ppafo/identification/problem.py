"""The problem file of ``ppafo identify``: which recordings, how their columns read, and which procedures to apply."""

from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ppafo.documents.models import NAME, one_of, published_schema
from ppafo.documents.problems import first_problem
from ppafo.documents.regular_file import MOST_BYTES_TYPED, read_regular_file
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import IdentificationError, nearest_name, reason
from ppafo.identification.trajectory.section import TrajectorySection
from ppafo.storage.column_map import ColumnMap

_STRICT = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)
_Text = Annotated[str, Field(min_length=1)]
_Recordings = Annotated[tuple[_Text, ...], Field(strict=False, min_length=1, description="files, relative to this one")]
_Columns = Annotated[
    _Text | None, Field(description="name of a column map; without one the file has units in its header")
]
_Confidence = Annotated[float, Field(gt=0.5, lt=1.0, description="of the intervals; 0.95 unless given")]
_Calibration = Annotated[
    float, Field(ge=0.0, lt=0.5, description="relative uncertainty of the sensors' gain, at the same confidence")
]
_Start = Annotated[_Text | None, Field(description="first time to use, such as '2 s'")]
_End = Annotated[_Text | None, Field(description="last time to use, such as '8 s'")]
_Gas = Annotated[_Text | None, Field(description="species of the gas on the bench; the set's unless given")]
_Temperature = Annotated[
    _Text | None, Field(description="of the gas on the bench, such as '17 degC'; the set's unless given")
]
_Valve = Annotated[_Text | None, Field(description="name of the set's valve; the chosen one unless given")]

_FILE = TomlKind(
    "identification problem", "identification", resources.files("ppafo.identification"), IdentificationError
)


class StaticTorqueProblem(BaseModel):
    """Static torque over rising and falling pressure: torque constant and static friction."""

    model_config = _STRICT

    kind: Literal["static_torque"]
    recordings: _Recordings
    columns: _Columns = None
    confidence: _Confidence = 0.95
    calibration: _Calibration = 0.0


class FreeDecayProblem(BaseModel):
    """Free decay after an impulse: viscous damping and Coulomb friction."""

    model_config = _STRICT

    kind: Literal["free_decay"]
    recordings: _Recordings
    columns: _Columns = None
    confidence: _Confidence = 0.95
    calibration: _Calibration = 0.0
    start: _Start = None
    end: _End = None
    inertia: Annotated[_Text | None, Field(description="'8.4 g m^2', or 'unknown'; the set's unless given")] = None


class OpenValveFlowProblem(BaseModel):
    """Flow through the fully open valve: Cd, or C and b of ISO 6358."""

    model_config = _STRICT

    kind: Literal["open_valve_flow"]
    recordings: _Recordings
    columns: _Columns = None
    confidence: _Confidence = 0.95
    calibration: _Calibration = 0.0
    gas: _Gas = None
    temperature: _Temperature = None
    valve: _Valve = None
    law: Annotated[Literal["orifice", "iso6358"], Field(description="the form in which the set gets it")] = "orifice"


class VaneLeakProblem(BaseModel):
    """Closed chambers losing pressure: the law of the leak, and its area where it is an orifice."""

    model_config = _STRICT

    kind: Literal["vane_leak"]
    recordings: _Recordings
    columns: _Columns = None
    confidence: _Confidence = 0.95
    calibration: _Calibration = 0.0
    gas: _Gas = None
    temperature: _Temperature = None
    start: _Start = None
    end: _End = None
    angle: Annotated[_Text | None, Field(description="vane angle, from which the set's volumes follow")] = None
    volume_1: Annotated[_Text | None, Field(description="volume of chamber 1 with its line, such as '40 cm^3'")] = None
    volume_2: Annotated[_Text | None, Field(description="volume of chamber 2 with its line")] = None


class ValveMapProblem(BaseModel):
    """Command against flow: dead band, gain, saturation, hysteresis."""

    model_config = _STRICT

    kind: Literal["valve_map"]
    recordings: _Recordings
    columns: _Columns = None
    confidence: _Confidence = 0.95
    calibration: _Calibration = 0.0
    gas: _Gas = None
    temperature: _Temperature = None
    valve: _Valve = None


class DeviceProblem(BaseModel):
    """The set to start from, its valve, and changes to it."""

    model_config = _STRICT

    set: Annotated[_Text, Field(description="name of a parameter set, or a path relative to this file")]
    valve: _Valve = None
    overrides: Annotated[
        tuple[_Text, ...], Field(strict=False, description="changes to the set, kept in the new one")
    ] = ()


ProcedureProblem = StaticTorqueProblem | FreeDecayProblem | OpenValveFlowProblem | VaneLeakProblem | ValveMapProblem
_KINDS = [StaticTorqueProblem, FreeDecayProblem, OpenValveFlowProblem, VaneLeakProblem, ValveMapProblem]


class ProblemFile(BaseModel):
    """A problem file, as it is written."""

    model_config = _STRICT

    schema_version: Annotated[Literal[1], Field(description="version of this layout")]
    name: Annotated[str, Field(pattern=NAME, max_length=100, description="name of the new parameter set")]
    title: Annotated[str, Field(description="title of the new parameter set")] = ""
    device: Annotated[DeviceProblem, Field(description="the set to start from")]
    columns: Annotated[dict[str, ColumnMap], Field(description="column maps by name, for files from elsewhere")] = {}
    procedure: Annotated[
        tuple[one_of(_KINDS), ...],  # type: ignore[valid-type]
        Field(strict=False, min_length=1, description="bench procedures to apply"),
    ] = ()
    trajectory: Annotated[
        TrajectorySection | None, Field(description="a fit to recordings of motion, after the bench procedures")
    ] = None


def load_problem(path: str | Path) -> ProblemFile:
    """Return the problem in a TOML file; paths in it begin in its folder."""
    try:
        content = read_regular_file(Path(path), MOST_BYTES_TYPED)
    except (OSError, ValueError) as error:
        raise IdentificationError(f"{label(str(path))}: cannot be read: {reason(error)}") from error
    return parse_problem(content, label(str(path)))


def parse_problem(content: bytes, file: str) -> ProblemFile:
    """Return the problem in the bytes of a TOML file; ``file`` is what messages call it."""
    document = _FILE.parse(content, file)
    try:
        problem = ProblemFile.model_validate(document)
    except ValidationError as error:
        text = first_problem(error.errors(include_url=False), ProblemFile)
        raise IdentificationError(f"{file}: {text}") from error
    if not problem.procedure and problem.trajectory is None:
        raise IdentificationError(f"{file}: has nothing to do: neither a [[procedure]] nor a [trajectory]")
    for place, name in _column_maps(problem):
        if name not in problem.columns:
            hint = nearest_name(name, problem.columns)
            known = ", ".join(problem.columns) or "none"
            raise IdentificationError(f"{file}: {place}: there is no column map '{name}'{hint}; there are {known}")
    return problem


def _column_maps(problem: ProblemFile) -> list[tuple[str, str]]:
    """Return every place that names a column map, with the name."""
    bench = [(f"procedure {number}", item.columns) for number, item in enumerate(problem.procedure, start=1)]
    fitted = () if problem.trajectory is None else problem.trajectory.experiments
    places = [*bench, *((f"experiment '{item.label}'", item.columns) for item in fitted)]
    return [(place, name) for place, name in places if name is not None]


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a problem file."""
    return published_schema(ProblemFile, "ppafo identification problem")
