"""How a component declares its parameters: name, unit, range and meaning. Data only, no physics."""

import math
from dataclasses import dataclass

VALVE_LAG, VALVE_DELAY = "lag of the valve", "dead time of the valve"
PRESSURE_LAG, FORCE_LAG = "lag of the pressure sensors", "lag of the force sensors"
"""What a default may follow."""

NOMINAL = {
    name: f"nominal {name.replace('_', ' ')}"
    for name in (
        "flow",
        "critical_ratio",
        "supply_pressure",
        "dorsiflexion_pressure",
        "atmospheric_pressure",
        "relieving",
        "volume_per_angle",
        "dead_volume_1",
        "dead_volume_2",
        "angle_min",
        "angle_max",
        "pair",
        "opening_delay",
        "closing_delay",
        "switching_interval",
        "lag",
        "dead_band",
        "joining_time",
        "line_droop_1",
        "line_largest_flow_1",
        "line_volume_1",
        "line_droop_2",
        "line_largest_flow_2",
        "line_volume_2",
        "line_relieving",
    )
}
"""What a default may follow of the device itself, for a controller that knows it."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """One parameter of a component; every number is in SI units. ``default`` None means that it must be given.

    What the default ``follows`` is added to it, in a walk: some of those above.
    """

    name: str
    unit: str
    summary: str
    default: float | None = None
    minimum: float = -math.inf
    maximum: float = math.inf
    minimum_allowed: bool = True
    follows: tuple[str, ...] = ()


def range_rule(quantity: Quantity, limits: str) -> str:
    """Return what a value out of range must be, such as "must be at least 0 m^2 (open area)"."""
    return f"must be {limits}" + (f" ({quantity.summary})" if quantity.summary else "")
