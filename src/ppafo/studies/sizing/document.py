"""The layout of a sizing file: torque profile, use, limits, parts to choose from."""

from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ppafo.documents.models import NAME, published_schema
from ppafo.documents.problems import first_problem
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import StudyError
from ppafo.parameters.parts.catalogue import DEFAULT

FILE = TomlKind("sizing", "size", resources.files("ppafo.studies.sizing") / "sizings", StudyError)

_STRICT = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)
_Text = Annotated[str, Field(min_length=1)]
_Names = Annotated[tuple[_Text, ...], Field(strict=False, min_length=1)]
_Texts = Annotated[tuple[_Text, ...], Field(strict=False)]
_Factor = Annotated[float, Field(ge=0.0, le=1000.0)]


class ProfileTable(BaseModel):
    """The torque that is wanted over one repetition: a recording, or times and torques."""

    model_config = _STRICT

    recording: Annotated[
        str | None, Field(description="a .csv or .nc file or a result folder, relative to this file")
    ] = None
    channel: Annotated[_Text, Field(description="channel of the recording, in N m")] = "torque"
    time: Annotated[_Texts, Field(description="times with unit, from 0 on; the profile repeats after the last")] = ()
    torque: Annotated[_Texts, Field(description="torques with unit, one for each time")] = ()
    scale: Annotated[float, Field(description="every torque times this: the share that the orthosis gives")] = 1.0


class UseTable(BaseModel):
    """How much is done with one bottle."""

    model_config = _STRICT

    repetitions: Annotated[int | None, Field(gt=0, description="repetitions of the profile, such as steps")] = None
    hours: Annotated[float | None, Field(gt=0.0, description="hours without a pause, instead of repetitions")] = None
    reserve: Annotated[
        float, Field(ge=0.0, le=10.0, description="gas that is to be left, as a share of what is used")
    ] = 0.1


class LimitsTable(BaseModel):
    """What must be kept."""

    model_config = _STRICT

    rms_error: Annotated[
        _Text, Field(description="largest RMS torque error: '0.5 N m', or '5 %' of the largest torque")
    ]


class SizingPartsTable(BaseModel):
    """Names of parts in the catalogue."""

    model_config = _STRICT

    valves: Annotated[_Names, Field(description="valves to choose from, of the kind that the scenario has")]
    bottles: Annotated[_Names, Field(description="bottles to choose from")]
    actuator: Annotated[str | None, Field(description="actuator; that of the scenario's device unless given")] = None
    regulators: Annotated[_Texts, Field(description="regulators that are carried, all of them")] = ()


class PressureTable(BaseModel):
    """Supply pressures to choose from; both regulators have the same."""

    model_config = _STRICT

    lowest: Annotated[_Text, Field(description="lowest supply pressure")] = "10 psi_g"
    highest: Annotated[_Text, Field(description="highest supply pressure")] = "120 psi_g"


class SizingFile(BaseModel):
    """A sizing file, as it is written."""

    model_config = _STRICT

    schema_version: Annotated[Literal[1], Field(description="version of this layout")]
    name: Annotated[str, Field(pattern=NAME, max_length=100)]
    description: str = ""
    scenario: Annotated[_Text, Field(description="device, motion, controller and sensors: a name, or a path")]
    overrides: Annotated[_Texts, Field(description="changes to the scenario")] = ()
    catalogue: Annotated[str, Field(description="catalogue of parts: a name, or a path relative to this file")] = (
        DEFAULT
    )
    profile: ProfileTable
    use: UseTable
    limits: LimitsTable
    parts: SizingPartsTable
    pressure: PressureTable = PressureTable()
    gain_factors: Annotated[
        tuple[_Factor, ...],
        Field(
            strict=False, min_length=1, max_length=12, description="each gain of the controller is tried times these"
        ),
    ] = (0.0, 0.5, 1.0, 3.0, 8.0)
    simulated: Annotated[
        int, Field(ge=1, le=1000, description="repetitions that are run; the first fills the lines")
    ] = 3


def read_sizing_file(name_or_path: str | Path) -> tuple[SizingFile, str]:
    """Return a sizing file by its name in the package or by its path, and what messages call it."""
    file = label(str(name_or_path))
    document = FILE.parse(FILE.read(name_or_path), file)
    try:
        return SizingFile.model_validate(document), file
    except ValidationError as error:
        raise StudyError(f"{file}: {first_problem(error.errors(include_url=False), SizingFile)}") from error


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a sizing file."""
    return published_schema(SizingFile, "ppafo sizing")
