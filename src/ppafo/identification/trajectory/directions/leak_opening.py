"""A leak that is tight up to a pressure between the chambers.

How it opens above that pressure is not known beforehand, and moves the fitted area by far more than noise does: a fit
with this effect has a number for that too.
"""

from ppafo.identification.trajectory.directions.kind import TRACE, Direction, Form

_RISE = "effects.leak_opening.rise"

DIRECTION = Direction(
    name="leak_opening",
    title="a leak that opens at a pressure",
    seems="the leak seems to open at {size}",
    unless="the leak does not open at a pressure above {size}",
    size_in_words=lambda size: f"{1e-3 * size:.2g} kPa",
    sizes=(1.5e3, 6.0e3, 2.4e4, 6.0e4),
    settings=lambda size, _: {"effects.leak_opening.pressure": size},
    neutral={"effects.leak_opening.pressure": TRACE, _RISE: 0.3},
    forms=(Form(_RISE, usual=0.3, factor=10.0, low=0.01, high=100.0),),
)
