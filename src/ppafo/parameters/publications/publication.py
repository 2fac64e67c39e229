"""File of a publication: numbers and sentences that a simulation can contradict.

Statements of the publication (``published``, ``words``) are kept apart from arithmetic on them (``own``). Claims,
observations and the audit read the file of the paper on which this package is based.
"""

from collections.abc import Mapping
from functools import cache, partial
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Literal

from pydantic import Field

from ppafo.documents.models import SchemaVersion, StrictTable, Text, Texts, make_schema, read_model
from ppafo.documents.toml_text import NAME, TomlKind
from ppafo.errors import ScenarioError
from ppafo.wording import first_twice

PAPER = "ppafo-2011"
"""Publication on which this package is based."""
FILE = TomlKind("publication", "publication", resources.files("ppafo.parameters.publications") / "files", ScenarioError)
_IDENTIFIER = r"^[a-z][a-z0-9_]*$"


class ClaimEntry(StrictTable):
    """Statement of a publication, with the computation and limits that test it."""

    id: str = Field(pattern=_IDENTIFIER, description="name of the statement, unique in the file")
    statement: Text = Field(description="statement, in one sentence")
    published: float | None = Field(
        None, allow_inf_nan=False, description="published number in 'unit'; omitted for a statement in words"
    )
    unit: str = Field("", description="unit of the published and of our number")
    words: str = Field("", description="published text or range, where it is no single number")
    own: str = Field("", description="calculation from published numbers, where the result itself is not published")
    direction: Literal["equal", "maximum", "less", "more"] = Field(
        "equal", description="kind of statement: a number, a maximum ('up to'), or less or more, which needs a limit"
    )
    where: Text = Field(description="page, section or figure of the source")
    source: str = Field("", description="publication, if other than the one of the file")
    computation: str = Field("", description="name of a computation of 'ppafo reproduce'")
    arguments: dict[str, str] = Field(
        default_factory=dict, description="arguments of the computation, or settings of its run, with units"
    )
    at_least: float | None = Field(None, allow_inf_nan=False, description="lowest value that agrees, in 'unit'")
    at_most: float | None = Field(None, allow_inf_nan=False, description="highest value that agrees, in 'unit'")
    assumed: Texts = Field((), description="assumptions of our number beyond the publication")
    note: str = Field("", description="reason for the verdict")
    not_testable: str = Field("", description="reason for no computation, in place of one")


class PublicationFile(StrictTable):
    """Layout of a publication file."""

    schema_version: SchemaVersion
    name: str = Field(pattern=NAME)
    title: Text = Field(description="subject of the publication")
    citation: Text = Field(description="authors, journal, year, doi where known")
    claims: list[ClaimEntry] = Field(min_length=1)


json_schema = partial(make_schema, PublicationFile, "ppafo publication")
"""JSON Schema of a file of a publication."""


def read_publication(name_or_path: str | Path) -> tuple[PublicationFile, str]:
    """Read a publication by name or file; also return the file label. Raises ScenarioError if invalid."""
    read, file = read_model(FILE, PublicationFile, name_or_path)
    twice = first_twice(entry.id for entry in read.claims)
    if twice is not None:
        raise ScenarioError(f"{file}: claims: '{twice}' appears twice")
    # What one field alone cannot say: these are rules between fields.
    for entry in read.claims:
        where = f"{file}: claims.{entry.id}"
        if entry.published is None and not entry.words and not entry.own:
            raise ScenarioError(
                f"{where}: give one published result: 'published' with its 'unit', or 'words', or 'own' (a calculation)"
            )
        limit = {"maximum": entry.at_most, "less": entry.at_most, "more": entry.at_least}.get(entry.direction, 0.0)
        if limit is None and not entry.not_testable:
            name = "at_least" if entry.direction == "more" else "at_most"
            raise ScenarioError(f"{where}: direction = '{entry.direction}' also needs {name}")
    return read, file


@cache
def paper_entries() -> Mapping[str, ClaimEntry]:
    """Return all statements of the paper by id."""
    return MappingProxyType({entry.id: entry for entry in read_publication(PAPER)[0].claims})
