"""The layout of a design file: tasks, parts to choose from, variables, constraints, search."""

from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ppafo.documents.models import NAME, published_schema
from ppafo.documents.problems import first_problem
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import StudyError
from ppafo.parameters.parts.catalogue import DEFAULT

FILE = TomlKind("design", "design", resources.files("ppafo.studies.design") / "designs", StudyError)

_STRICT = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)
_Text = Annotated[str, Field(min_length=1)]
_Names = Annotated[tuple[_Text, ...], Field(strict=False, min_length=1)]
_Texts = Annotated[tuple[_Text, ...], Field(strict=False)]


class TaskTable(BaseModel):
    """A task that the device has to do, as a scenario for each kind of valve that may do it."""

    model_config = _STRICT

    name: Annotated[_Text, Field(description="what reports call it")]
    scenarios: Annotated[
        dict[str, _Text],
        Field(min_length=1, description="scenario by kind of valve: a name, or a path relative to this file"),
    ]
    overrides: Annotated[_Texts, Field(description="changes to every scenario of the task")] = ()
    weight: Annotated[float, Field(gt=0.0, description="share of the task in use, relative to the others")] = 1.0


class PartsTable(BaseModel):
    """Names of parts in the catalogue; every valve is tried with every actuator."""

    model_config = _STRICT

    valves: Annotated[_Names, Field(description="valves to choose from")]
    actuators: Annotated[_Names, Field(description="actuators to choose from")]
    regulators: Annotated[_Texts, Field(description="regulators that are carried, all of them")] = ()
    bottle: Annotated[str | None, Field(description="bottle that is carried, full")] = None
    other_mass: Annotated[str, Field(description="what is carried besides: shell, straps, electronics")] = "0 kg"


class VariableTable(BaseModel):
    """A number that may be chosen: between two limits, or one of some values."""

    model_config = _STRICT

    lowest: Annotated[str | None, Field(description="smallest value with its unit")] = None
    highest: Annotated[str | None, Field(description="largest value with its unit")] = None
    values: Annotated[_Texts, Field(description="values to choose from, with unit; needed for times and rates")] = ()
    scale: Annotated[Literal["linear", "log"], Field(description="how values between the limits are spread")] = "linear"


class ConstraintTable(BaseModel):
    """What a design has to keep, in each task."""

    model_config = _STRICT

    least: Annotated[str | None, Field(description="smallest value allowed, with its unit")] = None
    most: Annotated[str | None, Field(description="largest value allowed, with its unit")] = None


class SearchTable(BaseModel):
    """How long to search."""

    model_config = _STRICT

    screening: Annotated[int, Field(ge=16, le=100_000, description="designs of the first, even look")] = 4096
    population: Annotated[int, Field(ge=16, le=4096, description="designs of each later generation")] = 256
    generations: Annotated[int, Field(ge=0, le=10_000, description="generations at most")] = 80
    tolerance: Annotated[
        float, Field(ge=0.0, lt=1.0, description="stop when the hypervolume has grown by less over 10 generations")
    ] = 1.0e-3
    seed: Annotated[int, Field(ge=0, le=2**32 - 1, description="the same seed gives the same designs")] = 1


class DesignFile(BaseModel):
    """A design file, as it is written."""

    model_config = _STRICT

    schema_version: Annotated[Literal[1], Field(description="version of this layout")]
    name: Annotated[str, Field(pattern=NAME, max_length=100)]
    description: str = ""
    catalogue: Annotated[str, Field(description="catalogue of parts: a name, or a path relative to this file")] = (
        DEFAULT
    )
    error: Annotated[str, Field(description="metric that counts as the error: any in N m")] = "rms_error"
    task: Annotated[tuple[TaskTable, ...], Field(strict=False, min_length=1)]
    parts: PartsTable
    variables: Annotated[dict[str, VariableTable], Field(description="numbers to choose, by path")] = {}
    constraints: Annotated[dict[str, ConstraintTable], Field(description="by metric, or error, gas or mass")] = {}
    search: SearchTable = SearchTable()


def read_design_file(name_or_path: str | Path) -> tuple[DesignFile, str]:
    """Return a design file by its name in the package or by its path, and what messages call it."""
    file = label(str(name_or_path))
    document = FILE.parse(FILE.read(name_or_path), file)
    try:
        return DesignFile.model_validate(document), file
    except ValidationError as error:
        raise StudyError(f"{file}: {first_problem(error.errors(include_url=False), DesignFile)}") from error


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a design file."""
    return published_schema(DesignFile, "ppafo design")
