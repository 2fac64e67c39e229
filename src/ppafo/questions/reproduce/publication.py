"""A publication as a file of claims: what it states, where, what is assumed, and how our number is computed."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, Field

from ppafo.documents.models import NAME, STRICT, Text, Texts, make_schema, read_model
from ppafo.documents.toml_text import TomlKind
from ppafo.errors import ScenarioError, UnitError, first_twice, nearest_name
from ppafo.questions.reproduce.computations import CHAMBERS, COMPUTATIONS, Computation, chamber_names
from ppafo.units import from_si, parse_quantity

FILE = TomlKind(
    "publication", "publication", resources.files("ppafo.questions.reproduce") / "publications", ScenarioError
)
_IDENTIFIER = r"^[a-z][a-z0-9_]*$"


class ClaimEntry(BaseModel):
    """One claim in the file of a publication."""

    model_config = STRICT

    id: str = Field(pattern=_IDENTIFIER, description="name of the claim, unique in the file")
    statement: Text = Field(description="what is claimed, one sentence")
    published: float | None = Field(
        None, allow_inf_nan=False, description="published number in 'unit'; left out where only words are"
    )
    unit: str = Field("", description="unit of the published and of our number")
    words: str = Field("", description="what is published where it is no number, or the range of it")
    where: Text = Field(description="where it was read")
    source: str = Field("", description="publication, where it is not that of the file")
    computation: str = Field("", description="name of a computation: " + ", ".join(COMPUTATIONS))
    arguments: dict[str, str] = Field(default_factory=dict, description="arguments of the computation, with units")
    at_least: float | None = Field(None, allow_inf_nan=False, description="lowest value that agrees, in 'unit'")
    at_most: float | None = Field(None, allow_inf_nan=False, description="highest value that agrees, in 'unit'")
    assumed: Texts = Field((), description="what our number rests on beside what is published")
    note: str = Field("", description="why the verdict is what it is")
    not_testable: str = Field("", description="why nothing is computed, in place of a computation")


class PublicationFile(BaseModel):
    """The file of a publication."""

    model_config = STRICT

    schema_version: Literal[1] = Field(description="version of this layout")
    name: str = Field(pattern=NAME)
    title: Text = Field(description="what it is about")
    citation: Text = Field(description="authors, journal, year, doi where known")
    claims: list[ClaimEntry] = Field(min_length=1)


@dataclass(frozen=True, slots=True)
class PublishedClaim:
    """A claim whose computation is known to exist; ``arguments`` in SI."""

    entry: ClaimEntry
    computation: Computation | None
    arguments: Mapping[str, str | float]
    source: str

    def value(self) -> float | None:
        """Return our number in the unit of the claim, None where nothing is computed; SimulationError if it fails."""
        if self.computation is None:
            return None
        return from_si(self.computation.compute(self.arguments), self.entry.unit, self.computation.unit)


@dataclass(frozen=True, slots=True)
class Publication:
    """A publication with its claims in the order of the file."""

    name: str
    title: str
    citation: str
    claims: tuple[PublishedClaim, ...]


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a file of a publication."""
    return make_schema(PublicationFile, "ppafo publication")


def load_publication(name_or_path: str | Path) -> Publication:
    """Return a publication of the package by its name, or any other by its file; ScenarioError where it is wrong."""
    read, file = read_model(FILE, PublicationFile, name_or_path)
    twice = first_twice(entry.id for entry in read.claims)
    if twice is not None:
        raise ScenarioError(f"{file}: claims: '{twice}' is there twice; give each claim a name of its own")
    claims = tuple(_checked(entry, read.citation, file) for entry in read.claims)
    return Publication(read.name, read.title, read.citation, claims)


def _checked(entry: ClaimEntry, citation: str, file: str) -> PublishedClaim:
    place = f"{file}: claims.{entry.id}"
    if entry.published is None and not entry.words:
        raise ScenarioError(f"{place}: give what is published: a number with its unit, or words")
    source = f"{entry.source or citation}, {entry.where}"
    if bool(entry.computation) == bool(entry.not_testable):
        raise ScenarioError(f"{place}: give either computation or not_testable, which says why there is none")
    if entry.not_testable:
        return PublishedClaim(entry, None, {}, source)
    if entry.computation not in COMPUTATIONS:
        hint = nearest_name(entry.computation, COMPUTATIONS)
        known = ", ".join(COMPUTATIONS)
        raise ScenarioError(f"{place}.computation: there is no '{entry.computation}'{hint}; available: {known}")
    _check_range(entry, place)
    computation = COMPUTATIONS[entry.computation]
    try:
        from_si(1.0, entry.unit, computation.unit)
    except UnitError as error:
        raise ScenarioError(f"{place}.unit: {error}") from error
    return PublishedClaim(entry, computation, _arguments(entry, computation, place), source)


def _check_range(entry: ClaimEntry, place: str) -> None:
    """Refuse a range that is none, and one in which the published number itself would not agree."""
    if entry.at_least is None and entry.at_most is None:
        raise ScenarioError(f"{place}: give at_least or at_most, or both: what agrees with the claim")
    low = -math.inf if entry.at_least is None else entry.at_least
    high = math.inf if entry.at_most is None else entry.at_most
    if low > high:
        raise ScenarioError(f"{place}: at_least = {low:g} lies above at_most = {high:g}: no number agrees")
    if entry.published is not None and not low <= entry.published <= high:
        name, limit = ("at_least", low) if entry.published < low else ("at_most", high)
        raise ScenarioError(
            f"{place}: published = {entry.published:g} does not agree with itself, {name} = {limit:g}; widen the range"
        )


def _arguments(entry: ClaimEntry, computation: Computation, place: str) -> dict[str, str | float]:
    wanted = ", ".join(computation.arguments)
    for name in entry.arguments:
        if name not in computation.arguments:
            hint = nearest_name(name, computation.arguments)
            raise ScenarioError(f"{place}.arguments: '{name}' is unknown{hint}; {entry.computation} takes {wanted}")
    values: dict[str, str | float] = {}
    for name, unit in computation.arguments.items():
        if name not in entry.arguments:
            raise ScenarioError(f"{place}.arguments: '{name}' is missing; {entry.computation} takes {wanted}")
        values[name] = _argument(entry.arguments[name], unit, f"{place}.arguments.{name}")
    return values


def _argument(text: str, unit: str, place: str) -> str | float:
    if unit == CHAMBERS:
        if text not in chamber_names():
            hint = nearest_name(text, chamber_names())
            known = "; ".join(chamber_names())
            raise ScenarioError(f"{place}: there are no chambers '{text}'{hint}; available: {known}")
        return text
    try:
        value = parse_quantity(text, unit)
    except UnitError as error:
        raise ScenarioError(f"{place}: {error}") from error
    # An absolute pressure and a time: neither lies below 0.
    if not 0.0 <= value < math.inf:
        raise ScenarioError(f"{place} = '{text}': must be at least 0 {unit} and finite")
    return value
