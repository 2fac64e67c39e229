"""How a component declares its parameters: name, unit, range and meaning. Data only, no physics."""

import math
from dataclasses import dataclass

VALVE_LAG, VALVE_DELAY = "lag of the valve", "dead time of the valve"
PRESSURE_LAG, FORCE_LAG = "lag of the pressure sensors", "lag of the force sensors"
"""What a default may follow."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """One parameter of a component; every number is in SI units. ``default`` None means that it must be given.

    What the default ``follows`` is added to it, in a walk: some of the lags above.
    """

    name: str
    unit: str
    summary: str
    default: float | None = None
    minimum: float = -math.inf
    maximum: float = math.inf
    minimum_allowed: bool = True
    follows: tuple[str, ...] = ()
