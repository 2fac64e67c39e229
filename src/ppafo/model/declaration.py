"""How a component declares its parameters: name, unit, range and meaning. Data only, no physics."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Quantity:
    """One parameter of a component; every number is in SI units. ``default`` None means that it must be given."""

    name: str
    unit: str
    summary: str
    default: float | None = None
    minimum: float = -math.inf
    maximum: float = math.inf
    minimum_allowed: bool = True
