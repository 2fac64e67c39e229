"""Friction of a seal that the pressure between the chambers presses on, at rest and in motion alike."""

from ppafo.identification.trajectory.directions.kind import TRACE, Direction

_PATHS = "effects.seal_friction.static_per_pressure", "effects.seal_friction.dynamic_per_pressure"

DIRECTION = Direction(
    name="seal_friction",
    title="friction that grows with the pressure between the chambers",
    seems="friction seems to grow with the pressure between the chambers by {size}",
    unless="friction does not grow with the pressure between the chambers by more than {size}",
    size_in_words=lambda size: f"{size:.2g} N m/Pa",
    sizes=(1.0e-8, 4.0e-8, 2.0e-7, 1.0e-6),
    settings=lambda size, _: dict.fromkeys(_PATHS, size),
    neutral=dict.fromkeys(_PATHS, TRACE**2),
)
