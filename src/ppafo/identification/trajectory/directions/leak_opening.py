"""A leak that is tight up to a pressure between the chambers."""

from ppafo.identification.trajectory.directions.kind import TRACE, Direction

DIRECTION = Direction(
    name="leak_opening",
    title="a leak that opens at a pressure",
    seems="the leak seems to open at {size}",
    unless="the leak does not open at a pressure above {size}",
    size_in_words=lambda size: f"{1e-3 * size:.2g} kPa",
    sizes=(1.5e3, 6.0e3, 2.4e4, 6.0e4),
    settings=lambda size, _: {"effects.leak_opening.pressure": size},
    neutral={"effects.leak_opening.pressure": TRACE},
)
