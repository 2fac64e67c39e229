"""One part: who makes it, its figures with their origin, and which figures nobody knows."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import BaseModel, Field

from ppafo.documents.models import STRICT
from ppafo.model.catalog import VALVES
from ppafo.parameters.declaration import ORIFICE

Origin = Literal["published", "datasheet", "quoted", "measured", "derived", "assumed"]
DOUBTFUL: tuple[Origin, ...] = ("quoted", "assumed")
"""Origins that a reader has to look at before buying: from memory of a document, or a guess."""


class Figure(BaseModel):
    """A figure of a part as it was given, in its own unit."""

    model_config = STRICT

    value: Annotated[float, Field(description="the number, in the unit beside it")]
    unit: Annotated[str, Field(description="such as 'mm^2', 'g', 'bar_g'; '' for a number")]
    origin: Annotated[
        Origin,
        Field(
            description="'published' in a paper, read in a 'datasheet', 'quoted' from a document not opened for it, "
            "'measured', 'derived' from other figures, or 'assumed'"
        ),
    ]
    source: Annotated[
        str, Field(min_length=1, description="where to look it up; for an assumed one, the basis of the assumption")
    ]
    note: Annotated[str, Field(description="reason or remark; needed where it is derived or assumed")] = ""


@dataclass(frozen=True, slots=True)
class Part:
    """A part of the catalogue.

    ``kind`` is that of a valve, else an empty text. ``figures`` as written and ``values`` in SI units (pressures
    absolute), by name; ``unknown`` names figures that are known to exist and that nobody could name.
    """

    name: str
    group: str
    kind: str
    maker: str
    model: str
    document: str
    note: str
    figures: Mapping[str, Figure]
    values: Mapping[str, float]
    unknown: tuple[str, ...]

    @property
    def title(self) -> str:
        """Maker and model."""
        return f"{self.maker} {self.model}"

    @property
    def doubtful(self) -> tuple[str, ...]:
        """Names of the figures that are quoted or assumed."""
        return tuple(name for name, figure in self.figures.items() if figure.origin in DOUBTFUL)

    @property
    def full_mass(self) -> float:
        """Mass [kg] of the part as it is carried: of a bottle, with its gas."""
        return self.values["mass"] if "mass" in self.values else self.values["empty_mass"] + self.values["content"]

    @property
    def model_numbers(self) -> dict[str, float]:
        """Numbers of a valve by path, in SI; what its maker does not say is ideal, as the declarations have it."""
        settings = {item.name: item.default for item in VALVES[self.kind].quantities if item.default is not None}
        orifice = {item.name: self.values[item.name] for item in ORIFICE if item.name in self.values}
        own = {name: self.values[name] for name in settings if name in self.values}
        return {f"valve.{name}": number for name, number in (orifice | settings | own).items()}
