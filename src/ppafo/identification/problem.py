"""The problem file of ``ppafo identify``: which recordings, how their columns read, and which procedures to apply."""

from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from ppafo.documents.models import NAME, STRICT, Text, make_schema, validate
from ppafo.documents.regular_file import MAXIMUM_BYTES_TYPED, read_regular_file
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import IdentificationError, nearest_name, reason
from ppafo.identification.trajectory.section import TrajectorySection
from ppafo.storage.column_map import ColumnMap

_Recordings = Annotated[tuple[Text, ...], Field(strict=False, min_length=1, description="files, relative to this one")]
_Columns = Annotated[
    Text | None, Field(description="name of a column map; without one the file has units in its header")
]
_Confidence = Annotated[float, Field(gt=0.5, lt=1.0, description="confidence of the intervals; default 0.95")]
_Calibration = Annotated[
    float, Field(ge=0.0, lt=0.5, description="relative uncertainty of the sensors' gain, at the same confidence")
]
_Start = Annotated[Text | None, Field(description="first time to use, such as '2 s'")]
_End = Annotated[Text | None, Field(description="last time to use, such as '8 s'")]
_Gas = Annotated[Text | None, Field(description="species of the gas on the bench; default: that of the set")]
_Temperature = Annotated[
    Text | None, Field(description="temperature of the gas on the bench, such as '17 degC'; default: that of the set")
]
_Valve = Annotated[Text | None, Field(description="name of a valve of the set; default: the chosen one")]

PROCEDURES = ("static-torque", "free-decay", "open-valve-flow", "valve-map", "vane-leak")
"""Kinds of procedures in the recommended order."""

_FILE = TomlKind(
    "identification problem", "identification", resources.files("ppafo.identification"), IdentificationError
)


class StaticTorqueProblem(BaseModel):
    """Static torque over rising and falling pressure: torque constant and static friction."""

    model_config = STRICT

    kind: Literal["static-torque"]
    recordings: _Recordings
    columns: _Columns = None
    confidence: _Confidence = 0.95
    calibration: _Calibration = 0.0


class FreeDecayProblem(BaseModel):
    """Free decay after an impulse: viscous damping and Coulomb friction."""

    model_config = STRICT

    kind: Literal["free-decay"]
    recordings: _Recordings
    columns: _Columns = None
    confidence: _Confidence = 0.95
    calibration: _Calibration = 0.0
    start: _Start = None
    end: _End = None
    inertia: Annotated[
        Text | None, Field(description="such as '8.4 g m^2', or 'unknown'; default: that of the set")
    ] = None


class OpenValveFlowProblem(BaseModel):
    """Flow through the fully open valve: Cd, or C and b of ISO 6358."""

    model_config = STRICT

    kind: Literal["open-valve-flow"]
    recordings: _Recordings
    columns: _Columns = None
    confidence: _Confidence = 0.95
    calibration: _Calibration = 0.0
    gas: _Gas = None
    temperature: _Temperature = None
    valve: _Valve = None
    law: Annotated[Literal["orifice", "iso6358"], Field(description="form in which it is written into the set")] = (
        "orifice"
    )


class VaneLeakProblem(BaseModel):
    """Closed chambers losing pressure: the law of the leak, and its area where it is an orifice."""

    model_config = STRICT

    kind: Literal["vane-leak"]
    recordings: _Recordings
    columns: _Columns = None
    confidence: _Confidence = 0.95
    calibration: _Calibration = 0.0
    gas: _Gas = None
    temperature: _Temperature = None
    start: _Start = None
    end: _End = None
    angle: Annotated[Text | None, Field(description="vane angle, from which the set's volumes follow")] = None
    volume_1: Annotated[Text | None, Field(description="volume of chamber 1 with its line, such as '40 cm^3'")] = None
    volume_2: Annotated[Text | None, Field(description="volume of chamber 2 with its line")] = None


class ValveMapProblem(BaseModel):
    """Command against flow: dead band, gain, saturation, hysteresis."""

    model_config = STRICT

    kind: Literal["valve-map"]
    recordings: _Recordings
    columns: _Columns = None
    confidence: _Confidence = 0.95
    calibration: _Calibration = 0.0
    gas: _Gas = None
    temperature: _Temperature = None
    valve: _Valve = None


class DeviceProblem(BaseModel):
    """The set to start from, its valve, and changes to it."""

    model_config = STRICT

    set: Annotated[Text, Field(description="name of a parameter set, or a path relative to this file")]
    valve: _Valve = None
    overrides: Annotated[
        tuple[Text, ...], Field(strict=False, description="changes to the set, kept in the new one")
    ] = ()


ProcedureProblem = StaticTorqueProblem | FreeDecayProblem | OpenValveFlowProblem | VaneLeakProblem | ValveMapProblem
_Procedure = Annotated[
    StaticTorqueProblem | FreeDecayProblem | OpenValveFlowProblem | VaneLeakProblem | ValveMapProblem,
    Field(discriminator="kind"),
]


class ProblemFile(BaseModel):
    """A problem file, as it is written."""

    model_config = STRICT

    schema_version: Annotated[Literal[1], Field(description="version of this layout")]
    name: Annotated[str, Field(pattern=NAME, max_length=100, description="name of the new parameter set")]
    title: Annotated[str, Field(description="title of the new parameter set")] = ""
    device: Annotated[DeviceProblem, Field(description="the set to start from")]
    columns: Annotated[dict[str, ColumnMap], Field(description="column maps by name, for files from elsewhere")] = {}
    procedure: Annotated[
        tuple[_Procedure, ...],
        Field(strict=False, min_length=1, description="bench procedures to apply"),
    ] = ()
    trajectory: Annotated[
        TrajectorySection | None, Field(description="a fit to recordings of motion, after the bench procedures")
    ] = None


def load_problem(path: str | Path) -> ProblemFile:
    """Return the problem in a TOML file; paths in it begin in its folder.

    IdentificationError for a file that is not usable.
    """
    try:
        content = read_regular_file(Path(path), MAXIMUM_BYTES_TYPED)
    except (OSError, ValueError) as error:
        raise IdentificationError(f"{label(str(path))}: cannot be read: {reason(error)}") from error
    return parse_problem(content, label(str(path)))


def parse_problem(content: bytes, file: str) -> ProblemFile:
    """Return the problem in the bytes of a TOML file; ``file`` is what messages call it.

    IdentificationError for one that is not usable.
    """
    problem = validate(ProblemFile, _with_hyphens(_FILE.parse(content, file)), file, IdentificationError)
    if not problem.procedure and problem.trajectory is None:
        raise IdentificationError(f"{file}: has nothing to do: neither a [[procedure]] nor a [trajectory]")
    for place, name in _column_maps(problem):
        if name not in problem.columns:
            hint = nearest_name(name, problem.columns)
            known = ", ".join(problem.columns) or "none"
            raise IdentificationError(f"{file}: {place}: there is no column map '{name}'{hint}; available: {known}")
    return problem


def _with_hyphens(document: dict[str, Any]) -> dict[str, Any]:
    """Return the document with the kinds of its procedures as they are spelled today; 0.1 wrote ``static_torque``."""
    procedures = document.get("procedure")
    if not isinstance(procedures, list):
        return document
    return {**document, "procedure": [_with_hyphen(item) for item in procedures]}


def _with_hyphen(procedure: object) -> object:
    kind = procedure.get("kind") if isinstance(procedure, dict) else None
    if not isinstance(procedure, dict) or not isinstance(kind, str) or kind.replace("_", "-") not in PROCEDURES:
        return procedure
    return {**procedure, "kind": kind.replace("_", "-")}


def _column_maps(problem: ProblemFile) -> list[tuple[str, str]]:
    """Return every place that names a column map, with the name."""
    bench = [(f"procedure {number}", item.columns) for number, item in enumerate(problem.procedure, start=1)]
    fitted = () if problem.trajectory is None else problem.trajectory.experiments
    places = [*bench, *((f"experiment '{item.label}'", item.columns) for item in fitted)]
    return [(place, name) for place, name in places if name is not None]


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a problem file."""
    return make_schema(ProblemFile, "ppafo identification problem")
