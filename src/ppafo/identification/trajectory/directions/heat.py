"""Gas with an energy balance, in one over its heat transfer: the isothermal gas of the paper has no resistance."""

from ppafo.identification.trajectory.directions.kind import TRACE, Direction

WALLS = 100.0
"""Area of the walls over the volume [1/m] for which a heat transfer coefficient is said: a chamber of some 50 cm^3."""
_COEFFICIENT = "gas_model.heat_transfer_coefficient"

HEAT = Direction(
    name="heat",
    title="heat between gas and walls",
    seems="the gas seems to warm and cool, with a heat transfer of {size}",
    unless="the heat transfer between gas and walls is not below {size}",
    size_in_words=lambda size: f"{1.0 / max(size, TRACE):.2g} W/(m^2 K) at {WALLS:g} 1/m",
    sizes=(1.0e-5, 5.0e-5, 2.5e-4, 2.0e-3, 1.0 / 60.0),
    settings=lambda size, _: {_COEFFICIENT: 1.0 / size},
    neutral={_COEFFICIENT: 1.0e8},
)
