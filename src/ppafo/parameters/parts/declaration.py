"""Every figure that a part can have: group, name, SI unit, range and meaning."""

from ppafo.model.catalog import VALVES
from ppafo.model.declaration import Quantity
from ppafo.parameters.declaration import ACTUATOR, ORIFICE

MASS = Quantity("mass", "kg", "mass of the part, of both valves for a pair", minimum=0.0, maximum=100.0)
RATING = Quantity(
    "largest_pressure", "Pa_a", "maximum pressure that the part is rated for", minimum=1.0e4, maximum=1.0e8
)
NOMINAL_FLOW = Quantity(
    "nominal_flow", "m^3/s", "flow of air at normal conditions from 6 bar to 5 bar gauge", minimum=0.0, maximum=1.0
)
NOMINAL_DIAMETER = Quantity("nominal_diameter", "m", "diameter of the opening", minimum=0.0, maximum=0.1)
CONTENT = Quantity("content", "kg", "gas in the full bottle", minimum=0.0, maximum=100.0, minimum_allowed=False)
EMPTY_MASS = Quantity("empty_mass", "kg", "mass of the empty bottle with its valve", minimum=0.0, maximum=100.0)

_OF_ACTUATOR = ("torque_constant", "volume_per_angle")

VALVE = (MASS, RATING, NOMINAL_FLOW, NOMINAL_DIAMETER, *ORIFICE)
GROUPS: dict[str, tuple[Quantity, ...]] = {
    "valves": VALVE + tuple(item for kind in VALVES.values() for item in kind.quantities),
    "actuators": (MASS, RATING, *(item for item in ACTUATOR if item.name in _OF_ACTUATOR)),
    "regulators": (MASS, RATING),
    "bottles": (CONTENT, EMPTY_MASS),
}
"""Figures by group; a valve has those of its kind."""

NEEDED: dict[str, tuple[str, ...]] = {
    "valves": ("mass",),
    "actuators": ("mass", *_OF_ACTUATOR),
    "regulators": ("mass",),
    "bottles": ("content", "empty_mass"),
}
"""Figures without which a part is of no use to a study; a valve needs an orifice in one of its two forms besides."""


def figures_of(group: str, kind: str) -> tuple[Quantity, ...]:
    """Return the figures that a part of a group can have; ``kind`` is that of a valve, an empty text for others."""
    return VALVE + VALVES[kind].quantities if group == "valves" else GROUPS[group]
