"""Problem file of ``ppafo identify``: initial parameter set, recordings, column maps, and procedures to apply."""

from functools import partial
from importlib import resources
from pathlib import Path
from typing import Annotated

from pydantic import Field

from ppafo.documents.models import SchemaVersion, StrictTable, Text, Texts, make_schema, validate
from ppafo.documents.toml_text import NAME, TomlKind, label
from ppafo.errors import IdentificationError
from ppafo.identification.procedures import ProcedureProblem
from ppafo.identification.tolerances import BenchSection
from ppafo.identification.trajectory.layout import TrajectorySection
from ppafo.storage.column_map import ColumnMap
from ppafo.wording import known_names

_FILE = TomlKind(
    "identification problem", "identification", resources.files("ppafo.identification"), IdentificationError
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
    bench: BenchSection | None = Field(None, description="tolerances of the bench")
    procedure: tuple[Annotated[ProcedureProblem, Field(discriminator="kind")], ...] = Field(
        (), strict=False, min_length=1, description="bench procedures to apply"
    )
    trajectory: TrajectorySection | None = Field(
        None, description="fit to recordings of motion, after the bench procedures"
    )


def load_problem(path: str | Path) -> ProblemFile:
    """Return the problem in a TOML file; its paths are relative to its folder.

    Raises IdentificationError for an invalid file.
    """
    return parse_problem(_FILE.read(path), label(str(path)))


def parse_problem(content: bytes, file: str) -> ProblemFile:
    """Return the problem in the bytes of a TOML file; ``file`` is its name in messages.

    Raises IdentificationError for an invalid file.
    """
    problem = validate(ProblemFile, _FILE.parse(content, file), file, IdentificationError, content)
    # Each may be left out, which the layout allows, but not both.
    if not problem.procedure and problem.trajectory is None:
        raise IdentificationError(f"{file}: has neither a [[procedure]] nor a [trajectory]; give at least one")
    fitted = () if problem.trajectory is None else problem.trajectory.experiments
    named = [(f"procedure {number}", item.columns) for number, item in enumerate(problem.procedure, start=1)]
    named += [(f"experiment '{item.label}'", item.columns) for item in fitted]
    for user, name in named:
        if name is not None and name not in problem.columns:
            names = known_names(name, problem.columns)
            raise IdentificationError(f"{file}: {user}: there is no column map '{name}'{names}")
    return problem


json_schema = partial(make_schema, ProblemFile, "ppafo identification problem")
"""JSON Schema of a problem file."""
