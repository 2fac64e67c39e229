"""File of a publication: numbers and sentences that a simulation can contradict.

Statements of the publication (``published``, ``words``) are kept apart from arithmetic on them (``own``). Claims,
observations and the audit read the file of the paper on which this package is based.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, partial
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Literal

from ppafo.documents.toml_text import NAME, TomlKind
from ppafo.errors import ScenarioError
from ppafo.parameters.declared import IDENTIFIER, Words
from ppafo.parameters.records import SchemaVersion, checked_record, keyed, record_schema
from ppafo.wording import first_twice

PAPER = "ppafo-2011"
"""Publication on which this package is based."""
FILE = TomlKind("publication", "publication", resources.files("ppafo.parameters.publications") / "files", ScenarioError)


@dataclass(frozen=True, slots=True, kw_only=True)
class ClaimEntry:
    """Statement of a publication, with the computation and limits that test it."""

    id: str = keyed(Words("name of the statement, unique in the file", pattern=IDENTIFIER))
    statement: str = keyed("statement, in one sentence")
    published: float | None = keyed("published number in 'unit'; omitted for a statement in words", None)
    unit: str = keyed("unit of the published and of our number", "")
    words: str = keyed("published text or range, where it is no single number", "")
    own: str = keyed("calculation from published numbers, where the result itself is not published", "")
    direction: Literal["equal", "maximum", "less", "more"] = keyed(
        "kind of statement: a number, a maximum ('up to'), or less or more, which needs a limit", "equal"
    )
    where: str = keyed("page, section or figure of the source")
    source: str = keyed("publication, if other than the one of the file", "")
    computation: str = keyed("name of a computation of 'ppafo reproduce'", "")
    arguments: Mapping[str, str] = keyed("arguments of the computation, or settings of its run, with units", dict)
    at_least: float | None = keyed("lowest value that agrees, in 'unit'", None)
    at_most: float | None = keyed("highest value that agrees, in 'unit'", None)
    assumed: tuple[str, ...] = keyed("assumptions of our number beyond the publication", ())
    note: str = keyed("reason for the verdict", "")
    not_testable: str = keyed("reason for no computation, in place of one", "")


@dataclass(frozen=True, slots=True)
class PublicationFile:
    """Layout of a publication file."""

    schema_version: SchemaVersion
    name: str = keyed(Words(pattern=NAME))
    title: str = keyed("subject of the publication")
    citation: str = keyed("authors, journal, year, doi where known")
    claims: tuple[ClaimEntry, ...] = keyed("statements")


json_schema = partial(record_schema, PublicationFile, "ppafo publication")
"""JSON Schema of a file of a publication."""


def read_publication(name_or_path: str | Path) -> tuple[PublicationFile, str]:
    """Read a publication by name or file; also return the file label. Raises ScenarioError if invalid."""
    source = FILE.load(name_or_path)
    read = checked_record(PublicationFile, source)
    twice = first_twice(entry.id for entry in read.claims)
    if twice is not None:
        raise ScenarioError(f"{source.label}: claims: '{twice}' appears twice")
    # Rules between fields, which the declaration of one field cannot state.
    for entry in read.claims:
        where = f"{source.label}: claims.{entry.id}"
        if entry.published is None and not entry.words and not entry.own:
            raise ScenarioError(
                f"{where}: give one published result: 'published' with its 'unit', or 'words', or 'own' (a calculation)"
            )
        limit = {"maximum": entry.at_most, "less": entry.at_most, "more": entry.at_least}.get(entry.direction, 0.0)
        if limit is None and not entry.not_testable:
            name = "at_least" if entry.direction == "more" else "at_most"
            raise ScenarioError(f"{where}: direction = '{entry.direction}' also needs {name}")
    return read, source.label


@cache
def paper_entries() -> Mapping[str, ClaimEntry]:
    """Return all statements of the paper by id."""
    return MappingProxyType({entry.id: entry for entry in read_publication(PAPER)[0].claims})
