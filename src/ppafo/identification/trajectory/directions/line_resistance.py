"""Resistance of lines between valve and chambers, in one over the area of the orifice that loses as much."""

from ppafo.identification.trajectory.directions.kind import TRACE, Direction

_WIDE = 1.0e-2
"""Area of a line [m^2] that is no resistance."""

DIRECTION = Direction(
    name="line_resistance",
    title="a narrow line between valve and chambers",
    seems="a line of {size} seems to lie between valve and chambers",
    unless="no line narrower than {size} lies between valve and chambers",
    size_in_words=lambda size: f"{1.0e6 / max(size, TRACE):.2g} mm^2",
    sizes=(5.0e3, 1.5e4, 4.0e4, 1.2e5),
    settings=lambda size, _: {"effects.line_resistance.area": 1.0 / size},
    neutral={"effects.line_resistance.area": _WIDE},
    # The pressure loss grows with the square of the flow over the area.
    growth=2.0,
)
