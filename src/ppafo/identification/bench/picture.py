"""What a procedure has to show, as data in SI units; the drawing is done elsewhere."""

from dataclasses import dataclass
from typing import Literal

from ppafo.signals.recording import Floats

Role = Literal["rising", "falling", "measured", "second", "law", "other law"]
"""How a series looks: crosses, circles, dots in one or another colour, a line, a thin line."""


@dataclass(frozen=True, slots=True)
class Series:
    """Points or a line: values along both axes in the units of the panel; an empty name stays out of the legend."""

    name: str
    x: Floats
    y: Floats
    role: Role


@dataclass(frozen=True, slots=True)
class Panel:
    """One panel: what its axes are, their SI units, and what is drawn."""

    title: str
    x_name: str
    x_unit: str
    y_name: str
    y_unit: str
    series: tuple[Series, ...]
